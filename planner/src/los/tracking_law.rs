//! A law with its gains and its memory between steps.

use crate::facts::angle::Course;
use crate::facts::asc::{AscNow, Limits};
use crate::facts::reference::Reference;
use crate::los::integral::{IntegralState, integral_los};
use crate::los::law::{LosLaw, LosTuning};
use crate::los::saturated::saturated_los;
use crate::los::tracker_frame::saturated_los_tracker_frame;
use crate::los::waypoint_box::WaypointBox;
use crate::predict::motion::{Motion, target_course};

/// A law with its gains and its memory, for one step about every second.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingLaw {
    tuning: LosTuning,
    /// Last course of the moving target.
    course: Option<Course>,
    integral: IntegralState,
    waypoint_box: WaypointBox,
}

impl TrackingLaw {
    /// The law at its start. `course`: the target's last one in motion, if known.
    pub fn new(tuning: LosTuning, course: Option<Course>) -> Self {
        Self { tuning, course, integral: IntegralState::default(), waypoint_box: WaypointBox::default() }
    }

    /// The law.
    pub fn law(&self) -> LosLaw {
        self.tuning.law
    }

    /// The reference at `time`, s on any clock. All steps use one frame.
    pub fn steer(&mut self, time: f64, asc: &AscNow, target: &Motion, limits: &Limits) -> Reference {
        let course = target_course(target, self.course);
        self.course = Some(course);
        let gains = self.tuning.gains;
        match self.tuning.law {
            LosLaw::SaturatedLos => saturated_los(asc, target, course, gains, limits),
            LosLaw::TrackerFrame => saturated_los_tracker_frame(asc, target, course, gains, limits),
            LosLaw::Integral => {
                integral_los(time, asc, target, course, &self.tuning, limits, &mut self.integral)
            }
            LosLaw::WaypointBox => self.waypoint_box.steer(time, asc, target, course, gains, limits),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::los::flight_for_tests::{Flight, craft_at, miss_after, tuning};
    use crate::tests::prelude::*;

    #[test]
    fn law_names_are_unique() {
        let mut names = LosLaw::ALL.map(LosLaw::name).to_vec();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), LosLaw::ALL.len());
    }

    #[test]
    fn each_law_settles_on_a_straight_target_in_a_known_current() {
        for (law, seconds, near) in [
            (LosLaw::SaturatedLos, 900, 1e-3),
            (LosLaw::TrackerFrame, 900, 1e-3),
            (LosLaw::Integral, 1800, 0.01),
        ] {
            for current in [Vector2::zeros(), Vector2::new(0.03, 0.12)] {
                for start in [Vector2::new(-20.0, 5.0), Vector2::new(15.0, -9.0)] {
                    let flight = Flight { current, known: current, start, ..Flight::default() };
                    near_to(miss_after(seconds, tuning(law), &flight), Vector2::zeros(), near);
                }
            }
        }
    }

    #[test]
    fn every_law_is_invariant_to_north_and_datum() {
        let turn = 2.1;
        for law in LosLaw::ALL {
            let flight = Flight {
                current: Vector2::new(0.02, 0.05),
                known: Vector2::new(0.02, 0.05),
                ..Flight::default()
            };
            let rotation = ned_from_body(turn);
            let turned = Flight {
                current: rotation * flight.current,
                known: rotation * flight.known,
                start: rotation * flight.start,
                course: flight.course + turn,
                datum: Vector2::new(400.0, -90.0),
                ..flight
            };
            let miss = |flight| miss_after(200, tuning(law), flight);
            near_to(miss(&flight), miss(&turned), 1e-6);
        }
    }

    #[test]
    fn a_resting_target_keeps_its_course() {
        for law in LosLaw::ALL {
            let mut tracking = TrackingLaw::new(tuning(law), Some(Course::new(1.0)));
            let asc = craft_at(Vector2::zeros(), 0.0);
            let noise = Motion { position: Vector2::zeros(), velocity: Vector2::new(-0.01, 0.0) };
            let _ = tracking.steer(0.0, &asc, &noise, &Limits::MEDUSA);
            assert_eq!(tracking.course, Some(Course::new(1.0)));
        }
    }
}
