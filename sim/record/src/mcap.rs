//! A record as MCAP: JSON messages with the schemas of Foxglove and Lichtblick.
//!
//! The frame `world` is east-north-up at the datum: x east, y north, z up. A vehicle's frame, with
//! the vehicle's name, is x forward, y to port, z up (ROS REP 103).
//!
//! | topic | schema | messages |
//! |---|---|---|
//! | `/rows` | `pilotfish.Row` | one a row of the table, as in the lines of JSON |
//! | `/tf` | `foxglove.FrameTransforms` | one a row with a vehicle's position |
//! | `/{vehicle}/pose` | `foxglove.PoseInFrame` | the same |
//! | `/{vehicle}/fix` | `foxglove.LocationFix` | the same, if the record has an origin |
//! | `/scene` | `foxglove.SceneUpdate` | one, with any paths, keep-out discs and area |
//! | `/events` | `pilotfish.Event` | one an event of a mission |
//!
//! Times are on the mission's clock, from the start if simulated, from 1970 if live. The publish
//! time of a message is that of the observation, its log time that of reception by the service.

use std::collections::BTreeMap;
use std::io::{self, Write};

use geodesy::Datum;
use mcap::{
    McapError, McapResult, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};
use serde_json::Value;

use crate::source::{Placed, plain};
use crate::{Entry, Scene, Source};
use messages::{Time, Vehicle};
use schemas::{EVENT, ROW};

mod messages;
mod scene;
mod schemas;

/// The topic of the table's rows.
pub const ROWS: &str = "/rows";

pub(super) fn write<S: Source>(record: &Placed<'_, S>, out: &mut impl Write) -> Result<(), S::Error> {
    let Placed { record: source, datum } = record;
    let mut log = Log::new(out, datum.as_ref(), source.has_true_headings()).map_err(not_written)?;
    let mut scene = Some(source.scene()).filter(|scene| !scene.is_empty());
    let written = log.metadata(&source.about()).map_err(not_written).map_err(S::Error::from);
    let written = written.and_then(|()| {
        record.for_each(&mut |entry| Ok(log.entry(entry, scene.take()).map_err(not_written)?))
    });
    match written {
        Ok(()) => Ok(log.file.finish().map(drop).map_err(not_written)?),
        Err(error) => {
            // Dropping it would write an end; without one, the file is recognisably incomplete.
            log.file.into_inner();
            Err(error)
        }
    }
}

/// The I/O error behind `error`.
fn not_written(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

/// An open MCAP file. Its index, some hundred bytes a megabyte, is in memory.
struct Log<'a, W: Write> {
    file: Writer<NoSeek<W>>,
    datum: Option<&'a Datum>,
    /// `true` if headings are from true north: the convergence turns poses in `world`.
    has_true_headings: bool,
    /// The channel of each topic, and the messages on it.
    channels: BTreeMap<String, (u16, u32)>,
}

impl<'a, W: Write> Log<'a, W> {
    /// Never seeks, so `out` may be a pipe. Chunks, indexes, statistics and the summary are on by
    /// default; compression is off, because it would need C code.
    fn new(out: W, datum: Option<&'a Datum>, has_true_headings: bool) -> McapResult<Self> {
        let file = WriteOptions::new()
            .library(concat!("pilotfish ", env!("CARGO_PKG_VERSION")))
            .disable_seeking(true)
            .create(NoSeek::new(out))?;
        Ok(Self { file, datum, has_true_headings, channels: BTreeMap::new() })
    }

    /// Writes the metadata of the file.
    fn metadata(&mut self, about: &[(&'static str, Value)]) -> McapResult<()> {
        let pairs = about.iter().map(|(key, value)| ((*key).to_owned(), plain(value)));
        self.file.write_metadata(&Metadata { name: "pilotfish".to_owned(), metadata: pairs.collect() })
    }

    fn entry(&mut self, entry: &Entry<'_>, scene: Option<Scene<'_>>) -> McapResult<()> {
        let logged = Time::of_seconds(entry.logged_s);
        if let Some(scene) = scene {
            let update = scene::update(&scene, logged).to_string();
            self.message("/scene", "SceneUpdate", [logged, logged], update.as_bytes())?;
        }
        if let Some(event) = entry.event {
            self.message("/events", EVENT, [logged, logged], event)?;
        }
        for row in &entry.rows {
            let time = Time::of_seconds(row.t_s.unwrap_or_default());
            let times = [time, logged];
            let json = serde_json::to_vec(row).expect("an object of numbers and words");
            self.message(ROWS, ROW, times, &json)?;
            let Some((id, mut vehicle)) = Vehicle::of(row) else { continue };
            if let Some(datum) = self.datum.filter(|_| self.has_true_headings) {
                vehicle.heading -= datum.convergence(&vehicle.position);
            }
            let transforms = messages::frame_transforms(id, &vehicle, time).to_string();
            self.message("/tf", "FrameTransforms", times, transforms.as_bytes())?;
            let pose = messages::pose_in_frame(&vehicle, time).to_string();
            let topic = format!("/{id}/pose");
            self.message(&topic, "PoseInFrame", times, pose.as_bytes())?;
            if let Some(datum) = self.datum {
                let fix = messages::location_fix(id, &vehicle, datum, time).to_string();
                let topic = format!("/{id}/fix");
                self.message(&topic, "LocationFix", times, fix.as_bytes())?;
            }
        }
        Ok(())
    }

    /// Writes a JSON message with its publish and log time. The schema's name is its title.
    fn message(
        &mut self,
        topic: &str,
        kind: &str,
        [published, logged]: [Time; 2],
        message: &[u8],
    ) -> McapResult<()> {
        if !self.channels.contains_key(topic) {
            let schema = schemas::of(kind);
            let name = schema["title"].as_str().unwrap_or_default();
            let schema = self.file.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
            let channel = self.file.add_channel(schema, topic, "json", &BTreeMap::new())?;
            self.channels.insert(topic.to_owned(), (channel, 0));
        }
        let (channel_id, written) = self.channels.get_mut(topic).expect("is made above");
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *written,
            log_time: logged.nanoseconds(),
            publish_time: published.nanoseconds(),
        };
        *written += 1;
        self.file.write_to_known_channel(&header, message)
    }
}

#[cfg(test)]
mod tests {
    use mcap::{MessageStream, Summary};
    use nalgebra::Vector2;
    use serde_json::json;

    use super::*;
    use crate::{
        Format,
        sample_for_tests::{self, Sample},
    };

    fn written(record: &Sample) -> Vec<u8> {
        let mut bytes = vec![];
        crate::write(record, Format::Mcap, &mut bytes).expect("can be written");
        bytes
    }

    /// Time in ns and body of every message on `topic`.
    fn messages(file: &[u8], topic: &str) -> Vec<(u64, Value)> {
        MessageStream::new(file)
            .expect("is MCAP")
            .map(|message| message.expect("can be read"))
            .filter(|message| message.channel.topic == topic)
            .map(|message| {
                let body = serde_json::from_slice(&message.data).expect("is JSON");
                (message.log_time, body)
            })
            .collect()
    }

    #[test]
    fn the_summary_counts_the_messages_of_every_topic() {
        let file = written(&sample_for_tests::record());
        let summary = Summary::read(&file).expect("is MCAP").expect("has a summary");
        let counts = summary.stats.expect("has statistics").channel_message_counts;
        let counted: BTreeMap<&str, (&str, u64)> = summary
            .channels
            .values()
            .map(|channel| {
                let schema = channel.schema.as_ref().expect("has a schema");
                assert_eq!((&*schema.encoding, &*channel.message_encoding), ("jsonschema", "json"));
                (channel.topic.as_str(), (schema.name.as_str(), counts[&channel.id]))
            })
            .collect();
        let expected = [
            ("/asc/fix", ("foxglove.LocationFix", 3)),
            ("/asc/pose", ("foxglove.PoseInFrame", 3)),
            ("/auv-1/fix", ("foxglove.LocationFix", 3)),
            ("/auv-1/pose", ("foxglove.PoseInFrame", 3)),
            ("/rows", ("pilotfish.Row", 12)),
            ("/scene", ("foxglove.SceneUpdate", 1)),
            ("/tf", ("foxglove.FrameTransforms", 6)),
        ];
        assert_eq!(counted, BTreeMap::from(expected));
        assert!(!summary.chunk_indexes.is_empty());
        assert_eq!(summary.metadata_indexes.len(), 1);
    }

    #[test]
    fn times_start_at_zero_and_agree_within_a_message() {
        let file = written(&sample_for_tests::record());
        let poses = messages(&file, "/auv-1/pose");
        let times: Vec<u64> = poses.iter().map(|(time, _)| *time).collect();
        assert_eq!(times, [0, 500_000_000, 1_000_000_000]);
        assert_eq!(poses[1].1["timestamp"], json!({"sec": 0, "nsec": 500_000_000}));
        assert_eq!(poses[2].1["timestamp"], json!({"sec": 1, "nsec": 0}));
    }

    #[test]
    fn poses_turn_true_headings_into_the_frame_of_the_datum() {
        let yaw = |true_headings| {
            let mut record = sample_for_tests::record();
            record.true_headings = true_headings;
            let orientation = &messages(&written(&record), "/asc/pose")[0].1["pose"]["orientation"];
            let number = |member: &str| orientation[member].as_f64().expect("is a number");
            2.0 * number("z").atan2(number("w"))
        };
        let origin = sample_for_tests::record().origin.expect("is there");
        let datum = Datum::new(&origin).expect("is on Earth");
        // Two metres east of the datum; yaw is counter-clockwise.
        let convergence = datum.convergence(&Vector2::new(1.0, 2.0));
        assert!(1e-8 < convergence);
        assert!((yaw(true) - yaw(false) - convergence).abs() < 1e-12);
    }

    #[test]
    fn rows_match_the_table_and_events_are_unchanged() {
        let mut record = sample_for_tests::record();
        record.origin = None;
        record.events = vec![r#"{"sequence":1,"kind":"ran"}"#, r#"{"sequence":2,"kind":"finished"}"#];
        let file = written(&record);
        let rows: Vec<Value> = messages(&file, ROWS).into_iter().map(|(_, row)| row).collect();
        assert_eq!(json!(rows), json!(record.rows()));
        let events = messages(&file, "/events");
        assert_eq!(events[1], (500_000_000, json!({"sequence": 2, "kind": "finished"})));
        assert_eq!(events.len(), 2);
    }
}
