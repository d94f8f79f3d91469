//! Laws behind a small HTTP server of the test's own.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread;

use planner::parameters::Parameters;
use planner::plan::{Workspace, plan};
use serde_json::json;
use sim::{guide::MpcGuide, mission::run, record::Record, scenario::Scenario};
use tempfile::TempDir;

use super::*;
use crate::{
    campaign::{Campaign, Directory, Manifest, ScenarioFiles, Shard, run as fly},
    comparison::{Comparison, names},
};

/// Status and body of an answer to the body of a request.
type Law = dyn Fn(&str) -> (u16, String) + Send + Sync;

/// The address at which `law` answers, until the test ends.
fn served_at(law: Arc<Law>) -> GuideUrl {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("is bound");
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let law = law.clone();
            thread::spawn(move || answer_all(stream, law.as_ref()));
        }
    });
    format!("http://{address}/").parse().expect("is an address")
}

/// Answers the requests of one connection. Status 0 closes it without an answer.
fn answer_all(mut stream: TcpStream, law: &Law) -> Option<()> {
    let mut lines = BufReader::new(stream.try_clone().ok()?);
    loop {
        let mut length = 0;
        loop {
            let mut line = String::new();
            lines.read_line(&mut line).ok().filter(|bytes| 0 < *bytes)?;
            let header = line.trim().to_lowercase();
            if header.is_empty() {
                break;
            }
            if let Some(bytes) = header.strip_prefix("content-length:") {
                length = bytes.trim().parse().ok()?;
            }
        }
        let mut body = vec![0; length];
        lines.read_exact(&mut body).ok()?;
        let (status, text) = law(std::str::from_utf8(&body).ok()?);
        if status == 0 {
            return None;
        }
        let head =
            format!("HTTP/1.1 {status} Any\r\nlocation: /there\r\ncontent-length: {}\r\n\r\n", text.len());
        stream.write_all((head + &text).as_bytes()).ok()?;
    }
}

fn always(status: u16, body: &str) -> GuideUrl {
    let body = body.to_owned();
    served_at(Arc::new(move |_: &str| (status, body.clone())))
}

fn scenario() -> Scenario {
    Scenario::named("paper-tracking").expect("exists").lasting(20.0)
}

fn flown(guide: &mut dyn Guide) -> Result<Record, GuideError> {
    run(&scenario(), guide, 1, &mut |_| {})
}

/// The planner as the service has it: nothing is kept from one request to the next.
fn plan_of(body: &str) -> Value {
    let request: wire::PlanRequest = wire::read(body.as_bytes()).expect("is a request");
    let echoed = request.metadata.clone();
    let snapshot = wire::snapshot(request).expect("is valid");
    let plan = plan(&snapshot, &Parameters::default(), &mut Workspace::default());
    json!(wire::Answer::new(&snapshot, &plan, Duration::ZERO, &echoed).planned())
}

/// Straight to the first AUV, faster the farther it is.
fn pursuit(body: &str) -> (u16, String) {
    let snapshot: Value = serde_json::from_str(body).expect("is JSON");
    let (craft, auv) = (&snapshot["asc"], &snapshot["auvs"][0]["state"]);
    let ahead = |member: &str| auv[member].as_f64().expect("given") - craft[member].as_f64().expect("given");
    let (north, east) = (ahead("north_m"), ahead("east_m"));
    let answer = json!({"speed_mps": 0.1 * north.hypot(east), "heading_rad": east.atan2(north)});
    (200, answer.to_string())
}

#[test]
fn the_planner_behind_an_address_flies_the_mission_that_it_flies_here() {
    let url = served_at(Arc::new(|body: &str| (200, plan_of(body).to_string())));
    let there = flown(&mut HttpGuide::new(&url)).expect("flies");
    let here = flown(&mut MpcGuide::new(Parameters::default())).expect("flies");
    assert_eq!(there.guide, GUIDE);
    assert_eq!(there.rows, here.rows);
}

#[test]
fn the_craft_follows_the_reference_of_a_law_up_to_its_largest_speed() {
    let fast = always(200, r#"{"speed_mps": 9, "heading_deg": 270}"#);
    let record = flown(&mut HttpGuide::new(&fast)).expect("flies");
    let limit = record.limits.expect("has a craft").speed_max;
    for row in &record.rows {
        let craft = row.surface_craft.as_ref().expect("has one");
        assert_eq!((craft.reference.speed, craft.method), (limit, None));
        assert!((craft.reference.heading.radians() + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }
}

#[test]
fn metadata_of_an_answer_comes_back_in_the_next_snapshot_of_the_same_mission() {
    let seen = Arc::new(Mutex::new(vec![]));
    let heard = seen.clone();
    let counting = move |body: &str| {
        let snapshot: Value = serde_json::from_str(body).expect("is JSON");
        let n = snapshot["metadata"]["n"].as_u64().unwrap_or(0);
        heard.lock().expect("no law panics").push(n);
        let answer = json!({"speed_mps": 1, "heading_rad": 0, "metadata": {"n": n + 1}});
        (200, answer.to_string())
    };
    let url = served_at(Arc::new(counting));
    for _ in 0..2 {
        flown(&mut HttpGuide::new(&url)).expect("flies");
    }
    let expected: Vec<u64> = (0..20).chain(0..20).collect();
    assert_eq!(*seen.lock().expect("no law panics"), expected);
}

/// Answers without a reference: status | body | fault.
const FAULTS: &str = r#"
500 | ZeroDivisionError | answered with status 500, not 200: ZeroDivisionError
307 |  | answered with status 307, not 200
200 |  | is not JSON
200 | {"speed_mps": NaN, "heading_rad": 0} | no NaN or Infinity either
200 | [1, 0] | speed_mps is no number: [1,0]
200 | {"speed_mps": "1", "heading_rad": 0} | speed_mps is no number
200 | {"speed_mps": 1e308, "heading_rad": 0} | outside 0 to 40 m/s
200 | {"speed_mps": -0.1, "heading_rad": 0} | speed_mps is -0.1, outside
200 | {"speed_mps": 1} | heading_rad is no number
200 | {"reference": {"speed_mps": 1, "heading_rad": 90}} | degrees are heading_deg
200 | {"speed_mps": 1, "heading_rad": 0, "serves": "auv-9"} | serves is "auv-9", and no AUV
200 | {"speed_mps": 1, "heading_rad": 0, "metadata": 3} | metadata is no object
0 |  | no answer (
"#;

#[test]
fn a_law_without_a_reference_ends_the_mission_with_its_fault() {
    let large = format!("{{\"speed_mps\": 1, \"note\": \"{}\"}}", "x".repeat(1 << 20));
    let remembers = json!({"speed_mps": 1, "heading_rad": 0, "metadata": {"all": "x".repeat(4096)}});
    let remembers = remembers.to_string();
    let lines = FAULTS.lines().filter(|line| !line.is_empty());
    let faults = lines.map(|line| {
        let mut parts = line.splitn(3, " | ");
        [(); 3].map(|()| parts.next().expect("three parts").to_owned())
    });
    let long = [
        ["200", "go\n  north", "(expected value at line 1 column 1): go north"],
        ["200", "\u{1b}[2J\u{9b}1A", "\u{fffd}[2J\u{fffd}1A"],
        ["200", &remembers, "more than 4096"],
        ["200", &large, "more than 1048576 bytes"],
    ];
    for [status, body, fault] in faults.chain(long.map(|parts| parts.map(str::to_owned))) {
        let url = always(status.parse().expect("a number"), &body);
        let error = flown(&mut HttpGuide::new(&url)).expect_err("is no reference");
        let error = error.to_string();
        let began = format!("the guide {url} gave no reference at 0 s");
        assert!(error.contains(&fault) && error.contains(&began), "{error}");
        assert!(error.len() < 500, "{} bytes", error.len());
    }
}

#[test]
fn a_law_that_closes_each_connection_gets_one_repeated_request() {
    let asked = Arc::new(Mutex::new(0));
    let (count, from) = (asked.clone(), Arc::new(Mutex::new(u32::MAX)));
    let fails_from = from.clone();
    let url = served_at(Arc::new(move |body: &str| {
        let mut n = count.lock().expect("no law panics");
        *n += 1;
        // Each second question comes on a connection that had an answer.
        if *n % 2 == 0 || *fails_from.lock().expect("no law panics") <= *n {
            return (0, String::new());
        }
        pursuit(body)
    }));
    let here = flown(&mut HttpGuide::new(&served_at(Arc::new(pursuit)))).expect("flies");
    let there = flown(&mut HttpGuide::new(&url)).expect("flies");
    assert_eq!(there.rows, here.rows);
    // 20 questions, and all but the first asked twice.
    assert_eq!(*asked.lock().expect("no law panics"), 39);
    // Gone after its first answer.
    *asked.lock().expect("no law panics") = 0;
    *from.lock().expect("no law panics") = 3;
    let error = flown(&mut HttpGuide::new(&url)).expect_err("is gone").to_string();
    let says = "closed the connection of its last answer and a fresh one";
    assert!(error.contains(says), "{error}");
}

#[test]
fn a_slow_or_absent_law_may_answer_later_and_a_wrong_one_may_not() {
    // Its answer comes when the test ends.
    let (_ends, end) = mpsc::channel::<()>();
    let end = Mutex::new(end);
    let slow = served_at(Arc::new(move |_: &str| {
        let _ = end.lock().expect("is asked once at a time").recv();
        (200, String::new())
    }));
    let mut hasty = HttpGuide::within(&slow, Duration::from_millis(100));
    let nowhere = {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        format!("http://{}/", listener.local_addr().expect("is bound"))
    };
    let mut away = HttpGuide::new(&nowhere.parse().expect("is an address"));
    let mut wrong = HttpGuide::new(&always(200, "{}"));
    for (guide, says, may_pass) in [
        (&mut hasty, "no answer within", true),
        (&mut away, "start the law", true),
        (&mut wrong, "speed_mps", false),
    ] {
        let error = flown(guide).expect_err("is no reference");
        let error = error.downcast::<NoGuidance>().expect("is of the guide");
        assert!(error.to_string().contains(says), "{error}");
        assert_eq!(error.may_pass(), may_pass, "{error}");
    }
}

#[test]
fn invalid_addresses_are_refused() {
    let long = format!("http://host/{}", "x".repeat(2000));
    let wrong = "127.0.0.1:8000 ftp://host/ http:// http:///path file:///etc/passwd";
    for text in wrong.split(' ').chain(["", &long]) {
        assert!(text.parse::<GuideUrl>().is_err(), "{text}");
    }
    let url: GuideUrl = "http://host:1/law".parse().expect("is one");
    assert_eq!(url.to_string(), "http://host:1/law");
}

#[test]
fn a_comparison_has_the_law_beside_the_planner() {
    let scenario = scenario();
    let url = served_at(Arc::new(pursuit));
    let comparison = Comparison::run(&scenario, 1, Some(&url), &mut |_, _| {}).expect("flies");
    let controllers = comparison.controllers.iter();
    let found: Vec<_> = controllers.map(|controller| controller.name.clone()).collect();
    assert_eq!(found, names(&scenario, Some(&url)));
    assert_eq!(found[..2], ["mpc", GUIDE]);
    let mut record = comparison.controllers[1].record.clone();
    for row in &mut record.rows {
        row.surface_craft.as_mut().expect("has one").solve_ms = None;
    }
    assert_eq!(record, flown(&mut HttpGuide::new(&url)).expect("flies"));
}

/// Two controllers in six conditions.
fn campaign(url: &GuideUrl) -> Campaign {
    let text = format!(
        "schema_version = \"1\"\nname = \"own\"\ntitle = \"a law of one's own\"\nscenarios = [\"paper-tracking\"]\n\
         duration_s = 20\nreplicates = 6\n[[controllers]]\nname = \"own\"\nguide = \"{url}\"\n\
         [[controllers]]\nname = \"los\"\n\
         law = {{ name = \"saturated_los\", gains = {{ look_ahead_m = 5, along_track_gain_per_s = 0.15 }} }}\n"
    );
    Campaign::parse(&text, "own.toml", ScenarioFiles::default()).expect("is a campaign")
}

#[test]
fn a_campaign_stops_without_its_law_and_continues_when_the_law_is_back() {
    let dies = Arc::new(AtomicBool::new(true));
    let dying = dies.clone();
    let url = served_at(Arc::new(move |body: &str| {
        let snapshot: Value = serde_json::from_str(body).expect("is JSON");
        if dying.load(Ordering::Relaxed) && snapshot["t_s"] == 7.0 {
            return (0, String::new());
        }
        pursuit(body)
    }));
    let folder = TempDir::new().expect("is a folder");
    let campaign = campaign(&url);
    let fly_in = |name: &str, jobs: usize| {
        let manifest = Manifest::of(&campaign, Shard::WHOLE);
        let directory = Directory::create(&folder.path().join(name), manifest).expect("is a directory");
        let jobs = NonZeroUsize::new(jobs).expect("positive");
        fly(&campaign, &directory, jobs, &mut |_| {})
    };
    let stopped = fly_in("one", 2).expect_err("its law is away").to_string();
    assert!(stopped.contains("at 7 s") && stopped.contains("run it again to continue"), "{stopped}");
    dies.store(false, Ordering::Relaxed);
    let rows = fly_in("one", 3).expect("flies");
    assert_eq!(rows.len(), 12);
    assert_eq!(rows.digest(), fly_in("other", 1).expect("flies").digest());
}

#[test]
fn a_law_whose_answers_are_wrong_fails_its_own_missions_only() {
    let url = always(200, "north");
    let folder = TempDir::new().expect("is a folder");
    let campaign = campaign(&url);
    let directory = Directory::create(folder.path(), Manifest::of(&campaign, Shard::WHOLE)).expect("is one");
    let rows = fly(&campaign, &directory, NonZeroUsize::MIN, &mut |_| {}).expect("ends");
    let failures = rows.words("failure").expect("is a column");
    let told = failures.iter().filter(|why| why.contains("is not JSON"));
    assert_eq!((rows.len(), told.count()), (12, 6));
}
