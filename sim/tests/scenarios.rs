//! Scenario files: what is published is what is read.

use std::{fs, path::Path};

use planner::los::LosGains;
use sim::{
    guide::LosGuide,
    metrics::Metrics,
    mission::run,
    scenario::{Files, Scenario},
};

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios"))
}

#[test]
fn the_published_schema_is_that_of_the_reader() {
    let published = fs::read_to_string(folder().join("scenario.schema.json")).expect("published");
    let schema = serde_json::to_string_pretty(&Scenario::schema()).expect("JSON") + "\n";
    assert!(
        published == schema,
        "write it anew: cargo run -- scenarios --schema > sim/scenarios/scenario.schema.json"
    );
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
fn every_scenario_runs_and_what_it_records_is_finite() {
    for name in Scenario::names() {
        let scenario = Scenario::named(name).expect("exists").lasting(120.0);
        let mut guide = LosGuide::new(LosGains {
            look_ahead: 10.0,
            along_track_gain: 0.15,
        });
        for seed in 0..3 {
            let record = run(&scenario, &mut guide, seed, &mut |_| {}).expect("runs");
            assert_eq!(record.rows.len(), 120, "{name}");
            for column in record.columns() {
                if let sim::record::Values::Numbers(numbers) = column.values {
                    assert!(
                        numbers.iter().flatten().all(|number| number.is_finite()),
                        "{name}, {}",
                        column.name
                    );
                }
            }
            let metrics = Metrics::of(&record);
            assert_eq!(metrics.surface_craft.is_some(), scenario.has_surface_craft());
        }
    }
}

/// A scenario in a folder of its own, with `beside` as a file called `name` next to it.
fn read_beside(text: &str, name: &str, beside: &str) -> Result<Scenario, String> {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join(name), beside).expect("written");
    fs::write(folder.path().join("my.toml"), text).expect("written");
    let scenario = Scenario::read(&folder.path().join("my.toml")).map_err(|error| error.to_string())?;
    // What it names is read anew at every start.
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
fn a_path_is_drawn_on_a_map() {
    // 0.001° of latitude is 111 m here, 0.001° of longitude 87 m: read off the ellipsoid's radii below.
    let text = format!("{ALONE}path.geojson = {{file = \"track.geojson\", fillet_m = 5}}");
    let track = r#"{"type": "Feature", "properties": {}, "geometry": {"type": "LineString",
        "coordinates": [[-9.12, 38.41], [-9.12, 38.411], [-9.119, 38.411]]}}"#;
    read_beside(&text, "track.geojson", track).expect("a path");
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("track.geojson"), track).expect("written");
    let scenario = Scenario::parse(&text, "my.toml", Files::beside(folder.path())).expect("a path");
    let path = scenario.start(0).expect("valid").world.divers[0].path.clone();
    let (a, e2) = (6_378_137.0_f64, 0.006_694_379_990_141_f64);
    let sin = 38.41_f64.to_radians().sin();
    let meridian = a * (1.0 - e2) / (1.0 - e2 * sin * sin).powf(1.5);
    let parallel = a / (1.0 - e2 * sin * sin).sqrt() * 38.41_f64.to_radians().cos();
    let millidegree = 0.001_f64.to_radians();
    let end = path.at(path.length()).position;
    // The radii change by 1e-5 of themselves over a millidegree.
    assert!((end.x - meridian * millidegree).abs() < 0.01, "{end}");
    assert!((end.y - parallel * millidegree).abs() < 0.01, "{end}");
}

#[test]
fn files_beside_a_scenario_are_found_and_what_is_wrong_with_them_is_said() {
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
        (
            &outside,
            "track.geojson",
            "{}",
            "does not lie beside the scenario",
        ),
        (&no_origin, "track.geojson", "{}", "add [origin]"),
    ] {
        let refused = read_beside(text, name, beside).expect_err(says);
        assert!(refused.contains(says), "{refused}");
        assert!(refused.contains("my.toml:"), "{refused}");
    }
}
