//! Recorded tracks that AUVs repeat: CSV files beside the scenario file.

use ::record::with_commas;
use csv::{ReaderBuilder, StringRecord, Trim};
use geodesy::Datum;
use nalgebra::Vector2;

use super::invalid::{InvalidScenario, invalid, refused};
use crate::{
    record::Origin,
    scenario::{
        file::{AuvFile, Scenario, TrackingErrorFile},
        quantity::{Coordinate, Depth, Kind, MissionTime, Speed},
    },
    world::recorded_track::TrackPoint,
};

/// Largest number of points of a track: more than a day at one a second.
const POINTS_MAX: usize = 100_000;
/// Largest height above the surface in a file, m, an error of pressure sensors; counts as surface.
const HEIGHT_MAX: f64 = 5.0;
/// Least step after a repeated fix that counts, m: smaller ones are rounding of an AUV at rest.
const STEP_MIN: f64 = 0.5;
/// Number of such steps in a row that mean repeated fixes. An AUV at rest leaves once.
const STEPS_MAX: usize = 3;

/// Byte order mark that some tools write before the text.
const BYTE_ORDER_MARK: char = '\u{feff}';

const TIME: [&str; 4] = ["t", "t_s", "time", "time_s"];
const NORTH: [&str; 2] = ["north", "north_m"];
const EAST: [&str; 2] = ["east", "east_m"];
const LATITUDE: [&str; 4] = ["latitude", "latitude_deg", "lat", "lat_deg"];
const LONGITUDE: [&str; 5] = ["longitude", "longitude_deg", "lon", "lon_deg", "lng"];
const DEPTH: [&str; 2] = ["depth", "depth_m"];

struct TrackRow {
    line: u64,
    time: f64,
    place: [f64; 2],
    depth: Option<f64>,
}

/// Columns of a file by their meaning.
struct Columns {
    time: usize,
    place: [usize; 2],
    on_earth: bool,
    depth: Option<usize>,
    /// `kind` and `vehicle` of a record of this program.
    record: Option<[usize; 2]>,
}

impl Scenario {
    /// The points of each AUV's recorded track, empty for those that follow a path. Times count
    /// from the earliest of all tracks; a depth that is not in the file is NaN.
    pub(super) fn tracks(&self, origin: Option<Origin>) -> Result<Vec<Vec<TrackPoint>>, InvalidScenario> {
        let track = |(i, auv): (usize, &AuvFile)| {
            let track = auv.track.as_ref().map(|file| self.track(auv, file, origin));
            let track = track.transpose().map(Option::unwrap_or_default);
            track.map_err(|reason| invalid(format!("auvs[{i}].track"), reason))
        };
        let mut tracks: Vec<_> = (0..).zip(&self.auvs).map(track).collect::<Result<_, _>>()?;
        let firsts = tracks.iter().filter_map(|track| track.first());
        let begin = firsts.map(|point| point.time).fold(f64::INFINITY, f64::min);
        for (i, track) in tracks.iter_mut().enumerate() {
            for point in &mut *track {
                point.time -= begin;
            }
            // Otherwise its AUV would rest throughout, or different times would become equal.
            let first = track.first().map_or(0.0, |first| first.time);
            if MissionTime::MAX < first || !track.is_sorted_by(|one, next| one.time < next.time) {
                let reason = format!(
                    "begins {first} s after the earliest of the tracks; a mission lasts {} s at most: have they one clock?",
                    MissionTime::MAX
                );
                return refused(format!("auvs[{i}].track"), reason);
            }
        }
        Ok(tracks)
    }

    fn track(&self, auv: &AuvFile, file: &str, origin: Option<Origin>) -> Result<Vec<TrackPoint>, String> {
        if let Some(member) = given_too(auv) {
            return Err(format!("{member} is given too, and a track says all of that: remove one of them"));
        }
        let text = self.files.text(file).map_err(|error| error.to_string())?;
        let in_file = |reason: String| format!("{file}: {reason}");
        let (columns, rows) = read(&text, &auv.id).map_err(in_file)?;
        if auv.depth_m.is_some() && columns.depth.is_some() {
            return Err(in_file("has a depth, and so has the scenario: remove depth_m".to_owned()));
        }
        let datum = match origin.filter(|_| columns.on_earth) {
            Some(origin) => Some(Datum::new(&origin).map_err(|error| error.to_string())?),
            None if columns.on_earth => {
                return Err("latitudes and longitudes need a datum: add [origin]".to_owned());
            }
            None => None,
        };
        points(&rows, datum.as_ref()).map_err(in_file)
    }
}

/// A member of `auv` that contradicts a track.
fn given_too(auv: &AuvFile) -> Option<&'static str> {
    let members = [
        ("path", auv.path.is_some()),
        ("north_of_path_m", auv.north_of_path_m.is_some()),
        ("east_of_path_m", auv.east_of_path_m.is_some()),
        ("heading_off_path_rad", auv.heading_off_path_rad.is_some()),
        ("speed_mps", auv.speed_mps.is_some()),
        ("speed_profile", auv.speed_profile.is_some()),
        ("dive", auv.dive.is_some()),
        ("navigation_error", auv.navigation_error.is_some()),
        ("tracking_error", auv.tracking_error != TrackingErrorFile::default()),
    ];
    let mut given = members.into_iter().filter(|(_, is_given)| *is_given);
    given.next().map(|(name, _)| name)
}

/// The rows of `text` about the vehicle `id`.
fn read(text: &str, id: &str) -> Result<(Columns, Vec<TrackRow>), String> {
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    let table = with_commas(text.as_bytes());
    let mut reader = ReaderBuilder::new().trim(Trim::All).comment(Some(b'#')).from_reader(&*table);
    let columns = Columns::of(reader.headers().map_err(|error| error.to_string())?)?;
    let mut records = vec![];
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        if columns.record.is_none_or(|[_, vehicle]| record[vehicle] == *id) {
            records.push(record);
        }
    }
    // The truth of a simulated mission, else measurements.
    let is =
        |record: &StringRecord, wanted: &str| columns.record.is_none_or(|[kind, _]| record[kind] == *wanted);
    let wanted = if records.iter().any(|record| is(record, "truth")) { "truth" } else { "fix" };
    records.retain(|record| is(record, wanted));
    let n = records.len();
    if POINTS_MAX < n {
        return Err(format!("has {n} points, more than {POINTS_MAX}: keep every second one"));
    }
    if n < 2 {
        let of = columns.record.map_or_else(String::new, |_| format!(" of {id:?}"));
        return Err(format!("has {n} points{of}; a track has two at least"));
    }
    let rows = records.iter().map(|record| columns.row(text, record));
    let rows = rows.collect::<Result<_, _>>()?;
    Ok((columns, rows))
}

impl Columns {
    fn of(names: &StringRecord) -> Result<Self, String> {
        let column = |known: &[&str]| {
            let mut names = names.iter();
            names.position(|name| known.contains(&name.to_ascii_lowercase().as_str()))
        };
        let both = |one: &[&str], other: &[&str]| Some([column(one)?, column(other)?]);
        let missing = |what: &str| {
            let found: Vec<&str> = names.iter().take(20).collect();
            format!("line 1: no column {what}; it has {}", found.join(", "))
        };
        let local = both(&NORTH, &EAST);
        let place = local.or_else(|| both(&LATITUDE, &LONGITUDE));
        Ok(Self {
            time: column(&TIME).ok_or_else(|| missing("t_s"))?,
            place: place.ok_or_else(|| missing("north_m and east_m, nor lat_deg and lon_deg"))?,
            on_earth: local.is_none(),
            depth: column(&DEPTH),
            record: both(&["kind"], &["vehicle"]),
        })
    }

    fn row(&self, text: &str, record: &StringRecord) -> Result<TrackRow, String> {
        let line = line_of(text, record);
        let number = |name: &str, column: usize| {
            let number = record[column].parse::<f64>().ok();
            number.filter(|number| number.is_finite()).ok_or_else(|| {
                let given: String = record[column].chars().take(40).collect();
                format!("line {line}: {name} {given:?} is no number")
            })
        };
        let [first, second] = if self.on_earth { ["latitude", "longitude"] } else { ["north", "east"] };
        Ok(TrackRow {
            line,
            time: number("t", self.time)?,
            place: [number(first, self.place[0])?, number(second, self.place[1])?],
            depth: self.depth.map(|column| number("depth", column)).transpose()?,
        })
    }
}

/// The line of `record` in `text`; its position may be that of comments and empty lines before.
fn line_of(text: &str, record: &StringRecord) -> u64 {
    let (line, byte) = record.position().map_or((0, 0), |at| (at.line(), at.byte()));
    let rest = usize::try_from(byte).ok().and_then(|byte| text.get(byte..));
    let skipped = rest.unwrap_or_default().lines().take_while(|line| {
        let line = line.trim();
        line.is_empty() || line.starts_with('#')
    });
    line + skipped.map(|_| 1).sum::<u64>()
}

/// The points of `rows`: local, or latitudes and longitudes relative to `datum`.
fn points(rows: &[TrackRow], datum: Option<&Datum>) -> Result<Vec<TrackPoint>, String> {
    let mut points: Vec<TrackPoint> = Vec::with_capacity(rows.len());
    let (mut has_moved, mut n_steps) = (true, 0);
    for row in rows {
        let (line, time, depth) = (row.line, row.time, row.depth);
        let position = match (datum, row.place) {
            (None, place) => Vector2::from(place),
            (Some(datum), [lat_deg, lon_deg]) => {
                let [latitude, longitude] = [lat_deg, lon_deg].map(f64::to_radians);
                let local = datum.to_local(&Origin { latitude, longitude });
                local.map_err(|error| format!("line {line}: {error}"))?
            }
        };
        if Coordinate::MAX < position.amax() {
            let (north, east, most) = (position.x, position.y, Coordinate::MAX);
            return Err(format!(
                "line {line}: {north:.0} m north, {east:.0} m east of the datum; {most} m are allowed"
            ));
        }
        if let Some(depth) = depth.filter(|depth| !(-HEIGHT_MAX..=Depth::MAX).contains(depth)) {
            let most = Depth::MAX;
            return Err(format!("line {line}: depth {depth} m is outside 0 to {most} m"));
        }
        let point = TrackPoint { time, position, depth: depth.map_or(f64::NAN, |depth| depth.max(0.0)) };
        if let Some(before) = points.last() {
            let duration = time - before.time;
            if duration <= 0.0 {
                return Err(format!("line {line}: t {time} is not after {}", before.time));
            }
            let step = (position - before.position).norm();
            n_steps = match (has_moved, 0.0 < step) {
                (false, true) if STEP_MIN < step => n_steps + 1,
                (_, true) => 0,
                (_, false) => n_steps,
            };
            has_moved = 0.0 < step;
            if STEPS_MAX <= n_steps {
                return Err(format!(
                    "line {line}: {step:.1} m from the line before, which repeats the position before it, as others do: \
                     keep the first line of every position"
                ));
            }
            let speed = step / duration;
            let descent = (point.depth - before.depth).abs() / duration;
            for (speed, what) in [(speed, ""), (descent, " of depth")] {
                if Speed::MAX < speed {
                    return Err(format!(
                        "line {line}: {speed:.1} m/s{what} from the point before; {} m/s are allowed (is t in seconds?)",
                        Speed::MAX
                    ));
                }
            }
        }
        points.push(point);
    }
    Ok(points)
}
