//! Lines that a regular expression takes apart: for modems that no module here knows.
//!
//! Named groups are fields. A position is one of
//!
//! | groups | from | axes |
//! |---|---|---|
//! | `lat_deg`, `lon_deg` | Earth, WGS 84 | degrees |
//! | `north_m`, `east_m`, and `down_m` where told | transducer | true north, east, down |
//! | `forward_m`, `starboard_m`, `down_m` | transducer | transducer's own |
//! | `range_m`, `bearing_deg`, `elevation_deg` | transducer | its own: clockwise from forward, up |
//!
//! and beside it `id`, `depth_m`, `sigma_m`, `travel_time_s`, and one of the times `age_s` (since arrival) and
//! `t_s` (when the AUV sent, s of Unix time). A pattern without `id` is of the only name in `names`.
//!
//! The regex crate matches in time linear in the line, whatever the pattern.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use regex::{Captures, Regex, RegexBuilder};

use super::{
    UnusableSettings,
    sighting::{Axes, Clock, Place, Sighting, address, line_of_sight, number},
};
use crate::Geographic;

const NO_MATCH: &str = "the pattern does not match";
const MISSING: &str = "the pattern left a group out";
const NEGATIVE: &str = "a field is negative";
const NOT_ON_EARTH: &str = "no place on Earth";

/// Memory of the compiled pattern, bytes: a slip in a repetition must not take the machine's.
const COMPILED_MAX: usize = 1 << 20;

/// Groups that go with any kind of position.
const BESIDE: [&str; 6] = ["id", "depth_m", "sigma_m", "age_s", "travel_time_s", "t_s"];

/// May stand with both Cartesian kinds.
const DOWN: &str = "down_m";

/// How positions are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Geographic,
    North,
    Body,
    Polar,
}

impl Form {
    const ALL: [Self; 4] = [Self::Geographic, Self::North, Self::Body, Self::Polar];

    /// The groups that it needs and that no other form has.
    fn groups(self) -> &'static [&'static str] {
        match self {
            Self::Geographic => &["lat_deg", "lon_deg"],
            Self::North => &["north_m", "east_m"],
            Self::Body => &["forward_m", "starboard_m"],
            Self::Polar => &["range_m", "bearing_deg", "elevation_deg"],
        }
    }
}

/// A pattern whose groups make sense.
#[derive(Debug)]
pub(super) struct Pattern {
    regex: Regex,
    form: Form,
    /// The address of all lines, where the pattern has no group `id`.
    only: Option<String>,
}

impl Pattern {
    pub(super) fn new(pattern: &str, names: &BTreeMap<String, String>) -> Result<Self, UnusableSettings> {
        let mut builder = RegexBuilder::new(pattern);
        let regex = builder
            .size_limit(COMPILED_MAX)
            .build()
            .map_err(UnusableSettings::Pattern)?;
        let groups: Vec<&str> = regex.capture_names().flatten().collect();
        let known = || {
            Form::ALL
                .iter()
                .flat_map(|form| form.groups())
                .chain([&DOWN])
                .chain(&BESIDE)
        };
        if let Some(unknown) = groups.iter().find(|group| !known().any(|known| known == *group)) {
            return Err(UnusableSettings::UnknownGroup {
                group: (*unknown).to_owned(),
                known: known().copied().collect::<Vec<_>>().join(", "),
            });
        }
        let form = form(&groups)?;
        let only = if groups.contains(&"id") {
            None
        } else {
            let mut addresses = names.keys();
            match (addresses.next(), addresses.next()) {
                (Some(only), None) => Some(only.clone()),
                _ => return Err(UnusableSettings::NoId { n_names: names.len() }),
            }
        };
        Ok(Self { regex, form, only })
    }

    /// Whether positions are told from the transducer.
    pub(super) fn is_relative(&self) -> bool {
        self.form != Form::Geographic
    }

    pub(super) fn read(&self, line: &str, received_s: f64) -> Result<Sighting, &'static str> {
        let captures = self.regex.captures(line).ok_or(NO_MATCH)?;
        let field = |group: &str| captures.name(group).map(|text| number(text.as_str())).transpose();
        let positive = |group: &str| match field(group)? {
            Some(value) if value < 0.0 => Err(NEGATIVE),
            value => Ok(value),
        };
        let address = match &self.only {
            Some(only) => only.clone(),
            None => address(captures.name("id").ok_or(MISSING)?.as_str())?,
        };
        let clock = match field("t_s")? {
            Some(sent_s) => Clock::Sent(sent_s),
            None => Clock::Arrived(received_s - positive("age_s")?.unwrap_or(0.0)),
        };
        Ok(Sighting {
            address,
            clock,
            travel_s: positive("travel_time_s")?,
            place: self.place(&captures)?,
            sigma_m: positive("sigma_m")?,
            depth_m: field("depth_m")?,
            transducer_depth_m: None,
        })
    }

    fn place(&self, captures: &Captures<'_>) -> Result<Place, &'static str> {
        let field = |group: &str| number(captures.name(group).ok_or(MISSING)?.as_str());
        let groups = self.form.groups();
        let (first, second) = (field(groups[0])?, field(groups[1])?);
        Ok(match self.form {
            Form::Geographic => Place::Geographic(Geographic::new(first, second).ok_or(NOT_ON_EARTH)?),
            Form::North => {
                let down = captures
                    .name(DOWN)
                    .map(|text| number(text.as_str()))
                    .transpose()?;
                Place::Vector {
                    axes: Axes::North,
                    vector: Vector3::new(first, second, down.unwrap_or(0.0)),
                    tells_depth: down.is_some(),
                }
            }
            Form::Body => Place::vector(Axes::Transducer, Vector3::new(first, second, field(DOWN)?)),
            Form::Polar => {
                let elevation = field(groups[2])?;
                if first < 0.0 {
                    return Err(NEGATIVE);
                }
                Place::vector(
                    Axes::Transducer,
                    line_of_sight(second.to_radians(), elevation.to_radians()) * first,
                )
            }
        })
    }
}

/// The one kind of position that `groups` tell, whole.
fn form(groups: &[&str]) -> Result<Form, UnusableSettings> {
    let mut found: Option<(Form, &'static str)> = None;
    for form in Form::ALL {
        let Some(given) = form.groups().iter().copied().find(|group| groups.contains(group)) else {
            continue;
        };
        if let Some((_, first)) = found {
            return Err(UnusableSettings::TwoPositions { first, second: given });
        }
        if let Some(missing) = form
            .groups()
            .iter()
            .copied()
            .find(|group| !groups.contains(group))
        {
            return Err(UnusableSettings::MissingGroup { given, missing });
        }
        found = Some((form, given));
    }
    let (form, given) = found.ok_or(UnusableSettings::NoPosition)?;
    let has_down = groups.contains(&DOWN);
    match form {
        Form::Body if !has_down => Err(UnusableSettings::MissingGroup { given, missing: DOWN }),
        Form::Geographic | Form::Polar if has_down => Err(UnusableSettings::TwoPositions {
            first: given,
            second: DOWN,
        }),
        _ => Ok(form),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(addresses: &[&str]) -> BTreeMap<String, String> {
        addresses
            .iter()
            .map(|address| ((*address).to_owned(), format!("auv-{address}")))
            .collect()
    }

    const NORTH: &str =
        r"(?<id>\d+):(?<north_m>[^, ]+),(?<east_m>[^, ]+)(,(?<down_m>[^, ]+))?( age (?<age_s>\S+))?$";

    #[test]
    fn groups_that_make_no_sense_are_named() {
        let new = |pattern: &str| {
            Pattern::new(pattern, &names(&[]))
                .expect_err("makes no sense")
                .to_string()
        };
        for (pattern, named) in [
            (r"(?<id>\d)(?<lat>.)", "\"lat\""),
            (r"(?<id>\d)(?<lat_deg>.)", "lacks \"lon_deg\""),
            (r"(?<id>\d)(?<forward_m>.)(?<starboard_m>.)", "lacks \"down_m\""),
            (
                r"(?<id>\d)(?<range_m>.)(?<bearing_deg>.)",
                "lacks \"elevation_deg\"",
            ),
            (
                r"(?<id>\d)(?<lat_deg>.)(?<lon_deg>.)(?<north_m>.)(?<east_m>.)",
                "two kinds",
            ),
            (r"(?<id>\d)(?<lat_deg>.)(?<lon_deg>.)(?<down_m>.)", "two kinds"),
            (r"(?<id>\d)(?<down_m>.)", "no position"),
            (r"(?<lat_deg>.)(?<lon_deg>.)", "names has 0 entries"),
            (r"(?<id>\d", "not usable"),
            (r"(?<id>\w{1000}{1000})(?<lat_deg>.)(?<lon_deg>.)", "size limit"),
        ] {
            assert!(new(pattern).contains(named), "{pattern}: {}", new(pattern));
        }
        let two = Pattern::new(r"(?<lat_deg>.)(?<lon_deg>.)", &names(&["1", "2"]));
        assert_eq!(
            two.expect_err("is ambiguous"),
            UnusableSettings::NoId { n_names: 2 }
        );
    }

    #[test]
    fn fields_are_read_and_the_optional_ones_may_be_left_out() {
        let pattern = Pattern::new(NORTH, &names(&[])).expect("makes sense");
        let sighting = pattern.read("7:1.5,-2,30 age 0.25", 100.0).expect("matches");
        assert_eq!(
            (sighting.address.as_str(), sighting.clock),
            ("7", Clock::Arrived(99.75))
        );
        let vector = Vector3::new(1.5, -2.0, 30.0);
        assert_eq!(sighting.place, Place::vector(Axes::North, vector));
        let flat = pattern.read("7:1.5,-2", 100.0).expect("matches");
        let vector = Vector3::new(1.5, -2.0, 0.0);
        assert_eq!(
            flat.place,
            Place::Vector {
                axes: Axes::North,
                vector,
                tells_depth: false
            }
        );
        for (line, reason) in [
            ("seven:1,2", NO_MATCH),
            ("7:1,x", super::super::sighting::NUMBER),
            ("7:1,inf", super::super::sighting::NUMBER),
            ("7:1,2 age -1", NEGATIVE),
        ] {
            assert_eq!(pattern.read(line, 0.0), Err(reason), "{line}");
        }
    }

    #[test]
    fn a_pattern_without_an_id_is_of_the_only_auv() {
        let pattern = r"^(?<lat_deg>\S+) (?<lon_deg>\S+) at (?<t_s>\S+)$";
        let pattern = Pattern::new(pattern, &names(&["pinger"])).expect("makes sense");
        let sighting = pattern.read("60.5 -5.25 at 1000.5", 1002.0).expect("matches");
        assert_eq!(
            (sighting.address.as_str(), sighting.clock),
            ("pinger", Clock::Sent(1000.5))
        );
        assert_eq!(pattern.read("91 0 at 1", 0.0), Err(NOT_ON_EARTH));
    }
}
