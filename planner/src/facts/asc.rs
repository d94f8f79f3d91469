//! State and limits of the surface craft.

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::angle::{Heading, ned_from_body};
use crate::facts::ranges::{LIMITS, LIMITS_ALONE, MapNumber, Range};

/// Inputs of a guidance law that describe the surface craft and its water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AscNow {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Heading ψ.
    pub heading: Heading,
    /// Current (north, east), m/s; zero where unknown.
    pub current: Vector2<f64>,
}

/// State of the surface craft.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Asc {
    /// Position north of the datum, m.
    #[serde(skip_serializing_if = "is_left_out")]
    pub north_m: f64,
    /// Position east of the datum, m.
    #[serde(skip_serializing_if = "is_left_out")]
    pub east_m: f64,
    /// Latitude, degrees, positive north. Needs `origin`, `lon_deg`; replaces `north_m`, `east_m`.
    pub lat_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    pub lon_deg: Option<f64>,
    /// Heading, rad, within ±2π.
    #[doc(alias = "psi")]
    pub heading_rad: f64,
    /// Surge speed through the water, m/s, positive ahead.
    pub speed_mps: f64,
    /// Sway speed through the water, m/s, positive to starboard. Default: 0.
    #[serde(default)]
    pub sway_mps: f64,
    /// Yaw rate, rad/s, positive clockwise seen from above. Default: 0.
    #[serde(default)]
    pub yaw_rate_radps: f64,
    /// Northward velocity over ground, m/s. Needs `ground_east_mps`.
    pub ground_north_mps: Option<f64>,
    /// Eastward velocity over ground, m/s. Needs `ground_north_mps`.
    pub ground_east_mps: Option<f64>,
}

/// `true` for metres that the service computes from degrees.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references on")]
fn is_left_out(metres: &f64) -> bool {
    metres.is_nan()
}

impl Asc {
    /// A craft at `position` (north, east), m, with `surge` speed through the water, m/s. Sway and
    /// yaw rate are 0; the velocity over ground is unknown.
    pub fn new(position: Vector2<f64>, heading: Heading, surge: f64) -> Self {
        Self {
            north_m: position.x,
            east_m: position.y,
            lat_deg: None,
            lon_deg: None,
            heading_rad: heading.radians(),
            speed_mps: surge,
            sway_mps: 0.0,
            yaw_rate_radps: 0.0,
            ground_north_mps: None,
            ground_east_mps: None,
        }
    }

    /// The same craft with a velocity over ground (north, east), m/s.
    #[must_use]
    pub fn with_ground_velocity(self, velocity: Option<Vector2<f64>>) -> Self {
        Self { ground_north_mps: velocity.map(|v| v.x), ground_east_mps: velocity.map(|v| v.y), ..self }
    }

    /// Position (north, east), m.
    pub fn position(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }

    /// Heading ψ.
    pub fn heading(&self) -> Heading {
        Heading::new(self.heading_rad)
    }

    /// Velocity over ground (north, east), m/s, where a GNSS receiver gives it.
    pub fn ground_velocity(&self) -> Option<Vector2<f64>> {
        Some(Vector2::new(self.ground_north_mps?, self.ground_east_mps?))
    }

    /// Velocity through the water (north, east), m/s.
    pub fn water_velocity(&self) -> Vector2<f64> {
        ned_from_body(self.heading().radians()) * Vector2::new(self.speed_mps, self.sway_mps)
    }

    /// Velocity over ground minus velocity through the water (north, east), m/s, unchecked.
    pub fn apparent_current(&self) -> Option<Vector2<f64>> {
        Some(self.ground_velocity()? - self.water_velocity())
    }
}

/// Limits that the operator sets for the surface craft.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = Limits)]
#[schemars(rename = "Limits")]
pub struct DeclaredLimits<N = f64> {
    /// Slowest speed reference through the water, m/s. Default: 0.05.
    #[schema(value_type = Option<f64>)]
    pub speed_min_mps: Option<N>,
    /// Fastest speed reference, m/s: through the water, or over ground if held. Default: 1.5.
    #[schema(value_type = Option<f64>)]
    pub speed_max_mps: Option<N>,
    /// Largest yaw rate, rad/s. Default: the craft's.
    #[schema(value_type = Option<f64>)]
    pub turn_rate_max_radps: Option<N>,
    /// Largest acceleration ahead, m/s². Default: the craft's.
    #[schema(value_type = Option<f64>)]
    pub acceleration_max_mps2: Option<N>,
    /// Largest deceleration, m/s², positive. Default: the craft's.
    #[schema(value_type = Option<f64>)]
    pub deceleration_max_mps2: Option<N>,
    /// Time constant of the surge loop, s; `craft` overrides it. Default: the craft's.
    #[schema(value_type = Option<f64>)]
    pub surge_lag_s: Option<N>,
}

impl<N> DeclaredLimits<N> {
    /// The same limits with other numbers. `number` maps each one, with its name, in this order.
    pub fn map<M>(&self, number: MapNumber<'_, N, M>) -> DeclaredLimits<M> {
        let mut of = |(member, range): &Range, given: &Option<N>| number(member, range, given.as_ref());
        let [speed_min, turn_rate_max, acceleration_max, deceleration_max] = &LIMITS;
        let [speed_max, surge_lag] = &LIMITS_ALONE;
        DeclaredLimits {
            speed_min_mps: of(speed_min, &self.speed_min_mps),
            speed_max_mps: of(speed_max, &self.speed_max_mps),
            turn_rate_max_radps: of(turn_rate_max, &self.turn_rate_max_radps),
            acceleration_max_mps2: of(acceleration_max, &self.acceleration_max_mps2),
            deceleration_max_mps2: of(deceleration_max, &self.deceleration_max_mps2),
            surge_lag_s: of(surge_lag, &self.surge_lag_s),
        }
    }
}

impl From<Limits> for DeclaredLimits {
    fn from(limits: Limits) -> Self {
        Self {
            speed_min_mps: Some(limits.speed_min),
            speed_max_mps: Some(limits.speed_max),
            turn_rate_max_radps: Some(limits.turn_rate_max),
            acceleration_max_mps2: Some(limits.acceleration_max),
            deceleration_max_mps2: Some(limits.deceleration_max),
            surge_lag_s: None,
        }
    }
}

/// Limits of the surface craft. Undeclared ones are those of [`Limits::ANY`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Slowest speed reference through the water, m/s; slower, the craft does not steer.
    pub speed_min: f64,
    /// Fastest speed reference, m/s: through the water, or over ground if the craft holds that.
    pub speed_max: f64,
    /// Largest yaw rate, rad/s.
    pub turn_rate_max: f64,
    /// Largest acceleration ahead, m/s².
    pub acceleration_max: f64,
    /// Largest deceleration, m/s², positive.
    pub deceleration_max: f64,
}

impl From<&DeclaredLimits> for Limits {
    fn from(declared: &DeclaredLimits) -> Self {
        declared.with_defaults(&Self::ANY)
    }
}

impl DeclaredLimits {
    /// The declared limits, and those of `others` that are not declared.
    pub fn with_defaults(&self, others: &Limits) -> Limits {
        Limits {
            speed_min: self.speed_min_mps.unwrap_or(others.speed_min),
            speed_max: self.speed_max_mps.unwrap_or(others.speed_max),
            turn_rate_max: self.turn_rate_max_radps.unwrap_or(others.turn_rate_max),
            acceleration_max: self.acceleration_max_mps2.unwrap_or(others.acceleration_max),
            deceleration_max: self.deceleration_max_mps2.unwrap_or(others.deceleration_max),
        }
    }
}

impl Limits {
    /// Speeds of a small craft; turns and accelerations are not limited.
    pub const ANY: Self = Self {
        speed_min: 0.05,
        speed_max: 1.5,
        turn_rate_max: 3.0,
        acceleration_max: 5.0,
        deceleration_max: 5.0,
    };

    /// Limits of the simulated MEDUSA-class craft: those of its hull.
    pub const MEDUSA: Self = Self {
        speed_min: 0.05,
        speed_max: 1.5,
        turn_rate_max: 0.3,
        acceleration_max: 0.09,
        deceleration_max: 0.09,
    };
}
