//! The record of a mission, out of the log and into a file that other programs open, however long the mission is.
//!
//! A page of events is in memory, and what the format itself has to keep. No format holds the mission.

use std::{
    cell::OnceCell,
    fmt,
    io::{self, BufWriter, Write},
};

use ::record::{Entry, ExportError, Format, Origin, SCHEMA_VERSION, Source};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::ToSchema;

use super::{event::Event, simulation::scenario};
use crate::store::{EventReader, StoreError, StoredEvent};
use row::{Before, Timeline};
use stored::Stored;
use wire::mission::NewMission;

mod row;
mod stored;
#[cfg(test)]
mod tests;

/// Events read at once. With 64 fixes of each of 16 vehicles an event is some 0.2 MB, and a page 13 MB.
const PAGE: usize = 64;

/// The kind of events that tell of plans.
const PLANNED: &str = "planned";

/// What lines are gathered into before the client takes them, bytes.
const PIECE: usize = 64 << 10;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordFormat {
    /// Comma-separated values: one header line, one line a row of the table.
    Csv,
    /// Apache Parquet: the same table with nulls, compressed.
    Parquet,
    /// Lines of JSON: an object a row of the table.
    Ndjson,
    /// MCAP with the schemas of Foxglove and Lichtblick, the rows of the table and every event.
    Mcap,
    /// `GeoJSON` (RFC 7946): where each vehicle was, on Earth.
    Geojson,
    /// Lines of JSON: every event, whole, with its `sequence`.
    EventsNdjson,
}

impl RecordFormat {
    /// Every format.
    pub const ALL: [Self; 6] = [
        Self::Csv,
        Self::Parquet,
        Self::Ndjson,
        Self::Mcap,
        Self::Geojson,
        Self::EventsNdjson,
    ];

    /// The format of the table; none of the events.
    fn of_table(self) -> Option<Format> {
        match self {
            Self::Csv => Some(Format::Csv),
            Self::Parquet => Some(Format::Parquet),
            Self::Ndjson => Some(Format::Ndjson),
            Self::Mcap => Some(Format::Mcap),
            Self::Geojson => Some(Format::Geojson),
            Self::EventsNdjson => None,
        }
    }

    /// What a `Content-Type` calls it: as IANA has it, but for lines of JSON, which it has not.
    #[must_use]
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Ndjson | Self::EventsNdjson => "application/x-ndjson",
            Self::Csv => "text/csv; charset=utf-8; header=present",
            Self::Parquet => "application/vnd.apache.parquet",
            Self::Mcap => "application/vnd.mcap",
            Self::Geojson => "application/geo+json",
        }
    }

    /// The ending of its files, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        self.of_table().map_or("events.ndjson", Format::extension)
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
    /// The mission's origin cannot be used.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] StoreError),
    /// The file did not take it.
    #[error(transparent)]
    Write(#[from] io::Error),
}

/// Writes the mission numbered `number` as the log has it now; what happens to it meanwhile is left out. Equal logs
/// give equal bytes. After an error, what was written is not whole.
pub fn write(
    reader: &EventReader,
    number: u64,
    format: RecordFormat,
    part: &Part,
    out: &mut (impl Write + Send),
) -> Result<(), RecordError> {
    let events = MissionEvents::of(reader, number, part)?;
    match format.of_table() {
        Some(Format::Geojson) if events.origin().is_none() => Err(RecordError::NoOrigin),
        Some(format) => ::record::write(&events, format, out),
        None => events_ndjson(&events, out),
    }
}

/// Which events of a mission. Default: all.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Those after the one with this number.
    pub after: u64,
    /// So many at most, of the kinds that are wanted.
    pub limit: Option<u64>,
    /// Of these kinds alone; of every kind where there are none.
    pub kinds: Vec<String>,
}

impl Part {
    fn has(&self, kind: &str) -> bool {
        self.kinds.is_empty() || self.kinds.iter().any(|wanted| wanted == kind)
    }
}

fn events_ndjson(events: &MissionEvents<'_>, out: &mut impl Write) -> Result<(), RecordError> {
    let mut out = BufWriter::with_capacity(PIECE, out);
    for stored in events.stored() {
        out.write_all(&numbered(&stored?)?)?;
        out.write_all(b"\n")?;
    }
    Ok(out.flush()?)
}

/// The event's JSON with its `sequence` in front. What is stored is not read: it stays as it is to the byte.
fn numbered(stored: &StoredEvent) -> Result<Vec<u8>, StoreError> {
    let Some(members) = stored.body.strip_prefix(b"{") else {
        return Err(StoreError::Damaged(format!(
            "event {} is no event",
            stored.sequence
        )));
    };
    let mut line = format!("{{\"sequence\":{},", stored.sequence).into_bytes();
    line.extend_from_slice(members);
    Ok(line)
}

/// A mission from its making until the record was asked for. It can be gone through more than once.
struct MissionEvents<'a> {
    reader: &'a EventReader,
    number: u64,
    /// The sequence of its last event; 0 where there is none.
    last: u64,
    /// What the client said when it made the mission.
    made_as: Option<Box<NewMission>>,
    /// The mission's clock, which its first event tells.
    start: Timeline,
    /// Where its datum lies, once that was looked for.
    origin: OnceCell<Option<Origin>>,
    part: &'a Part,
}

impl<'a> MissionEvents<'a> {
    fn of(reader: &'a EventReader, number: u64, part: &'a Part) -> Result<Self, StoreError> {
        let first = reader.events(number, 0, 1)?;
        let first = first.first().map(Event::read).transpose()?;
        let mut start = Timeline::default();
        if let Some(event) = &first {
            start.take_up(event);
        }
        let made_as = match first {
            Some(Event::Created { mission, .. }) => Some(mission),
            _ => None,
        };
        Ok(Self {
            reader,
            number,
            last: reader.last_sequence(number)?,
            made_as,
            start,
            origin: OnceCell::new(),
            part,
        })
    }

    fn find_origin(&self) -> Option<Origin> {
        let made_as = self.made_as.as_ref()?;
        if let Some(live) = &made_as.live {
            return live.origin.or_else(|| self.first_fix()).map(Origin::from);
        }
        let simulated = made_as.simulated.as_ref()?;
        scenario(simulated).ok()?.start(simulated.seed).ok()?.origin
    }

    /// Where the first fix put the datum of a live mission that was made without an origin.
    fn first_fix(&self) -> Option<wire::Origin> {
        let whole = Part::default();
        let first = Stored::of(self, &whole)
            .filter_map(Result::ok)
            .find(|stored| stored.kind == "reported")?;
        match Event::read(&first) {
            Ok(Event::Reported { heard, .. }) => heard.origin,
            _ => None,
        }
    }

    /// Its events as they are stored, in order.
    fn stored(&self) -> Stored<'_> {
        Stored::of(self, self.part)
    }

    fn is_live(&self) -> bool {
        let made_as = self.made_as.as_ref();
        made_as.is_some_and(|made_as| made_as.live.is_some())
    }

    /// What the rows of the part depend on of what is before it: a part's rows are those that the whole has.
    fn before(&self) -> Result<Before, RecordError> {
        let mut before = Before {
            timeline: self.start,
            ..Before::default()
        };
        // A live mission's clock runs by itself: its last plan says which fixes are refused, and nothing else.
        let depends = !self.is_live() || self.part.has(PLANNED);
        if 0 < self.part.after && depends {
            let plan = self.reader.last_of_kind(self.number, PLANNED, self.part.after)?;
            if let Some(plan) = plan {
                before.take_up(&Event::read(&plan)?);
            }
        }
        Ok(before)
    }

    /// Hands the events for whose kind `wanted` is true to `take`, with what they tell.
    fn hand(
        &self,
        wanted: impl Fn(&str) -> bool,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        let mut before = self.before()?;
        let mut events = self.stored();
        while let Some(stored) = events.next() {
            let stored = stored?;
            if !wanted(&stored.kind) {
                continue;
            }
            if let Some(plan) = events.passed_plan.take_if(|_| !self.is_live()) {
                before.take_up(&Event::read(&plan)?);
            }
            let event = Event::read(&stored)?;
            let logged_s = before.timeline.take_up(&event);
            take(&Entry {
                logged_s,
                event: Some(&numbered(&stored)?),
                rows: row::rows(stored.sequence, logged_s, &event, &mut before.refused),
            })?;
        }
        Ok(())
    }
}

impl Source for MissionEvents<'_> {
    type Error = RecordError;

    fn about(&self) -> Vec<(&'static str, Value)> {
        let mut about = vec![("schema_version", json!(SCHEMA_VERSION))];
        let Some(made_as) = &self.made_as else {
            return about;
        };
        about.extend(made_as.title.as_ref().map(|title| ("title", json!(title))));
        if let Some(simulated) = &made_as.simulated {
            about.push(("kind", json!("simulated")));
            about.extend(simulated.scenario.as_ref().map(|name| ("scenario", json!(name))));
            about.push(("seed", json!(simulated.seed)));
        } else {
            about.push(("kind", json!("live")));
        }
        about
    }

    /// Where the client said so, or the first fix was. Where a scenario lay that this program no longer has is not known.
    fn origin(&self) -> Option<Origin> {
        *self.origin.get_or_init(|| self.find_origin())
    }

    fn for_each(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        self.hand(|_| true, take)
    }

    /// No other events tell where a vehicle was, and reading one takes its time; so do plans of a live mission.
    fn for_each_with_places(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        let telling = if self.is_live() { "reported" } else { PLANNED };
        self.hand(|kind| kind == telling, take)
    }
}
