//! Who steers, and what the bridge writes.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use clock::Clock;

use super::*;
use crate::autopilot_link::{AutopilotLink, AutopilotSettings};
use crate::mavlink::Control;
use crate::mission_link::LinkStatus;
use crate::moos::packet::{DATA, PacketReader, REGISTER, TIMING, greeting};
use crate::plan::Plan;
use crate::reference::Reference;
use crate::tests::planned;
use crate::wire::Received;

/// Mode of the heartbeat, and whether it may be steered.
fn mode(events: &[AutopilotEvent]) -> Option<(String, bool)> {
    events.iter().find_map(|event| match event {
        AutopilotEvent::Heartbeat(beat) => Some((beat.mode.to_string(), beat.may_be_steered())),
        _ => None,
    })
}

fn state(client: &mut MoosClient, after: f64, key: &str, text: &str) -> Option<(String, bool)> {
    mode(&heard(client, after, [(key, Text(text))]))
}

#[test]
fn a_helm_that_drives_is_steered_unless_a_person_overrides_it() {
    let mut client = client(None, false);
    let state = |client: &mut MoosClient, key, text| state(client, 0.0, key, text).expect("is a heartbeat");
    assert_eq!(state(&mut client, "IVPHELM_STATE", "PARK"), ("PARK".to_owned(), false));
    for text in ["DRIVE", "DRIVE+"] {
        assert_eq!(state(&mut client, "IVPHELM_STATE", text), ("DRIVE".to_owned(), true));
    }
    for text in ["DISABLED", "STANDBY", "MALCONFIG", ""] {
        assert!(!state(&mut client, "IVPHELM_STATE", text).1, "{text}");
    }
    for key in ["MOOS_MANUAL_OVERRIDE", "MOOS_MANUAL_OVERIDE"] {
        assert_eq!(state(&mut client, key, "TRUE"), ("manual override".to_owned(), false));
        // Before the helm has noticed it.
        assert!(!state(&mut client, "IVPHELM_STATE", "DRIVE").1);
        assert_eq!(mode(&heard(&mut client, 0.0, [(key, Text("false"))])), None);
        assert!(state(&mut client, "IVPHELM_STATE", "DRIVE").1);
    }
}

#[test]
fn without_a_helm_the_controller_must_be_handed_over_and_no_helm_may_drive() {
    let mut client = client(None, true);
    let time = |client: &mut MoosClient, after| mode(&heard(client, after, [("DB_TIME", Number(NOW_S))]));
    assert_eq!(time(&mut client, 0.0), Some(("manual override".to_owned(), false)));
    assert_eq!(state(&mut client, 0.0, "MOOS_MANUAL_OVERRIDE", "false"), None);
    assert_eq!(time(&mut client, 1.0), Some(("DESIRED_*".to_owned(), true)));
    assert_eq!(state(&mut client, 1.0, "IVPHELM_STATE", "DRIVE"), None);
    assert_eq!(time(&mut client, 2.0), Some(("the helm drives too".to_owned(), false)));
    assert_eq!(time(&mut client, 4.0), Some(("DESIRED_*".to_owned(), true)));
}

#[test]
fn the_reason_for_which_the_helm_stops_the_craft_is_told_once() {
    let mut client = client(None, false);
    for (reason, times) in [("BehaviorError", 1), ("BehaviorError", 0), ("clear", 1)] {
        let told = AutopilotEvent::Text(format!("IVPHELM_ALLSTOP {reason}"));
        assert_eq!(heard(&mut client, 0.0, [("IVPHELM_ALLSTOP", Text(reason))]), vec![told; times]);
    }
}

/// What is sent, and the messages in it.
type Sent = Arc<Mutex<Vec<u8>>>;

fn messages(sent: &Sent) -> Vec<(u8, String, f64, Option<String>)> {
    let bytes = std::mem::take(&mut *sent.lock().expect("is whole"));
    let mut reader = PacketReader::default();
    let messages = reader.push(bytes.strip_prefix(&greeting()).unwrap_or(&bytes));
    assert!(!reader.is_lost && reader.rejects.total() == 0);
    messages.into_iter().map(|message| (message.kind, message.key, message.number, message.text)).collect()
}

/// A link to a database at this wire, and what it sends.
fn link(is_raw: bool) -> (AutopilotLink, Sent) {
    let sent = Sent::default();
    let kept = Arc::clone(&sent);
    let connect = "tcp:craft:9000".parse().expect("is a wire");
    let settings = AutopilotSettings::Moos { connect, auvs: vec![], datum: Some(DATUM), is_raw };
    let link = AutopilotLink::open(settings, &clock::Clock::simulated(0.0), |_| {
        Box::new(move |bytes| {
            kept.lock().expect("is whole").extend(if bytes.is_empty() { b"closed" } else { bytes });
        })
    });
    (link, sent)
}

fn piece(bytes: &[u8], after: f64) -> Received {
    let at = Clock::simulated(0.0).now() + Duration::from_secs_f64(after);
    Received { wire: 0, bytes: bytes.to_vec(), is_datagram: false, at }
}

#[tokio::test(start_paused = true)]
async fn every_connection_begins_with_greeting_name_and_variables() {
    let (mut link, sent) = link(false);
    for t_s in [10.0, 20.0] {
        // The rest of a packet that the last connection did not finish.
        link.push(&piece(&[77, 0], t_s - 1.0), t_s - 1.0, NOW_S);
        assert_eq!(link.push(&piece(&[], t_s), t_s, NOW_S), []);
        let bytes = sent.lock().expect("is whole").clone();
        assert!(bytes.starts_with(&greeting()));
        let messages = messages(&sent);
        let name = Some("pPilotfish".to_owned());
        assert_eq!(messages[0], (DATA, "asynchronous".to_owned(), 0.0, name));
        for key in ["NAV_X", "NODE_REPORT", "IVPHELM_STATE", "MOOS_MANUAL_OVERRIDE", "DB_TIME"] {
            assert!(messages.contains(&(REGISTER, key.to_owned(), 0.0, None)), "{key}");
        }
        let drive = packet(&[message("IVPHELM_STATE", Text("DRIVE"), NOW_S)]);
        assert_eq!(link.push(&piece(&drive, t_s), t_s, NOW_S).len(), 1);
        assert!(
            matches!(link.control(t_s + 1.0), Control::Reported(Some((beat, 1.0))) if beat.may_be_steered())
        );
    }
}

#[tokio::test(start_paused = true)]
async fn a_silent_or_senseless_connection_is_closed_once() {
    let (mut link, sent) = link(false);
    link.send_heartbeat(100.0);
    link.push(&piece(&[], 100.0), 100.0, NOW_S);
    messages(&sent);
    link.send_heartbeat(105.0);
    assert_eq!(sent.lock().expect("is whole").as_slice(), b"");
    link.send_heartbeat(105.1);
    link.send_heartbeat(107.0);
    assert_eq!(std::mem::take(&mut *sent.lock().expect("is whole")), b"closed");
    link.push(&piece(&[], 108.0), 108.0, NOW_S);
    messages(&sent);
    link.push(&piece(&[1, 0, 0, 0], 108.0), 108.0, NOW_S);
    link.send_heartbeat(109.0);
    assert_eq!(sent.lock().expect("is whole").as_slice(), b"closed");
}

#[tokio::test(start_paused = true)]
async fn a_database_that_speaks_hears_of_the_bridge_each_second() {
    let (mut link, sent) = link(false);
    link.push(&piece(&[], 0.0), 0.0, NOW_S);
    messages(&sent);
    let time = packet(&[message("DB_TIME", Number(NOW_S), NOW_S)]);
    let mut signs = 0;
    for tenth in 1..=45_u8 {
        let t_s = 0.1 * f64::from(tenth);
        link.push(&piece(&time, t_s), t_s, NOW_S);
        signs += messages(&sent).iter().filter(|message| message.0 == TIMING).count();
    }
    assert_eq!(signs, 4);
}

#[tokio::test(start_paused = true)]
async fn references_are_updates_of_two_behaviours_or_desired_on_request() {
    let reference = Reference { speed: 1.25, heading: -std::f64::consts::FRAC_PI_2 };
    let text = |key: &str, text: &str| (NOTIFY, key.to_owned(), 0.0, Some(text.to_owned()));
    let number = |key: &str, number| (NOTIFY, key.to_owned(), number, None);
    let updates = vec![
        text("PILOTFISH_HEADING", "heading=270.0000"),
        text("PILOTFISH_SPEED", "speed=1.25000"),
        text("PILOTFISH_ACTIVE", "true"),
    ];
    let desired = vec![number("DESIRED_HEADING", 270.0), number("DESIRED_SPEED", 1.25)];
    for (is_raw, expected) in [(false, updates), (true, desired)] {
        let (mut link, sent) = link(is_raw);
        link.send(&reference, 1.0);
        assert_eq!(messages(&sent), expected);
    }
}

#[tokio::test(start_paused = true)]
async fn a_bridge_that_falls_silent_stops_a_craft_that_is_still_its_own_and_has_no_helm() {
    for (is_raw, is_handed_over) in [(true, true), (true, false), (false, true)] {
        let (mut link, sent) = link(is_raw);
        link.push(&piece(&[], 0.0), 0.0, NOW_S);
        let handed = if is_handed_over { "false" } else { "true" };
        let drives = if is_raw {
            message("DB_TIME", Number(NOW_S), NOW_S)
        } else {
            message("IVPHELM_STATE", Text("DRIVE"), NOW_S)
        };
        let said = packet(&[message("MOOS_MANUAL_OVERRIDE", Text(handed), NOW_S), drives]);
        link.push(&piece(&said, 0.0), 0.0, NOW_S);
        messages(&sent);
        link.fall_silent(1.0);
        let stop = (NOTIFY, "DESIRED_SPEED".to_owned(), 0.0, None);
        // The helm's own watchdog stops it otherwise, or a person has it.
        let expected = if is_raw && is_handed_over { vec![stop] } else { vec![] };
        assert_eq!(messages(&sent), expected, "{is_raw}, {is_handed_over}");
    }
}

#[test]
fn the_override_that_was_written_last_counts_and_another_database_begins_anew() {
    let mut client = client(None, false);
    let said = |client: &mut MoosClient, key, text, written_s| {
        let bytes = packet(&[message(key, Text(text), written_s)]);
        mode(&client.push(&bytes, 0.0, NOW_S))
    };
    let overridden = Some(("manual override".to_owned(), false));
    assert_eq!(said(&mut client, "MOOS_MANUAL_OVERRIDE", "true", NOW_S), overridden);
    // The other spelling, from before.
    assert_eq!(said(&mut client, "MOOS_MANUAL_OVERIDE", "false", NOW_S - 60.0), overridden);
    let drive = |client: &mut MoosClient| said(client, "IVPHELM_STATE", "DRIVE", NOW_S).expect("beats").1;
    assert!(!drive(&mut client));
    client.connect(0.0, NOW_S);
    assert!(drive(&mut client));
}

#[tokio::test(start_paused = true)]
async fn the_state_is_shown_at_once_and_the_plan_each_second() {
    let (mut link, sent) = link(false);
    let mut answer = planned(3);
    answer["plan"]["origin"] = serde_json::json!(DATUM);
    let answer = serde_json::from_value(answer).expect("is an answer");
    let mut status = LinkStatus { plan: Plan::new(answer, 0.0, 0.0).map(Arc::new), ..LinkStatus::default() };
    status.setting.keep_outs = serde_json::from_value(serde_json::json!([
        { "north_m": 10.0, "east_m": 20.0, "radius_m": 5.0 },
    ]))
    .expect("is one");
    let keys = |sent: &Sent| messages(sent).into_iter().map(|(_, key, ..)| key).collect::<Vec<_>>();
    link.show(10.0, "steering", &status);
    let shown = messages(&sent);
    let text = |key: &str| shown.iter().find(|(_, of, ..)| of == key).and_then(|shown| shown.3.clone());
    assert_eq!(text("PILOTFISH_STATE").as_deref(), Some("steering"));
    assert_eq!(text("VIEW_CIRCLE").as_deref(), Some("x=20.0,y=10.0,label=keep_out_0,radius=5.0"));
    let plan = text("VIEW_SEGLIST").expect("is drawn");
    assert_eq!(plan, "pts={0.0,0.0},label=pilotfish_plan");
    assert!(text("VIEW_POINT").is_some_and(|goal| goal.ends_with(",label=pilotfish_goal")));
    link.show(10.5, "steering", &status);
    assert_eq!(keys(&sent), [""; 0]);
    link.show(10.6, "NOT STEERING: no plan", &status);
    assert_eq!(keys(&sent), ["PILOTFISH_STATE"]);
    link.show(11.0, "NOT STEERING: no plan", &LinkStatus::default());
    assert_eq!(keys(&sent), ["PILOTFISH_STATE", "VIEW_SEGLIST"]);
}
