//! Way-points around a box about the target's last fixes.

use nalgebra::Vector2;

use crate::facts::angle::{Course, ned_from_body};
use crate::facts::asc::{AscNow, Limits};
use crate::facts::reference::Reference;
use crate::los::law::LosGains;
use crate::los::saturated::saturated_los;
use crate::predict::motion::Motion;

/// Time between two boxes, s. Source: practice at the Institute for Systems and Robotics, Lisbon.
const BOX_PERIOD: f64 = 360.0;

/// Half length of the box along the target's course, m.
const HALF_LENGTH: f64 = 40.0;

/// Half width of the box, m.
const HALF_WIDTH: f64 = 15.0;

/// Time between two fixes, s: an AUV's slot in an acoustic network.
const FIX_INTERVAL: f64 = 10.0;

/// Distance at which a way-point is reached, m. Assumption: two MEDUSA lengths and a turn.
const REACHED_WITHIN: f64 = 5.0;

/// Fastest speed along the box, m/s: one lap in its time. Assumption: faster is no closer.
const SPEED_ROUND: f64 = 4.0 * (HALF_LENGTH + HALF_WIDTH) / BOX_PERIOD;

/// The present box, and the fixes for the next.
///
/// ```text
/// every 360 s:  c = mean of the last two fixes,  corners c + R(ψ_d) (±40 m, ±15 m)
/// on the leg from corner a to b:  saturated line of sight to b, at rest, on the course from a to b
/// ```
/// Laps go clockwise from the nearest corner. [`saturated_los`] follows the legs at 0.61 m/s at
/// most, slower by k₃ times the distance near a corner. A fix is the target's position every 10 s.
/// A target that jumps by more than half the box's length is another one, with its own box.
///
/// Source: practice at sea with such craft, in the form above; way-point following as in T. I.
/// Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control*, 2nd ed., chapter 12.
/// Without a second fix, the first box is centred on the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WaypointBox {
    fixes: Option<LastFixes>,
    lap: Option<Lap>,
}

/// The last two fixes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastFixes {
    last: Vector2<f64>,
    taken_at: f64,
    before: Option<Vector2<f64>>,
}

/// A box and the present leg.
#[derive(Clone, Debug, PartialEq)]
struct Lap {
    corners: [Vector2<f64>; 4],
    drawn_at: f64,
    from: Vector2<f64>,
    /// Index of the corner at its end.
    to: usize,
}

impl WaypointBox {
    /// The reference at `time`, s. Uses the target's position, and its course for a new box.
    pub fn steer(
        &mut self,
        time: f64,
        asc: &AscNow,
        target: &Motion,
        target_course: Course,
        gains: LosGains,
        limits: &Limits,
    ) -> Reference {
        let jumped = self.take_fix(time, &target.position);
        let lap = match self.lap.take() {
            Some(lap) if !jumped && (0.0..BOX_PERIOD).contains(&(time - lap.drawn_at)) => lap,
            _ => Lap::new(time, asc, &self.centre(&target.position), target_course),
        };
        let lap = lap.past_reached_corners(asc);
        let reference = lap.follow(asc, gains, limits);
        self.lap = Some(lap);
        reference
    }

    /// Stores a fix when due; `true` if the target is another one than at the last fix.
    fn take_fix(&mut self, time: f64, position: &Vector2<f64>) -> bool {
        let first = LastFixes { last: *position, taken_at: time, before: None };
        let Some(fixes) = self.fixes else {
            self.fixes = Some(first);
            return false;
        };
        let jumped = (position - fixes.last).norm() > HALF_LENGTH;
        if jumped || time < fixes.taken_at {
            self.fixes = Some(first);
        } else if FIX_INTERVAL <= time - fixes.taken_at {
            self.fixes = Some(LastFixes { before: Some(fixes.last), ..first });
        }
        jumped
    }

    fn centre(&self, otherwise: &Vector2<f64>) -> Vector2<f64> {
        let mean = |fixes: &LastFixes| 0.5 * (fixes.last + fixes.before.unwrap_or(fixes.last));
        self.fixes.as_ref().map_or(*otherwise, mean)
    }
}

impl Lap {
    fn new(time: f64, asc: &AscNow, centre: &Vector2<f64>, course: Course) -> Self {
        let ned_from_target = ned_from_body(course.radians());
        // Clockwise, seen from above.
        let corners = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(ahead, aside)| {
            centre + ned_from_target * Vector2::new(ahead * HALF_LENGTH, aside * HALF_WIDTH)
        });
        let distance = |i: &usize| (corners[*i] - asc.position).norm();
        let nearest = (0..corners.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        Self { corners, drawn_at: time, from: asc.position, to: nearest.unwrap_or(0) }
    }

    /// Skips all corners that the craft has reached.
    fn past_reached_corners(mut self, asc: &AscNow) -> Self {
        for _ in 0..self.corners.len() {
            let corner = self.corners[self.to];
            let to_go = (corner - asc.position).dot(&self.leg());
            if REACHED_WITHIN < to_go {
                break;
            }
            self.from = corner;
            self.to = (self.to + 1) % self.corners.len();
        }
        self
    }

    fn leg(&self) -> Vector2<f64> {
        let leg = self.corners[self.to] - self.from;
        // A leg of length 0 ends at once, in any direction.
        leg.try_normalize(f64::EPSILON).unwrap_or_else(Vector2::x)
    }

    fn follow(&self, asc: &AscNow, gains: LosGains, limits: &Limits) -> Reference {
        let corner = Motion { position: self.corners[self.to], velocity: Vector2::zeros() };
        let round = Limits { speed_max: limits.speed_max.min(SPEED_ROUND.max(limits.speed_min)), ..*limits };
        saturated_los(asc, &corner, Course::of(&self.leg()), gains, &round)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::los::{
        flight_for_tests::{Flight, craft_at, miss_after, tuning},
        law::LosLaw,
    };
    use crate::tests::prelude::*;

    /// Corners of the box after steps at `looks`, (time, north, east) of a target.
    fn corners(looks: &[(f64, f64, f64)]) -> [Vector2<f64>; 4] {
        let mut following = WaypointBox::default();
        let gains = tuning(LosLaw::WaypointBox).gains;
        let asc = craft_at(Vector2::zeros(), 0.0);
        for (time, north, east) in looks {
            let target = Motion { position: Vector2::new(*north, *east), velocity: Vector2::new(0.2, 0.0) };
            let _ = following.steer(*time, &asc, &target, Course::new(0.0), gains, &Limits::MEDUSA);
        }
        following.lap.expect("was asked").corners
    }

    fn centre(looks: &[(f64, f64, f64)]) -> Vector2<f64> {
        corners(looks).iter().sum::<Vector2<f64>>() / 4.0
    }

    #[test]
    fn the_first_box_is_centred_on_the_first_fix_along_the_target_s_course() {
        let expected = [[140.0, 35.0], [140.0, 65.0], [60.0, 65.0], [60.0, 35.0]];
        for (corner, expected) in corners(&[(0.0, 100.0, 50.0)]).into_iter().zip(expected) {
            near_to(corner, expected.into(), 1e-9);
        }
    }

    #[test]
    fn a_box_lasts_360_s_and_the_next_is_centred_on_the_mean_of_two_fixes() {
        let look = |t| (f64::from(t), 0.2 * f64::from(t), 0.0);
        let looks: Vec<_> = (0..=360).map(look).collect();
        near_to(centre(&looks[..360]), Vector2::zeros(), 1e-9);
        // Fixes at 350 s and 360 s: 70 m and 72 m.
        near_to(centre(&looks), Vector2::new(71.0, 0.0), 1e-9);
    }

    #[test]
    fn a_new_target_gets_a_box_at_once_and_a_scattered_fix_does_not() {
        let after = |east| centre(&[(0.0, 0.0, 0.0), (10.0, 2.0, 0.0), (11.0, 2.0, east)]);
        near_to(after(60.0), Vector2::new(2.0, 60.0), 1e-9);
        near_to(after(20.0), Vector2::zeros(), 1e-9);
    }

    #[test]
    fn a_resting_target_is_circled_on_the_box() {
        let flight = Flight { target_speed: 0.0, start: Vector2::new(-30.0, 5.0), ..Flight::default() };
        let mut quadrants = [false; 4];
        for time in (360..720).step_by(5) {
            let miss = miss_after(time, tuning(LosLaw::WaypointBox), &flight);
            let (along, across) = (miss.x.abs() / HALF_LENGTH, miss.y.abs() / HALF_WIDTH);
            // On the box, up to the corners that are cut or overrun.
            let cut = REACHED_WITHIN / HALF_WIDTH;
            assert!((along.max(across) - 1.0).abs() < cut, "{time} s: {miss}");
            quadrants[usize::from(miss.x < 0.0) + 2 * usize::from(miss.y < 0.0)] = true;
        }
        assert_eq!(quadrants, [true; 4]);
    }
}
