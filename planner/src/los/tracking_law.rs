//! A law at work: its gains, and what it remembers from one look to the next.

use crate::{
    facts::{
        angle::Course,
        asc::{AscNow, Limits},
        reference::Reference,
    },
    los::{
        integral::{IntegralState, integral_los},
        law::{LosLaw, LosTuning},
        saturated::saturated_los,
        tracker_frame::saturated_los_tracker_frame,
        waypoint_box::WaypointBox,
    },
    predict::motion::{Motion, target_course},
};

/// A law with its gains and its memory. Look about once a second.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingLaw {
    tuning: LosTuning,
    /// The target's course when it last moved.
    course: Option<Course>,
    integral: IntegralState,
    waypoint_box: WaypointBox,
}

impl TrackingLaw {
    /// The law at its start: no integral, no box. `course` is the target's when it last moved, where that is known.
    #[must_use]
    pub fn new(tuning: LosTuning, course: Option<Course>) -> Self {
        Self {
            tuning,
            course,
            integral: IntegralState::default(),
            waypoint_box: WaypointBox::default(),
        }
    }

    /// Which law it is.
    #[must_use]
    pub fn law(&self) -> LosLaw {
        self.tuning.law
    }

    /// The reference at `time`, s on any clock. All positions are in one frame from look to look.
    #[must_use]
    pub fn steer(&mut self, time: f64, asc: &AscNow, target: &Motion, limits: &Limits) -> Reference {
        let course = target_course(target, self.course);
        self.course = Some(course);
        let gains = self.tuning.gains;
        match self.tuning.law {
            LosLaw::SaturatedLos => saturated_los(asc, target, course, gains, limits),
            LosLaw::TrackerFrame => saturated_los_tracker_frame(asc, target, course, gains, limits),
            LosLaw::Integral => integral_los(
                time,
                asc,
                target,
                course,
                &self.tuning,
                limits,
                &mut self.integral,
            ),
            LosLaw::WaypointBox => self.waypoint_box.steer(time, asc, target, course, gains, limits),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::super::flight_for_tests as flight;
    use super::*;
    use crate::facts::angle::ned_from_body;
    use crate::los::flight_for_tests::Flight;
    use crate::los::flight_for_tests::miss_after;

    #[test]
    fn every_name_is_its_own() {
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
                    let flight = Flight {
                        current,
                        known: current,
                        start,
                        ..Flight::default()
                    };
                    let miss = miss_after(seconds, flight::tuning(law), &flight);
                    assert!(miss.norm() < near, "{law:?}: {miss}");
                }
            }
        }
    }

    #[test]
    fn no_law_cares_where_north_or_the_datum_is() {
        let (turn, shift) = (2.1, Vector2::new(400.0, -90.0));
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
                datum: shift,
                ..flight
            };
            let tuning = flight::tuning(law);
            let (here, there) = (miss_after(200, tuning, &flight), miss_after(200, tuning, &turned));
            assert!((here - there).norm() < 1e-6, "{law:?}: {here} and {there}");
        }
    }

    #[test]
    fn a_standing_target_s_course_is_held() {
        for law in LosLaw::ALL {
            let mut tracking = TrackingLaw::new(flight::tuning(law), Some(Course::new(1.0)));
            let asc = AscNow {
                position: Vector2::zeros(),
                heading: crate::facts::angle::Heading::new(0.0),
                current: Vector2::zeros(),
            };
            let noise = Motion {
                position: Vector2::zeros(),
                velocity: Vector2::new(-0.01, 0.0),
            };
            let _ = tracking.steer(0.0, &asc, &noise, &Limits::MEDUSA);
            assert_eq!(tracking.course, Some(Course::new(1.0)));
        }
    }
}
