//! A manoeuvre, sailed by a rolled-out craft among the forecast vessels.

use nalgebra::{Rotation2, Vector2};
use smallvec::SmallVec;

use crate::avoid::encounter::SPEED_UNDER_WAY;
use crate::avoid::scene::{Other, STEPS, Scene};
use crate::facts::angle::{starboard_of, wrap};
use crate::facts::traffic::EncounterKind;

/// Least share of its speed that a craft keeps in a turn.
const SPEED_IN_TURN: f64 = 0.3;

/// Time for which a vessel's way ahead of it belongs to it, s.
const AHEAD: f64 = 120.0;

/// Time in a vessel's circle that doubles the price of the depth, s.
const DEPTH_TIME: f64 = 30.0;

/// A heading, from the bow, and a largest speed that are held until a time, s. Without a heading the
/// craft goes for its goal at that speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Leg {
    pub(crate) heading: Option<f64>,
    pub(crate) speed: f64,
    pub(crate) until: f64,
}

/// A leg, and another one if the first does not keep clear of all; then the craft goes for its goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Trial {
    pub(crate) leg: Leg,
    pub(crate) then: Option<Leg>,
    /// Share of the uncertainty of vessels by which they are passed farther off: all of it by a new
    /// manoeuvre, less by the present one, so that noise does not end it.
    pub(crate) doubt: f64,
}

/// How a vessel passes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passing {
    /// Least distance beyond the one to keep, m, and the time of it, s.
    pub(crate) clearance: f64,
    pub(crate) time: f64,
    /// Distance at that time, m.
    pub(crate) distance: f64,
    /// Time at which it first comes too near, s.
    pub(crate) too_near: Option<f64>,
    /// The craft at the least clearance, along the vessel's course and to starboard of it, m.
    pub(crate) place: Vector2<f64>,
    /// `true` if the craft passes on the side that the encounter forbids.
    pub(crate) is_wrong_side: bool,
}

/// Outcome of a trial.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// Cost, m of distance from the goal, and the part of it that is no distance from the goal.
    pub(crate) cost: f64,
    pub(crate) faults: f64,
    pub(crate) passings: SmallVec<[Passing; 16]>,
}

impl Scene<'_> {
    /// Sails `trial`, and shows each place to `see`; none if it costs `least` or more.
    pub(crate) fn sail(
        &self,
        trial: &Trial,
        least: f64,
        mut see: impl FnMut(Vector2<f64>),
    ) -> Option<Outcome> {
        let (dt, tuned) = (self.dt(), &self.tuned);
        let (mut position, mut bow, mut speed) = (Vector2::zeros(), Vector2::new(1.0, 0.0), self.speed_now);
        let mut passings: SmallVec<[Passing; 16]> =
            self.others.iter().map(|other| Passing::begun(other, &position, trial.doubt)).collect();
        let (mut tracking, mut deepest, mut depths) = (0.0, 0.0_f64, 0.0);
        see(position);
        for k in 0..STEPS {
            let (time, before) = (dt * k as f64, position);
            self.step(trial, k, &mut position, &mut bow, &mut speed);
            see(position);
            tracking += (position - self.goal[k + 1].position).norm();
            let mut depth = self.breach(&position);
            for (other, passing) in self.others.iter().zip(&mut passings) {
                passing.step(other, trial.doubt, (time, dt), [&before, &position]);
                let here = (position - other.forecast.at(time + dt)).norm();
                depth = depth.max(other.forecast.radius_of(time + dt, trial.doubt) - here);
            }
            deepest = deepest.max(depth);
            depths += depth.max(0.0) * dt / DEPTH_TIME;
            let wrong = passings.iter().filter(|passing| passing.is_wrong_side).count();
            let faults = tuned.depth_price * (deepest + depths) + tuned.side_price * wrong as f64;
            if least <= tracking / STEPS as f64 + faults {
                return None;
            }
        }
        let between = passings.iter().map(|passing| -passing.clearance).fold(deepest, f64::max);
        let price = |(other, passing): (&Other, &Passing)| {
            let changes = other.side.is_some_and(|side| side * passing.place.y < 0.0);
            let wrong = if passing.is_wrong_side { tuned.side_price } else { 0.0 };
            wrong + if changes { tuned.other_side_price } else { 0.0 }
        };
        let sides: f64 = self.others.iter().zip(&passings).map(price).sum();
        let faults = tuned.depth_price * (between + depths) + sides;
        let cost = tracking / STEPS as f64 + faults;
        (cost < least).then_some(Outcome { cost, faults, passings })
    }

    fn step(
        &self,
        trial: &Trial,
        k: usize,
        position: &mut Vector2<f64>,
        bow: &mut Vector2<f64>,
        speed: &mut f64,
    ) {
        let (dt, limits) = (self.dt(), &self.craft.limits);
        let holds = |leg: &&Leg| dt * (k as f64) < leg.until;
        let leg = [Some(&trial.leg), trial.then.as_ref()].into_iter().flatten().find(holds);
        let most = leg.map_or(limits.speed_max, |leg| leg.speed);
        let wanted = if let Some(heading) = leg.and_then(|leg| leg.heading) {
            Vector2::new(heading.cos(), heading.sin()) * most
        } else {
            let goal = &self.goal[k];
            let off = goal.position - *position;
            // Over long steps no faster than one closes the distance.
            goal.velocity + off * self.tuned.pursuit_rate.min(0.5 / dt) - self.current
        };
        let turn = wrap(bow.perp(&wanted).atan2(bow.dot(&wanted)));
        let turn_most = limits.turn_rate_max * dt;
        *bow = Rotation2::new(turn.clamp(-turn_most, turn_most)) * *bow;
        let left = (turn.abs() - turn_most).max(0.0).cos().max(SPEED_IN_TURN);
        let wanted = (wanted.norm().min(most) * left).max(limits.speed_min);
        let (slower, faster) = (limits.deceleration_max * dt, limits.acceleration_max * dt);
        *speed += (wanted - *speed).clamp(-slower, faster);
        *position += (*bow * *speed + self.current) * dt;
    }

    /// Depth outside the area, within a keep-out or in a no-go area, m; negative if none.
    fn breach(&self, position: &Vector2<f64>) -> f64 {
        let discs = self.discs.iter().map(|(centre, radius)| radius - (position - centre).norm());
        let corners = self.area.iter();
        let sides = corners.clone().zip(corners.cycle().skip(1));
        let edges = sides.map(|(from, to)| -(to - from).normalize().perp(&(position - from)));
        let on_land = self.land.and_then(|(land, here, axes)| land.inside(&(here + axes * position)));
        let depths = discs.chain(edges).chain(on_land.map(|(_, depth)| depth));
        depths.fold(f64::NEG_INFINITY, f64::max)
    }
}

impl Passing {
    fn begun(other: &Other, craft: &Vector2<f64>, doubt: f64) -> Self {
        let distance = (craft - other.forecast.at(0.0)).norm();
        let clearance = distance - other.forecast.radius_of(0.0, doubt);
        Self {
            clearance,
            time: 0.0,
            distance,
            too_near: (clearance < 0.0).then_some(0.0),
            place: other.beside(craft, 0.0, 0.0),
            is_wrong_side: false,
        }
    }

    /// Goes on by the step at `time` that leads the craft from one place to the next.
    fn step(
        &mut self,
        other: &Other,
        doubt: f64,
        (time, dt): (f64, f64),
        [before, after]: [&Vector2<f64>; 2],
    ) {
        let [from, to] = [other.beside(before, time, time), other.beside(after, time + dt, time)];
        // Fast vessels pass between two steps.
        let chord = to - from;
        let length = chord.norm_squared();
        let share = if length > 0.0 { (-from.dot(&chord) / length).clamp(0.0, 1.0) } else { 0.0 };
        let (nearest, at) = (from + chord * share, time + share * dt);
        let clearance = nearest.norm() - other.forecast.radius_of(at, doubt);
        if clearance < self.clearance {
            (self.clearance, self.time) = (clearance, at);
            (self.distance, self.place) = (nearest.norm(), nearest);
        }
        if clearance < 0.0 && self.too_near.is_none() {
            self.too_near = Some(at);
        }
        let speed = other.forecast.velocity_at(time).norm();
        let crosses = from.y * to.y < 0.0;
        let along = if crosses { from.x - from.y * (to.x - from.x) / (to.y - from.y) } else { 0.0 };
        let ahead = 0.0 < along && along < (AHEAD * speed).max(3.0 * other.forecast.radius(at));
        self.is_wrong_side |= match other.kind {
            Some(EncounterKind::CrossingGiveWay | EncounterKind::Overtaking) => crosses && ahead,
            // Abeam of each other, the vessel has the craft on its port side.
            Some(EncounterKind::HeadOn) => to.x < 0.0 && 0.0 <= from.x && 0.0 < to.y,
            _ => false,
        };
    }
}

impl Other {
    /// Place of `craft` from the vessel at `time`, ahead and to starboard along the vessel's course at
    /// the time `of`, m. A vessel at rest counts along the goal's course.
    fn beside(&self, craft: &Vector2<f64>, time: f64, of: f64) -> Vector2<f64> {
        let there = craft - self.forecast.at(time);
        let along = self.forecast.velocity_at(of).try_normalize(SPEED_UNDER_WAY).unwrap_or(self.course);
        Vector2::new(there.dot(&along), there.dot(&starboard_of(along)))
    }
}
