//! Scenario files: published files are the ones that are read.

use std::{collections::BTreeSet, fs, path::Path};

use pilotfish_sim::{
    metrics::Metrics,
    mission::run,
    scenario::{Files, ReportedAs, Scenario},
    surface_craft::SurfaceClass,
};
use planner::craft::{CraftDescription, HeadingReference, Power, SpeedReference};
use record::{
    Source as _,
    table::{COLUMNS, Cell, Column, Row},
};

use crate::{los, named};

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios"))
}

#[test]
fn every_file_of_the_folder_is_built_in() {
    let mut found: Vec<String> = fs::read_dir(folder())
        .expect("there")
        .map(|entry| entry.expect("readable").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().expect("named").to_string_lossy().into_owned())
        .collect();
    let mut names: Vec<String> = Scenario::names().into_iter().map(str::to_owned).collect();
    found.sort();
    names.sort();
    assert_eq!(found, names);
}

#[test]
fn every_scenario_runs_and_its_record_is_finite() {
    for name in Scenario::names() {
        // Schedules take longest.
        let seconds = if name.starts_with("visit") { 20_u8 } else { 120 };
        let scenario = named(name).lasting(f64::from(seconds));
        for seed in 0..3 {
            let record = run(&scenario, &mut los(), seed, &mut |_| {}).expect("runs");
            assert_eq!(record.rows.len(), usize::from(seconds), "{name}");
            let finite = |row: &Row<'_>, column: &Column| match (column.cell)(row) {
                Cell::Number(number) => number.is_finite(),
                Cell::Nothing | Cell::Count(_) | Cell::Word(_) => true,
            };
            let checked = record.for_each(&mut |entry| {
                for (row, column) in entry
                    .rows
                    .iter()
                    .flat_map(|row| COLUMNS.iter().map(move |column| (row, column)))
                {
                    assert!(finite(row, column), "{name}, {}: {row:?}", column.name);
                }
                Ok(())
            });
            checked.expect("nothing refuses a row");
            let metrics = Metrics::of(&record);
            assert_eq!(metrics.surface_craft.is_some(), scenario.has_surface_craft());
        }
    }
}

/// A scenario in a folder of its own, with `beside` as a file called `name`.
fn read_beside(text: &str, name: &str, beside: &str) -> Result<Scenario, String> {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join(name), beside).expect("written");
    fs::write(folder.path().join("my.toml"), text).expect("written");
    let scenario = Scenario::read(&folder.path().join("my.toml")).map_err(|error| error.to_string())?;
    // Every start reads the named file again.
    scenario.start(3).map_err(|error| error.to_string())?;
    Ok(scenario)
}

const ALONE: &str = r#"
schema_version = "1"
name = "alone"
title = "one vehicle"
duration_s = 60
settled_after_s = 0
origin = {lat_deg = 38.41, lon_deg = -9.12}
[[auvs]]
id = "auv-1"
"#;

#[test]
fn bounds_that_no_snapshot_accepts_are_refused_before_departure() {
    let crowded = fs::read_to_string(folder().join("crowded.toml")).expect("built in");
    let area = "area = [[-60, -60], [160, -60], [160, 180], [-60, 180]]";
    for (text, written, says) in [
        (
            area,
            "area = [[0, 0], [90, 0], [50, 20], [90, 90], [0, 90]]",
            "bounds.area[2]",
        ),
        (
            area,
            "area = [[0, 0], [90, 0]]",
            "bounds.area: must have 3 to 64 items, has 2",
        ),
        ("radius_m = 8", "radius_m = 0.01", "0.1"),
        (
            "range_max_m = 60",
            "range_max_m = {choice = [60, 0.5]}",
            "range_max_m",
        ),
    ] {
        assert_eq!(crowded.matches(text).count(), 1, "{text}");
        let error = read_beside(&crowded.replace(text, written), "none", "").expect_err(written);
        assert!(error.contains(says), "{error}");
    }
    let many = "{north_m = 0, east_m = 0, radius_m = 1},".repeat(33);
    let disc = "keep_outs = [";
    let error =
        read_beside(&crowded.replace(disc, &format!("{disc}{many}")), "none", "").expect_err("34 discs");
    assert!(
        error.contains("bounds.keep_outs: must have 0 to 32 items, has 34"),
        "{error}"
    );
}

#[test]
fn a_path_is_drawn_on_a_map() {
    // 0.001° of latitude is 111 m, 0.001° of longitude 87 m, by the ellipsoid's radii below.
    let text = format!("{ALONE}path.geojson = {{file = \"track.geojson\", fillet_m = 5}}");
    let track = r#"{"type": "Feature", "properties": {}, "geometry": {"type": "LineString",
        "coordinates": [[-9.12, 38.41], [-9.12, 38.411], [-9.119, 38.411]]}}"#;
    read_beside(&text, "track.geojson", track).expect("a path");
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("track.geojson"), track).expect("written");
    let scenario = Scenario::parse(&text, "my.toml", Files::beside(folder.path())).expect("a path");
    let path = scenario.start(0).expect("valid").world.auvs[0].path.clone();
    let (a, e2) = (6_378_137.0_f64, 0.006_694_379_990_141_f64);
    let sin = 38.41_f64.to_radians().sin();
    let meridian = a * (1.0 - e2) / (1.0 - e2 * sin * sin).powf(1.5);
    let parallel = a / (1.0 - e2 * sin * sin).sqrt() * 38.41_f64.to_radians().cos();
    let millidegree = 0.001_f64.to_radians();
    let end = path.at(path.length()).position;
    // The radii change by 1e-5 over a millidegree.
    assert!((end.x - meridian * millidegree).abs() < 0.01, "{end}");
    assert!((end.y - parallel * millidegree).abs() < 0.01, "{end}");
}

#[test]
fn survey_lines_of_common_tools_are_read() {
    let text = format!("{ALONE}path.geojson = {{file = \"track.geojson\", fillet_m = 5}}");
    let length = |track: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("track.geojson"), track).expect("written");
        let scenario = Scenario::parse(&text, "my.toml", Files::beside(folder.path())).expect(track);
        scenario.start(0).expect(track).world.auvs[0].path.length()
    };
    let [a, b, c] = ["[-9.12, 38.41]", "[-9.12, 38.411]", "[-9.119, 38.411]"];
    let plain = length(&format!(
        r#"{{"type": "LineString", "coordinates": [{a}, {b}, {c}]}}"#
    ));
    for track in [
        format!(r#"{{"type": "LineString", "coordinates": [{a}, {a}, {b}, {b}, {c}]}}"#),
        format!(r#"{{"type": "MultiLineString", "coordinates": [[{a}, {b}], [{b}, {c}]]}}"#),
        format!("\u{feff}{{\"type\": \"LineString\", \"coordinates\": [{a}, {b}, {c}]}}"),
    ] {
        assert!((length(&track) - plain).abs() < 1e-9, "{track}");
    }
}

#[test]
fn files_beside_a_scenario_are_found_and_their_errors_are_named() {
    let path = "path.segments = {segments = [{line = {from = [0, 0], to = [100, 0]}}]}";
    let grid = format!("{ALONE}{path}\n[water.current.grid]\nfile = \"grid.csv\"\n");
    let header = "t_s,north_m,east_m,current_north_mps,current_east_mps\n";
    read_beside(&grid, "grid.csv", &format!("{header}0,0,0,0.1,0\n")).expect("one node is a grid");
    let track = format!("{ALONE}path.geojson = {{file = \"track.geojson\", fillet_m = 5}}");
    let outside = track.replace("track.geojson", "../track.geojson");
    let no_origin = track.replace("origin =", "# origin =");
    for (text, name, beside, says) in [
        (&grid, "grid.csv", &*format!("{header}0,0,0,99,0\n"), "99"),
        (&grid, "other.csv", "", "cannot read"),
        (&track, "track.geojson", "{", "is not GeoJSON"),
        (
            &track,
            "track.geojson",
            r#"{"type": "Point", "coordinates": [1, 2]}"#,
            "has 0 LineStrings",
        ),
        (
            &track,
            "track.geojson",
            r#"{"type": "LineString", "coordinates": [[0, 99], [1, 99]]}"#,
            "no place on Earth",
        ),
        (&outside, "track.geojson", "{}", "is not in the scenario's folder"),
        (&no_origin, "track.geojson", "{}", "add [origin]"),
    ] {
        let refused = read_beside(text, name, beside).expect_err(says);
        assert!(refused.contains(says), "{refused}");
        assert!(refused.contains("my.toml:"), "{refused}");
    }
}

const LINE: &str = "path.segments = {segments = [{line = {from = [0, 0], to = [100, 0]}}]}\n";

/// A surface craft that follows the vehicle of [`ALONE`].
const CRAFT: &str = r#"
[surface_craft]
class = "medusa"
north_m = 0
east_m = 0
heading_rad = 0
speed_mps = 0.3
contact_range_m = 30
goal.midpoint.auvs = ["auv-1"]
"#;

/// Acoustics in which `lines` replace the lines of the same keys, before the table `[water]`.
fn acoustics(lines: &str) -> String {
    let usual = [
        "frame_s = 10",
        "slot_length_s = 0.5",
        "slots_s = {auv-1 = 0}",
        "latency_s = 2",
        "position_sigma_m = 1",
        "range_max_m = 100",
    ];
    let key = |line: &str| line.split(' ').next().map(str::to_owned);
    let kept = usual
        .iter()
        .filter(|line| lines.lines().all(|other| key(other) != key(line)));
    let kept: Vec<&str> = kept.copied().collect();
    format!("[knowledge.acoustics]\n{}\n{lines}\n[water]", kept.join("\n"))
}

/// Asserts that the whole scenario with `wrong` instead of `right` is refused with an error `says`.
fn assert_refused(cases: &[(&str, &str, &str)]) {
    let whole = format!("{ALONE}{LINE}{CRAFT}[surface_craft.limits]\n[water]\n");
    Scenario::parse(&whole, "my.toml", Files::default()).expect("valid as it stands");
    for (right, wrong, says) in cases {
        assert!(whole.contains(right), "{right}");
        let text = whole.replacen(right, wrong, 1);
        let refused = Scenario::parse(&text, "my.toml", Files::default())
            .and_then(Scenario::checked)
            .expect_err(wrong)
            .to_string();
        assert!(refused.contains(says), "{refused}");
    }
}

#[test]
fn members_that_would_fail_in_a_mission_are_refused_before_it() {
    assert_refused(&[
        ("id = \"auv-1\"", "id = \"a\\\"b,c\"", "auvs[0].id"),
        ("id = \"auv-1\"", "id = \"asc\"", "the name of the surface craft"),
        ("[\"auv-1\"]", "[\"auv-1\", \"auv-1\"]", "named twice"),
        ("speed_mps = 0.3", "speed_mps = 4", "more than the 72 N"),
        (LINE, &format!("speed_mps = 2.5\n{LINE}"), "more than the 72 N"),
        (
            "[surface_craft.limits]",
            "[surface_craft.limits]\nspeed_max_mps = 0.06",
            "0.05 m/s above",
        ),
        (
            "[surface_craft.limits]",
            "[surface_craft.limits]\nspeed_min_mps = 3",
            "outside 0 to 2 m/s",
        ),
        (
            "settled_after_s = 0",
            "settled_after_s = 59.5",
            "less than a second before the end",
        ),
        (
            "[water]",
            "[water]\nwaves = {heading_sigma_rad = 0.4, surge_sigma_mps = 0, peak_period_s = 1, damping = 0.1}",
            "water.waves.heading_sigma_rad: 0.4 is outside 0 to 0.0795",
        ),
        (
            LINE,
            "path.lawn_mower = {from = [99000, 0], heading_rad = 0, lane_length_m = 2000, lane_spacing_m = 20, lanes = 2}\n",
            "of the datum",
        ),
        (
            "[water]",
            &acoustics("slot_length_s = 2.5"),
            "slot_length_s: 2.5 is outside 0 to 2, ",
        ),
        (
            "[water]",
            &acoustics("slots_s = {auv-1 = 11}"),
            "slots_s.auv-1: 11 is outside 0 to 10, ",
        ),
        (
            "[water]",
            &acoustics("slots_s = {}"),
            "slots_s: \"auv-1\" has no slot",
        ),
        (
            "[water]",
            &acoustics("loss = 0.6\nloss_at_range_max = 0.5"),
            "loss_at_range_max: 0.5 is outside 0.6 to 1, ",
        ),
        (
            "goal.midpoint.auvs = [\"auv-1\"]",
            "goal.weighted.weights = {auv-2 = 1.0}",
            "there is no vehicle \"auv-2\"",
        ),
        (
            "goal.midpoint.auvs = [\"auv-1\"]",
            "goal.weighted.weights = {auv-1 = 0}",
            "weights: at least one of them must be above 0",
        ),
        (
            "goal.midpoint.auvs = [\"auv-1\"]",
            "goal.range = {auvs = [\"auv-1\"], range_m = 0.5}",
            "outside 1 to 20000 m",
        ),
        (
            "[surface_craft.limits]",
            "goal_offset.path = {ahead_m = 0, starboard_m = 9}\n[surface_craft.limits]",
            "goal_offset.path: an offset along a path needs a goal that follows one vehicle at a time",
        ),
        (
            "goal.midpoint.auvs = [\"auv-1\"]",
            "goal.track.auv = \"auv-1\"\ngoal_offset.path = {ahead_m = 0, starboard_m = 9}",
            "the surface craft knows no paths",
        ),
        (
            LINE,
            "path.waypoints = {points = [[0, 0], [10, 0], [10, 10]], fillet_m = 11}\n",
            "fillet",
        ),
    ]);
}

#[test]
fn a_craft_table_that_contradicts_itself_is_refused() {
    assert_refused(&[
        (
            "[water]",
            "[surface_craft.craft]\npreset = \"ark\"\n[water]",
            "surface_craft.craft.preset: the known craft are ",
        ),
        (
            "[water]",
            "[surface_craft.craft]\nheading_loop = {delay_s = 11}\n[water]",
            "craft.heading_loop.delay_s: 11 is outside 0 to 10 s",
        ),
        (
            "[water]",
            "[surface_craft.craft]\nsurge_loop = {delay_s = {uniform = [5, inf]}}\n[water]",
            "craft.surge_loop.delay_s.uniform[1]: invalid value: not a finite number",
        ),
        (
            "[water]",
            "[surface_craft.craft]\nheading_loop = {damping = 1}\n[water]",
            "craft.heading_loop.natural_frequency_radps: give both `natural_frequency_radps` and `damping`, or neither",
        ),
        (
            "[water]",
            "[surface_craft.craft]\nsurge_loop = {integrates = false, integral_time_s = 5}\n[water]",
            "craft.surge_loop.integral_time_s: `integral_time_s` contradicts `integrates`: false",
        ),
        (
            "[surface_craft.limits]",
            "craft.surge_loop.time_constant_s = 2\n[surface_craft.limits]\nsurge_lag_s = 3",
            "limits.surge_lag_s: surface_craft.craft.surge_loop.time_constant_s is given too",
        ),
    ]);
}

#[test]
fn a_craft_stays_at_every_kind_of_goal_and_offset() {
    // Line of sight keeps within 0.07 m of a steady goal. The place nearest to two AUVs that dive
    // in turn moves to and fro by 6.6 m, (23² − 1²) m² over twice 40 m, at an unknown speed.
    for (goal, most) in [
        ("goal.weighted.weights = {auv-1 = 2, auv-2 = 1}", 0.1),
        ("goal.range = {auvs = [\"auv-1\", \"auv-2\"], range_m = 60}", 4.0),
        (
            "goal.midpoint.auvs = [\"auv-1\", \"auv-2\"]\ngoal_offset.ned = {north_m = -5, east_m = 10}",
            0.1,
        ),
        (
            "goal.track.auv = \"auv-1\"\ngoal_offset.target = {ahead_m = -5, starboard_m = 10}",
            0.1,
        ),
        (
            "goal.intermittent = {auvs = [\"auv-1\"], dwell_s = 60, epoch_s = 0}\n\
             goal_offset.path = {ahead_m = 0, starboard_m = 10}",
            0.1,
        ),
    ] {
        let craft = CRAFT.replace("goal.midpoint.auvs = [\"auv-1\"]", goal);
        let second = ALONE.split_once("[[auvs]]").expect("has a vehicle").1;
        // Half a dive apart from the first.
        let second = second.replace("auv-1", "auv-2") + "leg = \"up\"\ndepth_m = 23\n";
        let line = |east: f64| {
            LINE.replace(
                "[0, 0], to = [100, 0]",
                &format!("[0, {east}], to = [100, {east}]"),
            )
        };
        let text = format!(
            "{ALONE}{}[[auvs]]{second}{}{craft}[knowledge]\npaths = true\n",
            line(0.0),
            line(40.0)
        )
        .replace("duration_s = 60", "duration_s = 600")
        .replace("settled_after_s = 0", "settled_after_s = 300");
        let scenario = Scenario::parse(&text, "my.toml", Files::default()).expect("valid");
        let record = run(&scenario, &mut los(), 1, &mut |_| {}).expect("runs");
        let craft = Metrics::of(&record).surface_craft.expect("has one");
        println!("{goal}: {} m", craft.settled_rms_m);
        assert!(craft.settled_rms_m < most, "{goal}: {} m", craft.settled_rms_m);
    }
}

#[test]
fn a_distribution_for_one_number_changes_no_other() {
    let text = Scenario::text("paper-midpoint").expect("exists");
    let starts = |text: &str| {
        let scenario = Scenario::parse(text, "my.toml", Files::default()).expect("valid");
        let world = scenario.start(9).expect("valid").world;
        let auvs: Vec<_> = world.auvs.iter().map(|auv| auv.state).collect();
        (world.surface_craft.expect("has one").state, auvs)
    };
    let (craft, auvs) = starts(text);
    let (other_craft, other_auvs) =
        starts(&text.replacen("speed_mps = 0.3", "speed_mps = {uniform = [0.2, 0.4]}", 1));
    assert_ne!(craft, other_craft);
    assert_eq!(craft.fixed_rows::<3>(0), other_craft.fixed_rows::<3>(0));
    assert_eq!(auvs, other_auvs);
}

#[test]
fn a_long_path_keeps_the_record_small() {
    let mower = "path.lawn_mower = {from = [0, 0], heading_rad = 0, lane_length_m = 90000, lane_spacing_m = 50, lanes = 100}\n";
    let text = format!("{ALONE}{mower}").replace("duration_s = 60", "duration_s = 2");
    let scenario = Scenario::parse(&text, "my.toml", Files::default()).expect("valid");
    let record = run(&scenario, &mut los(), 1, &mut |_| {}).expect("runs");
    assert_eq!(record.paths[0].len(), 10_001);
}

#[test]
fn a_strayed_vehicle_resumes_its_own_lane() {
    // It waits at the surface for 300 s while a current carries it nearer to the next lane.
    let text = format!(
        "{ALONE}path.lawn_mower = {{from = [0, 0], heading_rad = 0, lane_length_m = 100, lane_spacing_m = 20, lanes = 3}}\n\
         [water.current.constant]\nnorth_mps = 0\neast_mps = 0.1\n\
         [[faults]]\nfrom_s = 100\nuntil_s = 400\nwhat.auv_stops.auv = \"auv-1\"\n"
    )
    .replace("duration_s = 60", "duration_s = 600");
    let scenario = Scenario::parse(&text, "my.toml", Files::default()).expect("valid");
    let mut world = scenario.start(1).expect("valid").world;
    while world.time() < 399.5 {
        world.step(None);
    }
    let auv = &world.auvs[0];
    let (left_at, east) = (auv.gamma, auv.position().y);
    assert!(15.0 < east, "it drifted to {east} m");
    while world.time() < 402.0 {
        world.step(None);
    }
    let gamma = world.auvs[0].gamma;
    assert!(
        (gamma - left_at).abs() < 45.0 && gamma < 100.0,
        "{left_at} and {gamma}"
    );
}

#[test]
fn a_surfaced_vehicle_has_a_fix_and_resumes_its_path() {
    let text = format!(
        "{ALONE}{LINE}dive = {{depth_min_m = 9, depth_max_m = 10, pitch_rad = 0.1}}\n\
         navigation_error = {{north_m = 12, east_m = -16, fix_at_surface = true}}\n\
         [[faults]]\nfrom_s = 100\nuntil_s = 500\nwhat.auv_stops.auv = \"auv-1\"\n"
    )
    .replace("duration_s = 60", "duration_s = 700");
    let scenario = Scenario::parse(&text, "my.toml", Files::default()).expect("valid");
    let mut world = scenario.start(1).expect("valid").world;
    // Depth and distance from its path, m.
    let mut at = |time: f64| {
        while world.time() < time {
            world.step(None);
        }
        let auv = &world.auvs[0];
        (auv.depth(), auv.path_error().y_1)
    };
    let (depth, off) = at(99.0);
    assert!(9.0 < depth + 0.1 && (off - 16.0).abs() < 0.1, "{depth} {off}");
    let (depth, off) = at(499.0);
    assert!(depth <= 1.0 && 10.0 < off, "{depth} {off}");
    let (depth, off) = at(690.0);
    // On its next descent.
    assert!(5.0 < depth && off.abs() < 0.1, "{depth} {off}");
}

#[test]
fn random_surveys_repeat_by_seed_have_all_patterns_and_can_be_followed() {
    let survey = |table: &str, seed| {
        let text = format!("{ALONE}path.random_survey = {{{table}}}\n");
        let scenario = Scenario::parse(&text, "my.toml", Files::default()).expect(table);
        scenario.start(seed).expect("valid").world.auvs[0].path.clone()
    };
    let mut corners = BTreeSet::new();
    for seed in 0..100 {
        let path = survey("turn_radius_m = 8", seed);
        assert_eq!(path, survey("turn_radius_m = 8", seed));
        assert_ne!(path, survey("turn_radius_m = 8", seed + 1));
        // A fixed pattern and its members change nothing else.
        let said = survey(
            "turn_radius_m = 8, from = [0, 0], pattern = \"there_and_back\"",
            seed,
        );
        assert!((said.at(0.0).tangent - path.at(0.0).tangent).abs() < 1e-9);
        let n = path.segments()[0].count();
        corners.insert((n, path.is_closed()));
        for piece in 0..=4000 {
            let curvature = path.at(path.length() * f64::from(piece) / 4000.0).curvature;
            assert!(curvature.abs() * 8.0 < 1.0 + 1e-6, "seed {seed}: {curvature} 1/m");
        }
    }
    // To and fro, round and round, and the corners of lanes, squares and way-points.
    assert!(
        corners.contains(&(2, true)) && corners.contains(&(4, true)),
        "{corners:?}"
    );
    assert!(10 < corners.len(), "{corners:?}");
}

#[test]
fn a_craft_table_reaches_the_planner_and_changes_no_draw() {
    let given = |table: &str| {
        let text = format!("{ALONE}{LINE}{CRAFT}{table}[water]\n");
        let text = text.replacen("north_m = 0", "north_m = {uniform = [-5, 5]}", 1);
        let scenario = Scenario::parse(&text, "my.toml", Files::default()).expect(table);
        let start = scenario.start(3).expect("valid");
        let position = start.world.surface_craft.expect("has one").position();
        let observer = start.observer.expect("has one");
        (observer.briefing.craft, position)
    };
    let (truth, position) = given("");
    assert_eq!(truth, SurfaceClass::Medusa.craft());
    let (nothing, same) = given("[surface_craft.craft]\n");
    assert_eq!((nothing, same), (CraftDescription::default(), position));
    let (all, same) = given(
        "[surface_craft.craft]\npreset = \"otter\"\nheading_loop = {time_constant_s = {uniform = [1, 3]}}\n\
         surge_loop = {integrates = false, delay_s = 0.5}\npower = {cubic_w_per_mps3 = 20}\n\
         heading_held = \"course\"\nspeed_held = \"over_ground\"\nrelative_uncertainty = 0.3\n",
    );
    assert_eq!(same, position);
    assert_eq!(all.preset.as_deref(), Some("otter"));
    let drawn = all.heading_loop.time_constant_s.expect("said");
    assert!((1.0..=3.0).contains(&drawn), "{drawn}");
    assert_eq!(all.surge_loop.integrates, Some(false));
    assert_eq!(
        (all.surge_loop.delay_s, all.relative_uncertainty),
        (Some(0.5), Some(0.3))
    );
    let power = Power {
        linear_w_per_mps: 0.0,
        cubic_w_per_mps3: 20.0,
    };
    assert_eq!(all.power, Some(power));
    assert_eq!(all.heading_held, Some(HeadingReference::Course));
    assert_eq!(all.speed_held, Some(SpeedReference::OverGround));
    // The limits' surge lag is a part of the description, and the rest of that stays.
    let (limited, _) = given("[surface_craft.limits]\nsurge_lag_s = 3\n");
    assert_eq!(limited.surge_loop.time_constant_s, Some(3.0));
    assert_eq!(limited.preset, truth.preset);
}

#[test]
fn the_older_name_of_reported_as_gives_the_same_scenario() {
    let text = Scenario::text("fast-lawn-mower").expect("is built in");
    let read = |text: &str| {
        let scenario = Scenario::parse(text, "my.toml", Files::default()).expect("is valid");
        scenario.knowledge.acoustics.expect("are there").reported_as
    };
    for (value, expected) in [("reports", ReportedAs::Reports), ("state", ReportedAs::State)] {
        let newer = text.replace("reported_as = \"reports\"", &format!("reported_as = \"{value}\""));
        assert_eq!(read(&newer), expected);
        assert_eq!(read(&newer.replace("reported_as", "told_as")), expected);
    }
}
