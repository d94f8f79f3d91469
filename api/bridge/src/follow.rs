//! The loop of a bridge to an autopilot: what the wires tell goes to the mission, and the mission's plan to the craft.
//!
//! ```text
//! autopilot, modems, receivers ─ bytes → adapters → measurements → craft's state, fixes ─→ mission (HTTP, threads of their own)
//! autopilot ← frames ← authority ← reference, ten times a second, along the newest plan ←──┘
//! ```
//! Sent is only what [`Authority`] allows. Whatever stops, the autopilot's own time-out stops the craft, and the mission's log says
//! why.

use std::{
    collections::BTreeMap,
    fmt,
    sync::mpsc::{Receiver, RecvTimeoutError, sync_channel},
    time::{Duration, Instant},
};

use serde_json::Value;
use sha2::{Digest as _, Sha256};

use crate::{
    AuvFix, CraftState, Measurement, Refused,
    acoustics::{CraftPose, KnownDepth, Modem, PoseHistory},
    clock::Clock,
    helm::{Helm, HelmSettings},
    mavlink::{Action, Authority, Conditions, Contradiction, Control, Heard, Parameters, Silence},
    mission::Missions,
    mission_link::{Keeping, LinkNow, MissionLink, Which},
    nmea::NmeaReader,
    plan::PlanNow,
    reference::Reference,
    setup::complete,
    wire::{Endpoint, Received, Wire},
};

mod line;

/// What a bridge is told.
#[derive(Debug)]
pub struct Settings {
    /// Wires with NMEA 0183 of the craft.
    pub nmea: Vec<Endpoint>,
    /// Acoustic modems, each with its wire.
    pub modems: Vec<(Endpoint, Modem)>,
    /// References a second.
    pub rate_hz: f64,
    /// Time between two posts.
    pub report_interval: Duration,
    /// Standard deviation of fixes that say nothing of their accuracy, m.
    pub sigma_m: f64,
    /// Whether the guided mode may be ordered and the motors switched on.
    pub take_control: bool,
    /// Whether the craft follows what line of sight would do, to compare with, and not the plan.
    pub line_of_sight: bool,
    /// Whether references are printed and not sent.
    pub dry_run: bool,
}

impl Default for Settings {
    /// Ten references a second, and nothing ordered.
    fn default() -> Self {
        Self {
            nmea: vec![],
            modems: vec![],
            rate_hz: 10.0,
            report_interval: Duration::from_millis(200),
            sigma_m: 1.0,
            take_control: false,
            line_of_sight: false,
            dry_run: false,
        }
    }
}

/// A mission to be kept: joined, or made with what is known of the craft by then.
#[derive(Debug)]
pub enum Mission {
    /// This one, which is there.
    Joined(String),
    /// The one of this name, or a new one of this body, in which the autopilot's limits are completed.
    Named(String, Value),
}

/// A mission that cannot be kept, and why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the mission cannot be kept: {0}")]
pub struct NoMission(String);

/// What has been seen so far.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// What the autopilot said of its parameters.
    pub parameters: Parameters,
    /// The craft.
    pub craft: CraftState,
    /// Whether the autopilot knows its position, where it says so.
    pub position_known: Option<bool>,
    /// By how much the autopilot's clock is ahead of this machine's, s.
    pub clock_ahead_s: Option<f64>,
    /// The newest fix of each AUV, when it came, s, and how many came.
    pub fixes: BTreeMap<String, (AuvFix, f64, u64)>,
    /// References sent.
    pub sent: u64,
}

/// What a bridge has said of its references.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Said {
    Nothing,
    /// Why none are sent.
    Silent(Silence),
    Sending,
}

/// A bridge at work.
pub struct Bridge {
    settings: Settings,
    clock: Clock,
    helm: Helm,
    received: Receiver<Received>,
    nmea: Vec<NmeaReader>,
    poses: PoseHistory,
    tilt: [f64; 2],
    authority: Authority,
    seen: Seen,
    link: Option<MissionLink>,
    /// The fastest that the mission was told to go, m/s.
    speed_max: Option<f64>,
    /// When the autopilot was heard first.
    met_s: Option<f64>,
    reported_s: f64,
    /// What was said last of why nothing is sent, or that something is.
    said: Said,
    is_steering: bool,
    trouble: Option<String>,
    last_second: u64,
    _others: Vec<Wire>,
}

/// Pieces that wait for the loop at most.
const PIECES_MAX: usize = 1024;
/// A piece without anything to wait for is asked for so often, for what has sockets of its own.
const POLL_INTERVAL: Duration = Duration::from_millis(10);
/// How long parameters are waited for after the first heartbeat, s.
const PARAMETERS_WAIT_S: f64 = 5.0;
/// Between two lines about how it goes, s.
const LINE_INTERVAL_S: u64 = 5;
/// Standard deviation of a depth that an AUV tells: its pressure gauge is better, and its message some seconds old, m.
const DEPTH_SIGMA_M: f64 = 0.5;
/// A position older than this is no state to report, s.
const REPORT_AGE_MAX_S: f64 = 2.0;

impl fmt::Debug for Bridge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bridge")
            .field("settings", &self.settings)
            .field("seen", &self.seen)
            .finish_non_exhaustive()
    }
}

impl Bridge {
    /// Opens the helm and the wires.
    #[must_use]
    pub fn open(helm: HelmSettings, settings: Settings) -> Self {
        let (sender, received) = sync_channel(PIECES_MAX);
        let helm = Helm::open(helm, &sender);
        let endpoints = settings
            .nmea
            .iter()
            .chain(settings.modems.iter().map(|(endpoint, _)| endpoint));
        let others = endpoints
            .enumerate()
            .map(|(index, endpoint)| Wire::open(endpoint.clone(), 1 + index, sender.clone()))
            .collect();
        Self {
            clock: Clock::start(),
            helm,
            received,
            nmea: settings.nmea.iter().map(|_| NmeaReader::default()).collect(),
            poses: PoseHistory::default(),
            tilt: [0.0; 2],
            authority: Authority::new(settings.take_control),
            seen: Seen::default(),
            link: None,
            speed_max: None,
            met_s: None,
            reported_s: f64::NEG_INFINITY,
            said: Said::Nothing,
            is_steering: false,
            trouble: None,
            last_second: 0,
            _others: others,
            settings,
        }
    }

    /// What has been seen so far.
    #[must_use]
    pub fn seen(&self) -> &Seen {
        &self.seen
    }

    /// The autopilot's parameters that do not go with references from here.
    #[must_use]
    pub fn contradictions(&self) -> Vec<Contradiction> {
        self.seen.parameters.contradictions(self.speed_max.unwrap_or(0.0))
    }

    /// s since the bridge's start.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.clock.now_s()
    }

    /// Who has the craft, as far as the helm tells.
    #[must_use]
    pub fn control(&self) -> Control {
        self.helm.control(self.now_s())
    }

    /// What is known of the mission; nothing before [`Bridge::keep`].
    #[must_use]
    pub fn link(&self) -> LinkNow {
        self.link.as_ref().map(MissionLink::now).unwrap_or_default()
    }

    /// What the wires said that was not understood.
    pub fn refused(&self) -> impl Iterator<Item = &Refused> {
        let modems = self.settings.modems.iter().map(|(_, modem)| modem.refused());
        [self.helm.refused()]
            .into_iter()
            .chain(self.nmea.iter().map(NmeaReader::refused))
            .chain(modems)
    }

    /// Waits for the craft, as long as `patience`: for its autopilot and that one's parameters, where the helm tells, else for its
    /// state. Answers whether it was heard.
    pub fn meet(&mut self, patience: Duration) -> bool {
        let end = Instant::now() + patience;
        let mut asked_s = f64::NEG_INFINITY;
        while Instant::now() < end {
            self.listen(Duration::from_millis(100));
            let now = self.now_s();
            let first_heard = match self.helm.control(now) {
                Control::Reported(heard) => heard.map(|_| *self.met_s.get_or_insert(now)),
                Control::Unreported if self.seen.craft.newest().is_some() => return true,
                Control::Unreported => None,
            };
            let Some(heard_s) = first_heard else {
                if now - asked_s > 1.0 {
                    asked_s = now;
                    // A wire that waits to be spoken to answers only then.
                    self.helm.live();
                }
                continue;
            };
            if self.seen.parameters.missing().next().is_none() || now - heard_s > PARAMETERS_WAIT_S {
                return true;
            }
            if now - asked_s > 1.0 {
                asked_s = now;
                self.helm.ask(&self.seen.parameters);
            }
        }
        self.met_s.is_some()
    }

    /// Keeps a mission from now on.
    pub fn keep(&mut self, missions: Missions, mission: Mission) {
        let which = match mission {
            Mission::Joined(id) => Which::Joined(id),
            Mission::Named(name, mut setup) => {
                let wanted = hex::encode(Sha256::digest(setup.to_string()));
                self.speed_max = setup["live"]["limits"]["speed_max_mps"].as_f64();
                let is_autopilot = matches!(self.helm.control(0.0), Control::Reported(_));
                complete(&mut setup, &self.seen.parameters, is_autopilot);
                Which::Named {
                    name,
                    wanted,
                    body: setup,
                }
            }
        };
        let keeping = Keeping {
            interval: self.settings.report_interval,
            sigma_m: self.settings.sigma_m,
            clock: self.clock,
        };
        self.link = Some(MissionLink::keep(missions, which, keeping));
    }

    /// Follows the mission's plans until it is over, or for as long as `limit`. Fails if there can be no such mission.
    pub fn run(&mut self, limit: Option<Duration>) -> Result<(), NoMission> {
        let end = limit.map(|limit| Instant::now() + limit);
        let interval = Duration::from_secs_f64(1.0 / self.settings.rate_hz);
        let mut due = Instant::now();
        while end.is_none_or(|end| Instant::now() < end) {
            self.listen(due.saturating_duration_since(Instant::now()));
            if Instant::now() < due {
                continue;
            }
            // A tick that was missed is not made up for.
            due = (due + interval).max(Instant::now());
            let link = self.link();
            self.tick(&link);
            if link.is_over {
                tracing::info!("the mission is over");
                return Ok(());
            }
            if let (true, Some(trouble)) = (link.hopeless, link.trouble) {
                return Err(NoMission(trouble));
            }
        }
        Ok(())
    }

    /// Takes what comes within `patience`.
    fn listen(&mut self, patience: Duration) {
        let end = Instant::now() + patience;
        loop {
            #[cfg(feature = "ros2")]
            self.poll();
            let left = end.saturating_duration_since(Instant::now());
            match self.received.recv_timeout(left.min(POLL_INTERVAL)) {
                Ok(piece) => {
                    self.take(&piece);
                    // A wire that never pauses must not cost the craft its references.
                    if Instant::now() >= end {
                        return;
                    }
                }
                Err(RecvTimeoutError::Timeout) if left > POLL_INTERVAL => {}
                Err(RecvTimeoutError::Timeout) => return,
                // No helm has a wire here.
                Err(RecvTimeoutError::Disconnected) => {
                    std::thread::sleep(left.min(POLL_INTERVAL));
                    if left.is_zero() {
                        return;
                    }
                }
            }
        }
    }

    /// Takes what a helm with sockets of its own has heard.
    #[cfg(feature = "ros2")]
    fn poll(&mut self) {
        let now = self.now_s();
        let unix_s = self.clock.unix_s(now);
        for heard in self.helm.poll(unix_s) {
            self.hear(heard, now, unix_s);
        }
    }

    fn take(&mut self, piece: &Received) {
        let t_s = self.clock.at_s(piece.at);
        let unix_s = self.clock.unix_s(t_s);
        let nmea = self.settings.nmea.len();
        match piece.wire.checked_sub(1) {
            None => {
                for heard in self.helm.push(piece, t_s, unix_s) {
                    self.hear(heard, t_s, unix_s);
                }
            }
            Some(index) if index < nmea => {
                let mut heard = self.nmea[index].push(&piece.bytes, unix_s);
                if piece.is_datagram {
                    // A datagram ends a sentence, with or without the end of a line.
                    heard.extend(self.nmea[index].push(b"\r\n", unix_s));
                }
                for measurement in heard {
                    self.measure(measurement, t_s, unix_s);
                }
            }
            Some(index) => {
                let (_, modem) = &mut self.settings.modems[index - nmea];
                for fix in modem.push(&piece.bytes, unix_s, &self.poses) {
                    self.measure(Measurement::Auv(fix), t_s, unix_s);
                }
            }
        }
    }

    fn hear(&mut self, heard: Heard, t_s: f64, unix_s: f64) {
        match heard {
            Heard::Measured(measurement) => {
                if let Measurement::Auv(fix) = &measurement {
                    self.note_depth(fix);
                }
                self.measure(measurement, t_s, unix_s);
            }
            Heard::Parameter { name, value } => self.seen.parameters.note(&name, value),
            Heard::Text(said) => tracing::info!("autopilot: {said}"),
            Heard::Acknowledged {
                command,
                is_accepted: false,
            } => {
                tracing::warn!(command, "the autopilot did not carry a command out");
            }
            // Of heartbeats the helm keeps what they say.
            Heard::Acknowledged { .. } | Heard::Heartbeat(_) => {}
            Heard::PositionKnown(known) => self.seen.position_known = Some(known),
            Heard::Time(autopilot_s) => self.seen.clock_ahead_s = Some(autopilot_s - unix_s),
            Heard::Attitude { roll, pitch } => self.tilt = [roll, pitch],
        }
    }

    /// Lets modems that measure angles alone know how deep an AUV says that it is. A modem's own fix tells no new depth.
    fn note_depth(&mut self, fix: &AuvFix) {
        let Some(depth_m) = fix.depth_m else { return };
        let known = KnownDepth {
            t_s: fix.t_s,
            depth_m,
            sigma_m: DEPTH_SIGMA_M,
        };
        for (_, modem) in &mut self.settings.modems {
            modem.note_depth(&fix.auv, known);
        }
    }

    fn measure(&mut self, measurement: Measurement, t_s: f64, unix_s: f64) {
        match measurement {
            Measurement::Craft {
                t_s: measured_s,
                measured,
            } => {
                // By the bridge's clock, which is never set.
                self.seen.craft.take(t_s - (unix_s - measured_s), &measured);
                if let Some(state) = self.seen.craft.newest() {
                    let [roll, pitch] = self.tilt;
                    let pose = CraftPose {
                        position: state.position,
                        heading: state.heading,
                        roll,
                        pitch,
                    };
                    self.poses.push(self.clock.unix_s(state.t_s), pose);
                }
            }
            Measurement::Auv(fix) => {
                if let Some(link) = &self.link {
                    link.report_auv(&fix);
                }
                let count = self.seen.fixes.get(&fix.auv).map_or(0, |(_, _, count)| *count);
                self.seen.fixes.insert(fix.auv.clone(), (fix, t_s, count + 1));
            }
        }
    }

    fn tick(&mut self, link: &LinkNow) {
        let now = self.now_s();
        let second = Duration::from_secs_f64(now).as_secs();
        if second != self.last_second {
            self.last_second = second;
            self.each_second(second, link);
        }
        let state = self
            .seen
            .craft
            .newest()
            .filter(|_| self.seen.position_known != Some(false));
        if let (Some(state), Some(kept)) = (&state, &self.link)
            && state.t_s > self.reported_s
            && now - state.t_s <= REPORT_AGE_MAX_S
        {
            self.reported_s = state.t_s;
            kept.report_craft(state, self.is_steering);
        }
        let known = Conditions {
            control: self.helm.control(now),
            state_age: state.map(|state| now - state.t_s),
            reference: link.plan.as_ref().and_then(|plan| self.reference(plan, now)),
            has_planned: link.plan.is_some(),
            is_held: link.is_held,
        };
        let action = self.authority.decide(now, &known);
        let is_the_plan = !self.settings.dry_run && !self.settings.line_of_sight;
        self.is_steering = matches!(action, Action::Send(_)) && is_the_plan;
        match action {
            Action::Send(reference) => {
                self.say(Said::Sending);
                self.send(&reference, link, now);
            }
            Action::Offer(reference) => {
                self.say(Said::Silent(Silence::NotGuided));
                self.send(&reference, link, now);
            }
            Action::Silent(silence) => self.say(Said::Silent(silence)),
            Action::OrderGuided(autopilot) => {
                if !self.settings.dry_run {
                    self.log("the guided mode is ordered (--take-control)");
                    self.helm.order_guided(autopilot);
                }
            }
            Action::OrderArm => {
                if !self.settings.dry_run {
                    self.log("the motors are switched on (--take-control)");
                    self.helm.order_arm();
                }
            }
        }
    }

    /// What to send by `plan` at `now`.
    fn reference(&self, plan: &PlanNow, now: f64) -> Option<Reference> {
        let planned = plan.planned.at(now)?;
        Some(if self.settings.line_of_sight {
            plan.line_of_sight
        } else {
            planned
        })
    }

    fn send(&mut self, reference: &Reference, link: &LinkNow, now: f64) {
        let Some(plan) = link.plan.as_ref().filter(|_| !self.settings.dry_run) else {
            return;
        };
        let ahead = self.clock.unix_s(now) - now;
        self.helm.send(reference, &plan.planned, now, ahead);
        self.seen.sent += 1;
    }

    fn each_second(&mut self, second: u64, link: &LinkNow) {
        self.helm.live();
        if second.is_multiple_of(LINE_INTERVAL_S) {
            // An autopilot that was started again has forgotten what it was asked for.
            self.helm.ask(&self.seen.parameters);
            tracing::info!("{}", self.line(link));
        }
        if link.trouble != self.trouble {
            match &link.trouble {
                Some(trouble) => self.log(&format!("the service does not answer: {trouble}")),
                None => self.log("the service answers again"),
            }
            self.trouble.clone_from(&link.trouble);
        }
    }

    /// Says once why nothing is sent, or that references are sent again.
    fn say(&mut self, said: Said) {
        if self.said == said {
            return;
        }
        self.said = said;
        match said {
            Said::Nothing => {}
            Said::Silent(silence) => self.log(&silence.to_string()),
            Said::Sending if self.settings.dry_run => self.log("references would be sent: this is a dry run"),
            Said::Sending => self.log("references are sent"),
        }
    }

    /// Writes to the log of the program and of the mission.
    fn log(&self, text: &str) {
        tracing::info!("{text}");
        if let Some(link) = &self.link {
            link.note(self.now_s(), text);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::mpsc, thread};

    use super::*;

    #[test]
    fn a_wire_that_never_pauses_does_not_hold_the_loop_up() {
        let (sender, received) = sync_channel(PIECES_MAX);
        thread::spawn(move || {
            let noise = Received {
                wire: 0,
                // Longer to read than to send again, so that the channel is never empty.
                bytes: b"$HEHDT,1.0,T*00\r\n".repeat(4096),
                is_datagram: false,
                at: Instant::now(),
            };
            while sender.send(noise.clone()).is_ok() {}
        });
        let (done, listened) = mpsc::channel();
        thread::spawn(move || {
            let connect = Endpoint::Udp("127.0.0.1:0".to_owned());
            let mut bridge = Bridge::open(HelmSettings::Nmea { connect }, Settings::default());
            bridge.received = received;
            bridge.listen(Duration::from_millis(50));
            done.send(())
        });
        // A hundred times as long as was asked for: the machine may be busy.
        let patience = Duration::from_secs(5);
        listened.recv_timeout(patience).expect("the loop goes on");
    }
}
