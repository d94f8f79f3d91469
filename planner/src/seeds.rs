//! Ways to linearise the first pass about: a convex program finds the best way on its side of a disc or of a turn,
//! and no other.

mod around;

use std::ops::Range;

use around::Wall;

use crate::{
    angle::{Heading, angle_of, wrap},
    forecast::Motion,
    goal::GoalForecast,
    horizon::Horizon,
    los::{AscNow, Reference, saturated_los, target_course},
    policy::Policy,
    response::{Rollout, Stage, Surge},
    snapshot::{Limits, Snapshot},
    ways::Ways,
};

/// Bearing error beyond which it is open to which side to turn, rad: 115°.
const TURN_TO_EITHER_SIDE: f64 = 2.0;

/// Nearer than this to its goal, a craft steers by its motion and not by its bearing, m: a look-ahead distance.
const NEAR: f64 = 10.0;

/// Longest time over which a goal's motion is led when it is steered for, s.
const LEAD_MAX: f64 = 60.0;

/// A turn to the wrong side of less than this is not worth forcing, rad.
const TURN_WORTH_FORCING: f64 = 0.5;

/// Rate of turn of a loiter, rad/s: a circle of 0.33 m at the least speed of the MEDUSA class, once in 42 s.
const LOITER_RATE: f64 = 0.15;

/// Most ways that are tried anew: each costs two passes.
const WAYS_MAX: usize = 4;

/// The side of a turn or of a disc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Starboard,
    Port,
}

impl Side {
    /// Starboard first: of two ways that are as good, it is taken.
    const BOTH: [Self; 2] = [Self::Starboard, Self::Port];

    fn sign(self) -> f64 {
        match self {
            Self::Starboard => 1.0,
            Self::Port => -1.0,
        }
    }
}

/// What the ways are sought for, and where they are written.
pub(crate) struct Seeds<'a> {
    pub(crate) snapshot: &'a Snapshot,
    pub(crate) policy: &'a Policy,
    pub(crate) horizon: &'a Horizon,
    pub(crate) goal: &'a GoalForecast,
    pub(crate) ways: &'a mut Ways,
    /// What a way is rolled out in.
    pub(crate) rollout: &'a mut Rollout,
}

impl Seeds<'_> {
    /// Ways to begin with when nothing is known of an earlier plan, `los` being the line-of-sight law's.
    pub(crate) fn anew(&mut self, los: &[Stage]) -> Range<usize> {
        let first = self.ways.count();
        let discs = &self.horizon.surroundings.discs;
        self.direct();
        if Wall::is_across(discs, los) || Wall::is_across(discs, &self.rollout.stages) {
            for side in Side::BOTH {
                self.around_walls(side);
                self.ways.add(self.rollout.stages.iter().copied());
            }
        }
        if self.turns_to_either_side(los) {
            for side in Side::BOTH {
                self.turning(side);
                around::add(discs, &self.rollout.stages, self.ways);
            }
        } else if self.loiters() {
            for side in Side::BOTH {
                self.loitering(side);
                around::add(discs, &self.rollout.stages, self.ways);
            }
        }
        around::add(discs, los, self.ways);
        self.direct();
        around::add(discs, &self.rollout.stages, self.ways);
        self.ways.at_most(WAYS_MAX, first)
    }

    /// Ways to try beside an earlier plan's that does not circle, when the goal stands still.
    pub(crate) fn beside(&mut self, earlier: usize) -> Range<usize> {
        let first = self.ways.count();
        let directions = || Horizon::directions_of(&self.ways[earlier]);
        let turned: f64 = directions()
            .zip(directions().skip(1))
            .map(|(from, to)| wrap(angle_of(&to) - angle_of(&from)))
            .sum();
        if self.loiters() && turned.abs() < std::f64::consts::FRAC_PI_2 {
            for side in Side::BOTH {
                self.loitering(side);
                self.ways.add(self.rollout.stages.iter().copied());
            }
        }
        first..self.ways.count()
    }

    fn turns_to_either_side(&self, los: &[Stage]) -> bool {
        let to_goal = self.horizon.goal[0].position;
        let bearing_error = if to_goal.norm() > NEAR {
            angle_of(&to_goal)
        } else {
            // Where the law has turned the craft to in the end.
            angle_of(&los[los.len() - 1].velocity)
        };
        TURN_TO_EITHER_SIDE < bearing_error.abs()
    }

    fn loiters(&self) -> bool {
        loiters(self.horizon, &self.snapshot.limits)
    }

    /// At full speed for the goal, turning to that side however far it is, then as line of sight says.
    fn turning(&mut self, side: Side) {
        let speed_max = self.snapshot.limits.speed_max;
        self.roll_out(|_, target, asc, los| {
            let reference = for_the_goal(target, asc, los, speed_max);
            let turn = wrap(reference.heading.radians() - asc.heading.radians());
            if turn * side.sign() < -TURN_WORTH_FORCING {
                let aside = asc.heading.radians() + side.sign() * std::f64::consts::FRAC_PI_2;
                return Reference {
                    heading: Heading::new(aside),
                    ..reference
                };
            }
            reference
        });
    }

    /// At full speed along the outline of whatever wall hides the goal, then for the goal.
    fn around_walls(&mut self, side: Side) {
        let (horizon, speed_max) = (self.horizon, self.snapshot.limits.speed_max);
        let discs = &horizon.surroundings.discs;
        self.roll_out(|time, target, asc, los| {
            let stage = horizon.times.partition_point(|begun| *begun <= time) - 1;
            match around::clear_course(discs, stage, &asc.position, &target.position, side) {
                None => for_the_goal(target, asc, los, speed_max),
                Some(course) => Reference {
                    speed: speed_max,
                    heading: Heading::new(course),
                },
            }
        });
    }

    /// Straight to where the goal is at the end of the horizon, to be there then: what line of sight, which is
    /// astern of a goal that hands over, never tries.
    fn direct(&mut self) {
        let horizon = self.horizon;
        let duration = horizon.times[horizon.times.len() - 1];
        let end = horizon.goal[horizon.goal.len() - 1].position;
        let limits = &self.snapshot.limits;
        let law = |time: f64, asc: &AscNow, _: Surge| {
            let to_end = end - asc.position;
            let left = (duration - time).max(1.0);
            let through_water = to_end / left - horizon.current;
            let speed = through_water.norm();
            Reference {
                speed: speed.clamp(limits.speed_min, limits.speed_max),
                heading: if speed < f64::EPSILON {
                    asc.heading
                } else {
                    Heading::new(angle_of(&through_water))
                },
            }
        };
        horizon.roll_out(self.snapshot.craft_model(), self.policy, law, self.rollout);
    }

    /// Slowly around a goal that stands still.
    fn loitering(&mut self, side: Side) {
        let speed_min = self.snapshot.limits.speed_min;
        self.roll_out(|_, _, asc, _| Reference {
            speed: speed_min,
            heading: Heading::new(asc.heading.radians() + side.sign() * LOITER_RATE),
        });
    }

    fn roll_out(&mut self, law: impl Fn(f64, &Motion, &AscNow, Reference) -> Reference) {
        let horizon = self.horizon;
        let mut held = horizon.local_goal_course();
        let limits = &self.snapshot.limits;
        let law = |time: f64, asc: &AscNow, _: Surge| {
            let target = horizon.local(&self.goal.at(time));
            held = target_course(&target, Some(held));
            let los = saturated_los(asc, &target, held, self.policy.los, limits);
            law(time, &target, asc, los)
        };
        horizon.roll_out(self.snapshot.craft_model(), self.policy, law, self.rollout);
    }
}

/// At full speed to where the goal will be; near it, as line of sight says.
fn for_the_goal(goal: &Motion, asc: &AscNow, los: Reference, speed_max: f64) -> Reference {
    let to_goal = goal.position - asc.position;
    if to_goal.norm() < NEAR {
        return los;
    }
    let lead = (to_goal.norm() / speed_max).min(LEAD_MAX);
    Reference {
        speed: speed_max,
        heading: Heading::new(angle_of(&(to_goal + goal.velocity * lead))),
    }
}

/// Whether the goal is near and slower through the water than the craft can go.
fn loiters(horizon: &Horizon, limits: &Limits) -> bool {
    let goal = &horizon.goal[0];
    let through_water = goal.velocity - horizon.current;
    goal.position.norm() < NEAR && through_water.norm() < limits.speed_min
}
