//! The settings file of one modem.

use std::{collections::BTreeMap, fmt};

use serde::{
    Deserialize, Deserializer,
    de::{Error, MapAccess, Visitor},
};

use super::mounting::Mounting;

/// Settings of a modem and its mounting on the craft.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    pub(crate) modem: ModemKind,
    /// AUVs' names by their addresses. An address without a name becomes `usbl-<address>`; one with
    /// two is an error.
    #[serde(default, deserialize_with = "one_name_each")]
    pub names: BTreeMap<String, String>,
    /// Mounting of the transducer. Not needed for modems that print positions on Earth.
    #[serde(default)]
    pub(crate) mounting: Option<Mounting>,
    /// Mean speed of sound to the AUV, m/s: for the travel time, if the modem states none.
    pub(crate) sound_speed_mps: f64,
    /// Standard deviation of a position along either axis, m, if the modem states none.
    #[serde(default)]
    pub(crate) sigma_m: Option<f64>,
    /// Magnetic declination, rad, positive east, of a modem's compass; 0 for true north.
    #[serde(default)]
    pub(crate) magnetic_declination_rad: f64,
}

#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum ModemKind {
    /// Evologics S2C with USBL: `USBLLONG` and `USBLANGLES`.
    Evologics {
        /// The position in each line that counts.
        frame: Frame,
    },
    /// Blueprint Subsea SeaTrac X150: responses to PING and NAV_QUERY.
    Seatrac {
        /// The position in each message that counts.
        frame: Frame,
    },
    /// Sonardyne `$PSONLLD` and Kongsberg `$PSIMSSB`.
    Sentences,
    /// Any lines, by a regular expression.
    Pattern {
        /// The expression, in the syntax of the regex-lite crate, with named groups.
        pattern: String,
    },
}

/// The attitude that turns a measurement to north.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Frame {
    /// The craft's: mounting, heading, roll and pitch turn vectors in the modem's axes.
    Body,
    /// The modem's: its own compass and inclinometers have turned the position already.
    Earth,
}

/// The reason that settings cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct UnusableSettings(pub(super) String);

/// Reads names by address: a map alone would keep the last name and lose the other AUV.
fn one_name_each<'de, D: Deserializer<'de>>(from: D) -> Result<BTreeMap<String, String>, D::Error> {
    struct Names;

    impl<'de> Visitor<'de> for Names {
        type Value = BTreeMap<String, String>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("names of AUVs by their addresses")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut names = BTreeMap::new();
            while let Some((address, name)) = map.next_entry::<String, String>()? {
                if let Some(other) = names.insert(address.clone(), name.clone()) {
                    return Err(A::Error::custom(format!(
                        "names: {other} and {name} both have the address {address}"
                    )));
                }
            }
            Ok(names)
        }
    }

    from.deserialize_map(Names)
}

#[cfg(test)]
mod tests {
    use super::{super::Modem, *};

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
    fn two_auvs_with_one_address_are_an_error_that_names_both() {
        let json =
            r#"{"modem": "sentences", "sound_speed_mps": 1500.0, "names": {"3": "red", "3": "black"}}"#;
        let error = serde_json::from_str::<Settings>(json).expect_err("has one address twice");
        assert!(error.to_string().contains("red and black both have the address 3"), "{error}");
        let json = json.replacen("\"3\"", "\"4\"", 1);
        assert_eq!(serde_json::from_str::<Settings>(&json).expect("is as it should be").names.len(), 2);
    }

    #[test]
    fn settings_out_of_range_are_rejected_with_the_reason() {
        let read = |json: &str| serde_json::from_str::<Settings>(json).expect("is an object of settings");
        let sentences = read(r#"{"modem": "sentences", "sound_speed_mps": 150.0}"#);
        let error = Modem::new(&sentences).expect_err("is no speed of sound in water");
        assert!(error.to_string().contains("sound_speed_mps is 150"), "{error}");
        let bare = read(r#"{"modem": {"seatrac": {"frame": "earth"}}, "sound_speed_mps": 1500.0}"#);
        let error = Modem::new(&bare).expect_err("has no mounting");
        assert!(error.to_string().starts_with("mounting is missing"), "{error}");
        let far = r#"{"modem": "sentences", "sound_speed_mps": 1500.0, "mounting":
            {"forward_m": 1e9, "starboard_m": 0.0, "down_m": 0.0, "heading_offset_rad": 0.0}}"#;
        assert!(Modem::new(&read(far)).is_err());
    }
}
