//! A recorded track that an AUV repeats, straight and at a steady speed between recorded points.

use nalgebra::Vector2;
use planner::{
    angle::{Course, wrap},
    forecast::SPEED_AT_REST,
};

/// A recorded point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Time since the start of the mission, s.
    pub time: f64,
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Depth, m.
    pub depth: f64,
}

/// Points of increasing times, at least one. The vehicle rests outside of these times.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedTrack(Vec<TrackPoint>);

/// Position and velocity at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackMotion {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Depth, m.
    pub depth: f64,
    /// Velocity over ground (north, east), m/s: difference of the points around, over time.
    pub velocity: Vector2<f64>,
    /// Rate of the depth, m/s.
    pub descent: f64,
    /// Rate of turn, rad/s, between the middles of the two legs around; 0 if one is at rest.
    pub turn_rate: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct LegMotion {
    middle: f64,
    velocity: Vector2<f64>,
    descent: f64,
}

impl RecordedTrack {
    /// The track through `points`, whose times increase.
    ///
    /// # Panics
    ///
    /// Without a point, or if times do not increase: the reader of a file checks both.
    pub fn new(points: Vec<TrackPoint>) -> Self {
        assert!(
            !points.is_empty() && points.is_sorted_by(|one, next| one.time < next.time),
            "a reader checks the points"
        );
        Self(points)
    }

    /// Position and motion at `time` s.
    pub fn at(&self, time: f64) -> TrackMotion {
        let passed = self.0.partition_point(|point| point.time <= time);
        let from = self.0[passed.saturating_sub(1)];
        let leg = self.leg(passed);
        let elapsed = (time - from.time).max(0.0);
        TrackMotion {
            position: from.position + leg.velocity * elapsed,
            depth: from.depth + leg.descent * elapsed,
            velocity: leg.velocity,
            descent: leg.descent,
            turn_rate: self.turn_rate(passed),
        }
    }

    /// Its points; if more than `most`, every n-th and the last.
    pub fn outline(&self, most: usize) -> Vec<Vector2<f64>> {
        let every = self.0.len().div_ceil(most).max(1);
        let points = self.0.iter().step_by(every).chain(self.0.last());
        points.map(|point| point.position).collect()
    }

    /// The leg that ends at point number `to`; at rest before the first and after the last.
    fn leg(&self, to: usize) -> LegMotion {
        let (Some(from), Some(to)) = (to.checked_sub(1).and_then(|from| self.0.get(from)), self.0.get(to))
        else {
            return LegMotion::default();
        };
        let duration = to.time - from.time;
        LegMotion {
            middle: 0.5 * (from.time + to.time),
            velocity: (to.position - from.position) / duration,
            descent: (to.depth - from.depth) / duration,
        }
    }

    fn turn_rate(&self, to: usize) -> f64 {
        let around = [to.saturating_sub(1), to, to + 1].map(|to| self.leg(to));
        if around.iter().any(|leg| leg.velocity.norm() < SPEED_AT_REST) {
            return 0.0;
        }
        let [before, _, after] = around;
        let turned = Course::of(&after.velocity).radians() - Course::of(&before.velocity).radians();
        wrap(turned) / (after.middle - before.middle)
    }
}

#[cfg(test)]
mod tests {
    use planner::angle::direction;

    use super::*;
    use crate::tests::{near, near_to};

    /// A circle of radius 20 m at 0.5 m/s, recorded once in two seconds, diving at 0.1 m/s.
    fn circle() -> RecordedTrack {
        let point = |k: u32| {
            let time = 2.0 * f64::from(k);
            TrackPoint { time, position: direction(0.025 * time) * 20.0, depth: 0.1 * time }
        };
        RecordedTrack::new((0..50).map(point).collect())
    }

    #[test]
    fn a_circle_keeps_its_speed_and_rate_of_turn() {
        let track = circle();
        for time in [4.0, 17.3, 60.9] {
            let motion = track.at(time);
            // The chord of 1 m lies 6 mm inside the arc of radius 20 m, and is 1e-4 shorter.
            near(motion.position.norm(), 20.0, 0.007);
            near(motion.velocity.norm(), 0.5, 1e-4);
            near(motion.turn_rate, 0.025, 1e-9);
            near(motion.depth, 0.1 * time, 1e-9);
            let step = 1e-3;
            let moved = (track.at(time + step).position - motion.position) / step;
            near_to(moved, motion.velocity, 1e-9);
        }
    }

    #[test]
    fn the_vehicle_rests_before_the_first_and_after_the_last_point() {
        let track = circle();
        for (time, at) in [(-5.0, 0.0), (98.0, 98.0), (1e6, 98.0)] {
            let motion = track.at(time);
            near_to(motion.position, track.at(at).position, 1e-12);
            assert_eq!(motion.velocity, Vector2::zeros());
            assert_eq!((motion.descent, motion.turn_rate), (0.0, 0.0));
        }
    }

    #[test]
    fn an_outline_has_both_ends_and_at_most_one_extra_point() {
        let track = circle();
        for most in [1, 7, 50, 1000] {
            let outline = track.outline(most);
            assert!(outline.len() <= most + 1, "{most}: {}", outline.len());
            assert_eq!(outline.first(), Some(&track.at(0.0).position));
            assert_eq!(outline.last(), Some(&track.at(98.0).position));
        }
    }
}
