//! `examples/live_mission.rs` with a service that is killed meanwhile.

use std::collections::BTreeMap;

use clap::Parser as _;
use service::missions::event::Event;
use tests::server::Server;
use wire::mission::Reports;

use crate::{command::pilotfish, kill::record_at};

#[path = "../../../examples/live_mission.rs"]
#[expect(dead_code, reason = "its main is not called here")]
mod live_mission;

#[test]
fn a_live_mission_outlives_the_server_and_nothing_acknowledged_is_lost() {
    // Mission time, s: an AUV is silent from 210 to 390.
    const KILLED: f64 = 280.0;
    const STARTED: f64 = 300.0;
    // Greatest values, also measured under threefold load: 1.5 m, 3.7 m, 24 s. Of these, 9 s pass
    // until every AUV is heard; the rest is the outage less the 10 s of the last reference.
    const SETTLED_RMS_MAX_M: f64 = 2.5;
    const SILENCE_MAX_M: f64 = 6.0;
    const UNGUIDED_MAX_S: u32 = 45;
    let folder = tempfile::tempdir().expect("there is room");
    let start_on = |port| {
        let mut program = pilotfish();
        program.args(["serve", "--data"]).arg(folder.path());
        Server::start_on(program, port)
    };
    let first = start_on(0);
    let (url, port) = (first.url(), first.port());
    let mut server = Some(first);
    let mut outage = |t: f64| {
        if (KILLED..STARTED).contains(&t) {
            server = None;
        } else if STARTED <= t && server.is_none() {
            server = Some(start_on(port));
        }
    };
    let arguments = live_mission::Arguments::parse_from(["live_mission", "--url", &url, "--duration", "600"]);
    let summary = live_mission::fly(&arguments, &mut outage).expect("the mission comes to its end");

    let events: Vec<(u64, Event)> = record_at(&format!("{url}/v1/missions/{}", summary.mission))
        .into_iter()
        .map(|event| {
            let sequence = event["sequence"].as_u64().expect("is numbered");
            (sequence, serde_json::from_value(event).expect("is an event"))
        })
        .collect();
    let origin = events.iter().find_map(|(_, event)| match event {
        Event::Created { mission, .. } => mission.live.as_ref()?.origin,
        _ => None,
    });
    let heard = |(sequence, event)| match event {
        Event::Reported { heard, .. } => Some((sequence, *heard)),
        _ => None,
    };
    let heard: BTreeMap<u64, Reports> = events.into_iter().filter_map(heard).collect();
    // The service only adds latitudes and longitudes.
    let mut acknowledged = summary.acknowledged.clone();
    for reports in acknowledged.values_mut() {
        reports.complete(origin.expect("the mission has one"));
    }
    assert!(
        heard == acknowledged,
        "what was acknowledged is not what is stored"
    );
    assert!(
        0 < summary.retries,
        "the client did not notice that the server was away"
    );
    assert!(summary.settled_rms_m < SETTLED_RMS_MAX_M, "{summary}");
    assert!(summary.silence_max_m < SILENCE_MAX_M, "{summary}");
    assert!(summary.unguided_s < UNGUIDED_MAX_S, "{summary}");
}
