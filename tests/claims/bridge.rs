//! A whole bridge in one thread and in simulated time, with a boat and a service in the process.

use std::{
    f64::consts::PI,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use bridge::{
    autopilot_link::AutopilotSettings,
    follow::{Bridge, Settings},
    mission_client::{Answer, Call, MissionClient, Transport},
    mission_link::MissionChoice,
    wire::Input,
};
use clock::Clock;
use mavlink::{MavlinkReader, dialects::ardupilotmega::MavMessage};
use nalgebra::Vector2;
use serde_json::{Value, json};
use tests::autopilot::{Boat, GUIDED, SYSTEM, frame};
use wire::mission::CurrentReference;

/// Limits of the mission, and the speed and heading of its plans: too fast, and astern.
const SPEED_MAX: f64 = 1.2;
const TURN_RATE_MAX: f64 = 0.3;
const WANTED: (f64, f64) = (20.0, 3.0);
/// Duration of the service's plans, and time for which a plan is followed after its arrival, s.
const PLANS_S: f64 = 30.0;
const PLAN_AGE_MAX_S: f64 = 10.0;
/// Delay of the service's answers.
const LATENCY: Duration = Duration::from_millis(20);
/// Time between two steps of the boat, s, and steps of [`Boat::messages`] in one of these.
const STEP_S: f64 = 0.1;
const STEPS: u64 = 5;

/// A boat, and the messages to it and to the service.
struct Sea {
    boat: Boat,
    /// References: time of arrival, s, speed, m/s, heading, rad.
    references: Vec<(f64, f64, f64)>,
    /// All bytes from the bridge.
    bytes: Vec<u8>,
    /// Reports of the craft at the service.
    reports: u64,
}

fn lock(sea: &Mutex<Sea>) -> MutexGuard<'_, Sea> {
    sea.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Sea {
    fn of(boat: Boat) -> Self {
        Self {
            boat,
            references: vec![],
            bytes: vec![],
            reports: 0,
        }
    }

    fn take(&mut self, now_s: f64, bytes: &[u8]) {
        self.bytes.extend(bytes);
        let mut frames = MavlinkReader::new(bytes);
        while let Ok((_, message)) = frames.read_any_message::<MavMessage>() {
            self.boat.take(&message, now_s, &mut vec![]);
            if let MavMessage::SET_POSITION_TARGET_LOCAL_NED(target) = message {
                self.references.push((now_s, target.vx.into(), target.yaw.into()));
            }
        }
    }
}

/// Steps ten times a second and sends the boat's messages.
async fn sail(clock: Clock, sea: Arc<Mutex<Sea>>, wire: Input) {
    let (start, still) = (clock.now(), Vector2::zeros());
    for step in 0.. {
        let said = {
            let boat = &mut lock(&sea).boat;
            boat.step(clock.since(start).as_secs_f64(), STEP_S, &still);
            boat.messages(STEPS * step, &still)
        };
        let bytes = said.iter().flat_map(|message| frame(SYSTEM, message)).collect();
        if !wire.arrived(bytes, false).await {
            return;
        }
        clock.sleep(Duration::from_secs_f64(STEP_S)).await;
    }
}

/// An answer of the service in the API's shape.
const REFERENCE: &str = include_str!("../../api/bridge/src/tests/reference.json");

/// The service's answer at `now_s`: a mission, and a new plan each second.
fn answer(call: &Call, now_s: f64) -> Value {
    if call.path.contains("/reference?") {
        let mut answer: CurrentReference = serde_json::from_str(REFERENCE).expect("has the API's shape");
        (answer.t_s, answer.sequence) = (now_s, Duration::from_secs_f64(now_s).as_secs());
        let plan = &mut answer.plan;
        (plan.reference.speed_mps, plan.reference.heading_rad) = WANTED;
        plan.reference.valid_until_s = now_s + 1e9;
        (plan.trajectory[0].speed_mps, plan.trajectory[0].heading_rad) = WANTED;
        plan.trajectory[0].t_s = now_s;
        return json!(answer);
    }
    if call.path.starts_with("/v1/missions?") {
        return json!({ "missions": [] });
    }
    json!({ "id": "m-1", "title": "", "kind": "live", "status": "running", "created_s": 0.0, "t_s": 0.0, "sequence": 1 })
}

/// A minute of `boat` and a bridge whose service falls silent after half a minute.
async fn voyage(boat: Boat, settings: Settings) -> Sea {
    let clock = Clock::simulated(1.8e9);
    let start = clock.now();
    let sea = Arc::new(Mutex::new(Sea::of(boat)));
    let autopilot = AutopilotSettings::Mavlink {
        connect: "tcp:boat:5760".parse().expect("an endpoint"),
        system: None,
        auvs: [(2, "auv-1".to_owned())].into(),
    };
    let mut bridge = Bridge::open(&clock, autopilot, settings, |_, wire| {
        tokio::spawn(sail(clock.clone(), Arc::clone(&sea), wire));
        let (clock, sea) = (clock.clone(), Arc::clone(&sea));
        Box::new(move |bytes| lock(&sea).take(clock.since(start).as_secs_f64(), bytes))
    });

    let (timer, ashore) = (clock.clone(), Arc::clone(&sea));
    let service = Transport::in_process(&clock, move |call| {
        let timer = timer.clone();
        lock(&ashore).reports += u64::from(call.path.ends_with("/reports"));
        Box::pin(async move {
            let now_s = timer.since(start).as_secs_f64();
            if PLANS_S <= now_s {
                std::future::pending::<()>().await;
            }
            timer.sleep(LATENCY).await;
            Ok(Answer {
                status: 200,
                body: answer(&call, now_s).to_string().into_bytes(),
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
    // A future that can be spawned, like in a harness with several bridges.
    let run = tokio::spawn(async move { bridge.run(Some(Duration::from_mins(1))).await });
    run.await.expect("does not panic").expect("the mission is found");
    std::mem::replace(&mut *lock(&sea), Sea::of(Boat::moored()))
}

/// A boat that may be steered.
fn guided() -> Boat {
    let mut boat = Boat::moored();
    (boat.mode, boat.is_armed) = (GUIDED, true);
    boat
}

#[tokio::test(start_paused = true)]
async fn references_keep_their_limits_and_stop_ten_seconds_after_the_last_plan() {
    let references = voyage(guided(), Settings::default()).await.references;
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
        // Ten a second without a gap, each a millisecond late at most.
        assert!((now_s - before_s - 0.1).abs() <= 1.1e-3, "{pair:?}");
    }
    let (first_s, ..) = references.first().expect("are sent");
    let (last_s, speed, heading) = references.last().expect("are sent");
    assert!(*first_s < 15.0, "{first_s}");
    // Like the plans, within the limits.
    assert!((speed - SPEED_MAX).abs() < tolerance && (heading - WANTED.1).abs() < tolerance);
    // The service repeats a plan for a second: the newest may have arrived that much earlier.
    let end_s = PLANS_S + LATENCY.as_secs_f64() + PLAN_AGE_MAX_S;
    assert!((end_s - 1.5..=end_s).contains(last_s), "{last_s}");
}

#[tokio::test(start_paused = true)]
async fn the_same_voyage_sends_the_same_bytes() {
    let [once, again] = [(); 2].map(|()| voyage(guided(), Settings::default()));
    let (once, again) = (once.await, again.await);
    assert!(!once.bytes.is_empty());
    assert_eq!(once.bytes, again.bytes);
    assert_eq!(once.references, again.references);
}

#[tokio::test(start_paused = true)]
async fn a_dry_run_reports_and_moves_nothing() {
    for boat in [guided(), Boat::moored()] {
        let settings = Settings {
            take_control: true,
            dry_run: true,
            ..Settings::default()
        };
        let sailed = voyage(boat, settings).await;
        assert!(0 < sailed.reports);
        assert_eq!((sailed.references.len(), sailed.boat.orders), (0, 0));
    }
}
