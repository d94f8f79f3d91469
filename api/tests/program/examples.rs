//! The examples, run against the program on a real socket.

use clap::Parser as _;
use tests::server::Server;

use crate::command::{has_all, serving, written};

#[path = "../../../examples/post_snapshot.rs"]
#[expect(dead_code, reason = "its main is not called here")]
mod post_snapshot;

fn post(server: &Server, snapshot: &str) -> Result<String, String> {
    let arguments = ["post_snapshot", snapshot, "--url", &server.url()];
    post_snapshot::ask(&post_snapshot::Arguments::parse_from(arguments)).map_err(|error| error.to_string())
}

#[test]
fn every_snapshot_is_answered_with_what_to_steer() {
    let server = serving(&[]);
    for example in service::examples::EXAMPLES {
        let file = format!("{}/../examples/snapshots/{}.json", env!("CARGO_MANIFEST_DIR"), example.name);
        let answer = post(&server, &file).expect("the server plans its own examples");
        let numbers: Vec<f64> = answer.split([' ', '°']).filter_map(|word| word.parse().ok()).collect();
        let [speed, heading] = numbers[..] else { panic!("{answer}") };
        assert!((0.0..=1.5).contains(&speed) && (0.0..360.0).contains(&heading), "{answer}");
    }
}

#[test]
fn a_refused_snapshot_shows_which_member_is_wrong() {
    let folder = tempfile::tempdir().expect("there is room");
    let right = service::examples::EXAMPLES[0].body;
    let wrong = right.replace("\"heading_rad\": 1.4", "\"heading_rad\": 14.0");
    assert_ne!(wrong, right);
    let file = written(&folder, "snapshot.json", &wrong);
    let error = post(&serving(&[]), &file).expect_err("is refused");
    has_all(&error, &["/asc/heading_rad"]);
}
