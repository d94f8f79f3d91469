//! A whole bridge in one thread and in simulated time: a boat on a wire of its own, a service in the process.

use std::{
    f64::consts::PI,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use clock::Clock;
use mavlink::{
    MAVLinkV2MessageRaw, MavHeader, MavlinkReader,
    dialects::ardupilotmega::{
        GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag,
    },
};
use pilotfish_bridge::{
    autopilot_link::AutopilotSettings,
    follow::{Bridge, Settings},
    mission_client::{Answer, Call, MissionClient, Transport},
    mission_link::MissionChoice,
    wire::Input,
};
use serde_json::{Value, json};

/// Limits of the mission, and what its plans want at once: too fast, and astern.
const SPEED_MAX: f64 = 1.2;
const TURN_RATE_MAX: f64 = 0.3;
const WANTED: (f64, f64) = (20.0, 3.0);
/// For how long the service makes plans, s, and how long a plan is followed after its arrival.
const PLANS_S: f64 = 30.0;
const PLAN_AGE_MAX_S: f64 = 10.0;
/// How long the service takes for an answer.
const LATENCY: Duration = Duration::from_millis(20);
/// Source: ArduPilot, `Rover/mode.h`.
const GUIDED: u32 = 15;

/// A boat that does at once what it is told.
#[derive(Default)]
struct Boat {
    metres_north: f64,
    speed: f64,
    heading: f64,
    /// When references came, s, with speed and heading.
    references: Vec<(f64, f64, f64)>,
    /// All bytes from the bridge.
    bytes: Vec<u8>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Boat {
    fn take(&mut self, now_s: f64, bytes: &[u8]) {
        self.bytes.extend(bytes);
        let mut frames = MavlinkReader::new(bytes);
        while let Ok((_, message)) = frames.read_any_message::<MavMessage>() {
            if let MavMessage::SET_POSITION_TARGET_LOCAL_NED(target) = message {
                (self.speed, self.heading) = (target.vx.into(), target.yaw.into());
                self.references.push((now_s, self.speed, self.heading));
            }
        }
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the message's integers are that wide, and a heading is made positive"
    )]
    fn place(&mut self, dt: f64) -> MavMessage {
        let north = self.speed * self.heading.cos();
        self.metres_north += north * dt;
        MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
            lat: ((38.0 + self.metres_north / 111_000.0) * 1e7) as i32,
            lon: -90_000_000,
            vx: (north * 100.0) as i16,
            hdg: (self.heading.to_degrees().rem_euclid(360.0) * 100.0) as u16,
            ..GLOBAL_POSITION_INT_DATA::DEFAULT
        })
    }
}

fn frame(message: &MavMessage) -> Vec<u8> {
    let header = MavHeader {
        system_id: 1,
        component_id: 1,
        sequence: 0,
    };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(header, message);
    raw.raw_bytes().to_vec()
}

/// Says ten times a second where the boat is, and once that it is in its guided mode and armed.
async fn sail(clock: Clock, boat: Arc<Mutex<Boat>>, wire: Input) {
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode: GUIDED,
        autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
        ..HEARTBEAT_DATA::DEFAULT
    });
    for tenth in 0_u64.. {
        let mut bytes = frame(&lock(&boat).place(0.1));
        if tenth.is_multiple_of(10) {
            bytes.extend(frame(&heartbeat));
        }
        if !wire.arrived(bytes, false).await {
            return;
        }
        clock.sleep(Duration::from_millis(100)).await;
    }
}

/// What a service answers at `now_s`: a mission, and a plan each second.
fn answer(call: &Call, now_s: f64) -> (u16, Value) {
    if call.path.contains("/reference?") {
        let point = json!({
            "t_s": now_s, "north_m": 0.0, "east_m": 0.0,
            "speed_mps": WANTED.0, "heading_rad": WANTED.1, "valid_until_s": now_s + 1e9,
        });
        let plan = json!({
            "method": "mpc", "outcome": "ok", "reference": point, "baseline": point,
            "trajectory": [point], "goal": { "trajectory": [point] },
        });
        let sequence = Duration::from_secs_f64(now_s).as_secs();
        return (
            200,
            json!({ "t_s": now_s, "age_s": 0.0, "sequence": sequence, "status": "running", "plan": plan }),
        );
    }
    if call.path.starts_with("/v1/missions?") {
        return (200, json!({ "missions": [], "next": null }));
    }
    (200, json!({ "id": "m-1", "status": "running" }))
}

/// A minute of a bridge whose service falls silent after half of it.
async fn voyage() -> Boat {
    let clock = Clock::simulated(1.8e9);
    let start = clock.now();
    let boat = Arc::new(Mutex::new(Boat::default()));
    let autopilot = AutopilotSettings::Mavlink {
        connect: "tcp:boat:5760".parse().expect("an endpoint"),
        system: None,
        auvs: [(2, "auv-1".to_owned())].into(),
    };
    let mut wires = vec![];
    let mut bridge = Bridge::open(&clock, autopilot, Settings::default(), |_, input| {
        wires.push(input);
        let (clock, boat) = (clock.clone(), Arc::clone(&boat));
        Box::new(move |bytes| lock(&boat).take(clock.since(start).as_secs_f64(), bytes))
    });
    for wire in wires {
        tokio::spawn(sail(clock.clone(), Arc::clone(&boat), wire));
    }

    let timer = clock.clone();
    let service = Transport::in_process(&clock, move |call| {
        let timer = timer.clone();
        Box::pin(async move {
            let now_s = timer.since(start).as_secs_f64();
            if PLANS_S <= now_s {
                std::future::pending::<()>().await;
            }
            timer.sleep(LATENCY).await;
            let (status, body) = answer(&call, now_s);
            Ok(Answer {
                status,
                body: body.to_string().into_bytes(),
            })
        })
    });
    let missions = MissionClient::new(&["http://service".to_owned()], None, service);
    let limits = json!({ "speed_max_mps": SPEED_MAX, "turn_rate_max_radps": TURN_RATE_MAX });
    let body = json!({ "live": { "auvs": [{ "id": "auv-1" }], "limits": limits } });

    assert!(bridge.wait_for_craft(Duration::from_secs(20)).await);
    bridge
        .follow(missions, MissionChoice::named("craft".to_owned(), body))
        .await;
    // A future that can be spawned, as a harness with several bridges does.
    let run = tokio::spawn(async move { bridge.run(Some(Duration::from_mins(1))).await });
    run.await.expect("does not panic").expect("the mission is found");
    std::mem::take(&mut *lock(&boat))
}

#[tokio::test(start_paused = true)]
async fn references_keep_their_limits_and_stop_ten_seconds_after_the_last_plan() {
    let boat = voyage().await;
    let references = &boat.references;
    // Within rounding of the message's single precision.
    let tolerance = 1e-6;
    assert!(
        references
            .iter()
            .all(|(_, speed, _)| (0.0..=SPEED_MAX + tolerance).contains(speed))
    );
    for pair in references.windows(2) {
        let [(before_s, _, before), (now_s, _, now)] = [pair[0], pair[1]];
        let turn = (now - before + PI).rem_euclid(2.0 * PI) - PI;
        assert!(
            turn.abs() <= TURN_RATE_MAX * (now_s - before_s) + tolerance,
            "{pair:?}"
        );
        // Ten a second, without a gap, each by a millisecond late at most.
        assert!((now_s - before_s - 0.1).abs() <= 1.1e-3, "{pair:?}");
    }
    let (first_s, ..) = references.first().expect("are sent");
    let (last_s, speed, heading) = references.last().expect("are sent");
    assert!(*first_s < 15.0, "{first_s}");
    // What the plans want, as far as it is allowed.
    assert!((speed - SPEED_MAX).abs() < tolerance && (heading - WANTED.1).abs() < tolerance);
    // Asked for before the service fell silent, or repeated since: the newest plan is a second older at most.
    let end_s = PLANS_S + LATENCY.as_secs_f64() + PLAN_AGE_MAX_S;
    assert!((end_s - 1.5..=end_s).contains(last_s), "{last_s}");
}

#[tokio::test(start_paused = true)]
async fn the_same_voyage_sends_the_same_bytes() {
    let (once, again) = (voyage().await, voyage().await);
    assert!(!once.bytes.is_empty());
    assert_eq!(once.bytes, again.bytes);
    assert_eq!(once.references, again.references);
}
