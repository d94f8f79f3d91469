//! Where an AUV will be that follows a path which is known.

use std::sync::Arc;

use nalgebra::Vector2;

use super::{Motion, SPEED_AT_REST, dive::Lead, doubt::OnPath};
use crate::{
    angle::{direction, ned_from_body},
    path::{Path, Piece, starboard},
    snapshot::{AuvState, KnownPath},
};

/// Position doubt in the search for the place on the path, m: two standard deviations of an acoustic fix (1.5 m),
/// or what a follower is off its path in a current. Within it, the course tells more than the distance.
const POSITION_DOUBT: f64 = 3.0;

/// By how much a place on the path that leads against the reported course must be closer than one that leads
/// along it. Assumption: lanes of a lawn-mower are told apart up to four fifths of the way between them.
const WRONG_WAY: f64 = 4.0;

/// Largest turn over which the speed along an arc is taken to change linearly, rad. At it, in a current half as
/// fast as the vehicle, the place on an arc of 10 m is right to a centimetre.
const TURN_OF_A_STRETCH: f64 = 0.1;

/// Most stretches, apart from one for each line and arc: it bounds the work on paths that wind without end.
const STRETCHES_MAX: f64 = 1000.0;

/// Least part of its speed over ground that the foot of a vehicle is taken to have on a bend of its path.
///
/// The foot of one that is far inside a bend is fast, at the centre of the bend infinitely so. At half the radius
/// it has twice the vehicle's speed, and whoever is farther inside does not follow the bend.
const FOOT_FACTOR_MIN: f64 = 0.5;

/// Way in which a vehicle that is not at its steady offset gets there, m: its course relative to the path falls
/// off by a factor of e.
///
/// Source: the simulated follower on a straight path at 0.193 m/s, its offset forecast for 60 s; root mean square
/// errors in m. Transients are its first 30 s from 0, 2 and 4 m off to either side, in a current of 0.1 m/s across
/// and in none; steady is its 0.84 m in that current, with the swings of the course at each reversal of pitch.
///
/// ```text
/// offset forecast          transient 0.1 m/s   transient 0   steady 0.1 m/s
/// kept                          1.26              1.31           0.04
/// exponential to 0, 60 s        0.77              0.71           0.34
/// exponential to 0, 300 s       1.10              1.15           0.10
/// this law, 1.5 m               0.80              0.80           0.05
/// this law, 2 m                 0.70              0.70           0.06
/// this law, 3 m                 0.59              0.63           0.08
/// ```
/// 3 m would make more of the errors of a reported course than transients, which are rare, are worth.
const APPROACH_LENGTH: f64 = 2.0;

/// A vehicle that goes along a path with the offset that it has.
///
/// ```text
/// p(t) = p_P(γ) + y n(γ)        (1 − κ y) γ̇ = v_c∥ + √(u_h² − v_c⊥²)
/// y(t) = y₁ + ℓ sin χ_e (1 − exp(−‖v‖ t / ℓ))
/// ```
/// n is 90° clockwise of the tangent; v_c∥ and v_c⊥ are the current's components along and across the tangent,
/// the root 0 where the current across is faster than the vehicle; χ_e is the reported course relative to the
/// tangent. A vehicle that follows a path in a current it does not know holds a steady offset, and its course
/// shows that: the offset goes on as it does at the report and stays, and is not led to zero. On bends γ̇ is
/// taken at the offset y₁.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AlongPath {
    path: Arc<Path>,
    /// Horizontal speed through the water, m/s.
    horizontal_speed: f64,
    /// Cross-track offset at the report y₁, m, positive to starboard.
    offset: f64,
    /// What the offset changes by in the end, m.
    approach: f64,
    /// How fast it gets there, 1/s.
    approach_rate: f64,
    /// Tangent angle of the path at the report, rad.
    reported_tangent: f64,
    /// Time and arc length of a whole round of a closed path.
    lap: Option<(f64, f64)>,
}

/// A stretch on which γ̇ is linear in γ.
///
/// ```text
/// γ(τ) = γ₀ + γ̇₀ (exp(λ τ) − 1) / λ        γ̇(τ) = γ̇₀ exp(λ τ)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    /// When it begins, s after the report.
    time: f64,
    /// Arc length where it begins γ₀, m.
    gamma: f64,
    /// γ̇₀, m/s, negative for a vehicle that a current carries back.
    rate: f64,
    /// λ = dγ̇/dγ, 1/s.
    growth: f64,
}

impl AlongPath {
    /// The future of an AUV in `state` on the path it is known to follow, in a `current` (north, east), m/s. Its
    /// stretches, in order of time and at least one, replace what `stretches` held.
    pub(super) fn new(
        state: &AuvState,
        known: &KnownPath,
        current: &Vector2<f64>,
        stretches: &mut Vec<Stretch>,
    ) -> Self {
        stretches.clear();
        let KnownPath {
            path,
            horizontal_speed,
        } = known;
        let ground_speed = |tangent: f64| speed_along(*horizontal_speed, current, tangent);
        let gamma = place_on_path(state, known, current);
        let point = path.at(gamma);
        let offset = (state.position - point.position).dot(&starboard(point.tangent));
        let mut schedule = Schedule {
            path,
            offset,
            ground_speed,
            turn: turn_of_a_stretch(path, current),
            way: ground_speed(point.tangent).signum(),
            time: 0.0,
            stretches,
        };
        let lap = schedule.fill(gamma);
        let cross_course = if state.speed < SPEED_AT_REST {
            0.0
        } else {
            state.course.unit().dot(&starboard(point.tangent))
        };
        Self {
            path: Arc::clone(path),
            horizontal_speed: *horizontal_speed,
            offset,
            approach: APPROACH_LENGTH * cross_course,
            approach_rate: state.speed.max(SPEED_AT_REST) / APPROACH_LENGTH,
            reported_tangent: point.tangent,
            lap,
        }
    }

    /// Cross-track offset at the report y₁, m, positive to starboard.
    pub(super) fn offset(&self) -> f64 {
        self.offset
    }

    /// Horizontal speed through the water, m/s.
    pub(super) fn horizontal_speed(&self) -> f64 {
        self.horizontal_speed
    }

    /// Motion `elapsed` seconds after the report, of a vehicle that leads by so much over its horizontal speed.
    ///
    /// The lead counts along the path: what a current across takes of it is left out (a sixth, at 0.1 m/s).
    pub(super) fn at(&self, elapsed: f64, lead: Lead, stretches: &[Stretch]) -> Motion {
        let (gamma, rate) = self.foot(elapsed, stretches);
        let point = self.path.at(gamma + lead.distance);
        let left = self.left_to_approach(elapsed);
        let offset = self.offset + self.approach * (1.0 - left);
        let across = starboard(point.tangent);
        Motion {
            position: point.position + across * offset,
            velocity: direction(point.tangent) * ((rate + lead.speed) * (1.0 - point.curvature * offset))
                + across * (self.approach * self.approach_rate * left),
        }
    }

    /// Tangent angle of the path beside the vehicle, rad, and its rate, rad/s, `elapsed` seconds after the report.
    pub(super) fn tangent(&self, elapsed: f64, lead: Lead, stretches: &[Stretch]) -> (f64, f64) {
        let (gamma, rate) = self.foot(elapsed, stretches);
        let point = self.path.at(gamma + lead.distance);
        (point.tangent, point.curvature * (rate + lead.speed))
    }

    /// What the doubt of the place depends on, `elapsed` seconds after the report.
    pub(super) fn on_path(&self, elapsed: f64, lead: Lead, stretches: &[Stretch]) -> OnPath {
        OnPath {
            reported: self.reported_tangent,
            tangent: self
                .path
                .at(self.foot(elapsed, stretches).0 + lead.distance)
                .tangent,
            speed: self.horizontal_speed,
            approached: 1.0 - self.left_to_approach(elapsed),
        }
    }

    /// Share of the way to the steady offset that is left, from 1 to 0.
    fn left_to_approach(&self, elapsed: f64) -> f64 {
        (-self.approach_rate * elapsed).exp()
    }

    /// Arc length of the point abeam of the vehicle, m, and its rate, m/s.
    fn foot(&self, elapsed: f64, stretches: &[Stretch]) -> (f64, f64) {
        let (laps_length, elapsed) = match self.lap {
            Some((time, length)) => {
                let laps = (elapsed / time).floor();
                (laps * length, elapsed - laps * time)
            }
            None => (0.0, elapsed),
        };
        let after = stretches
            .partition_point(|stretch| stretch.time <= elapsed)
            .max(1);
        let stretch = &stretches[after - 1];
        let since = elapsed - stretch.time;
        let gamma = stretch.gamma + stretch.rate * since * exponential_mean(stretch.growth * since);
        let rate = stretch.rate * (stretch.growth * since).exp();
        (gamma + laps_length, rate)
    }
}

/// Arc length at which a vehicle in `state` is on the path that it is known to follow: the closest place, but a place
/// that leads against the vehicle's course counts as farther away.
pub(crate) fn place_on_path(state: &AuvState, known: &KnownPath, current: &Vector2<f64>) -> f64 {
    known.path.closest_by(&state.position, |distance, point| {
        // Against a strong current the vehicle goes backwards along its path.
        let forward = speed_along(known.horizontal_speed, current, point.tangent).signum();
        let agreement = if state.speed < SPEED_AT_REST {
            1.0
        } else {
            (direction(point.tangent) * forward).dot(&state.course.unit())
        };
        (distance + POSITION_DOUBT) * (1.0 + (WRONG_WAY - 1.0) * 0.5 * (1.0 - agreement))
    })
}

/// The stretches that are being laid one after the other.
struct Schedule<'a, F> {
    path: &'a Path,
    offset: f64,
    ground_speed: F,
    turn: f64,
    /// 1 for a vehicle that goes forward along its path, −1 for one that is carried back.
    way: f64,
    time: f64,
    stretches: &'a mut Vec<Stretch>,
}

impl<F: Fn(f64) -> f64> Schedule<'_, F> {
    /// Lays stretches from `gamma` on: to where the vehicle stands, else out of the path's end, or once round a
    /// closed path; of a round, time and signed length.
    fn fill(&mut self, gamma: f64) -> Option<(f64, f64)> {
        let length = self.path.length();
        let (laps, start) = self.path.lap_of(gamma);
        let before_lap = laps * length;
        let goes_on = if self.path.is_closed() {
            self.over_pieces(start, if self.way > 0.0 { length } else { 0.0 }, before_lap)
                && self.over_pieces(
                    if self.way > 0.0 { 0.0 } else { length },
                    start,
                    before_lap + self.way * length,
                )
        } else {
            let (near, far) = if self.way > 0.0 {
                (0.0, length)
            } else {
                (length, 0.0)
            };
            let outside = self.way * (start - near) < 0.0;
            (!outside || self.over(start, near, 0.0))
                && self.over_pieces(if outside { near } else { start }, far, 0.0)
                && self.straight_on(far + self.way * (self.way * (start - far)).max(0.0))
        };
        (self.path.is_closed() && goes_on).then_some((self.time, self.way * length))
    }

    /// Over the path's pieces between two arc lengths of the first lap, `shift` added to each. Whether the
    /// vehicle gets there.
    fn over_pieces(&mut self, start: f64, end: f64, shift: f64) -> bool {
        let (low, high) = (start.min(end), start.max(end));
        let path = self.path;
        let over = |piece: &Piece| low < piece.end() && piece.from < high;
        let mut lay = |piece: &Piece| {
            let (from, to) = (piece.from.max(low) + shift, piece.end().min(high) + shift);
            let (from, to) = if self.way > 0.0 { (from, to) } else { (to, from) };
            self.over(from, to, piece.curvature)
        };
        let mut pieces = path.pieces().iter().filter(|piece| over(piece));
        if start <= end {
            pieces.all(&mut lay)
        } else {
            pieces.rev().all(&mut lay)
        }
    }

    /// Over a piece of constant curvature, in parts of a small turn. Whether the vehicle gets there.
    fn over(&mut self, start: f64, end: f64, curvature: f64) -> bool {
        let parts = ((end - start) * curvature / self.turn).abs().ceil().max(1.0);
        let length = (end - start).abs() / parts;
        let mut part = 0.0;
        while part < parts {
            let from = start + self.way * length * part;
            if !self.lay(from, length, curvature) {
                return false;
            }
            part += 1.0;
        }
        true
    }

    fn lay(&mut self, gamma: f64, length: f64, curvature: f64) -> bool {
        if length <= 0.0 {
            return true;
        }
        // The piece's own tangents, whichever piece `at` takes at a joint.
        let tangent = self.path.at(gamma + 0.5 * self.way * length).tangent;
        let half_turn = 0.5 * self.way * length * curvature;
        let before = self.rate(tangent - half_turn, curvature).max(0.0);
        let after = self.rate(tangent + half_turn, curvature);
        let change = (after - before) / length;
        self.stretches.push(Stretch {
            time: self.time,
            gamma,
            rate: self.way * before,
            growth: if before > 0.0 { change } else { 0.0 },
        });
        // Where the speed falls to nothing within, the vehicle comes ever closer and never there.
        if before <= 0.0 || after <= 0.0 {
            return false;
        }
        self.time += length / (before * logarithmic_mean_inverse(after / before - 1.0));
        true
    }

    fn straight_on(&mut self, gamma: f64) -> bool {
        let tangent = self.path.at(gamma + self.way).tangent;
        let rate = self.rate(tangent, 0.0).max(0.0);
        self.stretches.push(Stretch {
            time: self.time,
            gamma,
            rate: self.way * rate,
            growth: 0.0,
        });
        rate > 0.0
    }

    /// Speed of the vehicle's foot on the path in its way, m/s.
    fn rate(&self, tangent: f64, curvature: f64) -> f64 {
        self.way * (self.ground_speed)(tangent) / (1.0 - curvature * self.offset).max(FOOT_FACTOR_MIN)
    }
}

/// Speed over ground along a tangent, m/s, of a vehicle of horizontal speed `u_h` through the water that holds its
/// course in a `current` (north, east), m/s.
pub(crate) fn speed_along(u_h: f64, current: &Vector2<f64>, tangent: f64) -> f64 {
    let in_path_frame = ned_from_body(tangent).transpose() * current;
    let (along, across) = (in_path_frame.x, in_path_frame.y);
    along + (u_h * u_h - across * across).max(0.0).sqrt()
}

/// Largest turn of a stretch, rad; in still water the speed along an arc does not change at all.
fn turn_of_a_stretch(path: &Path, current: &Vector2<f64>) -> f64 {
    if *current == Vector2::zeros() {
        return f64::INFINITY;
    }
    let turn: f64 = path
        .pieces()
        .iter()
        .map(|piece| (piece.curvature * piece.length).abs())
        .sum();
    TURN_OF_A_STRETCH.max(turn / STRETCHES_MAX)
}

/// (exp x − 1) / x, and its limit 1 at 0.
fn exponential_mean(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.exp_m1() / x }
}

/// x / ln(1 + x), and its limit 1 at 0.
fn logarithmic_mean_inverse(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x / x.ln_1p() }
}
