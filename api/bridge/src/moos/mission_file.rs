//! The datum in the mission file of a MOOS community.

use std::collections::BTreeMap;

use crate::{Origin, on_earth};

/// A mission file without a datum that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("LatOrigin and LongOrigin must be degrees: expand the file's macros first (nsplug)")]
pub struct NoDatum;

/// The place of x = y = 0: `LatOrigin` and `LongOrigin` outside of all blocks, in any letters.
pub fn datum_of(mission_file: &str) -> Result<Origin, NoDatum> {
    let (mut settings, mut depth) = (BTreeMap::new(), 0_usize);
    for line in mission_file.lines() {
        let line = line.split("//").next().unwrap_or_default();
        if let (0, Some((name, value))) = (depth, line.split_once('=')) {
            settings.insert(name.trim().to_ascii_lowercase(), value.trim());
        }
        depth = (depth + line.matches('{').count()).saturating_sub(line.matches('}').count());
    }
    let degrees = |name| settings.get(name).and_then(|text| text.parse().ok());
    let datum = degrees("latorigin").zip(degrees("longorigin"));
    datum.and_then(|(lat_deg, lon_deg)| on_earth(lat_deg, lon_deg)).ok_or(NoDatum)
}
