//! A record as MCAP: JSON messages with the schemas that Foxglove and Lichtblick draw.
//!
//! The frame `world` is east-north-up at the datum: x east, y north, z up, so that z is minus the depth. A
//! vehicle's frame, named as the vehicle, is x forward, y to port, z up (ROS REP 103). Times count from the
//! mission's start, which is 0 ns.
//!
//! | topic | schema | messages |
//! |---|---|---|
//! | `/tf` | `foxglove.FrameTransforms` | one a tick: every vehicle in `world` |
//! | `/{vehicle}/pose` | `foxglove.PoseInFrame` | one a tick |
//! | `/{vehicle}/fix` | `foxglove.LocationFix` | one a tick, where the datum lies on Earth |
//! | `/scene` | `foxglove.SceneUpdate` | one: paths, keep-out discs, area |
//! | `/tick` | `pilotfish.Tick` | one a tick: the row of the CSV; absent where there was nothing to tell |

use std::{
    collections::BTreeMap,
    io::{self, Write},
};

use mcap::{
    McapError, McapResult, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};
use serde_json::{Map, Value, json};
use sim::{
    datum::Datum,
    record::{Column, Record, Row, Values},
};

use super::{ExportError, about};
use messages::{Time, Vehicle};

pub(crate) mod messages;
mod scene;
pub(crate) mod schemas;

const SURFACE_CRAFT: &str = "asc";

pub(super) fn write(record: &Record, out: &mut impl Write) -> Result<(), ExportError> {
    let datum = record.origin.as_ref().map(Datum::new).transpose()?;
    log(record, datum.as_ref(), out).map_err(|error| ExportError::Write(not_written(error)))
}

/// What a file refused with, where it was the file.
pub(crate) fn not_written(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

fn log(record: &Record, datum: Option<&Datum>, out: &mut impl Write) -> McapResult<()> {
    let columns = record.columns();
    let mut log = Log::new(out)?;
    let scene = log.channel("/scene", &schemas::scene_update())?;
    let transforms = log.channel("/tf", &schemas::frame_transforms())?;
    let tick = log.channel("/tick", &schemas::tick(&columns))?;
    let mut poses = BTreeMap::new();
    let mut fixes = BTreeMap::new();
    for id in ids(record) {
        poses.insert(
            id,
            log.channel(&format!("/{id}/pose"), &schemas::pose_in_frame())?,
        );
        if datum.is_some() {
            fixes.insert(id, log.channel(&format!("/{id}/fix"), &schemas::location_fix())?);
        }
    }
    log.metadata(&about(record))?;

    for (i, row) in record.rows.iter().enumerate() {
        let time = Time::of_seconds(row.time);
        if i == 0 {
            log.message(scene, time, &scene::update(record, time))?;
        }
        let vehicles: Vec<(&str, Vehicle)> = vehicles(record, row).collect();
        log.message(transforms, time, &messages::frame_transforms(&vehicles, time))?;
        for (id, vehicle) in &vehicles {
            if let Some(pose) = poses.get(id) {
                log.message(*pose, time, &messages::pose_in_frame(vehicle, time))?;
            }
            if let (Some(fix), Some(datum)) = (fixes.get(id), datum) {
                log.message(*fix, time, &messages::location_fix(id, vehicle, datum, time))?;
            }
        }
        log.message(tick, time, &cells(&columns, i))?;
    }
    log.finish()
}

fn ids(record: &Record) -> impl Iterator<Item = &str> {
    let surface_craft = record.limits.is_some().then_some(SURFACE_CRAFT);
    surface_craft
        .into_iter()
        .chain(record.diver_ids.iter().map(String::as_str))
}

fn vehicles<'a>(record: &'a Record, row: &Row) -> impl Iterator<Item = (&'a str, Vehicle)> {
    let surface_craft = row.surface_craft.as_ref();
    let divers = record.diver_ids.iter().zip(&row.divers);
    surface_craft
        .map(|craft| (SURFACE_CRAFT, Vehicle::from(craft)))
        .into_iter()
        .chain(divers.map(|(id, diver)| (id.as_str(), Vehicle::from(diver))))
}

/// A row of the table. Absent members, not nulls: the viewers' schemas have one type a member.
fn cells(columns: &[Column], row: usize) -> Value {
    let cells = columns.iter().filter_map(|column| {
        let value = match &column.values {
            Values::Numbers(numbers) => json!(numbers[row]?),
            Values::Words(words) => json!(words[row]),
        };
        Some((column.name.clone(), value))
    });
    Value::Object(cells.collect::<Map<_, _>>())
}

/// An MCAP file being written.
pub(crate) struct Log<W: Write> {
    file: Writer<NoSeek<W>>,
    /// Messages of each channel.
    written: BTreeMap<u16, u32>,
}

impl<W: Write> Log<W> {
    /// Never seeks, so that a pipe will do. Chunks, indexes, statistics and the summary are on by default,
    /// compression is not: it would bring C code.
    pub(crate) fn new(out: W) -> McapResult<Self> {
        let file = WriteOptions::new()
            .library(concat!("pilotfish ", env!("CARGO_PKG_VERSION")))
            .disable_seeking(true)
            .create(NoSeek::new(out))?;
        Ok(Self {
            file,
            written: BTreeMap::new(),
        })
    }

    /// A channel for messages of `schema`, which is named by its title.
    pub(crate) fn channel(&mut self, topic: &str, schema: &Value) -> McapResult<u16> {
        let name = schema["title"].as_str().unwrap_or_default();
        let schema = self
            .file
            .add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
        self.file.add_channel(schema, topic, "json", &BTreeMap::new())
    }

    /// What the file says of itself.
    pub(crate) fn metadata(&mut self, about: &[(&'static str, String)]) -> McapResult<()> {
        let metadata = about
            .iter()
            .map(|(key, value)| ((*key).to_owned(), value.clone()));
        self.file.write_metadata(&Metadata {
            name: "pilotfish".to_owned(),
            metadata: metadata.collect(),
        })
    }

    pub(crate) fn message(&mut self, channel_id: u16, time: Time, message: &Value) -> McapResult<()> {
        self.late_message(channel_id, [time, time], message.to_string().as_bytes())
    }

    /// A message, in JSON, of what was so at one time and known at another.
    pub(crate) fn late_message(
        &mut self,
        channel_id: u16,
        [published, logged]: [Time; 2],
        message: &[u8],
    ) -> McapResult<()> {
        let written = self.written.entry(channel_id).or_default();
        let header = MessageHeader {
            channel_id,
            sequence: *written,
            log_time: logged.nanoseconds(),
            publish_time: published.nanoseconds(),
        };
        *written += 1;
        self.file.write_to_known_channel(&header, message)
    }

    pub(crate) fn finish(mut self) -> McapResult<()> {
        self.file.finish()?;
        Ok(())
    }

    /// Leaves the file without its end, which dropping it would write: nobody takes it for whole.
    pub(crate) fn break_off(self) {
        self.file.into_inner();
    }
}

#[cfg(test)]
mod tests {
    use mcap::{MessageStream, Summary};

    use super::*;
    use crate::export::sample;

    fn written(record: &Record) -> Vec<u8> {
        let mut bytes = vec![];
        write(record, &mut bytes).expect("can be written");
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
    fn the_summary_counts_a_message_a_tick_on_every_topic_but_the_scene() {
        let file = written(&sample::record());
        let summary = Summary::read(&file).expect("is MCAP").expect("has a summary");
        let counts = summary.stats.expect("has statistics").channel_message_counts;
        let counted: BTreeMap<&str, (&str, u64)> = summary
            .channels
            .values()
            .map(|channel| {
                let schema = channel.schema.as_ref().expect("has a schema");
                assert_eq!(
                    (&*schema.encoding, &*channel.message_encoding),
                    ("jsonschema", "json")
                );
                (
                    channel.topic.as_str(),
                    (schema.name.as_str(), counts[&channel.id]),
                )
            })
            .collect();
        let expected = [
            ("/asc/fix", ("foxglove.LocationFix", 3)),
            ("/asc/pose", ("foxglove.PoseInFrame", 3)),
            ("/auv-1/fix", ("foxglove.LocationFix", 3)),
            ("/auv-1/pose", ("foxglove.PoseInFrame", 3)),
            ("/scene", ("foxglove.SceneUpdate", 1)),
            ("/tf", ("foxglove.FrameTransforms", 3)),
            ("/tick", ("pilotfish.Tick", 3)),
        ];
        assert_eq!(counted, BTreeMap::from(expected));
        assert!(!summary.chunk_indexes.is_empty());
        assert_eq!(summary.metadata_indexes.len(), 1);
    }

    #[test]
    fn time_starts_at_nought_and_agrees_within_a_message() {
        let file = written(&sample::record());
        let poses = messages(&file, "/auv-1/pose");
        let times: Vec<u64> = poses.iter().map(|(time, _)| *time).collect();
        assert_eq!(times, [0, 500_000_000, 1_000_000_000]);
        assert_eq!(poses[1].1["timestamp"], json!({"sec": 0, "nsec": 500_000_000}));
        assert_eq!(poses[2].1["timestamp"], json!({"sec": 1, "nsec": 0}));
    }

    #[test]
    fn a_tick_is_the_row_of_the_table_without_what_there_was_not_to_tell() {
        let file = written(&sample::record());
        let ticks = messages(&file, "/tick");
        for (i, (_, tick)) in ticks.iter().enumerate() {
            let mut n_cells = 0;
            for column in sample::record().columns() {
                let expected = match &column.values {
                    Values::Numbers(numbers) => numbers[i].map(|number| json!(number)),
                    Values::Words(words) => Some(json!(words[i])),
                };
                assert_eq!(tick.get(&column.name), expected.as_ref(), "{}", column.name);
                n_cells += usize::from(expected.is_some());
            }
            assert_eq!(tick.as_object().expect("is an object").len(), n_cells);
        }
        assert!(ticks[0].1.get("known_current_north_mps").is_none());
        assert!(ticks[1].1.get("known_current_north_mps").is_some());
    }

    #[test]
    fn without_a_place_on_earth_there_are_no_fixes() {
        let file = written(&Record {
            origin: None,
            ..sample::record()
        });
        assert_eq!(messages(&file, "/asc/fix").len(), 0);
        assert_eq!(messages(&file, "/asc/pose").len(), 3);
    }

    #[test]
    fn a_mission_without_a_surface_craft_has_its_vehicles_only() {
        let mut record = sample::record();
        record.limits = None;
        for row in &mut record.rows {
            row.surface_craft = None;
        }
        let file = written(&record);
        let transforms = messages(&file, "/tf");
        assert_eq!(transforms[0].1["transforms"].as_array().map(Vec::len), Some(1));
        assert_eq!(transforms[0].1["transforms"][0]["child_frame_id"], "auv-1");
    }
}
