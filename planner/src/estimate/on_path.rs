//! Filter of a vehicle that follows a known path by its own navigation.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Matrix2, Matrix2x6, Matrix4, Matrix6, Vector2, Vector6};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    estimate::{
        kalman::Kalman,
        track::{Filter, Innovation},
    },
    facts::{
        angle::{direction, ned_from_body, starboard_of},
        evidence::{Report, SPEED_AT_REST},
        known_path::{FOOT_FACTOR_MIN, KnownPath, foot_speed},
        path::piece::{Piece, starboard},
    },
    tuned::EstimateNumbers,
};

/// Longest step of a prediction along the path, s: at 0.3 m/s and 10 m radius a turn of 0.15 rad.
const STEP_MAX: f64 = 5.0;

/// Most steps between two reports: a quarter of an hour, after which no goal uses the earlier one.
/// A longer silence has longer steps, which bounds the time of any filter.
const STEPS_MAX: f64 = 180.0;

/// Accuracy of a vehicle's own navigation, by which it follows the path.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Navigation {
    share: f64,
    /// Standard deviation of the path's offset along either axis at the first report, m.
    offset_sigma: f64,
    /// Spread of the offset along either axis, m²/s.
    offset_density: f64,
    /// Initial offsets along the path that are separate hypotheses, and their deviation.
    parts: (&'static [f64], f64),
}

/// Initial offsets by dead reckoning, in deviations, and their deviation: a linear filter cannot
/// turn at the wrong place. Otter on lanes, path 20 m off: 1.26 m, without parts 4.80 m.
const PARTS: (&[f64], f64) = (&[0.0, -0.7, 0.7, -1.4, 1.4], 0.35);

/// The usual navigation, and dead reckoning.
fn navigations(tuned: &EstimateNumbers) -> [Navigation; 2] {
    [
        Navigation {
            share: 1.0 - tuned.poor_share,
            offset_sigma: tuned.offset_sigma,
            offset_density: tuned.offset_density,
            parts: (&[0.0], 1.0),
        },
        Navigation {
            share: tuned.poor_share,
            offset_sigma: tuned.poor_offset_sigma,
            offset_density: tuned.poor_offset_density,
            parts: PARTS,
        },
    ]
}

/// Accuracy with which a vehicle keeps to its path.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tracking {
    share: f64,
    error_sigma: f64,
    /// Variance that a turn adds to that error and to the place along the path, m²/rad.
    turn_density: f64,
    /// Standard deviation of the way that each radian of a turn takes beyond the path's, m/rad.
    corner_sigma: f64,
}

/// Exact, loose and rough tracking.
fn trackings(tuned: &EstimateNumbers) -> [Tracking; 3] {
    let tracking = |share: f64, error_sigma: f64, turn: f64, corner_sigma: f64| Tracking {
        share,
        error_sigma,
        turn_density: turn * turn / FRAC_PI_2,
        corner_sigma,
    };
    let (loose, rough) = (tuned.loose_share, tuned.rough_share);
    [
        tracking(1.0 - loose - rough, 0.0, 0.0, tuned.exact_corner),
        tracking(loose, tuned.loose_sigma, tuned.loose_turn, tuned.loose_corner),
        tracking(rough, tuned.rough_sigma, tuned.rough_turn, tuned.rough_corner),
    ]
}

/// Standard deviation of an unknown place along the path, m: negligible information beside any fix.
const ANYWHERE: f64 = 1000.0;

/// Most initial places along the path, the closest ones.
const FEET_MAX: usize = 4;

/// Most hypotheses.
const HYPOTHESES_MAX: usize = 24;

/// Probability below which a hypothesis is dropped.
const PROBABILITY_MIN: f64 = 3.0e-3;

/// A path hypothesis: the path that a vehicle follows, and the accuracy with which it does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathHypothesis<'a> {
    pub(crate) known: &'a KnownPath,
    pub(crate) current: Vector2<f64>,
    /// Spread of its pace, (m/s)²/s.
    pub(crate) speed_density: f64,
    /// Distance of a path made of reports from them, m; such a path has no other offset.
    pub(crate) roughness: Option<f64>,
    pub(crate) tuned: &'a EstimateNumbers,
}

/// A vehicle on a path displaced by the error of its navigation, and beside it by its own.
///
/// ```text
/// x = (γ, b, o, e, c)   p = p_P(γ) + o + e n(γ) (measured)
/// γ̇ = ±(u_P(γ) + b − c |ψ̇_P|) + w_s   ḃ = w_b   ȯ = w_o   ė = −e/τ ∓ k c ψ̇_P + w_e   ċ = 0
/// ```
/// u_P is the speed over ground from the declared speed and current, o the offset (north, east), e
/// the cross-track error, a stationary process with the correlation time τ, n the normal to
/// starboard, and c the way that a turn takes beyond the path's, which carries the vehicle outwards
/// by a share k. A straight leg shows o across it; a turn shows the rest. The leg, the navigation,
/// the tracking and the sense are hypotheses, each with its own filter and probability.
#[derive(Clone, Debug)]
pub(crate) struct OnPath<'a> {
    assumed: PathHypothesis<'a>,
    time: f64,
    /// At most [`HYPOTHESES_MAX`], the most probable one first.
    hypotheses: Vec<Hypothesis>,
}

/// The next turn of a vehicle on its path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NextTurn {
    /// Time after the newest report that fits the path, s.
    pub in_s: f64,
    /// Standard deviation of `in_s`, s.
    pub sigma_s: f64,
    /// Change of direction, rad, positive to starboard.
    pub by_rad: f64,
}

/// Longest straight piece inside one turn, m.
const SAME_TURN: f64 = 1.0;

impl NextTurn {
    /// The turn on a path of unknown radii.
    pub(crate) fn of_any_radius(self, tuned: &EstimateNumbers) -> Self {
        Self { sigma_s: self.sigma_s.hypot(tuned.turn_begins_sigma), ..self }
    }
}

/// Growth of the uncertainty of a vehicle on its path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Growth of the variance of the place along the path, without the speed's error, m²/s.
    pub along_density: f64,
    /// Growth of the variance of the speed along the path, (m/s)²/s.
    pub speed_density: f64,
    /// Growth of the variance of the path's offset along either axis, m²/s.
    pub offset_density: f64,
    /// Variance of the path's points along either axis, m².
    pub path_variance: f64,
    /// Variance of the cross-track error, m².
    pub error_variance: f64,
    /// Rate at which the cross-track error fades, 1/s.
    pub error_rate: f64,
    /// Growth of its variance, and of the place's, with the turned angle, m²/rad.
    pub turn_density: f64,
}

/// Place of a vehicle on its path, its speed, and the path's offset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathFit {
    /// Place γ along the path, m; excess speed, m/s; offset of the path (north, east), m;
    /// cross-track error, m, positive to starboard of the path; way of a turn beyond the path's,
    /// m/rad.
    pub state: Vector6<f64>,
    /// Covariance of these.
    pub covariance: Matrix6<f64>,
    /// 1, or −1 for a vehicle that follows the path backwards.
    pub sense: f64,
    /// Growth of the uncertainty.
    pub spread: Spread,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Hypothesis {
    probability: f64,
    fit: PathFit,
}

/// Index of the cross-track error in a state.
const ERROR: usize = 4;

/// Index of the way of a turn beyond the path's.
const CORNER: usize = 5;

impl PathFit {
    /// Place along the path, m.
    pub fn along(&self) -> f64 {
        self.state.x
    }

    /// Speed along the path above the declared one, m/s.
    pub fn faster(&self) -> f64 {
        self.state.y
    }

    /// Offset of the path (north, east), m.
    pub fn offset(&self) -> Vector2<f64> {
        Vector2::new(self.state.z, self.state.w)
    }

    /// Cross-track error, m, positive to starboard of the path.
    pub fn error(&self) -> f64 {
        self.state[ERROR]
    }

    /// Way of a turn beyond the path's, m/rad: positive if the vehicle overshoots its corners.
    pub fn corner(&self) -> f64 {
        self.state[CORNER]
    }

    pub(crate) fn position(&self, known: &KnownPath) -> Vector2<f64> {
        let point = known.path.at(self.state.x);
        point.position + self.offset() + starboard(point.tangent) * self.error()
    }

    /// The fit of the same vehicle known to be at `position` (north, east), m. The path moves
    /// there: how much of the distance is its tracking error is unknown.
    #[must_use]
    pub(crate) fn moved_to(mut self, position: &Vector2<f64>, known: &KnownPath) -> Self {
        let tangent = known.path.at(self.state.x).tangent;
        let off = position - self.position(known);
        self.state.x += off.dot(&direction(tangent));
        let across = starboard(tangent);
        let beside = across * (off.dot(&across) + self.state[ERROR]);
        self.state[ERROR] = 0.0;
        (self.state.z, self.state.w) = (self.state.z + beside.x, self.state.w + beside.y);
        self
    }

    /// Rate of the place γ, m/s.
    fn rate(&self, assumed: &PathHypothesis<'_>) -> f64 {
        let (tangent, leg) = assumed.known.path.tangent_at(self.state.x);
        let speed = leg.speed_mps.unwrap_or(assumed.known.horizontal_speed);
        foot_speed(speed, &assumed.current, tangent, self.sense) + self.sense * self.state.y
    }

    pub(crate) fn next_turn(&self, assumed: &PathHypothesis<'_>) -> Option<NextTurn> {
        let (path, tuned) = (&assumed.known.path, assumed.tuned);
        let pieces = path.pieces();
        let (_, gamma) = path.lap_of(self.state.x);
        let begun = pieces.partition_point(|piece| piece.from <= gamma);
        let forwards = 0.0 < self.sense;
        let under = pieces[..begun].last().filter(|piece| gamma <= piece.end());
        // The pieces ahead in the vehicle's order, with the distances of their ends.
        let (first, laps) =
            if forwards { (begun, 1.0) } else { (pieces.len() - begun + usize::from(under.is_some()), -1.0) };
        let n = if path.is_closed() { pieces.len() } else { pieces.len().saturating_sub(first) };
        let ahead = (first..first + n).map(|number| {
            let lap = if number < pieces.len() { 0.0 } else { laps * path.length() };
            let number = number % pieces.len();
            let piece = &pieces[if forwards { number } else { pieces.len() - 1 - number }];
            let (from, to) = (piece.from + lap - gamma, piece.end() + lap - gamma);
            (if forwards { (from, to) } else { (-to, -from) }, piece)
        });
        // The rest of the present turn is not the next one.
        let mut turning_until = under.map_or(f64::NEG_INFINITY, |piece| match (piece.curvature, forwards) {
            (0.0, _) => f64::NEG_INFINITY,
            (_, true) => piece.end() - gamma,
            (_, false) => gamma - piece.from,
        });
        let arcs = ahead.filter(|(_, piece)| piece.curvature != 0.0).skip_while(|((from, to), _)| {
            let is_same = *from <= turning_until + SAME_TURN;
            if is_same {
                turning_until = *to;
            }
            is_same
        });
        let angle = |piece: &Piece| self.sense * piece.curvature * piece.length;
        let (mut distance, mut end, mut by_rad) = (0.0, f64::NEG_INFINITY, 0.0);
        for ((from, to), piece) in arcs {
            if from - end <= SAME_TURN && 0.0 <= angle(piece) * by_rad {
                (by_rad, end) = (by_rad + angle(piece), to);
            } else if tuned.turn_least <= f64::abs(by_rad) {
                break;
            } else {
                (distance, end, by_rad) = (from, to, angle(piece));
            }
        }
        if f64::abs(by_rad) < tuned.turn_least {
            return None;
        }
        let speed = self.rate(assumed).abs().max(SPEED_AT_REST);
        let in_s = distance / speed;
        let p = &self.covariance;
        let variance = p.m11
            + 2.0 * self.sense * in_s * p.m12
            + in_s * in_s * p.m22
            + self.spread.along_density * in_s
            + self.spread.speed_density * in_s.powi(3) / 3.0
            + self.spread.path_variance;
        Some(NextTurn { in_s, sigma_s: variance.max(0.0).sqrt() / speed, by_rad })
    }

    /// Derivative of position and speed by the state: rows north, east.
    fn jacobian(along: &Vector2<f64>) -> Matrix2x6<f64> {
        let across = starboard_of(*along);
        Matrix2x6::new(
            along.x, 0.0, 1.0, 0.0, across.x, 0.0, //
            along.y, 0.0, 0.0, 1.0, across.y, 0.0,
        )
    }

    /// Covariance of the position at `tangent`, m², after `elapsed` seconds and a turn by `turned`.
    pub fn position_covariance(&self, tangent: f64, elapsed: f64, turned: f64) -> Matrix2<f64> {
        let along = direction(tangent);
        let across = starboard_of(along);
        let mut jacobian = Self::jacobian(&along);
        let spread = &self.spread;
        let kept = (-elapsed * spread.error_rate).exp();
        jacobian.set_column(1, &(along * (self.sense * elapsed)));
        jacobian.set_column(ERROR, &(across * kept));
        jacobian.set_column(CORNER, &(along * (-self.sense * turned.abs())));
        let turning = spread.turn_density * turned.abs();
        let ahead = spread.along_density * elapsed + spread.speed_density * elapsed.powi(3) / 3.0 + turning;
        // No less than now: waiting adds no information.
        let settled = spread.error_variance.max(self.covariance[(ERROR, ERROR)]);
        let beside = settled * (1.0 - kept * kept) + turning;
        let anywhere = spread.path_variance + spread.offset_density * elapsed;
        jacobian * self.covariance * jacobian.transpose()
            + along * along.transpose() * ahead
            + across * across.transpose() * beside
            + Matrix2::identity() * anywhere
    }

    fn carry_on(&mut self, t: f64, assumed: &PathHypothesis<'_>) {
        let kept = (-t * self.spread.error_rate).exp();
        let way = t * self.rate(assumed);
        let (turned, to_starboard) =
            if assumed.known.path.is_straight_between(self.state.x, self.state.x + way) {
                self.state.x += way;
                self.state[ERROR] *= kept;
                (0.0, 0.0)
            } else {
                self.carry_round(t, assumed)
            };
        let mut f = Matrix6::identity();
        f[(0, 1)] = self.sense * t;
        f[(ERROR, ERROR)] = kept;
        f[(0, CORNER)] = -self.sense * turned;
        f[(ERROR, CORNER)] = -assumed.tuned.corner_out * to_starboard;
        let (q_s, q_b, q_o) =
            (self.spread.along_density, self.spread.speed_density, self.spread.offset_density * t);
        let turning = self.spread.turn_density * turned;
        let q_e = self.spread.error_variance * (1.0 - kept * kept) + turning;
        let q_along = q_s * t + q_b * t.powi(3) / 3.0 + turning;
        let mut q = Matrix6::from_diagonal(&Vector6::new(q_along, q_b * t, q_o, q_o, q_e, 0.0));
        q[(0, 1)] = 0.5 * q_b * t * t * self.sense;
        q[(1, 0)] = q[(0, 1)];
        self.covariance = f * self.covariance * f.transpose() + q;
    }

    /// Predicts the state by `t` seconds in steps. Returns the turned angle, rad, and the turn to
    /// starboard, faded as the cross-track error fades.
    fn carry_round(&mut self, t: f64, assumed: &PathHypothesis<'_>) -> (f64, f64) {
        let steps = (t / STEP_MAX).ceil().min(STEPS_MAX);
        let step = if steps > 0.0 { t / steps } else { 0.0 };
        let kept = (-step * self.spread.error_rate).exp();
        let tangent_at = |along: f64| assumed.known.path.tangent_at(along).0;
        let mut tangent = tangent_at(self.state.x);
        let (mut done, mut turned, mut to_starboard) = (0.0, 0.0, 0.0);
        while done < steps {
            // Midpoint rule, accurate to second order.
            let start = self.state.x;
            self.state.x += 0.5 * step * self.rate(assumed);
            let way = step * self.rate(assumed);
            // As in forecasts, γ̇ = u / (1 + c |κ|), with the mean bend of the step.
            let bend = (tangent_at(start + way) - tangent).abs();
            let longer = (way.abs() + self.corner() * bend).max(FOOT_FACTOR_MIN * way.abs());
            let share = way.abs() / longer.max(f64::MIN_POSITIVE);
            self.state.x = start + way * share;
            let by = tangent_at(self.state.x) - tangent;
            tangent += by;
            turned += by.abs() * share;
            to_starboard = to_starboard * kept + self.sense * by;
            let outwards = -assumed.tuned.corner_out * self.sense * by * self.corner();
            self.state[ERROR] = self.state[ERROR] * kept + outwards;
            done += 1.0;
        }
        (turned, to_starboard)
    }

    /// Updates with a position in Joseph's form, as in [`Kalman`].
    fn update(
        &mut self,
        h: &Matrix2x6<f64>,
        innovation: &Vector2<f64>,
        inverse: &Matrix2<f64>,
        variance: f64,
    ) {
        let gain = self.covariance * h.transpose() * inverse;
        let kept = Matrix6::identity() - gain * h;
        let covariance = kept * self.covariance * kept.transpose() + gain * gain.transpose() * variance;
        self.covariance = (covariance + covariance.transpose()) * 0.5;
        self.state += gain * innovation;
    }

    /// Updates with a speed along the path that is higher by `excess`.
    fn update_speed(&mut self, excess: f64, tuned: &EstimateNumbers) {
        let column = self.covariance.column(1).into_owned();
        let gain = column / (column.y + tuned.telemetry_sigma.powi(2));
        self.covariance -= gain * column.transpose();
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        self.state += gain * excess;
    }
}

impl<'a> OnPath<'a> {
    /// Starts from one report, on each leg that is near enough.
    pub(crate) fn start(report: &Report, assumed: &PathHypothesis<'a>) -> Self {
        let mut filter =
            Self { assumed: *assumed, time: report.t_s, hypotheses: Vec::with_capacity(HYPOTHESES_MAX) };
        let PathHypothesis { known, roughness, tuned, .. } = assumed;
        let navigations = navigations(tuned);
        for gamma in known.path.feet::<FEET_MAX>(&report.position(), tuned.reach) {
            for tracking in &trackings(tuned) {
                let mut insert = |navigation: &Navigation, part: f64, sense: f64| {
                    let begun = filter.begun(gamma, (navigation, tracking), part, sense, report);
                    filter.insert(&begun);
                };
                if roughness.is_some() {
                    insert(&navigations[0], 0.0, 1.0);
                    continue;
                }
                for navigation in &navigations {
                    for part in navigation.parts.0 {
                        insert(navigation, *part, 1.0);
                    }
                    insert(navigation, 0.0, -1.0);
                }
            }
        }
        filter.normalise();
        filter
    }

    /// A vehicle beside `gamma`, with a path displaced along itself by a `part` of the error.
    fn begun(
        &self,
        gamma: f64,
        (navigation, tracking): (&Navigation, &Tracking),
        part: f64,
        sense: f64,
        report: &Report,
    ) -> Hypothesis {
        let (known, tuned) = (self.assumed.known, self.assumed.tuned);
        let turn = ned_from_body(known.path.tangent_at(gamma).0);
        let sigma = navigation.offset_sigma;
        let ahead = part * sigma;
        let offset = turn * Vector2::new(ahead, 0.0);
        let variances = Vector2::new((navigation.parts.1 * sigma).powi(2), sigma.powi(2));
        let speed_variance =
            tuned.path_speed_sigma.powi(2) + (tuned.path_speed_share * known.horizontal_speed).powi(2);
        let error_variance = tracking.error_sigma.powi(2);
        let mut covariance = Matrix6::from_diagonal(&Vector6::new(
            ANYWHERE.powi(2),
            speed_variance,
            0.0,
            0.0,
            error_variance,
            tracking.corner_sigma.powi(2),
        ));
        covariance
            .fixed_view_mut::<2, 2>(2, 2)
            .copy_from(&(turn * Matrix2::from_diagonal(&variances) * turn.transpose()));
        let mut fit = PathFit {
            state: Vector6::new(gamma - ahead, 0.0, offset.x, offset.y, 0.0, 0.0),
            covariance,
            sense,
            spread: Spread {
                along_density: tuned.along_density + tuned.pace_time * known.horizontal_speed.powi(2),
                speed_density: self.assumed.speed_density,
                offset_density: navigation.offset_density,
                path_variance: self.assumed.roughness.unwrap_or(0.0).powi(2),
                error_variance,
                error_rate: tuned.error_time.recip(),
                turn_density: tracking.turn_density,
            },
        };
        let innovation = self.take_in(&mut fit, report);
        let share = if sense < 0.0 { tuned.backwards } else { 1.0 - tuned.backwards };
        Hypothesis {
            probability: navigation.share
                * tracking.share
                * share
                * (-0.5 * part * part).exp()
                * innovation.density,
            fit,
        }
    }

    pub(crate) fn assumed(&self) -> &PathHypothesis<'a> {
        &self.assumed
    }

    /// The next turn, if the vehicle is on the path.
    pub(crate) fn next_turn(&self) -> Option<NextTurn> {
        let fit = self.is_on_path().then(|| self.fit())?;
        fit.next_turn(&self.assumed)
    }

    /// `true` if the path passes near the reports.
    pub(crate) fn is_on_path(&self) -> bool {
        !self.hypotheses.is_empty()
    }

    pub(crate) fn fit(&self) -> PathFit {
        self.hypotheses.first().map_or_else(PathFit::default, |hypothesis| hypothesis.fit)
    }

    /// The most probable vehicle, as if it were free.
    pub(crate) fn free(&self) -> Kalman {
        let (fit, known) = (self.fit(), self.assumed.known);
        let along = direction(known.path.tangent_at(fit.state.x).0);
        let (across, h) = (starboard_of(along), PathFit::jacobian(&along));
        let swing = fit.spread.error_variance * fit.spread.error_rate.powi(2);
        let across_variance = self.assumed.tuned.across_sigma.powi(2) + swing;
        let with_speed = h * fit.covariance.column(1) * along.transpose() * fit.sense;
        let mut covariance = Matrix4::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&(h * fit.covariance * h.transpose()));
        covariance.fixed_view_mut::<2, 2>(0, 2).copy_from(&with_speed);
        covariance.fixed_view_mut::<2, 2>(2, 0).copy_from(&with_speed.transpose());
        covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(
            &(along * along.transpose() * fit.covariance.m22 + across * across.transpose() * across_variance),
        );
        let covariance = (covariance + covariance.transpose()) * 0.5;
        let velocity = along * fit.rate(&self.assumed);
        Kalman::new(self.time, &fit.position(known), &velocity, &covariance)
    }

    /// Updates with a report inside the gate. The density covers position and reported course.
    fn take_in(&self, fit: &mut PathFit, report: &Report) -> Innovation {
        let PathHypothesis { known, tuned, .. } = self.assumed;
        let point = known.path.at(fit.state.x);
        let along = direction(point.tangent);
        let h = PathFit::jacobian(&along);
        let error = report.position() - point.position - fit.offset() - starboard_of(along) * fit.error();
        let noise = report.sigma_m.powi(2) + fit.spread.path_variance;
        let covariance = h * fit.covariance * h.transpose() + Matrix2::identity() * noise;
        let determinant = covariance.determinant().max(f64::MIN_POSITIVE);
        let adjugate = Matrix2::new(covariance.m22, -covariance.m12, -covariance.m21, covariance.m11);
        let inverse = adjugate / determinant;
        let (normalised, variance) = (error.dot(&(inverse * error)), determinant.sqrt());
        let track = report.ground_track();
        let agreement = track.map_or(1.0, |track| {
            let cosine = (along * fit.sense).dot(&track.course.unit());
            ((cosine - 1.0) / tuned.course_variance).exp() + tuned.course_unlike
        });
        let accepted = normalised <= tuned.gate;
        if accepted {
            fit.update(&h, &error, &inverse, noise);
            if let Some(track) = &track {
                let along = direction(known.path.tangent_at(fit.state.x).0) * fit.sense;
                let forwards = fit.sense * fit.rate(&self.assumed);
                fit.update_speed(track.velocity().dot(&along) - forwards, tuned);
            }
        }
        Innovation {
            accepted,
            normalised,
            density: agreement * (-0.5 * normalised).exp() / (TAU * variance),
            square: error.norm_squared(),
            variance,
        }
    }

    /// Inserts a hypothesis by probability; drops the least probable if there are too many.
    fn insert(&mut self, hypothesis: &Hypothesis) {
        let place = self.hypotheses.partition_point(|other| hypothesis.probability <= other.probability);
        self.hypotheses.insert(place, *hypothesis);
        self.hypotheses.truncate(HYPOTHESES_MAX);
    }

    /// The prediction at a later time, s.
    fn carried_to(&self, time: f64) -> Self {
        let mut then = self.clone();
        then.time = time;
        for hypothesis in &mut then.hypotheses {
            hypothesis.fit.carry_on(time - self.time, &self.assumed);
        }
        then
    }

    /// Normalises the probabilities and drops improbable hypotheses.
    fn normalise(&mut self) {
        let sum: f64 = self.hypotheses.iter().map(|hypothesis| hypothesis.probability).sum();
        self.hypotheses.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        self.hypotheses.retain_mut(|hypothesis| {
            hypothesis.probability /= sum;
            PROBABILITY_MIN <= hypothesis.probability
        });
    }
}

impl Filter for OnPath<'_> {
    fn tuned(&self) -> &EstimateNumbers {
        self.assumed.tuned
    }

    fn accept(&mut self, report: &Report) -> Innovation {
        let mut then = self.carried_to(report.t_s);
        let mut best = (0.0, Innovation::REFUSED);
        let mut density = 0.0;
        for hypothesis in &mut then.hypotheses {
            let innovation = self.take_in(&mut hypothesis.fit, report);
            density += hypothesis.probability * innovation.density;
            hypothesis.probability *= innovation.log_likelihood(self.assumed.tuned).exp();
            if best.0 < hypothesis.probability {
                best = (hypothesis.probability, innovation);
            }
        }
        let (best_probability, innovation) = best;
        if innovation.accepted {
            then.normalise();
            *self = then;
        } else if 0.0 < best_probability {
            // A refused fix moves no vehicle, but it may speak for a looser tracking.
            for (mine, weighed) in self.hypotheses.iter_mut().zip(&then.hypotheses) {
                mine.probability = weighed.probability;
            }
            self.normalise();
        }
        Innovation { density, ..innovation }
    }

    /// The place on the path is kept and the path moves: the vehicle corrected its position.
    fn found_at(&self, report: &Report) -> Self {
        let mut found = self.carried_to(report.t_s);
        for hypothesis in &mut found.hypotheses {
            let fit = &mut hypothesis.fit;
            let offset = report.position() - fit.position(self.assumed.known) + fit.offset();
            (fit.state.z, fit.state.w) = (offset.x, offset.y);
            for axis in 2..4 {
                fit.covariance.fill_row(axis, 0.0);
                fit.covariance.fill_column(axis, 0.0);
                fit.covariance[(axis, axis)] = report.sigma_m.powi(2);
            }
        }
        found
    }
}
