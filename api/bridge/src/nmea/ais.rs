//! Reads AIS messages of vessels: types 1 to 3, 5, 18, 19 and 24 in VDM and VDO sentences.
//!
//! The crate `aivdm` reads the bits. Of the others, `ais` 0.12 rounds positions to single
//! precision, and `nmea-parser` 0.11 keeps parts of messages without bound.

use std::collections::BTreeMap;

use aivdm::message::{AisMessage, StaticDataReport};
use aivdm::string::FixedStr;
use aivdm::{Cog, FragmentAssembler, Heading, Latitude, Longitude, Sentence, Sog};
use planner::snapshot::VesselStatus;

use super::sentence::{KNOT, checked_payload};
use crate::{Parsed, VesselFix, VesselMessage, on_earth, reject_if};

/// Greatest sequence number of a message in parts (IEC 61162-1).
const SEQUENCE_MAX: u8 = 9;
/// Longest message in parts, characters: five slots of the radio channel are 1,064 bits.
const MESSAGE_MAX: usize = 256;
/// Time after which a further part belongs to another message, s.
const PART_AGE_MAX_S: f64 = 5.0;
/// First two digits of craft of a mother ship, whose number stands instead of dimensions.
const CRAFT_OF_A_SHIP: u32 = 98;

/// The messages of which some parts were read, by sequence number, with the time of the last part.
#[derive(Debug, Default)]
pub(super) struct AisReader(BTreeMap<u8, (f64, FragmentAssembler<MESSAGE_MAX>)>);

impl AisReader {
    /// The message that `line` completes; `None` before its last part.
    pub(super) fn read(&mut self, line: &[u8], received_s: f64) -> Parsed<Option<VesselMessage>> {
        checked_payload(line)?;
        let sentence = std::str::from_utf8(line).ok().and_then(|line| Sentence::parse(line).ok());
        let sentence = sentence.ok_or("AIS sentence")?;
        if sentence.fragment_count == 1 {
            return read_message(sentence.payload, sentence.is_own_ship).map(Some);
        }
        let number = sentence.seq_id.unwrap_or_default();
        reject_if(number > SEQUENCE_MAX, "AIS sentence")?;
        let (at, parts) = self.0.entry(number).or_default();
        if !(0.0..=PART_AGE_MAX_S).contains(&(received_s - *at)) {
            parts.reset();
        }
        *at = received_s;
        let whole = parts.push(&sentence).map_err(|_| "part of an AIS message")?;
        whole.map(|whole| read_message(whole.armored, sentence.is_own_ship)).transpose()
    }
}

/// Reads a message. The bits that fill its last character are no harm: some transponders leave out
/// spare bits at the end.
fn read_message(payload: &[u8], is_own: bool) -> Parsed<VesselMessage> {
    let message = aivdm::decode_payload(payload, 0).map_err(|_| "AIS message")?;
    let of = |mmsi: aivdm::Mmsi| VesselMessage { mmsi: mmsi.raw(), is_own, ..VesselMessage::default() };
    Ok(match message {
        AisMessage::PositionReportClassA(at) => {
            let status = vessel_status(at.navigation_status.to_raw());
            let fix = fix((at.latitude, at.longitude), at.sog, at.cog, at.heading, status);
            VesselMessage { fix, ..of(at.mmsi) }
        }
        AisMessage::PositionReportClassB(at) => {
            let status = VesselStatus::default();
            let fix = fix((at.latitude, at.longitude), at.sog, at.cog, at.heading, status);
            VesselMessage { fix, ..of(at.mmsi) }
        }
        AisMessage::PositionReportClassBExtended(at) => {
            let status = VesselStatus::default();
            let sides = [at.dimension_to_port, at.dimension_to_starboard];
            VesselMessage {
                fix: fix((at.latitude, at.longitude), at.sog, at.cog, at.heading, status),
                name: name(&at.name),
                dimensions: dimensions([at.dimension_to_bow, at.dimension_to_stern], sides),
                ..of(at.mmsi)
            }
        }
        AisMessage::StaticVoyageData(ship) => {
            let sides = [ship.dimension_to_port, ship.dimension_to_starboard];
            let dimensions = dimensions([ship.dimension_to_bow, ship.dimension_to_stern], sides);
            VesselMessage { name: name(&ship.name), dimensions, ..of(ship.mmsi) }
        }
        AisMessage::StaticDataReport(StaticDataReport::A(ship)) => {
            VesselMessage { name: name(&ship.name), ..of(ship.mmsi) }
        }
        AisMessage::StaticDataReport(StaticDataReport::B(ship)) => {
            let sides = [ship.dimension_to_port, ship.dimension_to_starboard];
            let dimensions = dimensions([ship.dimension_to_bow, ship.dimension_to_stern], sides);
            let has_its_own = ship.mmsi.raw() / 10_000_000 != CRAFT_OF_A_SHIP;
            VesselMessage { dimensions: dimensions.filter(|_| has_its_own), ..of(ship.mmsi) }
        }
        // Base stations, aircraft, aids to navigation, texts.
        _ => return Err("unused sentence"),
    })
}

/// Speeds, courses and headings beyond their ranges mean "not known".
fn fix(
    (latitude, longitude): (Latitude, Longitude),
    speed: Sog,
    course: Cog,
    heading: Heading,
    status: VesselStatus,
) -> Option<VesselFix> {
    let direction = |degrees: f64| (degrees < 360.0).then(|| degrees.to_radians());
    Some(VesselFix {
        age_s: 0.0,
        position: on_earth(latitude.as_degrees()?, longitude.as_degrees()?)?,
        course: course.degrees().and_then(direction),
        speed: speed.knots().map(|knots| knots * KNOT),
        heading: heading.degrees().map(f64::from).and_then(direction),
        status,
    })
}

/// What a vessel does, by the number of its navigational status (ITU-R M.1371). One that is
/// constrained by its draught or in distress does not give way.
pub(crate) fn vessel_status(said: u8) -> VesselStatus {
    match said {
        1 => VesselStatus::AtAnchor,
        5 => VesselStatus::Moored,
        6 => VesselStatus::Aground,
        7 => VesselStatus::Fishing,
        2..=4 | 14 => VesselStatus::Restricted,
        _ => VesselStatus::UnderWay,
    }
}

/// A text ends at its first `@`.
fn name<const N: usize>(text: &FixedStr<N>) -> Option<String> {
    let name = text.as_str().split('@').next().unwrap_or_default().trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// Distances to the ends and sides; zeros mean "not known".
fn dimensions([bow, stern]: [u16; 2], [port, starboard]: [u8; 2]) -> Option<[f64; 4]> {
    let all = [bow, stern, port.into(), starboard.into()].map(f64::from);
    (0 < bow + stern).then_some(all)
}
