//! Status line, ground station and mission change at the tick in which the state does.

use std::{collections::BTreeMap, sync::Mutex};

use ::mavlink::MavlinkReader;
use ::mavlink::dialects::ardupilotmega::{
    AIS_VESSEL_DATA, AisNavStatus, FOLLOW_TARGET_DATA, GLOBAL_POSITION_INT_DATA, MavMessage,
};
use ::wire::mission::Steering as Said;

use super::*;
use crate::{
    arrivals::Arrivals,
    mission_client::{Answer, Transport},
    tests::{ARDUPILOT, BOAT, frame, heartbeat, mission},
};

/// Speed of the boat to the north, m/s.
const SPEED: f64 = 1.0;
const METRES_PER_DEGREE: f64 = 111_195.0;
const GUIDED: u32 = 15;
const HOLD: u32 = 4;
const AUV: u32 = 7;
const TICK: Duration = Duration::from_millis(100);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    FixesCease,
    PlansCease,
    LeavesGuided,
    RudderSticks,
    MeetsVessel,
}

/// A bridge that steers a boat to the north, and everything that it says.
struct Voyage {
    bridge: Bridge,
    wire: Input,
    link: LinkStatus,
    tenths: u32,
    sent: Arc<Mutex<Vec<u8>>>,
    posted: Arc<Mutex<Vec<Said>>>,
}

impl Voyage {
    fn begin() -> Self {
        let (clock, mut wire) = (Clock::simulated(1.8e9), None);
        let sent = Arc::<Mutex<Vec<u8>>>::default();
        let autopilot = AutopilotSettings::Mavlink {
            connect: "tcp:autopilot:1".parse().expect("an endpoint"),
            system: None,
            auvs: BTreeMap::from([(7, "auv-1".to_owned())]),
        };
        let mut bridge = Bridge::open(&clock, autopilot, Settings::default(), |_, input| {
            wire = Some(input);
            let sent = Arc::clone(&sent);
            Box::new(move |bytes| sent.lock().expect("is whole").extend(bytes))
        });
        let posted = Arc::<Mutex<Vec<Said>>>::default();
        let (said, timer) = (Arc::clone(&posted), clock.clone());
        let transport = Transport::in_process(&clock, move |call| {
            let posted = call.posted.map(|posted| posted.body);
            let posted: Option<Value> = posted.and_then(|body| serde_json::from_slice(&body).ok());
            let words = posted.and_then(|posted| serde_json::from_value(posted["steering"].clone()).ok());
            let words: Vec<Said> = words.unwrap_or_default();
            said.lock().expect("is whole").extend(words);
            let (timer, body) = (timer.clone(), mission("m-1").to_string().into_bytes());
            Box::pin(async move {
                timer.sleep(Duration::from_millis(1)).await;
                Ok(Answer { status: 200, body })
            })
        });
        let client = MissionClient::new(&["http://a".to_owned()], None, transport);
        let choice = MissionChoice::Joined("m-1".to_owned());
        let interval = Duration::from_millis(10);
        let log = bridge.log.clock.clone();
        bridge.log.mission = Some(MissionLink::open(client, choice, interval, 1.0, log));
        Self { bridge, wire: wire.expect("is opened"), link: link(|_| {}), tenths: 0, sent, posted }
    }

    /// A tick with `fault`, and the time until the next one.
    async fn pass(&mut self, fault: Option<Fault>) {
        let now = self.bridge.now_s();
        let bytes = self.heard(fault);
        self.wire.arrived(bytes, false).await;
        self.bridge.listen(self.wire.clock.now()).await;
        if self.tenths.is_multiple_of(10) && fault != Some(Fault::PlansCease) {
            let mut answer = serde_json::from_value(planned(1)).expect("has the API's shape");
            let CurrentReference { plan, .. } = &mut answer;
            if fault == Some(Fault::RudderSticks) {
                plan.reference.heading_rad = 1.0;
            }
            self.link.plan = Plan::new(answer, now, now).map(Arc::new);
            match &mut self.link.plans {
                Some(plans) => plans.push(now),
                None => self.link.plans = Some(Arrivals::first(now)),
            }
        }
        let link = self.link.clone();
        self.bridge.tick(&link);
        self.tenths += 1;
        self.wire.clock.sleep(TICK).await;
    }

    /// Messages of boat and AUV. The boat never turns.
    fn heard(&self, fault: Option<Fault>) -> Vec<u8> {
        let north_m = 0.1 * SPEED * f64::from(self.tenths);
        #[expect(clippy::cast_possible_truncation, reason = "the message is that coarse")]
        let lat = ((38.0 + north_m / METRES_PER_DEGREE) * 1e7) as i32;
        let place =
            GLOBAL_POSITION_INT_DATA { lat, lon: -91_200_000, vx: 100, ..GLOBAL_POSITION_INT_DATA::DEFAULT };
        let mut bytes = frame(1, 1, &MavMessage::GLOBAL_POSITION_INT(place));
        if self.tenths.is_multiple_of(10) {
            let is_left = fault == Some(Fault::LeavesGuided);
            let beat = heartbeat(BOAT, ARDUPILOT, if is_left { HOLD } else { GUIDED });
            bytes.extend(frame(1, 1, &beat));
        }
        if self.tenths.is_multiple_of(50) && fault != Some(Fault::FixesCease) {
            let fix = FOLLOW_TARGET_DATA {
                lat,
                lon: -91_200_000,
                est_capabilities: 1,
                ..FOLLOW_TARGET_DATA::DEFAULT
            };
            bytes.extend(frame(AUV, 1, &MavMessage::FOLLOW_TARGET(fix)));
        }
        if fault == Some(Fault::MeetsVessel) {
            // Its half length and the distance to keep are 40 m: three seconds before the twelve
            // metres of the next ten seconds lead into them.
            let north_m = 30.0 + 3.0 + 12.0 + 40.0;
            #[expect(clippy::cast_possible_truncation, reason = "the message is that coarse")]
            let lat = ((38.0 + north_m / METRES_PER_DEGREE) * 1e7) as i32;
            let navigational_status = AisNavStatus::AIS_NAV_STATUS_MOORED;
            let (lon, mmsi) = (-91_200_000, 244_123_456);
            let vessel =
                AIS_VESSEL_DATA { lat, lon, MMSI: mmsi, navigational_status, ..AIS_VESSEL_DATA::DEFAULT };
            bytes.extend(frame(1, 1, &MavMessage::AIS_VESSEL(vessel)));
        }
        bytes
    }

    /// The state, in words, by status line, ground station and mission, each since its last change.
    fn displays(&self) -> [String; 3] {
        let line = self.bridge.reporting.lined.as_ref().and_then(|(steering, _)| steering.as_ref());
        let sent = self.sent.lock().expect("is whole");
        let mut frames = MavlinkReader::new(&sent[..]);
        let mut text = String::new();
        while let Ok((_, message)) = frames.read_any_message::<MavMessage>() {
            if let MavMessage::STATUSTEXT(said) = message {
                let said = said.text.to_str().unwrap_or_default();
                text = match said.strip_prefix("... ") {
                    Some(more) => format!("{text} {more}"),
                    None => said.to_owned(),
                };
            }
        }
        let posted = self.posted.lock().expect("is whole");
        let posted = posted.last().map(|said| Steering { state: said.state, cause: said.why.clone() });
        let [line, posted] = [line, posted.as_ref()].map(|steering| {
            let texts = steering.map(Steering::texts).unwrap_or_default();
            texts.join(" ").replace(" ... ", " ")
        });
        [line, text, posted]
    }
}

#[tokio::test(start_paused = true)]
async fn every_display_changes_at_the_tick_of_the_state() {
    for (fault, words, most_s) in [
        // Two seconds later than after the usual five, or one.
        (Fault::FixesCease, "Pilotfish steering: no new fix of auv-1", 7.1),
        (Fault::PlansCease, "Pilotfish steering: no new plan", 3.1),
        (Fault::LeavesGuided, "Pilotfish off: the autopilot left its guided mode", 0.1),
        (Fault::RudderSticks, "Pilotfish steering: the heading does not turn as told", 2.1),
        (Fault::MeetsVessel, "Pilotfish degraded: keeps clear of 244123456 against the plan", 4.1),
    ] {
        let mut voyage = Voyage::begin();
        for _ in 0..300 {
            voyage.pass(None).await;
        }
        assert_eq!(voyage.displays(), ["Pilotfish steering"; 3]);
        let mut ticks = 0;
        while voyage.displays() == ["Pilotfish steering"; 3] {
            voyage.pass(Some(fault)).await;
            ticks += 1;
            assert!(0.1 * f64::from(ticks) < most_s + 0.1, "{fault:?}");
        }
        assert_eq!(voyage.displays(), [words; 3], "{fault:?} after {ticks} ticks");
    }
}
