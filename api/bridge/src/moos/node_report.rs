//! Texts of `NAME=value` pairs: reports of vehicles, and ranges to them.

use std::collections::BTreeMap;

use crate::{Origin, on_earth};

/// The pairs of a text, by their names in capitals. Later ones replace earlier ones.
pub(super) struct Pairs<'a>(BTreeMap<String, &'a str>);

/// A report of a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NodeReport {
    pub(super) name: String,
    /// Time of the position, s of Unix time.
    pub(super) t_s: Option<f64>,
    pub(super) position: Option<Origin>,
    /// East and north of the sender's datum, m.
    pub(super) xy: Option<[f64; 2]>,
    /// Speed, m/s, and direction, rad: over ground if it has both.
    pub(super) speed: Option<f64>,
    pub(super) course: Option<f64>,
    pub(super) heading: Option<f64>,
    pub(super) depth_m: Option<f64>,
    pub(super) length_m: Option<f64>,
}

impl<'a> Pairs<'a> {
    pub(super) fn of(text: &'a str) -> Self {
        let pairs = text.split(',').filter_map(|pair| pair.split_once('='));
        Self(pairs.map(|(name, value)| (name.trim().to_ascii_uppercase(), value.trim())).collect())
    }

    /// The first of these that it has.
    pub(super) fn text(&self, names: &[&str]) -> Option<&'a str> {
        names.iter().find_map(|name| self.0.get(*name).copied())
    }

    pub(super) fn number(&self, names: &[&str]) -> Option<f64> {
        self.text(names)?.parse().ok().filter(|number: &f64| number.is_finite())
    }
}

impl NodeReport {
    /// The report in `text`; `None` without a name.
    pub(super) fn read(text: &str) -> Option<Self> {
        let pairs = Pairs::of(text);
        let number = |names: &[&str]| pairs.number(names);
        let angle = |names: &[&str]| number(names).map(f64::to_radians);
        let both = |first, second| number(&[first]).zip(number(&[second]));
        let over_ground = both("SPD_OG", "HDG_OG").map(|(speed, course)| (speed, course.to_radians()));
        let heading = angle(&["HDG"]);
        Some(Self {
            name: pairs.text(&["NAME"]).filter(|name| !name.is_empty())?.to_owned(),
            t_s: number(&["TIME"]),
            position: both("LAT", "LON").and_then(|(lat_deg, lon_deg)| on_earth(lat_deg, lon_deg)),
            xy: both("X", "Y").map(<[f64; 2]>::from),
            speed: over_ground.map(|(speed, _)| speed).or(number(&["SPD"])).filter(|speed| 0.0 <= *speed),
            course: over_ground.map(|(_, course)| course).or(angle(&["COG"])).or(heading),
            heading,
            depth_m: number(&["DEP", "DEPTH"]),
            length_m: number(&["LENGTH"]).filter(|length| 0.0 < *length),
        })
    }
}
