//! Files of planning tools on the command line.

use std::fs;

use serde_json::{Value, json};

use crate::command::{has_all, json as read, line, path, printed, refusal, written};

#[test]
fn lanes_over_a_rectangle_are_a_file_that_is_read_again() {
    let folder = tempfile::tempdir().expect("there is room");
    let [file, svg] = ["s.geojson", "s.svg"].map(|name| path(&folder, name));
    let area = "route --rectangle 38.41,-9.12,200,100 --lanes 25 --heading 90 --speed 1.5";
    let lanes = printed(&line(&format!("{area} --out {file} --svg {svg}")));
    has_all(&lanes, &["8 way-points", "at 1.5 m/s"]);
    assert_eq!(printed(&line(&format!("route {file}"))), lanes);
    // What a file states counts for lanes over it.
    has_all(&printed(&line(&format!("route {file} --lanes 20"))), &["at 1.5 m/s;"]);
    let drawn = fs::read_to_string(svg).expect("is drawn");
    let counts = ["<circle", "A"].map(|what| drawn.matches(what).count());
    assert_eq!(counts, [8, 6], "{drawn}");
}

#[test]
fn repairs_of_a_route_are_named_and_a_file_without_one_is_refused_by_line() {
    let folder = tempfile::tempdir().expect("there is room");
    let route = |text: &str, flags: &str| line(&format!("route {}{flags}", written(&folder, "a.csv", text)));
    let repaired = "north_m,east_m,depth_m\n0,0,5\n0,0.01,5\n100,0,5\n100,8,5\n0,8,5\n100,8,5\n";
    let notes = ["left out: 1\n", "short: 2, down to 4.00 m", "by a loop: 1\n"];
    has_all(&printed(&route(repaired, " --speed 1.5")), &notes);
    for (text, says) in [
        ("lat,lon\n38,-9\n91,-9\n", "line 3: latitude 91"),
        ("north_m,east_m\n0,0\n", "must have 2 to 10000 points (given: 1)"),
    ] {
        has_all(refusal(&route(text, "")), &[says]);
    }
}

#[test]
fn an_auv_with_a_route_file_has_its_path() {
    let folder = tempfile::tempdir().expect("there is room");
    let write = |name: &str, text: &str| written(&folder, name, text);
    let points = json!([[0.0, 0.0], [200.0, 0.0], [200.0, 30.0], [0.0, 30.0]]);
    let route = write("r.csv", "north_m,east_m,speed_mps\n0,0,1.5\n200,0,1.5\n200,30,1\n0,30,1.2\n");
    // Near the end of its first leg, so that the slower second one is within the horizon.
    let state =
        json!({ "north_m": 170.0, "east_m": 0.0, "depth_m": 5.0, "course_rad": 0.0, "speed_mps": 1.5 });
    let mut snapshot = json!({ "schema_version": "1.0", "t_s": 0.0,
        "asc": { "north_m": 0.0, "east_m": 5.0, "heading_rad": 0.0, "speed_mps": 1.0 },
        "auvs": [{ "id": "auv-1", "state": state }], "goal": { "kind": "track", "auv": "auv-1" } });
    let plan = |body: &Value, flags: &str| {
        let body = write("s.json", &body.to_string());
        let mut answer = read(&printed(&line(&format!("plan {body}{flags}"))));
        answer["solver"] = Value::Null;
        answer
    };
    let declared = plan(&snapshot, &format!(" --route auv-1={route}"));
    let legs = json!([{ "speed_mps": 1.5 }, { "speed_mps": 1.0 }, { "speed_mps": 1.2 }]);
    let path = |waypoints: Value| json!({ "segments": [waypoints], "closed": false, "speed_mps": 1.5 });
    snapshot["auvs"][0]["path"] = path(json!({ "kind": "waypoints", "points": points }));
    assert_ne!(declared, plan(&snapshot, ""));
    snapshot["auvs"][0]["path"] = path(json!({ "kind": "waypoints", "points": points, "legs": legs }));
    assert_eq!(declared, plan(&snapshot, ""));
    let snapshot = write("s.json", &snapshot.to_string());
    let unknown = line(&format!("plan {snapshot} --route b={route}"));
    has_all(refusal(&unknown), &["no AUV has this id"]);

    // A simulated AUV starts where its route does.
    let (record, lanes) = (write("r.csv", ""), write("n.csv", "north_m,east_m\n500,700\n500,900\n530,900\n"));
    let mission = "simulate calm --duration-s 2 --route";
    printed(&line(&format!("{mission} auv-1={lanes} --out {record}")));
    let record = fs::read_to_string(record).expect("is written");
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let head = cells(record.lines().next().expect("has a head"));
    let column = |name: &str| head.iter().position(|cell| cell == name).expect(name);
    let rows = record.lines().skip(1).map(cells);
    let mut rows = rows.filter(|row| row[column("kind")] == "truth" && row[column("vehicle")] == "auv-1");
    let first = rows.next().expect("an AUV is somewhere");
    let at = ["north_m", "east_m"].map(|name| first[column(name)].parse::<f64>().expect("is a number"));
    assert!((at[0] - 500.0).hypot(at[1] - 700.0) < 2.0, "{at:?}");
}
