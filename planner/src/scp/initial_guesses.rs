//! Initial guesses: trajectories about which the first SCP iteration is linearised. A convex
//! subproblem finds the best trajectory on the guess's side of a disc or turn only.

use std::cell::Cell;

use crate::coast::land::Land;
use crate::craft::response::{Rollout, Stage, Surge};
use crate::facts::angle::{Heading, angle_of, wrap};
use crate::facts::asc::AscNow;
use crate::facts::path::curve::Side;
use crate::facts::reference::Reference;
use crate::los::saturated::saturated_los;
use crate::predict::motion::{Motion, target_course};
use crate::problem::horizon::Horizon;
use crate::scp::detours::{Wall, add, clear_course};

/// Bearing error beyond which both sides of a turn are tried, rad: 115°.
const TURN_TO_EITHER_SIDE: f64 = 2.0;

/// Distance from the goal below which a craft steers by its motion, m: a look-ahead distance.
const NEAR: f64 = 10.0;

/// Longest prediction of the goal's motion for steering, s.
const LEAD_MAX: f64 = 60.0;

/// Least turn to the wrong side that is tried, rad.
const TURN_WORTH_FORCING: f64 = 0.5;

/// Rate of turn of a loiter, rad/s: a circle of 0.33 m in 42 s at a MEDUSA's least speed.
const LOITER_RATE: f64 = 0.15;

/// Most new guesses: each costs two SCP iterations.
const GUESSES_MAX: usize = 4;

impl Horizon<'_> {
    /// Guesses without an earlier plan; `los` is the line-of-sight law's trajectory.
    ///
    /// In order: the way round no-go areas, both sides of a wall, of a turn or circle, line of
    /// sight, straight to the goal's end; each that crosses a disc becomes two that pass it.
    pub(crate) fn guesses_without_plan(&self, los: &[Stage]) -> Vec<Vec<Stage>> {
        let discs = &self.constraints.discs;
        let direct = self.direct();
        let mut guesses = Vec::new();
        if self.forecast.is_by_way() {
            guesses.push(self.on_the_way());
        }
        if Wall::is_across(discs, los) || Wall::is_across(discs, &direct) {
            guesses.extend(Side::BOTH.map(|side| self.around_walls(side)));
        }
        if self.is_hemmed_in() {
            guesses.extend(Side::BOTH.map(|side| self.turning_slowly(side).1.stages));
        } else if self.turns_to_either_side(los) {
            for side in Side::BOTH {
                add(discs, self.turning(side), &mut guesses);
            }
        } else if self.loiters() {
            for side in Side::BOTH {
                add(discs, self.loitering(side), &mut guesses);
            }
        }
        add(discs, los.to_vec(), &mut guesses);
        add(discs, direct, &mut guesses);
        guesses.truncate(GUESSES_MAX);
        guesses
    }

    /// Guesses besides an earlier plan's trajectory that does not circle, if the goal is at rest.
    pub(crate) fn guesses_beside_plan(&self, earlier: &[Stage]) -> Vec<Vec<Stage>> {
        let directions = || Horizon::directions_of(earlier);
        let turned: f64 = directions()
            .zip(directions().skip(1))
            .map(|(from, to)| wrap(angle_of(&to) - angle_of(&from)))
            .sum();
        if self.loiters() && turned.abs() < std::f64::consts::FRAC_PI_2 {
            Side::BOTH.map(|side| self.loitering(side)).into()
        } else {
            Vec::new()
        }
    }

    /// As the goal moves.
    fn on_the_way(&self) -> Vec<Stage> {
        let stage = |goal: &Motion| Stage { position: goal.position, velocity: goal.velocity - self.current };
        std::iter::once(self.start).chain(self.goal[1..].iter().map(stage)).collect()
    }

    fn turns_to_either_side(&self, los: &[Stage]) -> bool {
        let to_goal = self.goal[0].position;
        let bearing_error = if to_goal.norm() > NEAR {
            angle_of(&to_goal)
        } else {
            // The law's final direction.
            angle_of(&los[los.len() - 1].velocity)
        };
        TURN_TO_EITHER_SIDE < bearing_error.abs()
    }

    /// `true` if the goal is near and slower through the water than the craft's least speed.
    fn loiters(&self) -> bool {
        let goal = &self.goal[0];
        let through_water = goal.velocity - self.current;
        goal.position.norm() < NEAR && through_water.norm() < self.snapshot.limits().speed_min
    }

    /// At full speed for the goal, with the turn to that side, then by line of sight.
    fn turning(&self, side: Side) -> Vec<Stage> {
        let speed_max = self.snapshot.limits().speed_max;
        self.guess(|_, target, asc, los| {
            let reference = for_the_goal(target, asc, los, speed_max);
            let turn = wrap(reference.heading.radians() - asc.heading.radians());
            if turn * side.sign() < -TURN_WORTH_FORCING {
                let aside = asc.heading.radians() + side.sign() * std::f64::consts::FRAC_PI_2;
                return Reference { heading: Heading::new(aside), ..reference };
            }
            reference
        })
    }

    /// `true` if land is nearer than the widest turn, so that the craft may have to turn slowly.
    pub(crate) fn is_hemmed_in(&self) -> bool {
        let limits = &self.craft.limits;
        let turn = 2.0 * limits.speed_max / limits.turn_rate_max;
        let near = |land: &Land| land.sides.nearest(&self.snapshot.asc.position(), turn, |_| true).is_some();
        self.forecast.is_by_way() && self.land_near().is_some_and(near)
    }

    /// Least speed with a turn to that side, then line of sight: first reference and trajectory.
    pub(crate) fn turning_slowly(&self, side: Side) -> (Reference, Rollout) {
        let (speed_min, first) = (self.snapshot.limits().speed_min, Cell::new(None));
        let rollout = self.rolled(|_, target, asc, los| {
            let way = target.velocity.try_normalize(f64::EPSILON);
            let course = way.map_or(los.heading.radians(), |way| angle_of(&way));
            let turn = wrap(course - asc.heading.radians());
            let aside = asc.heading.radians() + side.sign() * std::f64::consts::FRAC_PI_2;
            let reference = if turn.abs() < TURN_WORTH_FORCING {
                los
            } else {
                let heading = if turn * side.sign() < 0.0 { aside } else { course };
                Reference { speed: speed_min, heading: Heading::new(heading) }
            };
            first.set(first.get().or(Some(reference)));
            reference
        });
        (first.get().expect("a horizon has an interval"), rollout)
    }

    /// At full speed along the outline of any wall before the goal, then for the goal.
    fn around_walls(&self, side: Side) -> Vec<Stage> {
        let speed_max = self.snapshot.limits().speed_max;
        let discs = &self.constraints.discs;
        self.guess(|time, target, asc, los| {
            let stage = self.times.partition_point(|begun| *begun <= time) - 1;
            match clear_course(discs, stage, &asc.position, &target.position, side) {
                None => for_the_goal(target, asc, los, speed_max),
                Some(course) => Reference { speed: speed_max, heading: Heading::new(course) },
            }
        })
    }

    /// Straight to the goal at the end of the horizon, which line of sight never tries.
    fn direct(&self) -> Vec<Stage> {
        let duration = self.times[self.times.len() - 1];
        let end = self.goal[self.goal.len() - 1].position;
        let limits = &self.snapshot.limits();
        let law = |time: f64, asc: &AscNow, _: Surge| {
            let to_end = end - asc.position;
            let left = (duration - time).max(1.0);
            let through_water = to_end / left - self.current;
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
        self.roll_out(self.snapshot.craft_model(), law).stages
    }

    /// Slowly around a resting goal.
    fn loitering(&self, side: Side) -> Vec<Stage> {
        let speed_min = self.snapshot.limits().speed_min;
        self.guess(|_, _, asc, _| Reference {
            speed: speed_min,
            heading: Heading::new(asc.heading.radians() + side.sign() * LOITER_RATE),
        })
    }

    fn guess(&self, law: impl Fn(f64, &Motion, &AscNow, Reference) -> Reference) -> Vec<Stage> {
        self.rolled(law).stages
    }

    /// The trajectory of a `law` that knows the goal's motion and its line of sight.
    fn rolled(&self, law: impl Fn(f64, &Motion, &AscNow, Reference) -> Reference) -> Rollout {
        let mut held = self.local_goal_course();
        let limits = &self.snapshot.limits();
        let law = |time: f64, asc: &AscNow, _: Surge| {
            let target = self.frame.motion(&self.forecast.at(time));
            held = target_course(&target, Some(held));
            let los = saturated_los(asc, &target, held, self.parameters.los, limits);
            law(time, &target, asc, los)
        };
        self.roll_out(self.snapshot.craft_model(), law)
    }
}

/// At full speed to the goal's predicted position; near it, by line of sight.
fn for_the_goal(goal: &Motion, asc: &AscNow, los: Reference, speed_max: f64) -> Reference {
    let to_goal = goal.position - asc.position;
    if to_goal.norm() < NEAR {
        return los;
    }
    let lead = (to_goal.norm() / speed_max).min(LEAD_MAX);
    Reference { speed: speed_max, heading: Heading::new(angle_of(&(to_goal + goal.velocity * lead))) }
}
