//! Forecast of an AUV that follows a known path.

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix4, Vector2};

use crate::{
    estimate::PathFit,
    facts::{
        angle::{direction, ned_from_body},
        evidence::{AuvState, SPEED_AT_REST},
        known_path::{FOOT_FACTOR_MIN, KnownPath, foot_speed, place_on_path},
        path::{
            curve::Path,
            piece::{PathPoint, Piece, starboard},
        },
    },
    predict::{dive::Lead, motion::Motion},
    tuned::ForecastNumbers,
};

/// Largest turn with a linear change of the speed along an arc, rad. In a current half as fast as
/// the vehicle, the place on an arc of 10 m is then right to a centimetre.
const TURN_OF_A_STRETCH: f64 = 0.1;

/// Most stretches, besides one for each line and arc; bounds the work on long paths.
const STRETCHES_MAX: f64 = 1000.0;

/// Time for which a path is followed, s; longer than any plan. Then the vehicle keeps its speed.
const LOOKED_AHEAD: f64 = 1800.0;

/// A vehicle that follows a path at its present offset.
///
/// ```text
/// p(t) = p_P(γ) + y n(γ)        (1 − κ y) γ̇ = v_c∥ + √(u_h² − v_c⊥²)
/// y(t) = y₁ + ℓ sin χ_e (1 − exp(−‖v‖ t / ℓ))
/// ```
/// n is 90° clockwise of the tangent; v_c∥ and v_c⊥ are the current along and across it; the root
/// is 0 in a cross current faster than the vehicle; χ_e is the reported course relative to the
/// tangent. A follower in an unknown current holds a steady offset: the offset continues from the
/// report and settles, and is not led to zero. On bends γ̇ is taken at the offset y₁.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AlongPath {
    path: Arc<Path>,
    /// Fit of its reports to the path, if it has any.
    fit: Option<Box<PathFit>>,
    pub(crate) horizontal_speed: f64,
    /// Cross-track offset at the report y₁, m, positive to starboard.
    pub(crate) offset: f64,
    /// Remaining change of the offset, m.
    approach: f64,
    /// Rate of the approach to the steady offset, 1/s.
    approach_rate: f64,
    /// Tangent angle of the path at the report, rad.
    reported_tangent: f64,
    /// Time and arc length of a lap of a closed path.
    lap: Option<(f64, f64)>,
    /// In order of time, at least one.
    stretches: Vec<Stretch>,
}

/// A stretch on which γ̇ is linear in γ.
///
/// ```text
/// γ(τ) = γ₀ + γ̇₀ (exp(λ τ) − 1) / λ        γ̇(τ) = γ̇₀ exp(λ τ)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    /// Beginning, s after the report.
    time: f64,
    /// Arc length at the beginning γ₀, m.
    gamma: f64,
    /// γ̇₀, m/s, negative for a vehicle that a current carries backwards.
    rate: f64,
    /// λ = dγ̇/dγ, 1/s.
    growth: f64,
    /// Angle turned before, rad, and per metre since, rad/m; positive whatever the side.
    turned: f64,
    curvature: f64,
}

impl AlongPath {
    /// The future of an AUV in `state` on its known path in a `current`, by its reports' `fit`.
    pub(crate) fn new(
        state: &AuvState,
        known: &KnownPath,
        fit: Option<&PathFit>,
        current: &Vector2<f64>,
        tuned: &ForecastNumbers,
    ) -> Self {
        let mut stretches = Vec::new();
        let path = &known.path;
        let (sense, faster) = fit.map_or((1.0, 0.0), |fit| (fit.sense, fit.state.y));
        let ground_speed =
            |speed: f64, tangent: f64| foot_speed(speed, current, tangent, sense) + sense * faster;
        let gamma = fit.map_or_else(|| place_on_path(state, known, current), |fit| fit.state.x);
        let point = path.at(gamma);
        let horizontal_speed = (known.speed_at(&point) + faster).max(0.0);
        let offset = match fit {
            Some(_) => 0.0,
            None => (state.position() - point.position).dot(&starboard(point.tangent)),
        };
        let mut schedule = Schedule {
            known,
            offset,
            corner: fit.map_or(0.0, PathFit::corner),
            ground_speed,
            turn: turn_of_a_stretch(path, current),
            sense: ground_speed(known.speed_at(&point), point.tangent).signum(),
            time: 0.0,
            turned: 0.0,
            time_max: state.age_s + LOOKED_AHEAD,
            stretches: &mut stretches,
        };
        let lap = schedule.fill(gamma);
        // A fit's tracking error fades; a vehicle without a fit settles beside the path.
        let (offset, approach, approach_rate) = if let Some(fit) = fit {
            (fit.error(), -fit.error(), fit.spread.error_rate)
        } else {
            let cross_course = if state.speed_mps < SPEED_AT_REST {
                0.0
            } else {
                state.course().unit().dot(&starboard(point.tangent))
            };
            let length = tuned.approach_length;
            let rate = state.speed_mps.max(SPEED_AT_REST) / length;
            (offset, length * cross_course, rate)
        };
        Self {
            path: Arc::clone(path),
            fit: fit.copied().map(Box::new),
            horizontal_speed,
            offset,
            approach,
            approach_rate,
            reported_tangent: point.tangent,
            lap,
            stretches,
        }
    }

    /// Motion `elapsed` seconds after the report, with a `lead` over the horizontal speed.
    ///
    /// The lead counts along the path, without a cross current (a sixth of it, at 0.1 m/s).
    pub(crate) fn at(&self, elapsed: f64, lead: Lead) -> Motion {
        let (gamma, rate) = self.foot(elapsed);
        let sense = self.sense();
        let point = self.path.at(gamma + sense * lead.distance);
        let left = self.left_to_approach(elapsed);
        let offset = self.offset + self.approach * (1.0 - left);
        let across = starboard(point.tangent);
        let shift = self.fit.as_ref().map_or_else(Vector2::zeros, |fit| fit.offset());
        Motion {
            position: point.position + across * offset + shift,
            velocity: direction(point.tangent)
                * ((rate + sense * lead.speed) * (1.0 - point.curvature * offset))
                + across * (self.approach * self.approach_rate * left),
        }
    }

    /// Tangent angle of the path beside the vehicle, rad, and its rate, rad/s, after `elapsed` s.
    pub(crate) fn tangent(&self, elapsed: f64, lead: Lead) -> (f64, f64) {
        let (gamma, rate) = self.foot(elapsed);
        let sense = self.sense();
        let point = self.path.at(gamma + sense * lead.distance);
        (point.tangent, point.curvature * (rate + sense * lead.speed))
    }

    /// Depth of the leg at that time, m, if declared.
    pub(crate) fn leg_depth(&self, elapsed: f64) -> Option<f64> {
        self.path.at(self.foot(elapsed).0).leg.depth_m
    }

    /// 1, or −1 for a vehicle that follows its path backwards.
    fn sense(&self) -> f64 {
        self.fit.as_ref().map_or(1.0, |fit| fit.sense)
    }

    /// Covariance of the position, m², `elapsed` s after the report: by the fit, else by `state`.
    ///
    /// ```text
    /// along    σ_s² + (0.1 u_h t)²              across   σ_y² + σ_∞² (1 − (1 − a)²)
    /// ```
    /// in the path's frame there, with σ_s and σ_y from the report in the path's frame then, their
    /// correlation unchanged, and the completed share a of the approach to a steady offset. The
    /// error along the path is taken as straight: bends are long beside it.
    pub(crate) fn position_covariance(
        &self,
        state: &Matrix4<f64>,
        elapsed: f64,
        lead: Lead,
        tuned: &ForecastNumbers,
    ) -> Matrix2<f64> {
        if let Some(fit) = &self.fit {
            let tangent = self.tangent(elapsed, lead).0;
            return fit.position_covariance(tangent, elapsed, self.turned(elapsed));
        }
        let reported = ned_from_body(self.reported_tangent);
        let mut covariance = reported.transpose() * state.fixed_view::<2, 2>(0, 0) * reported;
        covariance[(0, 0)] += (tuned.path_speed_share * self.horizontal_speed * elapsed).powi(2);
        let approached = 1.0 - self.left_to_approach(elapsed);
        covariance[(1, 1)] += tuned.cross_track_sigma.powi(2) * (1.0 - (1.0 - approached).powi(2));
        let there = self.path.at(self.foot(elapsed).0 + lead.distance);
        let tangent = ned_from_body(there.tangent);
        tangent * covariance * tangent.transpose()
    }

    /// Remaining share of the approach to the steady offset, from 1 to 0.
    fn left_to_approach(&self, elapsed: f64) -> f64 {
        (-self.approach_rate * elapsed).exp()
    }

    /// Arc length of the point abeam of the vehicle, m, and its rate, m/s.
    fn foot(&self, elapsed: f64) -> (f64, f64) {
        let (laps, since, stretch) = self.stretch(elapsed);
        let rate = stretch.rate * (stretch.growth * since).exp();
        let laps_length = self.lap.map_or(0.0, |(_, length)| laps * length);
        (stretch.gamma + stretch.way(since) + laps_length, rate)
    }

    /// Angle turned along the path, rad, to either side.
    fn turned(&self, elapsed: f64) -> f64 {
        let (laps, since, stretch) = self.stretch(elapsed);
        laps * self.path.total_turn() + stretch.turned + stretch.curvature * stretch.way(since).abs()
    }

    /// Completed laps, and the time, s, on the present stretch.
    fn stretch(&self, elapsed: f64) -> (f64, f64, &Stretch) {
        let (laps, elapsed) = self.lap.map_or((0.0, elapsed), |(time, _)| {
            let laps = (elapsed / time).floor();
            (laps, elapsed - laps * time)
        });
        let begun = |stretch: &Stretch| stretch.time <= elapsed;
        let stretch = &self.stretches[self.stretches.partition_point(begun).max(1) - 1];
        (laps, elapsed - stretch.time, stretch)
    }
}

impl Stretch {
    /// Signed distance along the path `since` its beginning, m.
    fn way(&self, since: f64) -> f64 {
        self.rate * since * exponential_mean(self.growth * since)
    }
}

/// The stretches under construction.
struct Schedule<'a, F> {
    known: &'a KnownPath,
    offset: f64,
    /// Way of a turn beyond the path's, m/rad.
    corner: f64,
    /// Rate of the foot, m/s, by horizontal speed through the water and tangent.
    ground_speed: F,
    turn: f64,
    /// 1 for a vehicle that moves forwards along its path, −1 for one carried backwards.
    sense: f64,
    time: f64,
    turned: f64,
    /// Time without need for further stretches, s after the report.
    time_max: f64,
    stretches: &'a mut Vec<Stretch>,
}

impl<F: Fn(f64, f64) -> f64> Schedule<'_, F> {
    /// Adds stretches from `gamma`: to the vehicle's stop or `time_max`, else beyond the path's
    /// end, or once round a closed path; returns time and signed length of such a lap.
    fn fill(&mut self, gamma: f64) -> Option<(f64, f64)> {
        let length = self.known.path.length();
        let (laps, start) = self.known.path.lap_of(gamma);
        let before_lap = laps * length;
        let goes_on = if self.known.path.is_closed() {
            self.over_pieces(start, if self.sense > 0.0 { length } else { 0.0 }, before_lap)
                && self.over_pieces(
                    if self.sense > 0.0 { 0.0 } else { length },
                    start,
                    before_lap + self.sense * length,
                )
        } else {
            let (near, far) = if self.sense > 0.0 { (0.0, length) } else { (length, 0.0) };
            let outside = self.sense * (start - near) < 0.0;
            (!outside || self.over(start, near, 0.0))
                && self.over_pieces(if outside { near } else { start }, far, 0.0)
                && self.straight_on(far + self.sense * (self.sense * (start - far)).max(0.0))
        };
        (self.known.path.is_closed() && goes_on).then_some((self.time, self.sense * length))
    }

    /// Adds the pieces between two arc lengths, each plus `shift`; `true` if the end is reached.
    fn over_pieces(&mut self, start: f64, end: f64, shift: f64) -> bool {
        let (low, high) = (start.min(end), start.max(end));
        let path = &self.known.path;
        let all = path.pieces();
        let first = all.partition_point(|piece| piece.end() <= low);
        let after = all.partition_point(|piece| piece.from < high).max(first);
        let mut lay = |piece: &Piece| {
            let (from, to) = (piece.from.max(low) + shift, piece.end().min(high) + shift);
            let (from, to) = if self.sense > 0.0 { (from, to) } else { (to, from) };
            self.over(from, to, piece.curvature)
        };
        let mut pieces = all[first..after].iter();
        if start <= end { pieces.all(&mut lay) } else { pieces.rev().all(&mut lay) }
    }

    /// Adds a piece of constant curvature in small turns; `true` if the vehicle reaches the end.
    fn over(&mut self, start: f64, end: f64, curvature: f64) -> bool {
        let parts = ((end - start) * curvature / self.turn).abs().ceil().max(1.0);
        let length = (end - start).abs() / parts;
        let mut part = 0.0;
        while part < parts {
            let from = start + self.sense * length * part;
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
        // Tangents of this piece, not of the neighbour at a joint.
        let middle = self.known.path.at(gamma + 0.5 * self.sense * length);
        let half_turn = 0.5 * self.sense * length * curvature;
        let [before, after] = [-half_turn, half_turn].map(|turn| {
            let point = PathPoint { tangent: middle.tangent + turn, curvature, ..middle };
            self.rate(&point)
        });
        let before = before.max(0.0);
        let change = (after - before) / length;
        self.stretches.push(Stretch {
            time: self.time,
            gamma,
            rate: self.sense * before,
            growth: if before > 0.0 { change } else { 0.0 },
            turned: self.turned,
            curvature: curvature.abs(),
        });
        self.turned += length * curvature.abs();
        // If the speed vanishes within, the vehicle approaches that point for ever.
        if before <= 0.0 || after <= 0.0 {
            return false;
        }
        self.time += length / (before * logarithmic_mean_inverse(after / before - 1.0));
        self.time <= self.time_max
    }

    fn straight_on(&mut self, gamma: f64) -> bool {
        let rate = self.rate(&self.known.path.at(gamma + self.sense)).max(0.0);
        self.stretches.push(Stretch {
            time: self.time,
            gamma,
            rate: self.sense * rate,
            growth: 0.0,
            turned: self.turned,
            curvature: 0.0,
        });
        rate > 0.0
    }

    /// Speed of the vehicle's foot along the path in its sense of travel, m/s.
    fn rate(&self, point: &PathPoint) -> f64 {
        let speed = (self.ground_speed)(self.known.speed_at(point), point.tangent);
        let longer = self.corner * point.curvature.abs();
        self.sense * speed / (1.0 + longer - point.curvature * self.offset).max(FOOT_FACTOR_MIN)
    }
}

/// Largest turn of a stretch, rad; unlimited in still water, with its constant speed.
fn turn_of_a_stretch(path: &Path, current: &Vector2<f64>) -> f64 {
    if *current == Vector2::zeros() {
        return f64::INFINITY;
    }
    TURN_OF_A_STRETCH.max(path.total_turn() / STRETCHES_MAX)
}

/// (exp x − 1) / x, and its limit 1 at 0.
fn exponential_mean(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.exp_m1() / x }
}

/// x / ln(1 + x), and its limit 1 at 0.
fn logarithmic_mean_inverse(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x / x.ln_1p() }
}
