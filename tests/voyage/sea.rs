//! The boat with its autopilot, the AUV, and the wire to the bridge with its messages.

use std::f64::consts::TAU;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bridge::wire::Input;
use mavlink::{
    MavlinkReader,
    dialects::ardupilotmega::{MavCmd, MavMessage},
};
use nalgebra::Vector2;
use rand::{Rng as _, RngExt as _};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use super::imc::{self, Dune};
use super::ships::{self, Ship};
use super::{CLEAR_S, Wire, World, faults::Kind, lock, moos, planners, rng};
use crate::autopilot::{Boat, GUIDED, HOLD, SYSTEM, frame, place};

/// System number of the AUV.
pub(super) const AUV: u8 = 101;
/// Time between two steps of the boat, s.
const STEP_S: f64 = 0.1;
/// Steps of [`Boat::messages`] in one of these.
const STEPS: u64 = 5;
/// Speed of the AUV, m/s.
const AUV_SPEED: f64 = 0.5;
/// Time between two fixes of the AUV, s.
const FIX_S: f64 = 5.0;
/// Share of late steps in a voyage without faults, and the largest delay, s.
const LATE_STEPS: f64 = 0.1;
const LATE_MAX_S: f64 = 0.4;
/// Share of lost fixes, and σ of noisy ones along either axis, m, as the bridge assumes it.
const LOST_FIXES: f64 = 0.05;
const SIGMA_M: f64 = 1.0;
/// Longest delay of a bad wire, s.
const DELAY_MAX_S: f64 = 2.0;
/// Time after a bad wire during which old bytes may arrive, s.
const SETTLED_S: f64 = 8.0;
/// Speed above which a craft is under way, m/s.
const WAY: f64 = 0.45;
/// Longest way under references with a frozen position, m, at this speed or faster, m/s: the
/// bridge's 5.7 m and 0.3 m/s, and delays.
const FROZEN_M: f64 = 8.0;
const FROZEN_SPEED: f64 = 0.4;
/// Least time between two references to DUNE, s.
const IMC_INTERVAL_S: f64 = 0.45;
/// Offset of a second receiver (north, east), m.
const ELSEWHERE: [f64; 2] = [60.0, -45.0];

/// Limits of the mission.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_field_names, reason = "each is a maximum")]
pub(super) struct Limits {
    /// Speed, m/s.
    pub(super) speed_max: f64,
    /// Turn rate, rad/s.
    pub(super) turn_rate_max: f64,
    /// Acceleration, m/s².
    pub(super) acceleration_max: f64,
}

pub(super) struct Sea {
    world: Arc<World>,
    pub(super) limits: Limits,
    state: Mutex<State>,
}

struct State {
    rng: ChaCha8Rng,
    boat: Boat,
    /// Position (north, east), m, and course, rad, of the AUV.
    auv: (Vector2<f64>, f64),
    /// `stops`: it sometimes rests. `is_noisy`: its fixes err as they claim; else they are exact.
    stops: bool,
    is_noisy: bool,
    fix_due_s: f64,
    dune: Dune,
    ships: Vec<Ship>,
    /// Time since which the boat is steered without a fault, s.
    undisturbed_since_s: f64,
    step: u64,
    /// Newest text of the bridge to the ground station, and time of its last heartbeat, s.
    text: String,
    heartbeat_s: f64,
    /// Bytes for the boat, and their times of arrival, s.
    to_boat: Vec<(f64, Vec<u8>)>,
    /// Input of the bridge, while there is one, and whether its connection is new.
    input: Option<Input>,
    is_opened: bool,
    /// The reported position of the boat, while it is frozen.
    frozen: Option<Vector2<f64>>,
    /// Knowledge of the bridge, for claims.
    known: Known,
}

/// Knowledge of this process of the bridge.
#[derive(Default)]
struct Known {
    /// Time between two references, s.
    period_s: f64,
    heartbeat_left_s: Option<f64>,
    /// Time, s, and place at which the craft with a frozen position got under way.
    frozen_since: Option<(f64, Vector2<f64>)>,
    /// Time since which a person has the craft, s.
    unguided_since_s: Option<f64>,
    wire_bad_s: Option<f64>,
    plan_sequence: u64,
    plan_arrived_s: Option<f64>,
    paused_since_s: Option<f64>,
    /// Time, s, of the last reference and its speed, m/s; of the last one with a heading, rad.
    sent: Option<(f64, f64)>,
    headed: Option<(f64, f64)>,
    sent_s: f64,
    has_sent: bool,
}

/// The seed's boat: loops of the stand-in, without lags, or slow. Also `stops` and `is_noisy`.
fn hull_and_stops(seed: u64) -> (Boat, bool, bool) {
    let mut rng = rng(seed, 9);
    let mut time = || {
        if rng.random_bool(0.3) { 0.0 } else { rng.random_range(0.0..6.0) }
    };
    let mut boat = Boat::moored();
    (boat.heading_time, boat.speed_time) = (time(), time());
    boat.turn_rate_max = rng.random_range(0.3..2.0);
    (boat, rng.random_bool(0.5), rng.random_bool(0.5))
}

impl Sea {
    pub(super) fn new(world: &Arc<World>, seed: u64) -> Self {
        let (mut boat, stops, is_noisy) = hull_and_stops(seed);
        let wire = world.course.wire;
        // A helm is in DRIVE, and no craft but ArduPilot's is armed.
        boat.is_armed = wire != Wire::Mavlink;
        boat.watchdog_s = match wire {
            Wire::Mavlink => boat.watchdog_s,
            Wire::Moos => moos::watchdog_s(),
            // DUNE's supervisor ends the manoeuvre.
            Wire::Imc => f64::INFINITY,
        };
        if wire == Wire::Moos || world.course.is_dry && seed % 2 == 1 {
            (boat.mode, boat.is_armed) = (GUIDED, true);
        }
        let (mut draws, course) = (rng(seed, 4), world.course);
        let mut limits = Limits {
            speed_max: draws.random_range(0.9..2.5),
            turn_rate_max: draws.random_range(0.1..1.0),
            acceleration_max: draws.random_range(0.05..0.6),
        };
        let auv = (
            Vector2::new(draws.random_range(-20.0..20.0), draws.random_range(10.0..30.0)),
            draws.random_range(-3.0..3.0),
        );
        let meets = course.only.is_none() && !course.is_dry && wire != Wire::Moos;
        let ships = if meets {
            ships::drawn(&mut rng(seed, 10), seed, auv, AUV_SPEED, course.duration_s)
        } else {
            vec![]
        };
        if wire != Wire::Mavlink {
            // Only MAVLink tells that the boat makes no more.
            limits.speed_max = limits.speed_max.min(2.0);
        }
        Self {
            world: Arc::clone(world),
            limits,
            state: Mutex::new(State {
                boat,
                stops,
                is_noisy,
                auv,
                rng: draws,
                fix_due_s: 0.0,
                dune: Dune::default(),
                ships,
                undisturbed_since_s: 0.0,
                step: 0,
                text: String::new(),
                heartbeat_s: f64::NEG_INFINITY,
                to_boat: vec![],
                input: None,
                is_opened: false,
                frozen: None,
                known: Known::default(),
            }),
        }
    }

    /// Starts a bridge without knowledge, which sends a reference each `period_s`.
    pub(super) fn new_bridge(&self, mut period_s: f64) {
        if self.world.course.wire == Wire::Imc {
            period_s *= (IMC_INTERVAL_S / period_s).ceil();
        }
        let mut state = lock(&self.state);
        state.known = Known {
            period_s,
            unguided_since_s: state.known.unguided_since_s,
            wire_bad_s: state.known.wire_bad_s,
            sent_s: state.known.sent_s,
            ..Known::default()
        };
    }

    pub(super) fn connect(&self, input: Input) {
        let mut state = lock(&self.state);
        (state.input, state.is_opened) = (Some(input), self.world.course.wire == Wire::Moos);
    }

    pub(super) fn disconnect(&self) {
        lock(&self.state).input = None;
    }

    /// Begins or ends a fault of the boat, its equipment or the planner.
    pub(super) fn change(&self, kind: Kind, begins: bool) {
        let mut state = lock(&self.state);
        match kind {
            Kind::NoHeartbeat => state.boat.has_heartbeat = !begins,
            Kind::PositionUnknown => state.boat.has_position = !begins,
            Kind::TakenOver => state.boat.mode = if begins { HOLD } else { GUIDED },
            Kind::Disarmed => state.boat.is_armed = !begins,
            Kind::PositionFrozen => state.frozen = begins.then_some(state.boat.position),
            Kind::RudderStuck => state.boat.is_rudder_stuck = begins,
            Kind::LyingPlanner => planners::lie(begins),
            _ => {}
        }
    }

    /// Sails until the voyage ends.
    pub(super) async fn sail(self: Arc<Self>) {
        loop {
            let step_s = STEP_S + self.late_s();
            self.world.aboard.sleep(Duration::from_secs_f64(step_s)).await;
            let (input, pieces) = self.step(step_s);
            let Some(input) = input else { continue };
            let is_datagram = self.world.course.wire == Wire::Imc;
            for (delay_s, bytes) in pieces {
                if delay_s == 0.0 {
                    input.arrived(bytes, is_datagram).await;
                } else {
                    let (input, clock) = (input.clone(), self.world.aboard.clone());
                    tokio::spawn(async move {
                        clock.sleep(Duration::from_secs_f64(delay_s)).await;
                        input.arrived(bytes, is_datagram).await;
                    });
                }
            }
        }
    }

    /// Delay of the next step, s: sometimes above 0 without faults, like a busy computer's.
    fn late_s(&self) -> f64 {
        let rng = &mut lock(&self.state).rng;
        if self.world.course.is_nominal && rng.random_bool(LATE_STEPS) {
            rng.random_range(0.0..LATE_MAX_S)
        } else {
            0.0
        }
    }

    /// State of the ground station: newest text, and time since the bridge's last heartbeat, s.
    pub(super) fn ground_station(&self) -> (String, f64) {
        let state = lock(&self.state);
        (state.text.clone(), self.world.t_s() - state.heartbeat_s)
    }

    /// A step of boat and AUV: their messages, with delays, s.
    fn step(&self, step_s: f64) -> (Option<Input>, Vec<(f64, Vec<u8>)>) {
        let t_s = self.world.t_s();
        let still = Vector2::zeros();
        let mut state = lock(&self.state);
        let state = &mut *state;
        let (now, mut answers) = (self.world.now(), vec![]);
        let mut arrived: Vec<(f64, Vec<u8>)> = vec![];
        state.to_boat.retain_mut(|(at_s, bytes)| {
            let is_due = *at_s <= t_s;
            if is_due {
                arrived.push((*at_s, std::mem::take(bytes)));
            }
            !is_due
        });
        for (_, bytes) in arrived {
            for message in self.messages(&bytes, &mut state.dune) {
                state.boat.take(&message, t_s, &mut answers);
            }
        }
        if self.world.course.wire == Wire::Imc {
            let hands_back = !now.is_paused && !now.has(Kind::TakenOver) && state.input.is_some();
            state.dune.supervise(&mut state.boat, t_s, hands_back);
        }
        state.boat.step(t_s, step_s, &still);
        let (position, course) = &mut state.auv;
        *course += 0.02 * (0.05 * t_s).sin();
        let rests = state.stops && 130.0 < t_s % 200.0;
        let speed = if rests { 0.0 } else { AUV_SPEED };
        *position += speed * step_s * Vector2::new(course.cos(), course.sin());

        let mut shown = state.boat.clone();
        shown.position = state.frozen.unwrap_or(shown.position);
        let odd = state.step % 2 == 1;
        if now.has(Kind::PositionJumped) || (now.has(Kind::TwoReceivers) && odd) {
            shown.position += Vector2::from(ELSEWHERE);
        }
        if now.has(Kind::TwoCompasses) && odd {
            shown.heading += 2.0;
        }
        let mut said = shown.messages(STEPS * state.step, &still);
        said.append(&mut answers);
        let is_heartbeat = |message: &MavMessage| matches!(message, MavMessage::HEARTBEAT(_));
        let heartbeat = said.iter().any(is_heartbeat);
        let unix_s = self.world.aboard.unix_s();
        let wire = self.world.course.wire;
        said.extend(state.ships.iter_mut().filter_map(|ship| ship.says(t_s)));
        let mut bytes: Vec<u8> = match wire {
            Wire::Mavlink => said.iter().flat_map(|message| frame(SYSTEM, message)).collect(),
            Wire::Moos => moos::written(&shown, &said, unix_s),
            Wire::Imc => imc::written(&shown, &said, unix_s),
        };
        if state.fix_due_s <= t_s {
            state.fix_due_s = t_s + FIX_S;
            let is_lost = self.world.course.is_nominal && state.rng.random_bool(LOST_FIXES);
            if !now.has(Kind::AuvSilent) && !is_lost {
                let velocity = speed * Vector2::new(state.auv.1.cos(), state.auv.1.sin());
                let mut position = state.auv.0;
                if state.is_noisy && self.world.course.is_nominal {
                    position += normal(&mut state.rng) * SIGMA_M;
                }
                let place = place(&position, &velocity, None);
                bytes.extend(match wire {
                    Wire::Mavlink => frame(u32::from(AUV), &place),
                    Wire::Moos => moos::node_report("auv-1", &place, unix_s),
                    Wire::Imc => imc::auv(&place, unix_s),
                });
            }
        }
        state.step += 1;

        let is_bad = now.has(Kind::BadWire);
        if is_bad || now.has(Kind::WireCut) {
            state.known.wire_bad_s = Some(t_s);
        }
        if heartbeat && !now.has(Kind::WireCut) {
            state.known.heartbeat_left_s = Some(t_s);
        }
        let known = &mut state.known;
        let is_deceived = state.frozen.is_some() && WAY <= state.boat.speed;
        let here = (t_s, state.boat.position);
        known.frozen_since = is_deceived.then(|| known.frozen_since.unwrap_or(here));
        let is_ours = state.boat.mode == GUIDED && state.boat.is_armed;
        known.unguided_since_s = (!is_ours).then(|| known.unguided_since_s.unwrap_or(t_s));
        let is_cut = now.has(Kind::WireCut);
        let may_steer = !now.is_paused && !self.world.course.is_dry;
        let is_due = CLEAR_S <= now.quiet_s(t_s) && may_steer && state.input.is_some();
        let is_steered = is_ours && state.input.is_some() && t_s - state.known.sent_s < 3.0;
        if !is_steered || now.is_paused || !now.is_quiet() {
            state.undisturbed_since_s = t_s;
        }
        drop(now);
        self.check(state, t_s, is_due);
        let mut pieces = carried(bytes, is_bad, is_cut, wire, &mut state.rng);
        if wire == Wire::Imc {
            for (_, bytes) in &pieces {
                state.dune.tell(bytes);
            }
        }
        if !is_cut && std::mem::take(&mut state.is_opened) {
            pieces.insert(0, (0.0, vec![]));
        }
        (state.input.clone(), pieces)
    }

    /// Checks the boat of `state`, for which a reference may be due.
    fn check(&self, state: &State, t_s: f64, is_due: bool) {
        let boat = &state.boat;
        let (mode, armed) = (boat.mode, boat.is_armed);
        if state.step.is_multiple_of(10) && is_due {
            let silent_s = t_s - state.known.sent_s;
            self.world.claim("resumes", silent_s < 2.0, || {
                format!("no reference for {silent_s:.1} s; mode {mode}, armed {armed}")
            });
        }
        if state.step.is_multiple_of(10) {
            let silent_s = boat.referred_s().map_or(0.0, |at_s| t_s - at_s);
            let is_steered = boat.followed(t_s).is_some();
            self.world.claim("watchdog", !is_steered || silent_s <= 3.0, || {
                format!("it follows a reference of {silent_s:.1} s ago")
            });
            let steered_s = t_s - state.undisturbed_since_s;
            for clearance in
                state.ships.iter().filter_map(|ship| ship.clearance(t_s, &boat.position, steered_s))
            {
                self.world.claim("clear", 0.0 <= clearance, || {
                    format!("a vessel that keeps its course is {:.1} m too near", -clearance)
                });
            }
        }
        if state.step.is_multiple_of(100) {
            let (north, east, speed) = (boat.position.x, boat.position.y, boat.speed);
            let what = format!("boat at {north:.2}, {east:.2} m, {speed:.2} m/s, mode {mode}, armed {armed}");
            self.world.note("sea", what);
        }
    }

    /// Checks that the mission's log has the warning of a vessel that is not heard any more.
    pub(super) fn expect_told_of_silence(&self) {
        let (t_s, state) = (self.world.t_s(), lock(&self.state));
        if self.world.course.is_nominal && state.ships.iter().any(|ship| ship.is_missed(t_s)) {
            let is_told = self.world.checker().log.iter().any(|line| line == "vessel_stale");
            self.world.claim("silence", is_told, || "no warning of the silent vessel".to_owned());
        }
    }

    /// Takes and checks the messages of the bridge.
    pub(super) fn take(&self, bytes: &[u8]) {
        let t_s = self.world.t_s();
        let mut state = lock(&self.state);
        // The bridge closes the connection.
        state.is_opened |= bytes.is_empty();
        let meant = self.messages(bytes, &mut state.dune);
        for message in meant {
            match message {
                MavMessage::SET_POSITION_TARGET_LOCAL_NED(target) => {
                    let speed = f64::from(target.vx.hypot(target.vy));
                    self.check_reference(t_s, speed, f64::from(target.yaw), &mut state);
                }
                MavMessage::STATUSTEXT(said) => {
                    let text = said.text.to_str().unwrap_or_default();
                    self.world.note("bridge", format!("says {text}"));
                    if let Some(more) = text.strip_prefix("... ") {
                        state.text = format!("{} {more}", state.text);
                    } else {
                        text.clone_into(&mut state.text);
                    }
                }
                MavMessage::HEARTBEAT(_) => state.heartbeat_s = t_s,
                MavMessage::COMMAND_LONG(order) if is_order(order.command) => {
                    self.world.note("bridge", format!("orders {:?}", order.command));
                    let has_sent = state.known.has_sent;
                    self.world.claim("orders", !has_sent, || "after the first reference".to_owned());
                }
                _ => {}
            }
        }
        let (is_bad, is_cut) = {
            let now = self.world.now();
            (now.has(Kind::BadWire), now.has(Kind::WireCut))
        };
        let state = &mut *state;
        let wire = self.world.course.wire;
        // The stand-in of a database reads whole packets.
        let is_bad = is_bad && wire != Wire::Moos;
        let pieces = carried(bytes.to_vec(), is_bad, is_cut, wire, &mut state.rng);
        state.to_boat.extend(pieces.into_iter().map(|(delay_s, bytes)| (t_s + delay_s, bytes)));
    }

    /// The whole messages in `bytes`.
    fn messages(&self, bytes: &[u8], dune: &mut Dune) -> Vec<MavMessage> {
        match self.world.course.wire {
            Wire::Mavlink => {}
            Wire::Moos => return moos::messages(bytes),
            Wire::Imc => return dune.messages(bytes),
        }
        let mut reader = MavlinkReader::new(bytes);
        let mut all = vec![];
        while let Ok((_, message)) = reader.read_any_message::<MavMessage>() {
            all.push(message);
        }
        all
    }

    fn check_reference(&self, t_s: f64, speed: f64, heading: f64, state: &mut State) {
        let (world, known) = (&self.world, &mut state.known);
        world.note("bridge", format!("reference {speed:.3} m/s, {heading:.3} rad"));
        let Limits { speed_max, turn_rate_max, acceleration_max } = self.limits;
        // `autopilot` has limits of its own, which MAVLink tells: 2 m/s, 1 m/s², 120°/s.
        let told = if world.course.wire == Wire::Mavlink { [2.0, 1.0] } else { [f64::INFINITY; 2] };
        let (speed_max, acceleration_max) = (speed_max.min(told[0]), acceleration_max.min(told[1]));
        world.claim("limits", speed.is_finite() && heading.is_finite() && speed <= speed_max + 1e-4, || {
            format!("{speed} m/s, at most {speed_max} are allowed")
        });
        if let Some((before_s, before_speed)) = known.sent
            && t_s - before_s <= 3.0
        {
            let elapsed = t_s - before_s;
            let off = (elapsed - known.period_s).abs();
            world.claim("rate", !world.course.is_nominal || off <= 1.1e-3, || {
                format!("{elapsed:.4} s after the last one, every {:.1} s is expected", known.period_s)
            });
            let rise = speed - before_speed;
            // DUNE is stopped by a place, so that it holds no slower speeds than this.
            let rounded = if world.course.wire == Wire::Imc { 0.05 } else { 1e-4 };
            world.claim("limits", rise <= 4.0 * acceleration_max * elapsed + rounded, || {
                format!("{rise:.4} m/s faster after {elapsed:.3} s, with {acceleration_max} m/s²")
            });
        }
        if let Some((before_s, before_heading)) = known.headed
            && t_s - before_s <= 3.0
        {
            let elapsed = t_s - before_s;
            let turn = (heading - before_heading).sin().atan2((heading - before_heading).cos()).abs();
            world.claim("limits", turn <= turn_rate_max * elapsed + 1e-4, || {
                format!(
                    "a turn of {turn:.4} rad in {elapsed:.3} s, at most {turn_rate_max} rad/s are allowed"
                )
            });
        }
        // A stop of DUNE has no direction.
        if world.course.wire != Wire::Imc || 0.0 < speed {
            known.headed = Some((t_s, heading));
        }
        known.sent = Some((t_s, speed));
        (known.sent_s, known.has_sent) = (t_s, true);

        // A bad wire delivers old heartbeats and loses new ones.
        let is_clean = known.wire_bad_s.is_none_or(|bad_s| SETTLED_S < t_s - bad_s);
        let late = if is_clean { 0.3 } else { DELAY_MAX_S + 0.3 };
        let age = known.heartbeat_left_s.map_or(f64::INFINITY, |left_s| t_s - left_s);
        world.claim("heartbeat", age <= 3.0 + late, || format!("the last one left {age:.2} s ago"));
        let unguided = known.unguided_since_s.map_or(0.0, |since_s| t_s - since_s);
        let most = if is_clean { 1.4 } else { 3.0 + late + 1.0 };
        world.claim("guided", unguided <= most, || {
            format!("the craft has been a person's for {unguided:.2} s")
        });
        let age = known.plan_arrived_s.map_or(f64::INFINITY, |arrived_s| t_s - arrived_s);
        world.claim("plan age", age <= 10.2, || format!("the newest plan came {age:.2} s ago"));
        let paused = known.paused_since_s.map_or(0.0, |since_s| t_s - since_s);
        world.claim("paused", paused <= 0.6, || {
            format!("the service said {paused:.2} s ago that it is paused")
        });
        let now = world.now();
        let lasts = |kind| now.since_s(kind).map_or(0.0, |since_s| t_s - since_s);
        let unknown = lasts(Kind::PositionUnknown);
        let (way_m, way_max_m) = known.frozen_since.map_or((0.0, FROZEN_M), |(since_s, from)| {
            let way_max_m = FROZEN_M.max(FROZEN_SPEED * (t_s - since_s));
            ((state.boat.position - from).norm(), way_max_m)
        });
        let doubts = [
            ("positions", lasts(Kind::TwoReceivers), 8.0),
            ("headings", lasts(Kind::TwoCompasses), 8.0),
            ("a position that stays", way_m, way_max_m),
        ];
        let doubt = doubts.into_iter().find(|(_, found, most)| most < found);
        drop(now);
        // On a MOOSDB it just ceases.
        let most = if world.course.wire == Wire::Moos { 3.4 } else { 1.4 };
        world.claim("position", !is_clean || unknown <= most, || {
            format!("it has been unknown for {unknown:.2} s")
        });
        world.claim("doubts", !is_clean || doubt.is_none(), || format!("{doubt:?}"));
    }

    /// Notes an answer to the bridge.
    pub(super) fn heard_from_service(&self, path: &str, status: u16, body: &[u8]) {
        if !path.contains("/reference") || status != 200 {
            return;
        }
        let Ok(answer) = serde_json::from_slice::<Value>(body) else { return };
        let t_s = self.world.t_s();
        let known = &mut lock(&self.state).known;
        let sequence = answer["sequence"].as_u64().unwrap_or(0);
        if known.plan_sequence < sequence {
            (known.plan_sequence, known.plan_arrived_s) = (sequence, Some(t_s));
        }
        let is_running = answer["status"] == "running";
        known.paused_since_s = (!is_running).then(|| known.paused_since_s.unwrap_or(t_s));
    }
}

/// Two numbers of standard deviation 1, by Box and Muller.
fn normal(rng: &mut ChaCha8Rng) -> Vector2<f64> {
    let (length, turn) = (1.0 - rng.random::<f64>(), rng.random_range(0.0..TAU));
    (-2.0 * length.ln()).sqrt() * Vector2::new(turn.cos(), turn.sin())
}

fn is_order(command: MavCmd) -> bool {
    matches!(command, MavCmd::MAV_CMD_DO_SET_MODE | MavCmd::MAV_CMD_COMPONENT_ARM_DISARM)
}

/// The pieces of `bytes` after the wire, with their delays, s.
fn carried(
    mut bytes: Vec<u8>,
    is_bad: bool,
    is_cut: bool,
    wire: Wire,
    rng: &mut ChaCha8Rng,
) -> Vec<(f64, Vec<u8>)> {
    if is_cut || bytes.is_empty() {
        return vec![];
    }
    if !is_bad {
        return vec![(0.0, bytes)];
    }
    if wire == Wire::Moos {
        // TCP loses and damages nothing, and a packet may come in pieces.
        let rest = bytes.split_off(rng.random_range(0..bytes.len()));
        return [bytes, rest]
            .into_iter()
            .filter(|piece| !piece.is_empty())
            .map(|piece| (0.0, piece))
            .collect();
    }
    if rng.random_bool(0.2) {
        return vec![];
    }
    if rng.random_bool(0.1) {
        bytes.truncate(rng.random_range(0..bytes.len()));
    }
    if rng.random_bool(0.1) && !bytes.is_empty() {
        let place = rng.random_range(0..bytes.len());
        bytes[place] ^= 1 << (rng.next_u32() % 8);
    }
    let mut late = || {
        // On a network there are no modems that keep bytes.
        if wire == Wire::Mavlink && rng.random_bool(0.5) { rng.random_range(0.001..DELAY_MAX_S) } else { 0.0 }
    };
    let mut pieces = vec![(late(), bytes.clone())];
    if rng.random_bool(0.1) {
        pieces.push((rng.random_range(0.001..DELAY_MAX_S), bytes));
    }
    pieces
}
