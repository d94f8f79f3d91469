//! Whether the craft is steered, as the status line and the ground station have it.

use std::fmt;

use ::mavlink::dialects::ardupilotmega::MavSeverity;

use crate::mavlink::TEXT_BYTES;

/// What further lines begin with.
const GOES_ON: &str = "... ";

/// Whether the craft is steered, for those who watch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Steering {
    /// Whether references are sent.
    pub(super) is_on: bool,
    /// Whether they are not because a person has the craft.
    pub(super) is_a_persons: bool,
    pub(super) severity: MavSeverity,
    /// Why it is not, or not as it should be, or what may become a reason.
    pub(super) cause: String,
}

impl Steering {
    /// The name of the state in the API.
    pub(super) fn state(&self) -> &'static str {
        match (self.is_on, self.severity) {
            (true, MavSeverity::MAV_SEVERITY_WARNING) => "degraded",
            (true, _) => "steering",
            (false, MavSeverity::MAV_SEVERITY_CRITICAL) => "not_steering",
            (false, _) if self.is_a_persons => "person",
            (false, _) => "waiting",
        }
    }

    /// Whether all is well: nothing is missing to call the craft steered.
    pub(super) fn is_good(&self) -> bool {
        self.is_on && self.severity == MavSeverity::MAV_SEVERITY_INFO
    }

    /// Whether somebody has to look.
    pub(super) fn is_alarm(&self) -> bool {
        matches!(
            self.severity,
            MavSeverity::MAV_SEVERITY_CRITICAL | MavSeverity::MAV_SEVERITY_WARNING
        )
    }

    /// For the ground station: as many texts of `TEXT_BYTES` as there are words for, none with half a word.
    pub(super) fn texts(&self) -> Vec<String> {
        let state = match (self.is_on, self.severity) {
            (true, MavSeverity::MAV_SEVERITY_WARNING) => "Pilotfish degraded",
            (true, _) => "Pilotfish steering",
            (false, _) => "Pilotfish off",
        };
        lines(&with_cause(state, &self.cause), TEXT_BYTES)
    }
}

/// The words of `whole` in as many lines as they need of at most `most` bytes: none with half a word. A word that is longer is a line.
pub(super) fn lines(whole: &str, most: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in whole.split(' ') {
        let last = lines.last_mut().expect("is never empty");
        if last.is_empty() {
            word.clone_into(last);
        } else if last.len() + 1 + word.len() <= most {
            *last = format!("{last} {word}");
        } else {
            lines.push(format!("{GOES_ON}{word}"));
        }
    }
    lines
}

impl fmt::Display for Steering {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match (self.is_on, self.severity) {
            (true, MavSeverity::MAV_SEVERITY_WARNING) => "DEGRADED",
            (true, _) => "steering",
            (false, MavSeverity::MAV_SEVERITY_CRITICAL) => "NOT STEERING",
            (false, _) => "not steering",
        };
        f.write_str(&with_cause(state, &self.cause))
    }
}

fn with_cause(state: &str, cause: &str) -> String {
    if cause.is_empty() {
        state.to_owned()
    } else {
        format!("{state}: {cause}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_cause_arrives_whole_in_several_texts() {
        let cause =
            "the position does not change although the reference speed is not zero; heading does not respond";
        let steering = Steering {
            is_on: true,
            is_a_persons: false,
            severity: MavSeverity::MAV_SEVERITY_WARNING,
            cause: cause.to_owned(),
        };
        let texts = steering.texts();
        assert!(texts.iter().all(|text| text.len() <= TEXT_BYTES), "{texts:?}");
        let whole = texts.join(" ").replace(&format!(" {GOES_ON}"), " ");
        assert_eq!(whole, format!("Pilotfish degraded: {cause}"));
    }
}
