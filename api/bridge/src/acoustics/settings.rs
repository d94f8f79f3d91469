//! The settings of one modem, as a section of the bridge's file holds them.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::Mounting;

/// What the adapter has to know of a modem and of its place on the craft.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// What it prints.
    pub modem: ModemKind,
    /// AUVs' names by their addresses on the wire. An address that is not here becomes `usbl-<address>`.
    #[serde(default)]
    pub names: BTreeMap<String, String>,
    /// Place of the transducer. A modem that prints places on Earth needs none.
    #[serde(default)]
    pub mounting: Option<Mounting>,
    /// Mean speed of sound between AUV and craft, m/s: turns a distance into a travel time where the modem tells
    /// none.
    pub sound_speed_mps: f64,
    /// Standard deviation of a position along either axis, m, where the modem tells none.
    #[serde(default)]
    pub sigma_m: Option<f64>,
    /// Magnetic declination where the craft sails, rad, positive east: turns the axes of a modem that steers by
    /// its own compass. 0 where the modem's own north is true north.
    #[serde(default)]
    pub magnetic_declination_rad: f64,
}

/// What a modem prints.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ModemKind {
    /// Evologics S2C with USBL: `USBLLONG` and `USBLANGLES`.
    Evologics {
        /// Which of the two positions of each line is used.
        frame: Frame,
    },
    /// Blueprint Subsea SeaTrac X150: responses to PING and NAV_QUERY.
    Seatrac {
        /// Which of the two positions of each message is used.
        frame: Frame,
    },
    /// Sonardyne `$PSONLLD` and Kongsberg `$PSIMSSB`.
    Sentences,
    /// Lines that a regular expression takes apart.
    Pattern {
        /// The expression, in the syntax of the regex crate, with named groups.
        pattern: String,
    },
}

/// Whose attitude turns a measurement to north.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Frame {
    /// The craft's: the modem's own axes are turned by the mounting and the craft's heading, roll and pitch.
    Body,
    /// The modem's: its own compass and inclinometers turned the position already.
    Earth,
}

/// Why settings cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnusableSettings {
    /// A number that no craft has.
    #[error("{name} is {value}; it must be {must}")]
    OutOfRange {
        /// Its place in the settings.
        name: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        must: &'static str,
    },
    /// A modem that measures from the transducer, and no word of where that is.
    #[error("mounting is missing; this modem tells positions from its transducer")]
    NoMounting,
    /// An expression that is none, or that takes too much memory.
    #[error("the pattern is not usable: {0}")]
    Pattern(regex::Error),
    /// A group that means nothing.
    #[error("the pattern's group {group:?} means nothing; groups are {known}")]
    UnknownGroup {
        /// The group.
        group: String,
        /// The groups that mean something.
        known: String,
    },
    /// A group that needs another one.
    #[error("the pattern has the group {given:?} and lacks {missing:?}")]
    MissingGroup {
        /// The group that is there.
        given: &'static str,
        /// The group that is not.
        missing: &'static str,
    },
    /// No position at all.
    #[error("the pattern tells no position; it needs lat_deg and lon_deg, or another kind of position")]
    NoPosition,
    /// Two kinds of position.
    #[error("the pattern tells positions of two kinds, with {first:?} and with {second:?}")]
    TwoPositions {
        /// A group of the one kind.
        first: &'static str,
        /// A group of the other kind.
        second: &'static str,
    },
    /// No group `id`, and not exactly one name.
    #[error("the pattern has no group \"id\", and names has {n_names} entries; then it must have one")]
    NoId {
        /// How many names there are.
        n_names: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::{super::Modem, *};

    #[test]
    fn the_examples_of_the_page_are_usable() {
        let page = include_str!("../../../../docs/acoustics.md");
        let mut n_examples = 0;
        for block in page.split("```json\n").skip(1) {
            let json = block.split("```").next().expect("a split has a first part");
            let settings: Settings = serde_json::from_str(json).expect("is an example of settings");
            Modem::new(&settings).expect("is usable");
            n_examples += 1;
        }
        assert_eq!(n_examples, 4);
    }

    #[test]
    fn a_misspelt_field_is_an_error() {
        for json in [
            r#"{"modem": "sentences", "sound_speed_mps": 1500.0, "sigma": 3.0}"#,
            r#"{"modem": {"evologics": {"frame": "body", "fram": 1}}, "sound_speed_mps": 1500.0}"#,
            r#"{"modem": {"evologics": {}}, "sound_speed_mps": 1500.0}"#,
            r#"{"modem": "sentences", "sound_speed_mps": 1500.0, "mounting": {"forward": 1.0}}"#,
        ] {
            assert!(serde_json::from_str::<Settings>(json).is_err(), "{json}");
        }
    }

    #[test]
    fn settings_that_no_craft_has_are_refused_and_say_why() {
        let read = |json: &str| serde_json::from_str::<Settings>(json).expect("is an object of settings");
        let sentences = read(r#"{"modem": "sentences", "sound_speed_mps": 150.0}"#);
        let error = Modem::new(&sentences).expect_err("is no speed of sound in water");
        assert!(error.to_string().contains("sound_speed_mps is 150"), "{error}");
        let bare = read(r#"{"modem": {"seatrac": {"frame": "earth"}}, "sound_speed_mps": 1500.0}"#);
        assert_eq!(
            Modem::new(&bare).expect_err("has no mounting"),
            UnusableSettings::NoMounting
        );
        let far = r#"{"modem": "sentences", "sound_speed_mps": 1500.0, "mounting":
            {"forward_m": 1e9, "starboard_m": 0.0, "down_m": 0.0, "heading_offset_rad": 0.0}}"#;
        assert!(Modem::new(&read(far)).is_err());
    }
}
