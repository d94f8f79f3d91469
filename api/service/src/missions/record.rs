//! The record of a mission, as a file for other programs. A mission may be of any length: memory
//! holds a page of events and the format's own data.

use std::cell::OnceCell;
use std::io::{self, BufWriter, Write};

use ::record::{Entry, ExportError, Format, Origin, SCHEMA_VERSION, Source, table::Row};
use planner::fleet::CRAFT_MAX;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::ToSchema;

use super::{event::Event, simulation::scenario};
use row::{RowContext, Timeline};
use store::{EventReader, StoreError, StoredEvent};
pub use stored::EventFilter;
use stored::{PLANNED, StoredEvents};
use wire::{DatumChange, mission::NewMission};

mod row;
mod stored;
#[cfg(test)]
mod tests;

/// Size of the buffer of lines, bytes.
const PIECE: usize = 64 << 10;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordFormat {
    /// Comma-separated values: a header line, then a line for each row of the table.
    Csv,
    /// Apache Parquet: the same table with nulls, compressed.
    Parquet,
    /// Lines of JSON: an object for each row of the table.
    Ndjson,
    /// MCAP with the schemas of Foxglove and Lichtblick, the rows of the table and every event.
    Mcap,
    /// `GeoJSON` (RFC 7946): positions of each vehicle on Earth.
    Geojson,
    /// Lines of JSON: every event with its `sequence`.
    EventsNdjson,
}

impl RecordFormat {
    /// Every format.
    pub const ALL: [Self; 6] =
        [Self::Csv, Self::Parquet, Self::Ndjson, Self::Mcap, Self::Geojson, Self::EventsNdjson];

    /// Its media type, registered with IANA except for lines of JSON, and the format of the table;
    /// none for that of the events.
    fn kind(self) -> (&'static str, Option<Format>) {
        match self {
            Self::Csv => ("text/csv; charset=utf-8; header=present", Some(Format::Csv)),
            Self::Parquet => ("application/vnd.apache.parquet", Some(Format::Parquet)),
            Self::Ndjson => ("application/x-ndjson", Some(Format::Ndjson)),
            Self::Mcap => ("application/vnd.mcap", Some(Format::Mcap)),
            Self::Geojson => ("application/geo+json", Some(Format::Geojson)),
            Self::EventsNdjson => ("application/x-ndjson", None),
        }
    }

    /// Its media type.
    pub fn media_type(self) -> &'static str {
        self.kind().0
    }

    /// The extension of its files, without the dot.
    pub fn extension(self) -> &'static str {
        self.kind().1.map_or("events.ndjson", Format::extension)
    }
}

/// The reason that a record is incomplete.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    #[error(
        "GeoJSON needs positions on Earth, which this mission does not have: choose another format, or create the next \
         mission with live.origin, or from a scenario with an [origin], each with lat_deg and lon_deg"
    )]
    NoOrigin,
    #[error(transparent)]
    Export(#[from] ExportError),
    #[error(transparent)]
    Log(#[from] StoreError),
    #[error(transparent)]
    Write(#[from] io::Error),
}

/// Writes the record of the mission numbered `number` as the log has it now. Equal logs give equal
/// bytes. After an error the record is incomplete.
pub fn write(
    reader: &EventReader,
    number: u64,
    format: RecordFormat,
    filter: &EventFilter,
    out: &mut (impl Write + Send),
) -> Result<(), RecordError> {
    let events = MissionEvents::of(reader, number, filter)?;
    match format.kind().1 {
        Some(Format::Geojson) if events.origin().is_none() => Err(RecordError::NoOrigin),
        Some(format) => ::record::write(&events, format, out),
        None => events_ndjson(&events, out),
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

/// The event's JSON with its `sequence` in front. The stored JSON keeps its bytes.
fn numbered(stored: &StoredEvent) -> Result<Vec<u8>, StoreError> {
    let is_none = || StoreError::Damaged(format!("event {} is no event", stored.sequence));
    let members = stored.body.strip_prefix(b"{").ok_or_else(is_none)?;
    let mut line = format!("{{\"sequence\":{},", stored.sequence).into_bytes();
    line.extend_from_slice(members);
    Ok(line)
}

/// The events of a mission until now. They can be read repeatedly.
struct MissionEvents<'a> {
    reader: &'a EventReader,
    number: u64,
    /// The sequence of its last event; 0 if there is none.
    last: u64,
    created: Option<Box<NewMission>>,
    /// The mission's clock, from its first event.
    start: Timeline,
    /// The datum's positions, each with the number of its first event, once looked up.
    origins: OnceCell<Vec<(u64, Origin)>>,
    filter: &'a EventFilter,
}

impl<'a> MissionEvents<'a> {
    fn of(reader: &'a EventReader, number: u64, filter: &'a EventFilter) -> Result<Self, StoreError> {
        let first = reader.events(number, 0, 1)?;
        let first = first.first().map(Event::read).transpose()?;
        let mut start = Timeline::default();
        if let Some(event) = &first {
            start.apply(event);
        }
        let created = match first {
            Some(Event::Created { mission, .. }) => Some(mission),
            _ => None,
        };
        Ok(Self {
            reader,
            number,
            last: reader.last_sequence(number)?,
            created,
            start,
            origins: OnceCell::new(),
            filter,
        })
    }

    fn first_origin(&self) -> Option<Origin> {
        let created = self.created.as_ref()?;
        if let Some(live) = &created.live {
            return live.origin.or_else(|| self.first_fix()).map(Origin::from);
        }
        let simulated = created.simulated.as_ref()?;
        scenario(simulated).ok()?.start(simulated.seed).ok()?.origin
    }

    /// The origins, the first one first.
    fn origins(&self) -> &[(u64, Origin)] {
        self.origins.get_or_init(|| {
            let first = self.first_origin().map(|origin| (0, origin));
            let mut changed = vec![];
            let mut last = self.last;
            while let Ok(Some(stored)) = self.reader.last_of_kind(self.number, "changed", last) {
                if let Ok(Event::Changed { setting, .. }) = Event::read(&stored)
                    && let Some(Some(origin)) = setting.origin
                {
                    changed.push((stored.sequence, origin.into()));
                }
                last = stored.sequence - 1;
            }
            first.into_iter().chain(changed.into_iter().rev()).collect()
        })
    }

    /// Counts the positions of rows of the event numbered `sequence` from the last origin.
    fn count_from_last_datum(&self, sequence: u64, rows: &mut [Row<'_>]) {
        let [before @ .., (_, last)] = self.origins() else {
            return;
        };
        let since = |(since, _): &&(u64, Origin)| *since <= sequence;
        let then = self.origins().iter().rfind(since);
        let then = then.or(before.first()).filter(|(_, then)| then != last);
        let Some(change) = then.and_then(|(_, then)| DatumChange::new((*then).into(), (*last).into())) else {
            return;
        };
        for row in rows {
            for (north, east) in
                [(&mut row.north_m, &mut row.east_m), (&mut row.goal_north_m, &mut row.goal_east_m)]
            {
                if let (Some(north), Some(east)) = (north, east) {
                    change.position(north, east);
                }
            }
        }
    }

    /// The datum from the first fix of a live mission that was created without an origin.
    fn first_fix(&self) -> Option<wire::Origin> {
        let whole = EventFilter::default();
        let stored = StoredEvents::of(self.reader, self.number, self.last, &whole).filter_map(Result::ok);
        let mut heard = stored.filter(|stored| stored.kind == "reported").filter_map(|stored| {
            match Event::read(&stored) {
                Ok(Event::Reported { heard, .. }) => Some(heard),
                _ => None,
            }
        });
        // The first with a position sets it.
        heard
            .find(|heard| !heard.auvs.is_empty() || !heard.asc.is_empty() || !heard.traffic.is_empty())?
            .origin
    }

    /// Its events as stored, in order.
    fn stored(&self) -> StoredEvents<'_> {
        StoredEvents::of(self.reader, self.number, self.last, self.filter)
    }

    fn is_live(&self) -> bool {
        self.created.as_ref().is_some_and(|created| created.live.is_some())
    }

    /// The state before a part, so that its rows equal those of the whole record.
    fn before(&self) -> Result<RowContext, RecordError> {
        let mut before = RowContext { timeline: self.start, ..RowContext::default() };
        let live = self.created.as_ref().and_then(|created| created.live.as_ref());
        // A live mission's clock is independent: only the last plan's refused fixes matter.
        if live.is_some() && !self.filter.has(PLANNED) {
            return Ok(before);
        }
        // Each craft of a fleet plans for AUVs of its own, which may have been another one's the
        // time before.
        let is_fleet = live.is_some_and(|live| !live.surface_craft.is_empty());
        let most = if is_fleet { 2 * CRAFT_MAX - 1 } else { 1 };
        let (mut plans, mut last) = (vec![], self.filter.after);
        while plans.len() < most
            && let Some(plan) = self.reader.last_of_kind(self.number, PLANNED, last)?
        {
            last = plan.sequence - 1;
            plans.push(Event::read(&plan)?);
        }
        plans.iter().rev().for_each(|plan| before.apply(plan));
        Ok(before)
    }

    /// Passes each event of a `wanted` kind to `take`, with its rows.
    fn pass_each(
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
            if let Some(plan) = events.skipped_plan.take_if(|_| !self.is_live()) {
                before.apply(&Event::read(&plan)?);
            }
            let event = Event::read(&stored)?;
            let logged_s = before.timeline.apply(&event);
            let mut rows = row::rows(stored.sequence, logged_s, &event, &mut before.refused);
            self.count_from_last_datum(stored.sequence, &mut rows);
            take(&Entry { logged_s, event: Some(&numbered(&stored)?), rows })?;
        }
        Ok(())
    }
}

impl Source for MissionEvents<'_> {
    type Error = RecordError;

    fn about(&self) -> Vec<(&'static str, Value)> {
        let mut about = vec![("schema_version", json!(SCHEMA_VERSION))];
        let Some(created) = &self.created else {
            return about;
        };
        about.extend(created.title.as_ref().map(|title| ("title", json!(title))));
        if let Some(simulated) = &created.simulated {
            about.push(("kind", json!("simulated")));
            about.extend(simulated.scenario.as_ref().map(|name| ("scenario", json!(name))));
            about.push(("seed", json!(simulated.seed)));
        } else {
            about.push(("kind", json!("live")));
        }
        about
    }

    /// The last origin, from client or first fix; unknown for scenarios that this program lacks.
    fn origin(&self) -> Option<Origin> {
        self.origins().last().map(|(_, origin)| *origin)
    }

    fn has_true_headings(&self) -> bool {
        self.is_live()
    }

    fn for_each(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        self.pass_each(|_| true, take)
    }

    /// Reads only events with vehicle positions, to save time: live reports or simulated plans.
    fn for_each_with_places(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        let positioned = if self.is_live() { "reported" } else { PLANNED };
        self.pass_each(|kind| kind == positioned, take)
    }
}
