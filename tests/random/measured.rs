//! Goals by which the craft measures or visits AUVs, and what earlier ranges left.

use std::collections::BTreeMap;

use planner::snapshot::{Asc, Auv, Fixes, Goal, Localise, Ranging, Reduce, VehicleId, VisitCost, Visits};
use rand::RngExt;

use super::Draw;

impl Draw {
    /// A goal that localises or visits some of `auvs`, in three tenths of the snapshots.
    pub(super) fn measured_goal(&mut self, auvs: &[Auv], time: f64) -> Option<Goal> {
        let kind = Some(self.rng.random_range(0..20)).filter(|kind| *kind < 6)?;
        let n = 1 + self.rng.random_range(0..auvs.len());
        let named: Vec<_> = auvs.iter().take(n).map(|auv| auv.id.clone()).collect();
        let weights = self.of_some(&named, (0.1, 10.0), (1.0e-6, 1.0e6));
        let costs_now = self.of_some(&named, (1.0, 400.0), (0.0, 1.0e12));
        let reduce = [Reduce::Mean, Reduce::Max][usize::from(self.chance(0.5))];
        if kind < 3 {
            return Some(Goal::Localise(Localise {
                auvs: named,
                fixes: self.fixes(),
                growth_m2ps: self.number((0.01, 0.1), (1.0e-6, 1.0e6)),
                sigma_m: self.number((0.5, 3.0), (0.001, 1.0e5)),
                sigma_rad: self.number((0.01, 0.05), (0.0, 1.0)),
                interval_s: self.number((5.0, 30.0), (0.1, 3600.0)),
                stand_off_m: self.number((0.0, 30.0), (0.0, 1.0e3)),
                weights,
                reduce,
                costs_now,
            }));
        }
        let serve_by_s = self.of_some(&named, (time, time + 1000.0), (-1.0e11, 1.0e11));
        let visits = Visits {
            next: self.chance(0.3).then(|| named[0].clone()),
            cost: self.visit_cost(kind),
            within_m: self.chance(0.5).then(|| self.number((5.0, 60.0), (1.0, 5.0e3))),
            dwell_min_s: self.chance(0.5).then(|| self.number((10.0, 120.0), (0.0, 3600.0))),
            weights,
            serve_by_s,
            reduce,
            costs_now,
            ..Visits::new(named)
        };
        // As if it had been read, which fills in what is left out.
        let (within_m, dwell_min_s) = (Some(visits.within()), Some(visits.dwell_min()));
        Some(Goal::Visit(Visits { within_m, dwell_min_s, ..visits }))
    }

    fn visit_cost(&mut self, kind: i32) -> VisitCost {
        match kind {
            3 => VisitCost::Age,
            4 => VisitCost::Data {
                growth_kbps: self.number((0.1, 1.0), (0.0, 1.0e6)),
                upload_kbps: self.number((1.0, 10.0), (0.001, 1.0e6)),
                range_max_m: self.number((50.0, 500.0), (1.0, 2.0e4)),
            },
            _ => VisitCost::Uncertainty {
                fixes: self.fixes(),
                growth_m2ps: self.number((0.01, 0.1), (1.0e-6, 1.0e6)),
                sigma_m: self.number((0.5, 3.0), (0.001, 1.0e5)),
                sigma_rad: self.number((0.01, 0.05), (0.0, 1.0)),
                interval_s: self.number((5.0, 30.0), (0.1, 3600.0)),
            },
        }
    }

    fn fixes(&mut self) -> Fixes {
        [Fixes::Range, Fixes::Usbl][usize::from(self.chance(0.5))]
    }

    /// Numbers of none of the vehicles, or of each with a chance of a half.
    fn of_some(
        &mut self,
        named: &[VehicleId],
        usual: (f64, f64),
        accepted: (f64, f64),
    ) -> BTreeMap<VehicleId, f64> {
        let any = self.chance(0.5);
        let mut drawn = BTreeMap::new();
        for id in named {
            if any && self.chance(0.5) {
                drawn.insert(id.clone(), self.number(usual, accepted));
            }
        }
        drawn
    }

    /// What a client may send as the memory of ranges: it fits no reports.
    pub(super) fn ranging(&mut self, asc: &Asc, t_s: f64) -> Option<Ranging> {
        let n = Some(self.rng.random_range(0..8)).filter(|n| *n < 5)?;
        let mut row = |k: usize| {
            let place = self.place(asc.position(), 100.0);
            let mut row = [0.0; 23];
            row[..3].copy_from_slice(&[1.0 / n as f64, f64::from(u8::from(1 < k)), (k % 2) as f64]);
            row[3..5].copy_from_slice(place.as_slice());
            row[5..].fill_with(|| self.number((-3.0, 3.0), (-1.0e9, 1.0e9)));
            row
        };
        let gaussians = (0..n).map(&mut row).collect();
        Some(Ranging {
            t_s: t_s - self.number((0.0, 30.0), (-1.0e9, 1.0e9)),
            fingerprint: self.number((0.0, 1.0e15), (-1.0e18, 1.0e18)),
            added: self.number((0.0, 32.0), (-1.0e3, 1.0e3)),
            inflation_m: self.number((0.0, 5.0), (-1.0, 1.0e6)),
            refused: (0..n).map(|k| t_s - 10.0 * k as f64).collect(),
            gaussians,
        })
    }
}
