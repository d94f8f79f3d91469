//! The log of the program, and that of the mission once there is one.

use crate::{bridge_clock::BridgeClock, mission_link::MissionLink};

/// Target of the lines of a bridge's loop, for log filters.
pub(super) const TARGET: &str = "pilotfish_bridge::follow";

pub(super) struct MissionLog {
    pub(super) clock: BridgeClock,
    pub(super) mission: Option<MissionLink>,
}

impl MissionLog {
    pub(super) fn info(&self, text: &str) {
        tracing::info!(target: TARGET, "{text}");
        self.note(text);
    }

    /// The same for messages that need an operator.
    pub(super) fn warn(&self, text: &str) {
        tracing::warn!(target: TARGET, "{text}");
        self.note(text);
    }

    fn note(&self, text: &str) {
        if let Some(mission) = &self.mission {
            mission.note(self.clock.now_s(), text);
        }
    }
}
