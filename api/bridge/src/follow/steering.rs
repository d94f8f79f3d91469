//! The state of the steering for the status line and the ground station.

use std::fmt;

use ::mavlink::dialects::ardupilotmega::MavSeverity;

use crate::mavlink::TEXT_BYTES;

/// Prefix of further lines.
const GOES_ON: &str = "... ";

/// The state of the steering, for operators.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Steering {
    /// `true` if references are sent.
    pub(super) is_on: bool,
    /// `true` if they are not sent because a person steers the craft.
    pub(super) is_a_persons: bool,
    pub(super) severity: MavSeverity,
    /// The reason that it is off or degraded, or a possible one.
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

    /// `true` if nothing is missing to call the craft steered.
    pub(super) fn is_good(&self) -> bool {
        self.is_on && self.severity == MavSeverity::MAV_SEVERITY_INFO
    }

    /// `true` if an operator has to act.
    pub(super) fn is_alarm(&self) -> bool {
        matches!(
            self.severity,
            MavSeverity::MAV_SEVERITY_CRITICAL | MavSeverity::MAV_SEVERITY_WARNING
        )
    }

    /// Texts for the ground station, each of at most `TEXT_BYTES`, with whole words only.
    pub(super) fn texts(&self) -> Vec<String> {
        let state = match (self.is_on, self.severity) {
            (true, MavSeverity::MAV_SEVERITY_WARNING) => "Pilotfish degraded",
            (true, _) => "Pilotfish steering",
            (false, _) => "Pilotfish off",
        };
        lines(&with_cause(state, &self.cause), TEXT_BYTES)
    }
}

/// Splits `whole` between words into lines of at most `most` bytes. A longer word is a line.
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
    fn a_long_cause_arrives_completely_in_several_texts() {
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
