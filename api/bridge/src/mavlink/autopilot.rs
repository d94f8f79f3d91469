//! The autopilots: their modes, and the parameters that change what a reference does.

use std::collections::BTreeMap;
use std::fmt;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Autopilot {
    ArduPilot,
    /// PX4: messages as documented, not tested with the program.
    Px4,
    /// The IvP helm of a MOOS community.
    Helm,
    /// On IMC.
    Dune,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Heartbeat {
    pub(crate) autopilot: Autopilot,
    pub(crate) mode: Mode,
    pub(crate) is_armed: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mode {
    pub(crate) name: &'static str,
    /// The program's own number of a mode without a name of its own.
    pub(crate) number: Option<u32>,
    /// `true` if the craft follows references in it.
    pub(crate) is_guided: bool,
}

/// Source: ArduPilot, `Rover/mode.h`; the dialect's `RoverMode`.
pub(super) const ARDUPILOT_GUIDED: u32 = 15;
/// Main mode, in bits 16 to 23 of a mode. Source: PX4, `px4_custom_mode.h`.
pub(super) const PX4_OFFBOARD: u32 = 6;

impl Heartbeat {
    /// A heartbeat of MAVLink, whose number of a `mode` depends on the autopilot.
    pub(crate) fn of_mavlink(autopilot: Autopilot, mode: u32, is_armed: bool) -> Self {
        let is_px4 = autopilot == Autopilot::Px4;
        let name = match mode {
            mode if is_px4 => (mode >> 16 & 0xFF == PX4_OFFBOARD).then_some("OFFBOARD"),
            0 => Some("MANUAL"),
            1 => Some("ACRO"),
            3 => Some("STEERING"),
            4 => Some("HOLD"),
            5 => Some("LOITER"),
            6 => Some("FOLLOW"),
            10 => Some("AUTO"),
            11 => Some("RTL"),
            ARDUPILOT_GUIDED => Some("GUIDED"),
            _ => None,
        };
        let is_guided = if is_px4 { name.is_some() } else { mode == ARDUPILOT_GUIDED };
        let number = name.is_none().then_some(mode);
        let mode = Mode { name: name.unwrap_or("mode"), number, is_guided };
        Self { autopilot, mode, is_armed }
    }

    /// `true` if it follows references now.
    pub(crate) fn may_be_steered(self) -> bool {
        self.mode.is_guided && self.is_armed
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)?;
        self.number.map_or(Ok(()), |number| write!(f, " {number}"))
    }
}

/// The parameters that are read before departure.
pub(crate) const PARAMETERS: [&str; 12] = [
    "WP_SPEED",
    "CRUISE_SPEED",
    "ATC_STR_RAT_MAX",
    "ATC_ACCEL_MAX",
    "ATC_DECEL_MAX",
    "GUID_OPTIONS",
    "ATC_SPEED_I",
    "SERVO1_FUNCTION",
    "SERVO3_FUNCTION",
    "FS_ACTION",
    "FS_GCS_ENABLE",
    "FENCE_ENABLE",
];

/// Outputs for the port or starboard thruster of two. Source: ArduPilot, `SRV_Channel`.
const THRUSTER_OF_TWO: [f64; 2] = [73.0, 74.0];
/// Slowest speed through the water at which a rudder or a turned thruster holds a heading, m/s: a
/// slower boat drifted off in a current of 0.3 m/s.
const STEERAGE_WAY: f64 = 0.2;

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Parameters {
    values: BTreeMap<String, f32>,
}

/// A parameter that contradicts the mission.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{parameter} is {value}: {detail}")]
pub struct Contradiction {
    pub(crate) parameter: &'static str,
    pub(crate) value: f64,
    /// Its effect on references, and the right value.
    pub(crate) detail: &'static str,
}

impl Parameters {
    /// Stores the value of one of [`PARAMETERS`].
    pub(crate) fn note(&mut self, name: &str, value: f32) {
        if PARAMETERS.contains(&name) && value.is_finite() {
            self.values.insert(name.to_owned(), value);
        }
    }

    pub(crate) fn get(&self, name: &str) -> Option<f64> {
        // The decimal that a person has set: 1.2 and not 1.2000000476837158.
        self.values.get(name)?.to_string().parse().ok()
    }

    /// Parameters without a value so far.
    pub(crate) fn missing(&self) -> impl Iterator<Item = &'static str> {
        PARAMETERS.into_iter().filter(|name| !self.values.contains_key(*name))
    }

    /// The limit of reference speeds, m/s: `WP_SPEED`, or `CRUISE_SPEED` if that is 0.
    pub(crate) fn speed_max(&self) -> Option<f64> {
        self.positive("WP_SPEED").or_else(|| self.positive("CRUISE_SPEED"))
    }

    /// The fastest turn, rad/s; `None` without a limit.
    pub(crate) fn turn_rate_max(&self) -> Option<f64> {
        self.positive("ATC_STR_RAT_MAX").map(f64::to_radians)
    }

    /// The largest acceleration ahead, m/s².
    pub(crate) fn acceleration_max(&self) -> Option<f64> {
        self.positive("ATC_ACCEL_MAX")
    }

    /// The largest deceleration, m/s², positive; 0 in ArduPilot means that of acceleration.
    pub(crate) fn deceleration_max(&self) -> Option<f64> {
        self.positive("ATC_DECEL_MAX").or_else(|| self.acceleration_max())
    }

    /// The slowest speed through the water at which the craft steers, m/s; `None` with two
    /// thrusters or unknown outputs.
    pub(crate) fn steerage_way(&self) -> Option<f64> {
        let outputs = [self.get("SERVO1_FUNCTION"), self.get("SERVO3_FUNCTION")];
        let mut known = outputs.into_iter().flatten().peekable();
        known.peek()?;
        let has_two_thrusters = known.any(|function| THRUSTER_OF_TWO.contains(&function));
        let most = self.speed_max().map_or(STEERAGE_WAY, |speed| 0.5 * speed);
        (!has_two_thrusters).then_some(STEERAGE_WAY.min(most))
    }

    /// Parameters that contradict a mission with this speed limit, m/s.
    pub(crate) fn contradictions(&self, speed_max: f64) -> Vec<Contradiction> {
        let found = [
            (
                "WP_SPEED",
                self.speed_max().filter(|value| *value < speed_max),
                "the autopilot goes no faster, so a new mission plans no faster either: raise it, or lower limits.speed_max_mps",
            ),
            (
                "GUID_OPTIONS",
                self.get("GUID_OPTIONS").filter(|value| *value != 0.0),
                "it changes the guided mode: set it to 0, or try in a harbour what it does",
            ),
            (
                "ATC_SPEED_I",
                self.get("ATC_SPEED_I").filter(|value| *value == 0.0),
                "without an integrator a current causes a permanent speed error: tune the speed loop first",
            ),
        ];
        let found = found.into_iter();
        let of = |(parameter, value, detail): (_, Option<f64>, _)| {
            let value = value?;
            Some(Contradiction { parameter, value, detail })
        };
        found.filter_map(of).collect()
    }

    /// Failsafes that do not act, or that end the steering.
    pub(crate) fn failsafes(&self) -> impl Iterator<Item = String> {
        let is_off = |name| self.get(name) == Some(0.0);
        let found = [
            ("FS_ACTION", is_off("FS_ACTION"), "a lost remote control changes nothing"),
            ("FS_GCS_ENABLE", self.positive("FS_GCS_ENABLE").is_some(), "a lost ground station ends GUIDED"),
            ("FENCE_ENABLE", is_off("FENCE_ENABLE"), "ArduPilot keeps within no fence"),
        ];
        found.into_iter().filter(|(_, is_found, _)| *is_found).map(|(name, _, effect)| {
            let value = self.get(name).unwrap_or_default();
            format!("{name} is {value}: {effect}")
        })
    }

    fn positive(&self, name: &str) -> Option<f64> {
        self.get(name).filter(|value| *value > 0.0)
    }
}
