//! The true cost of each unserved AUV, advanced step by step: the basis of scores and rules.
//!
//! The planner has closed forms for whole visits instead.

use nalgebra::{Matrix2, Vector2};
use planner::snapshot::{Fixes, Goal, VehicleId, VisitCost, Visits};

use crate::{fault::Behaviour, record::Service, world::World};

/// The costs of the AUVs of a goal, in its order, without those of weight 0.
#[derive(Clone, Debug)]
pub struct Costs {
    /// The goal.
    pub visits: Visits,
    /// The AUVs.
    pub auvs: Vec<VehicleId>,
    /// The cost of each, in the unit of the goal's cost.
    pub costs: Vec<f64>,
    /// Time since each was served, s.
    pub ages: Vec<f64>,
    /// Covariance of each one's own navigation, m², where ranges reduce the cost.
    covariances: Vec<Matrix2<f64>>,
}

/// Place of an AUV that is served, seen from the craft: (north, east) and depth, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServedAt {
    /// Horizontal displacement.
    pub off: Vector2<f64>,
    /// Depth.
    pub depth: f64,
}

impl ServedAt {
    /// Slant range, m.
    fn range(&self) -> f64 {
        self.off.norm().hypot(self.depth)
    }
}

impl Costs {
    /// Costs after a long service at the surface.
    pub fn new(visits: &Visits) -> Self {
        let goal = Goal::Visit(visits.clone());
        let auvs: Vec<_> = goal.vehicles().cloned().collect();
        let fresh = match visits.cost {
            VisitCost::Age | VisitCost::Data { .. } => 0.0,
            VisitCost::Uncertainty { growth_m2ps, .. } => (growth_m2ps * fix_noise(&visits.cost, 0.0)).sqrt(),
        };
        Self {
            visits: visits.clone(),
            costs: vec![fresh; auvs.len()],
            ages: vec![0.0; auvs.len()],
            covariances: vec![Matrix2::identity() * fresh; auvs.len()],
            auvs,
        }
    }

    /// `true` if an AUV is served at this horizontal distance and depth, m.
    pub fn serves(&self, distance: f64, depth: f64) -> bool {
        let reached = match self.visits.cost {
            VisitCost::Age | VisitCost::Uncertainty { .. } => true,
            VisitCost::Data { range_max_m, .. } => depth < range_max_m,
        };
        reached && distance <= self.visits.within()
    }

    /// Advances the cost of the AUV at `place` by `elapsed` s; `served` if it is.
    ///
    /// ```text
    /// variance: P⁻ = P + q Δt,  1/P = 1/P⁻ + Δt/(R T) if served: a Kalman filter, one fix a step
    /// ranges:   P⁻ = P + q Δt I,  P⁻¹ + h hᵀ Δt/(σ² T) with h = d/r: half the trace counts
    /// backlog:  b + (g − u max(0, 1 − r/r_max)) Δt, at least 0
    /// ```
    pub fn advance(&mut self, place: usize, elapsed: f64, served: Option<ServedAt>) {
        self.ages[place] = served.map_or(self.ages[place] + elapsed, |_| 0.0);
        let cost = &mut self.costs[place];
        *cost = match self.visits.cost {
            VisitCost::Age => self.ages[place],
            VisitCost::Uncertainty { fixes: Fixes::Range, growth_m2ps, sigma_m, interval_s, .. } => {
                let covariance = &mut self.covariances[place];
                *covariance += Matrix2::identity() * (growth_m2ps * elapsed);
                if let Some(from) = served.filter(|from| 0.0 < elapsed && 0.0 < from.range()) {
                    let slope = from.off / from.range();
                    let seen = *covariance * slope;
                    let noise = sigma_m.powi(2) * interval_s / elapsed;
                    *covariance -= seen * seen.transpose() / (slope.dot(&seen) + noise);
                }
                0.5 * covariance.trace()
            }
            VisitCost::Uncertainty { fixes: Fixes::Usbl, growth_m2ps, .. } => {
                let grown = *cost + growth_m2ps * elapsed;
                served.map_or(grown, |from| {
                    grown / (1.0 + grown * elapsed / fix_noise(&self.visits.cost, from.range()))
                })
            }
            VisitCost::Data { growth_kbps, upload_kbps, range_max_m } => {
                let rate = |from: ServedAt| upload_kbps * (1.0 - from.range() / range_max_m).max(0.0);
                let upload = served.map_or(0.0, rate);
                (*cost + (growth_kbps - upload) * elapsed).max(0.0)
            }
        };
    }
}

/// R T at a slant range, m: variance of a fix times interval, m² s; of ranges twice, on an arc.
fn fix_noise(cost: &VisitCost, range: f64) -> f64 {
    match *cost {
        VisitCost::Uncertainty { fixes: Fixes::Range, sigma_m, interval_s, .. } => {
            2.0 * sigma_m.powi(2) * interval_s
        }
        VisitCost::Uncertainty { fixes: Fixes::Usbl, sigma_m, sigma_rad, interval_s, .. } => {
            (sigma_m.powi(2) + (sigma_rad * range).powi(2)) * interval_s
        }
        VisitCost::Age | VisitCost::Data { .. } => 0.0,
    }
}

/// The true costs of a mission whose goal visits.
#[derive(Clone, Debug)]
pub(crate) struct TrueCosts {
    costs: Costs,
    /// Weight of each over the mean weight.
    relative: Vec<f64>,
    /// `true`: first served in time; `false`: late; none before either.
    in_time: Vec<Option<bool>>,
    /// Time of the last tick, s.
    then: f64,
}

impl TrueCosts {
    /// None if the goal does not visit.
    pub(crate) fn new(goal: &Goal) -> Option<Self> {
        let Goal::Visit(visits) = goal else { return None };
        let costs = Costs::new(visits);
        let weights: Vec<f64> = costs.auvs.iter().map(|id| visits.weight(id)).collect();
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        Some(Self {
            relative: weights.iter().map(|weight| weight / mean).collect(),
            in_time: vec![None; costs.auvs.len()],
            costs,
            then: 0.0,
        })
    }

    /// Service of the world's AUV number `auv` now by the nearest `craft`, by their positions; none if
    /// it is dead or not of the goal. Call it for each AUV before [`TrueCosts::end_tick`].
    pub(crate) fn observe(&mut self, world: &World, craft: &[Vector2<f64>], auv: usize) -> Option<Service> {
        let (now, is) = (world.time(), &world.auvs[auv]);
        let place = self.costs.auvs.iter().position(|id| *id == is.id)?;
        if world.faults.behaviour(auv, now) == Behaviour::Drifts {
            return None;
        }
        let depth = is.depth();
        let off = craft.iter().map(|craft| is.position() - craft);
        let nearest = off.min_by(|a, b| a.norm().total_cmp(&b.norm()));
        let served_at = nearest.filter(|off| self.costs.serves(off.norm(), depth));
        self.costs.advance(place, now - self.then, served_at.map(|off| ServedAt { off, depth }));
        let served = served_at.is_some();
        let due = self.costs.visits.serve_by_s.get(&is.id);
        let in_time = &mut self.in_time[place];
        let late = due.is_some_and(|due| *due < now);
        if in_time.is_none() && (served || late) {
            *in_time = Some(!late);
        }
        Some(Service {
            cost: self.relative[place] * self.costs.costs[place],
            served,
            late: *in_time == Some(false),
        })
    }

    /// Ends a tick, in which [`TrueCosts::observe`] was called for all AUVs.
    pub(crate) fn end_tick(&mut self, world: &World) {
        self.then = world.time();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::near;

    fn costs(cost: VisitCost) -> Costs {
        Costs::new(&Visits { cost, ..Visits::new(vec![VehicleId("a".to_owned())]) })
    }

    /// Costs after 1000 s away, and 400 s later at a slant range of 30 m, by steps of a second.
    fn visited(cost: VisitCost) -> [f64; 2] {
        let mut costs = costs(cost);
        let there = ServedAt { off: Vector2::new(0.0, 0.0), depth: 30.0 };
        [(1000, None), (400, Some(there))].map(|(seconds, served)| {
            for _ in 0..seconds {
                costs.advance(0, 1.0, served);
            }
            costs.costs[0]
        })
    }

    #[test]
    fn costs_match_their_equations_integrated_in_small_steps() {
        let uncertainty = VisitCost::Uncertainty {
            fixes: Fixes::Usbl,
            growth_m2ps: 0.03,
            sigma_m: 1.5,
            sigma_rad: 0.02,
            interval_s: 10.0,
        };
        let [before, after] = visited(uncertainty);
        near(before, (0.03_f64 * 22.5).sqrt() + 30.0, 1e-9);
        // dP/dt = q − P²/(R T), R = 1.5² + (0.02 · 30)², by Euler's rule with steps of 1 ms.
        let noise = (2.25 + 0.36) * 10.0;
        let step = |p, _| p + 1e-3 * (0.03 - p * p / noise);
        // Fixes once a second and continuous ones differ by half a second's growth at most.
        near(after, (0..400_000).fold(before, step), 0.03);
        // 500 kbit fall at 3 · 0.9 − 0.5 = 2.2 kbit/s and are gone after 228 s.
        assert_eq!(visited(data(300.0)), [500.0, 0.0]);
        assert_eq!(visited(VisitCost::Age), [1000.0, 0.0]);
    }

    #[test]
    fn ranges_from_one_side_leave_the_other_axis_unknown_and_from_above_both() {
        let cost = |fixes| VisitCost::Uncertainty {
            fixes,
            growth_m2ps: 0.03,
            sigma_m: 1.5,
            sigma_rad: 0.02,
            interval_s: 10.0,
        };
        let after = |off: fn(f64) -> Vector2<f64>| {
            let mut costs = costs(cost(Fixes::Range));
            costs.advance(0, 1000.0, None);
            for second in 0..200 {
                costs.advance(0, 1.0, Some(ServedAt { off: off(f64::from(second)), depth: 20.0 }));
            }
            costs.costs[0]
        };
        let [above, beside, around] = [
            |_| Vector2::zeros(),
            |_| Vector2::new(30.0, 0.0),
            |time: f64| planner::angle::direction(time / 25.0) * 30.0,
        ]
        .map(after);
        // √(q σ² T) along one axis with every range, 31.2 + 6 m² along the other.
        near(above, (0.03_f64 * 45.0).sqrt() + 36.0, 1e-9);
        assert!((0.5..0.55).contains(&(beside / above)), "{beside}");
        near(around, (0.03_f64 * 45.0 / 0.69).sqrt(), 0.15);
    }

    fn data(range_max_m: f64) -> VisitCost {
        VisitCost::Data { growth_kbps: 0.5, upload_kbps: 3.0, range_max_m }
    }

    #[test]
    fn a_vehicle_below_the_upload_range_is_not_served() {
        let costs = costs(data(100.0));
        let served =
            [(20.0, 99.0), (20.0, 100.0), (20.1, 5.0)].map(|(near, slant)| costs.serves(near, slant));
        assert_eq!(served, [true, false, false]);
    }
}
