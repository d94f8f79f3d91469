//! One mission under way: a mailbox, a clock, and what it came to. Whatever it tells is on the disk first.
//!
//! ```text
//! letters ──► mailbox ──► events ──► log ──► taken up ──► who watches, who streams
//!                         clock, every period ──► plan ──┘
//! ```

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};
use tokio::{
    sync::{
        broadcast,
        mpsc::{self, error::TryRecvError},
        oneshot, watch,
    },
    task::spawn_blocking,
    time::{sleep_until, timeout},
};

use super::{
    clock::Clock,
    event::Event,
    known::Known,
    log::{self, Answered, Append, Appended, Log},
};
use crate::{
    planners::Planners,
    problem::Problem,
    wire::{
        PlanResponse,
        mission::{Accepted, Live as LiveConfig, Mission, Reports, Status},
    },
};

mod live;
mod simulated;

pub(super) use live::Live;
pub(super) use simulated::Simulated;

/// Letters that may wait for a mission: some seconds of a few vehicles' reports.
const MAILBOX: usize = 32;

/// How long an actor of a mission that is over waits for another letter, such as one that is sent again.
const REST: Duration = Duration::from_secs(5);

/// Events that a reader of the stream may be behind before it misses some.
const STREAM: usize = 64;

/// What a mission is asked.
#[derive(Debug)]
pub(super) struct Letter {
    pub(super) order: Order,
    pub(super) key: Option<Key>,
    pub(super) told: oneshot::Sender<Result<Vec<u8>, Problem>>,
}

#[derive(Debug)]
pub(super) enum Order {
    /// Take this up.
    Hear(Box<Reports>),
    /// Begin or go on, so many seconds of it in one.
    Run(Option<f64>),
    /// Hold.
    Pause,
    /// Go on for so many plans.
    Step(u32),
    /// End.
    Finish,
}

/// A client's name for a request, by which it is known again.
#[derive(Clone, Debug)]
pub(crate) struct Key {
    pub(crate) key: String,
    /// Hash of what is asked.
    pub(crate) request: [u8; 32],
}

/// What everybody may see of a mission.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub(super) mission: Mission,
    /// The last plan.
    pub(super) plan: Option<Arc<Plan>>,
    /// Of whom nothing is known that another plan could rest on.
    pub(super) waits_for: Vec<String>,
    /// Plans that were due and not made.
    pub(super) missed: u64,
}

/// A plan that was stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Plan {
    /// Number of the event that stored it.
    pub(super) sequence: u64,
    /// When it was made, on the mission's clock, s.
    pub(super) time: f64,
    /// How long after it was due, s.
    pub(super) late: f64,
    pub(super) answer: PlanResponse,
    /// When each vehicle was last heard, on the mission's clock, s.
    pub(super) heard: BTreeMap<String, f64>,
}

/// What is kept of a mission beside its events, so that a start needs few of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Snapshot {
    /// What is known of a live mission.
    pub(super) known: Option<Known>,
    /// The last plan.
    pub(super) plan: Option<Arc<Plan>>,
}

/// An event as streams tell it.
#[derive(Clone, Debug)]
pub(super) struct Told {
    pub(super) sequence: u64,
    pub(super) kind: &'static str,
    pub(super) body: Arc<[u8]>,
}

/// A mission under way. It ends when its last handle is dropped.
#[derive(Clone, Debug)]
pub(super) struct Handle {
    pub(super) mailbox: mpsc::Sender<Letter>,
    pub(super) seen: watch::Receiver<Seen>,
    pub(super) stream: broadcast::WeakSender<Told>,
    /// What a live mission was made with.
    pub(super) live: Option<Arc<LiveMission>>,
}

/// What a live mission was made with.
#[derive(Debug)]
pub(super) struct LiveMission {
    pub(super) config: LiveConfig,
    pub(super) clock: Clock,
}

/// An actor of either kind.
trait Actor: Send {
    fn desk(&mut self) -> &mut Desk;
    /// When to go on, if the mission is running.
    fn due(&self) -> Instant;
    /// Carries out an order of a mission that is not over, and answers.
    fn carry_out(
        &mut self,
        order: Order,
        key: Option<Key>,
    ) -> impl Future<Output = Result<Vec<u8>, Problem>> + Send;
    fn go_on(&mut self) -> impl Future<Output = ()> + Send;
}

/// Lets an actor work as long as anybody has its handle and there is something to do.
async fn work(mut actor: impl Actor) {
    while !actor.desk().book.overtaken {
        // By turns, so that neither a flood of letters nor a slow disk keeps the other waiting.
        match actor.desk().mailbox.try_recv() {
            Ok(letter) => read(&mut actor, letter).await,
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => return,
        }
        let running = actor.desk().book.mission.status == Status::Running;
        let due = actor.due();
        if running && due <= Instant::now() {
            actor.go_on().await;
            continue;
        }
        tokio::select! {
            letter = actor.desk().letter() => match letter {
                Some(letter) => read(&mut actor, letter).await,
                None => return,
            },
            () = sleep_until(due.into()), if running => {}
        }
    }
}

async fn read(actor: &mut impl Actor, Letter { order, key, told }: Letter) {
    let answer = answer(actor, order, key).await;
    // Whoever asked may have gone.
    let _ = told.send(answer);
}

async fn answer(actor: &mut impl Actor, order: Order, key: Option<Key>) -> Result<Vec<u8>, Problem> {
    let book = &mut actor.desk().book;
    let over = book.mission.status.is_over();
    // Reports are looked up where they are stored.
    if let Some(key) = &key
        && (over || !matches!(order, Order::Hear(_)))
        && let Some(before) = answered(&book.log, &book.mission.id, key).await?
    {
        return Ok(before);
    }
    match (order, book.mission.status) {
        (Order::Finish, Status::Finished) | (Order::Pause, Status::Created | Status::Paused) => {
            book.unchanged(key).await
        }
        _ if over => Err(Problem::conflict("the mission is over")),
        (order, _) => actor.carry_out(order, key).await,
    }
}

/// What an actor of either kind works with.
#[derive(Debug)]
pub(super) struct Desk {
    pub(super) mailbox: mpsc::Receiver<Letter>,
    pub(super) book: Book,
    pub(super) planners: Planners,
}

impl Desk {
    /// The next letter. None when there will be no more: nobody has the handle, or the mission is over and nobody wrote.
    async fn letter(&mut self) -> Option<Letter> {
        if !self.book.mission.status.is_over() {
            return self.mailbox.recv().await;
        }
        if let Ok(letter) = timeout(REST, self.mailbox.recv()).await {
            return letter;
        }
        // What was sent until now is still read.
        self.mailbox.close();
        self.mailbox.recv().await
    }

    /// A desk for `mission`, and the handle to whoever will work there.
    pub(super) fn new(
        number: u64,
        mission: Mission,
        plan: Option<Arc<Plan>>,
        live: Option<Arc<LiveMission>>,
        log: Log,
        planners: Planners,
    ) -> (Self, Handle) {
        let (letters, mailbox) = mpsc::channel(MAILBOX);
        let (seen, watched) = watch::channel(Seen {
            mission: mission.clone(),
            plan,
            waits_for: vec![],
            missed: 0,
        });
        let (stream, _) = broadcast::channel(STREAM);
        let handle = Handle {
            mailbox: letters,
            seen: watched,
            stream: stream.downgrade(),
            live,
        };
        let book = Book {
            number,
            overtaken: false,
            mission,
            log,
            seen,
            stream,
        };
        let desk = Self {
            mailbox,
            book,
            planners,
        };
        (desk, handle)
    }
}

/// Where a mission is written down.
#[derive(Debug)]
pub(super) struct Book {
    /// Number of the mission in the log.
    pub(super) number: u64,
    /// Whether the mission was deleted or went on without this one, who should end then: the log knows better.
    pub(super) overtaken: bool,
    pub(super) mission: Mission,
    pub(super) log: Log,
    pub(super) seen: watch::Sender<Seen>,
    stream: broadcast::Sender<Told>,
}

/// What became of events that were to be stored.
pub(super) enum Stored {
    /// They are, and this is the answer.
    Now(Vec<u8>),
    /// The key had been answered before, so.
    Before(Vec<u8>),
}

impl Stored {
    pub(super) fn answer(self) -> Vec<u8> {
        match self {
            Self::Now(answer) | Self::Before(answer) => answer,
        }
    }
}

impl Book {
    /// Stores events of the mission, and then tells of them: what is not on the disk has not happened. `snapshot` is
    /// what all of it then comes to.
    pub(super) async fn store(
        &mut self,
        events: Vec<Event>,
        key: Option<Key>,
        snapshot: Option<Vec<u8>>,
    ) -> Result<Stored, Problem> {
        let mut after = self.mission.clone();
        let mut told = vec![];
        for event in &events {
            after.sequence += 1;
            take_up(&mut after, event);
            told.push(Told {
                sequence: after.sequence,
                kind: event.kind(),
                body: json(event).into(),
            });
        }
        let heard = matches!(events.first(), Some(Event::Reported { .. }));
        let answer = if heard {
            json(&Accepted {
                sequence: after.sequence,
            })
        } else {
            json(&after)
        };
        let append = Append {
            mission: after.id.clone(),
            number: Some(self.number),
            events: told.iter().map(stored).collect(),
            status: after.status.name().to_owned(),
            summary: json(&after),
            snapshot,
            answered: key.map(|Key { key, request }| Answered {
                key,
                request,
                answer: answer.clone(),
            }),
        };
        match self.log.append(append).await? {
            Appended::Now => {}
            Appended::Before(answer) => return Ok(Stored::Before(answer)),
            Appended::KeyTaken => return Err(Problem::KeyTaken),
            Appended::Gone => {
                self.overtaken = true;
                return Err(Problem::NoMission);
            }
            Appended::Overtaken => {
                self.overtaken = true;
                return Err(Problem::Behind);
            }
        }
        self.mission = after;
        let mission = self.mission.clone();
        self.seen.send_modify(|seen| seen.mission = mission);
        for told in told {
            // Nobody may be listening.
            let _ = self.stream.send(told);
        }
        Ok(Stored::Now(answer))
    }

    /// Shows the last plan, which is stored.
    fn show(&self, plan: Option<Arc<Plan>>) {
        self.seen.send_modify(|seen| {
            seen.plan = plan;
            seen.waits_for.clear();
        });
    }

    /// Answers a request that changes nothing, which is only remembered.
    pub(super) async fn unchanged(&mut self, key: Option<Key>) -> Result<Vec<u8>, Problem> {
        if key.is_none() {
            return Ok(json(&self.mission));
        }
        self.store(vec![], key, None).await.map(Stored::answer)
    }
}

/// What the key was answered with.
pub(super) async fn answered(log: &Log, mission: &str, key: &Key) -> Result<Option<Vec<u8>>, Problem> {
    let (log, mission, name) = (log.clone(), mission.to_owned(), key.key.clone());
    let before = spawn_blocking(move || log.reader()?.answered(&mission, &name));
    match before.await.map_err(|_| Problem::Panicked)?? {
        None => Ok(None),
        Some((asked, answer)) if asked == key.request => Ok(Some(answer)),
        Some(_) => Err(Problem::KeyTaken),
    }
}

fn stored(told: &Told) -> log::Event {
    log::Event {
        sequence: told.sequence,
        kind: told.kind.to_owned(),
        body: told.body.to_vec(),
    }
}

/// What an event makes of a mission, its knowledge apart.
fn take_up(mission: &mut Mission, event: &Event) {
    match event {
        Event::Created { .. } | Event::Reported { .. } => {}
        Event::Ran { at_s, speed_factor } => {
            mission.status = Status::Running;
            mission.started_s.get_or_insert(*at_s);
            mission.speed_factor = *speed_factor;
        }
        Event::Paused { .. } => mission.status = Status::Paused,
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

pub(super) fn json<T: serde::Serialize>(value: &T) -> Vec<u8> {
    serde_json::to_vec(value).expect("strings, numbers and lists only")
}
