//! From what a client's JSON tells of where an AUV is.

use nalgebra::{Matrix4, Vector2};
use planner::{
    angle::Course,
    snapshot::{self as domain, Evidence, GroundTrack},
};

use super::request::{Auv, AuvState, Report};
use crate::FieldError;

/// The state or the reports of the AUV at `pointer`; where there is neither or both, that goes into `invalid`.
pub(super) fn evidence(pointer: &str, auv: &Auv, invalid: &mut Vec<FieldError>) -> Option<Evidence> {
    match (&auv.state, &auv.reports) {
        (Some(given), None) => Some(Evidence::State(state(given))),
        (None, Some(reports)) => Some(Evidence::Reports(
            reports
                .iter()
                .enumerate()
                .map(|(j, given)| report(&format!("{pointer}/reports/{j}"), given, invalid))
                .collect(),
        )),
        (None, None) => {
            let detail = "either `state` or `reports` must say where the vehicle is";
            invalid.push(FieldError::new(format!("{pointer}/state"), "missing", detail));
            None
        }
        (Some(_), Some(_)) => {
            let detail = "either `state` or `reports` says where the vehicle is, not both";
            invalid.push(FieldError::new(
                format!("{pointer}/reports"),
                "unexpected",
                detail,
            ));
            None
        }
    }
}

fn state(given: &AuvState) -> domain::AuvState {
    domain::AuvState {
        position: Vector2::new(given.north_m, given.east_m),
        depth: given.depth_m,
        course: Course::new(given.course_rad),
        speed: given.speed_mps,
        turn_rate: given.turn_rate_radps,
        age: given.age_s,
        covariance: given
            .covariance
            .map(|rows| Matrix4::from_fn(|row, column| rows[row][column])),
    }
}

fn report(pointer: &str, given: &Report, invalid: &mut Vec<FieldError>) -> domain::Report {
    let ground_track = match (given.course_rad, given.speed_mps) {
        (Some(course), Some(speed)) => Some(GroundTrack {
            course: Course::new(course),
            speed,
        }),
        (None, None) => None,
        (given_course, _) => {
            let name = if given_course.is_some() {
                "speed_mps"
            } else {
                "course_rad"
            };
            let detail = "course and speed come together or not at all";
            invalid.push(FieldError::new(format!("{pointer}/{name}"), "missing", detail));
            None
        }
    };
    domain::Report {
        time: given.t_s,
        position: Vector2::new(given.north_m, given.east_m),
        sigma: given.sigma_m,
        depth: given.depth_m,
        ground_track,
        turn_rate: given.turn_rate_radps,
    }
}
