//! What is known of the two autopilots: their modes, and the parameters that decide what becomes of a reference.

use std::{collections::BTreeMap, fmt};

/// The programs that a reference can be sent to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Autopilot {
    /// ArduPilot's Rover.
    ArduPilot,
    /// PX4: in every message as its documentation says; not tried with the program.
    Px4,
}

/// What an autopilot says of itself once a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// Its program.
    pub autopilot: Autopilot,
    /// Its mode, as the program numbers them.
    pub mode: u32,
    /// Whether the motors may run.
    pub is_armed: bool,
}

/// Source: ArduPilot, `Rover/mode.h`; the dialect's `RoverMode`.
const ARDUPILOT_GUIDED: u32 = 15;
/// Main mode "offboard", 6, in bits 16 to 23. Source: PX4, `px4_custom_mode.h`.
const PX4_OFFBOARD: u32 = 6 << 16;
const PX4_MAIN_MODE: u32 = 0xFF << 16;

impl Autopilot {
    /// The mode in which it takes references.
    #[must_use]
    pub fn guided_mode(self) -> u32 {
        match self {
            Self::ArduPilot => ARDUPILOT_GUIDED,
            Self::Px4 => PX4_OFFBOARD,
        }
    }

    /// What its handbook calls that mode.
    #[must_use]
    pub fn guided_name(self) -> &'static str {
        match self {
            Self::ArduPilot => "GUIDED",
            Self::Px4 => "OFFBOARD",
        }
    }
}

impl Heartbeat {
    /// Whether it takes references.
    #[must_use]
    pub fn is_guided(&self) -> bool {
        match self.autopilot {
            Autopilot::ArduPilot => self.mode == ARDUPILOT_GUIDED,
            Autopilot::Px4 => self.mode & PX4_MAIN_MODE == PX4_OFFBOARD,
        }
    }

    /// The mode, as people call it.
    #[must_use]
    pub fn mode_name(&self) -> String {
        let name = match (self.autopilot, self.mode) {
            (Autopilot::ArduPilot, 0) => "MANUAL",
            (Autopilot::ArduPilot, 1) => "ACRO",
            (Autopilot::ArduPilot, 3) => "STEERING",
            (Autopilot::ArduPilot, 4) => "HOLD",
            (Autopilot::ArduPilot, 5) => "LOITER",
            (Autopilot::ArduPilot, 6) => "FOLLOW",
            (Autopilot::ArduPilot, 10) => "AUTO",
            (Autopilot::ArduPilot, 11) => "RTL",
            _ if self.is_guided() => self.autopilot.guided_name(),
            _ => return format!("mode {}", self.mode),
        };
        name.to_owned()
    }
}

/// The parameters that are read before departure.
pub const PARAMETERS: [&str; 9] = [
    "WP_SPEED",
    "CRUISE_SPEED",
    "ATC_STR_RAT_MAX",
    "ATC_ACCEL_MAX",
    "ATC_DECEL_MAX",
    "GUID_OPTIONS",
    "ATC_SPEED_I",
    "SERVO1_FUNCTION",
    "SERVO3_FUNCTION",
];

/// Functions of an output that drives the port or the starboard thruster of two. Source: ArduPilot, `SRV_Channel`.
const THRUSTER_OF_TWO: [f64; 2] = [73.0, 74.0];
/// Slowest speed through the water at which a rudder, or a thruster that is turned, holds a heading, m/s: below it a boat that was to
/// wait for an AUV in a current of 0.3 m/s did not turn any more, and was carried off.
const STEERAGE_WAY: f64 = 0.2;

/// What the autopilot said of its parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters {
    values: BTreeMap<String, f32>,
}

/// A parameter that does not go with references from here.
#[derive(Clone, Debug, PartialEq)]
pub struct Contradiction {
    /// Its name.
    pub parameter: &'static str,
    /// Its value.
    pub value: f64,
    /// What becomes of references with it, and what to set.
    pub detail: &'static str,
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is {}: {}", self.parameter, self.value, self.detail)
    }
}

impl Parameters {
    /// Keeps what was said of one of [`PARAMETERS`].
    pub fn note(&mut self, name: &str, value: f32) {
        if PARAMETERS.contains(&name) && value.is_finite() {
            self.values.insert(name.to_owned(), value);
        }
    }

    /// The value of one, if it was said.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values.get(name).map(|value| f64::from(*value))
    }

    /// Those that were not said yet.
    pub fn missing(&self) -> impl Iterator<Item = &'static str> {
        PARAMETERS
            .into_iter()
            .filter(|name| !self.values.contains_key(*name))
    }

    /// The speed at which references are clipped, m/s: `WP_SPEED`, or `CRUISE_SPEED` where that is 0.
    #[must_use]
    pub fn speed_max(&self) -> Option<f64> {
        [self.get("WP_SPEED"), self.get("CRUISE_SPEED")]
            .into_iter()
            .flatten()
            .find(|speed| *speed > 0.0)
    }

    /// The fastest turn, rad/s; none where there is no limit.
    #[must_use]
    pub fn turn_rate_max(&self) -> Option<f64> {
        self.positive("ATC_STR_RAT_MAX").map(f64::to_radians)
    }

    /// The largest acceleration ahead, m/s².
    #[must_use]
    pub fn acceleration_max(&self) -> Option<f64> {
        self.positive("ATC_ACCEL_MAX")
    }

    /// The largest deceleration, m/s², positive; ArduPilot takes that of the acceleration where it is 0.
    #[must_use]
    pub fn deceleration_max(&self) -> Option<f64> {
        self.positive("ATC_DECEL_MAX").or_else(|| self.acceleration_max())
    }

    /// The slowest speed through the water at which the craft steers, m/s: none for one that steers by two thrusters, or does not tell
    /// what it steers by.
    #[must_use]
    pub fn steerage_way(&self) -> Option<f64> {
        let outputs = [self.get("SERVO1_FUNCTION"), self.get("SERVO3_FUNCTION")];
        let mut told = outputs.into_iter().flatten().peekable();
        told.peek()?;
        let has_two_thrusters = told.any(|function| THRUSTER_OF_TWO.contains(&function));
        let most = self.speed_max().map_or(STEERAGE_WAY, |speed| 0.5 * speed);
        (!has_two_thrusters).then_some(STEERAGE_WAY.min(most))
    }

    /// What does not go with a craft that is to be sent up to `speed_max`, m/s.
    #[must_use]
    pub fn contradictions(&self, speed_max: f64) -> Vec<Contradiction> {
        let mut found = vec![];
        if let Some(value) = self.speed_max()
            && value < speed_max
        {
            found.push(Contradiction {
                parameter: "WP_SPEED",
                value,
                detail: "the autopilot goes no faster than that, and the mission allows more: raise it, or lower limits.speed_max_mps",
            });
        }
        if let Some(value) = self.get("GUID_OPTIONS")
            && value != 0.0
        {
            found.push(Contradiction {
                parameter: "GUID_OPTIONS",
                value,
                detail: "references are meant for the autopilot's plain guided mode: set it to 0, or try in a harbour what it changes",
            });
        }
        if let Some(value) = self.get("ATC_SPEED_I")
            && value == 0.0
        {
            found.push(Contradiction {
                parameter: "ATC_SPEED_I",
                value,
                detail: "without an integrator the speed stays off its reference in a current: tune the speed loop first",
            });
        }
        found
    }

    fn positive(&self, name: &str) -> Option<f64> {
        self.get(name).filter(|value| *value > 0.0)
    }
}
