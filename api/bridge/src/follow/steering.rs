//! Whether the craft is steered, as the status line and the ground station have it.

use std::fmt;

use ::mavlink::dialects::ardupilotmega::MavSeverity;

/// Whether the craft is steered, for those who watch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Steering {
    pub(super) severity: MavSeverity,
    /// Why it is not, or not as it should be.
    pub(super) cause: String,
}

impl Steering {
    /// For the ground station, which shows 50 bytes.
    pub(super) fn text(&self) -> String {
        match self.severity {
            MavSeverity::MAV_SEVERITY_INFO => "Pilotfish steering".to_owned(),
            MavSeverity::MAV_SEVERITY_WARNING => format!("Pilotfish degraded: {}", self.cause),
            _ => format!("Pilotfish off: {}", self.cause),
        }
    }
}

impl fmt::Display for Steering {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.severity {
            MavSeverity::MAV_SEVERITY_INFO => f.write_str("steering"),
            MavSeverity::MAV_SEVERITY_WARNING => write!(f, "DEGRADED: {}", self.cause),
            MavSeverity::MAV_SEVERITY_CRITICAL => write!(f, "NOT STEERING: {}", self.cause),
            _ => write!(f, "not steering: {}", self.cause),
        }
    }
}
