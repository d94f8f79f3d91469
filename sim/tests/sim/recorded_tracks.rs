//! AUVs that repeat a recorded track.

use std::collections::BTreeMap;

use geodesy::Datum;
use nalgebra::Vector2;
use pilotfish_sim::record::{Origin, Record};
use pilotfish_sim::scenario::{Files, Scenario};
use planner::angle::{angle_of, direction, wrap};

use crate::{flown_by, mpc, near, near_to, rows};

/// The scenario `cross-current`, whose AUV repeats the file `text` instead of following its path.
fn scenario(text: &str) -> Result<Scenario, String> {
    let built_in = Scenario::text("cross-current").expect("exists");
    let (before, rest) = built_in.split_once("[[auvs]]").expect("has an AUV");
    let (_, water) = rest.split_once("[water").expect("has a current");
    with_track(&format!("{before}[[auvs]]\nid = \"auv-1\"\ntrack = \"track.csv\"\n\n[water{water}"), text)
}

fn with_track(toml: &str, track: &str) -> Result<Scenario, String> {
    let files = Files::kept(BTreeMap::from([("track.csv".to_owned(), track.to_owned())]));
    let read = Scenario::parse(toml, "mine.toml", files);
    read.and_then(Scenario::checked).map_err(|error| error.to_string())
}

/// A spiral that dives and climbs, once a second for a minute, from a time of day on.
fn spiral() -> Vec<[f64; 4]> {
    let point = |t: f64| {
        let [north, east] = (direction(0.02 * t) * (20.0 + 0.1 * t)).into();
        [36_000.0 + t, north, east, 5.0 + 3.0 * (0.1 * t).sin()]
    };
    (0..=60).map(f64::from).map(point).collect()
}

fn csv(header: &str, rows: &[[f64; 4]]) -> String {
    let line = |[t, a, b, depth]: &[f64; 4]| format!("{t},{a},{b},{depth}\n");
    format!("{header}\n{}", rows.iter().map(line).collect::<String>())
}

/// The mission with the track `text`.
fn flown(text: &str) -> Record {
    flown_by(&scenario(text).expect("is one").lasting(90.0), &mut mpc(), 1)
}

#[test]
fn an_auv_follows_the_positions_and_differences_of_its_file() {
    let rows = spiral();
    let record = flown(&csv("t,north,east,depth", &rows));
    assert_eq!(record.rows.len(), 90);
    for (k, row) in record.rows.iter().enumerate() {
        let auv = &row.auvs[0];
        let [_, north, east, depth] = rows[k.min(60)];
        near_to(auv.position, Vector2::new(north, east), 1e-9);
        near(auv.depth, depth, 1e-9);
        // Through the water along bow and pitch, and with the current.
        let next = rows[(k + 1).min(60)];
        let moves = Vector2::new(next[1] - north, next[2] - east);
        let ahead = direction(auv.heading) * auv.surge * auv.pitch.cos();
        near_to(ahead + auv.current, moves, 1e-9);
        near(-auv.surge * auv.pitch.sin(), next[3] - depth, 1e-9);
        let known = auv.known.as_ref().expect("is heard");
        near(known.speed, moves.norm(), 1e-6);
        if k < 60 {
            near(wrap(known.course - angle_of(&moves)), 0.0, 1e-6);
        }
        assert_eq!((auv.along_track, auv.cross_track), (0.0, 0.0));
    }
    let path = &record.paths[0];
    assert_eq!((path.len(), path[0]), (62, Vector2::new(20.0, 0.0)));
}

#[test]
fn latitudes_and_longitudes_give_the_same_track() {
    let rows = spiral();
    let local = flown(&csv("time_s,north_m,east_m,depth_m", &rows));
    let datum = Datum::new(&local.origin.expect("is off Sesimbra")).expect("is on Earth");
    let on_earth = rows.into_iter().map(|[t, north, east, depth]| {
        let Origin { latitude, longitude } = datum.from_local(&Vector2::new(north, east));
        [t, latitude.to_degrees(), longitude.to_degrees(), depth]
    });
    let on_earth: Vec<_> = on_earth.collect();
    let other = flown(&format!("\u{feff}# from a log\n{}", csv("t,Lat,Lon,depth", &on_earth)));
    for (one, other) in local.rows.iter().zip(&other.rows) {
        // A degree has 15 printed digits: nanometres.
        near_to(one.auvs[0].position, other.auvs[0].position, 1e-6);
    }
}

#[test]
fn a_track_may_have_tabs_or_semicolons_and_decimal_commas() {
    let text = csv("t,north,east,depth", &spiral());
    let expected = flown(&text);
    for separator in ["\t", ";"] {
        let other = text.replace(',', separator);
        for other in [other.replace('.', ","), other] {
            assert_eq!(flown(&format!("# one; two\n{other}")).rows, expected.rows);
        }
    }
}

/// A track to the north at 0.2 m/s; `known` gives the recorded distance after so many seconds.
fn recorded(known: impl Fn(u32) -> f64) -> Result<Scenario, String> {
    let rows: Vec<_> = (0..120).map(|t| [f64::from(t), known(t), 0.0, 5.0]).collect();
    scenario(&csv("t,north,east,depth", &rows))
}

#[test]
fn repeated_fixes_are_refused_as_motion() {
    for (period, line) in [(10, 32), (20, 62)] {
        let refused = recorded(|t| 0.2 * f64::from(t - t % period)).expect_err("goes in bursts");
        let far = period / 5;
        let says = format!("line {line}: {far}.0 m from the line before, which repeats");
        assert!(refused.contains(&says), "{refused}");
    }
    // An AUV at rest may leave and rest again, and its last digit may change.
    recorded(|t| 0.6 * f64::from(t.saturating_sub(60))).expect("leaves once");
    recorded(|t| 0.6 * f64::from(20 * (t / 40) + (t % 40).min(20))).expect("rests between legs");
    recorded(|t| 0.1 * f64::from(t / 7)).expect("is rounded");
}

#[test]
fn a_record_is_a_track_and_two_tracks_share_a_clock() {
    let parsed = |second: &str, track: &str| {
        let both = Scenario::text("paper-midpoint").expect("exists");
        let (head, _) = both.split_once("[[auvs]]").expect("has AUVs");
        let [one, two] =
            ["auv-1", "auv-2"].map(|id| format!("[[auvs]]\nid = \"{id}\"\ntrack = \"track.csv\"\n"));
        with_track(&format!("{head}{one}{second}{two}"), track)
    };
    let row = |t: u32| {
        let (along, later) = (0.3 * f64::from(t), t + 5);
        format!(
            "truth,{t},auv-1,{along},0,2\nknown,{t},auv-1,99,99,9\ntruth,{later},auv-2,0,{along},3\ntruth,{t},asc,7,7,\n"
        )
    };
    let rows: String = (0..20).map(row).collect();
    let text = format!("kind,t_s,vehicle,north_m,east_m,depth_m\nplanned,0,asc,,,\n{rows}");
    let scenario = parsed("", &text).expect("is one").lasting(90.0);
    let record = flown_by(&scenario, &mut mpc(), 1);
    for (t, row) in (0..20_u32).zip(&record.rows) {
        let along = |t: u32| 0.3 * f64::from(t);
        near_to(row.auvs[0].position, Vector2::new(along(t), 0.0), 1e-9);
        let expected = Vector2::new(0.0, along(t.saturating_sub(5)));
        near_to(row.auvs[1].position, expected, 1e-9);
        assert_eq!((row.auvs[0].depth, row.auvs[1].depth), (2.0, 3.0));
    }
    let of_day = text.replace(",auv-2,", "00000,auv-2,");
    let clocks = "auvs[1].track: begins 500000 s after the earliest of the tracks";
    let depths = "auvs[0].track: track.csv: has a depth, and so has the scenario";
    for (second, text, says) in [("", &of_day, clocks), ("depth_m = 7\n", &text, depths)] {
        let refused = parsed(second, text).expect_err(says);
        assert!(refused.contains(says), "{refused}");
    }
}

#[test]
fn a_wrong_track_is_refused_with_its_line() {
    let many = (0..=100_000).map(|t| format!("{t},0,0")).collect::<Vec<_>>().join("\n");
    let many = [format!("t,north,east\n{many}"), "has 100001 points, more than 100000".to_owned()];
    let table = rows(
        r#"
                              | line 1: no column t_s; it has
        a,b\n1,2\n            | line 1: no column t_s; it has a, b
        t,north\n1,2\n        | no column north_m and east_m, nor lat_deg and lon_deg
        t,north,east\n        | has 0 points; a track has two at least
        t,north,east\n0,0,0\n | has 1 points
        t,north,east\n0,0,0\n1,0\n | line: 3
        t,north,east\n0,0,0\n1,x,0\n | line 3: north "x" is no number
        t,north,east\n0,0,0\n1,NaN,0\n | line 3: north "NaN" is no number
        t,north,east\n0,0,0\n1,0.1,0\n1,0.2,0\n | line 4: t 1 is not after 1
        t,north,east\n0,0,0\n# late\n-1,0.1,0\n | line 4: t -1 is not after 0
        t,north,east\n0,0,0\n1,5.1,0\n | line 3: 5.1 m/s from the point before; 5 m/s are allowed
        t,north,east,depth\n0,0,0,0\n1,0,0,6\n | line 3: 6.0 m/s of depth
        t,north,east,depth\n0,0,0,-6\n1,0,0,0\n | line 2: depth -6 m is outside 0 to 2000 m
        t,north,east\n0,0,2e5\n1,0,2e5\n | line 2: 0 m north, 200000 m east of the datum
        t,lat,lon\n0,91,0\n1,91,0\n | line 2:
        kind,vehicle,t_s,north_m,east_m\ntruth,other,0,0,0\n | has 0 points of "auv-1"
        "#,
    );
    for [text, fault] in table.into_iter().chain([many]) {
        let refused = scenario(&text).expect_err(&fault);
        assert!(refused.contains("auvs[0].track: track.csv: "), "{refused}");
        assert!(refused.contains(&fault), "{fault}: {refused}");
        assert!(refused.starts_with("mine.toml:"), "{refused}");
    }
}

#[test]
fn a_member_that_contradicts_a_track_is_refused() {
    let track = "t,north,east\n0,0,0\n9,1,0\n";
    let base = Scenario::text("cross-current").expect("exists");
    let path_too = base.replacen("[auvs.path", "track = \"track.csv\"\n[auvs.path", 1);
    let neither = "schema_version = \"1\"\nname = \"a\"\ntitle = \"a\"\nduration_s = 9\nsettled_after_s = 0\n[[auvs]]\nid = \"auv-1\"\n";
    let alone = |more: &str| format!("{neither}track = \"track.csv\"\n{more}");
    let astray = "[[faults]]\nfrom_s = 1\nwhat.auv_dies.auv = \"auv-1\"\n";
    for (toml, fault) in [
        (path_too, "auvs[0].track: "),
        (neither.to_owned(), "auvs[0].path: is missing; give path or track"),
        (alone("speed_mps = 0.3\n"), "auvs[0].track: speed_mps is given too"),
        (alone(astray), "faults[0].what.auv_dies.auv: \"auv-1\" repeats its recorded track"),
    ] {
        let refused = with_track(&toml, track).expect_err(fault);
        assert!(refused.contains(fault), "{refused}");
    }
    with_track(&alone("depth_m = 4\n"), track).expect("has a depth of its own");
    let absent = Scenario::parse(&alone(""), "mine.toml", Files::kept(BTreeMap::new()));
    let absent = absent.and_then(Scenario::checked).expect_err("is absent").to_string();
    assert!(absent.contains("auvs[0].track: \"track.csv\" was not stored"), "{absent}");
}
