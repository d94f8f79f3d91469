//! What each craft of a fleet plans for: its AUVs, among the other craft as vessels.

use nalgebra::Vector2;

use crate::choose::answer::Plan;
use crate::facts::auv::{Auv, VehicleId};
use crate::facts::fleet::Assignment;
use crate::facts::localise::Figure;
use crate::facts::ranges::VESSEL_PLAN_LENGTH;
use crate::facts::traffic::Vessel;
use crate::fleet::members::Fleet;
use crate::predict::goal::forecast_all;
use crate::snapshot::build::Snapshot;

/// Time for which a spare craft is said to stay where it is, s: the longest manoeuvre.
const STAYS: f64 = 300.0;

impl Fleet {
    /// The number of craft.
    pub fn n_craft(&self) -> usize {
        self.ids.len()
    }

    /// What is known to each craft, in the order of way.
    pub fn snapshots(&self) -> &[Snapshot] {
        &self.snapshots
    }

    /// Plans for every craft by `assignment`, in the order of way: each of its [`Self::next`].
    /// `plan` also gets the number of plans that are left.
    pub fn plans<P: AsRef<Plan>>(
        &self,
        assignment: &Assignment,
        mut plan: impl FnMut(Snapshot, usize) -> P,
    ) -> Vec<P> {
        let mut plans = Vec::with_capacity(self.n_craft());
        for left in (1..=self.n_craft()).rev() {
            plans.push(plan(self.next(assignment, &plans), left));
        }
        plans
    }

    /// What the craft after those of `plans` plans for, among them and the spare ones as vessels.
    pub fn next(&self, assignment: &Assignment, plans: &[impl AsRef<Plan>]) -> Snapshot {
        let mut ahead = self.at_rest(assignment);
        for (craft, plan) in plans.iter().enumerate() {
            if ahead.iter().all(|vessel| vessel.id != self.ids[craft]) {
                ahead.push(self.as_vessel(craft, plan.as_ref()));
            }
        }
        self.snapshot(plans.len(), assignment, &ahead)
    }

    /// The spare craft as vessels that stay where they are, or go straight on if they are away.
    fn at_rest(&self, assignment: &Assignment) -> Vec<Vessel> {
        let spare = (0..self.n_craft()).filter(|craft| assignment.serves(*craft).next().is_none());
        let at_rest = spare.map(|craft| {
            let snapshot = &self.snapshots[craft];
            let (asc, now) = (&snapshot.asc, snapshot.t_s);
            // Without way on it drifts with the current.
            let end = asc.position() + snapshot.current() * STAYS;
            let stays = (snapshot.current(), vec![[now + STAYS, end.x, end.y]]);
            let (velocity, plan) = if self.is_away[craft] { (self.velocity(craft), vec![]) } else { stays };
            Vessel::of_craft(self.ids[craft].clone(), now, asc.position(), velocity, plan)
        });
        at_rest.collect()
    }

    fn velocity(&self, craft: usize) -> Vector2<f64> {
        let snapshot = &self.snapshots[craft];
        let asc = &snapshot.asc;
        asc.ground_velocity().unwrap_or_else(|| asc.water_velocity() + snapshot.current())
    }

    /// What a craft, by index, plans for by `assignment` among the vessels `ahead` of it.
    pub fn snapshot(&self, craft: usize, assignment: &Assignment, ahead: &[Vessel]) -> Snapshot {
        let snapshot = &self.snapshots[craft];
        let served: Vec<_> = assignment.serves(craft).collect();
        let goal = snapshot.goal.goal.only(|id| served.contains(&id));
        let others = (0..self.n_craft()).filter(|other| *other != craft);
        let of_others = others.flat_map(|other| assignment.serves(other));
        let of_others = of_others.filter(|id| !served.contains(id)).cloned().collect();
        let others = ahead.iter().filter(|vessel| vessel.id != self.ids[craft]);
        let least_radius = self.least_radius(assignment, craft);
        snapshot.part(goal, others.cloned(), of_others, least_radius)
    }

    /// The vessel with its `plan` that the craft after this one, an index, see.
    fn as_vessel(&self, craft: usize, plan: &Plan) -> Vessel {
        let snapshot = &self.snapshots[craft];
        let asc = &snapshot.asc;
        let most = *VESSEL_PLAN_LENGTH.end() / if plan.figure.is_some() { 2 } else { 1 };
        let step = plan.trajectory.len().div_ceil(most).max(1);
        let points = plan.trajectory.iter().skip(step).step_by(step);
        let mut points: Vec<_> = points.map(|at| [at.t_s, at.north_m, at.east_m]).collect();
        // A craft on a figure goes on with it: others would dodge one that goes straight on.
        if let (Some(figure), Some(last)) = (&plan.figure, points.last()) {
            let ends = last[0] - snapshot.t_s;
            let mean = self.mean_of(figure);
            points.extend((1..=most).map(|i| {
                let ahead = ends + (STAYS - ends).max(1.0) * i as f64 / most as f64;
                let at = mean(ahead) + figure.at(ahead).0;
                [snapshot.t_s + ahead, at.x, at.y]
            }));
        }
        Vessel::of_craft(self.ids[craft].clone(), snapshot.t_s, asc.position(), self.velocity(craft), points)
    }

    /// `true` for the AUVs that the answer to a craft, by index, tells of and remembers: those that
    /// it serves, and in that to the first craft those that nobody serves.
    pub fn tells_of(craft: usize, assignment: &Assignment, id: &VehicleId) -> bool {
        let serves = |craft: usize| assignment.serves(craft).any(|served| served == id);
        serves(craft) || craft == 0 && !(0..assignment.craft.len()).any(serves)
    }

    /// Where the mean of the vehicles of a figure is after a time, s.
    fn mean_of(&self, figure: &Figure) -> impl Fn(f64) -> Vector2<f64> + use<> {
        let leading = &self.snapshots[0];
        let weight = |id: &VehicleId| leading.goal.goal.weight(id);
        let of = |forecast, auv: &Auv| (forecast, weight(&auv.id));
        let all = forecast_all(leading).into_iter().zip(&leading.auvs);
        let is_of = |auv: &Auv| figure.vehicles.iter().any(|vehicle| vehicle.auv == auv.id);
        let auvs: Vec<_> =
            all.filter(|(_, auv)| is_of(auv)).map(|(forecast, auv)| of(forecast, auv)).collect();
        let sum: f64 = auvs.iter().map(|(_, weight)| weight).sum();
        move |ahead| auvs.iter().map(|(forecast, weight)| forecast.at(ahead).position * (weight / sum)).sum()
    }
}
