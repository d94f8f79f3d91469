//! A random survey: way-points in a usual pattern, or in none.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use nalgebra::Vector2;
use planner::{
    angle::{direction, ned_from_body},
    path::{LOOP_FROM, Path, Segment},
};
use rand::{RngExt, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;

use super::invalid::{InvalidScenario, invalid, refused};
use crate::scenario::file::SurveyPattern;

/// Lengths of lanes and legs, in turn radii. Each of a leg's two corners takes up to tan 75° = 3.7.
const LEG: [f64; 2] = [8.0, 30.0];
/// Distances of neighbouring lanes, in turn radii. A half circle takes two.
const SPACING: [f64; 2] = [2.0, 6.0];

/// Fixed properties of a survey; the others are drawn.
pub(super) struct SurveyConstraints {
    pub(super) pattern: Option<SurveyPattern>,
    /// Beginning (north, east), m.
    pub(super) from: Vector2<f64>,
    /// Heading of the first leg, rad.
    pub(super) heading: Option<f64>,
    /// Length of lanes or longest legs, m.
    pub(super) leg: Option<f64>,
    /// Distance of neighbouring lanes, m.
    pub(super) spacing: Option<f64>,
    /// Radius at which the vehicle turns, m.
    pub(super) turn_radius: f64,
}

impl SurveyConstraints {
    /// The survey that `rng` draws for the table `field` of a scenario.
    pub(super) fn draw(&self, field: &str, mut rng: ChaCha8Rng) -> Result<Path, InvalidScenario> {
        let radius = self.turn_radius;
        let at_least = |member: &str, length: f64, radii: f64| {
            if length < radii * radius {
                let reason = format_args!("{length} m is less than {radii} turn radii of {radius} m");
                return refused(format!("{field}.{member}"), reason);
            }
            Ok(length)
        };
        // All are drawn: fixing one changes no other.
        let drawn = *SurveyPattern::DRAWN.choose(&mut rng).expect("is not empty");
        let pattern = self.pattern.unwrap_or(drawn);
        let drawn = rng.random_range(-PI..PI);
        let heading = self.heading.unwrap_or(drawn);
        let drawn = radius * LEG[0] * (LEG[1] / LEG[0]).powf(rng.random_range(0.0..1.0));
        let leg = at_least("leg_m", self.leg.unwrap_or(drawn), LEG[0])?;
        let drawn = radius * rng.random_range(SPACING[0]..SPACING[1]);
        let spacing = at_least("spacing_m", self.spacing.unwrap_or(drawn), SPACING[0])?;
        let side = if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };

        let points = match pattern {
            SurveyPattern::LawnMower => lanes(rng.random_range(4..=12), leg, spacing),
            SurveyPattern::ThereAndBack => vec![Vector2::zeros(), Vector2::new(leg, 0.0)],
            SurveyPattern::Box => lanes(2, leg, leg.min(rng.random_range(LEG[0]..LEG[1]) * radius)),
            SurveyPattern::Racetrack => lanes(2, leg, spacing),
            SurveyPattern::ExpandingSquare => expanding_square(leg, spacing),
            SurveyPattern::Waypoints => without_pattern(leg, radius, &mut rng),
            SurveyPattern::UnequalLanes => {
                let n = rng.random_range(4..=12);
                let mut points = lanes(n, leg, spacing);
                // Both points of a turn.
                for turn in points[1..].chunks_mut(2) {
                    let shorter = leg * rng.random_range(0.0..0.4);
                    let inwards = if turn[0].x == 0.0 { shorter } else { -shorter };
                    for point in turn {
                        point.x += inwards;
                    }
                }
                points
            }
            SurveyPattern::Spiral => spiral(leg, spacing),
            SurveyPattern::FigureOfEight => {
                let wide = 2.0 * spacing;
                let corners = [[0.0, 0.0], [leg, wide], [leg, 0.0], [0.0, wide]];
                corners.map(Vector2::from).into()
            }
        };
        let to_ned = ned_from_body(heading);
        let place =
            |point: &Vector2<f64>| (self.from + to_ned * Vector2::new(point.x, side * point.y)).into();
        let waypoints = Segment::Waypoints {
            points: points.iter().map(place).collect(),
            fillet_m: None,
            turn_radius_m: Some(match pattern {
                SurveyPattern::LawnMower | SurveyPattern::Racetrack => 0.5 * spacing,
                // As round as its points allow.
                SurveyPattern::Spiral => leg,
                _ => radius,
            }),
            legs: vec![],
        };
        let closed = matches!(
            pattern,
            SurveyPattern::ThereAndBack
                | SurveyPattern::Box
                | SurveyPattern::Racetrack
                | SurveyPattern::FigureOfEight
        );
        Path::from_segments(&[waypoints], closed).map_err(|error| invalid(field, error))
    }
}

/// Corners of parallel lanes (ahead, starboard), m.
fn lanes(n: u32, length: f64, spacing: f64) -> Vec<Vector2<f64>> {
    let lane = |k: u32| {
        let starboard = f64::from(k) * spacing;
        let ends = [0.0, length].map(|ahead| Vector2::new(ahead, starboard));
        if k.is_multiple_of(2) { ends } else { [ends[1], ends[0]] }
    };
    (0..n).flat_map(lane).collect()
}

/// Two legs of each multiple of a spacing, up to `longest` m, each at a right angle to the last.
fn expanding_square(longest: f64, spacing: f64) -> Vec<Vector2<f64>> {
    // At least six legs.
    let spacing = spacing.min(longest / 3.0);
    let legs = (0..)
        .map(|k: u32| (k, f64::from(k / 2 + 1) * spacing))
        .take_while(|(_, length)| *length <= longest * (1.0 + f64::EPSILON))
        .map(|(k, length)| direction(f64::from(k) * FRAC_PI_2) * length);
    joined(legs)
}

/// Points an eighth of a turn apart on a spiral of turns `spacing` m apart, within `longest` m.
fn spiral(longest: f64, spacing: f64) -> Vec<Vector2<f64>> {
    let at = |k: u32| direction(f64::from(k) * FRAC_PI_4) * spacing * (1.0 + 0.125 * f64::from(k));
    let points = (0..).map(at).take_while(|point| point.norm() <= longest);
    points.map(|point| point - at(0)).collect()
}

/// Legs of lengths up to `longest` m, with turns that need no loop.
fn without_pattern(longest: f64, radius: f64, rng: &mut ChaCha8Rng) -> Vec<Vector2<f64>> {
    let mut heading = 0.0;
    let legs = (0..rng.random_range(6..=12)).map(|_| {
        let leg = direction(heading) * rng.random_range(LEG[0] * radius..=longest);
        heading += rng.random_range(-LOOP_FROM..LOOP_FROM);
        leg
    });
    joined(legs)
}

fn joined(legs: impl Iterator<Item = Vector2<f64>>) -> Vec<Vector2<f64>> {
    let mut points = vec![Vector2::zeros()];
    for leg in legs {
        points.push(points[points.len() - 1] + leg);
    }
    points
}
