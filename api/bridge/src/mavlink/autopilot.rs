//! The autopilots: their modes, and the parameters that change what a reference does.

use std::collections::BTreeMap;

use crate::imc::mode::DuneMode;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Autopilot {
    ArduPilot,
    /// PX4: messages as documented, not tested with the program.
    Px4,
    /// The IvP helm of a MOOS community, with [`HELM_MODES`].
    Helm,
    /// On IMC; its number of a mode is a [`DuneMode`].
    Dune,
}

/// The modes of a craft with a MOOSDB. It follows in the first two.
pub(crate) const HELM_MODES: [&str; 6] =
    ["DRIVE", "DESIRED_*", "PARK", "manual override", "the helm drives too", "helm in another state"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Heartbeat {
    pub(crate) autopilot: Autopilot,
    /// The program's own number of the mode.
    pub(crate) mode: u32,
    pub(crate) is_armed: bool,
}

/// Source: ArduPilot, `Rover/mode.h`; the dialect's `RoverMode`.
const ARDUPILOT_GUIDED: u32 = 15;
/// Main mode "offboard", 6, in bits 16 to 23. Source: PX4, `px4_custom_mode.h`.
const PX4_OFFBOARD: u32 = 6 << 16;
const PX4_MAIN_MODE: u32 = 0xFF << 16;

impl Autopilot {
    /// The mode in which it follows references.
    pub(crate) fn guided_mode(self) -> u32 {
        match self {
            Self::ArduPilot => ARDUPILOT_GUIDED,
            Self::Px4 => PX4_OFFBOARD,
            Self::Helm => 0,
            Self::Dune => DuneMode::FOLLOWING.into(),
        }
    }

    pub(crate) fn guided_name(self) -> &'static str {
        match self {
            Self::ArduPilot => "GUIDED",
            Self::Px4 => "OFFBOARD",
            Self::Helm => "DRIVE",
            Self::Dune => "FollowReference",
        }
    }
}

impl Heartbeat {
    pub(crate) fn is_guided(self) -> bool {
        match self.autopilot {
            Autopilot::ArduPilot => self.mode == ARDUPILOT_GUIDED,
            Autopilot::Px4 => self.mode & PX4_MAIN_MODE == PX4_OFFBOARD,
            Autopilot::Helm => self.mode < 2,
            Autopilot::Dune => DuneMode::from(self.mode).is_ours,
        }
    }

    /// `true` if it follows references now.
    pub(crate) fn may_be_steered(self) -> bool {
        self.is_guided() && self.is_armed
    }

    pub(crate) fn mode_name(self) -> String {
        let name = match (self.autopilot, self.mode) {
            (Autopilot::Helm, mode) => HELM_MODES[(mode as usize).min(HELM_MODES.len() - 1)],
            (Autopilot::ArduPilot, 0) => "MANUAL",
            (Autopilot::ArduPilot, 1) => "ACRO",
            (Autopilot::ArduPilot, 3) => "STEERING",
            (Autopilot::ArduPilot, 4) => "HOLD",
            (Autopilot::ArduPilot, 5) => "LOITER",
            (Autopilot::ArduPilot, 6) => "FOLLOW",
            (Autopilot::ArduPilot, 10) => "AUTO",
            (Autopilot::ArduPilot, 11) => "RTL",
            (Autopilot::Dune, mode) => return DuneMode::from(mode).name(),
            _ if self.is_guided() => self.autopilot.guided_name(),
            _ => return format!("mode {}", self.mode),
        };
        name.to_owned()
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
        let value = self.values.get(name)?;
        value.to_string().parse().ok()
    }

    /// Parameters without a value so far.
    pub(crate) fn missing(&self) -> impl Iterator<Item = &'static str> {
        let names = PARAMETERS.into_iter();
        names.filter(|name| !self.values.contains_key(*name))
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
