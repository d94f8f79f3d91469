//! A craft that runs DUNE, in the loop: what it is sent, second by second.

use parking_lot::Mutex;

use super::*;
use crate::imc::ImcSettings;
use crate::imc::codec::{
    ByteOrder, EstimatedState, Header, Message, Packet, PacketReader, PlanControl, VehicleState, packet,
};

const CRAFT: u16 = 0x0C01;
const SERVICE: (u8, u16) = (0, 0xFFFF);
const FOLLOWS: (u8, u16) = (3, 478);
const EXTERNAL: (u8, u16) = (4, 0xFFFF);

/// A craft that goes north at 1 m/s, its mode, and what it was sent in each second.
struct Dune {
    bridge: Bridge,
    wire: Input,
    sent: Arc<Mutex<Vec<u8>>>,
    tenths: u32,
    has_position: bool,
}

impl Dune {
    fn begin(take_control: bool, headings: bool) -> Self {
        let (clock, mut wire) = (Clock::simulated(1.8e9), None);
        let sent = Arc::<Mutex<Vec<u8>>>::default();
        let autopilot = AutopilotSettings::Imc(ImcSettings {
            connect: "udp:0.0.0.0:1".parse().expect("an endpoint"),
            number: 9,
            vehicle: "asv".to_owned(),
            auvs: vec![],
            numbers: [(CRAFT, "asv".to_owned())].into(),
            beacons: [].into(),
            headings,
            asks: false,
        });
        let settings = Settings { take_control, ..Settings::default() };
        let bridge = Bridge::open(&clock, autopilot, settings, |_, input| {
            wire = Some(input);
            let sent = Arc::clone(&sent);
            Box::new(move |bytes| sent.lock().extend(bytes))
        });
        Self { bridge, wire: wire.expect("is opened"), sent, tenths: 0, has_position: true }
    }

    fn packet(&self, message: impl Into<Message>) -> Vec<u8> {
        let header = Header { time_s: self.wire.clock.unix_s(), source: CRAFT, ..Header::default() };
        packet(&header, &message.into(), ByteOrder::Big)
    }

    /// The messages of one second in the mode, or in silence, and the line at its end.
    async fn second(&mut self, mode: Option<(u8, u16)>) -> (Vec<Message>, String) {
        for tenth in 0..10 {
            if let Some((op_mode, maneuver_type)) = mode {
                let x = 0.1 * f32::from(u16::try_from(self.tenths).expect("is soon over"));
                let state = EstimatedState { lat: 0.7, lon: -0.15, x, vx: 1.0, ..EstimatedState::default() };
                let mut bytes = if self.has_position { self.packet(state) } else { vec![] };
                if tenth == 0 {
                    let state = VehicleState { op_mode, maneuver_type, ..VehicleState::default() };
                    bytes.extend(self.packet(state));
                }
                self.wire.arrived(bytes, true).await;
            }
            self.bridge.listen(self.wire.clock.now()).await;
            let now = self.bridge.now_s();
            let mut link = link(|_| {});
            let answer = serde_json::from_value(planned(1)).expect("has the API's shape");
            link.plan = Plan::new(answer, now, now).map(Arc::new);
            self.bridge.tick(&link);
            self.tenths += 1;
            self.wire.clock.sleep(Duration::from_millis(100)).await;
        }
        let packets: Vec<Packet> =
            PacketReader::default().push(&std::mem::take(&mut *self.sent.lock()), false);
        let to_craft = packets.into_iter().filter(|packet| packet.header.destination == CRAFT);
        let messages = to_craft.filter_map(|packet| packet.message).collect();
        let line = line(self.bridge.decision.sending, &link(|_| {}));
        (messages, line)
    }

    /// The numbers of references and of orders to start in each of `count` seconds of one mode.
    async fn seconds(&mut self, count: u32, mode: Option<(u8, u16)>) -> Vec<[usize; 2]> {
        let mut seconds = vec![];
        for _ in 0..count {
            let (messages, _) = self.second(mode).await;
            let references = messages.iter().filter_map(|message| match message {
                Message::Reference(reference) => reference.speed.as_ref(),
                _ => None,
            });
            let speeds: Vec<f64> = references.map(|speed| speed.value).collect();
            assert!(speeds.iter().all(|speed| *speed <= 1.2 + 1e-9), "the mission's limit: {speeds:?}");
            let is_start =
                |message: &&Message| matches!(message, Message::PlanControl(PlanControl { op: 0, .. }));
            seconds.push([speeds.len(), messages.iter().filter(is_start).count()]);
        }
        seconds
    }
}

#[tokio::test(start_paused = true)]
async fn references_are_sent_in_follow_reference_alone_and_an_operator_s_word_is_the_last() {
    let mut dune = Dune::begin(false, false);
    assert_eq!(dune.seconds(4, Some(SERVICE)).await, [[0, 0]; 4], "nobody has started it");
    assert_eq!(dune.seconds(5, Some(FOLLOWS)).await, [[2, 0]; 5]);
    assert_eq!(dune.seconds(5, Some((3, 450))).await, [[0, 0]; 5], "the operator started another plan");
    let mut dune = Dune::begin(true, false);
    let ordered = dune.seconds(3, Some(SERVICE)).await;
    assert_eq!(ordered, [[0, 1], [0, 0], [0, 1]], "every two seconds");
    assert_eq!(dune.seconds(5, Some(FOLLOWS)).await, [[2, 0]; 5]);
    assert_eq!(dune.seconds(9, Some(SERVICE)).await, [[0, 0]; 9], "it is not started again");
}

#[tokio::test(start_paused = true)]
async fn nothing_is_sent_three_seconds_after_the_craft_falls_silent_until_it_is_back() {
    let mut dune = Dune::begin(false, false);
    assert_eq!(dune.seconds(5, Some(FOLLOWS)).await, [[2, 0]; 5]);
    let silent = dune.seconds(9, None).await;
    assert_eq!(silent[3..], [[0, 0]; 6], "{silent:?}");
    let (_, line) = dune.second(None).await;
    assert!(line.starts_with("NOT STEERING"), "{line}");
    assert_eq!(dune.seconds(3, Some(SERVICE)).await, [[0, 0]; 3], "it has restarted");
    assert_eq!(dune.seconds(3, Some(FOLLOWS)).await[1..], [[2, 0]; 2]);
}

#[tokio::test(start_paused = true)]
async fn a_craft_on_raw_headings_is_stopped_for_a_second_when_references_end() {
    let mut dune = Dune::begin(false, true);
    let mut speeds = vec![];
    for second in 0..10 {
        dune.has_position = second < 5;
        let (messages, _) = dune.second(Some(EXTERNAL)).await;
        speeds.extend(messages.iter().filter_map(|message| match message {
            Message::DesiredSpeed(speed) => Some(speed.value),
            _ => None,
        }));
    }
    let stops = speeds.iter().rev().take_while(|speed| **speed == 0.0).count();
    assert!(40 < speeds.len() && stops == 10, "{speeds:?}");
}
