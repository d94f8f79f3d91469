//! The loop with a wire, and what operators are told.

use std::sync::Arc;

use ::wire::Warning;
use ::wire::mission::{CurrentReference, Setting};

use super::{decision::Sending, *};
use crate::{Plan, mavlink::Silence, tests::planned};

mod displays;
mod dune;

/// A bridge with only the wire of its autopilot.
fn bridge() -> (Bridge, Input) {
    let connect = "tcp:autopilot:1".parse().expect("an endpoint");
    let (clock, mut wire) = (Clock::simulated(0.0), None);
    let autopilot = AutopilotSettings::Nmea { connect };
    let bridge = Bridge::open(&clock, autopilot, Settings::default(), |_, input| {
        wire = Some(input);
        Box::new(|_| ())
    });
    (bridge, wire.expect("is opened"))
}

const PIECE: &[u8] = b"$HEHDT,1.0,T*00\r\n";

#[tokio::test(start_paused = true)]
async fn a_wire_without_pauses_does_not_delay_the_loop() {
    let (mut bridge, wire) = bridge();
    let clock = wire.clock.clone();
    let noise = tokio::spawn(async move {
        for _ in 0..1_000 {
            // More pieces wait than the loop reads before another task is next.
            while wire.received.try_send(wire.piece(PIECE.to_vec(), false)).is_ok() {}
            tokio::time::advance(Duration::from_millis(1)).await;
        }
    });
    let start = clock.now();
    bridge.listen(start + Duration::from_millis(50)).await;
    let (waiting, listened) = (bridge.received.len(), clock.since(start));
    noise.abort();
    assert!(0 < waiting, "the wire pauses");
    assert_eq!(listened, Duration::from_millis(50));
}

#[tokio::test(start_paused = true)]
async fn a_late_loop_reads_a_piece_in_each_round() {
    let (mut bridge, wire) = bridge();
    for _ in 0..3 {
        wire.arrived(PIECE.to_vec(), false).await;
    }
    let due = wire.clock.now();
    for count in 1..=2 {
        bridge.listen(due).await;
        assert_eq!(bridge.telemetry.pieces, [count]);
    }
}

/// A mission with a present plan, whose answer `change` modifies.
fn link(change: impl Fn(&mut CurrentReference)) -> LinkStatus {
    let mut answer = serde_json::from_value(planned(1)).expect("has the API's shape");
    change(&mut answer);
    let limits = DeclaredLimits { speed_max_mps: Some(1.2), ..DeclaredLimits::default() };
    LinkStatus {
        plan: Plan::new(answer, 0.0, 0.0).map(Arc::new),
        setting: Setting { limits: Some(Some(limits)), ..Setting::default() },
        ..LinkStatus::default()
    }
}

fn warnings(of: &[(&str, &str)]) -> Vec<Warning> {
    let warning = |(code, detail): &(&str, &str)| Warning {
        code: (*code).to_owned(),
        pointer: String::new(),
        detail: (*detail).to_owned(),
    };
    of.iter().map(warning).collect()
}

fn line(sending: Option<Sending>, link: &LinkStatus) -> String {
    let (mut bridge, _) = bridge();
    bridge.decision.sending = sending;
    let facts = bridge.facts(link);
    facts.line(facts.steering().as_ref())
}

const ACTIVE: Option<Sending> = Some(Sending::Active);

#[tokio::test(start_paused = true)]
async fn the_line_begins_with_the_state_of_the_steering_and_its_reason() {
    let stopped = |silence| Some(Sending::Stopped(silence));
    let stale = "auv-1 was last heard 40 s ago; its forecast starts there";
    for (sending, reason, warned, begins_with) in [
        (ACTIVE, None, None, "steering, mode unknown, mpc ok, 0.0 m from"),
        (stopped(Silence::NoHeartbeat), None, None, "NOT STEERING: no heartbeat of the autopilot, "),
        (stopped(Silence::MissionPaused), None, None, "not steering: the mission is paused, "),
        (ACTIVE, None, Some(("heading_does_not_respond", "")), "DEGRADED: heading does not respond, "),
        (
            ACTIVE,
            None,
            Some(("stale_report", stale)),
            "steering: auv-1 was last heard 40 s ago, mode unknown, ",
        ),
        (ACTIVE, Some("deadline"), None, "DEGRADED: deadline, "),
        (None, None, None, "not steering: waiting for the craft, "),
    ] {
        let link = link(|answer| {
            answer.plan.reason = reason.map(str::to_owned);
            answer.plan.warnings = warnings(warned.as_slice());
        });
        let line = line(sending, &link);
        let is_said_once = line.matches("heading does not respond").count() <= 1;
        assert!(line.starts_with(begins_with) && is_said_once, "{line}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_outdated_plan_has_only_its_age_and_a_present_one_is_shown_within_the_limits() {
    let outdated = link(|answer| {
        answer.age_s = 40.0;
        answer.plan.reference.valid_until_s = 20.0;
    });
    let outdated = line(None, &outdated);
    assert!(outdated.contains("last plan 40 s ago"), "{outdated}");
    assert!(!outdated.contains("goal") && !outdated.contains("ok"), "{outdated}");
    let present = line(None, &link(|_| {}));
    assert!(present.contains(", 1.20 m/s 000°"), "{present}");
}

#[tokio::test(start_paused = true)]
async fn the_ground_station_is_told_of_worse_states_at_once_and_of_the_lasting_end_of_an_alarm() {
    let ((mut bridge, wire), link) = (bridge(), link(|_| {}));
    let mut texts = vec![];
    let stale = Sending::Stopped(Silence::PlanStale);
    // Tenths of a second. Intermittent silence is told twice a minute.
    let course = [(Sending::Active, 12)];
    let intermittent = [(stale, 13), (Sending::Active, 30)].repeat(14);
    let end = [(Sending::Active, 80)];
    for (sending, tenths) in course.into_iter().chain(intermittent).chain(end) {
        for _ in 0..tenths {
            wire.clock.sleep(Duration::from_millis(100)).await;
            bridge.decision.sending = Some(sending);
            let steering = bridge.facts(&link).steering();
            let now = bridge.now_s();
            bridge.reporting.tell(now, steering, None, &mut bridge.autopilot);
            let told = bridge.reporting.texted.clone();
            if told != texts.last().cloned() {
                texts.extend(told);
            }
        }
    }
    let texts: Vec<_> = texts.iter().map(|(steering, _)| steering.texts().concat()).collect();
    let (on, off) = ("Pilotfish steering", "Pilotfish off: the plan is too old");
    assert_eq!(texts, [on, off, off, on]);
}
