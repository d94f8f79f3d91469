//! AUVs that repeat a recorded track.

use std::{collections::BTreeMap, fmt::Write as _};

use geodesy::Datum;
use nalgebra::Vector2;
use pilotfish_sim::{
    mission::run,
    record::{Origin, Record},
    scenario::{Files, Scenario},
};
use planner::angle::wrap;

use crate::mpc;

/// The scenario `cross-current`, whose AUV repeats the file `text` instead of following its path.
fn scenario(text: &str, id: &str) -> Result<Scenario, String> {
    let built_in = Scenario::text("cross-current").expect("exists");
    let (before, rest) = built_in.split_once("[[auvs]]").expect("has an AUV");
    let (_, water) = rest.split_once("[water").expect("has a current");
    let before = before
        .replace("\"cross-current\"", "\"recorded\"")
        .replace("auv-1", id);
    let toml = format!("{before}[[auvs]]\nid = \"{id}\"\ntrack = \"track.csv\"\n\n[water{water}");
    parsed(&toml, text)
}

fn parsed(toml: &str, track: &str) -> Result<Scenario, String> {
    let files = Files::kept(BTreeMap::from([("track.csv".to_owned(), track.to_owned())]));
    let read = Scenario::parse(toml, "mine.toml", files);
    read.and_then(Scenario::checked)
        .map_err(|error| error.to_string())
}

/// A spiral that dives and climbs, once a second for a minute, from a time of day on.
fn spiral() -> Vec<[f64; 4]> {
    let point = |k: u32| {
        let t = f64::from(k);
        let (radius, bearing) = (20.0 + 0.1 * t, 0.02 * t);
        [
            36_000.0 + t,
            radius * bearing.cos(),
            radius * bearing.sin(),
            5.0 + 3.0 * (0.1 * t).sin(),
        ]
    };
    (0..=60).map(point).collect()
}

fn csv(header: &str, rows: &[[f64; 4]]) -> String {
    rows.iter()
        .fold(format!("{header}\n"), |mut text, [t, a, b, depth]| {
            writeln!(text, "{t},{a},{b},{depth}").expect("a string takes everything");
            text
        })
}

fn flown(scenario: &Scenario) -> Record {
    run(&scenario.clone().lasting(90.0), &mut mpc(), 1, &mut |_| {}).expect("flies")
}

#[test]
fn an_auv_follows_the_positions_and_differences_of_its_file() {
    let rows = spiral();
    let record = flown(&scenario(&csv("t,north,east,depth", &rows), "auv-1").expect("is one"));
    assert_eq!(record.rows.len(), 90);
    for (k, row) in record.rows.iter().enumerate() {
        let auv = &row.auvs[0];
        let [_, north, east, depth] = rows[k.min(60)];
        assert!(
            (auv.position - Vector2::new(north, east)).norm() < 1e-9,
            "{k}: {auv:?}"
        );
        assert!((auv.depth - depth).abs() < 1e-9, "{k}: {auv:?}");
        // Through the water along bow and pitch, and with the current.
        let next = rows[(k + 1).min(60)];
        let moves = Vector2::new(next[1] - north, next[2] - east);
        let (sin, cos) = auv.heading.sin_cos();
        let ground = Vector2::new(cos, sin) * auv.surge * auv.pitch.cos() + auv.current;
        assert!((ground - moves).norm() < 1e-9, "{k}: {ground}");
        assert!(
            (-auv.surge * auv.pitch.sin() - (next[3] - depth)).abs() < 1e-9,
            "{k}: {auv:?}"
        );
        let known = auv.known.as_ref().expect("is heard");
        assert!((known.speed - moves.norm()).abs() < 1e-6, "{k}: {known:?}");
        if k < 60 {
            assert!(
                wrap(known.course - moves.y.atan2(moves.x)).abs() < 1e-6,
                "{k}: {known:?}"
            );
        }
        assert_eq!((auv.along_track, auv.cross_track), (0.0, 0.0));
    }
    let path = &record.paths[0];
    assert_eq!((path.len(), path[0]), (62, Vector2::new(20.0, 0.0)));
}

#[test]
fn latitudes_and_longitudes_give_the_same_track() {
    let rows = spiral();
    let local = flown(&scenario(&csv("time_s,north_m,east_m,depth_m", &rows), "auv-1").expect("is one"));
    let origin = local.origin.expect("is off Sesimbra");
    let datum = Datum::new(&origin).expect("is on Earth");
    let on_earth = rows.into_iter().map(|[t, north, east, depth]| {
        let Origin { latitude, longitude } = datum.from_local(&Vector2::new(north, east));
        [t, latitude.to_degrees(), longitude.to_degrees(), depth]
    });
    let on_earth: Vec<_> = on_earth.collect();
    let text = format!("\u{feff}# from a log\n{}", csv("t,Lat,Lon,depth", &on_earth));
    let other = flown(&scenario(&text, "auv-1").expect("is one"));
    for (one, other) in local.rows.iter().zip(&other.rows) {
        // A degree has 15 printed digits: nanometres.
        assert!((one.auvs[0].position - other.auvs[0].position).norm() < 1e-6);
    }
}

#[test]
fn a_track_may_have_tabs_or_semicolons_and_decimal_commas() {
    let text = csv("t,north,east,depth", &spiral());
    let expected = flown(&scenario(&text, "auv-1").expect("is one"));
    for separator in ["\t", ";"] {
        let other = text.replace(',', separator);
        for other in [other.replace('.', ","), other] {
            let record = flown(&scenario(&format!("# one; two\n{other}"), "auv-1").expect("is one"));
            assert_eq!(record.rows, expected.rows);
        }
    }
}

/// A track to the north at 0.2 m/s; `known` gives the recorded distance after so many seconds.
fn recorded(known: impl Fn(u32) -> f64) -> Result<Scenario, String> {
    let rows = (0..120).map(|t| [f64::from(t), known(t), 0.0, 5.0]);
    scenario(&csv("t,north,east,depth", &rows.collect::<Vec<_>>()), "auv-1")
}

#[test]
fn repeated_fixes_are_refused_as_motion() {
    let every = |period: u32| move |t: u32| 0.2 * f64::from(t - t % period);
    for (period, line) in [(10, 32), (20, 62)] {
        let refused = recorded(every(period)).expect_err("goes in bursts");
        assert!(
            refused.contains(&format!(
                "line {line}: {}.0 m from the line before, which repeats",
                period / 5
            )),
            "{refused}"
        );
    }
    // An AUV at rest may leave and rest again, and its last digit may change.
    recorded(|t| 0.6 * f64::from(t.saturating_sub(60))).expect("leaves once");
    recorded(|t| {
        0.6 * f64::from(if t % 40 < 20 {
            20 * (t / 40) + t % 40
        } else {
            20 * (t / 40) + 20
        })
    })
    .expect("rests between legs");
    recorded(|t| 0.1 * f64::from(t / 7)).expect("is rounded");
}

#[test]
fn a_record_is_a_track_and_two_tracks_share_a_clock() {
    let toml = |second: &str| {
        let both = Scenario::text("paper-midpoint").expect("exists");
        let (head, _) = both.split_once("[[auvs]]").expect("has AUVs");
        let [one, two] =
            ["auv-1", "auv-2"].map(|id| format!("[[auvs]]\nid = \"{id}\"\ntrack = \"track.csv\"\n"));
        format!("{head}{one}{second}{two}")
    };
    let header = "kind,t_s,vehicle,north_m,east_m,depth_m";
    let mut text = format!("{header}\nplanned,0,asc,,,\n");
    for t in 0..20_u32 {
        let along = 0.3 * f64::from(t);
        writeln!(text, "truth,{t},auv-1,{along},0,2\nknown,{t},auv-1,99,99,9").expect("takes everything");
        writeln!(text, "truth,{},auv-2,0,{along},3\ntruth,{t},asc,7,7,", t + 5).expect("takes everything");
    }
    let record = flown(&parsed(&toml(""), &text).expect("is one"));
    for (t, row) in record.rows.iter().take(20).enumerate() {
        let along = |t: usize| 0.3 * f64::from(u32::try_from(t).expect("small"));
        assert!(
            (row.auvs[0].position - Vector2::new(along(t), 0.0)).norm() < 1e-9,
            "{t}"
        );
        assert!(
            (row.auvs[1].position - Vector2::new(0.0, along(t.saturating_sub(5)))).norm() < 1e-9,
            "{t}"
        );
        assert_eq!((row.auvs[0].depth, row.auvs[1].depth), (2.0, 3.0));
    }
    let of_day = text.replace(",auv-2,", "00000,auv-2,");
    let other = parsed(&toml(""), &of_day).expect_err("has two clocks");
    assert!(
        other.contains("auvs[1].track: begins 500000 s after the earliest of the tracks"),
        "{other}"
    );
    let constant = parsed(&toml("depth_m = 7\n"), &text).expect_err("has two depths");
    assert!(
        constant.contains("auvs[0].track: track.csv: has a depth, and so has the scenario"),
        "{constant}"
    );
}

#[test]
fn a_wrong_track_is_refused_with_its_line() {
    let many = (0..=100_000).fold("t,north,east\n".to_owned(), |text, t| {
        text + &format!("{t},0,0\n")
    });
    for (text, fault) in [
        ("", "line 1: no column t_s; it has "),
        ("a,b\n1,2\n", "line 1: no column t_s; it has a, b"),
        (
            "t,north\n1,2\n",
            "no column north_m and east_m, nor lat_deg and lon_deg",
        ),
        ("t,north,east\n", "has 0 points; a track has two at least"),
        ("t,north,east\n0,0,0\n", "has 1 points"),
        ("t,north,east\n0,0,0\n1,0\n", "line: 3"),
        ("t,north,east\n0,0,0\n1,x,0\n", "line 3: north \"x\" is no number"),
        (
            "t,north,east\n0,0,0\n1,NaN,0\n",
            "line 3: north \"NaN\" is no number",
        ),
        (
            "t,north,east\n0,0,0\n1,0.1,0\n1,0.2,0\n",
            "line 4: t 1 is not after 1",
        ),
        (
            "t,north,east\n0,0,0\n# late\n-1,0.1,0\n",
            "line 4: t -1 is not after 0",
        ),
        (
            "t,north,east\n0,0,0\n1,5.1,0\n",
            "line 3: 5.1 m/s from the point before; 5 m/s are allowed",
        ),
        (
            "t,north,east,depth\n0,0,0,0\n1,0,0,6\n",
            "line 3: 6.0 m/s of depth",
        ),
        (
            "t,north,east,depth\n0,0,0,-6\n1,0,0,0\n",
            "line 2: depth -6 m is outside 0 to 2000 m",
        ),
        (
            "t,north,east\n0,0,2e5\n1,0,2e5\n",
            "line 2: 0 m north, 200000 m east of the datum",
        ),
        ("t,lat,lon\n0,91,0\n1,91,0\n", "line 2: "),
        (
            "kind,vehicle,t_s,north_m,east_m\ntruth,other,0,0,0\n",
            "has 0 points of \"auv-1\"",
        ),
        (&many, "has 100001 points, more than 100000"),
    ] {
        let refused = scenario(text, "auv-1").expect_err(fault);
        assert!(refused.contains("auvs[0].track: track.csv: "), "{refused}");
        assert!(refused.contains(fault), "{fault}: {refused}");
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
        (
            alone("speed_mps = 0.3\n"),
            "auvs[0].track: speed_mps is given too",
        ),
        (
            alone(astray),
            "faults[0].what.auv_dies.auv: \"auv-1\" repeats its recorded track",
        ),
    ] {
        let refused = parsed(&toml, track).expect_err(fault);
        assert!(refused.contains(fault), "{refused}");
    }
    parsed(&alone("depth_m = 4\n"), track).expect("has a depth of its own");
    let read = Scenario::parse(&alone(""), "mine.toml", Files::kept(BTreeMap::new()));
    let absent = read.and_then(Scenario::checked).expect_err("is absent");
    assert!(
        absent
            .to_string()
            .contains("auvs[0].track: \"track.csv\" was not stored"),
        "{absent}"
    );
}
