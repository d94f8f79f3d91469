//! Way-points: straight legs, and corners that a vehicle can follow.
//!
//! A corner is an arc that touches both legs. With tangent length t from the way-point and turn θ
//! its radius is t / tan(|θ| / 2). Where the legs reverse, no such arc comes near the way-point;
//! the vehicle makes a loop of three arcs.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Vector2;
use serde_json::json;

use crate::facts::angle::{angle_of, direction, wrap};
use crate::facts::field_error::FieldError;
use crate::facts::path::limits::{
    InvalidPath, KINK_MAX, LENGTH_MAX, LENGTH_MIN, SEGMENTS_MAX, one_place, require_count, require_point,
    require_straight, require_within,
};
use crate::facts::path::piece::{Leg, Piece};
use crate::facts::ranges::LEG;

/// Shorter pieces between or inside fillets are rounding, m.
const LENGTH_OF_ROUNDING: f64 = 1e-9;

/// Largest distance, m, at which a way-point without a prescribed radius repeats the previous one:
/// a tenth of underwater vehicles' position error, and more than the rounding of degrees.
pub const REPEATED_WITHIN: f64 = 0.1;

/// Least turn of a corner that becomes a loop, rad; its arc would pass at three times its radius.
pub const LOOP_FROM: f64 = PI * 5.0 / 6.0;

/// Corners at which a vehicle turns once it has reached the way-point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Overshot {
    /// Least turn of such a corner, rad.
    pub(crate) from: f64,
    pub(crate) radius: f64,
}

/// Rounding of corners.
#[derive(Clone, Copy)]
pub(super) enum Corners {
    /// One radius for all, m, for which the legs must have room; 0 if there is no corner.
    Fillets { radius: f64 },
    /// This radius, m, or the largest possible; sharper corners may be overshot by another one.
    Turns { radius: f64, overshot: Option<Overshot> },
}

/// Legs and corners between `points`, of which repeated ones are omitted, and back to the first if
/// `ring`. `declared` describes each leg, or is empty.
pub(super) fn legs(
    points: &[[f64; 2]],
    declared: &[Leg],
    ring: bool,
    corners: Corners,
    field: &str,
) -> Result<Vec<Piece>, InvalidPath> {
    let legs = Legs::new(points, ring, corners, field)?;
    if !declared.is_empty() {
        let n = points.len() - usize::from(!ring);
        require_count(format_args!("{field}/legs"), declared.len(), &(n..=n), "legs")?;
    }
    for (k, leg) in declared.iter().enumerate() {
        let given = [leg.speed_mps, leg.depth_m];
        for ((name, range), value) in LEG.iter().zip(given) {
            let (least, most) = range.clone().into_inner();
            require_within(format_args!("{field}/legs/{k}/{name}"), value.unwrap_or(least), least, most)?;
        }
    }
    let corners = match corners {
        Corners::Fillets { radius } => legs.fillets(radius, field)?,
        Corners::Turns { radius, overshot } => {
            require_within(format_args!("{field}/turn_radius_m"), radius, LENGTH_MIN, LENGTH_MAX)?;
            legs.turns(radius, overshot)
        }
    };
    Ok(legs.pieces(&corners, declared))
}

/// Straight legs between points.
struct Legs {
    points: Vec<Vector2<f64>>,
    /// Index of each point in the given list.
    given_at: Vec<usize>,
    /// Direction of each leg, rad. The k-th leg begins at the k-th point.
    tangents: Vec<f64>,
    /// Change of direction at each point, rad, positive to starboard; 0 at the ends.
    turns: Vec<f64>,
    /// `true` if a leg leads from the last point to the first.
    ring: bool,
}

/// The turn of a vehicle at a way-point.
#[derive(Clone, Copy, Default)]
struct Corner {
    radius: f64,
    /// Length that it takes of both legs, m; if overshot, of the second alone.
    tangent_length: f64,
    /// Rad, positive to starboard.
    turn: f64,
    kind: CornerKind,
}

#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum CornerKind {
    /// One arc, which touches both legs.
    #[default]
    Cut,
    /// Two arcs from the way-point to the second leg.
    Overshot,
    /// Three arcs from the way-point back to it.
    Loop,
}

impl Corner {
    /// Lengths that it takes of both legs, m.
    fn lengths(&self) -> [f64; 2] {
        match self.kind {
            CornerKind::Overshot => [0.0, self.tangent_length],
            CornerKind::Cut | CornerKind::Loop => [self.tangent_length; 2],
        }
    }
}

impl Legs {
    fn new(given: &[[f64; 2]], ring: bool, corners: Corners, field: &str) -> Result<Self, InvalidPath> {
        let (n_least, repeated_within) = match corners {
            Corners::Fillets { .. } => (if ring { 3 } else { 2 }, LENGTH_MIN),
            Corners::Turns { .. } => (2, REPEATED_WITHIN),
        };
        require_count(format_args!("{field}/points"), given.len(), &(n_least..=SEGMENTS_MAX), "points")?;
        for (k, point) in given.iter().enumerate() {
            require_point(format_args!("{field}/points/{k}"), point)?;
        }
        let mut legs = Self {
            points: Vec::with_capacity(given.len()),
            given_at: Vec::with_capacity(given.len()),
            tangents: Vec::new(),
            turns: Vec::new(),
            ring,
        };
        for (k, point) in given.iter().enumerate() {
            let point = Vector2::from(*point);
            let repeats = |last: &Vector2<f64>| (point - last).norm() < repeated_within;
            if !legs.points.last().is_some_and(repeats) {
                legs.points.push(point);
                legs.given_at.push(k);
            }
        }
        let returns = |legs: &Self| match &legs.points[..] {
            [first, .., last] => ring && (first - last).norm() < repeated_within,
            _ => false,
        };
        while returns(&legs) {
            legs.points.pop();
            legs.given_at.pop();
        }
        if legs.points.len() < n_least {
            let place = format_args!("{field}/points");
            return Err(one_place(place, "all points", repeated_within));
        }
        for leg in 0..legs.n() {
            let end = legs.given_at[(leg + 1) % legs.points.len()];
            let field = format_args!("{field}/points/{end}");
            require_within(field, legs.length(leg), LENGTH_MIN, LENGTH_MAX)?;
        }
        legs.tangents = (0..legs.n()).map(|leg| angle_of(&legs.vector(leg))).collect();
        legs.turns = (0..legs.points.len()).map(|point| legs.turn(point)).collect();
        Ok(legs)
    }

    fn n(&self) -> usize {
        self.points.len() - usize::from(!self.ring)
    }

    fn vector(&self, leg: usize) -> Vector2<f64> {
        self.points[(leg + 1) % self.points.len()] - self.points[leg]
    }

    fn length(&self, leg: usize) -> f64 {
        self.vector(leg).norm()
    }

    /// The leg that ends at a point.
    fn before(&self, point: usize) -> usize {
        (point + self.points.len() - 1) % self.points.len()
    }

    fn turn(&self, point: usize) -> f64 {
        if !self.ring && (point == 0 || point + 1 == self.points.len()) {
            return 0.0;
        }
        wrap(self.tangents[point] - self.tangents[self.before(point)])
    }

    fn fillets(&self, radius: f64, field: &str) -> Result<Vec<Corner>, InvalidPath> {
        let unit = |turn: &f64| (0.5 * turn.abs()).tan();
        let tangent_lengths: Vec<f64> = self.turns.iter().map(unit).collect();
        if radius == 0.0 {
            for (turn, k) in self.turns.iter().zip(&self.given_at) {
                require_straight(format_args!("{field}/points/{k}"), *turn)?;
            }
        } else {
            require_within(format_args!("{field}/fillet_m"), radius, LENGTH_MIN, LENGTH_MAX)?;
            self.check_room(&tangent_lengths, radius, field)?;
        }
        let corner = |(turn, unit): (&f64, f64)| Corner {
            radius,
            tangent_length: radius * unit,
            turn: *turn,
            kind: CornerKind::Cut,
        };
        Ok(self.turns.iter().zip(tangent_lengths).map(corner).collect())
    }

    /// Checks that both fillets of every leg fit. Names the sharper corner of the tightest leg.
    fn check_room(&self, tangent_lengths: &[f64], radius: f64, field: &str) -> Result<(), InvalidPath> {
        let end = |leg: usize| (leg + 1) % self.points.len();
        let room = |leg: usize| self.length(leg) / (tangent_lengths[leg] + tangent_lengths[end(leg)]);
        let tightest = (0..self.n()).map(|leg| (leg, room(leg)));
        let Some((leg, most)) = tightest.min_by(|(_, a), (_, b)| a.total_cmp(b)) else {
            return Ok(());
        };
        // A polygon whose fillets use up its legs is valid, up to rounding.
        if radius <= most * (1.0 + LENGTH_OF_ROUNDING) {
            return Ok(());
        }
        let sharper = if tangent_lengths[leg] < tangent_lengths[end(leg)] { end(leg) } else { leg };
        let place = format_args!("{field}/points/{}", self.given_at[sharper]);
        let detail = format!(
            "the legs that meet here have no room for a fillet of {radius} m, only for {most} m; without `fillet_m` every \
             corner gets the radius that fits"
        );
        let fault = FieldError::new(place, "fillet", detail).given(radius);
        Err(Box::new(fault.limit(json!({ "most": most }))))
    }

    /// Arcs of `radius`, or of a shared fraction where those at both ends of a leg do not fit.
    fn turns(&self, radius: f64, overshot: Option<Overshot>) -> Vec<Corner> {
        let n = self.points.len();
        let wanted = |point: usize| {
            let turn = self.turns[point];
            if turn == 0.0 {
                return Corner::default();
            }
            let shorter = self.length(point).min(self.length(self.before(point)));
            // In a reversal, rounding must not choose the side.
            let back = PI - KINK_MAX < turn.abs();
            let turn = if back { turn.rem_euclid(TAU) } else { turn };
            if let Some(overshot) = overshot.filter(|overshot| overshot.from < turn.abs()) {
                let unit = overshot_length(turn);
                let radius = overshot.radius.min(self.length(point) / unit);
                return Corner { radius, tangent_length: radius * unit, turn, kind: CornerKind::Overshot };
            }
            if LOOP_FROM < turn.abs() {
                let radius = radius.min(0.5 * shorter);
                return Corner { radius, tangent_length: 0.0, turn, kind: CornerKind::Loop };
            }
            let tangent_length = (radius * (0.5 * turn.abs()).tan()).min(shorter);
            Corner { radius, tangent_length, turn, kind: CornerKind::Cut }
        };
        let mut corners: Vec<Corner> = (0..n).map(wanted).collect();
        let taken = |leg: usize| corners[leg].lengths()[1] + corners[(leg + 1) % n].lengths()[0];
        let share = |leg: usize| (self.length(leg) / taken(leg)).min(1.0);
        let shares: Vec<f64> = (0..self.n()).map(share).collect();
        for (point, corner) in corners.iter_mut().enumerate() {
            if 0.0 < corner.tangent_length {
                let (share, unit) = match corner.kind {
                    CornerKind::Overshot => (shares[point], overshot_length(corner.turn)),
                    CornerKind::Cut | CornerKind::Loop => {
                        (shares[point].min(shares[self.before(point)]), (0.5 * corner.turn.abs()).tan())
                    }
                };
                corner.tangent_length *= share;
                corner.radius = corner.tangent_length / unit;
            }
        }
        corners
    }

    fn pieces(&self, corners: &[Corner], declared: &[Leg]) -> Vec<Piece> {
        let mut pieces = Vec::with_capacity(2 * self.n());
        for leg in 0..self.n() {
            let first = pieces.len();
            let (along, tangent) = (self.vector(leg), self.tangents[leg]);
            let corner = corners[(leg + 1) % self.points.len()];
            let ([_, before], [after, _]) = (corners[leg].lengths(), corner.lengths());
            let start = self.points[leg] + direction(tangent) * before;
            let length = along.norm() - before - after;
            if LENGTH_OF_ROUNDING < length {
                pieces.push(Piece::line(start, tangent, length));
            }
            let end = self.points[leg] + along;
            match corner.kind {
                CornerKind::Loop => pieces.extend(looped(end, tangent, corner.radius, corner.turn)),
                CornerKind::Overshot => {
                    let arcs = overshot(end, tangent, corner.radius, corner.turn).into_iter();
                    pieces.extend(arcs.filter(|piece| LENGTH_OF_ROUNDING < piece.length));
                }
                CornerKind::Cut if LENGTH_OF_ROUNDING < corner.radius * corner.turn.abs() => {
                    let start = end - direction(tangent) * after;
                    pieces.push(Piece::arc(start, tangent, corner.radius, corner.turn));
                }
                CornerKind::Cut => {}
            }
            // The last given leg of those that end at this point.
            let n_given = declared.len().max(1);
            let given = (self.given_at[(leg + 1) % self.points.len()] + n_given - 1) % n_given;
            for piece in &mut pieces[first..] {
                piece.leg = declared.get(given).copied().unwrap_or_default();
            }
        }
        pieces
    }
}

/// Angle δ of the second arc of an overshot corner, rad: the centres of both arcs are 2 r apart, of
/// which r (1 + cos θ) = 2 r cos δ is across the second leg.
fn back(turn: f64) -> f64 {
    (0.5 * (1.0 + turn.cos())).acos()
}

/// Length of the second leg that an overshot corner takes, in radii.
fn overshot_length(turn: f64) -> f64 {
    turn.abs().sin() + 2.0 * back(turn).sin()
}

/// Two arcs from a point to a leg from it: by θ + δ into the turn, and by δ away from it.
fn overshot(point: Vector2<f64>, tangent: f64, radius: f64, turn: f64) -> [Piece; 2] {
    let back = back(turn).copysign(turn);
    arcs(point, tangent, radius, [turn + back, -back])
}

/// Arcs one after the other, each through one of `angles`.
fn arcs<const N: usize>(
    mut point: Vector2<f64>,
    mut tangent: f64,
    radius: f64,
    angles: [f64; N],
) -> [Piece; N] {
    angles.map(|angle| {
        let piece = Piece::arc(point, tangent, radius, angle);
        let end = piece.at(piece.length);
        (point, tangent) = (end.position, end.tangent);
        piece
    })
}

/// Three arcs back to their beginning that turn by `turn`: φ away, |θ| + 2 φ into it, φ away.
///
/// ```text
/// centres, for r = 1, θ > 0 and ψ = 0:  C₁ = (0, −1),
///     C₂ = (cos θ/2 + √(4 − sin² θ/2)) [sin θ/2, −cos θ/2]
/// φ = π/2 − angle of C₂ − C₁
/// ```
fn looped(point: Vector2<f64>, tangent: f64, radius: f64, turn: f64) -> [Piece; 3] {
    let side = turn.signum();
    let (sin, cos) = (0.5 * turn.abs()).sin_cos();
    let second = Vector2::new(sin, -cos) * (cos + (4.0 - sin * sin).sqrt());
    let away = FRAC_PI_2 - angle_of(&(second - Vector2::new(0.0, -1.0)));
    arcs(point, tangent, radius, [-away, turn.abs() + 2.0 * away, -away].map(|angle| side * angle))
}
