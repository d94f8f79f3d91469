//! The true goal, computed from the true positions and velocities of the vehicles.

use nalgebra::Vector2;
use planner::{
    angle::{Course, ned_from_body},
    forecast::SPEED_AT_REST,
    smallest_circle::{Below, nearest_to_all},
    snapshot::{Goal, Offset, VehicleId},
};

use crate::{auv::SimulatedAuv, observe::Briefing, surface_craft::SurfaceCraft, world::World};

#[derive(Clone, Debug)]
pub(crate) struct TrueGoal {
    goal: Goal,
    offset: Option<Offset>,
    /// Last course of the followed point.
    course: Course,
}

/// The point that a goal follows, without its offset.
struct GoalPoint<'a> {
    position: Vector2<f64>,
    /// Velocity over ground (north, east), m/s.
    velocity: Vector2<f64>,
    /// The vehicle, if the goal follows one at a time.
    auv: Option<&'a SimulatedAuv>,
}

impl TrueGoal {
    pub(crate) fn new(briefing: &Briefing) -> Self {
        Self::of(briefing.goal.clone(), briefing.offset)
    }

    fn of(goal: Goal, offset: Option<Offset>) -> Self {
        Self { goal, offset, course: Course::new(0.0) }
    }

    /// Follows another goal from now on.
    pub(crate) fn change(&mut self, goal: &Goal) {
        self.goal.clone_from(goal);
    }

    /// Its present position (north, east), m. A goal at rest keeps its course: call in time order.
    ///
    /// A goal that visits is at the vehicle `serves`, or without that at its nearest one.
    pub(crate) fn position(&mut self, world: &World, serves: Option<usize>) -> Vector2<f64> {
        let followed = goal_point(&self.goal, world, serves);
        if SPEED_AT_REST <= followed.velocity.norm() {
            self.course = Course::of(&followed.velocity);
        }
        let by = self.offset.map_or_else(Vector2::zeros, |offset| offset.vector());
        let arm = match self.offset {
            None | Some(Offset::Ned { .. } | Offset::Polar { .. }) => by,
            Some(Offset::Target { .. }) => ned_from_body(self.course.radians()) * by,
            Some(Offset::Path { .. }) => {
                let auv = followed.auv.expect("a start checks that there is one");
                ned_from_body(auv.path.at(auv.gamma).tangent) * by
            }
        };
        followed.position + arm
    }
}

fn goal_point<'a>(goal: &Goal, world: &'a World, serves: Option<usize>) -> GoalPoint<'a> {
    let named = |id: &VehicleId| -> &'a SimulatedAuv {
        let mut auvs = world.auvs.iter();
        auvs.find(|auv| auv.id == *id).expect("a scenario's goal names its own vehicles")
    };
    let one = |auv: &'a SimulatedAuv| GoalPoint {
        position: auv.position(),
        velocity: ground_velocity(auv, world),
        auv: Some(auv),
    };
    match goal {
        Goal::Track { auv } => one(named(auv)),
        Goal::Intermittent { auvs, dwell_s, epoch_s } => {
            one(named(&auvs[in_turn(world.time() - epoch_s, *dwell_s, auvs.len())]))
        }
        Goal::Midpoint { auvs } => mean(world, auvs.iter().map(|id| (named(id), 1.0))),
        Goal::Weighted { weights } => mean(world, weights.iter().map(|(id, weight)| (named(id), *weight))),
        Goal::Localise(localise) => {
            let weighted = |id| (named(id), localise.weight(id));
            mean(world, localise.auvs.iter().map(weighted))
        }
        Goal::Visit(visits) => {
            let served = serves.and_then(|place| world.auvs.get(place));
            one(served.unwrap_or_else(|| nearest(visits.auvs.iter().map(named), world)))
        }
        Goal::Range { auvs, .. } => {
            let auvs: Vec<_> = auvs.iter().map(named).collect();
            let below = auvs.iter().map(|auv| Below { position: auv.position(), depth: auv.depth() });
            let nearest = nearest_to_all(&below.collect::<Vec<_>>());
            GoalPoint { position: nearest.position, ..mean(world, auvs.into_iter().zip(nearest.weights)) }
        }
    }
}

/// The vehicle that is nearest to the surface craft.
fn nearest<'a>(auvs: impl Iterator<Item = &'a SimulatedAuv>, world: &World) -> &'a SimulatedAuv {
    let here = world.surface_craft.as_ref().map(SurfaceCraft::position);
    let distance = |auv: &SimulatedAuv| (auv.position() - here.unwrap_or_default()).norm();
    let nearest = auvs.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.expect("a goal names a vehicle")
}

fn mean<'a>(world: &World, weighted: impl Iterator<Item = (&'a SimulatedAuv, f64)>) -> GoalPoint<'a> {
    let (mut position, mut velocity, mut sum) = (Vector2::zeros(), Vector2::zeros(), 0.0);
    for (auv, weight) in weighted {
        position += auv.position() * weight;
        velocity += ground_velocity(auv, world) * weight;
        sum += weight;
    }
    GoalPoint { position: position / sum, velocity: velocity / sum, auv: None }
}

fn ground_velocity(auv: &SimulatedAuv, world: &World) -> Vector2<f64> {
    let current = world.water.current(&auv.position(), auv.depth());
    auv.ground_track(world.time(), &current).0
}

/// Index, of `n`, of the vehicle to follow `elapsed` s after the epoch of turns of `dwell` s.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "a mission has few dwells, and rem_euclid is never negative"
)]
pub fn in_turn(elapsed: f64, dwell: f64, n: usize) -> usize {
    ((elapsed / dwell).floor() as i64).rem_euclid(n as i64) as usize
}

#[cfg(test)]
mod tests {
    use planner::snapshot::Visits;

    use super::*;
    use crate::{scenario::Scenario, tests::near_to};

    #[test]
    fn an_intermittent_goal_changes_vehicle_exactly_at_the_dwell() {
        let found = [-0.1, 0.0, 239.9, 240.0, 479.9, 480.0].map(|t| in_turn(t, 240.0, 2));
        assert_eq!(found, [1, 0, 0, 1, 1, 0]);
    }

    fn world() -> (World, Vec<VehicleId>) {
        let scenario = Scenario::named("paper-midpoint").expect("exists");
        let world = scenario.start(0).expect("valid").world;
        let ids = world.auvs.iter().map(|auv| auv.id.clone()).collect();
        (world, ids)
    }

    #[test]
    fn a_visiting_goal_is_the_served_or_else_the_nearest_vehicle() {
        let (world, auvs) = world();
        let mut goal = TrueGoal::of(Goal::Visit(Visits::new(auvs)), None);
        for (place, auv) in world.auvs.iter().enumerate() {
            assert_eq!(goal.position(&world, Some(place)), auv.position());
        }
        let here = world.surface_craft.as_ref().expect("there is one").position();
        let distance = (goal.position(&world, None) - here).norm();
        let mut auvs = world.auvs.iter();
        assert!(auvs.all(|auv| distance <= (auv.position() - here).norm()));
    }

    #[test]
    fn means_and_smallest_range_of_two_vehicles_at_the_surface_lie_between_them() {
        let (mut world, auvs) = world();
        for auv in &mut world.auvs {
            auv.state[2] = 0.0;
        }
        let [a, b] = [0, 1].map(|i| world.auvs[i].position());
        let weighted =
            |weights: [f64; 2]| Goal::Weighted { weights: auvs.iter().cloned().zip(weights).collect() };
        let range = Goal::Range { auvs: auvs.clone(), range_m: 100.0 };
        for (goal, share) in [
            (Goal::Midpoint { auvs: auvs.clone() }, 0.5),
            (weighted([3.0, 3.0]), 0.5),
            (range, 0.5),
            (weighted([1.0, 3.0]), 0.75),
        ] {
            let found = TrueGoal::of(goal, None).position(&world, None);
            near_to(found, a.lerp(&b, share), 1e-12);
        }
    }

    #[test]
    fn an_offset_turns_with_its_vehicle_and_keeps_its_direction_at_rest() {
        let (mut world, ids) = world();
        let by = Vector2::new(4.0, -7.0);
        let mut goals = [Offset::ned(by), Offset::target(by), Offset::path(by)].map(|offset| {
            let auv = ids[0].clone();
            TrueGoal::of(Goal::Track { auv }, Some(offset))
        });
        let mut arms = |world: &World| {
            let here = world.auvs[0].position();
            goals.each_mut().map(|goal| goal.position(world, None) - here)
        };
        for _ in 0..3_000 {
            world.step(None);
            let auv = &world.auvs[0];
            let tangent = auv.path.at(auv.gamma).tangent;
            // Still water: the course is the heading.
            for (arm, angle) in arms(&world).into_iter().zip([0.0, auv.heading(), tangent]) {
                near_to(arm, ned_from_body(angle) * by, 1e-9);
            }
        }
        let before = arms(&world);
        (world.auvs[0].state[4], world.auvs[0].state[5]) = (1.0, 0.0);
        assert_eq!(arms(&world), before);
    }
}
