//! Lines that a regular expression parses, for modems without a module here.
//!
//! Named groups are fields. A position is one of
//!
//! | groups | from | axes |
//! |---|---|---|
//! | `lat_deg`, `lon_deg` | Earth, WGS 84 | degrees |
//! | `north_m`, `east_m`, and `down_m` if known | transducer | true north, east, down |
//! | `forward_m`, `starboard_m`, `down_m` | transducer | transducer's own |
//! | `range_m`, `bearing_deg`, `elevation_deg` | transducer | its own: clockwise from forward, up |
//! | `range_m` alone | transducer | none: a range, not a position |
//!
//! and further `id`, `depth_m`, `sigma_m`, `travel_time_s`, and `age_s` (since arrival) or `t_s`
//! (when the AUV sent, s of Unix time). A pattern without `id` needs one name in `names`.
//!
//! The regex-lite crate matches every pattern in time linear in the line.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use regex_lite::{Captures, Regex, RegexBuilder};

use super::observation::{Axes, Location, Observation, SignalTime, address, line_of_sight, optional};
use super::settings::UnusableSettings;
use crate::Parsed;

const NO_MATCH: &str = "the pattern does not match";
const MISSING: &str = "the pattern left a group out";
const NEGATIVE: &str = "a field is negative";

/// Memory of the compiled pattern, bytes: a large repetition must not exhaust the machine's.
const COMPILED_MAX: usize = 1 << 20;

/// Groups that any kind of position may have.
const BESIDE: [&str; 6] = ["id", "depth_m", "sigma_m", "age_s", "travel_time_s", "t_s"];

/// A group of both Cartesian kinds.
const DOWN: &str = "down_m";

/// The kind of position, and its required groups, which no other kind has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Geographic,
    North,
    Body,
    Polar,
    Range,
}

const FORMS: [(Form, &[&str]); 4] = [
    (Form::Geographic, &["lat_deg", "lon_deg"]),
    (Form::North, &["north_m", "east_m"]),
    (Form::Body, &["forward_m", "starboard_m"]),
    (Form::Polar, &["range_m", "bearing_deg", "elevation_deg"]),
];

#[derive(Debug)]
pub(super) struct Pattern {
    regex: Regex,
    form: Form,
    /// The address of all lines, if the pattern has no group `id`.
    only: Option<String>,
}

impl Pattern {
    pub(super) fn new(pattern: &str, names: &BTreeMap<String, String>) -> Result<Self, UnusableSettings> {
        let regex = RegexBuilder::new(pattern).size_limit(COMPILED_MAX).build();
        let regex = regex.map_err(|error| UnusableSettings(format!("the pattern is not usable: {error}")))?;
        let groups: Vec<&str> = regex.capture_names().flatten().collect();
        let of_forms = FORMS.iter().flat_map(|(_, groups)| *groups);
        let known: Vec<&str> = of_forms.chain([&DOWN]).chain(&BESIDE).copied().collect();
        if let Some(unknown) = groups.iter().find(|group| !known.contains(group)) {
            let known = known.join(", ");
            let says = format!("the pattern has an unknown group {unknown:?}; groups are {known}");
            return Err(UnusableSettings(says));
        }
        let form = form(&groups)?;
        let only = if groups.contains(&"id") {
            None
        } else {
            let mut addresses = names.keys();
            let (Some(only), None) = (addresses.next(), addresses.next()) else {
                let (has_no_id, n_names) = ("the pattern has no group \"id\"", names.len());
                let says = format!("{has_no_id}, and names has {n_names} entries; then it must have one");
                return Err(UnusableSettings(says));
            };
            Some(only.clone())
        };
        Ok(Self { regex, form, only })
    }

    pub(super) fn is_relative(&self) -> bool {
        self.form != Form::Geographic
    }

    pub(super) fn read(&self, line: &str, received_s: f64) -> Parsed<Observation> {
        let fields = Fields(self.regex.captures(line).ok_or(NO_MATCH)?);
        let address = match &self.only {
            Some(only) => only.clone(),
            None => address(fields.0.name("id").ok_or(MISSING)?.as_str())?,
        };
        let time = match fields.optional("t_s")? {
            Some(sent_s) => SignalTime::Sent(sent_s),
            None => SignalTime::Arrived(received_s - fields.positive("age_s")?.unwrap_or(0.0)),
        };
        Ok(Observation {
            travel_s: fields.positive("travel_time_s")?,
            sigma_m: fields.positive("sigma_m")?,
            depth_m: fields.optional("depth_m")?,
            ..Observation::new(address, time, self.location(&fields)?)
        })
    }

    fn location(&self, fields: &Fields<'_>) -> Parsed<Location> {
        Ok(match self.form {
            Form::Geographic => {
                Location::geographic(fields.required("lat_deg")?, fields.required("lon_deg")?)?
            }
            Form::North => {
                let down = fields.optional(DOWN)?;
                let (north, east) = (fields.required("north_m")?, fields.required("east_m")?);
                Location::Vector {
                    axes: Axes::North,
                    vector: Vector3::new(north, east, down.unwrap_or(0.0)),
                    has_depth: down.is_some(),
                }
            }
            Form::Body => {
                let (forward, starboard) = (fields.required("forward_m")?, fields.required("starboard_m")?);
                let vector = Vector3::new(forward, starboard, fields.required(DOWN)?);
                Location::vector(Axes::Transducer, vector)
            }
            Form::Polar => {
                let range = fields.positive("range_m")?.ok_or(MISSING)?;
                let bearing = fields.required("bearing_deg")?.to_radians();
                let elevation = fields.required("elevation_deg")?.to_radians();
                Location::vector(Axes::Transducer, line_of_sight(bearing, elevation) * range)
            }
            Form::Range => Location::Range(fields.positive("range_m")?.ok_or(MISSING)?),
        })
    }
}

struct Fields<'a>(Captures<'a>);

impl Fields<'_> {
    fn optional(&self, group: &str) -> Parsed<Option<f64>> {
        self.0.name(group).map_or(Ok(None), |text| optional(text.as_str()))
    }

    fn required(&self, group: &str) -> Parsed<f64> {
        self.optional(group)?.ok_or(MISSING)
    }

    fn positive(&self, group: &str) -> Parsed<Option<f64>> {
        match self.optional(group)? {
            Some(value) if value < 0.0 => Err(NEGATIVE),
            value => Ok(value),
        }
    }
}

/// The one kind of position in `groups`, complete.
fn form(groups: &[&str]) -> Result<Form, UnusableSettings> {
    let error = |says: String| Err(UnusableSettings(says));
    let two_positions = |first: &str, second: &str| {
        error(format!("the pattern has positions of two kinds, with {first:?} and with {second:?}"))
    };
    let lacks = |given: &str, missing: &str| {
        error(format!("the pattern has the group {given:?} and lacks {missing:?}"))
    };
    let mut found: Option<(Form, &'static str)> = None;
    for (form, needed) in FORMS {
        let Some(given) = needed.iter().copied().find(|group| groups.contains(group)) else {
            continue;
        };
        if let Some((_, first)) = found {
            return two_positions(first, given);
        }
        let missing: Vec<_> = needed.iter().copied().filter(|group| !groups.contains(group)).collect();
        found = match (form, &missing[..]) {
            (_, []) => Some((form, given)),
            (Form::Polar, ["bearing_deg", "elevation_deg"]) => Some((Form::Range, given)),
            (_, [missing, ..]) => return lacks(given, missing),
        };
    }
    let Some((form, given)) = found else {
        let says = "the pattern has no position: it needs lat_deg and lon_deg, or another kind of position";
        return error(says.to_owned());
    };
    let has_down = groups.contains(&DOWN);
    match form {
        Form::Body if !has_down => lacks(given, DOWN),
        Form::Geographic | Form::Polar | Form::Range if has_down => two_positions(given, DOWN),
        _ => Ok(form),
    }
}

#[cfg(test)]
mod tests {
    use super::super::observation::{NOT_ON_EARTH, NUMBER};
    use super::*;

    fn names(addresses: &[&str]) -> BTreeMap<String, String> {
        addresses.iter().map(|address| ((*address).to_owned(), format!("auv-{address}"))).collect()
    }

    const NORTH: &str =
        r"(?<id>\d+):(?<north_m>[^, ]+),(?<east_m>[^, ]+)(,(?<down_m>[^, ]+))?( age (?<age_s>\S+))?$";

    #[test]
    fn inconsistent_groups_are_named() {
        let place = "(?<lat_deg>.)(?<lon_deg>.)";
        let huge = format!(r"(?<id>\w{{1000}}{{1000}}){place}");
        for (pattern, named) in [
            (r"(?<id>\d)(?<lat>.)", "\"lat\""),
            (r"(?<id>\d)(?<lat_deg>.)", "lacks \"lon_deg\""),
            (r"(?<id>\d)(?<forward_m>.)(?<starboard_m>.)", "lacks \"down_m\""),
            (r"(?<id>\d)(?<range_m>.)(?<bearing_deg>.)", "lacks \"elevation"),
            (&format!(r"(?<id>\d){place}(?<north_m>.)(?<east_m>.)"), "two kinds"),
            (&format!(r"(?<id>\d){place}(?<down_m>.)"), "two kinds"),
            (r"(?<id>\d)(?<range_m>.)(?<down_m>.)", "two kinds"),
            (r"(?<id>\d)(?<down_m>.)", "no position"),
            (place, "names has 0 entries"),
            (r"(?<id>\d", "not usable"),
            (&huge, "size limit"),
        ] {
            let error = Pattern::new(pattern, &names(&[])).expect_err("is invalid").to_string();
            assert!(error.contains(named), "{pattern}: {error}");
        }
        let two = Pattern::new(place, &names(&["1", "2"])).expect_err("is ambiguous");
        assert!(two.to_string().contains("names has 2 entries"), "{two}");
    }

    #[test]
    fn fields_are_read_and_optional_ones_may_be_absent() {
        let pattern = Pattern::new(NORTH, &names(&[])).expect("makes sense");
        for (line, time_s, down, has_depth) in
            [("7:1.5,-2,30 age 0.25", 99.75, 30.0, true), ("7:1.5,-2", 100.0, 0.0, false)]
        {
            let observation = pattern.read(line, 100.0).expect("matches");
            let location =
                Location::Vector { axes: Axes::North, vector: Vector3::new(1.5, -2.0, down), has_depth };
            let expected = Observation::new("7".to_owned(), SignalTime::Arrived(time_s), location);
            assert_eq!(observation, expected);
        }
        for (line, reason) in
            [("seven:1,2", NO_MATCH), ("7:1,x", NUMBER), ("7:1,inf", NUMBER), ("7:1,2 age -1", NEGATIVE)]
        {
            assert_eq!(pattern.read(line, 0.0), Err(reason), "{line}");
        }
    }

    #[test]
    fn a_pattern_without_an_id_has_the_only_name() {
        let pattern = r"^(?<lat_deg>\S+) (?<lon_deg>\S+) at (?<t_s>\S+)$";
        let pattern = Pattern::new(pattern, &names(&["pinger"])).expect("makes sense");
        let observation = pattern.read("60.5 -5.25 at 1000.5", 1002.0).expect("matches");
        let (address, time) = (observation.address.as_str(), observation.time);
        assert_eq!((address, time), ("pinger", SignalTime::Sent(1000.5)));
        assert_eq!(pattern.read("91 0 at 1", 0.0), Err(NOT_ON_EARTH));
    }
}
