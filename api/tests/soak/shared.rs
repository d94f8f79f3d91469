//! Services that share missions through PostgreSQL. Voyages and `.ci/failover` kill, stop and cut
//! off such services.

use serde_json::Value;
use tests::{
    postgres::{database, psql},
    server::{Server, certificate},
};

use crate::access::curl;
use crate::ask_at;
use crate::command::{has_all, printed};
use crate::kill::{
    Home, check_numbers, live_mission, pilotfish, record_at, running_mission, terminate, unix_now,
    while_clients_post,
};

#[test]
fn services_with_certificates_call_only_each_other_by_https() {
    let Some(store) = database() else { return };
    let folders = [(); 3].map(|()| tempfile::tempdir().expect("there is room"));
    // The first two have the same self-signed one.
    let files = [0, 0, 1].map(|k: usize| certificate(folders[k].path()));
    let serve = |k: usize| {
        let (certificate, key) = &files[k];
        let mut serve = pilotfish();
        serve.args(["serve", "--store", &store, "--advertise-ca", certificate]);
        serve.args(["--tls-certificate", certificate, "--tls-key", key, "--data"]);
        serve.arg(folders[2].path().join(k.to_string()));
        Server::start_on(serve, 0)
    };
    let services = [serve(0), serve(1), serve(2)];
    let ask = |k: usize, path: &str, body: Option<&str>| {
        let url = format!("https://127.0.0.1:{}/v1/missions{path}", services[k].port());
        let mut arguments = vec!["--cacert", &files[k].0, &url];
        if let Some(body) = body {
            arguments.extend(["--json", body]);
        }
        curl(&arguments)
    };
    let (status, made) = ask(0, "", Some(&live_mission()));
    assert_eq!(status, 201, "{made}");
    let made: Value = serde_json::from_str(&made).expect("is JSON");
    let mission = made["id"].as_str().expect("it has a name");
    let run = format!("/{mission}/run");
    assert_eq!(ask(0, &run, Some("{}")).0, 200, "the first service has it");

    assert_eq!(ask(1, &run, Some("{}")).0, 200);
    let encoded = format!("/%6d{}/run", &mission[1..]);
    assert_eq!(ask(1, &encoded, Some("{}")).0, 200, "the same name, written another way");
    let (status, problem) = ask(2, &run, Some("{}"));
    assert!(status == 503 && problem.contains("mission_elsewhere"), "{problem}");
}

#[test]
fn only_stored_changes_are_acknowledged() {
    let Some(store) = database() else { return };
    let data = tempfile::tempdir().expect("there is room");
    let mut serve = pilotfish();
    serve.args(["serve", "--store", &store, "--data"]).arg(data.path());
    let server = Server::start_on(serve, 0);
    let missions = format!("{}/v1/missions", server.url());
    let mission = format!("{missions}/{}", running_mission(&missions));
    let finish = || ask_at("POST", &format!("{mission}/finish"), "");
    let _ = psql(&store, "ALTER TABLE events RENAME TO elsewhere");
    assert_eq!(finish().status, 503);
    let _ = psql(&store, "ALTER TABLE elsewhere RENAME TO events");
    // A finished mission has no owner: it can be finished again.
    for _ in 0..2 {
        let _ = finish().expected(200);
    }
    check_numbers(&record_at(&mission));
}

/// The library copies every row and its digest (`tests/claims/store.rs`).
#[test]
fn the_program_copies_missions_to_a_database_and_replays_them_there() {
    let Some(url) = database() else { return };
    let home = Home::new();
    let mut server = home.start();
    let mission = home.mission();
    while_clients_post(&home.url(&format!("/{mission}/reports")), |_| {
        home.await_plan(&mission, unix_now());
    });
    terminate(&mut server);
    let (mut copy, mut replay) = (pilotfish(), pilotfish());
    copy.arg("copy-store").arg("--from").arg(home.data()).args(["--to", &url]);
    has_all(&printed(&copy.output().expect("starts")), &["copied 1 missions"]);
    replay.args(["replay", &mission, "--store", &url]);
    has_all(&printed(&replay.output().expect("starts")), &[" 0 different"]);
}
