//! The record as `GeoJSON`: one line for each vehicle, and the times of its points.
//!
//! Positions are as in [`crate::export`]: longitude, latitude and, where the depth is known, an altitude of minus it,
//! in WGS 84; lines are not cut at the antimeridian. The log is gone through once to see who is in it and twice for
//! each of them, because a line's points and its times are two lists, neither of which fits into memory.

use std::{
    collections::{BTreeMap, VecDeque},
    io::{self, Write},
};

use nalgebra::Vector2;
use serde_json::json;

use super::{
    RecordError, Story,
    row::{Row, Vehicle, rows},
};
use crate::{
    export::geojson::{Frame, altitude},
    missions::event::Event,
};

/// Points that wait for one that was so before them: reports are at most a day late, and mostly minutes. What is later
/// than as many others stays where it was heard. 160 kB.
const WINDOW: usize = 4_096;

/// Points that a line has at least (RFC 7946, 3.1.4).
const POINTS_MIN: u64 = 2;

pub(super) fn write(story: &Story<'_>, out: &mut impl Write) -> Result<(), RecordError> {
    let frame = Frame::new(story.origin().ok_or(RecordError::NoOrigin)?)?;
    out.write_all(b"{\"type\":\"FeatureCollection\",\"features\":[")?;
    let lines = points_of_each(story)?
        .into_iter()
        .filter(|(_, points)| POINTS_MIN <= *points);
    for (i, (name, _)) in lines.enumerate() {
        out.write_all(if i == 0 { b"\n" } else { b",\n" })?;
        feature(story, &frame, &name, out)?;
    }
    out.write_all(b"\n]}\n")?;
    Ok(())
}

/// A vehicle: its kind and id. The surface craft comes first.
type Name = (&'static str, String);

fn name(vehicle: Vehicle<'_>) -> (&'static str, &str) {
    let kind = match vehicle {
        Vehicle::Asc => "asc",
        Vehicle::Auv(_) => "auv",
    };
    (kind, vehicle.id())
}

fn points_of_each(story: &Story<'_>) -> Result<BTreeMap<Name, u64>, RecordError> {
    let mut points = BTreeMap::new();
    for_each_place(story, |vehicle, _| {
        let (kind, id) = name(vehicle);
        *points.entry((kind, id.to_owned())).or_default() += 1;
        Ok(())
    })?;
    Ok(points)
}

fn feature(story: &Story<'_>, frame: &Frame, name: &Name, out: &mut impl Write) -> Result<(), RecordError> {
    let (kind, id) = name;
    let (kind, id) = (json!(kind), json!(id));
    write!(
        out,
        r#"{{"type":"Feature","properties":{{"kind":{kind},"id":{id},"t_s":"#
    )?;
    list(story, name, out, |out, place| number(out, place.time))?;
    write!(out, r#"}},"geometry":{{"type":"LineString","coordinates":"#)?;
    list(story, name, out, |out, place| {
        let [longitude, latitude] = frame.degrees(&place.position);
        out.write_all(b"[")?;
        number(out, longitude)?;
        out.write_all(b",")?;
        number(out, latitude)?;
        if let Some(depth) = place.depth {
            out.write_all(b",")?;
            number(out, altitude(depth))?;
        }
        out.write_all(b"]")
    })?;
    out.write_all(b"}}")?;
    Ok(())
}

fn number(out: &mut impl Write, number: f64) -> io::Result<()> {
    Ok(serde_json::to_writer(out, &number)?)
}

/// Where a vehicle was at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    /// On the mission's clock, s.
    time: f64,
    /// (north, east), m.
    position: Vector2<f64>,
    /// m.
    depth: Option<f64>,
}

/// A JSON list of what `write_place` makes of the vehicle's places, in the order of their times.
fn list<W: Write>(
    story: &Story<'_>,
    wanted: &Name,
    out: &mut W,
    write_place: impl Fn(&mut W, &Place) -> io::Result<()>,
) -> Result<(), RecordError> {
    let mut begun = false;
    let mut item = |place: Option<Place>| {
        let Some(place) = place else { return Ok(()) };
        out.write_all(if begun { b"," } else { b"[" })?;
        begun = true;
        write_place(out, &place)
    };
    let mut window = Window::default();
    for_each_place(story, |vehicle, place| {
        let (kind, id) = name(vehicle);
        if (kind, id) == (wanted.0, &wanted.1) {
            item(window.push(place))?;
        }
        Ok(())
    })?;
    while let Some(place) = window.0.pop_front() {
        item(Some(place))?;
    }
    out.write_all(b"]")?;
    Ok(())
}

/// Places in the order of their times, so far as they are not too late.
#[derive(Debug, Default)]
struct Window(VecDeque<Place>);

impl Window {
    /// Takes one more, and gives the earliest where there is no room.
    fn push(&mut self, place: Place) -> Option<Place> {
        let order = self.0.partition_point(|earlier| earlier.time <= place.time);
        self.0.insert(order, place);
        if WINDOW < self.0.len() {
            self.0.pop_front()
        } else {
            None
        }
    }
}

/// Hands where vehicles were to `take`, as they were heard.
fn for_each_place(
    story: &Story<'_>,
    mut take: impl FnMut(Vehicle<'_>, Place) -> Result<(), RecordError>,
) -> Result<(), RecordError> {
    for stored in story.stored() {
        let stored = stored?;
        // No others tell where anybody was, and reading one takes its time; so do plans of a live mission.
        let is_live = story
            .made_as
            .as_ref()
            .is_some_and(|made_as| made_as.live.is_some());
        if stored.kind != (if is_live { "reported" } else { "planned" }) {
            continue;
        }
        let event = Event::read(&stored)?;
        let time = match &event {
            Event::Planned(plan) => plan.t_s,
            // Reports tell their own.
            _ => 0.0,
        };
        for row in rows(stored.sequence, time, &event) {
            if let Some((vehicle, place)) = place(&row) {
                take(vehicle, place)?;
            }
        }
    }
    Ok(())
}

fn place<'a>(row: &Row<'a>) -> Option<(Vehicle<'a>, Place)> {
    let vehicle = row.vehicle?;
    let place = Place {
        time: row.t_s,
        position: Vector2::from(row.position?),
        depth: row.depth_m.filter(|_| vehicle != Vehicle::Asc),
    };
    Some((vehicle, place))
}
