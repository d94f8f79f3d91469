//! The loop of a bridge, from the wires to the mission and from its plan to the craft.
//!
//! Each tick reads `telemetry`, makes a `decision`, and ends with `reporting`. The bridge
//! sends only what `Authority` allows. If any part stops, the autopilot's own time-out stops the
//! craft, and the mission's log has the reason.

use std::time::{Duration, Instant};

use ::wire::{DeclaredLimits, Origin, mission::SteeringState};
use clock::Clock;
use serde_json::{Value, json};
use tokio::sync::mpsc::{Receiver, channel};

use crate::acoustics::Modem;
use crate::autopilot_link::{AutopilotLink, AutopilotSettings};
use crate::bridge_clock::BridgeClock;
use crate::imc::ImcLink;
use crate::mavlink::{Action, Contradiction, Control};
use crate::mission_client::{MissionClient, OwnPart};
use crate::mission_link::{LinkStatus, MissionChoice, MissionLink};
use crate::mission_setup::{complete, declared, needs_origin, own_part};
use crate::output_limiter::OutputLimits;
use crate::reference::Reference;
use crate::wire::{Endpoint, Input, Output, Received};
use crate::{MeasuredState, Rejects};

mod decision;
mod mission_log;
mod reporting;
mod steering;
mod telemetry;

pub(crate) use telemetry::{CLOCK_ERROR_MAX_S, Fixes, Telemetry};

use decision::Decision;
use mission_log::MissionLog;
use reporting::{Facts, LINE_INTERVAL_S, Reporting, send_texts};
use steering::{Steering, lines};
use telemetry::{AUTOPILOT_WIRE, REPORT_AGE_MAX_S};

/// Settings of a bridge.
#[derive(Debug)]
pub struct Settings {
    /// Wires with NMEA 0183 of the craft.
    pub nmea: Vec<Endpoint>,
    /// MMSI of the craft's own AIS transponder, whose messages are no traffic.
    pub own_mmsi: Option<u32>,
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
            own_mmsi: None,
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

/// A running bridge.
pub struct Bridge {
    settings: Settings,
    autopilot: AutopilotLink,
    received: Receiver<Received>,
    pub(crate) telemetry: Telemetry,
    decision: Decision,
    reporting: Reporting,
    log: MissionLog,
    /// The mission's speed limit, m/s.
    speed_max: Option<f64>,
    met_s: Option<f64>,
    reported_s: f64,
    /// Time of the last end of references, s.
    silent_since_s: f64,
    trouble: Option<String>,
    last_second: u64,
}

/// Pieces that may wait for the loop.
const PIECES_MAX: usize = 1024;
/// Time of reading bytes before the result is examined.
const LISTEN: Duration = Duration::from_millis(100);
/// Longest wait for parameters after the first heartbeat, s.
const PARAMETERS_WAIT_S: f64 = 5.0;
/// Time to wait for positions that agree, one of which becomes the origin of a new mission.
const ORIGIN_WAIT: Duration = Duration::from_secs(20);
/// Time for which a stop is repeated, s, and how often it is at the bridge's end, and after which
/// time: datagrams are lost, some at a time.
const STOPS_S: f64 = 1.0;
const STOPS: usize = 3;
const BETWEEN_STOPS: Duration = Duration::from_millis(100);
/// Time between two requests to the autopilot, s.
const REQUEST_INTERVAL_S: u64 = 5;
/// Time between two status lines in the log book of a network, s.
const LOG_INTERVAL_S: u64 = 30;
/// Longest status line, bytes: two lines of a terminal.
const LINE_BYTES: usize = 160;

impl Bridge {
    /// A bridge on its `clock`. `open` opens wires: [`crate::wire::open`], or a test's.
    pub fn open(
        clock: &Clock,
        autopilot: AutopilotSettings,
        mut settings: Settings,
        mut open: impl FnMut(&Endpoint, Input) -> Output,
    ) -> Self {
        let (sender, received) = channel(PIECES_MAX);
        let mut open = |endpoint: &Endpoint, wire| {
            let (received, clock) = (sender.clone(), clock.clone());
            let input = Input { wire, received, clock };
            open(endpoint, input)
        };
        let autopilot = AutopilotLink::open(autopilot, clock, |connect| open(connect, AUTOPILOT_WIRE));
        let (endpoints, modems): (Vec<_>, Vec<Modem>) = settings.modems.drain(..).unzip();
        let n_nmea = settings.nmea.len();
        settings.nmea.extend(endpoints);
        for (index, endpoint) in settings.nmea.iter().enumerate() {
            // Sensors are sent nothing.
            drop(open(endpoint, 1 + index));
        }
        Self {
            autopilot,
            received,
            telemetry: Telemetry::new(n_nmea, modems, settings.own_mmsi),
            decision: Decision::new(settings.take_control, settings.line_of_sight, settings.dry_run),
            reporting: Reporting::default(),
            log: MissionLog { clock: BridgeClock::start(clock), mission: None },
            speed_max: None,
            met_s: None,
            reported_s: f64::NEG_INFINITY,
            silent_since_s: f64::NEG_INFINITY,
            trouble: None,
            last_second: 0,
            settings,
        }
    }

    /// The autopilot's parameters that contradict the mission.
    pub fn contradictions(&self) -> Vec<Contradiction> {
        let speed_max = self.speed_max.unwrap_or(0.0);
        self.telemetry.parameters.contradictions(speed_max)
    }

    /// The link to a craft that runs DUNE.
    pub(crate) fn dune(&self) -> Option<&ImcLink> {
        self.autopilot.dune()
    }

    fn clock(&self) -> &Clock {
        &self.log.clock.machine
    }

    pub(crate) fn now_s(&self) -> f64 {
        self.log.clock.now_s()
    }

    pub(crate) fn control(&self) -> Control {
        self.autopilot.control(self.now_s())
    }

    /// The state of the mission; the default before [`Bridge::follow`].
    pub(crate) fn link(&self) -> LinkStatus {
        self.log.mission.as_ref().map(MissionLink::status).unwrap_or_default()
    }

    /// Names of the wires, in the order of [`Telemetry::pieces`].
    pub(crate) fn wires(&self) -> impl Iterator<Item = String> {
        let sensors = self.settings.nmea.iter().map(ToString::to_string);
        ["--connect".to_owned()].into_iter().chain(sensors)
    }

    /// Rejected input of each wire, and measurements that were not used.
    pub(crate) fn rejects(&self) -> impl Iterator<Item = &Rejects> {
        std::iter::once(self.autopilot.rejects()).chain(self.telemetry.rejects())
    }

    /// Waits up to `patience` for the autopilot and its parameters, or for the craft's state on
    /// wires without parameters. Returns `true` if the craft was heard.
    pub async fn wait_for_craft(&mut self, patience: Duration) -> bool {
        let end = self.clock().now() + patience;
        let (mut requested_s, mut logged_s) = (f64::NEG_INFINITY, 0.0);
        while self.clock().now() < end {
            self.listen_for(LISTEN).await;
            let now = self.now_s();
            self.telemetry.settled_position(now);
            if now - logged_s >= LINE_INTERVAL_S {
                logged_s = now;
                let link = self.link();
                let facts = self.facts(&link);
                let line = facts.line(facts.steering().as_ref());
                log_lines(&format!("waiting for the craft: {line}"));
            }
            match self.autopilot.control(now) {
                Control::Unreported if self.telemetry.craft.newest().is_some() => return true,
                Control::Reported(Some(_)) => {
                    let met_s = *self.met_s.get_or_insert(now);
                    let is_complete =
                        self.dune().is_some() || self.telemetry.parameters.missing().next().is_none();
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
                    self.autopilot.send_heartbeat(now);
                }
                self.autopilot.request(&self.telemetry.parameters);
            }
        }
        self.met_s.is_some()
    }

    /// Joins or creates the mission, whose limits the autopilot's parameters complete.
    pub async fn follow(&mut self, missions: MissionClient, mut mission: MissionChoice) {
        if let MissionChoice::Named { body, own: part, .. } = &mut mission {
            let live = &mut body["live"];
            if needs_origin(live)
                && let Some(origin) = self.origin().await
            {
                let Origin { lat_deg, lon_deg } = origin;
                tracing::info!("if the mission is new, its origin is {lat_deg:.6}°, {lon_deg:.6}°");
                live["origin"] = json!(origin);
            }
            let limits = |own: &Value| declared::<DeclaredLimits>(own, "limits").unwrap_or_default();
            let own = own_part(live, missions.craft());
            self.speed_max = limits(own).speed_max_mps;
            let stated = serde_json::from_value(own.clone());
            complete(own, &self.telemetry.parameters, self.autopilot.heading_held());
            // Another bridge may create the mission, with what it knows of its own craft.
            if let (Some(_), Ok(stated), Ok(completed)) =
                (missions.craft(), stated, serde_json::from_value(own.clone()))
            {
                *part = Some(Box::new(OwnPart { stated, completed }));
            }
            let craft = declared(own, "craft").unwrap_or_default();
            self.decision.limits = Some(OutputLimits::declared(&limits(own), &craft));
            if let Some(separation) = live["vessel_separation_m"].as_f64() {
                self.decision.separation = separation;
            }
        }
        let (interval, sigma_m) = (self.settings.report_interval, self.settings.sigma_m);
        let link = MissionLink::open(missions, mission, interval, sigma_m, self.log.clock.clone());
        // There may be no others; repeated ones count once.
        for fixes in self.telemetry.fixes.values() {
            link.report_auv(&fixes.newest);
        }
        self.log.mission = Some(link);
    }

    /// The origin of a new mission: the wire's, or one for which it waits; `None` if positions do
    /// not agree in time.
    async fn origin(&mut self) -> Option<Origin> {
        if let Some(datum) = self.autopilot.datum() {
            return Some(datum);
        }
        let end = self.clock().now() + ORIGIN_WAIT;
        loop {
            let settled = self.telemetry.settled_position(self.now_s());
            if settled.is_some() || self.clock().now() >= end {
                return settled;
            }
            self.listen_for(LISTEN).await;
        }
    }

    /// Follows the mission's plans until it is over, or for as long as `limit`.
    pub async fn run(&mut self, limit: Option<Duration>) -> Result<(), MissionError> {
        let mut due = self.clock().now();
        let end = limit.map(|limit| due + limit);
        let interval = Duration::from_secs_f64(1.0 / self.settings.rate_hz);
        while end.is_none_or(|end| self.clock().now() < end) {
            self.listen(due).await;
            // A missed tick is not repeated.
            due = (due + interval).max(self.clock().now());
            let link = self.link();
            self.tick(&link);
            if link.is_over {
                tracing::info!("the mission is over");
                self.tell_end(SteeringState::Waiting, "the mission is over").await;
                return Ok(());
            }
            if let (true, Some(trouble)) = (link.has_failed, link.trouble) {
                self.tell_end(SteeringState::NotSteering, &trouble).await;
                return Err(MissionError(trouble));
            }
        }
        self.tell_end(SteeringState::Waiting, "the bridge ends").await;
        Ok(())
    }

    async fn listen_for(&mut self, patience: Duration) {
        self.listen(self.clock().now() + patience).await;
    }

    /// Processes input until `end`, and at least one piece of what waits.
    async fn listen(&mut self, end: Instant) {
        loop {
            tokio::select! {
                biased;
                Some(piece) = self.received.recv() => {
                    self.telemetry.take(&piece, &mut self.autopilot, &self.log);
                }
                () = self.log.clock.machine.sleep_until(end) => return,
            }
            // A wire without pauses must not delay references.
            if end <= self.clock().now() {
                return;
            }
        }
    }

    fn facts<'a>(&'a self, link: &'a LinkStatus) -> Facts<'a> {
        Facts {
            now: self.now_s(),
            link,
            autopilot: &self.autopilot,
            telemetry: &self.telemetry,
            decision: &self.decision,
        }
    }

    /// Reports the craft, decides, acts, and tells the result.
    fn tick(&mut self, link: &LinkStatus) {
        let now = self.now_s();
        let second = Duration::from_secs_f64(now).as_secs();
        if second != self.last_second {
            self.last_second = second;
            self.each_second(second, link);
        }
        let state = self.telemetry.state();
        if let (Some(state), Some(mission)) = (&state, &self.log.mission)
            && state.t_s > self.reported_s
            && now - state.t_s <= REPORT_AGE_MAX_S
        {
            self.reported_s = state.t_s;
            mission.report_craft(state, self.telemetry.battery(now), self.decision.is_steering());
        }
        let control = self.autopilot.control(now);
        let decision = &mut self.decision;
        let was_sending = decision.is_sending();
        let action = decision.decide(now, control, &self.telemetry, link, &self.log);
        if !self.settings.dry_run {
            let is_silent = matches!(action, Action::Silent(_));
            if was_sending && is_silent {
                self.silent_since_s = now;
            }
            if is_silent && now - self.silent_since_s < STOPS_S {
                self.autopilot.fall_silent(now);
            }
            self.act(now, action, state.as_ref(), link);
        }
        let steering = self.facts(link).steering();
        if self.reporting.takes_line(now, steering.as_ref()) {
            log_lines(&self.facts(link).line(steering.as_ref()));
        }
        if let Some(steering) = &steering {
            self.autopilot.show(now, &steering.to_string(), link);
        }
        let mission = self.log.mission.as_ref();
        self.reporting.tell(now, steering, mission, &mut self.autopilot);
    }

    fn act(&mut self, now: f64, action: Action, state: Option<&MeasuredState>, link: &LinkStatus) {
        match action {
            Action::Send(reference) | Action::Offer(reference) => {
                if let Some(state) = state {
                    self.send(now, &reference, state, link);
                }
            }
            Action::OrderGuided(autopilot) => {
                self.log.info("the guided mode is ordered (--take-control)");
                self.autopilot.order_guided(autopilot);
            }
            Action::OrderArm => {
                self.log.info("arming is ordered (--take-control)");
                self.autopilot.send_frames(|writer, _| writer.arm());
            }
            Action::Silent(_) => {}
        }
    }

    fn send(&mut self, now: f64, reference: &Reference, state: &MeasuredState, link: &LinkStatus) {
        let limits = self.decision.output_limits(link, &self.telemetry.parameters);
        let plan = link.plan.as_deref();
        let clear =
            plan.map(|plan| self.decision.clear_of_vessels(now, reference, &self.telemetry, plan, &limits));
        let reference = clear.as_ref().unwrap_or(reference);
        if let Some(sent) = self.decision.limited(now, reference, state, &limits) {
            self.autopilot.send(&sent, now);
            let seconds = 1.0 / self.settings.rate_hz;
            self.telemetry.craft.integrity.sent(&sent, seconds);
        }
    }

    fn each_second(&mut self, second: u64, link: &LinkStatus) {
        self.autopilot.send_heartbeat(self.now_s());
        if second.is_multiple_of(LOG_INTERVAL_S) && !self.settings.dry_run {
            let facts = self.facts(link);
            let line = facts.line(facts.steering().as_ref());
            self.autopilot.log(&line);
        }
        if second.is_multiple_of(REQUEST_INTERVAL_S) {
            // An autopilot that restarted has forgotten the requests.
            self.autopilot.request(&self.telemetry.parameters);
        }
        if link.trouble != self.trouble {
            match &link.trouble {
                Some(trouble) => self.log.info(&format!("the service does not answer: {trouble}")),
                None => self.log.info("the service answers again"),
            }
            self.trouble.clone_from(&link.trouble);
        }
        if let (Some(state), Some(mission)) = (self.telemetry.state(), &self.log.mission) {
            mission.report_traffic(self.telemetry.vessels.news(self.now_s(), &state.position));
        }
    }

    /// Tells the ground station that the bridge ends, and the reason.
    async fn tell_end(&mut self, state: SteeringState, cause: &str) {
        let steering = Steering { state, cause: cause.to_owned() };
        if !self.settings.dry_run {
            if let (true, Some(craft)) = (self.decision.is_sending(), self.telemetry.state()) {
                for stop in 0..STOPS {
                    if 0 < stop {
                        self.clock().sleep(BETWEEN_STOPS).await;
                    }
                    self.autopilot.release(craft.heading);
                    self.autopilot.fall_silent(self.now_s());
                }
            }
            self.autopilot.show(self.now_s(), &steering.to_string(), &LinkStatus::default());
            send_texts(&steering, &mut self.autopilot);
        }
    }
}

fn log_lines(status: &str) {
    for line in lines(status, LINE_BYTES) {
        tracing::info!("{line}");
    }
}

#[cfg(test)]
mod tests;
