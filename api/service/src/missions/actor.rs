//! The actor of one mission: commands, clock and state. Clients learn only stored events.
//!
//! ```text
//! requests ──► command ──► events ──► event store ──► state ──► view, event streams
//!              clock, every period ──► plan ──┘
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clock::Clock;
use planner::fleet::SlotUse;
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TryRecvError;
use tokio::sync::{broadcast, oneshot, watch};
use tracing::{Instrument as _, Span, error_span, info_span};

use super::clock::MissionClock;
use super::craft_state::CraftView;
use super::event::{Event, StoredAnswer, json};
use super::if_match::IfMatch;
use super::memory::MEMORY;
use super::state::MissionState;
use store::{Append, Appended, AuditEntry, EventStore, KeyedAnswer, Room, StoreError, StoredEvent};

use crate::edge::problem::Problem;
use crate::edge::quota::QuotaPermit;
use crate::limits::{EVENTS_BEHIND_MAX, MAILBOX};
use crate::metrics::{Counted, Shed};
use crate::planning::planners::Planners;
use wire::{
    Origin, Outcome,
    mission::{Accepted, Live, Mission, Reports, Setting, Status, Steering},
};

pub(super) mod live;
pub(super) mod simulated;

/// Time for which the actor of a finished mission waits for requests, such as a repeated one.
const REST: Duration = Duration::from_secs(5);

pub(super) const NO_REPORTS: &str = "a simulated mission makes its own reports; only live missions take them";

pub(super) const FIXED_SETTING: &str = "the scenario sets what a simulated mission does: create another mission with the goal, \
    the keep-outs and the craft in its scenario_file";

/// A command to a mission, and the channel of its reply. Without a client the reply is dropped.
#[derive(Debug)]
pub(super) struct Request {
    pub(super) command: Command,
    pub(super) key: Option<IdempotencyKey>,
    pub(super) if_match: IfMatch,
    pub(super) order: Option<AuditEntry>,
    pub(super) reply: oneshot::Sender<Result<Vec<u8>, Problem>>,
    pub(super) span: Span,
}

#[derive(Debug)]
pub(super) enum Command {
    /// Adds reports of vehicles, read with this origin.
    Report(Box<Reports>, Option<Origin>),
    /// Replaces members of the setting, read with this origin.
    Change(Box<Setting>, Option<Origin>),
    /// Starts or resumes the mission, with a speed factor for a simulated one.
    Run(Option<f64>),
    Pause,
    Step(u32),
    Finish,
}

/// A client's name for a request, which identifies repeated requests.
#[derive(Clone, Debug)]
pub(crate) struct IdempotencyKey {
    pub(crate) key: String,
    /// Hash of the request.
    pub(crate) request: [u8; 32],
}

impl IdempotencyKey {
    pub(super) fn with(self, answer: Vec<u8>) -> KeyedAnswer {
        let Self { key, request } = self;
        KeyedAnswer { key, request, answer }
    }

    pub(super) async fn answered(
        &self,
        store: &EventStore,
        mission: &str,
    ) -> Result<Option<Vec<u8>>, Problem> {
        let (store, mission, key) = (store.clone(), mission.to_owned(), self.key.clone());
        let machine = store.machine().clone();
        let before = machine.run_blocking(move || store.reader()?.answered(&mission, &key));
        match before.await.map_err(|_| Problem::Panicked)?? {
            None => Ok(None),
            Some((request, answer)) if request == self.request => Ok(Some(answer)),
            Some(_) => Err(Problem::KeyTaken),
        }
    }
}

/// The clients' view of a mission.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) mission: Arc<Mission>,
    /// The last plan of each craft.
    pub(super) plans: Vec<Arc<StoredPlan>>,
    pub(super) fleet: Vec<CraftView>,
    /// Vehicles whose recent reports the next plan needs and lacks.
    pub(super) waits_for: Vec<String>,
    /// The last report of whether the craft is steered; of a fleet, the worst.
    pub(super) steering: Option<Steering>,
    /// Slots of the acoustic network of a fleet, by its newest plans.
    pub(super) slots: Vec<Vec<SlotUse>>,
    pub(super) missed: u64,
    /// Time when the last report was stored, or the service was started.
    pub(super) reported: Instant,
}

impl View {
    /// The last plan of the craft of that name, or of the one of a mission of one.
    pub(super) fn plan(&self, craft: Option<&str>) -> Option<&Arc<StoredPlan>> {
        self.plans.iter().find(|plan| plan.craft.as_deref() == craft)
    }
}

/// The plan that stands for all of these: a degraded one of the newest, or the first of them.
pub(super) fn leading(plans: &[Arc<StoredPlan>]) -> Option<&Arc<StoredPlan>> {
    let newest = plans.iter().map(|plan| plan.time).fold(f64::NEG_INFINITY, f64::max);
    let newest = || plans.iter().filter(move |plan| plan.time == newest);
    let is_degraded = |plan: &&Arc<StoredPlan>| plan.answer.answer.outcome == Outcome::Degraded;
    newest().find(is_degraded).or_else(|| newest().next())
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct StoredPlan {
    /// The craft of a fleet that it is for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) craft: Option<String>,
    /// Number of the event that stored it.
    pub(super) sequence: u64,
    /// Its time on the mission's clock, s.
    pub(super) time: f64,
    /// Delay after its due time, s.
    pub(super) late: f64,
    pub(super) answer: StoredAnswer,
    /// Time when each vehicle was last heard, on the mission's clock, s.
    pub(super) heard: BTreeMap<String, f64>,
    /// Its time by a monotonic clock; `None` for a plan from before the start of the service.
    #[serde(skip)]
    pub(super) made: Option<Instant>,
}

impl StoredPlan {
    /// Its age by the clock of its mission, s. A simulated mission's clock shows `now`.
    pub(super) fn age(&self, live: Option<&LiveMission>, now: f64, machine: &Clock) -> f64 {
        let Some(LiveMission { clock, .. }) = live else {
            return now - self.time;
        };
        // The greater age counts: one is too small after the clock was set back, one after a sleep.
        let since = self.made.map_or(0.0, |made| machine.since(made).as_secs_f64());
        (clock.rate * since).max(clock.now(machine) - self.time)
    }
}

/// The fold of a mission's events, stored beside them so that a restart reads few events.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Checkpoint<S = MissionState> {
    /// The state of a live mission.
    #[serde(rename = "known")]
    pub(super) state: Option<S>,
    /// The last plan, that of the first craft of a fleet.
    pub(super) plan: Option<Arc<StoredPlan>>,
    /// The last plans of a fleet's other craft.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) others: Vec<Arc<StoredPlan>>,
}

impl<S> Checkpoint<S> {
    /// A mission's state with the last plans of its craft.
    pub(super) fn new(state: Option<S>, plans: &[Arc<StoredPlan>]) -> Self {
        let (plan, others) = plans.split_first().unzip();
        Self { state, plan: plan.cloned(), others: others.unwrap_or_default().to_vec() }
    }

    /// The last plan of each craft.
    pub(super) fn plans(&self) -> Vec<Arc<StoredPlan>> {
        self.plan.iter().chain(&self.others).cloned().collect()
    }
}

/// A handle to the actor of a mission. The actor ends when its last handle is dropped.
#[derive(Clone, Debug)]
pub(super) struct Handle {
    pub(super) requests: mpsc::Sender<Request>,
    pub(super) view: watch::Receiver<View>,
    pub(super) events: broadcast::WeakSender<StoredEvent>,
    pub(super) live: Option<Arc<LiveMission>>,
    pub(super) ownership: Ownership,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Ownership {
    /// Stored events carry it: the store refuses those of an earlier owner.
    pub(super) epoch: u64,
    /// The service's incarnation when it took the mission. A later one has lost the mission.
    pub(super) incarnation: u64,
}

#[derive(Debug)]
pub(super) struct LiveMission {
    pub(super) config: Live,
    pub(super) clock: MissionClock,
}

/// The part of an actor that differs between live and simulated missions.
pub(super) trait Actor: Send {
    fn context(&mut self) -> &mut Context;
    /// The next time to advance a running mission.
    fn due(&self) -> Instant;
    /// Executes a command of an unfinished mission, and answers it.
    fn execute(
        &mut self,
        command: Command,
        key: Option<IdempotencyKey>,
    ) -> impl Future<Output = Result<Vec<u8>, Problem>> + Send;
    fn advance(&mut self) -> impl Future<Output = ()> + Send;
}

/// Runs an actor until its last handle is dropped or its mission is over.
pub(super) async fn run(mut actor: impl Actor) {
    while !actor.context().superseded {
        // Requests and plans take turns, so that neither a flood nor a slow plan delays the other.
        match actor.context().try_next() {
            Ok(request) => serve(&mut actor, request).await,
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => return,
        }
        let running = actor.context().is_running();
        let due = actor.due();
        let clock = actor.context().clock().clone();
        if running && due <= clock.now() {
            let span = error_span!("advance", mission = actor.context().mission.id);
            actor.advance().instrument(span).await;
            continue;
        }
        tokio::select! {
            biased;
            request = actor.context().next_request() => match request {
                Some(request) => serve(&mut actor, request).await,
                None => return,
            },
            () = clock.sleep_until(due), if running => {}
        }
    }
}

async fn serve(actor: &mut impl Actor, request: Request) {
    actor.context().order = request.order;
    let answer = answer(actor, request.command, request.key, &request.if_match);
    let answer = answer.instrument(request.span).await;
    actor.context().order = None;
    let _ = request.reply.send(answer);
}

async fn answer(
    actor: &mut impl Actor,
    command: Command,
    key: Option<IdempotencyKey>,
    if_match: &IfMatch,
) -> Result<Vec<u8>, Problem> {
    let context = actor.context();
    let status = context.mission.status;
    // The store looks up the key of reports when it stores them.
    if let Some(key) = &key
        && (status.is_over() || !matches!(command, Command::Report(..)))
        && let Some(before) = key.answered(&context.store, &context.mission.id).await?
    {
        return Ok(before);
    }
    if_match.check(&context.mission)?;
    match (command, status) {
        (Command::Finish, Status::Finished) | (Command::Pause, Status::Created | Status::Paused) => {
            context.unchanged(key).await
        }
        _ if status.is_over() => Err(Problem::conflict("the mission is over: create a new one")),
        (command, _) => actor.execute(command, key).await,
    }
}

/// The part of an actor that live and simulated missions share.
#[derive(Debug)]
pub(super) struct Context {
    requests: mpsc::Receiver<Request>,
    /// A request that came during other work.
    called: Option<Request>,
    /// Number of the mission in the store.
    number: u64,
    epoch: u64,
    mission: Arc<Mission>,
    /// `true` ends the actor: the mission is deleted, moved, or has unknown events.
    superseded: bool,
    store: EventStore,
    view: watch::Sender<View>,
    events: broadcast::Sender<StoredEvent>,
    planners: Planners,
    order: Option<AuditEntry>,
    counted: Option<Counted>,
    memory: Option<QuotaPermit<Arc<str>>>,
}

/// The answer to a request after its events were stored.
struct Stored {
    answer: Vec<u8>,
    /// `false` if the key had this answer before.
    is_new: bool,
}

impl Context {
    /// The context of `mission`, and the handle to its actor.
    pub(super) fn new(
        (number, mission): (u64, Mission),
        ownership: Ownership,
        plans: Vec<Arc<StoredPlan>>,
        live: Option<(Arc<LiveMission>, QuotaPermit<Arc<str>>)>,
        store: EventStore,
        planners: Planners,
    ) -> (Self, Handle) {
        let (live, memory) = live.unzip();
        let mission = Arc::new(mission);
        let (requests_in, requests) = mpsc::channel(MAILBOX);
        let (view, view_out) = watch::channel(View {
            mission: Arc::clone(&mission),
            plans,
            fleet: vec![],
            waits_for: vec![],
            steering: None,
            slots: vec![],
            missed: 0,
            reported: planners.clock.now(),
        });
        let (events, _) = broadcast::channel(EVENTS_BEHIND_MAX);
        let handle =
            Handle { requests: requests_in, view: view_out, events: events.downgrade(), live, ownership };
        let context = Self {
            counted: count(&planners, &mission),
            memory,
            requests,
            called: None,
            number,
            epoch: ownership.epoch,
            mission,
            superseded: false,
            store,
            view,
            events,
            planners,
            order: None,
        };
        (context, handle)
    }

    fn clock(&self) -> &Clock {
        &self.planners.clock
    }

    /// Counts `bytes` of memory from now on. Fails if these are too many.
    fn hold(&mut self, bytes: usize) -> Result<(), Problem> {
        let resized = self.memory.as_mut().map_or(Ok(()), |memory| memory.resize(bytes));
        resized.map_err(|exceeded| {
            self.planners.metrics.shed(Shed::Limit);
            exceeded.problem(MEMORY)
        })
    }

    fn is_running(&self) -> bool {
        self.mission.status == Status::Running
    }

    /// `false` if no plan can be stored. A plan must steer nothing then: another service may steer.
    fn may_plan(&self) -> bool {
        self.store.lease().is_none_or(|lease| lease.incarnation().is_ok())
    }

    /// Waits for a request and keeps it for `try_next`, or until no handle is left.
    async fn called(&mut self) {
        if self.called.is_none() {
            self.called = self.requests.recv().await;
        }
    }

    fn try_next(&mut self) -> Result<Request, TryRecvError> {
        self.called.take().map_or_else(|| self.requests.try_recv(), Ok)
    }

    /// The next request; `None` without handles, or some time after the mission's end.
    async fn next_request(&mut self) -> Option<Request> {
        if !self.mission.status.is_over() {
            return self.requests.recv().await;
        }
        let clock = self.planners.clock.clone();
        if let Ok(request) = clock.timeout(REST, self.requests.recv()).await {
            return request;
        }
        // Serves requests that were already sent.
        self.requests.close();
        self.requests.recv().await
    }

    /// Stores events of the mission and then publishes them. An unstored event does not count.
    /// `checkpoint` is the fold of all events including these. A change of the setting needs it.
    async fn append(
        &mut self,
        events: &[Event],
        key: Option<IdempotencyKey>,
        checkpoint: Option<Checkpoint<&MissionState>>,
    ) -> Result<Stored, Problem> {
        let state = checkpoint.as_ref().and_then(|folded| folded.state);
        let mut after = Mission::clone(&self.mission);
        let mut stored = vec![];
        for event in events {
            apply(&mut after, event, state);
            stored.push(event.stored(after.sequence));
        }
        let after = Arc::new(after);
        let summary = json(&after);
        let answer = match events {
            [Event::Reported { heard, .. }] => json(&Accepted {
                sequence: after.sequence,
                origin: heard.origin,
                rejected: heard.rejected.clone(),
            }),
            _ => summary.clone(),
        };
        let append = Append {
            mission: after.id.clone(),
            number: Some(self.number),
            epoch: self.epoch,
            events: stored.clone(),
            status: after.status.name().to_owned(),
            summary,
            snapshot: checkpoint.as_ref().map(json),
            answered: key.map(|key| key.with(answer.clone())),
            // A command without effect is not an order.
            order: self.order.take_if(|_| !events.is_empty()),
            room: self.room_for(events.first()),
        };
        let append = self.store.append(append).instrument(info_span!("write"));
        let appended = append.await;
        // The store may have these events or others: the next actor reads it.
        self.superseded |= match &appended {
            Err(error) => *error == StoreError::Unanswered && self.store.lease().is_some(),
            Ok(Appended::MissionGone | Appended::OutOfSequence | Appended::NotOwner) => true,
            Ok(_) => false,
        };
        match appended? {
            Appended::Stored => {}
            Appended::AnsweredBefore(answer) => {
                return Ok(Stored { answer, is_new: false });
            }
            Appended::KeyTaken => return Err(Problem::KeyTaken),
            Appended::ShareUsed => return Err(Problem::DiskShare),
            Appended::MissionGone => return Err(Problem::NoMission),
            Appended::OutOfSequence | Appended::NotOwner => return Err(Problem::Behind),
        }
        for event in events {
            log(&after.id, event);
        }
        if after.status != self.mission.status {
            self.counted = count(&self.planners, &after);
        }
        self.mission = Arc::clone(&after);
        if self.mission.status.is_over() && self.store.lease().is_some() {
            // The mission is free: the next request starts it. Sent requests are answered.
            self.requests.close();
        }
        let is_report = matches!(events, [Event::Reported { .. }]);
        self.view.send_modify(|view| {
            view.mission = after;
            if is_report {
                view.reported = self.planners.clock.now();
            }
        });
        for event in stored {
            // Fails without readers.
            let _ = self.events.send(event);
        }
        Ok(Stored { answer, is_new: true })
    }

    /// The disk space for storing events that begin with this one.
    fn room_for(&self, first: Option<&Event>) -> Room {
        use Event::{ClockSet, Failed, Finished, Paused, Planned};
        match first {
            // A live mission's plan guides a craft, so it is stored in any case.
            Some(Planned(_)) if self.mission.kind == "live" => Room::Any,
            Some(Paused { .. } | Finished { .. } | Failed { .. } | ClockSet { .. }) => Room::Any,
            _ => Room::Share,
        }
    }

    /// These newest plans of craft, and the last ones of the others that the mission still `has`.
    fn with_others(
        &self,
        mut newest: Vec<Arc<StoredPlan>>,
        has: impl Fn(Option<&str>) -> bool,
    ) -> Vec<Arc<StoredPlan>> {
        let view = self.view.borrow();
        let others = view.plans.iter().filter(|other| newest.iter().all(|new| new.craft != other.craft));
        let others: Vec<_> = others.filter(|other| has(other.craft.as_deref())).cloned().collect();
        newest.extend(others);
        newest
    }

    /// Shows the last plan of each craft, and the slots of a fleet.
    fn show(&self, plans: Vec<Arc<StoredPlan>>, slots: Vec<Vec<SlotUse>>) {
        self.view.send_modify(|view| {
            (view.plans, view.slots) = (plans, slots);
            view.waits_for.clear();
        });
    }

    /// Answers a request that changes nothing, and stores its key.
    async fn unchanged(&mut self, key: Option<IdempotencyKey>) -> Result<Vec<u8>, Problem> {
        if key.is_none() {
            return Ok(json(&self.mission));
        }
        Ok(self.append(&[], key, None).await?.answer)
    }
}

fn count(planners: &Planners, mission: &Mission) -> Option<Counted> {
    let Mission { kind, status, .. } = mission;
    (!status.is_over()).then(|| planners.metrics.mission(kind, status.name()))
}

/// `true` for an event that changes a mission's setting or status.
fn changes(event: &Event) -> bool {
    use Event::{Assigned, ClockSet, Planned, Reported};
    !matches!(event, Reported { .. } | Planned(_) | Assigned(_) | ClockSet { .. })
}

fn log(mission: &str, event: &Event) {
    if let Event::Failed { reason, .. } = event {
        tracing::warn!(mission, reason, "a mission failed");
    } else if changes(event) {
        tracing::info!(mission, change = event.kind(), "a mission changed");
    }
}

/// Applies an event to the mission as clients see it. After a change, `state` has the new setting.
fn apply(mission: &mut Mission, event: &Event, state: Option<&MissionState>) {
    mission.sequence += 1;
    if changes(event) {
        mission.revision = mission.sequence;
    }
    match event {
        Event::Created { .. } | Event::ClockSet { .. } | Event::Assigned(_) => {}
        Event::Ran { at_s, speed_factor } => {
            mission.status = Status::Running;
            mission.started_s.get_or_insert(*at_s);
            mission.speed_factor = *speed_factor;
        }
        Event::Paused { .. } => mission.status = Status::Paused,
        Event::Reported { heard, .. } => mission.origin = mission.origin.or(heard.origin),
        Event::Changed { .. } => state.expect("is given with a change").show_in(mission),
        Event::Planned(planned) => mission.t_s = planned.t_s,
        Event::Finished { at_s } => {
            mission.status = Status::Finished;
            mission.finished_s = Some(*at_s);
        }
        Event::Failed { at_s, .. } => {
            mission.status = Status::Failed;
            mission.finished_s = Some(*at_s);
        }
    }
}
