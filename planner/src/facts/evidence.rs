//! Evidence of an AUV's position: its state, or the reports from which it is estimated.

use nalgebra::{Matrix4, Vector2};
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::angle::Course;

/// An AUV slower than this over ground is at rest, m/s. A quarter of known vehicles' slowest speed
/// (0.193 m/s); below it the course is noise.
pub const SPEED_AT_REST: f64 = 0.05;

/// Oldest report for a forecast, s; older, the AUV is held at its last position. Assumption: in an
/// hour an unknown current displaces it by the length of any forecast.
pub(crate) const FORECAST_AGE_MAX: f64 = 3600.0;

/// State of an underwater vehicle at the time of its last report.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AuvState {
    /// Position north of the datum, m.
    pub north_m: f64,
    /// Position east of the datum, m.
    pub east_m: f64,
    /// Latitude, degrees, positive north. Needs `origin`, `lon_deg`; replaces `north_m`, `east_m`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    pub lon_deg: Option<f64>,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Course over ground, rad, within ±2π.
    pub course_rad: f64,
    /// Horizontal speed over ground, m/s, never negative.
    pub speed_mps: f64,
    /// Rate of turn of the course, rad/s, positive clockwise. Default, also for 0: from the courses
    /// of this state and of the one in `previous_plan.targets`, else 0.
    #[serde(default)]
    pub turn_rate_radps: f64,
    /// Age of the report, s. From 15 minutes a goal that needs this vehicle now is held, and limits
    /// about it do not count; from an hour the vehicle is assumed at rest. Default: 0.
    #[serde(default)]
    pub age_s: f64,
    /// Covariance of north, east, north velocity and east velocity at that time, row by row, in m²,
    /// m²/s and m²/s²; symmetric, no eigenvalue negative. Default: unknown.
    pub covariance: Option<[[f64; 4]; 4]>,
}

impl AuvState {
    /// The present state of an AUV at `position` (north, east), m, and `depth`, m, on a straight
    /// course at `speed` over ground, m/s. Its covariance is unknown.
    pub fn new(position: Vector2<f64>, depth: f64, course: Course, speed: f64) -> Self {
        Self {
            north_m: position.x,
            east_m: position.y,
            lat_deg: None,
            lon_deg: None,
            depth_m: depth,
            course_rad: course.radians(),
            speed_mps: speed,
            turn_rate_radps: 0.0,
            age_s: 0.0,
            covariance: None,
        }
    }

    /// Position (north, east) at the time of the report, m.
    pub fn position(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }

    /// Course over ground χ.
    pub fn course(&self) -> Course {
        Course::new(self.course_rad)
    }

    /// Velocity over ground (north, east), m/s.
    pub fn velocity(&self) -> Vector2<f64> {
        self.course().unit() * self.speed_mps
    }

    /// Covariance of (north, east, north velocity, east velocity) at that time, if known.
    pub fn covariance(&self) -> Option<Matrix4<f64>> {
        self.covariance.map(|rows| Matrix4::from_fn(|row, column| rows[row][column]))
    }

    /// Root-mean-square distance from the vehicle at that time, m, if known.
    pub(crate) fn position_sigma(&self) -> Option<f64> {
        let variance = |known: Matrix4<f64>| known.m11 + known.m22;
        self.covariance().map(|known| variance(known).max(0.0).sqrt())
    }
}

/// A measured position of an underwater vehicle, or a range to it, with the telemetry sent with it.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// Time of sending, not of arrival, s on the request's clock; up to 1 s in the future counts as
    /// now. If all reports are older than an hour, only the newest counts.
    pub t_s: f64,
    /// Position north of the datum, m. Required unless `range_m` or `travel` is given.
    pub north_m: Option<f64>,
    /// Position east of the datum, m. Required unless `range_m` or `travel` is given.
    pub east_m: Option<f64>,
    /// Latitude, degrees, positive north. Needs `origin`, `lon_deg`; replaces `north_m`, `east_m`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    pub lon_deg: Option<f64>,
    /// Measured slant range, m, instead of a position. Multipath makes it longer, never shorter.
    pub range_m: Option<f64>,
    /// Measured travel time, instead of `range_m`.
    pub travel: Option<TravelTime>,
    /// Position [north, east] of the surface craft when it measured the range, m. Default: where it
    /// was at `t_s`: in a request for ranges of the last 2 s, in a mission by its reported states
    /// within 2 s.
    pub from: Option<[f64; 2]>,
    /// Standard deviation of the position along either axis, or of the range with the error of
    /// `from`, m. The estimator raises it if the measurements scatter more.
    pub sigma_m: f64,
    /// Telemetered depth, m, positive down. Default: not reported; 0 if no report states it.
    pub depth_m: Option<f64>,
    /// Telemetered course over ground, rad, within ±2π. Needs `speed_mps`.
    pub course_rad: Option<f64>,
    /// Telemetered horizontal speed over ground, m/s, never negative. Needs `course_rad`. Fixes
    /// that contradict course and speed override them.
    pub speed_mps: Option<f64>,
    /// Telemetered rate of turn of the course, rad/s, positive clockwise. The newest is used for 60
    /// s; without one, the courses of the two newest reports give the rate. Default: not reported.
    pub turn_rate_radps: Option<f64>,
}

/// Travel time of sound between the surface craft and an underwater vehicle.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TravelTime {
    /// From sending to reception, s: one way, or with `reply_delay_s` there and back.
    pub time_s: f64,
    /// Time from reception at the vehicle to its reply, s. Default: the time is that of one way.
    pub reply_delay_s: Option<f64>,
    /// Mean speed of sound along the way, m/s.
    #[serde(default = "sound_speed")]
    #[schema(default = sound_speed)]
    pub sound_speed_mps: f64,
}

/// Speed of sound in sea water of 13 °C and a salinity of 35 at the surface, m/s.
fn sound_speed() -> f64 {
    1500.0
}

impl TravelTime {
    /// Slant range, m.
    pub(crate) fn range(&self) -> f64 {
        let Self { time_s, reply_delay_s, sound_speed_mps } = self;
        sound_speed_mps * reply_delay_s.map_or(*time_s, |delay| 0.5 * (time_s - delay))
    }
}

impl Report {
    /// `true` for a range, `false` for a position.
    pub fn is_range(&self) -> bool {
        self.range_m.is_some() || self.travel.is_some()
    }

    /// Makes a range of a travel time.
    pub fn measure(&mut self) {
        self.range_m = self.travel.take().map(|travel| travel.range()).or(self.range_m);
    }

    /// A position (north, east), m, at time `t_s` with standard deviation `sigma_m`; no telemetry.
    pub fn new(t_s: f64, position: Vector2<f64>, sigma_m: f64) -> Self {
        Self {
            t_s,
            north_m: Some(position.x),
            east_m: Some(position.y),
            lat_deg: None,
            lon_deg: None,
            range_m: None,
            travel: None,
            from: None,
            sigma_m,
            depth_m: None,
            course_rad: None,
            speed_mps: None,
            turn_rate_radps: None,
        }
    }

    /// The same report with a telemetered course and speed.
    #[must_use]
    pub fn with_ground_track(self, track: Option<GroundTrack>) -> Self {
        Self {
            course_rad: track.map(|track| track.course.radians()),
            speed_mps: track.map(|track| track.speed),
            ..self
        }
    }

    /// A range from a place (north, east), m, at time `t_s` with standard deviation `sigma_m`.
    pub fn ranged(t_s: f64, range_m: f64, from: Option<Vector2<f64>>, sigma_m: f64) -> Self {
        let fix = Self::new(t_s, Vector2::zeros(), sigma_m);
        Self { north_m: None, east_m: None, range_m: Some(range_m), from: from.map(Into::into), ..fix }
    }

    /// Measured position (north, east), m; of a range the place from which it was measured.
    pub fn position(&self) -> Vector2<f64> {
        let fix = || [self.north_m.unwrap_or_default(), self.east_m.unwrap_or_default()];
        self.from.unwrap_or_else(fix).into()
    }

    /// Moves its position, or the place from which its range was measured.
    pub fn move_position(&mut self, moved: impl Fn(&Vector2<f64>) -> Vector2<f64>) {
        if let (Some(north), Some(east)) = (&mut self.north_m, &mut self.east_m) {
            let position = moved(&Vector2::new(*north, *east));
            (*north, *east) = (position.x, position.y);
        }
        self.from = self.from.map(|from| moved(&from.into()).into());
    }

    /// Telemetered course and speed.
    pub fn ground_track(&self) -> Option<GroundTrack> {
        Some(GroundTrack { course: Course::new(self.course_rad?), speed: self.speed_mps? })
    }
}

/// Telemetered motion of a vehicle over ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundTrack {
    /// Course over ground χ.
    pub course: Course,
    /// Horizontal speed over ground, m/s, never negative.
    pub speed: f64,
}

impl GroundTrack {
    /// Velocity over ground (north, east), m/s.
    pub fn velocity(&self) -> Vector2<f64> {
        self.course.unit() * self.speed
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use crate::tests::prelude::*;

    /// A request with one report of the vehicle, 43.5 m from the craft at the origin.
    fn heard(measured: &serde_json::Value) -> Result<Snapshot, Vec<String>> {
        let mut report = json!({ "t_s": 0.0, "sigma_m": 1.0, "depth_m": 20.0, "from": [0.0, 0.0] });
        report.as_object_mut().expect("is one").extend(measured.as_object().expect("is one").clone());
        let reports = vec![serde_json::from_value(report).expect("is a report")];
        let auv =
            Auv { state: None, reports: Some(reports), ..Auv::new("a", moving(0.0, 0.0, 0.0, 0.0, 0.0)) };
        let asc = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.5);
        let goal = Goal::Midpoint { auvs: vec!["a".into()] };
        let snapshot = Snapshot::try_from(PlanRequest::new(0.0, asc, vec![auv], goal));
        snapshot.map_err(|refused| {
            refused.0.into_iter().map(|fault| format!("{} {}", fault.pointer, fault.code)).collect()
        })
    }

    #[test]
    fn a_travel_time_is_the_range_that_sound_has_covered() {
        let spread = |measured| {
            let snapshot = heard(&measured).expect("is valid");
            let estimate = &snapshot.estimates()[0];
            format!("{:?}", estimate.state)
        };
        let ranged = spread(json!({ "range_m": 43.5 }));
        // 29 ms one way; there and back with a reply after 100 ms; 30 ms where sound is slower.
        for travel in [
            json!({ "time_s": 0.029 }),
            json!({ "time_s": 0.158, "reply_delay_s": 0.1 }),
            json!({ "time_s": 0.03, "sound_speed_mps": 1450.0 }),
        ] {
            assert_eq!(spread(json!({ "travel": travel })), ranged);
        }
    }

    #[test]
    fn travel_times_that_are_no_ranges_are_refused_by_name() {
        for (measured, fault) in [
            (json!({ "travel": { "time_s": 0.05, "reply_delay_s": 0.1 } }), "travel/time_s out_of_range"),
            (json!({ "travel": { "time_s": 130.0 } }), "travel/time_s out_of_range"),
            (json!({ "travel": { "time_s": 20.0 } }), "travel/time_s out_of_range"),
            (
                json!({ "travel": { "time_s": 0.1, "sound_speed_mps": 340.0 } }),
                "travel/sound_speed_mps out_of_range",
            ),
            (json!({ "travel": { "time_s": 0.1 }, "range_m": 150.0 }), "travel unexpected"),
            (json!({ "travel": { "time_s": 0.1 }, "north_m": 1.0 }), "north_m unexpected"),
        ] {
            let faults = heard(&measured).expect_err("is refused");
            assert_eq!(faults, [format!("/auvs/0/reports/0/{fault}")]);
        }
    }
}
