//! Scenario files: published files are the ones that are read.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use pilotfish_sim::metrics::Metrics;
use pilotfish_sim::scenario::{Files, ReportedAs, Scenario};
use pilotfish_sim::surface_craft::SurfaceClass;
use planner::craft::{CraftDescription, HeadingLoop, HeadingReference, Power, SpeedReference, SurgeLoop};
use record::Source as _;
use record::table::{COLUMNS, Cell, Column};

use crate::{flown_by, los, named, near, parsed, rows, step_until, world};

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios"))
}

#[test]
fn every_file_of_the_folder_is_built_in() {
    let files = fs::read_dir(folder()).expect("there");
    let paths = files.map(|entry| entry.expect("readable").path());
    let scenarios = paths.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let found = scenarios.map(|path| path.file_stem().expect("named").to_string_lossy().into_owned());
    let names = Scenario::names().into_iter().map(str::to_owned);
    assert_eq!(found.collect::<BTreeSet<_>>(), names.collect());
}

#[test]
fn every_scenario_runs_and_its_record_is_finite() {
    for name in Scenario::names() {
        // Schedules take longest.
        let seconds = if name.starts_with("visit") { 20_u8 } else { 120 };
        let scenario = named(name).lasting(f64::from(seconds));
        for seed in 0..3 {
            let record = flown_by(&scenario, &mut los(), seed);
            assert_eq!(record.rows.len(), usize::from(seconds), "{name}");
            let checked = record.for_each(&mut |entry| {
                for row in &entry.rows {
                    for Column { cell, name, .. } in COLUMNS {
                        let endless = matches!(cell(row), Cell::Number(number) if !number.is_finite());
                        assert!(!endless, "{name}: {row:?}");
                    }
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
    let many = "{north_m = 0, east_m = 0, radius_m = 1},".repeat(33);
    for [text, written, says] in rows(
        r"
        area = [[-60, -60], [160, -60], [160, 180], [-60, 180]] | area = [[0, 0], [90, 0], [50, 20], [90, 90], [0, 90]] | bounds.area[2]
        area = [[-60, -60], [160, -60], [160, 180], [-60, 180]] | area = [[0, 0], [90, 0]] | bounds.area: must have 3 to 64 items (given: 2)
        radius_m = 8 | radius_m = 0.01 | 0.1
        range_max_m = 60 | range_max_m = {choice = [60, 0.5]} | range_max_m
        keep_outs = [ | keep_outs = [MANY | bounds.keep_outs: must have 0 to 32 items (given: 34)
        ",
    ) {
        assert_eq!(crowded.matches(&text).count(), 1, "{text}");
        let written = written.replace("MANY", &many);
        let error = read_beside(&crowded.replace(&text, &written), "none", "").expect_err(&written);
        assert!(error.contains(&says), "{error}");
    }
}

/// The path of the vehicle of [`ALONE`] along the file `track`.
fn drawn(track: &str) -> Arc<planner::path::Path> {
    let text = format!("{ALONE}path.geojson = {{file = \"track.geojson\", fillet_m = 5}}");
    let files = Files::kept(BTreeMap::from([("track.geojson".to_owned(), track.to_owned())]));
    let scenario = Scenario::parse(&text, "my.toml", files).expect(track);
    world(&scenario, 0).auvs[0].path.clone()
}

#[test]
fn a_path_is_drawn_on_a_map() {
    // 0.001° of latitude is 111 m, 0.001° of longitude 87 m, by the ellipsoid's radii below.
    let [a, b, c] = ["[-9.12, 38.41]", "[-9.12, 38.411]", "[-9.119, 38.411]"];
    let plain = format!(r#"{{"type": "LineString", "coordinates": [{a}, {b}, {c}]}}"#);
    let feature = format!(r#"{{"type": "Feature", "properties": {{}}, "geometry": {plain}}}"#);
    let path = drawn(&feature);
    let (radius, e2) = (6_378_137.0_f64, 0.006_694_379_990_141_f64);
    let (sin, cos) = 38.41_f64.to_radians().sin_cos();
    let meridian = radius * (1.0 - e2) / (1.0 - e2 * sin * sin).powf(1.5);
    let parallel = radius / (1.0 - e2 * sin * sin).sqrt() * cos;
    let end = path.at(path.length()).position;
    // The radii change by 1e-5 over a millidegree.
    near(end.x, meridian * 0.001_f64.to_radians(), 0.01);
    near(end.y, parallel * 0.001_f64.to_radians(), 0.01);
    // Survey lines of common tools.
    for track in [
        format!(r#"{{"type": "LineString", "coordinates": [{a}, {a}, {b}, {b}, {c}]}}"#),
        format!(r#"{{"type": "MultiLineString", "coordinates": [[{a}, {b}], [{b}, {c}]]}}"#),
        format!("\u{feff}{plain}"),
    ] {
        near(drawn(&track).length(), path.length(), 1e-9);
    }
}

#[test]
fn files_beside_a_scenario_are_found_and_their_errors_are_named() {
    let grid = format!("{ALONE}{LINE}[water.current.grid]\nfile = \"grid.csv\"\n");
    let header = "t_s,north_m,east_m,current_north_mps,current_east_mps\n";
    read_beside(&grid, "grid.csv", &format!("{header}0,0,0,0.1,0\n")).expect("one node is a grid");
    let fast = format!("{header}0,0,0,99,0\n");
    let track = format!("{ALONE}path.geojson = {{file = \"track.geojson\", fillet_m = 5}}");
    let outside = track.replace("track.geojson", "../track.geojson");
    let no_origin = track.replace("origin =", "# origin =");
    let point = r#"{"type": "Point", "coordinates": [1, 2]}"#;
    let nowhere = r#"{"type": "LineString", "coordinates": [[0, 99], [1, 99]]}"#;
    for (text, name, beside, says) in [
        (&grid, "grid.csv", &*fast, "99"),
        (&grid, "other.csv", "", "cannot read"),
        (&track, "track.geojson", "{", "is not GeoJSON"),
        (&track, "track.geojson", point, "has 0 LineStrings"),
        (&track, "track.geojson", nowhere, "no place on Earth"),
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
    let kept = usual.iter().filter(|line| lines.lines().all(|other| key(other) != key(line)));
    let kept: Vec<&str> = kept.copied().collect();
    format!("[knowledge.acoustics]\n{}\n{lines}\n[water]", kept.join("\n"))
}

/// Asserts of each row of a table: the whole scenario with the second instead of the first is
/// refused with an error that says the third.
fn assert_refused(table: &str) {
    let whole = format!("{ALONE}{LINE}{CRAFT}[surface_craft.limits]\n[water]\n");
    let _ = parsed(&whole);
    for [right, wrong, says] in rows(table) {
        let right = right.replace("LINE", LINE.trim());
        assert!(whole.contains(&right), "{right}");
        let wrong = match wrong.strip_prefix("ACOUSTICS ") {
            Some(lines) => acoustics(lines),
            None => wrong.replace("LINE", LINE.trim()),
        };
        let text = whole.replacen(&right, &wrong, 1);
        let read = Scenario::parse(&text, "my.toml", Files::default());
        let refused = read.and_then(Scenario::checked).expect_err(&wrong);
        assert!(refused.to_string().contains(&says), "{refused}");
    }
}

#[test]
fn members_that_would_fail_in_a_mission_are_refused_before_it() {
    assert_refused(
        r#"
        id = "auv-1" | id = "a\"b,c" | auvs[0].id
        id = "auv-1" | id = "asc" | the name of the surface craft
        ["auv-1"] | ["auv-1", "auv-1"] | auvs[1]: duplicate name
        speed_mps = 0.3 | speed_mps = 4 | more than the 72 N
        LINE | speed_mps = 2.5\nLINE | more than the 72 N
        [surface_craft.limits] | [surface_craft.limits]\nspeed_max_mps = 0.06 | 0.05 m/s above
        [surface_craft.limits] | [surface_craft.limits]\nspeed_min_mps = 3 | outside 0 to 2 m/s
        settled_after_s = 0 | settled_after_s = 59.5 | less than a second before the end
        [water] | [water]\nwaves = {heading_sigma_rad = 0.4, surge_sigma_mps = 0, peak_period_s = 1, damping = 0.1} | water.waves.heading_sigma_rad: 0.4 is outside 0 to 0.0795
        LINE | path.lawn_mower = {from = [99000, 0], heading_rad = 0, lane_length_m = 2000, lane_spacing_m = 20, lanes = 2} | of the datum
        [water] | ACOUSTICS slot_length_s = 2.5 | slot_length_s: 2.5 is outside 0 to 2,
        [water] | ACOUSTICS slots_s = {auv-1 = 11} | slots_s.auv-1: 11 is outside 0 to 10,
        [water] | ACOUSTICS slots_s = {} | slots_s: "auv-1" has no slot
        [water] | ACOUSTICS loss = 0.6\nloss_at_range_max = 0.5 | loss_at_range_max: 0.5 is outside 0.6 to 1,
        goal.midpoint.auvs = ["auv-1"] | goal.weighted.weights = {auv-2 = 1.0} | no vehicle in `auvs` has this id (given: "auv-2")
        goal.midpoint.auvs = ["auv-1"] | goal.weighted.weights = {auv-1 = 0} | weights: at least one weight must be above 0
        goal.midpoint.auvs = ["auv-1"] | goal.range = {auvs = ["auv-1"], range_m = 0.5} | outside 1 to 20000 m
        [surface_craft.limits] | goal_offset.path = {ahead_m = 0, starboard_m = 9}\n[surface_craft.limits] | goal_offset.path: an offset along a path needs a goal that follows one vehicle at a time
        goal.midpoint.auvs = ["auv-1"] | goal.track.auv = "auv-1"\ngoal_offset.path = {ahead_m = 0, starboard_m = 9} | the surface craft knows no paths
        LINE | path.waypoints = {points = [[0, 0], [10, 0], [10, 10]], fillet_m = 11} | fillet
        LINE | tracking_error.turns_late_m = 5\nLINE | auvs[0].tracking_error.turns_late_m: the path has no way-points
        "#,
    );
}

#[test]
fn a_craft_table_that_contradicts_itself_is_refused() {
    assert_refused(
        r#"
        [water] | [surface_craft.craft]\npreset = "ark"\n[water] | surface_craft.craft.preset: the known craft are
        [water] | [surface_craft.craft]\nheading_loop = {delay_s = 11}\n[water] | craft.heading_loop.delay_s: 11 is outside 0 to 10 s
        [water] | [surface_craft.craft]\nsurge_loop = {delay_s = {uniform = [5, inf]}}\n[water] | craft.surge_loop.delay_s.uniform[1]: invalid value: not a finite number
        [water] | [surface_craft.craft]\nheading_loop = {damping = 1}\n[water] | craft.heading_loop.natural_frequency_radps: give both `natural_frequency_radps` and `damping`, or neither
        [water] | [surface_craft.craft]\nsurge_loop = {integrates = false, integral_time_s = 5}\n[water] | craft.surge_loop.integral_time_s: `integral_time_s` contradicts `integrates`: false
        [surface_craft.limits] | craft.surge_loop.time_constant_s = 2\n[surface_craft.limits]\nsurge_lag_s = 3 | limits.surge_lag_s: surface_craft.craft.surge_loop.time_constant_s is given too
        "#,
    );
}

#[test]
fn a_craft_stays_at_every_kind_of_goal_and_offset() {
    // Line of sight keeps within 0.07 m of a steady goal. The place nearest to two AUVs that dive
    // in turn moves to and fro by 6.6 m, (23² − 1²) m² over twice 40 m, at an unknown speed.
    for (goal, most) in [
        ("goal.weighted.weights = {auv-1 = 2, auv-2 = 1}", 0.1),
        ("goal.range = {auvs = [\"auv-1\", \"auv-2\"], range_m = 60}", 4.0),
        ("goal.midpoint.auvs = [\"auv-1\", \"auv-2\"]\ngoal_offset.ned = {north_m = -5, east_m = 10}", 0.1),
        ("goal.track.auv = \"auv-1\"\ngoal_offset.target = {ahead_m = -5, starboard_m = 10}", 0.1),
        (
            "goal.intermittent = {auvs = [\"auv-1\"], dwell_s = 60, epoch_s = 0}\n\
             goal_offset.path = {ahead_m = 0, starboard_m = 10}",
            0.1,
        ),
    ] {
        let craft = CRAFT.replace("goal.midpoint.auvs = [\"auv-1\"]", goal);
        // Half a dive apart from the first, on a parallel line.
        let second = "[[auvs]]\nid = \"auv-2\"\nleg = \"up\"\ndepth_m = 23\n";
        let line = LINE.replace("[0, 0], to = [100, 0]", "[0, 40], to = [100, 40]");
        let text = format!("{ALONE}{LINE}{second}{line}{craft}[knowledge]\npaths = true\n")
            .replace("duration_s = 60", "duration_s = 600")
            .replace("settled_after_s = 0", "settled_after_s = 300");
        let record = flown_by(&parsed(&text), &mut los(), 1);
        let off = Metrics::of(&record).surface_craft.expect("has one").settled_rms_m;
        assert!(off < most, "{goal}: {off} m");
    }
}

#[test]
fn a_distribution_for_one_number_changes_no_other() {
    let text = Scenario::text("paper-midpoint").expect("exists");
    let starts = |text: &str| {
        let world = world(&parsed(text), 9);
        let auvs: Vec<_> = world.auvs.iter().map(|auv| auv.state).collect();
        (world.surface_craft.expect("has one").state, auvs)
    };
    let (craft, auvs) = starts(text);
    let drawn = text.replacen("speed_mps = 0.3", "speed_mps = {uniform = [0.2, 0.4]}", 1);
    let (other_craft, other_auvs) = starts(&drawn);
    assert_ne!(craft, other_craft);
    assert_eq!(craft.fixed_rows::<3>(0), other_craft.fixed_rows::<3>(0));
    assert_eq!(auvs, other_auvs);
}

#[test]
fn a_long_path_keeps_the_record_small() {
    let mower = "path.lawn_mower = {from = [0, 0], heading_rad = 0, lane_length_m = 90000, lane_spacing_m = 50, lanes = 100}\n";
    let scenario = parsed(&format!("{ALONE}{mower}")).lasting(2.0);
    assert_eq!(flown_by(&scenario, &mut los(), 1).paths[0].len(), 10_001);
}

#[test]
fn a_strayed_vehicle_resumes_its_own_lane() {
    // It waits at the surface for 300 s while a current carries it nearer to the next lane.
    let text = format!(
        "{ALONE}path.lawn_mower = {{from = [0, 0], heading_rad = 0, lane_length_m = 100, lane_spacing_m = 20, lanes = 3}}\n\
         [water.current.constant]\nnorth_mps = 0\neast_mps = 0.1\n\
         [[faults]]\nfrom_s = 100\nuntil_s = 400\nwhat.auv_stops.auv = \"auv-1\"\n"
    );
    let mut world = world(&parsed(&text.replace("duration_s = 60", "duration_s = 600")), 1);
    step_until(&mut world, 399.5);
    let (left_at, east) = (world.auvs[0].gamma, world.auvs[0].position().y);
    assert!(15.0 < east, "it drifted to {east} m");
    step_until(&mut world, 402.0);
    let gamma = world.auvs[0].gamma;
    assert!((gamma - left_at).abs() < 45.0 && gamma < 100.0, "{left_at} and {gamma}");
}

#[test]
fn a_surfaced_vehicle_has_a_fix_and_resumes_its_path() {
    let text = format!(
        "{ALONE}{LINE}dive = {{depth_min_m = 9, depth_max_m = 10, pitch_rad = 0.1}}\n\
         navigation_error = {{north_m = 12, east_m = -16, fix_at_surface = true}}\n\
         [[faults]]\nfrom_s = 100\nuntil_s = 500\nwhat.auv_stops.auv = \"auv-1\"\n"
    );
    let mut world = world(&parsed(&text.replace("duration_s = 60", "duration_s = 700")), 1);
    // Depth and distance from its path, m.
    let mut at = |time: f64| {
        step_until(&mut world, time);
        (world.auvs[0].depth(), world.auvs[0].path_error().y_1)
    };
    let (depth, off) = at(99.0);
    assert!(9.0 < depth + 0.1 && (off - 16.0).abs() < 0.1, "{depth} {off}");
    let (depth, off) = at(499.0);
    assert!(depth <= 1.0 && 10.0 < off, "{depth} {off}");
    // On its next descent.
    let (depth, off) = at(690.0);
    assert!(5.0 < depth && off.abs() < 0.1, "{depth} {off}");
}

#[test]
fn random_surveys_repeat_by_seed_have_all_patterns_and_can_be_followed() {
    let survey = |table: &str, seed| {
        let scenario = parsed(&format!("{ALONE}path.random_survey = {{{table}}}\n"));
        world(&scenario, seed).auvs[0].path.clone()
    };
    let mut corners = BTreeSet::new();
    for seed in 0..100 {
        let path = survey("turn_radius_m = 8", seed);
        assert_eq!(path, survey("turn_radius_m = 8", seed));
        assert_ne!(path, survey("turn_radius_m = 8", seed + 1));
        // A fixed pattern and its members change nothing else.
        let said = survey("turn_radius_m = 8, from = [0, 0], pattern = \"there_and_back\"", seed);
        near(said.at(0.0).tangent, path.at(0.0).tangent, 1e-9);
        corners.insert((path.segments()[0].count(), path.is_closed()));
        for piece in 0..=4000 {
            let curvature = path.at(path.length() * f64::from(piece) / 4000.0).curvature;
            assert!(curvature.abs() * 8.0 < 1.0 + 1e-6, "seed {seed}: {curvature} 1/m");
        }
    }
    // To and fro, round and round, and the corners of lanes, squares and way-points.
    let has_rings = corners.contains(&(2, true)) && corners.contains(&(4, true));
    assert!(has_rings && 10 < corners.len(), "{corners:?}");
}

#[test]
fn a_craft_table_reaches_the_planner_and_changes_no_draw() {
    let given = |table: &str| {
        let text = format!("{ALONE}{LINE}{CRAFT}{table}[water]\n");
        let text = text.replacen("north_m = 0", "north_m = {uniform = [-5, 5]}", 1);
        let start = parsed(&text).start(3).expect("valid");
        let position = start.world.surface_craft.expect("has one").position();
        (start.observer.expect("has one").briefing.craft, position)
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
    let drawn = all.heading_loop.time_constant_s;
    assert!(drawn.is_some_and(|drawn| (1.0..=3.0).contains(&drawn)), "{drawn:?}");
    let expected = CraftDescription {
        preset: Some("otter".to_owned()),
        heading_loop: HeadingLoop { time_constant_s: drawn, ..HeadingLoop::default() },
        surge_loop: SurgeLoop { integrates: Some(false), delay_s: Some(0.5), ..SurgeLoop::default() },
        power: Some(Power { linear_w_per_mps: 0.0, cubic_w_per_mps3: 20.0 }),
        heading_held: Some(HeadingReference::Course),
        speed_held: Some(SpeedReference::OverGround),
        relative_uncertainty: Some(0.3),
        ..CraftDescription::default()
    };
    assert_eq!((all, same), (expected, position));
    // The limits' surge lag is a part of the description, and the rest of that stays.
    let (limited, _) = given("[surface_craft.limits]\nsurge_lag_s = 3\n");
    assert_eq!(limited.surge_loop.time_constant_s, Some(3.0));
    assert_eq!(limited.preset, truth.preset);
}

#[test]
fn the_older_name_of_reported_as_gives_the_same_scenario() {
    let text = Scenario::text("fast-lawn-mower").expect("is built in");
    let read = |text: &str| parsed(text).knowledge.acoustics.expect("are there").reported_as;
    for (value, expected) in [("reports", ReportedAs::Reports), ("state", ReportedAs::State)] {
        let newer = text.replace("reported_as = \"reports\"", &format!("reported_as = \"{value}\""));
        assert_eq!(read(&newer), expected);
        assert_eq!(read(&newer.replace("reported_as", "told_as")), expected);
    }
}
