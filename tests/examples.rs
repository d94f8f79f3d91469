//! The examples, run against the program on a real socket.

use std::process::Command;

use ::examples::remote_guide::RemoteGuide;
use clap::Parser as _;
use planner::policy::Policy;
use sim::{
    guide::{Guide, MpcGuide},
    mission,
    record::{Record, SurfaceCraftRow},
    scenario::Scenario,
};
use tests::server::Server;

#[path = "../examples/post_snapshot.rs"]
#[expect(dead_code, reason = "its main is not called here")]
mod post_snapshot;

fn server() -> Server {
    Server::start(Command::new(env!("CARGO_BIN_EXE_pilotfish")))
}

/// The first half minute of a scenario.
fn short(name: &str) -> Scenario {
    Scenario::named(name).expect("exists").lasting(30.0)
}

fn fly(scenario: &Scenario, guide: &mut dyn Guide) -> Record {
    mission::run(scenario, guide, 1, &mut |_| {}).expect("every second has an answer")
}

fn crafts(record: &Record) -> Vec<SurfaceCraftRow> {
    record.rows.iter().filter_map(|row| row.surface_craft).collect()
}

#[test]
fn a_mission_over_http_is_the_mission_flown_beside_the_planner() {
    // Numbers survive JSON to the last digit or two; half a minute of closed loop does not amplify that.
    const TOLERANCE_M: f64 = 1e-6;
    let server = server();
    for name in ["paper-tracking", "paper-intermittent", "cross-current"] {
        let scenario = short(name);
        let remote = crafts(&fly(&scenario, &mut RemoteGuide::new(&server.url())));
        let local = crafts(&fly(&scenario, &mut MpcGuide::new(Policy::default())));
        assert_eq!(remote.len(), 30);
        for (remote, local) in remote.iter().zip(&local) {
            let apart = (remote.position - local.position).norm();
            assert!(apart < TOLERANCE_M, "{name}: {apart} m apart");
            assert_eq!(remote.method, local.method, "{name}");
        }
    }
}

#[test]
fn a_guide_without_a_server_says_how_to_start_one() {
    // Port 1 is nobody's: binding it takes a privilege and no service has it.
    let mut guide = RemoteGuide::new("http://127.0.0.1:1");
    let error =
        mission::run(&short("paper-tracking"), &mut guide, 1, &mut |_| {}).expect_err("nobody answers");
    assert!(error.to_string().contains("cargo run --release"), "{error}");
}

fn post(server: &Server, snapshot: &str) -> Result<String, String> {
    let arguments = ["post_snapshot", snapshot, "--url", &server.url()];
    post_snapshot::ask(&post_snapshot::Arguments::parse_from(arguments)).map_err(|error| error.to_string())
}

#[test]
fn every_snapshot_is_answered_with_what_to_steer() {
    let server = server();
    for example in api::examples::EXAMPLES {
        let file = format!(
            "{}/../examples/snapshots/{}.json",
            env!("CARGO_MANIFEST_DIR"),
            example.name
        );
        let answer = post(&server, &file).expect("the server plans its own examples");
        let numbers: Vec<f64> = answer
            .split([' ', '°'])
            .filter_map(|word| word.parse().ok())
            .collect();
        let [speed, heading] = numbers[..] else {
            panic!("{answer}")
        };
        assert!(
            (0.0..=1.5).contains(&speed) && (0.0..360.0).contains(&heading),
            "{answer}"
        );
    }
}

#[test]
fn a_refused_snapshot_shows_which_member_is_wrong() {
    let server = server();
    let file = std::env::temp_dir().join(format!("pilotfish-snapshot-{}.json", std::process::id()));
    let right = api::examples::EXAMPLES[0].body;
    let wrong = right.replace("\"heading_rad\": 1.9", "\"heading_rad\": 19.0");
    assert_ne!(wrong, right);
    std::fs::write(&file, wrong).expect("can be written");
    let error = post(&server, file.to_str().expect("is text")).expect_err("is refused");
    assert!(error.contains("/asc/heading_rad"), "{error}");
    std::fs::remove_file(&file).expect("can be removed");
}
