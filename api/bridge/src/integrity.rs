//! Checks of the craft's navigation, by comparing each measurement with others and the possible.
//!
//! [`Integrity`] admits measurements one by one, before the craft's state takes them; [`Alarm`]
//! names contradictions. The table in `docs/at-sea.md#doubts` has the report and the effect of each
//! check, and the text below it the rate of false alarms.
//!
//! - Sources ([`Sources`]): the autopilot's wire comes first, then `--nmea` in order. A lower one
//!   is used after 2 s of silence, until the better one has returned for 5 s. Unused sources are
//!   compared with the used one.
//! - Jumps ([`Track`]): an innovation outside its gate is a miss. Misses that agree for 3 s, while
//!   nothing agrees with the prediction, are the new truth. If both continue, the measurement is
//!   contested.
//! - Consistency: positions against the integral of the velocity, a heading against the turns of
//!   rate and course ([`Turns`]), frozen positions against velocity and references.

mod sources;
mod track;
mod turns;

use std::collections::BTreeSet;

use nalgebra::Vector2;
use planner::angle::{angle_of, wrap};

pub(crate) use self::sources::Source;

use self::sources::Sources;
use self::track::{Fit, Track};
use self::turns::Turns;
use crate::{
    CraftMeasurement, Origin, Rejects,
    recent_positions::{RecentPositions, moved},
    reference::Reference,
};

/// Fastest surface craft, even carried by a ship, m/s.
const SPEED_MAX: f64 = 20.0;
/// Fastest yaw rate of a surface craft, rad/s, as in the API.
const YAW_RATE_MAX: f64 = 3.0;
/// Gate of a position, m, and its growth, m/s: five standard deviations of a receiver of 3 m.
const POSITION_GATE: [f64; 2] = [15.0, 5.0];
/// Gate of a heading, rad, and its growth, rad/s: without and with a measured yaw rate.
const HEADING_GATE: [f64; 2] = [0.5, 1.5];
const HEADING_GATE_BY_RATE: [f64; 2] = [0.5, 0.2];
/// Gate of a velocity, m/s, and its growth, m/s²: waves and the quickest craft.
const VELOCITY_GATE: [f64; 2] = [2.0, 3.0];
/// Distance of two sources' positions that is a contradiction, m, and its growth, m/s.
const POSITIONS_APART: [f64; 2] = [30.0, 10.0];
/// The same for headings: rad, rad/s. Two compasses differ by 10° on small craft without a fault.
const HEADINGS_APART: [f64; 2] = [0.35, 1.0];
/// Distance between velocity's and positions' travel that is a contradiction, m, its growth, m/s,
/// and the shortest time, s.
const MISMATCH: [f64; 2] = [8.0, 0.3];
const MISMATCH_AFTER_S: f64 = 5.0;
/// Time for which they must contradict, s: one position alone may be as far off.
const MISMATCH_FOR_S: f64 = 2.0;
/// Growth of the distance between positions and integrated velocity that is a drift, m/s, and its
/// increase per m/s, as receivers' velocities lag; least standard deviations, if these were known;
/// least time, s.
const DRIFT: [f64; 2] = [0.35, 0.05];
const DRIFT_SIGMAS: f64 = 5.0;
const DRIFT_AFTER_S: f64 = 10.0;
/// A position within this distance, m, stays: less than noise and waves move any receiver.
const STILL_M: f64 = 0.1;
/// Time for which noise may keep positions or headings near each other, s.
const STILL_MIN_S: f64 = 3.0;
const STEADY_MIN_S: f64 = 5.0;
/// Travel by the velocity, m, at this speed or faster, m/s, that contradicts a frozen position.
/// Receivers report up to 0.2 m/s at rest.
const FROZEN_TRAVEL_M: f64 = 5.7;
const FROZEN_SPEED: f64 = 0.3;
/// Travel by references, m, and time without way, s, that contradict a frozen position.
const REQUESTED_M: f64 = 10.0;
const REQUESTED_S: f64 = 30.0;
/// A heading within this angle, rad, stays: less than any craft under way yaws.
const HEADING_STILL: f64 = 0.005;
/// Turn by yaw rate in [`TURN_WINDOW_S`] that is real, rad: twice what the bias of a gyro makes.
const TURN_BY_RATE: f64 = 0.8;
const TURN_WINDOW_S: f64 = 20.0;
/// Yaw rates farther apart than this, s, belong to different turns.
const RATE_GAP_MAX_S: f64 = 1.0;
/// Change of course, rad, at this speed or faster, m/s, that shows a turning craft.
const TURN_BY_COURSE: f64 = 1.0;
const COURSE_SPEED: f64 = 0.7;
/// Angle between course and heading, rad, and time, s. Cross current of half the speed makes 0.5.
const COURSE_OFF: f64 = 0.9;
const COURSE_OFF_FOR_S: f64 = 10.0;
/// Time without further evidence after which a frozen position or heading is trusted again, s.
const LATCH_S: f64 = 60.0;
/// Time for which a jump is shown, s.
const JUMP_SHOWN_S: f64 = 10.0;
/// Greatest age of a value that predicts, s.
const FRESH_S: f64 = 2.0;

/// A contradiction in the navigation, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub(crate) enum Alarm {
    /// Positions at two places alternately, or at a new one each time.
    #[error("the position jumps between places: two receivers, or two vehicles with one system number")]
    PositionJumps,
    #[error(
        "the position does not change although measured or reference speed is not zero: receiver frozen, or no thrust"
    )]
    PositionFrozen,
    #[error("the heading jumps: two compasses, or two vehicles with one system number")]
    HeadingJumps,
    /// The heading stays while yaw rate or course show that the craft turns.
    #[error("the heading stays while the craft turns: compass frozen")]
    HeadingFrozen,
    #[error("the position jumped: the new position is used")]
    PositionJumped,
    #[error(
        "the position does not change although the reference speed is not zero: check thrust and receiver"
    )]
    NoWay,
    #[error("two sources of the position differ: check the receivers")]
    PositionsDiffer,
    #[error("two sources of the heading differ: check the compasses")]
    HeadingsDiffer,
    #[error("the velocity contradicts the positions: those count")]
    VelocityContradicts,
    #[error("positions and velocity drift apart: check the receiver; the positions count")]
    PositionDrifts,
    #[error("the heading jumped: the new heading is used; check the compass")]
    HeadingJumped,
    /// The heading turns otherwise than the yaw rate, or opposite to the course.
    #[error(
        "the heading turns otherwise than the craft: yaw mirrored or compass off, or a current faster than the craft"
    )]
    HeadingContradicts,
    #[error("the course is far off the heading: compass off, strong current, or astern")]
    CourseOffHeading,
}

impl Alarm {
    /// `true` for alarms without a trustworthy state: nothing is sent.
    pub(crate) fn stops(self) -> bool {
        self <= Self::HeadingFrozen
    }
}

/// The checks with their memory. Times are s on one clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct Integrity {
    positions: Sources<Origin>,
    headings: Sources<f64>,
    velocities: Sources<()>,
    water_velocities: Sources<()>,
    yaw_rates: Sources<()>,
    position_track: Track<Origin>,
    heading_track: Track<f64>,
    velocity_track: Track<Vector2<f64>>,
    yaw_rate: Option<(f64, f64)>,
    pub(crate) recent: RecentPositions,
    /// Time since which velocity and positions contradict each other, s.
    apart_since_s: Option<f64>,
    stationary: Option<StationaryPosition>,
    constant: Option<ConstantHeading>,
    turns: Turns,
    /// Integral of the yaw rate, rad, and its greatest error from changes between measurements.
    turned: f64,
    turned_error: f64,
    /// Time of the last contradiction of the heading by rate or course, s.
    contradicted_s: Option<f64>,
    /// Time of the last contradiction of a frozen position or heading, s.
    position_frozen_s: Option<f64>,
    heading_frozen_s: Option<f64>,
    jumped_s: Option<f64>,
    heading_jumped_s: Option<f64>,
    /// Time since which the course has been far off the heading, s.
    off_course_s: Option<f64>,
    alarms: BTreeSet<Alarm>,
    pub(crate) rejects: Rejects,
}

#[derive(Clone, Copy, Debug)]
struct StationaryPosition {
    since_s: f64,
    position: Origin,
    /// Integral of the velocity at the start (north, east), m.
    travelled: Vector2<f64>,
    /// Travel that references have requested since, m.
    requested: f64,
}

#[derive(Clone, Copy, Debug)]
struct ConstantHeading {
    began_s: f64,
    /// Start of the window of `turned`.
    since_s: f64,
    heading: f64,
    /// Integral of the yaw rate at the start, rad.
    turned: f64,
    /// Course at the start of way, rad.
    course: Option<f64>,
}

impl Integrity {
    /// `true` if the state may use the measurement of `source` at `t_s`.
    pub(crate) fn admits(&mut self, t_s: f64, source: Source, measured: &CraftMeasurement) -> bool {
        match *measured {
            CraftMeasurement::Position(position) => self.admits_position(t_s, source, position),
            CraftMeasurement::Heading(heading) => self.admits_heading(t_s, source, heading),
            CraftMeasurement::GroundVelocity(velocity) => {
                self.may_move(velocity.norm()) && self.velocities.uses_any(t_s, source)
            }
            CraftMeasurement::GroundSpeed(speed) => {
                self.may_move(speed) && self.velocities.uses_any(t_s, source)
            }
            CraftMeasurement::WaterVelocity(velocity) => {
                self.may_move(velocity.norm()) && self.water_velocities.uses_any(t_s, source)
            }
            CraftMeasurement::YawRate(rate) => {
                let is_possible = self.is_possible(rate, YAW_RATE_MAX, "turns faster than a surface craft");
                let is_used = is_possible && self.yaw_rates.uses_any(t_s, source);
                // A gyroscope never reads 0 always, which stands for a rate that nothing measures.
                if is_used && (rate != 0.0 || self.yaw_rate.is_some()) {
                    self.turn(t_s, rate);
                }
                is_used
            }
        }
    }

    /// `true` if the state may use an admitted velocity over ground (north, east), m/s: it has not
    /// jumped and agrees with the positions.
    pub(crate) fn admits_velocity(&mut self, t_s: f64, velocity: Vector2<f64>) -> bool {
        let fit = self
            .velocity_track
            .take(t_s, velocity, |(at, before)| (velocity - before).norm() <= gate(VELOCITY_GATE, t_s - at));
        if fit == Fit::Missed {
            self.rejects.count("velocity jumps");
            return false;
        }
        self.recent.travel(t_s, velocity);
        !self.alarms.contains(&Alarm::VelocityContradicts)
    }

    /// Records that a reference was sent and followed for `seconds`.
    pub(crate) fn sent(&mut self, reference: &Reference, seconds: f64) {
        if let Some(stationary) = &mut self.stationary {
            stationary.requested += reference.speed * seconds;
        }
    }

    /// The present contradictions, the worst first.
    pub(crate) fn alarms(&self) -> impl Iterator<Item = Alarm> {
        self.alarms.iter().copied()
    }

    fn may_move(&mut self, speed: f64) -> bool {
        self.is_possible(speed, SPEED_MAX, "faster than a surface craft")
    }

    fn is_possible(&mut self, value: f64, most: f64, otherwise: &'static str) -> bool {
        let is_possible = value.abs() <= most;
        self.rejects.add(otherwise, u64::from(!is_possible));
        is_possible
    }

    /// The trusted velocity over ground (north, east) near `t_s`, m/s.
    fn velocity(&self, t_s: f64) -> Option<Vector2<f64>> {
        let (at, velocity) = self.velocity_track.trusted?;
        ((t_s - at).abs() <= FRESH_S).then_some(velocity)
    }

    /// The limit of `alarm`, which ends well inside its gate.
    fn limit(&self, alarm: Alarm, gate: f64) -> f64 {
        let is_raised = self.alarms.contains(&alarm);
        if is_raised { 0.5 * gate } else { gate }
    }

    fn set(&mut self, alarm: Alarm, is_raised: bool) {
        if is_raised {
            self.alarms.insert(alarm);
        } else {
            self.alarms.remove(&alarm);
        }
    }

    fn admits_position(&mut self, t_s: f64, source: Source, position: Origin) -> bool {
        let is_used = self.positions.uses(t_s, source, position, |here, there, age| {
            moved(here, there).norm() > gate(POSITIONS_APART, age)
        });
        self.set(Alarm::PositionsDiffer, self.positions.differ());
        if !is_used {
            return false;
        }
        let velocity = self.velocity(t_s).unwrap_or_default();
        let fit = self.position_track.take(t_s, position, |(at, before)| {
            let elapsed = t_s - at;
            (moved(before, &position) - velocity * elapsed).norm() <= gate(POSITION_GATE, elapsed)
        });
        if fit == Fit::Jumped {
            self.jumped_s = Some(t_s);
            self.recent.clear();
            self.stationary = None;
        }
        self.set(Alarm::PositionJumps, self.position_track.is_contested(t_s));
        self.set(Alarm::PositionJumped, is_recent(self.jumped_s, t_s, JUMP_SHOWN_S));
        if fit == Fit::Missed {
            self.rejects.count("position jumps");
            return false;
        }
        if self.recent.push(t_s, position) {
            self.compare_drift();
        }
        self.compare_with_velocity(t_s);
        self.compare_stationary(t_s, position);
        true
    }

    /// Compares the drift of positions from the integral of the velocity with its limit.
    fn compare_drift(&mut self) {
        if let Some(drift) = self.recent.drift().filter(|drift| drift.span_s >= DRIFT_AFTER_S) {
            let velocity = self.velocity_track.trusted;
            let speed = velocity.map_or(0.0, |(_, velocity)| velocity.norm());
            let most = gate(DRIFT, speed).max(drift.slope_beyond(DRIFT_SIGMAS));
            let is_apart = drift.slope.norm() > self.limit(Alarm::PositionDrifts, most);
            let is_raised = is_apart && !self.alarms.contains(&Alarm::VelocityContradicts);
            self.set(Alarm::PositionDrifts, is_raised);
        }
    }

    /// Compares positions with the integral of the velocity.
    fn compare_with_velocity(&mut self, t_s: f64) {
        // What is no longer measured contradicts nothing.
        if !self.recent.has_velocity() {
            self.apart_since_s = None;
            return self.set(Alarm::VelocityContradicts, false);
        }
        let mismatch = self.recent.mismatch();
        let Some((span, apart)) = mismatch.filter(|(span, _)| *span >= MISMATCH_AFTER_S) else {
            return;
        };
        let is_apart = apart > self.limit(Alarm::VelocityContradicts, gate(MISMATCH, span));
        let mut is_raised = is_apart;
        if !self.alarms.contains(&Alarm::VelocityContradicts) {
            let since_s = self.apart_since_s.unwrap_or(t_s);
            self.apart_since_s = is_apart.then_some(since_s);
            is_raised &= t_s - since_s >= MISMATCH_FOR_S;
        }
        self.set(Alarm::VelocityContradicts, is_raised);
    }

    /// Compares a position that stays with velocity and references.
    fn compare_stationary(&mut self, t_s: f64, position: Origin) {
        let travelled = self.recent.travelled;
        let start = StationaryPosition { since_s: t_s, position, travelled, requested: 0.0 };
        let stationary = *self.stationary.get_or_insert(start);
        let mut has_no_way = false;
        if moved(&stationary.position, &position).norm() > STILL_M {
            self.stationary = Some(start);
            if self.position_frozen_s.take().is_some() {
                // The kept positions show no motion.
                self.recent.clear();
            }
        } else {
            let time = t_s - stationary.since_s;
            let travel = (travelled - stationary.travelled).norm();
            let has_pace = |by: f64| by >= FROZEN_SPEED * time;
            let is_way = |by: f64, least: f64| by >= least && has_pace(by);
            let is_requested = is_way(stationary.requested, REQUESTED_M);
            has_no_way = is_requested;
            let is_frozen =
                is_way(travel, FROZEN_TRAVEL_M) && time >= STILL_MIN_S || is_requested && time >= REQUESTED_S;
            if is_frozen {
                self.position_frozen_s = Some(t_s);
            }
            // The next evidence must be new. At rest there is none: receivers freeze at berths too.
            if is_frozen || !has_pace(travel) && !has_pace(stationary.requested) {
                let position = stationary.position;
                self.stationary = Some(StationaryPosition { position, ..start });
            }
        }
        let is_frozen = is_recent(self.position_frozen_s, t_s, LATCH_S);
        self.set(Alarm::PositionFrozen, is_frozen);
        self.set(Alarm::NoWay, has_no_way && !is_frozen);
    }

    fn admits_heading(&mut self, t_s: f64, source: Source, heading: f64) -> bool {
        let is_used = self.headings.uses(t_s, source, heading, |here, there, age| {
            wrap(here - there).abs() > gate(HEADINGS_APART, age)
        });
        self.set(Alarm::HeadingsDiffer, self.headings.differ());
        if !is_used {
            return false;
        }
        let rate = self.yaw_rate.filter(|(at, _)| (t_s - at).abs() <= FRESH_S);
        let (rate, heading_gate) = rate.map_or((0.0, HEADING_GATE), |(_, rate)| (rate, HEADING_GATE_BY_RATE));
        let fit = self.heading_track.take(t_s, heading, |(at, before)| {
            let elapsed = t_s - at;
            wrap(heading - before - rate * elapsed).abs() <= gate(heading_gate, elapsed)
        });
        if fit == Fit::Jumped {
            self.heading_jumped_s = Some(t_s);
        }
        self.set(Alarm::HeadingJumps, self.heading_track.is_contested(t_s));
        let has_jumped = is_recent(self.heading_jumped_s, t_s, JUMP_SHOWN_S);
        self.set(Alarm::HeadingJumped, has_jumped);
        if fit == Fit::Missed {
            self.rejects.count("heading jumps");
            return false;
        }
        let measured = self.yaw_rate.filter(|(at, _)| (t_s - at).abs() <= RATE_GAP_MAX_S);
        let turned = measured.map(|_| [self.turned, self.turned_error]);
        let is_kept = self.turns.push(t_s, heading, turned, self.recent.travelled);
        self.compare_constant(t_s, heading);
        self.compare_with_course(t_s, heading);
        if is_kept {
            self.compare_turns(t_s);
        }
        true
    }

    /// Compares the turns of the heading with those of rate and course.
    fn compare_turns(&mut self, t_s: f64) {
        let is_moving = !self.alarms.contains(&Alarm::VelocityContradicts);
        if self.turns.contradict_rate() || is_moving && self.turns.contradict_course() {
            self.contradicted_s = Some(t_s);
        }
        let is_recent = is_recent(self.contradicted_s, t_s, JUMP_SHOWN_S);
        let is_raised = is_recent && !self.alarms.contains(&Alarm::HeadingFrozen);
        self.set(Alarm::HeadingContradicts, is_raised);
    }

    fn compare_with_course(&mut self, t_s: f64, heading: f64) {
        let off = course(self.velocity(t_s)).map(|course| wrap(course - heading).abs());
        let since_s = self.off_course_s.unwrap_or(t_s);
        self.off_course_s = off.filter(|off| *off >= COURSE_OFF).map(|_| since_s);
        let is_off = self.off_course_s.is_some() && t_s - since_s >= COURSE_OFF_FOR_S;
        self.set(Alarm::CourseOffHeading, is_off);
    }

    /// Compares a heading that stays with yaw rate and course.
    fn compare_constant(&mut self, t_s: f64, heading: f64) {
        let start =
            ConstantHeading { began_s: t_s, since_s: t_s, heading, turned: self.turned, course: None };
        let constant = self.constant.get_or_insert(start);
        if wrap(heading - constant.heading).abs() > HEADING_STILL {
            *constant = start;
            self.heading_frozen_s = None;
        } else {
            let course = course(self.recent.velocity());
            constant.course = course.and_then(|course| constant.course.or(Some(course)));
            let both = course.zip(constant.course);
            let changed = both.map_or(0.0, |(now, then)| wrap(now - then));
            let is_turned = (self.turned - constant.turned).abs() >= TURN_BY_RATE
                || changed.abs() >= TURN_BY_COURSE
                || self.turns.swing_since(constant.began_s);
            let time = t_s - constant.since_s;
            if is_turned && time >= STEADY_MIN_S {
                self.heading_frozen_s = Some(t_s);
                *constant = start;
            } else if time > TURN_WINDOW_S {
                (constant.since_s, constant.turned) = (t_s, self.turned);
            }
        }
        let is_frozen = is_recent(self.heading_frozen_s, t_s, LATCH_S);
        self.set(Alarm::HeadingFrozen, is_frozen);
    }

    fn turn(&mut self, t_s: f64, rate: f64) {
        if let Some((before_s, before)) = self.yaw_rate {
            let elapsed = (t_s - before_s).clamp(0.0, RATE_GAP_MAX_S);
            self.turned += 0.5 * (before + rate) * elapsed;
            self.turned_error += 0.5 * (rate - before).abs() * elapsed;
        }
        self.yaw_rate = Some((t_s, rate));
    }
}

/// `true` at `t_s` from the event of `at_s` on, for `within_s`, s.
fn is_recent(at_s: Option<f64>, t_s: f64, within_s: f64) -> bool {
    at_s.is_some_and(|at_s| t_s - at_s <= within_s)
}

/// The course of a craft that makes way, rad.
fn course(velocity: Option<Vector2<f64>>) -> Option<f64> {
    let velocity = velocity.filter(|velocity| velocity.norm() >= COURSE_SPEED);
    velocity.map(|velocity| angle_of(&velocity))
}

/// A gate that widens with the elapsed time, s.
fn gate([at_once, per_second]: [f64; 2], elapsed: f64) -> f64 {
    at_once + per_second * elapsed.abs()
}

#[cfg(test)]
mod tests;
