//! The loop of a bridge, from measurements to the mission and from its plan to the craft.
//!
//! ```text
//! autopilot, modems, sensors ─ bytes → adapters → measurements → state, fixes ─→ mission (HTTP)
//! autopilot ← frames ← output limiter ← authority ← reference, ten times a second ← plan ←─┘
//! ```
//! The bridge sends only what `Authority` allows. If any part stops, the autopilot's own time-out
//! stops the craft, and the mission's log has the reason.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque, btree_map::Entry},
    fmt,
    time::{Duration, Instant},
};

use ::mavlink::dialects::ardupilotmega::MavSeverity;
use clock::Clock;
use tokio::sync::mpsc::{Receiver, channel};

use crate::{
    Alarm, AuvFix, CraftState, Geographic, MeasuredState, Measurement, Rejects, Source,
    acoustics::{CraftPose, KnownDepth, Modem, PoseHistory},
    autopilot_link::{AutopilotLink, AutopilotSettings, read_nmea},
    bridge_clock::BridgeClock,
    confirmation::Confirmation,
    mavlink::{Action, Authority, AutopilotEvent, Conditions, Contradiction, Control, Parameters, Silence},
    mission_client::MissionClient,
    mission_link::{LinkStatus, MissionChoice, MissionLink},
    mission_setup::{Settling, complete, needs_origin},
    nmea::NmeaReader,
    output_limiter::{OutputLimiter, OutputLimits},
    plan::Plan,
    reference::Reference,
    wire::{Endpoint, Input, Output, Received},
};

mod status_line;
mod steering;

use steering::{Steering, lines};

/// Settings of a bridge.
#[derive(Debug)]
pub struct Settings {
    /// Wires with NMEA 0183 of the craft.
    pub nmea: Vec<Endpoint>,
    /// Acoustic modems with their wires.
    pub modems: Vec<(Endpoint, Modem)>,
    /// References per second.
    pub rate_hz: f64,
    /// Time between two reports to the service.
    pub report_interval: Duration,
    /// Standard deviation of fixes that state none, m.
    pub sigma_m: f64,
    /// `true` if the bridge may order the guided mode and arm the craft.
    pub take_control: bool,
    /// `true` if the craft follows line of sight instead of the plan, for comparison.
    pub line_of_sight: bool,
    /// `true` if references are logged and not sent.
    pub dry_run: bool,
}

impl Default for Settings {
    /// Ten references per second, and no orders.
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

/// The mission cannot be joined or created.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the mission cannot be followed: {0}")]
pub struct MissionError(String);

/// The bridge's received data.
#[derive(Clone, Debug, Default)]
pub(crate) struct Telemetry {
    pub(crate) parameters: Parameters,
    pub(crate) craft: CraftState,
    /// `true` if the autopilot knows its position; `None` if it does not report that.
    pub(crate) position_known: Option<bool>,
    /// Lead of the autopilot's clock over this machine's, s.
    pub(crate) clock_ahead_s: Option<f64>,
    /// All alarms of the craft's navigation so far.
    pub(crate) alarms_seen: BTreeSet<Alarm>,
    /// Number of pieces from each wire: the autopilot's, those of `nmea`, then those of the modems.
    pub(crate) pieces: Vec<u64>,
    /// The fixes of each AUV.
    pub(crate) fixes: BTreeMap<String, Fixes>,
}

/// The fixes of an AUV.
#[derive(Clone, Debug)]
pub(crate) struct Fixes {
    pub(crate) newest: AuvFix,
    /// Time of its arrival, s.
    pub(crate) at_s: f64,
    pub(crate) count: u64,
    /// The last times between two fixes, s.
    intervals: VecDeque<f64>,
}

impl Fixes {
    fn take(&mut self, fix: AuvFix, t_s: f64) {
        self.intervals.push_back(t_s - self.at_s);
        if self.intervals.len() > INTERVALS {
            self.intervals.pop_front();
        }
        (self.newest, self.at_s, self.count) = (fix, t_s, self.count + 1);
    }

    /// `true` if a fix should have come by `now`, s: after the longest of the last intervals, since
    /// a modem often loses some. The first fixes set no expectation.
    fn is_overdue(&self, now: f64) -> bool {
        let usual = self.intervals.iter().copied().fold(0.0, f64::max);
        self.intervals.len() >= INTERVALS_MIN && now - self.at_s > usual + OVERDUE_S
    }
}

/// The bridge's use of references.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sending {
    Active,
    Stopped(Silence),
}

/// A running bridge.
pub struct Bridge {
    settings: Settings,
    clock: BridgeClock,
    autopilot: AutopilotLink,
    received: Receiver<Received>,
    nmea: Vec<NmeaReader>,
    poses: PoseHistory,
    /// Roll and pitch, rad.
    tilt: [f64; 2],
    authority: Authority,
    limiter: OutputLimiter,
    /// Limits that the body of the new mission states; none for a mission that the bridge joins.
    limits: Option<OutputLimits>,
    telemetry: Telemetry,
    settling: Settling,
    /// The alarms that were logged last.
    alarms: BTreeSet<Alarm>,
    link: Option<MissionLink>,
    /// The mission's speed limit, m/s.
    speed_max: Option<f64>,
    /// Time when the autopilot was first heard.
    met_s: Option<f64>,
    reported_s: f64,
    /// The last logged use of references.
    logged: Option<Sending>,
    /// The state of the steering and its beginning, s.
    steering: Option<(Steering, f64)>,
    /// Time since which the state differs from the ground station's, s.
    untold_s: Option<f64>,
    /// The state that the ground station was last told, and that time, s.
    told: Option<(Steering, f64)>,
    /// The state and reason that the mission was last told, and that time, s.
    said: Option<((&'static str, String), f64)>,
    /// `true` once there was a plan.
    has_planned: bool,
    is_steering: bool,
    /// The craft's observed motion since references are sent.
    confirmation: Option<Confirmation>,
    trouble: Option<String>,
    /// The state of the last second, and `true` if it was good.
    shown: Option<(&'static str, bool)>,
    last_second: u64,
}

/// Number of the autopilot's wire.
const AUTOPILOT_WIRE: usize = 0;
/// Pieces that may wait for the loop.
const PIECES_MAX: usize = 1024;
/// Time of reading bytes between two looks at the result.
const LISTEN: Duration = Duration::from_millis(100);
/// Longest wait for parameters after the first heartbeat, s.
const PARAMETERS_WAIT_S: f64 = 5.0;
/// Time to wait for positions that agree, one of which becomes the origin of a new mission.
const ORIGIN_WAIT: Duration = Duration::from_secs(20);
/// Time between two status lines, s.
const LINE_INTERVAL_S: u64 = 5;
/// Longest status line, bytes: two lines of a terminal.
const LINE_BYTES: usize = 160;
/// Standard deviation of a reported depth, m: the gauge is better, but the message is seconds old.
const DEPTH_SIGMA_M: f64 = 0.5;
/// Clocks farther apart than this shift fixes by a craft's length, s.
pub(crate) const CLOCK_ERROR_MAX_S: f64 = 0.5;
/// Number of kept times between fixes, and the least number that predicts the next one.
const INTERVALS: usize = 8;
const INTERVALS_MIN: usize = 3;
/// Delay after which a fix is overdue, s.
const OVERDUE_S: f64 = 2.0;
/// Greatest age of a reported position, s.
const REPORT_AGE_MAX_S: f64 = 2.0;

impl fmt::Debug for Bridge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bridge")
            .field("settings", &self.settings)
            .field("telemetry", &self.telemetry)
            .finish_non_exhaustive()
    }
}

impl Bridge {
    /// A bridge on its `clock`. `open` opens wires: [`crate::wire::open`], or a test's.
    #[must_use]
    pub fn open(
        clock: &Clock,
        autopilot: AutopilotSettings,
        settings: Settings,
        mut open: impl FnMut(&Endpoint, Input) -> Output,
    ) -> Self {
        let (sender, received) = channel(PIECES_MAX);
        let mut open = |endpoint: &Endpoint, wire| {
            let (received, clock) = (sender.clone(), clock.clone());
            open(
                endpoint,
                Input {
                    wire,
                    received,
                    clock,
                },
            )
        };
        let autopilot = AutopilotLink::open(autopilot, |connect| open(connect, AUTOPILOT_WIRE));
        let modems = settings.modems.iter().map(|(endpoint, _)| endpoint);
        for (index, endpoint) in settings.nmea.iter().chain(modems).enumerate() {
            // Sensors are sent nothing.
            drop(open(endpoint, 1 + index));
        }
        Self {
            clock: BridgeClock::start(clock),
            autopilot,
            received,
            nmea: settings.nmea.iter().map(|_| NmeaReader::default()).collect(),
            poses: PoseHistory::default(),
            tilt: [0.0; 2],
            authority: Authority::new(settings.take_control),
            limiter: OutputLimiter::default(),
            limits: None,
            telemetry: Telemetry {
                pieces: vec![0; 1 + settings.nmea.len() + settings.modems.len()],
                ..Telemetry::default()
            },
            alarms: BTreeSet::new(),
            settling: Settling::default(),
            link: None,
            speed_max: None,
            met_s: None,
            reported_s: f64::NEG_INFINITY,
            logged: None,
            steering: None,
            untold_s: None,
            told: None,
            said: None,
            has_planned: false,
            is_steering: false,
            confirmation: None,
            trouble: None,
            shown: None,
            last_second: 0,
            settings,
        }
    }

    pub(crate) fn telemetry(&self) -> &Telemetry {
        &self.telemetry
    }

    /// The autopilot's parameters that contradict the mission.
    #[must_use]
    pub fn contradictions(&self) -> Vec<Contradiction> {
        let speed_max = self.speed_max.unwrap_or(0.0);
        self.telemetry.parameters.contradictions(speed_max)
    }

    pub(crate) fn now_s(&self) -> f64 {
        self.clock.now_s()
    }

    /// The craft's control, if the autopilot reports it.
    pub(crate) fn control(&self) -> Control {
        self.autopilot.control(self.now_s())
    }

    /// The state of the mission; the default before [`Bridge::follow`].
    pub(crate) fn link(&self) -> LinkStatus {
        self.link.as_ref().map(MissionLink::status).unwrap_or_default()
    }

    /// Names of the wires, in the order of [`Telemetry::pieces`].
    pub(crate) fn wires(&self) -> impl Iterator<Item = String> {
        let modems = self.settings.modems.iter().map(|(endpoint, _)| endpoint);
        let sensors = self.settings.nmea.iter().chain(modems).map(ToString::to_string);
        ["--connect".to_owned()].into_iter().chain(sensors)
    }

    /// Rejected input of each wire, and measurements that were not used.
    pub(crate) fn rejects(&self) -> impl Iterator<Item = &Rejects> {
        let modems = self.settings.modems.iter().map(|(_, modem)| modem.rejects());
        [self.autopilot.rejects(), self.telemetry.craft.rejects()]
            .into_iter()
            .chain(self.nmea.iter().map(NmeaReader::rejects))
            .chain(modems)
    }

    /// Waits up to `patience` for the autopilot and its parameters, or for the craft's state on
    /// wires without parameters. Returns `true` if the craft was heard.
    pub async fn wait_for_craft(&mut self, patience: Duration) -> bool {
        let end = self.clock.machine.now() + patience;
        let (mut requested_s, mut said_s) = (f64::NEG_INFINITY, 0.0);
        while self.clock.machine.now() < end {
            self.listen_for(LISTEN).await;
            self.settle();
            let now = self.now_s();
            if now - said_s >= Duration::from_secs(LINE_INTERVAL_S).as_secs_f64() {
                said_s = now;
                let line = format!("waiting for the craft: {}", self.status_line(&self.link()));
                for line in lines(&line, LINE_BYTES) {
                    tracing::info!("{line}");
                }
            }
            match self.autopilot.control(now) {
                Control::Unreported if self.telemetry.craft.newest().is_some() => return true,
                Control::Reported(Some(_)) => {
                    let met_s = *self.met_s.get_or_insert(now);
                    let is_complete = self.telemetry.parameters.missing().next().is_none();
                    if is_complete || now - met_s > PARAMETERS_WAIT_S {
                        return true;
                    }
                }
                Control::Unreported | Control::Reported(None) => {}
            }
            if now - requested_s > 1.0 {
                requested_s = now;
                // Some wires answer only after a first message.
                if self.met_s.is_none() {
                    self.autopilot.send_heartbeat();
                }
                self.autopilot.request(&self.telemetry.parameters);
            }
        }
        self.met_s.is_some()
    }

    /// Joins or creates the mission, whose limits the autopilot's parameters complete.
    pub async fn follow(&mut self, missions: MissionClient, mut mission: MissionChoice) {
        if let MissionChoice::Named { body, .. } = &mut mission {
            if needs_origin(&body["live"])
                && let Some(Geographic { lat_deg, lon_deg }) = self.settled_position().await
            {
                tracing::info!("a new mission has its origin at {lat_deg:.6}°, {lon_deg:.6}°");
                body["live"]["origin"] = serde_json::json!({ "lat_deg": lat_deg, "lon_deg": lon_deg });
            }
            self.speed_max = body["live"]["limits"]["speed_max_mps"].as_f64();
            let is_autopilot = matches!(self.control(), Control::Reported(_));
            complete(body, &self.telemetry.parameters, is_autopilot);
            self.limits = Some(OutputLimits::declared(&body["live"]));
        }
        let (interval, sigma_m) = (self.settings.report_interval, self.settings.sigma_m);
        let link = MissionLink::open(missions, mission, interval, sigma_m, self.clock.clone());
        // There may be no others; repeated ones count once.
        for fixes in self.telemetry.fixes.values() {
            link.report_auv(&fixes.newest);
        }
        self.link = Some(link);
    }

    /// Waits for the origin of a new mission; `None` if positions do not agree in time.
    async fn settled_position(&mut self) -> Option<Geographic> {
        let end = self.clock.machine.now() + ORIGIN_WAIT;
        let mut settled = self.settle();
        while settled.is_none() && self.clock.machine.now() < end {
            self.listen_for(LISTEN).await;
            settled = self.settle();
        }
        settled
    }

    /// The craft's position, once positions have agreed for long enough.
    fn settle(&mut self) -> Option<Geographic> {
        let (now, craft) = (self.now_s(), &self.telemetry.craft);
        let is_new =
            |state: &MeasuredState| now - state.t_s <= REPORT_AGE_MAX_S && craft.distrusted().is_none();
        let position = craft.newest().filter(is_new).map(|state| state.position);
        self.settling.settled(now, position)
    }

    /// Follows the mission's plans until it is over, or for as long as `limit`.
    pub async fn run(&mut self, limit: Option<Duration>) -> Result<(), MissionError> {
        let mut due = self.clock.machine.now();
        let end = limit.map(|limit| due + limit);
        let interval = Duration::from_secs_f64(1.0 / self.settings.rate_hz);
        while end.is_none_or(|end| self.clock.machine.now() < end) {
            self.listen(due).await;
            // A missed tick is not repeated.
            due = (due + interval).max(self.clock.machine.now());
            let link = self.link();
            self.tick(&link);
            if link.is_over {
                tracing::info!("the mission is over");
                self.tell_end(MavSeverity::MAV_SEVERITY_NOTICE, "the mission is over");
                return Ok(());
            }
            if let (true, Some(trouble)) = (link.has_failed, link.trouble) {
                self.tell_end(MavSeverity::MAV_SEVERITY_CRITICAL, &trouble);
                return Err(MissionError(trouble));
            }
        }
        self.tell_end(MavSeverity::MAV_SEVERITY_NOTICE, "the bridge ends");
        Ok(())
    }

    async fn listen_for(&mut self, patience: Duration) {
        self.listen(self.clock.machine.now() + patience).await;
    }

    /// Processes input until `end`, and at least one piece of what waits.
    async fn listen(&mut self, end: Instant) {
        loop {
            tokio::select! {
                biased;
                Some(piece) = self.received.recv() => self.process(&piece),
                () = self.clock.machine.sleep_until(end) => return,
            }
            // A wire without pauses must not delay references.
            if end <= self.clock.machine.now() {
                return;
            }
        }
    }

    fn process(&mut self, piece: &Received) {
        let t_s = self.clock.at_s(piece.at);
        let unix_s = self.clock.unix_s(t_s);
        self.telemetry.pieces[piece.wire] += 1;
        let nmea = self.settings.nmea.len();
        match piece.wire.checked_sub(1) {
            None => {
                for event in self.autopilot.push(piece, t_s, unix_s) {
                    self.process_event(event, t_s, unix_s);
                }
            }
            Some(index) if index < nmea => {
                for measurement in read_nmea(&mut self.nmea[index], piece, unix_s) {
                    self.measure(piece.wire, t_s, unix_s, measurement);
                }
            }
            Some(index) => {
                let (_, modem) = &mut self.settings.modems[index - nmea];
                for fix in modem.push(&piece.bytes, unix_s, &self.poses) {
                    self.measure(piece.wire, t_s, unix_s, Measurement::Auv(fix));
                }
            }
        }
    }

    fn process_event(&mut self, event: AutopilotEvent, t_s: f64, unix_s: f64) {
        match event {
            AutopilotEvent::Measured(measurement) => {
                if let Measurement::Auv(fix) = &measurement {
                    self.note_depth(fix);
                }
                self.measure(AUTOPILOT_WIRE, t_s, unix_s, measurement);
            }
            AutopilotEvent::Parameter { name, value } => self.telemetry.parameters.note(&name, value),
            AutopilotEvent::Text(text) => tracing::info!("autopilot: {text}"),
            AutopilotEvent::NoCraft { system, kind } => self.log(&format!(
                "system {system} is no surface craft but {kind}: it is left alone"
            )),
            AutopilotEvent::Acknowledged {
                command,
                is_accepted: false,
            } => {
                tracing::warn!(command, "the autopilot rejected a command");
            }
            // The link keeps heartbeats.
            AutopilotEvent::Acknowledged { .. } | AutopilotEvent::Heartbeat(_) => {}
            AutopilotEvent::PositionKnown(known) => self.telemetry.position_known = Some(known),
            AutopilotEvent::Time(autopilot_s) => self.note_clock(autopilot_s - unix_s),
            AutopilotEvent::Attitude { roll, pitch } => self.tilt = [roll, pitch],
        }
    }

    /// Gives an AUV's reported depth to modems that measure angles only.
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

    fn measure(&mut self, wire: usize, t_s: f64, unix_s: f64, measurement: Measurement) {
        match measurement {
            Measurement::Craft {
                t_s: measured_s,
                talker,
                measured,
            } => {
                let source = Source { wire, talker };
                // On the bridge's clock, which is never set.
                let craft = &mut self.telemetry.craft;
                craft.take(t_s - (unix_s - measured_s), source, &measured);
                self.log_alarms();
                if let Some(state) = self.telemetry.craft.newest() {
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
                match self.telemetry.fixes.entry(fix.auv.clone()) {
                    Entry::Occupied(mut fixes) => fixes.get_mut().take(fix, t_s),
                    Entry::Vacant(first) => {
                        first.insert(Fixes {
                            newest: fix,
                            at_s: t_s,
                            count: 1,
                            intervals: VecDeque::new(),
                        });
                    }
                }
            }
        }
    }

    fn tick(&mut self, link: &LinkStatus) {
        let now = self.now_s();
        let second = Duration::from_secs_f64(now).as_secs();
        if second != self.last_second {
            self.last_second = second;
            self.each_second(second, link);
        }
        let state = self.telemetry.craft.newest();
        let state = state.filter(|_| self.telemetry.position_known != Some(false));
        if let (Some(state), Some(mission)) = (&state, &self.link)
            && state.t_s > self.reported_s
            && now - state.t_s <= REPORT_AGE_MAX_S
        {
            self.reported_s = state.t_s;
            mission.report_craft(state, self.is_steering);
        }
        self.has_planned |= link.plan.is_some();
        let known = Conditions {
            control: self.autopilot.control(now),
            distrust: self.telemetry.craft.distrusted(),
            state_age: state.map(|state| now - state.t_s),
            reference: link.plan.as_ref().and_then(|plan| self.reference(plan, now)),
            has_planned: self.has_planned,
            is_paused: link.is_paused,
        };
        let action = self.authority.decide(now, &known);
        let is_plan = !self.settings.dry_run && !self.settings.line_of_sight;
        self.is_steering = matches!(action, Action::Send(_)) && is_plan;
        let may_send = !self.settings.dry_run;
        match action {
            Action::Send(_) => self.log_once(Sending::Active),
            Action::Offer(_) => self.log_once(Sending::Stopped(Silence::NotGuided)),
            Action::Silent(silence) => self.log_once(Sending::Stopped(silence)),
            Action::OrderGuided(_) | Action::OrderArm => {}
        }
        if !matches!(action, Action::Send(_)) {
            self.confirmation = None;
        }
        match action {
            Action::Send(reference) | Action::Offer(reference) if may_send => {
                self.send(now, &reference, state.as_ref(), link);
            }
            Action::OrderGuided(autopilot) if may_send => {
                self.log("the guided mode is ordered (--take-control)");
                self.autopilot.order_guided(autopilot);
            }
            Action::OrderArm if may_send => {
                self.log("arming is ordered (--take-control)");
                self.autopilot.order_arm();
            }
            _ => {}
        }
        self.tell(link);
    }

    /// Sends `reference` within the output limiter's limits.
    fn send(&mut self, now: f64, reference: &Reference, state: Option<&MeasuredState>, link: &LinkStatus) {
        let Some(state) = state else { return };
        let craft = Reference {
            speed: state
                .ground_velocity
                .map_or(state.water_velocity.x, |velocity| velocity.norm()),
            heading: state.heading,
        };
        let limits = self.output_limits(link);
        if let Some(sent) = self.limiter.limit(now, reference, &craft, &limits) {
            self.autopilot.send(&sent, now);
            self.telemetry.craft.sent(&sent, 1.0 / self.settings.rate_hz);
            let seen = self
                .confirmation
                .get_or_insert_with(|| Confirmation::begin(now, state));
            seen.take(now, state, &sent);
        }
    }

    /// The limits of the output limiter.
    fn output_limits(&self, link: &LinkStatus) -> OutputLimits {
        let declared = self
            .limits
            .unwrap_or_else(|| OutputLimits::declared(&link.setting));
        declared.within(&self.telemetry.parameters)
    }

    fn reference(&self, plan: &Plan, now: f64) -> Option<Reference> {
        let planned = plan.planned.at(now)?;
        if !OutputLimiter::may_follow(plan.arrived_s, now) {
            return None;
        }
        Some(if self.settings.line_of_sight {
            plan.line_of_sight
        } else {
            planned
        })
    }

    fn each_second(&mut self, second: u64, link: &LinkStatus) {
        self.autopilot.send_heartbeat();
        let shown = self
            .steering(link)
            .map(|steering| (steering.state(), steering.is_good()));
        let has_changed = std::mem::replace(&mut self.shown, shown) != shown;
        if second.is_multiple_of(LINE_INTERVAL_S) {
            // An autopilot that restarted has forgotten the requests.
            self.autopilot.request(&self.telemetry.parameters);
        }
        if has_changed || second.is_multiple_of(LINE_INTERVAL_S) {
            for line in lines(&self.status_line(link), LINE_BYTES) {
                tracing::info!("{line}");
            }
        }
        if link.trouble != self.trouble {
            match &link.trouble {
                Some(trouble) => self.log(&format!("the service does not answer: {trouble}")),
                None => self.log("the service answers again"),
            }
            self.trouble.clone_from(&link.trouble);
        }
    }

    /// Logs contradictions in the craft's navigation, and their end.
    fn log_alarms(&mut self) {
        let alarms: BTreeSet<Alarm> = self.telemetry.craft.alarms().collect();
        if alarms == self.alarms {
            return;
        }
        for raised in alarms.difference(&self.alarms) {
            self.warn(&format!("warning: {raised}"));
        }
        for ended in self.alarms.difference(&alarms) {
            self.log(&format!("over: {ended}"));
        }
        self.telemetry.alarms_seen.extend(&alarms);
        self.alarms = alarms;
    }

    /// Logs changes between sending and the reasons for silence.
    fn log_once(&mut self, sending: Sending) {
        if self.logged == Some(sending) {
            return;
        }
        self.logged = Some(sending);
        match sending {
            Sending::Stopped(silence) if silence.is_meant() => self.log(&silence.to_string()),
            Sending::Stopped(silence) => self.warn(&silence.to_string()),
            Sending::Active if self.settings.dry_run => {
                self.log("references would be sent: this is a dry run");
            }
            Sending::Active => self.log("references are sent"),
        }
    }

    /// Keeps the lead of the autopilot's clock, s; warns once of a wrong one.
    fn note_clock(&mut self, ahead_s: f64) {
        let is_wrong = |ahead_s: f64| ahead_s.abs() > CLOCK_ERROR_MAX_S;
        let was_wrong = self.telemetry.clock_ahead_s.is_some_and(is_wrong);
        if is_wrong(ahead_s) && !was_wrong {
            self.warn(&format!(
                "warning: the autopilot's clock is {ahead_s:+.1} s ahead of this machine's"
            ));
        }
        self.telemetry.clock_ahead_s = Some(ahead_s);
    }

    /// Writes to the log of the program and of the mission.
    fn log(&self, text: &str) {
        tracing::info!("{text}");
        self.note(text);
    }

    /// The same for messages that need an operator.
    fn warn(&self, text: &str) {
        tracing::warn!("{text}");
        self.note(text);
    }

    fn note(&self, text: &str) {
        if let Some(link) = &self.link {
            link.note(self.now_s(), text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bridge with only the wire of its autopilot.
    fn bridge() -> (Bridge, Input) {
        let connect = "tcp:autopilot:1".parse().expect("an endpoint");
        let (clock, mut wire) = (Clock::simulated(0.0), None);
        let bridge = Bridge::open(
            &clock,
            AutopilotSettings::Nmea { connect },
            Settings::default(),
            |_, input| {
                wire = Some(input);
                Box::new(|_| ())
            },
        );
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
}
