//! The state of the steering in words, for the status line and the ground station.

use std::fmt;

use ::mavlink::dialects::ardupilotmega::MavSeverity;
use ::wire::mission::SteeringState;

use crate::mavlink::TEXT_BYTES;

/// Prefix of further lines.
const GOES_ON: &str = "... ";

/// The state of the steering, for operators.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Steering {
    pub(super) state: SteeringState,
    /// The reason that it is off or degraded, or a possible one.
    pub(super) cause: String,
}

impl Steering {
    /// `true` if references are sent.
    pub(super) fn is_on(&self) -> bool {
        matches!(self.state, SteeringState::Steering | SteeringState::Degraded)
    }

    /// `true` if nothing is missing to call the craft steered.
    pub(super) fn is_good(&self) -> bool {
        self.state == SteeringState::Steering && self.cause.is_empty()
    }

    /// `true` if an operator has to act.
    pub(super) fn is_alarm(&self) -> bool {
        matches!(self.state, SteeringState::Degraded | SteeringState::NotSteering)
    }

    pub(super) fn severity(&self) -> MavSeverity {
        match self.state {
            SteeringState::NotSteering => MavSeverity::MAV_SEVERITY_CRITICAL,
            SteeringState::Degraded => MavSeverity::MAV_SEVERITY_WARNING,
            SteeringState::Steering if self.is_good() => MavSeverity::MAV_SEVERITY_INFO,
            _ => MavSeverity::MAV_SEVERITY_NOTICE,
        }
    }

    /// `true` if operators are told the same of both, whatever their causes.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        self.rank() == other.rank()
    }

    /// `true` if references end, or are sent with less effect.
    pub(super) fn is_worse_than(&self, other: &Self) -> bool {
        self.rank() < other.rank()
    }

    /// Higher is better.
    fn rank(&self) -> (bool, u8) {
        (self.is_on(), self.severity() as u8)
    }

    /// Texts for the ground station, each of at most `TEXT_BYTES`, with whole words only.
    pub(super) fn texts(&self) -> Vec<String> {
        let state = match self.state {
            SteeringState::Degraded => "Pilotfish degraded",
            SteeringState::Steering => "Pilotfish steering",
            _ => "Pilotfish off",
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
        let state = match self.state {
            SteeringState::Degraded => "DEGRADED",
            SteeringState::Steering => "steering",
            SteeringState::NotSteering => "NOT STEERING",
            SteeringState::Person | SteeringState::Waiting => "not steering",
        };
        f.write_str(&with_cause(state, &self.cause))
    }
}

fn with_cause(state: &str, cause: &str) -> String {
    if cause.is_empty() { state.to_owned() } else { format!("{state}: {cause}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_cause_arrives_completely_in_several_texts() {
        let cause =
            "the position does not change although the reference speed is not zero; heading does not respond";
        let steering = Steering { state: SteeringState::Degraded, cause: cause.to_owned() };
        let texts = steering.texts();
        assert!(texts.iter().all(|text| text.len() <= TEXT_BYTES), "{texts:?}");
        let whole = texts.join(" ").replace(&format!(" {GOES_ON}"), " ");
        assert_eq!(whole, format!("Pilotfish degraded: {cause}"));
    }
}
