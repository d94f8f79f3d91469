//! The closed loops of a craft as data.

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    angle::{Heading, angle_of},
    reference::Reference,
};

/// Slower than this over ground, a velocity has no course worth holding, m/s.
const SPEED_WITHOUT_COURSE: f64 = 0.05;

/// Closed-loop response of a surface craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Craft {
    /// How the heading loop answers.
    pub heading: HeadingResponse,
    /// How the speed loop answers.
    pub surge: SurgeResponse,
    /// Sway per surge and yaw rate k_β, s, positive where the craft drifts outwards in a turn: v = −k_β u r.
    #[doc(alias = "k_beta")]
    pub sway_per_yaw_rate: f64,
    /// Power that propulsion draws at a steady speed.
    pub power: Power,
    /// What the speed reference is held against.
    pub speed_held: SpeedReference,
    /// What the heading reference is held against.
    pub heading_held: HeadingReference,
}

/// How the heading loop answers a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingResponse {
    /// Its dynamics after the delay.
    pub dynamics: HeadingDynamics,
    /// Time until a reference begins to act t_d, s.
    pub delay: f64,
    /// Fastest turn that the loop makes r_max, rad/s.
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

/// How the speed loop answers a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurgeResponse {
    /// Time constant of the answer to a small step T_u, s.
    pub time_constant: f64,
    /// Time until a reference begins to act, s.
    pub delay: f64,
    /// Largest acceleration ahead, m/s².
    pub acceleration_max: f64,
    /// Largest deceleration, m/s², positive.
    pub deceleration_max: f64,
    /// Time T_i in which the loop's integrator gathers what its proportional part asks for, s; none where it has no
    /// integrator or winds up not noticeably.
    pub integral_time: Option<f64>,
}

/// Power that propulsion draws at a steady speed u through the water: linear · u + cubic · u³.
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

/// What a speed reference means: the speed that the loop measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpeedReference {
    /// Surge speed through the water.
    ThroughWater,
    /// Velocity over ground along the bow.
    OverGround,
}

/// What a heading reference means: the angle that the loop measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeadingReference {
    /// Where the bow points ψ.
    Heading,
    /// The direction of the velocity over ground χ.
    Course,
}

impl Craft {
    /// The command with which the craft moves through the water as `reference` says, in a `current`
    /// (north, east), m/s: a loop that holds speed over ground gets the velocity over ground along the bow, up to `speed_max`,
    /// m/s, one that holds a course the direction of that velocity.
    #[must_use]
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
    /// By how much the heading is behind a reference that turns steadily, s: T, or 2ζ/ω.
    #[must_use]
    pub fn lag(self) -> f64 {
        match self {
            Self::FirstOrder { time_constant } => time_constant,
            Self::SecondOrder {
                natural_frequency,
                damping,
            } => 2.0 * damping / natural_frequency,
        }
    }
}

/// Part of the lag of a second-order loop that delays the beginning of its answer: the rest is the time constant of what
/// follows. Of a critically damped loop, two equal lags after one another, it would be a half.
const SECOND_ORDER_DELAY: f64 = 0.4;

impl HeadingResponse {
    /// Time constant of a first-order loop that answers like this one after its effective delay, s.
    #[must_use]
    pub fn time_constant(&self) -> f64 {
        match self.dynamics {
            HeadingDynamics::FirstOrder { time_constant } => time_constant,
            HeadingDynamics::SecondOrder { .. } => (1.0 - SECOND_ORDER_DELAY) * self.dynamics.lag(),
        }
    }

    /// Time until a first-order loop begins to answer that answers like this one, s.
    #[must_use]
    pub(crate) fn effective_delay(&self) -> f64 {
        self.lag() - self.time_constant()
    }

    /// By how much the heading is behind a reference that turns steadily, the delay included, s.
    #[must_use]
    pub fn lag(&self) -> f64 {
        self.dynamics.lag() + self.delay
    }
}

impl SurgeResponse {
    /// By how much the speed is behind a reference that rises steadily, the delay included, s.
    #[must_use]
    pub fn lag(&self) -> f64 {
        self.time_constant + self.delay
    }
}

impl Power {
    /// Power at a speed through the water, W, never negative.
    #[must_use]
    pub fn at(&self, speed: f64) -> f64 {
        let speed = speed.abs();
        (self.linear_w_per_mps + self.cubic_w_per_mps3 * speed * speed) * speed
    }
}
