//! The bridge's process.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
    time::Duration,
};

use bridge::{
    autopilot_link::AutopilotSettings,
    follow::{Bridge, Settings},
    mission_client::{Answer, Answering, Call, MissionClient, Transport},
    mission_link::MissionChoice,
};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use tokio::task::JoinHandle;

use super::{
    World,
    faults::Kind,
    host::{Host, Request},
    lock, rng,
    sea::{AUV, Limits, Sea},
};

pub(super) struct BridgeProcess {
    world: Arc<World>,
    sea: Arc<Sea>,
    host: Arc<Host>,
    rng: Arc<Mutex<ChaCha8Rng>>,
    settings: Settings,
    body: serde_json::Value,
    running: Option<JoinHandle<()>>,
}

impl BridgeProcess {
    pub(super) fn new(world: &Arc<World>, sea: &Arc<Sea>, host: &Arc<Host>, seed: u64) -> Self {
        let mut draws = rng(seed, 1);
        let Limits {
            speed_max,
            turn_rate_max,
            acceleration_max,
        } = sea.limits;
        Self {
            world: Arc::clone(world),
            sea: Arc::clone(sea),
            host: Arc::clone(host),
            settings: Settings {
                rate_hz: [2.0, 5.0, 10.0][draws.random_range(0..3)],
                report_interval: Duration::from_millis([200, 500, 1_000][draws.random_range(0..3)]),
                take_control: true,
                ..Settings::default()
            },
            rng: Arc::new(Mutex::new(draws)),
            body: json!({ "schema_version": "1.0", "title": "a voyage", "live": {
                "auvs": [{ "id": "auv-1" }],
                "goal": { "kind": "track", "auv": "auv-1" },
                "limits": {
                    "speed_max_mps": speed_max,
                    "turn_rate_max_radps": turn_rate_max,
                    "acceleration_max_mps2": acceleration_max,
                },
            } }),
            running: None,
        }
    }

    pub(super) fn start(&mut self) {
        self.world.note("bridge", "starts");
        self.sea.new_bridge();
        let settings = Settings {
            nmea: vec![],
            modems: vec![],
            ..self.settings
        };
        let autopilot = AutopilotSettings::Mavlink {
            connect: "tcp:boat:5760".parse().expect("is an endpoint"),
            system: None,
            auvs: BTreeMap::from([(AUV, "auv-1".to_owned())]),
        };
        let sea = Arc::clone(&self.sea);
        let mut bridge = Bridge::open(&self.world.aboard, autopilot, settings, move |_, input| {
            sea.connect(input);
            let sea = Arc::clone(&sea);
            Box::new(move |bytes| sea.take(bytes))
        });
        let transport = Transport::in_process(&self.world.aboard, self.network());
        let client = MissionClient::new(&["http://host".to_owned()], None, transport);
        let choice = MissionChoice::named("voyage".to_owned(), self.body.clone());
        let world = Arc::clone(&self.world);
        self.running = Some(tokio::spawn(async move {
            while !bridge.wait_for_craft(Duration::from_secs(600)).await {}
            bridge.follow(client, choice).await;
            let ended = bridge.run(None).await;
            world.note("bridge", format!("ends: {ended:?}"));
        }));
    }

    pub(super) fn kill(&mut self) {
        if let Some(running) = self.running.take() {
            running.abort();
            self.world.note("bridge", "is killed");
        }
        self.sea.disconnect();
    }

    /// The network to the service, which loses, delays, doubles and cuts what it carries.
    fn network(&self) -> impl Fn(Call) -> Answering + Send + Sync + 'static {
        let (world, host, sea, rng) = (
            Arc::clone(&self.world),
            Arc::clone(&self.host),
            Arc::clone(&self.sea),
            Arc::clone(&self.rng),
        );
        move |call| {
            let (world, host, sea, rng) = (
                Arc::clone(&world),
                Arc::clone(&host),
                Arc::clone(&sea),
                Arc::clone(&rng),
            );
            Box::pin(async move {
                let fate = Fate::drawn(&mut lock(&rng), world.now().has(Kind::BadNetwork));
                world.aboard.sleep(fate.there).await;
                if fate.is_lost || world.now().has(Kind::NetworkCut) {
                    return std::future::pending().await;
                }
                let request = Request {
                    path: call.path.clone(),
                    key: call.posted.as_ref().map(|posted| posted.key.clone()),
                    body: call.posted.map(|posted| posted.body),
                };
                if fate.is_doubled {
                    let (host, request) = (Arc::clone(&host), request.clone());
                    tokio::spawn(async move { host.ask(request).await });
                }
                let (status, mut body) = host.ask(request).await?;
                world.aboard.sleep(fate.back).await;
                if fate.answer_is_lost || world.now().has(Kind::NetworkCut) {
                    return std::future::pending().await;
                }
                if fate.is_cut {
                    body.truncate(body.len() / 2);
                } else {
                    sea.heard_from_service(&call.path, status, &body);
                }
                Ok(Answer { status, body })
            })
        }
    }
}

/// What becomes of a request and its answer.
struct Fate {
    there: Duration,
    back: Duration,
    is_lost: bool,
    answer_is_lost: bool,
    is_doubled: bool,
    is_cut: bool,
}

impl Fate {
    fn drawn(rng: &mut ChaCha8Rng, is_bad: bool) -> Self {
        let mut with = |probability: f64| rng.random_bool(if is_bad { probability } else { 0.0 });
        let (is_lost, answer_is_lost, is_doubled, is_cut) = (with(0.2), with(0.2), with(0.2), with(0.1));
        let most = if is_bad { 2.0 } else { 0.02 };
        let mut delay = || Duration::from_secs_f64(rng.random_range(0.001..most));
        Self {
            there: delay(),
            back: delay(),
            is_lost,
            answer_is_lost,
            is_doubled,
            is_cut,
        }
    }
}
