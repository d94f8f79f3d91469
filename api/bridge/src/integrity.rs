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

use std::{collections::BTreeSet, fmt};

use nalgebra::Vector2;

pub(crate) use self::sources::Source;

use self::{
    sources::Sources,
    track::{Fit, Track},
    turns::Turns,
};
use crate::{
    CraftMeasurement, Geographic, Rejects,
    recent_positions::{RecentPositions, moved},
    reference::{Reference, wrapped},
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
/// increase per m/s, as receivers' velocities lag; least standard deviations; least time, s.
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
const ASKED_M: f64 = 10.0;
const ASKED_S: f64 = 30.0;
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

/// A contradiction in the navigation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Alarm {
    /// Positions at two places alternately, or at a new one each time.
    PositionJumps,
    /// The position stays while velocity or references show that the craft moves.
    PositionFrozen,
    /// Alternating headings of two values.
    HeadingJumps,
    /// The heading stays while yaw rate or course show that the craft turns.
    HeadingFrozen,
    /// The position jumped and stays there.
    PositionJumped,
    /// The position stays while references ask for way.
    NoWay,
    /// Two sources of the position differ.
    PositionsDiffer,
    /// Two sources of the heading differ.
    HeadingsDiffer,
    /// The measured velocity contradicts the positions.
    VelocityContradicts,
    /// Positions and measured velocity slowly diverge.
    PositionDrifts,
    /// The heading jumped and stays there.
    HeadingJumped,
    /// The heading turns otherwise than the yaw rate, or opposite to the course.
    HeadingContradicts,
    CourseOffHeading,
}

impl Alarm {
    /// `true` for alarms without a trustworthy state: nothing is sent.
    pub(crate) fn stops(self) -> bool {
        match self {
            Self::PositionJumps | Self::PositionFrozen | Self::HeadingJumps | Self::HeadingFrozen => true,
            Self::PositionJumped
            | Self::NoWay
            | Self::PositionsDiffer
            | Self::HeadingsDiffer
            | Self::VelocityContradicts
            | Self::PositionDrifts
            | Self::HeadingJumped
            | Self::HeadingContradicts
            | Self::CourseOffHeading => false,
        }
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PositionJumps => {
                "the position jumps between places: two receivers, or two vehicles with one system number"
            }
            Self::PositionFrozen => {
                "the position does not change although measured or reference speed is not zero: receiver frozen, or no thrust"
            }
            Self::NoWay => "the position does not change although the reference speed is not zero: check thrust and receiver",
            Self::HeadingJumps => "the heading jumps: two compasses, or two vehicles with one system number",
            Self::HeadingFrozen => "the heading stays while the craft turns: compass frozen",
            Self::PositionJumped => "the position jumped: the new position is used",
            Self::PositionsDiffer => "two sources of the position differ: check the receivers",
            Self::HeadingsDiffer => "two sources of the heading differ: check the compasses",
            Self::VelocityContradicts => "the velocity contradicts the positions: those count",
            Self::PositionDrifts => "positions and velocity drift apart: check the receiver; the positions count",
            Self::HeadingContradicts => {
                "the heading turns otherwise than the craft: yaw mirrored or compass off, or a current faster than the craft"
            }
            Self::HeadingJumped => "the heading jumped: the new heading is used; check the compass",
            Self::CourseOffHeading => {
                "the course is far off the heading: compass off, strong current, or astern"
            }
        })
    }
}

/// The checks with their memory. Times are s on one clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct Integrity {
    positions: Sources<Geographic>,
    headings: Sources<f64>,
    velocities: Sources<()>,
    water_velocities: Sources<()>,
    yaw_rates: Sources<()>,
    place: Track<Geographic>,
    bow: Track<f64>,
    motion: Track<Vector2<f64>>,
    yaw_rate: Option<(f64, f64)>,
    recent: RecentPositions,
    /// Time since which velocity and positions contradict each other, s.
    apart_since_s: Option<f64>,
    still: Option<Still>,
    steady: Option<Steady>,
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
    rejects: Rejects,
}

/// A position that has not moved.
#[derive(Clone, Copy, Debug)]
struct Still {
    since_s: f64,
    place: Geographic,
    /// Integral of the velocity at the start (north, east), m.
    travelled: Vector2<f64>,
    /// Travel that references have requested since, m.
    asked: f64,
}

/// A heading that has not changed.
#[derive(Clone, Copy, Debug)]
struct Steady {
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
        match measured {
            CraftMeasurement::Position(position) => self.admits_position(t_s, source, *position),
            CraftMeasurement::Heading(heading) => self.admits_heading(t_s, source, *heading),
            CraftMeasurement::GroundVelocity(velocity) => {
                self.may_move(velocity.norm()) && self.velocities.uses_any(t_s, source)
            }
            CraftMeasurement::GroundSpeed(speed) => {
                self.may_move(*speed) && self.velocities.uses_any(t_s, source)
            }
            CraftMeasurement::WaterVelocity(velocity) => {
                self.may_move(velocity.norm()) && self.water_velocities.uses_any(t_s, source)
            }
            CraftMeasurement::YawRate(rate) => {
                let is_possible = rate.abs() <= YAW_RATE_MAX;
                self.count_unless(is_possible, "turns faster than a surface craft");
                let is_used = is_possible && self.yaw_rates.uses_any(t_s, source);
                if is_used {
                    self.turn(t_s, *rate);
                }
                is_used
            }
        }
    }

    /// `true` if the state may use an admitted velocity over ground (north, east), m/s: it has not
    /// jumped and agrees with the positions.
    pub(crate) fn admits_velocity(&mut self, t_s: f64, velocity: Vector2<f64>) -> bool {
        let fit = self.motion.take(t_s, velocity, |(at, before)| {
            (velocity - before).norm() <= gate(VELOCITY_GATE, t_s - at)
        });
        if fit == Fit::Missed {
            self.rejects.count("velocity jumps");
            return false;
        }
        self.recent.travel(t_s, velocity);
        !self.alarms.contains(&Alarm::VelocityContradicts)
    }

    /// Marks the newest velocity as a guess, which contradicts nothing.
    pub(crate) fn velocity_is_unknown(&mut self) {
        self.recent.travel_unmeasured();
    }

    /// Records that a reference was sent and followed for `seconds`.
    pub(crate) fn sent(&mut self, reference: &Reference, seconds: f64) {
        if let Some(still) = &mut self.still {
            still.asked += reference.speed * seconds;
        }
    }

    /// The present contradictions, the worst first.
    pub(crate) fn alarms(&self) -> impl Iterator<Item = Alarm> {
        self.alarms.iter().copied()
    }

    pub(crate) fn rejects(&self) -> &Rejects {
        &self.rejects
    }

    pub(crate) fn recent(&self) -> &RecentPositions {
        &self.recent
    }

    /// `true` for speeds that a surface craft can reach, m/s.
    fn may_move(&mut self, speed: f64) -> bool {
        let is_possible = speed.abs() <= SPEED_MAX;
        self.count_unless(is_possible, "faster than a surface craft");
        is_possible
    }

    fn count_unless(&mut self, is_possible: bool, reason: &'static str) {
        self.rejects.add(reason, u64::from(!is_possible));
    }

    fn set(&mut self, alarm: Alarm, is_raised: bool) {
        if is_raised {
            self.alarms.insert(alarm);
        } else {
            self.alarms.remove(&alarm);
        }
    }

    fn admits_position(&mut self, t_s: f64, source: Source, position: Geographic) -> bool {
        let is_used = self.positions.uses(t_s, source, position, |here, there, age| {
            moved(here, there).norm() > gate(POSITIONS_APART, age)
        });
        self.set(Alarm::PositionsDiffer, self.positions.differ());
        if !is_used {
            return false;
        }
        let velocity = self.motion.newest().filter(|(at, _)| (t_s - at).abs() <= FRESH_S);
        let velocity = velocity.map_or(Vector2::zeros(), |(_, velocity)| velocity);
        let fit = self.place.take(t_s, position, |(at, before)| {
            let elapsed = t_s - at;
            (moved(before, &position) - velocity * elapsed).norm() <= gate(POSITION_GATE, elapsed)
        });
        if fit == Fit::Jumped {
            self.jumped_s = Some(t_s);
            self.recent.clear();
            self.still = None;
        }
        self.set(Alarm::PositionJumps, self.place.is_contested(t_s));
        self.set(Alarm::PositionJumped, is_shown(self.jumped_s, t_s));
        if fit == Fit::Missed {
            self.rejects.count("position jumps");
            return false;
        }
        if self.recent.push(t_s, position) {
            self.compare_drift();
        }
        self.compare_with_velocity(t_s);
        self.compare_still(t_s, position);
        true
    }

    /// Compares the drift of positions from the integral of the velocity with its limit.
    fn compare_drift(&mut self) {
        if let Some(drift) = self.recent.drift().filter(|drift| drift.span_s >= DRIFT_AFTER_S) {
            let speed = self.motion.newest().map_or(0.0, |(_, velocity)| velocity.norm());
            let most = gate(DRIFT, speed).max(DRIFT_SIGMAS * drift.slope_sigma);
            let is_raised = self.alarms.contains(&Alarm::PositionDrifts);
            // It ends well inside its gate.
            let least = if is_raised { 0.5 * most } else { most };
            let is_apart = drift.slope.norm() > least;
            self.set(
                Alarm::PositionDrifts,
                is_apart && !self.alarms.contains(&Alarm::VelocityContradicts),
            );
        }
    }

    /// Compares positions with the integral of the velocity.
    fn compare_with_velocity(&mut self, t_s: f64) {
        let Some((span, apart)) = self
            .recent
            .mismatch()
            .filter(|(span, _)| *span >= MISMATCH_AFTER_S)
        else {
            return;
        };
        let most = gate(MISMATCH, span);
        if self.alarms.contains(&Alarm::VelocityContradicts) {
            // It ends well inside its gate.
            self.set(Alarm::VelocityContradicts, apart > 0.5 * most);
            return;
        }
        let since_s = self.apart_since_s.unwrap_or(t_s);
        self.apart_since_s = (apart > most).then_some(since_s);
        let contradicts = apart > most && t_s - since_s >= MISMATCH_FOR_S;
        self.set(Alarm::VelocityContradicts, contradicts);
    }

    /// Compares a position that stays with velocity and references.
    fn compare_still(&mut self, t_s: f64, position: Geographic) {
        let travelled = self.recent.travelled();
        let start = Still {
            since_s: t_s,
            place: position,
            travelled,
            asked: 0.0,
        };
        let still = *self.still.get_or_insert(start);
        let mut has_no_way = false;
        if moved(&still.place, &position).norm() > STILL_M {
            self.still = Some(start);
            if self.position_frozen_s.take().is_some() {
                // The kept positions show no motion.
                self.recent.clear();
            }
        } else {
            let (travel, time) = ((travelled - still.travelled).norm(), t_s - still.since_s);
            let has_pace = |by: f64| by >= FROZEN_SPEED * time;
            let is_way = |by: f64, least: f64| by >= least && has_pace(by);
            let is_asked = is_way(still.asked, ASKED_M);
            has_no_way = is_asked;
            if is_way(travel, FROZEN_TRAVEL_M) && time >= STILL_MIN_S || is_asked && time >= ASKED_S {
                self.position_frozen_s = Some(t_s);
                // The next evidence must be new.
                self.still = Some(Still {
                    place: still.place,
                    ..start
                });
            } else if !has_pace(travel) && !has_pace(still.asked) {
                // A craft at rest gives no evidence: a receiver may have frozen at the berth.
                self.still = Some(Still {
                    place: still.place,
                    ..start
                });
            }
        }
        let is_frozen = self.position_frozen_s.is_some_and(|at| t_s - at <= LATCH_S);
        self.set(Alarm::PositionFrozen, is_frozen);
        self.set(Alarm::NoWay, has_no_way && !is_frozen);
    }

    fn admits_heading(&mut self, t_s: f64, source: Source, heading: f64) -> bool {
        let is_used = self.headings.uses(t_s, source, heading, |here, there, age| {
            wrapped(here - there).abs() > gate(HEADINGS_APART, age)
        });
        self.set(Alarm::HeadingsDiffer, self.headings.differ());
        if !is_used {
            return false;
        }
        let rate = self.yaw_rate.filter(|(at, _)| (t_s - at).abs() <= FRESH_S);
        let (rate, heading_gate) = rate.map_or((0.0, HEADING_GATE), |(_, rate)| (rate, HEADING_GATE_BY_RATE));
        let fit = self.bow.take(t_s, heading, |(at, before)| {
            let elapsed = t_s - at;
            wrapped(heading - before - rate * elapsed).abs() <= gate(heading_gate, elapsed)
        });
        if fit == Fit::Jumped {
            self.heading_jumped_s = Some(t_s);
        }
        self.set(Alarm::HeadingJumps, self.bow.is_contested(t_s));
        self.set(Alarm::HeadingJumped, is_shown(self.heading_jumped_s, t_s));
        if fit == Fit::Missed {
            self.rejects.count("heading jumps");
            return false;
        }
        let is_measured = self
            .yaw_rate
            .is_some_and(|(at, _)| (t_s - at).abs() <= RATE_GAP_MAX_S);
        let turned = is_measured.then_some([self.turned, self.turned_error]);
        let is_kept = self.turns.push(t_s, heading, turned, self.recent.travelled());
        self.compare_steady(t_s, heading);
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
        let is_so = is_shown(self.contradicted_s, t_s) && !self.alarms.contains(&Alarm::HeadingFrozen);
        self.set(Alarm::HeadingContradicts, is_so);
    }

    /// Compares the heading with the measured course.
    fn compare_with_course(&mut self, t_s: f64, heading: f64) {
        let measured = self.motion.newest().filter(|(at, _)| (t_s - at).abs() <= FRESH_S);
        let velocity = measured
            .map(|(_, velocity)| velocity)
            .filter(|velocity| velocity.norm() >= COURSE_SPEED);
        let off = velocity.map(|velocity| wrapped(velocity.y.atan2(velocity.x) - heading).abs());
        let since_s = self.off_course_s.unwrap_or(t_s);
        self.off_course_s = off.filter(|off| *off >= COURSE_OFF).map(|_| since_s);
        let is_off = self.off_course_s.is_some() && t_s - since_s >= COURSE_OFF_FOR_S;
        self.set(Alarm::CourseOffHeading, is_off);
    }

    /// Compares a heading that stays with yaw rate and course.
    fn compare_steady(&mut self, t_s: f64, heading: f64) {
        let start = Steady {
            began_s: t_s,
            since_s: t_s,
            heading,
            turned: self.turned,
            course: None,
        };
        let steady = self.steady.get_or_insert(start);
        if wrapped(heading - steady.heading).abs() > HEADING_STILL {
            *steady = start;
            self.heading_frozen_s = None;
        } else {
            let velocity = self.recent.velocity();
            let course = velocity
                .filter(|velocity| velocity.norm() >= COURSE_SPEED)
                .map(|velocity| velocity.y.atan2(velocity.x));
            steady.course = course.and_then(|course| steady.course.or(Some(course)));
            let changed = course
                .zip(steady.course)
                .map_or(0.0, |(now, then)| wrapped(now - then));
            let is_turned = (self.turned - steady.turned).abs() >= TURN_BY_RATE
                || changed.abs() >= TURN_BY_COURSE
                || self.turns.swing_since(steady.began_s);
            let time = t_s - steady.since_s;
            if is_turned && time >= STEADY_MIN_S {
                self.heading_frozen_s = Some(t_s);
                *steady = start;
            } else if time > TURN_WINDOW_S {
                (steady.since_s, steady.turned) = (t_s, self.turned);
            }
        }
        let is_frozen = self.heading_frozen_s.is_some_and(|at| t_s - at <= LATCH_S);
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

/// `true` if a jump at `at_s` is recent at `t_s`, s.
fn is_shown(at_s: Option<f64>, t_s: f64) -> bool {
    at_s.is_some_and(|at_s| t_s - at_s <= JUMP_SHOWN_S)
}

/// A gate that widens with the elapsed time, s.
fn gate([at_once, per_second]: [f64; 2], elapsed: f64) -> f64 {
    at_once + per_second * elapsed.abs()
}
