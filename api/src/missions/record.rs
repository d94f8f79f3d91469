//! The record of a mission, out of the log and into a file that other programs open, however long the mission is.
//!
//! ```text
//! log ── a page at a time ──► events ──► rows ──► csv, parquet, mcap, geojson
//!                              └───────────────► ndjson
//! ```
//! A page of events is in memory, and what the format itself has to keep: Parquet a group of rows, MCAP a chunk, both
//! an index of what they have written, GeoJSON the points that may still have to be put in order. No format holds the
//! mission.

use std::{
    fmt,
    io::{self, BufWriter, Write},
    vec,
};

use serde::{Deserialize, Serialize};
use sim::{datum::NotOnEarth, record::Origin};
use utoipa::ToSchema;

use super::{
    event::Event,
    log::{self, LogError, Reader},
    simulation::scenario,
};
use crate::wire::mission::NewMission;
use row::{Row, Timeline};

mod csv;
mod geojson;
mod mcap;
mod parquet;
mod row;
#[cfg(test)]
mod tests;

/// Events read at once. With 64 fixes of each of 16 vehicles an event is some 0.2 MB, and a page 13 MB.
const PAGE: usize = 64;

/// What lines and numbers are gathered into before the file takes them, bytes.
const PIECE: usize = 64 << 10;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordFormat {
    /// Lines of JSON: every event, whole, with its `sequence`.
    Ndjson,
    /// Comma-separated values: one header line, one line an observation.
    Csv,
    /// Apache Parquet: the same table with nulls.
    Parquet,
    /// MCAP with the schemas of Foxglove and Lichtblick, and every event.
    Mcap,
    /// `GeoJSON` (RFC 7946): where each vehicle was, on Earth.
    Geojson,
}

impl RecordFormat {
    /// Every format.
    pub const ALL: [Self; 5] = [Self::Ndjson, Self::Csv, Self::Parquet, Self::Mcap, Self::Geojson];

    /// What a `Content-Type` calls it: as IANA has it, but for lines of JSON, which it has not.
    #[must_use]
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Ndjson => "application/x-ndjson",
            Self::Csv => "text/csv; charset=utf-8; header=present",
            Self::Parquet => "application/vnd.apache.parquet",
            Self::Mcap => "application/vnd.mcap",
            Self::Geojson => "application/geo+json",
        }
    }

    /// The ending of its files, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ndjson => "ndjson",
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Mcap => "mcap",
            Self::Geojson => "geojson",
        }
    }
}

impl fmt::Display for RecordFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}

/// Why a record was not written, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The format holds places on Earth and the mission none.
    #[error(
        "GeoJSON needs the place on Earth, which this mission does not tell: take another format, or make the next \
         mission with live.origin, or of a scenario with an [origin], each with lat_deg and lon_deg"
    )]
    NoOrigin,
    /// The mission's origin is no place on Earth.
    #[error("the mission's origin cannot be used")]
    Origin(#[from] NotOnEarth),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The file did not take it.
    #[error(transparent)]
    Write(#[from] io::Error),
}

/// Writes the mission numbered `number` as the log has it now; what happens to it meanwhile is left out. Equal logs
/// give equal bytes. After an error, what was written is not whole.
pub fn write(
    reader: &Reader,
    number: u64,
    format: RecordFormat,
    out: &mut (impl Write + Send),
) -> Result<(), RecordError> {
    let story = Story::of(reader, number)?;
    let mut out = BufWriter::with_capacity(PIECE, out);
    match format {
        RecordFormat::Ndjson => ndjson(&story, &mut out)?,
        RecordFormat::Csv => csv::write(&story, &mut out)?,
        RecordFormat::Parquet => parquet::write(&story, &mut out)?,
        RecordFormat::Mcap => mcap::write(&story, &mut out)?,
        RecordFormat::Geojson => geojson::write(&story, &mut out)?,
    }
    Ok(out.flush()?)
}

fn ndjson(story: &Story<'_>, out: &mut impl Write) -> Result<(), RecordError> {
    for stored in story.stored() {
        out.write_all(&numbered(&stored?)?)?;
        out.write_all(b"\n")?;
    }
    Ok(())
}

/// The event's JSON with its `sequence` in front. What is stored is not read: it stays as it is to the byte.
fn numbered(stored: &log::Event) -> Result<Vec<u8>, LogError> {
    let Some(members) = stored.body.strip_prefix(b"{") else {
        return Err(LogError::Damaged(format!(
            "event {} is no event",
            stored.sequence
        )));
    };
    let mut line = format!("{{\"sequence\":{},", stored.sequence).into_bytes();
    line.extend_from_slice(members);
    Ok(line)
}

/// A mission from its making until the record was asked for. It can be gone through more than once.
struct Story<'a> {
    reader: &'a Reader,
    number: u64,
    /// The sequence of its last event; 0 where there is none.
    last: u64,
    /// What the client said when it made the mission.
    made_as: Option<Box<NewMission>>,
}

impl<'a> Story<'a> {
    fn of(reader: &'a Reader, number: u64) -> Result<Self, LogError> {
        let first = reader.events(number, 0, 1)?;
        let made_as = match first.first().map(Event::read).transpose()? {
            Some(Event::Created { mission, .. }) => Some(mission),
            _ => None,
        };
        Ok(Self {
            reader,
            number,
            last: reader.last_sequence(number)?,
            made_as,
        })
    }

    /// Its events as they are stored, in order.
    fn stored(&self) -> Stored<'_> {
        Stored {
            story: self,
            after: 0,
            page: vec![].into_iter(),
        }
    }

    /// Its events, in order, each with the time that the mission's clock showed.
    fn events(&self) -> impl Iterator<Item = Result<Happened, LogError>> {
        let mut timeline = Timeline::default();
        self.stored().map(move |stored| {
            let stored = stored?;
            let event = Event::read(&stored)?;
            Ok(Happened {
                time: timeline.take_up(&event),
                stored,
                event,
            })
        })
    }

    /// Hands every observation to `take`, in order.
    fn for_each_row(
        &self,
        mut take: impl FnMut(&Row<'_>) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        for happened in self.events() {
            for row in happened?.rows() {
                take(&row)?;
            }
        }
        Ok(())
    }

    /// Where the datum lies on Earth, where the client said so. Nobody knows where a scenario lay that this program no
    /// longer has.
    fn origin(&self) -> Option<Origin> {
        let made_as = self.made_as.as_ref()?;
        if let Some(live) = &made_as.live {
            return live.origin.map(|origin| Origin {
                latitude: origin.lat_deg.to_radians(),
                longitude: origin.lon_deg.to_radians(),
            });
        }
        let simulated = made_as.simulated.as_ref()?;
        scenario(simulated).ok()?.start(simulated.seed).ok()?.origin
    }

    /// What a file says of the mission as a whole, as names and values.
    fn about(&self) -> Vec<(&'static str, String)> {
        let mut about = vec![("schema_version", "1".to_owned())];
        let Some(made_as) = &self.made_as else {
            return about;
        };
        about.extend(made_as.title.clone().map(|title| ("title", title)));
        if let Some(simulated) = &made_as.simulated {
            about.push(("kind", "simulated".to_owned()));
            about.extend(simulated.scenario.clone().map(|name| ("scenario", name)));
            about.push(("seed", simulated.seed.to_string()));
        } else {
            about.push(("kind", "live".to_owned()));
        }
        about
    }
}

/// An event, and when.
struct Happened {
    /// What the mission's clock showed, s.
    time: f64,
    stored: log::Event,
    event: Event,
}

impl Happened {
    fn rows(&self) -> Vec<Row<'_>> {
        row::rows(self.stored.sequence, self.time, &self.event)
    }
}

/// Events out of the log, a page at a time. No transaction is held open: one that waits for a slow client would keep
/// the log from tidying up.
struct Stored<'a> {
    story: &'a Story<'a>,
    after: u64,
    page: vec::IntoIter<log::Event>,
}

impl Iterator for Stored<'_> {
    type Item = Result<log::Event, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        let Story {
            reader, number, last, ..
        } = *self.story;
        if self.after == last {
            return None;
        }
        if self.page.len() == 0 {
            let left = usize::try_from(last - self.after).unwrap_or(PAGE);
            match reader.events(number, self.after, PAGE.min(left)) {
                Ok(page) => self.page = page.into_iter(),
                Err(error) => {
                    self.after = last;
                    return Some(Err(error));
                }
            }
        }
        let Some(event) = self.page.next() else {
            // The mission was deleted meanwhile: what is written is not whole.
            let missing = LogError::Damaged(format!(
                "event {} of mission number {number} is gone",
                self.after + 1
            ));
            self.after = last;
            return Some(Err(missing));
        };
        self.after = event.sequence;
        Some(Ok(event))
    }
}
