//! The closed loops of a craft as data.

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::angle::{Heading, angle_of};
use crate::facts::reference::Reference;

/// Least speed over ground with a usable course, m/s.
const SPEED_WITHOUT_COURSE: f64 = 0.05;

/// Closed-loop response of a surface craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Craft {
    /// Response of the heading loop.
    pub heading: HeadingResponse,
    /// Response of the speed loop.
    pub surge: SurgeResponse,
    /// Sway per surge and yaw rate k_β, s, positive for an outward drift in a turn: v = −k_β u r.
    #[doc(alias = "k_beta")]
    pub sway_per_yaw_rate: f64,
    /// Propulsion power at a steady speed.
    pub power: Power,
    /// Quantity that the speed loop holds.
    pub speed_held: SpeedReference,
    /// Quantity that the heading loop holds.
    pub heading_held: HeadingReference,
}

/// Response of the heading loop to a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingResponse {
    /// Its dynamics after the delay.
    pub dynamics: HeadingDynamics,
    /// Delay t_d before a reference acts, s.
    pub delay: f64,
    /// Largest yaw rate of the loop r_max, rad/s.
    pub rate_max: f64,
}

/// Dynamics of a heading loop between its delay and its rate limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeadingDynamics {
    /// T ψ̇ = ψ_ref − ψ.
    FirstOrder {
        /// Time constant T, s.
        time_constant: f64,
    },
    /// ψ̈ = ω²(ψ_ref − ψ) − 2ζω ψ̇.
    SecondOrder {
        /// Natural frequency ω, rad/s.
        natural_frequency: f64,
        /// Damping ratio ζ.
        damping: f64,
    },
}

/// Response of the speed loop to a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurgeResponse {
    /// Time constant of the response to a small step T_u, s.
    pub time_constant: f64,
    /// Delay before a reference acts, s.
    pub delay: f64,
    /// Largest acceleration ahead, m/s².
    pub acceleration_max: f64,
    /// Largest deceleration, m/s², positive.
    pub deceleration_max: f64,
    /// Integral time T_i, s: the integrator then equals the proportional part. `None` without an
    /// integrator, or if it winds up negligibly.
    pub integral_time: Option<f64>,
}

/// Propulsion power at a steady speed u through the water: linear · u + cubic · u³.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Power", bound = "N: JsonSchema + Default")]
pub struct Power<N = f64> {
    /// Linear coefficient, W/(m/s); 0 if left out.
    #[serde(default)]
    #[schema(value_type = f64)]
    pub linear_w_per_mps: N,
    /// Cubic coefficient, W/(m/s)³; 0 if left out.
    #[serde(default)]
    #[schema(value_type = f64, example = 27.5)]
    pub cubic_w_per_mps3: N,
}

/// Quantity that a speed loop measures and holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpeedReference {
    /// Surge speed through the water.
    ThroughWater,
    /// Velocity over ground along the bow.
    OverGround,
}

/// Quantity that a heading loop measures and holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeadingReference {
    /// Direction of the bow ψ.
    Heading,
    /// Direction of the velocity over ground χ.
    Course,
}

impl Craft {
    /// The command that makes the craft move through the water as `reference` says, in a `current`
    /// (north, east), m/s. A loop over ground gets the velocity over ground along the bow, up to
    /// `speed_max`, m/s; a course loop gets the direction of that velocity.
    pub fn command(&self, reference: &Reference, current: &Vector2<f64>, speed_max: f64) -> Reference {
        let ahead = reference.heading.unit();
        let over_ground = ahead * reference.speed + current;
        Reference {
            speed: match self.speed_held {
                SpeedReference::ThroughWater => reference.speed,
                SpeedReference::OverGround => over_ground.dot(&ahead).clamp(0.0, speed_max),
            },
            heading: match self.heading_held {
                HeadingReference::Course if SPEED_WITHOUT_COURSE <= over_ground.norm() => {
                    Heading::new(angle_of(&over_ground))
                }
                HeadingReference::Course | HeadingReference::Heading => reference.heading,
            },
        }
    }
}

impl HeadingDynamics {
    /// Lag behind a reference that turns steadily, s: T, or 2ζ/ω.
    pub fn lag(self) -> f64 {
        match self {
            Self::FirstOrder { time_constant } => time_constant,
            Self::SecondOrder { natural_frequency, damping } => 2.0 * damping / natural_frequency,
        }
    }
}

/// Share of a second-order loop's lag that acts as a delay; the rest acts as a time constant. For a
/// critically damped loop, two equal lags in series, it would be a half.
const SECOND_ORDER_DELAY: f64 = 0.4;

impl HeadingResponse {
    /// Time constant of the first-order loop that approximates this one after a delay, s.
    pub fn time_constant(&self) -> f64 {
        match self.dynamics {
            HeadingDynamics::FirstOrder { time_constant } => time_constant,
            HeadingDynamics::SecondOrder { .. } => (1.0 - SECOND_ORDER_DELAY) * self.dynamics.lag(),
        }
    }

    /// Delay of the first-order loop that approximates this one, s.
    pub(crate) fn effective_delay(&self) -> f64 {
        self.lag() - self.time_constant()
    }

    /// Lag behind a reference that turns steadily, with the delay, s.
    pub fn lag(&self) -> f64 {
        self.dynamics.lag() + self.delay
    }
}

impl SurgeResponse {
    /// Lag behind a reference that rises steadily, with the delay, s.
    pub fn lag(&self) -> f64 {
        self.time_constant + self.delay
    }
}

impl Power {
    /// Power at a speed through the water, W, never negative.
    pub fn at(&self, speed: f64) -> f64 {
        let speed = speed.abs();
        (self.linear_w_per_mps + self.cubic_w_per_mps3 * speed * speed) * speed
    }
}
