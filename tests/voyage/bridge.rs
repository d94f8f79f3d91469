//! The bridge's process.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bridge::autopilot_link::AutopilotSettings;
use bridge::follow::{Bridge, Settings};
use bridge::imc::ImcSettings;
use bridge::mission_client::{Answer, Answering, Call, MissionClient, Transport};
use bridge::mission_link::MissionChoice;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use tokio::task::JoinHandle;

use super::faults::Kind;
use super::host::{Host, Request};
use super::sea::{AUV, Limits, Sea};
use super::{Wire, World, imc, lock, rng};

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
        let mut settings = Settings {
            rate_hz: [2.0, 5.0, 10.0][draws.random_range(0..3)],
            report_interval: Duration::from_millis([200, 500, 1_000][draws.random_range(0..3)]),
            take_control: world.course.wire != Wire::Moos,
            dry_run: world.course.is_dry,
            ..Settings::default()
        };
        if world.course.only.is_some() {
            // The displays are those of a bridge with default settings.
            let usual = Settings::default();
            (settings.rate_hz, settings.report_interval) = (usual.rate_hz, usual.report_interval);
        }
        let Limits { speed_max, turn_rate_max, acceleration_max } = sea.limits;
        Self {
            world: Arc::clone(world),
            sea: Arc::clone(sea),
            host: Arc::clone(host),
            settings,
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
        self.sea.new_bridge(1.0 / self.settings.rate_hz);
        let settings = Settings { nmea: vec![], modems: vec![], ..self.settings };
        let connect = "tcp:boat:5760".parse().expect("is an endpoint");
        let auv = "auv-1".to_owned();
        let autopilot = match self.world.course.wire {
            Wire::Mavlink => {
                AutopilotSettings::Mavlink { connect, system: None, auvs: BTreeMap::from([(AUV, auv)]) }
            }
            Wire::Moos => AutopilotSettings::Moos { connect, auvs: vec![auv], datum: None, is_raw: false },
            Wire::Imc => AutopilotSettings::Imc(ImcSettings {
                connect,
                number: 9,
                vehicle: "craft".to_owned(),
                auvs: vec![auv.clone()],
                numbers: [(imc::CRAFT, "craft".to_owned()), (imc::AUV, auv)].into(),
                beacons: BTreeMap::new(),
                headings: false,
                asks: false,
            }),
        };
        let sea = Arc::clone(&self.sea);
        let mut bridge = Bridge::open(&self.world.aboard, autopilot, settings, move |_, input| {
            sea.connect(input);
            let sea = Arc::clone(&sea);
            Box::new(move |bytes| sea.take(bytes))
        });
        let transport = Transport::in_process(&self.world.aboard, self.network());
        let client = MissionClient::new(&self.host.urls(), None, transport);
        let choice = MissionChoice::named("voyage".to_owned(), self.body.clone());
        let world = Arc::clone(&self.world);
        self.running = Some(tokio::spawn(async move {
            while !bridge.wait_for_craft(Duration::from_mins(10)).await {}
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

    /// The network to the service: loses, delays, doubles and cuts messages.
    fn network(&self) -> impl Fn(Call) -> Answering + Send + Sync + 'static {
        let (world, host, sea, rng) =
            (Arc::clone(&self.world), Arc::clone(&self.host), Arc::clone(&self.sea), Arc::clone(&self.rng));
        move |call| {
            let (world, host, sea, rng) =
                (Arc::clone(&world), Arc::clone(&host), Arc::clone(&sea), Arc::clone(&rng));
            Box::pin(async move {
                let (fate, [there, back]) = Fate::drawn(&mut lock(&rng), world.now().has(Kind::BadNetwork));
                world.aboard.sleep(there).await;
                if fate == Fate::Lost || world.now().has(Kind::NetworkCut) {
                    return std::future::pending().await;
                }
                let urls = host.urls();
                let service = urls.iter().position(|url| *url == call.service);
                let service = service.expect("is one of them");
                let request = Request {
                    path: call.path.clone(),
                    key: call.posted.as_ref().map(|posted| posted.key.clone()),
                    body: call.posted.map(|posted| posted.body),
                };
                if fate == Fate::Doubled {
                    let (host, request) = (Arc::clone(&host), request.clone());
                    tokio::spawn(async move { host.ask(service, request).await });
                }
                let (status, mut body) = host.ask(service, request).await?;
                world.aboard.sleep(back).await;
                if fate == Fate::AnswerLost || world.now().has(Kind::NetworkCut) {
                    return std::future::pending().await;
                }
                if fate == Fate::AnswerCut {
                    body.truncate(body.len() / 2);
                } else {
                    sea.heard_from_service(&call.path, status, &body);
                }
                Ok(Answer { status, body })
            })
        }
    }
}

/// Fate of a request and its answer.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Arrives,
    Lost,
    AnswerLost,
    Doubled,
    AnswerCut,
}

impl Fate {
    /// A fate, with the delays of request and answer.
    fn drawn(rng: &mut ChaCha8Rng, is_bad: bool) -> (Self, [Duration; 2]) {
        let most = if is_bad { 2.0 } else { 0.02 };
        let delays = [(); 2].map(|()| Duration::from_secs_f64(rng.random_range(0.001..most)));
        let fate = match rng.random_range(0..10) {
            0 | 1 if is_bad => Self::Lost,
            2 | 3 if is_bad => Self::AnswerLost,
            4 | 5 if is_bad => Self::Doubled,
            6 if is_bad => Self::AnswerCut,
            _ => Self::Arrives,
        };
        (fate, delays)
    }
}
