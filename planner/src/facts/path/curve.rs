//! A path as a function of arc length.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::facts::angle::{direction, wrap};
use crate::facts::path::piece::{Leg, PathPoint, Piece, starboard};
use crate::facts::path::segment::Segment;

/// A path with a continuous tangent.
///
/// An open path continues straight at both ends. On a closed path, positions repeat after each lap
/// while the tangent angle grows by the path's total turn: no jump at the seam.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    pub(super) segments: Vec<Segment>,
    pub(super) pieces: Vec<Piece>,
    pub(super) start: PathPoint,
    pub(super) end: PathPoint,
    pub(super) length: f64,
    turn: f64,
    /// Bounding box of each [`BLOCK`] of pieces.
    pub(super) boxes: Vec<Extent>,
    pub(super) closed: bool,
}

/// Number of pieces with one [`Extent`], which a search skips together.
pub(super) const BLOCK: usize = 32;

/// A box with its sides along north and east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    least: Vector2<f64>,
    most: Vector2<f64>,
}

impl Extent {
    const NOWHERE: Self = Self {
        least: Vector2::new(f64::INFINITY, f64::INFINITY),
        most: Vector2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// Extends the box by a piece that ends at `end`.
    fn take_in(&mut self, piece: &Piece, end: &Vector2<f64>) {
        // A point of an arc is at most a diameter from its beginning.
        let reach = if piece.curvature == 0.0 { 0.0 } else { piece.length.min(2.0 / piece.curvature.abs()) };
        let reach = Vector2::repeat(reach);
        self.least = self.least.inf(&end.inf(&(piece.start - reach)));
        self.most = self.most.sup(&end.sup(&(piece.start + reach)));
    }

    /// Distance from the box to a position outside, m; 0 inside.
    pub(super) fn distance(&self, position: &Vector2<f64>) -> f64 {
        let outside = (self.least - position).sup(&(position - self.most));
        outside.sup(&Vector2::zeros()).norm()
    }
}

/// Side of a turn, in the direction of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// To the left.
    Port,
    /// To the right.
    Starboard,
}

impl Side {
    /// Starboard first: it wins between equal candidates.
    pub(crate) const BOTH: [Self; 2] = [Self::Starboard, Self::Port];

    /// 1 to starboard, −1 to port.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Starboard => 1.0,
            Self::Port => -1.0,
        }
    }
}

impl Path {
    /// An open path of length 0 at `start` (north, east), m, along `tangent`, rad.
    pub fn starting_at(start: Vector2<f64>, tangent: f64) -> Self {
        let end = PathPoint { position: start, tangent, curvature: 0.0, leg: Leg::default() };
        Self {
            segments: vec![],
            pieces: vec![],
            start: end,
            end,
            length: 0.0,
            turn: 0.0,
            boxes: vec![],
            closed: false,
        }
    }

    /// Appends a line of `length` metres, positive; 0 appends nothing.
    #[must_use]
    pub fn line(mut self, length: f64) -> Self {
        if length != 0.0 {
            let from = self.end.position;
            let to = from + direction(self.end.tangent) * length;
            self.push(Segment::Line { from: from.into(), to: to.into() });
        }
        self
    }

    /// Appends an arc of `radius` metres through `angle` radians, both positive.
    #[must_use]
    pub fn arc(mut self, side: Side, radius: f64, angle: f64) -> Self {
        let from = self.end.position;
        let to_starboard = starboard(self.end.tangent) * radius;
        let (centre, angle) = match side {
            Side::Port => (from - to_starboard, -angle),
            Side::Starboard => (from + to_starboard, angle),
        };
        self.push(Segment::Arc { from: from.into(), centre: centre.into(), angle_rad: angle });
        self
    }

    /// Lanes of `lane_length`, `lane_spacing` apart, m, with half circles, the first to starboard.
    pub fn lawn_mower(
        start: Vector2<f64>,
        tangent: f64,
        lane_length: f64,
        lane_spacing: f64,
        n_lanes: usize,
    ) -> Self {
        let first = Self::starting_at(start, tangent).line(lane_length);
        (1..n_lanes).fold(first, |path, lane| {
            let side = if lane % 2 == 1 { Side::Starboard } else { Side::Port };
            path.arc(side, 0.5 * lane_spacing, PI).line(lane_length)
        })
    }

    /// Length, m; of one lap of a closed path.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// `true` if the path leads from its end to its beginning.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Its segments; [`Path::from_segments`] restores the same path from them, to the bit.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Its lines and arcs, with way-points already rounded.
    pub fn lines_and_arcs(&self) -> impl Iterator<Item = Segment> {
        self.pieces.iter().map(|piece| {
            let from = piece.start.into();
            if piece.curvature == 0.0 {
                let to = piece.start + direction(piece.tangent) * piece.length;
                return Segment::Line { from, to: to.into() };
            }
            Segment::Arc {
                from,
                centre: (piece.start + starboard(piece.tangent) / piece.curvature).into(),
                angle_rad: piece.curvature * piece.length,
            }
        })
    }

    /// The point at arc length `gamma`, m, any finite number.
    pub fn at(&self, gamma: f64) -> PathPoint {
        let (laps, gamma) = self.lap_of(gamma);
        if !self.closed && gamma < 0.0 {
            return beyond(&self.start, gamma);
        }
        match self.piece_over(gamma) {
            Some(piece) if self.closed || gamma <= piece.end() => {
                let point = piece.at(gamma - piece.from);
                PathPoint { tangent: point.tangent + laps * self.turn_of_a_lap(), ..point }
            }
            _ => beyond(&self.end, gamma - self.length),
        }
    }

    /// Tangent angle, rad, and leg at arc length `gamma`, as of [`Self::at`].
    pub(crate) fn tangent_at(&self, gamma: f64) -> (f64, Leg) {
        let (laps, gamma) = self.lap_of(gamma);
        if !self.closed && gamma < 0.0 {
            return (self.start.tangent, self.start.leg);
        }
        match self.piece_over(gamma) {
            Some(piece) if self.closed || gamma <= piece.end() => {
                let turned = piece.curvature * (gamma - piece.from);
                (piece.tangent + turned + laps * self.turn_of_a_lap(), piece.leg)
            }
            _ => (self.end.tangent, self.end.leg),
        }
    }

    /// `true` if one straight piece holds both arc lengths, on the same lap.
    pub(crate) fn is_straight_between(&self, one: f64, other: f64) -> bool {
        let ((lap, one), (other_lap, other)) = (self.lap_of(one), self.lap_of(other));
        let piece = self.piece_over(one);
        let holds = |piece: &Piece| piece.curvature == 0.0 && piece.from <= other && other <= piece.end();
        lap == other_lap && piece.is_some_and(holds)
    }

    pub(crate) fn total_turn(&self) -> f64 {
        self.turn
    }

    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Completed laps of a closed path before `gamma`, and the arc length since.
    pub(crate) fn lap_of(&self, gamma: f64) -> (f64, f64) {
        if self.closed {
            let laps = (gamma / self.length).floor();
            (laps, (gamma - laps * self.length).max(0.0).min(self.length))
        } else {
            (0.0, gamma)
        }
    }

    /// The last piece that begins at or before `gamma`, on the first lap.
    fn piece_over(&self, gamma: f64) -> Option<&Piece> {
        let after = self.pieces.partition_point(|piece| piece.from <= gamma);
        self.pieces[..after].last()
    }

    /// Turn of one lap in whole turns, free of rounding: 0 for a figure of eight.
    fn turn_of_a_lap(&self) -> f64 {
        TAU * ((self.end.tangent - self.start.tangent) / TAU).round()
    }

    fn push(&mut self, segment: Segment) {
        if let Some(piece) = segment.piece() {
            self.append(piece);
        }
        self.segments.push(segment);
    }

    /// Appends a piece and continues the tangent angle without a jump of 2π.
    pub(super) fn append(&mut self, mut piece: Piece) {
        if !self.pieces.is_empty() {
            piece.tangent = self.end.tangent + wrap(piece.tangent - self.end.tangent);
        }
        piece.from = self.length;
        if self.pieces.is_empty() {
            self.start = PathPoint { curvature: 0.0, ..piece.at(0.0) };
        }
        self.end = PathPoint { curvature: 0.0, ..piece.at(piece.length) };
        self.length += piece.length;
        self.turn += (piece.curvature * piece.length).abs();
        if self.pieces.len().is_multiple_of(BLOCK) {
            self.boxes.push(Extent::NOWHERE);
        }
        if let Some(last) = self.boxes.last_mut() {
            last.take_in(&piece, &self.end.position);
        }
        self.pieces.push(piece);
    }
}

fn beyond(point: &PathPoint, length: f64) -> PathPoint {
    PathPoint { position: point.position + direction(point.tangent) * length, ..*point }
}
