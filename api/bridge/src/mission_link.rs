//! A live mission beside the craft's loop. Its own tasks send reports and wait for plans, so that a
//! slow service never delays the craft's messages.

use std::mem;
use std::sync::Arc;
use std::time::Duration;

use ::wire::mission::{
    AscReport, CurrentReference, Mission, Note, Reports, Setting, Status, Steering, SteeringState,
};
use ::wire::{Asc, Current, Report, Vessel};
use geodesy::Datum;
use parking_lot::Mutex;
use planner::angle::angle_of;
use planner::snapshot::{AUVS_MAX, REPORTS_MAX, ranges_by_shape};
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use tokio::task::JoinSet;

use crate::arrivals::Arrivals;
use crate::bridge_clock::BridgeClock;
use crate::mission_client::{MissionClient, OwnPart, ServiceError};
use crate::plan::Plan;
use crate::{AuvFix, MeasuredState, Origin, Rejects};

/// Between two tries.
const RETRY: Duration = Duration::from_millis(300);
/// The same for finding the mission.
const FIND_RETRY: Duration = Duration::from_secs(1);
/// Metres of a position in degrees: not in JSON, because the service computes them.
const IN_DEGREES: f64 = f64::NAN;

#[derive(Clone, Debug, Default)]
pub(crate) struct LinkStatus {
    /// ID of the mission, while it is known.
    pub(crate) mission: Option<String>,
    /// The mission's settings when it was found.
    pub(crate) setting: Setting,
    pub(crate) plan: Option<Arc<Plan>>,
    /// The arrivals of plans since the mission was found or went on.
    pub(crate) plans: Option<Arrivals>,
    /// The reason that the service did not answer the last request, and the time since which it
    /// has answered none, s of the bridge's clock.
    pub(crate) trouble: Option<String>,
    pub(crate) troubled_s: Option<f64>,
    /// Values outside the API's ranges that were clamped, by member.
    pub(crate) clamped: Rejects,
    /// Number of rejected reports, and the last reason.
    pub(crate) rejected: Option<(u64, String)>,
    /// `true` if the mission cannot be joined or created, for the reason in `trouble`.
    pub(crate) has_failed: bool,
    pub(crate) is_paused: bool,
    pub(crate) is_over: bool,
}

impl LinkStatus {
    fn is_answered(&mut self) {
        (self.trouble, self.troubled_s) = (None, None);
    }

    fn fails(&mut self, now_s: f64, error: &ServiceError) {
        self.trouble = Some(error.to_string());
        self.troubled_s.get_or_insert(now_s);
    }

    fn count_rejected(&mut self, faults: Vec<String>) {
        for fault in faults {
            let (count, why) = self.rejected.get_or_insert_default();
            (*count, *why) = (*count + 1, fault);
        }
    }
}

/// The mission to follow.
#[derive(Clone, Debug)]
pub enum MissionChoice {
    /// The mission with this ID.
    Joined(String),
    /// The unfinished mission of a name, or a new one.
    Named {
        /// The name.
        name: String,
        /// Digest of the operator's request.
        digest: String,
        /// Body of `POST /v1/missions`.
        body: Value,
        /// The bridge's own craft of a fleet in that body.
        own: Option<Box<OwnPart>>,
    },
}

impl MissionChoice {
    /// The unfinished mission of this name, or a new one of `body`.
    pub fn named(name: String, body: Value) -> Self {
        let digest = hex::encode(Sha256::digest(body.to_string()));
        Self::Named { name, digest, body, own: None }
    }
}

/// A mission that two tasks keep until this is dropped.
pub(crate) struct MissionLink {
    shared: Arc<Shared>,
    _tasks: JoinSet<()>,
}

struct Shared {
    client: MissionClient,
    status: Mutex<LinkStatus>,
    /// The content of the next request. Its lists are bounded; only the newest state waits.
    outbox: Mutex<Reports>,
    clock: BridgeClock,
    /// Standard deviation of fixes that state none, m.
    sigma_m: f64,
}

impl MissionLink {
    /// Follows `mission` and reports every `interval`. `sigma_m` is for fixes that state none.
    pub(crate) fn open(
        client: MissionClient,
        mission: MissionChoice,
        interval: Duration,
        sigma_m: f64,
        clock: BridgeClock,
    ) -> Self {
        let shared =
            Arc::new(Shared { status: Mutex::default(), outbox: Mutex::default(), client, clock, sigma_m });
        let (reports, plans) = (Arc::clone(&shared), Arc::clone(&shared));
        let mut tasks = JoinSet::new();
        tasks.spawn(async move { reports.post_reports(&mission, interval).await });
        tasks.spawn(async move { plans.wait_for_plans().await });
        Self { shared, _tasks: tasks }
    }

    pub(crate) fn status(&self) -> LinkStatus {
        self.shared.status.lock().clone()
    }

    /// Posts the craft's newest state soon, with the share of its energy that is left and whether it
    /// is steered. Times are the bridge's.
    pub(crate) fn report_craft(&self, state: &MeasuredState, battery: Option<f64>, is_steered: bool) {
        let t_s = self.shared.clock.unix_s(state.t_s);
        let report = asc_report(t_s, state, is_steered, &mut self.shared.status.lock().clamped);
        self.shared.outbox.lock().asc = vec![AscReport { battery, ..report }];
    }

    /// Posts a fix soon, with Unix time.
    pub(crate) fn report_auv(&self, fix: &AuvFix) {
        let mut status = self.shared.status.lock();
        let origin = status.plan.as_ref().and_then(|plan| plan.answer.plan.origin);
        let mut report = auv_report(fix, self.shared.sigma_m, &mut status.clamped);
        drop(status);
        report.from = origin.filter(|_| fix.range_m.is_some()).and_then(|origin| from(&origin, fix));
        let mut outbox = self.shared.outbox.lock();
        // The service refuses a body with more.
        if outbox.auvs.len() < AUVS_MAX || outbox.auvs.contains_key(&fix.auv) {
            push(outbox.auvs.entry(fix.auv.clone()).or_default(), report);
        }
    }

    /// Posts other vessels soon, with the bridge's times; of each its newest position.
    pub(crate) fn report_traffic(&self, vessels: Vec<Vessel>) {
        for vessel in vessels.into_iter().rev() {
            let t_s = vessel.t_s.map(|t_s| self.shared.clock.unix_s(t_s));
            let mut status = self.shared.status.lock();
            let mut within =
                |value: f64, member, name| clamped(value, ["Vessel", member], name, &mut status.clamped);
            let speed_mps = vessel.speed_mps.map(|speed| within(speed, "speed_mps", "vessel's speed"));
            let length_m = vessel.length_m.map(|length| within(length, "length_m", "vessel's length"));
            drop(status);
            let waiting = &mut self.shared.outbox.lock().traffic;
            waiting.retain(|before| before.id != vessel.id);
            push(waiting, Vessel { t_s, speed_mps, length_m, ..vessel });
        }
    }

    /// Posts the state of the steering soon, with the bridge's time.
    pub(crate) fn report_steering(&self, t_s: f64, state: SteeringState, why: &str) {
        let (t_s, why) = (self.shared.clock.unix_s(t_s), cut(why));
        self.shared.outbox.lock().steering = vec![Steering { t_s, state, why }];
    }

    /// Writes into the mission's log soon, with the time on the bridge's clock.
    pub(crate) fn note(&self, t_s: f64, text: &str) {
        self.shared.note(t_s, text);
    }
}

impl Shared {
    async fn post_reports(&self, choice: &MissionChoice, interval: Duration) {
        let clock = &self.clock.machine;
        // Keys of this run only.
        let run = self.clock.unix_s(0.0).to_bits();
        for number in 0_u64.. {
            let started = clock.now();
            let known = self.status.lock().mission.clone();
            let mission = match known {
                Some(mission) => mission,
                None => self.find(choice).await,
            };
            let mut reports = mem::take(&mut *self.outbox.lock());
            if reports != Reports::default() {
                reports.craft = self.client.craft().map(str::to_owned);
                let key = format!("bridge-{run:x}-{number}");
                self.post_until_answered(&mission, &reports, &key).await;
            }
            clock.sleep(interval.saturating_sub(clock.since(started))).await;
        }
    }

    /// Finds or creates the mission, with unlimited attempts.
    async fn find(&self, mission: &MissionChoice) -> String {
        let key = format!("{:x}", self.clock.machine.unix_s().to_bits());
        loop {
            let found = match mission {
                MissionChoice::Joined(id) => match self.client.mission(id).await {
                    Ok(mission) => self.client.run(mission).await,
                    error => error,
                },
                MissionChoice::Named { name, digest, body, own } => {
                    match (self.client.find_or_create(name, digest, body, &key).await, own) {
                        (Ok(mission), Some(own)) => self.client.complete(mission, own).await,
                        (found, _) => found,
                    }
                }
            };
            match found.and_then(|mission| self.with_own_craft(mission)) {
                Ok(mission) => {
                    let mut status = self.status.lock();
                    status.is_answered();
                    status.is_over = mission.status.is_over();
                    status.mission = Some(mission.id.clone());
                    status.setting = of_craft(mission.setting.unwrap_or_default(), self.client.craft());
                    return mission.id;
                }
                // Of a token that may report for one craft alone: another one creates and runs the
                // mission.
                Err(ServiceError::Rejected { code, detail }) if code == "mission_forbidden" => {
                    let why = format!(
                        "this token may not create or run the mission (give the --name that it permits; a fleet's mission is created with another token): {detail}"
                    );
                    self.status.lock().fails(self.clock.now_s(), &ServiceError::Unavailable(why));
                }
                Err(error) => {
                    let mut status = self.status.lock();
                    // A mission that the bridge would create can be lost on the way to it.
                    status.has_failed = match &error {
                        ServiceError::Unavailable(_) => false,
                        ServiceError::NoMission => matches!(mission, MissionChoice::Joined(_)),
                        ServiceError::Unauthorised | ServiceError::Rejected { .. } => true,
                    };
                    status.fails(self.clock.now_s(), &error);
                }
            }
            self.clock.machine.sleep(FIND_RETRY).await;
        }
    }

    /// The mission, if it is of this bridge's craft.
    fn with_own_craft(&self, mission: Mission) -> Result<Mission, ServiceError> {
        let fleet = mission.setting.as_ref().and_then(|setting| setting.surface_craft.as_ref());
        let names: Vec<_> = fleet.into_iter().flatten().map(|craft| &*craft.id.0).collect();
        let detail = match self.client.craft() {
            None if names.is_empty() => return Ok(mission),
            Some(craft) if names.contains(&craft) => return Ok(mission),
            Some(craft) if names.is_empty() => {
                format!("mission {} has one craft: leave --craft {craft} out", mission.id)
            }
            _ => format!(
                "mission {} is of several craft: name one of {} with --craft",
                mission.id,
                names.join(", ")
            ),
        };
        Err(ServiceError::Rejected { code: "unknown_craft".to_owned(), detail })
    }

    /// Handles a lost `mission`: the bridge creates its own again; a lost joined one ends it.
    fn lose(&self, mission: &str) {
        let mut status = self.status.lock();
        // The other task may have noticed it already.
        if status.mission.as_deref() != Some(mission) {
            return;
        }
        (status.mission, status.plan, status.plans) = (None, None, None);
        drop(status);
        let text = format!("the service no longer has mission {mission}: searching for it again");
        tracing::warn!("{text}");
        self.note(self.clock.now_s(), &text);
    }

    fn note(&self, t_s: f64, text: &str) {
        let (t_s, text) = (self.clock.unix_s(t_s), cut(text));
        push(&mut self.outbox.lock().notes, Note { t_s, text });
    }

    async fn post_until_answered(&self, mission: &str, reports: &Reports, key: &str) {
        loop {
            match self.client.report(mission, reports, key).await {
                Ok(rejected) => {
                    let mut status = self.status.lock();
                    status.is_answered();
                    return status.count_rejected(rejected);
                }
                Err(ServiceError::NoMission) => return self.lose(mission),
                Err(error @ ServiceError::Rejected { .. }) => {
                    return self.status.lock().count_rejected(vec![error.to_string()]);
                }
                Err(error) => self.status.lock().fails(self.clock.now_s(), &error),
            }
            self.clock.machine.sleep(RETRY).await;
        }
    }

    async fn wait_for_plans(&self) {
        let mut newest = Newest::default();
        loop {
            let mission = self.status.lock().mission.clone();
            if mission.is_some() && mission != newest.mission {
                newest = Newest::default();
                newest.mission.clone_from(&mission);
            }
            let is_new = match mission {
                Some(mission) => self.wait_for_plan(&mission, &mut newest).await,
                None => false,
            };
            if !is_new {
                self.clock.machine.sleep(RETRY).await;
            }
        }
    }

    /// Returns `true` for a plan that is newer than `newest`.
    async fn wait_for_plan(&self, mission: &str, newest: &mut Newest) -> bool {
        match self.client.reference(mission, newest.sequence).await {
            Ok(Some(answer)) => self.take(answer, mission, newest),
            Ok(None) => {
                // Without a plan, the mission's status shows if one will come.
                if let Ok(Mission { status, .. }) = self.client.mission(mission).await {
                    let mut now = self.status.lock();
                    now.is_over = status.is_over();
                    now.is_paused = status == Status::Paused;
                }
                false
            }
            Err(error) => {
                match error {
                    ServiceError::NoMission => self.lose(mission),
                    error => self.status.lock().fails(self.clock.now_s(), &error),
                }
                false
            }
        }
    }

    /// Follows the plan in `answer`. Returns `true` if it is newer than `newest`.
    fn take(&self, answer: CurrentReference, mission: &str, newest: &mut Newest) -> bool {
        // A service that lost the mission to another one repeats old plans.
        if answer.sequence < newest.sequence {
            return false;
        }
        let now_s = self.clock.now_s();
        let is_new = answer.sequence > newest.sequence;
        if is_new {
            (newest.sequence, newest.arrived_s) = (answer.sequence, now_s);
        }
        let mut now = self.status.lock();
        // The mission was lost meanwhile.
        if now.mission.as_deref() != Some(mission) {
            return false;
        }
        let is_running = answer.status == Status::Running;
        now.is_over = answer.status.is_over();
        now.is_paused = !is_running && !now.is_over;
        if is_new && is_running {
            match &mut now.plans {
                Some(plans) => plans.push(now_s),
                None => now.plans = Some(Arrivals::first(now_s)),
            }
        } else if !is_running {
            now.plans = None;
        }
        // A paused mission makes no plans, and its last one is not followed.
        let plan = Plan::new(answer, newest.arrived_s, now_s);
        now.plan = plan.filter(|_| is_running).map(Arc::new);
        is_new
    }
}

/// The setting with limits and description of that craft of a fleet.
fn of_craft(mut setting: Setting, craft: Option<&str>) -> Setting {
    let mut fleet = setting.surface_craft.iter().flatten();
    let own = fleet.find(|known| Some(&*known.id.0) == craft).cloned();
    if let Some(own) = own {
        (setting.limits, setting.craft) = (Some(own.limits), Some(own.craft));
    }
    setting
}

#[derive(Debug, Default)]
struct Newest {
    mission: Option<String>,
    sequence: u64,
    /// Time of its first arrival, s of the bridge's clock; the service repeats it.
    arrived_s: f64,
}

/// Longest text that the service accepts, bytes.
const TEXT_BYTES_MAX: usize = 500;

/// The beginning of `text` that the service accepts.
fn cut(text: &str) -> String {
    text[..text.floor_char_boundary(TEXT_BYTES_MAX)].to_owned()
}

/// Adds `item`; drops the oldest if more wait than the service accepts in one request.
fn push<T>(waiting: &mut Vec<T>, item: T) {
    waiting.push(item);
    if waiting.len() > REPORTS_MAX {
        waiting.remove(0);
    }
}

/// `value` within the API's range of a `member` of `shape`. `counts` has changes by `name`.
fn clamped(value: f64, [shape, member]: [&str; 2], name: &'static str, counts: &mut Rejects) -> f64 {
    let mut ranges = ranges_by_shape();
    let known = ranges.find(|(of, (name, _))| (*of, *name) == (shape, member));
    debug_assert!(known.is_some(), "{shape} has no {member}");
    let Some((_, (_, range))) = known.filter(|(_, (_, range))| !range.contains(&value)) else {
        return value;
    };
    counts.count(name);
    value.clamp(*range.start(), *range.end())
}

fn asc_report(t_s: f64, state: &MeasuredState, steered: bool, counts: &mut Rejects) -> AscReport {
    let mut within = |value: f64, place, name| clamped(value, place, name, counts);
    let current = state.current.map(|current| Current {
        north_mps: within(current.x, ["Current", "north_mps"], "current"),
        east_mps: within(current.y, ["Current", "east_mps"], "current"),
    });
    let mut asc = |value: f64, member, name| within(value, ["Asc", member], name);
    let ground = state.ground_velocity;
    let state = Asc {
        north_m: IN_DEGREES,
        east_m: IN_DEGREES,
        lat_deg: Some(state.position.lat_deg),
        lon_deg: Some(state.position.lon_deg),
        heading_rad: state.heading,
        speed_mps: asc(state.water_velocity.x, "speed_mps", "speed"),
        sway_mps: asc(state.water_velocity.y, "sway_mps", "sway"),
        yaw_rate_radps: asc(state.yaw_rate, "yaw_rate_radps", "yaw rate"),
        ground_north_mps: ground.map(|velocity| asc(velocity.x, "ground_north_mps", "ground velocity")),
        ground_east_mps: ground.map(|velocity| asc(velocity.y, "ground_east_mps", "ground velocity")),
    };
    AscReport { t_s, state, current, steered, battery: None }
}

/// Position of a range's transducer (north, east) from the mission's `origin`, m. The bridge learns
/// the origin from the first plan; before that, the mission uses the craft's reported position.
fn from(origin: &Origin, fix: &AuvFix) -> Option<[f64; 2]> {
    let datum = Datum::new(&(*origin).into()).ok()?;
    datum.to_local(&fix.position.into()).ok().map(Into::into)
}

fn auv_report(fix: &AuvFix, sigma_m: f64, counts: &mut Rejects) -> Report {
    let mut within = |value: f64, member, name| clamped(value, ["Report", member], name, counts);
    let velocity = fix.ground_velocity;
    Report {
        t_s: fix.t_s,
        north_m: None,
        east_m: None,
        range_m: fix.range_m.map(|range| within(range, "range_m", "AUV's range")),
        travel: None,
        from: None,
        lat_deg: fix.range_m.is_none().then_some(fix.position.lat_deg),
        lon_deg: fix.range_m.is_none().then_some(fix.position.lon_deg),
        sigma_m: within(fix.sigma_m.unwrap_or(sigma_m), "sigma_m", "AUV's accuracy"),
        depth_m: fix.depth_m.map(|depth| within(depth, "depth_m", "AUV's depth")),
        course_rad: velocity.map(|velocity| angle_of(&velocity)),
        speed_mps: velocity.map(|velocity| within(velocity.norm(), "speed_mps", "AUV's speed")),
        turn_rate_radps: None,
    }
}

#[cfg(test)]
mod tests;
