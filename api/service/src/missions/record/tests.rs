use std::{collections::BTreeMap, f64::consts::FRAC_PI_2};

use ::geojson::{FeatureCollection, GeoJson, Geometry, GeometryValue};
use ::mcap::MessageStream;
use ::parquet::file::reader::{FileReader as _, SerializedFileReader};
use allocation_counter::measure;
use axum::body::Bytes;
use clock::Clock;
use serde_json::{Value, json};
use sim::record::method_name;
use tempfile::TempDir;

use super::{row::outcome, *};
use store::{Append, EventStore};

use crate::missions::event::Planned;
use crate::missions::own_craft::OwnCraft;
use wire::{
    Method, Outcome, Reference,
    mission::{Reports, TrueVehicle, Truth},
};

mod parts;

/// An id that every format has to quote.
const ODD: &str = "auv \"1\",\nsouth";

static WHOLE: EventFilter = EventFilter { after: 0, limit: None, kinds: Vec::new() };

/// Creation time of the live mission, Unix time, s, which is a multiple of no period.
const MADE: f64 = 1_760_000_000.125;

/// A log with one mission, of these events.
struct Logged {
    _directory: TempDir,
    log: EventStore,
    reader: EventReader,
    number: u64,
}

impl Logged {
    async fn of(events: impl IntoIterator<Item = Event>) -> Self {
        let directory = tempfile::tempdir().expect("is made");
        let log = EventStore::open(directory.path(), &Clock::simulated(1.8e9)).expect("opens");
        let reader = log.reader().expect("opens");
        let mut logged = Self { _directory: directory, log, reader, number: 0 };
        logged.append(1, events).await;
        let listed = logged.reader.mission("m").expect("reads").expect("is there");
        logged.number = listed.number;
        logged
    }

    async fn append(&self, first: u64, events: impl IntoIterator<Item = Event>) {
        const AT_ONCE: usize = 1_000;
        let mut numbered = (first..).zip(events).peekable();
        while let Some(&(next, _)) = numbered.peek() {
            let some = numbered.by_ref().take(AT_ONCE);
            let append = Append {
                mission: "m".to_owned(),
                number: (1 < next).then_some(1),
                events: some.map(|(sequence, event)| event.stored(sequence)).collect(),
                ..Append::default()
            };
            self.log.append(append).await.expect("is stored");
        }
    }

    fn write(&self, format: RecordFormat) -> Result<Vec<u8>, RecordError> {
        self.write_part(format, &WHOLE)
    }

    fn write_part(&self, format: RecordFormat, part: &EventFilter) -> Result<Vec<u8>, RecordError> {
        let mut bytes = vec![];
        write(&self.reader, self.number, format, part, &mut bytes)?;
        Ok(bytes)
    }

    fn written(&self, format: RecordFormat) -> Vec<u8> {
        self.write(format).expect("can be written")
    }
}

fn made(at_s: f64, mission: Value) -> Event {
    Event::Created { at_s, mission: Box::new(serde_json::from_value(mission).expect("is a mission")) }
}

/// Two vehicles off Sesimbra.
fn made_live() -> Event {
    let live = json!({
        "auvs": [{"id": ODD}, {"id": "auv-2"}],
        "goal": {"kind": "track", "auv": ODD},
        "origin": {"lat_deg": 38.41, "lon_deg": -9.12},
    });
    made(MADE, json!({"schema_version": "1.0", "title": "Two, \"live\"", "live": live}))
}

fn made_simulated() -> Event {
    let simulated = json!({"scenario": "calm", "seed": 3});
    made(MADE, json!({"schema_version": "1.0", "simulated": simulated}))
}

fn reported(at_s: f64, heard: Value) -> Event {
    Event::Reported { at_s, heard: Box::new(serde_json::from_value::<Reports>(heard).expect("are reports")) }
}

fn planned(t_s: f64, truth: Option<Truth>) -> Event {
    Event::Planned(Box::new(Planned {
        craft: None,
        t_s,
        late_s: 0.001,
        solve_time_ns: 700_000,
        outcome: Outcome::Degraded,
        method: Method::SaturatedLos,
        reason: Some("late, \"very\"".to_owned()),
        reference: Reference {
            speed_mps: 0.1 + 0.2,
            heading_rad: -1.0,
            heading_deg: 302.7,
            valid_until_s: t_s + 5.0,
        },
        answer_sha256: "00".repeat(32),
        cut_short: None,
        own_craft: OwnCraft::default(),
        truth: truth.map(Box::new),
        prediction: None,
    }))
}

/// A live mission: the second fix is late, the last vehicle is heard once.
fn live() -> Vec<Event> {
    let fix = |t_s: f64, north_m: f64| json!({"t_s": t_s, "north_m": north_m, "east_m": 0.0, "sigma_m": 0.5});
    let mut deep = fix(MADE + 1.0, 0.0);
    for (name, value) in [("depth_m", 12.5), ("course_rad", FRAC_PI_2), ("speed_mps", 0.3)] {
        deep[name] = json!(value);
    }
    let state = json!({"north_m": 0.0, "east_m": 0.0, "heading_rad": 0.25, "speed_mps": 0.5});
    vec![
        made_live(),
        Event::Ran { at_s: MADE + 0.5, speed_factor: None },
        reported(
            MADE + 3.0,
            json!({
                "received_s": MADE + 2.5,
                "auvs": {ODD: [fix(MADE + 2.0, 100.0), deep], "auv-2": [fix(MADE + 2.0, 7.0)]},
            }),
        ),
        reported(MADE + 4.0, json!({"asc": [{"t_s": MADE + 3.5, "state": state}]})),
        planned(MADE + 4.25, None),
        Event::Failed { at_s: MADE + 5.0, reason: "out of\nluck".to_owned() },
    ]
}

fn truth(north_m: f64) -> Truth {
    let vehicle = TrueVehicle { north_m, east_m: 2.0, depth_m: 0.0, heading_rad: 0.5, speed_mps: 1.0 };
    let auv = TrueVehicle { depth_m: 9.5, ..vehicle };
    Truth {
        asc: vehicle,
        auvs: BTreeMap::from([("auv-1".to_owned(), auv)]),
        goal_north_m: 0.0,
        goal_east_m: 0.0,
        distance_m: 1.0,
        energy_j: 2.0,
        vessels: BTreeMap::new(),
    }
}

fn simulated() -> Vec<Event> {
    vec![
        made_simulated(),
        Event::Ran { at_s: MADE + 1.0, speed_factor: Some(10.0) },
        planned(0.0, Some(truth(0.0))),
        planned(1.0, Some(truth(1.5))),
        Event::Finished { at_s: MADE + 2.0 },
    ]
}

/// The lines of the table, by column, without empty cells.
fn table(csv: &[u8]) -> Vec<BTreeMap<String, String>> {
    let mut reader = ::csv::Reader::from_reader(csv);
    let lines = reader.deserialize().map(|line| line.expect("is a line"));
    lines
        .map(|line: BTreeMap<String, String>| line.into_iter().filter(|(_, cell)| !cell.is_empty()).collect())
        .collect()
}

/// The cells of a line: the members of some objects.
fn line(cells: &[Value]) -> BTreeMap<String, String> {
    let text = |value: &Value| match value {
        Value::String(text) => text.clone(),
        // Whole numbers without a decimal point.
        Value::Number(number) => number.as_f64().expect("is one").to_string(),
        other => other.to_string(),
    };
    let cells = cells.iter().flat_map(|cells| cells.as_object().expect("has cells"));
    cells.map(|(name, value)| (name.clone(), text(value))).collect()
}

#[tokio::test(start_paused = true)]
async fn the_table_of_a_live_mission_has_every_observation_at_its_time() {
    let mut events = live();
    if let Event::Created { mission, .. } = &mut events[0] {
        mission.live.as_mut().expect("is live").origin = None;
    }
    let logged = Logged::of(events).await;
    let order = |sequence: u64, kind: &str, at: f64| json!({"sequence": sequence, "kind": kind, "t_s": at, "received_s": at});
    let fix = |vehicle: &str, at: f64, north: f64| {
        json!({
            "sequence": 3, "kind": "fix", "t_s": at, "received_s": MADE + 2.5, "vehicle": vehicle,
            "north_m": north, "east_m": 0.0, "sigma_m": 0.5,
        })
    };
    let telemetry = json!({"depth_m": 12.5, "course_rad": FRAC_PI_2, "speed_mps": 0.3});
    let state = json!({
        "sequence": 4, "kind": "asc_state", "t_s": MADE + 3.5, "received_s": MADE + 4.0, "vehicle": "asc",
        "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.25, "speed_mps": 0.5, "sway_mps": 0.0, "yaw_rate_radps": 0.0,
    });
    let plan = json!({
        "sequence": 5, "kind": "planned", "t_s": MADE + 4.25, "reference_speed_mps": "0.30000000000000004",
        "reference_heading_rad": -1.0, "outcome": "degraded", "method": "saturated_los",
        "reason": "late, \"very\"", "solve_ms": 0.7, "late_s": 0.001,
    });
    let expected = vec![
        line(&[order(1, "created", MADE)]),
        line(&[order(2, "ran", MADE + 0.5)]),
        line(&[fix(ODD, MADE + 2.0, 100.0)]),
        line(&[fix(ODD, MADE + 1.0, 0.0), telemetry]),
        line(&[fix("auv-2", MADE + 2.0, 7.0)]),
        line(&[state]),
        line(&[plan]),
        line(&[order(6, "failed", MADE + 5.0), json!({"reason": "out of\nluck"})]),
    ];
    assert_eq!(table(&logged.written(RecordFormat::Csv)), expected);
}

#[tokio::test(start_paused = true)]
async fn the_table_of_a_simulated_mission_has_positions_on_the_mission_s_clock() {
    let logged = Logged::of(simulated()).await;
    let table = table(&logged.written(RecordFormat::Csv));
    let cells: Vec<_> = table
        .iter()
        .map(|row| {
            let cell = |name: &str| row.get(name).map_or("", String::as_str);
            [cell("kind"), cell("t_s"), cell("vehicle"), cell("north_m"), cell("depth_m")]
        })
        .collect();
    let expected = [
        ["created", "0", "", "", ""],
        ["ran", "0", "", "", ""],
        ["planned", "0", "", "", ""],
        ["truth", "0", "asc", "0", "0"],
        ["truth", "0", "auv-1", "0", "9.5"],
        ["planned", "1", "", "", ""],
        ["truth", "1", "asc", "1.5", "0"],
        ["truth", "1", "auv-1", "1.5", "9.5"],
        ["finished", "1", "", "", ""],
    ];
    assert_eq!(cells, expected);
    assert_eq!(table[8]["received_s"], (MADE + 2.0).to_string());
}

#[tokio::test(start_paused = true)]
async fn parquet_names_its_mission() {
    let logged = Logged::of(simulated()).await;
    let file = SerializedFileReader::new(Bytes::from(logged.written(RecordFormat::Parquet)));
    let file = file.expect("is Parquet");
    let pairs = file.metadata().file_metadata().key_value_metadata().expect("has pairs");
    let pairs: Vec<(&str, &str)> =
        pairs.iter().map(|pair| (pair.key.as_str(), pair.value.as_deref().unwrap_or_default())).collect();
    let expected = [("schema_version", "3"), ("kind", "simulated"), ("scenario", "calm"), ("seed", "3")];
    assert_eq!(pairs, expected);
}

/// Log and publish time, ns, and body of every message, by topic.
fn messages(file: &[u8]) -> BTreeMap<String, Vec<(u64, u64, Value)>> {
    let mut topics: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for message in MessageStream::new(file).expect("is MCAP") {
        let message = message.expect("can be read");
        let body = serde_json::from_slice(&message.data).expect("is JSON");
        let entry = (message.log_time, message.publish_time, body);
        topics.entry(message.channel.topic.clone()).or_default().push(entry);
    }
    topics
}

/// `true` if `time`, ns, is `seconds` after [`MADE`]. An f64 has Unix times to 256 ns.
fn is_after_made(time: u64, seconds: u64) -> bool {
    (1_760_000_000_125_000_000 + seconds * 1_000_000_000).abs_diff(time) <= 256
}

#[tokio::test(start_paused = true)]
async fn mcap_of_a_live_mission_logs_reports_when_heard_and_publishes_them_when_true() {
    let logged = Logged::of(live()).await;
    let topics = messages(&logged.written(RecordFormat::Mcap));
    let counts: Vec<(&str, usize)> =
        topics.iter().map(|(topic, logged)| (topic.as_str(), logged.len())).collect();
    let (odd_fix, odd_pose) = (format!("/{ODD}/fix"), format!("/{ODD}/pose"));
    let expected = [
        ("/asc/fix", 1),
        ("/asc/pose", 1),
        (odd_fix.as_str(), 2),
        (odd_pose.as_str(), 2),
        ("/auv-2/fix", 1),
        ("/auv-2/pose", 1),
        ("/events", 6),
        ("/rows", 8),
        ("/tf", 4),
    ];
    assert_eq!(counts, expected);

    let (log_time, publish_time, pose) = &topics[&odd_pose][1];
    assert!(is_after_made(*log_time, 3), "{log_time}");
    assert!(is_after_made(*publish_time, 1), "{publish_time}");
    assert_eq!(pose["pose"]["position"], json!({"x": 0.0, "y": 0.0, "z": -12.5}));
    // Its course was east, which is along x.
    assert_eq!(pose["pose"]["orientation"], json!({"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}));

    let (_, _, place) = &topics["/asc/fix"][0];
    let degrees = |name: &str| place[name].as_f64().expect("is a number");
    assert!((degrees("latitude") - 38.41).abs() < 1e-12, "{place}");
    assert!((degrees("longitude") + 9.12).abs() < 1e-12, "{place}");

    let lines = logged.written(RecordFormat::EventsNdjson);
    let lines = lines.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
    let lines: Vec<Value> = lines.map(|line| serde_json::from_slice(line).expect("is JSON")).collect();
    let events: Vec<Value> = topics["/events"].iter().map(|(_, _, event)| event.clone()).collect();
    assert_eq!(events, lines);
}

/// Kind, id, times and positions of a line.
type Track = (String, String, Vec<f64>, Vec<Vec<f64>>);

fn tracks(bytes: &[u8]) -> Vec<Track> {
    let text = std::str::from_utf8(bytes).expect("is text");
    let collection = FeatureCollection::try_from(text.parse::<GeoJson>().expect("is GeoJSON"));
    let features = collection.expect("is a collection").features;
    features
        .into_iter()
        .map(|feature| {
            let word = |name: &str| {
                let value = feature.property(name).and_then(Value::as_str);
                value.expect("is a word").to_owned()
            };
            let times = feature.property("t_s").expect("are there").clone();
            let times: Vec<f64> = serde_json::from_value(times).expect("are numbers");
            let Some(Geometry { value: GeometryValue::LineString { coordinates }, .. }) = &feature.geometry
            else {
                panic!("{feature:?}");
            };
            let positions = coordinates.iter().map(|position| position.as_slice().to_vec());
            (word("kind"), word("id"), times, positions.collect())
        })
        .collect()
}

#[tokio::test(start_paused = true)]
async fn geojson_of_a_live_mission_has_a_line_per_vehicle_heard_twice_in_order_of_time() {
    let logged = Logged::of(live()).await;
    let tracks = tracks(&logged.written(RecordFormat::Geojson));
    let [(kind, id, times, positions)] = tracks.as_slice() else { panic!("{tracks:?}") };
    assert_eq!((kind.as_str(), id.as_str()), ("auv", ODD));
    assert_eq!(times, &[MADE + 1.0, MADE + 2.0]);
    assert_eq!(positions[0], [-9.12, 38.41, -12.5]);
    // A hundred metres of the meridian at that latitude: 111 km a degree, to a thousandth.
    let [longitude, latitude] = positions[1][..] else { panic!("{positions:?}") };
    assert_eq!(longitude, -9.12);
    assert!(((latitude - 38.41) * 111_000.0 - 100.0).abs() < 0.1, "{latitude}");
}

#[tokio::test(start_paused = true)]
async fn a_line_is_in_order_of_time_despite_reports_that_are_minutes_late() {
    let logged = Logged::of(long(2_000)).await;
    let tracks = tracks(&logged.written(RecordFormat::Geojson));
    let [(_, _, times, positions)] = tracks.as_slice() else { panic!("{tracks:?}") };
    assert_eq!((times.len(), positions.len()), (1_000, 1_000));
    assert!(times.is_sorted());
}

#[tokio::test(start_paused = true)]
async fn geojson_of_a_simulated_mission_has_its_vehicles_at_the_scenario_s_origin() {
    let logged = Logged::of(simulated()).await;
    let tracks = tracks(&logged.written(RecordFormat::Geojson));
    let who: Vec<_> =
        tracks.iter().map(|(kind, id, times, _)| (kind.as_str(), id.as_str(), times.as_slice())).collect();
    assert_eq!(
        who,
        [
            ("asc", "asc", &[0.0, 1.0][..]),
            ("auv", "auv-1", &[0.0, 1.0][..]),
            ("goal", "goal", &[0.0, 1.0][..])
        ]
    );
    for (_, _, _, positions) in &tracks[..2] {
        // North by 1.5 m, and not to the east.
        let (from, to) = (&positions[0], &positions[1]);
        assert!(((to[1] - from[1]) * 111_000.0 - 1.5).abs() < 0.01, "{positions:?}");
        assert!((to[0] - from[0]).abs() < 1e-8, "{positions:?}");
    }
    let lengths: Vec<usize> = tracks.iter().map(|(_, _, _, positions)| positions[0].len()).collect();
    assert_eq!(lengths, [2, 3, 2]);
}

#[tokio::test(start_paused = true)]
async fn without_a_position_on_earth_no_byte_of_geojson_is_written() {
    let mut events = live();
    let Event::Created { mission, .. } = &mut events[0] else { panic!("is made first") };
    mission.live.as_mut().expect("is live").origin = None;
    let logged = Logged::of(events).await;
    for format in RecordFormat::ALL {
        let mut bytes = vec![];
        let written = write(&logged.reader, logged.number, format, &WHOLE, &mut bytes);
        if format == RecordFormat::Geojson {
            let error = written.expect_err("has no place on Earth");
            assert!(matches!(error, RecordError::NoOrigin), "{error}");
            assert!(error.to_string().contains("live.origin"), "{error}");
            assert!(bytes.is_empty());
        } else {
            written.expect("can be written");
        }
    }
    let topics = messages(&logged.written(RecordFormat::Mcap));
    assert!(!topics.contains_key("/asc/fix"));
    assert_eq!(topics["/asc/pose"].len(), 1);
}

#[tokio::test(start_paused = true)]
async fn a_mission_without_events_is_written_too() {
    let logged = Logged::of([made_live()]).await;
    assert_eq!(table(&logged.written(RecordFormat::Csv)).len(), 1);
    assert_eq!(messages(&logged.written(RecordFormat::Mcap))["/events"].len(), 1);
    assert!(tracks(&logged.written(RecordFormat::Geojson)).is_empty());
    let empty = Logged { number: logged.number + 1, ..logged };
    assert!(empty.written(RecordFormat::EventsNdjson).is_empty());
    assert!(table(&empty.written(RecordFormat::Csv)).is_empty());
    assert!(messages(&empty.written(RecordFormat::Mcap)).is_empty());
    let file = SerializedFileReader::new(Bytes::from(empty.written(RecordFormat::Parquet)));
    assert_eq!(file.expect("is Parquet").metadata().file_metadata().num_rows(), 0);
    empty.write(RecordFormat::Geojson).expect_err("lies nowhere");
}

#[tokio::test(start_paused = true)]
async fn later_events_are_left_out_of_a_record() {
    let logged = Logged::of(live()).await;
    let events = MissionEvents::of(&logged.reader, logged.number, &WHOLE).expect("reads");
    logged.append(7, [planned(MADE + 6.0, None)]).await;
    let sequences: Vec<u64> = events.stored().map(|event| event.expect("reads").sequence).collect();
    assert_eq!(sequences, [1, 2, 3, 4, 5, 6]);
}

#[tokio::test(start_paused = true)]
async fn a_mission_deleted_during_its_record_is_an_error() {
    let logged = Logged::of(live()).await;
    let mut events = MissionEvents::of(&logged.reader, logged.number, &WHOLE).expect("reads");
    events.last += 1;
    let mut stored = events.stored().skip(6);
    let error = stored.next().expect("is there").expect_err("is gone");
    assert!(error.to_string().contains("event 7"), "{error}");
    assert!(stored.next().is_none());
    let mut bytes = vec![];
    ::record::write(&events, Format::Mcap, &mut bytes).expect_err("is not whole");
    let read = MessageStream::new(&bytes)
        .and_then(|mut messages| messages.try_for_each(|message| message.map(drop)));
    read.expect_err("has no end");
}

#[tokio::test(start_paused = true)]
async fn a_rehearsal_s_clock_is_faster_from_its_creation() {
    let mut events = live();
    let Event::Created { mission, .. } = &mut events[0] else { panic!("is made first") };
    mission.live.as_mut().expect("is live").clock_rate = 10.0;
    let logged = Logged::of(events).await;
    let table = table(&logged.written(RecordFormat::Csv));
    // Half a second after its creation it runs; reports state times of the mission's clock.
    assert_eq!(table[1]["t_s"], (MADE + 5.0).to_string());
    assert_eq!(table[1]["received_s"], (MADE + 0.5).to_string());
    assert_eq!(table[2]["received_s"], (MADE + 2.5).to_string());
    assert_eq!(table[5]["received_s"], (MADE + 40.0).to_string());
}

#[test]
fn names_in_records_are_those_of_the_answers() {
    let methods = [
        Method::Mpc,
        Method::PreviousPlan,
        Method::SaturatedLos,
        Method::Hold,
        Method::SaturatedLosTrackerFrame,
        Method::IntegralLos,
        Method::WaypointBox,
    ];
    for word in methods {
        assert_eq!(serde_json::to_value(word).expect("is a word"), method_name(word));
    }
    for word in [Outcome::Ok, Outcome::Degraded] {
        assert_eq!(serde_json::to_value(word).expect("is a word"), outcome(word));
    }
    for format in RecordFormat::ALL {
        assert_eq!(serde_json::to_value(format).expect("is a word"), format.extension().replace('.', "_"));
    }
}

/// Counts bytes and drops them.
#[derive(Default)]
struct Counter {
    bytes: usize,
    largest: usize,
}

impl Write for Counter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes += bytes.len();
        self.largest = self.largest.max(bytes.len());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A mission with `n` reports, some of them minutes late.
fn long(n: u32) -> impl Iterator<Item = Event> {
    let later = (0..n).map(|k| {
        let at = MADE + f64::from(k);
        let sent = at - f64::from(k % 7 * 60);
        let fix = json!({"t_s": sent, "north_m": f64::from(k), "east_m": 1.0 / 3.0, "sigma_m": 0.5});
        match k % 2 {
            0 => reported(at, json!({"auvs": {ODD: [fix]}})),
            _ => planned(at, None),
        }
    });
    [made_live()].into_iter().chain(later)
}

#[tokio::test(start_paused = true)]
async fn a_file_that_cannot_be_written_is_an_error_and_no_panic() {
    struct Full;
    impl Write for Full {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::StorageFull.into())
        }
        fn flush(&mut self) -> io::Result<()> {
            Err(io::ErrorKind::StorageFull.into())
        }
    }
    // Once while it is written, once at its end.
    for events in [long(3_000).collect(), live()] {
        let logged = Logged::of(events).await;
        for format in RecordFormat::ALL {
            let error = write(&logged.reader, logged.number, format, &WHOLE, &mut Full).expect_err("is full");
            assert!(
                matches!(&error, RecordError::Write(error) if error.kind() == io::ErrorKind::StorageFull),
                "{format:?}: {error:?}"
            );
        }
    }
}

/// A plan of a live mission at `t_s` that refuses the fixes of `refused_t_s`.
fn planned_without(t_s: f64, refused_t_s: &[f64]) -> Event {
    let auv = json!({
        "id": "auv-2", "positions": [[7.5, 1.25], [9.0, 1.25]], "depths_m": [4.0, 4.0],
        "covariances_m2": [[1.0, 0.0, 1.0], [2.0, 0.0, 2.0]], "age_s": 1.5, "refused_t_s": refused_t_s, "drift": [0.0, 0.0],
    });
    let prediction = json!({
        "after_s": [0.0, 5.0], "asc": [[0.0, 0.0], [1.0, 0.0]], "goal": [[3.0, 4.0], [4.0, 4.0]],
        "line_of_sight": [[0.0, 0.0], [1.0, 0.0]], "auvs": [auv],
        "line_of_sight_reference": {"speed_mps": 0.2, "heading_rad": 0.0}, "rms_m": 1.0, "line_of_sight_rms_m": 2.0,
        "craft": {
            "heading_lag_s": 1.0, "heading_offset_rad": 0.0, "surge_lag_s": 1.0, "surge_bias_mps2": 0.0,
            "sway_per_yaw_rate_s": 0.0, "follows": true,
        },
    });
    let Event::Planned(mut plan) = planned(t_s, None) else { unreachable!("is a plan") };
    plan.prediction = Some(serde_json::from_value(prediction).expect("is a prediction"));
    Event::Planned(plan)
}

#[tokio::test(start_paused = true)]
async fn a_live_plan_has_rows_of_estimated_positions_and_one_for_each_refused_fix() {
    let [first, second, third] = [1.0, 2.0, 3.0].map(|s| MADE + s);
    let events = vec![
        made_live(),
        planned_without(first, &[]),
        planned_without(second, &[first]),
        planned_without(third, &[first, second]),
    ];
    let csv = Logged::of(events).await.written(RecordFormat::Csv);
    let rows = table(&csv);
    let of_kind = |kind: &str| -> Vec<_> { rows.iter().filter(|row| row["kind"] == kind).collect() };

    let refused: Vec<_> = of_kind("refused")
        .iter()
        .map(|row| (row["sequence"].as_str(), row["t_s"].parse().expect("is a number")))
        .collect();
    assert_eq!(refused, [("3", first), ("4", second)]);

    let estimated = of_kind("estimated");
    assert_eq!(estimated.len(), 3);
    let cells = ["vehicle", "north_m", "east_m", "depth_m", "age_s"].map(|name| estimated[1][name].as_str());
    assert_eq!(cells, ["auv-2", "7.5", "1.25", "4", "1.5"]);
    assert_eq!(of_kind("planned")[0]["goal_distance_m"], "5");
}

mod slow {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn five_times_the_mission_takes_the_same_memory() {
        // More than Parquet's row group and GeoJSON's window hold.
        const SOME: u32 = 20_000;
        const MANY: u32 = 100_000;
        let (some, many) = (Logged::of(long(SOME)).await, Logged::of(long(MANY)).await);
        for format in RecordFormat::ALL {
            let run = |logged: &Logged| {
                let mut out = Counter::default();
                let memory = measure(|| {
                    write(&logged.reader, logged.number, format, &WHOLE, &mut out).expect("can be written");
                });
                (out, memory.bytes_max)
            };
            let ((short, few), (out, most)) = (run(&some), run(&many));
            assert!(4 * short.bytes < out.bytes, "{format:?}: {} and {}", short.bytes, out.bytes);
            // A chunk of MCAP, and the message that does not fit into it.
            assert!(out.largest < (1 << 20) + (4 << 10), "{format:?}: {}", out.largest);
            // The growth of the indexes, of which Parquet's is the greatest.
            assert!(most < few + (256 << 10), "{format:?}: {few} and {most} bytes");
            assert!(most < 16 << 20, "{format:?}: {most} bytes");
        }
    }
}
