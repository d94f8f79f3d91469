//! The record as MCAP: the messages and frames of [`crate::export`]'s, and every event.
//!
//! | topic | schema | messages |
//! |---|---|---|
//! | `/events` | `pilotfish.Event` | one an event, as in the lines of JSON |
//! | `/tf` | `foxglove.FrameTransforms` | one a truth, fix or state: its vehicle in `world` |
//! | `/{vehicle}/pose` | `foxglove.PoseInFrame` | one a truth, fix or state |
//! | `/{vehicle}/fix` | `foxglove.LocationFix` | the same, where the datum lies on Earth |
//!
//! Times are those of the mission's clock: from its start on of a simulated mission, from 1970 on of a live one. What
//! was heard is logged when the service took it up, and published when it was so. A vehicle lies level; of a fix it
//! points where the course led, or north where that was not told, and is at the surface where its depth was not.

use std::{collections::BTreeMap, io::Write};

use mcap::McapError;
use nalgebra::Vector2;
use serde_json::{Value, json};
use sim::datum::Datum;

use super::{Happened, RecordError, Story, numbered, row::Row};
use crate::export::mcap::{
    Log,
    messages::{self, Time, Vehicle},
    not_written, schemas,
};

pub(super) fn write(story: &Story<'_>, out: &mut impl Write) -> Result<(), RecordError> {
    let datum = story.origin().as_ref().map(Datum::new).transpose()?;
    let mut log = Log::new(out)?;
    match tell(story, datum.as_ref(), &mut log) {
        Ok(()) => Ok(log.finish()?),
        Err(error) => {
            log.break_off();
            Err(error)
        }
    }
}

impl From<McapError> for RecordError {
    fn from(error: McapError) -> Self {
        Self::Write(not_written(error))
    }
}

/// The file's index, of some hundred bytes a megabyte of it, is in memory until its end.
fn tell<W: Write>(story: &Story<'_>, datum: Option<&Datum>, log: &mut Log<W>) -> Result<(), RecordError> {
    let events = log.channel("/events", &event())?;
    let transforms = log.channel("/tf", &schemas::frame_transforms())?;
    log.metadata(&story.about())?;
    let mut channels = Channels {
        datum,
        transforms,
        vehicles: BTreeMap::new(),
    };
    for happened in story.events() {
        let happened = happened?;
        let logged = Time::of_seconds(happened.time);
        log.late_message(events, [logged, logged], &numbered(&happened.stored)?)?;
        channels.tell(&happened, log)?;
    }
    Ok(())
}

/// Any event: its members are those of its kind.
fn event() -> Value {
    json!({
        "title": "pilotfish.Event",
        "type": "object",
        "properties": {"sequence": {"type": "integer"}, "kind": {"type": "string"}},
        "required": ["sequence", "kind"],
    })
}

struct Channels<'a> {
    datum: Option<&'a Datum>,
    transforms: u16,
    /// Of each vehicle that was seen, its poses and its fixes.
    vehicles: BTreeMap<String, [u16; 2]>,
}

impl Channels<'_> {
    /// Where vehicles were, as the event tells.
    fn tell<W: Write>(&mut self, happened: &Happened, log: &mut Log<W>) -> Result<(), RecordError> {
        let logged = Time::of_seconds(happened.time);
        for row in happened.rows() {
            let Some((id, vehicle)) = vehicle(&row) else {
                continue;
            };
            let time = Time::of_seconds(row.t_s);
            let send = |log: &mut Log<W>, channel, message: Value| {
                log.late_message(channel, [time, logged], message.to_string().as_bytes())
            };
            let poses = self.of(id, log)?;
            send(
                log,
                self.transforms,
                messages::frame_transforms(&[(id, vehicle)], time),
            )?;
            send(log, poses[0], messages::pose_in_frame(&vehicle, time))?;
            if let Some(datum) = self.datum {
                send(log, poses[1], messages::location_fix(id, &vehicle, datum, time))?;
            }
        }
        Ok(())
    }

    /// The channels of a vehicle, made when it is first seen.
    fn of<W: Write>(&mut self, id: &str, log: &mut Log<W>) -> Result<[u16; 2], RecordError> {
        if let Some(channels) = self.vehicles.get(id) {
            return Ok(*channels);
        }
        let poses = log.channel(&format!("/{id}/pose"), &schemas::pose_in_frame())?;
        let fixes = match self.datum {
            Some(_) => log.channel(&format!("/{id}/fix"), &schemas::location_fix())?,
            None => poses,
        };
        self.vehicles.insert(id.to_owned(), [poses, fixes]);
        Ok([poses, fixes])
    }
}

fn vehicle<'a>(row: &Row<'a>) -> Option<(&'a str, Vehicle)> {
    let vehicle = Vehicle {
        position: Vector2::from(row.position?),
        depth: row.depth_m.unwrap_or(0.0),
        heading: row.heading_rad.or(row.course_rad).unwrap_or(0.0),
        pitch: 0.0,
    };
    Some((row.vehicle?.id(), vehicle))
}
