//! The cost of each unserved AUV, advanced step by step: the truth by which visits are judged, and
//! the basis of comparison rules.
//!
//! The planner has closed forms for whole visits instead.

use planner::snapshot::{Goal, VehicleId, VisitCost, Visits};

use crate::{fault::Behaviour, record::Service, surface_craft::SurfaceCraft, world::World};

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
        Self { visits: visits.clone(), costs: vec![fresh; auvs.len()], ages: vec![0.0; auvs.len()], auvs }
    }

    /// `true` if an AUV is served at this horizontal distance and depth, m.
    pub fn serves(&self, distance: f64, depth: f64) -> bool {
        let reached = match self.visits.cost {
            VisitCost::Age | VisitCost::Uncertainty { .. } => true,
            VisitCost::Data { range_max_m, .. } => depth < range_max_m,
        };
        reached && distance <= self.visits.within_m
    }

    /// Advances the cost of the AUV at `place` by `elapsed` s; `served` is its slant range, m.
    ///
    /// ```text
    /// variance: P⁻ = P + q Δt,  1/P = 1/P⁻ + Δt/(R T) if served: a Kalman filter, one fix a step
    /// backlog:  b + (g − u max(0, 1 − r/r_max)) Δt, at least 0
    /// ```
    pub fn advance(&mut self, place: usize, elapsed: f64, served: Option<f64>) {
        self.ages[place] = served.map_or(self.ages[place] + elapsed, |_| 0.0);
        let cost = &mut self.costs[place];
        *cost = match self.visits.cost {
            VisitCost::Age => self.ages[place],
            VisitCost::Uncertainty { growth_m2ps, .. } => {
                let grown = *cost + growth_m2ps * elapsed;
                served.map_or(grown, |range| {
                    grown / (1.0 + grown * elapsed / fix_noise(&self.visits.cost, range))
                })
            }
            VisitCost::Data { growth_kbps, upload_kbps, range_max_m } => {
                let upload = served.map_or(0.0, |range| upload_kbps * (1.0 - range / range_max_m).max(0.0));
                (*cost + (growth_kbps - upload) * elapsed).max(0.0)
            }
        };
    }
}

/// R T at a slant range, m: variance of a fix times their interval, m² s.
fn fix_noise(cost: &VisitCost, range: f64) -> f64 {
    match *cost {
        VisitCost::Uncertainty { sigma_m, sigma_rad, interval_s, .. } => {
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

    /// Service of the world's AUV number `auv` now; none if it is dead or not of the goal. Call it
    /// for each AUV before [`TrueCosts::end_tick`].
    pub(crate) fn observe(&mut self, world: &World, craft: &SurfaceCraft, auv: usize) -> Option<Service> {
        let (now, is) = (world.time(), &world.auvs[auv]);
        let place = self.costs.auvs.iter().position(|id| *id == is.id)?;
        if world.faults.behaviour(auv, now) == Behaviour::Drifts {
            return None;
        }
        let distance = (is.position() - craft.position()).norm();
        let served = self.costs.serves(distance, is.depth());
        let range = served.then(|| distance.hypot(is.depth()));
        self.costs.advance(place, now - self.then, range);
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
        [(1000, None), (400, Some(30.0))].map(|(seconds, served)| {
            for _ in 0..seconds {
                costs.advance(0, 1.0, served);
            }
            costs.costs[0]
        })
    }

    #[test]
    fn costs_match_their_equations_integrated_in_small_steps() {
        let uncertainty =
            VisitCost::Uncertainty { growth_m2ps: 0.03, sigma_m: 1.5, sigma_rad: 0.02, interval_s: 10.0 };
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
