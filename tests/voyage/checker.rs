//! The claims, and the history of a voyage.

use std::collections::{BTreeMap, VecDeque};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use super::faults::{Fault, Kind};
use super::{CLEAR_S, Course, Wire};

/// Number of events that a broken voyage shows.
const SHOWN: usize = 20;

/// Every claim, in a line: its name, and the part with its promise.
const CLAIMS: &str = "\
limits: bridge: no reference is faster, turns faster or accelerates more than the mission allows
rate: bridge: without faults, references are sent at their rate without a gap
heartbeat: bridge: nothing is sent without a heartbeat of the last 3 s
guided: bridge: nothing is sent to a craft that a person has taken over or disarmed
position: bridge: nothing is sent without a known position of the last 3 s
plan age: bridge: no plan is followed for longer than 10 s after its arrival
paused: bridge: a paused mission steers nothing
watchdog: craft: 3 s after its last reference the craft follows none
doubts: bridge: nothing is sent while positions or headings contradict each other
orders: bridge: nothing is armed and no mode is ordered after the first reference
resumes: all: the craft is steered again 30 s after the last fault
acknowledged: store: what was acknowledged is stored, at its number, once
plans: service: no client sees a plan that is not stored
one history: store: events have numbers without gaps, and none changes
one mission: service, bridge: restarts continue the mission
repeated: service: a repeated request has the same answer
no loss reported: store: a kill or a power cut loses nothing, and no loss is reported
one owner: two services: only the owner of a mission stores its events and answers with its plan, and only with a lease
take-over: two services: 2.75 s after one is gone the other has its missions, and the craft is steered on
replay: service: every plan can be made again, to the byte
named: bridge, service: each fault is named in the mission's log, with its consequence for the craft
clear: all: the craft keeps its distance from vessels that are heard and keep their course
silence: service: the operator is told of a vessel that is not heard any more
no alarm: bridge: without faults there is no alarm";

/// Every claim: its name, and the part with its promise.
pub fn claims() -> impl Iterator<Item = (&'static str, &'static str)> {
    CLAIMS.lines().filter_map(|line| line.split_once(": "))
}

/// An event.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Time since the start, s.
    pub t_s: f64,
    /// The part that acts.
    pub who: &'static str,
    /// Its action.
    pub what: String,
}

/// The checker of a voyage.
#[derive(Debug, Default)]
pub(super) struct Checker {
    pub(super) claims: BTreeMap<&'static str, u64>,
    pub(super) broken: Option<String>,
    pub(super) last: VecDeque<Entry>,
    digest: DefaultHasher,
    /// Texts in the mission's log and kinds of its events, at the end.
    pub(super) log: Vec<String>,
    /// Durations of sent references and, of these, of steering without a reservation, s.
    pub(super) steered_s: [f64; 2],
}

impl Checker {
    pub(super) fn note(&mut self, t_s: f64, who: &'static str, what: String) {
        (t_s.to_bits(), who, &what).hash(&mut self.digest);
        // After a broken claim, the history shows what led to it.
        if self.broken.is_none() {
            self.last.push_back(Entry { t_s, who, what });
            if SHOWN < self.last.len() {
                self.last.pop_front();
            }
        }
    }

    pub(super) fn claim(
        &mut self,
        t_s: f64,
        name: &'static str,
        holds: bool,
        otherwise: impl FnOnce() -> String,
    ) {
        *self.claims.entry(name).or_insert_with(|| {
            debug_assert!(claims().any(|(known, _)| known == name), "{name}");
            0
        }) += 1;
        if !holds && self.broken.is_none() {
            let broken = format!("broken at {t_s:.3} s: {name}: {}", otherwise());
            self.note(t_s, "checker", broken.clone());
            self.broken = Some(broken);
        }
    }

    pub(super) fn digest(&self) -> u64 {
        self.digest.finish()
    }

    /// Claims that every isolated fault is named, and that a voyage without faults has no alarm.
    pub(super) fn expect_names(
        &mut self,
        faults: &[Fault],
        pauses: &[[f64; 2]],
        course: Course,
        is_shared: bool,
    ) {
        if self.broken.is_some() {
            return;
        }
        let end_s = course.duration_s;
        let count = |log: &[String], text: &str| log.iter().filter(|line| line.contains(text)).count();
        if course.is_nominal {
            let is_alarm = |line: &&String| line.contains("warning") || line.contains("does not answer");
            let otherwise = self.log.iter().find(is_alarm).cloned().unwrap_or_default();
            self.claim(end_s, "no alarm", otherwise.is_empty(), || otherwise.clone());
        }
        let mut expected: BTreeMap<&str, usize> = BTreeMap::new();
        let is_clear = |number: usize, fault: &Fault| {
            let quiet = faults[..number]
                .iter()
                .all(|before| before.ends_s + before.kind.doubted_s() + CLEAR_S < fault.begins_s);
            let paused =
                pauses.iter().any(|[from, to]| *from < fault.ends_s && fault.begins_s < to + CLEAR_S);
            fault.is_alone && quiet && !paused
        };
        for (number, fault) in faults.iter().enumerate() {
            if !is_clear(number, fault) {
                continue;
            }
            if let Some(text) = name_of(fault, is_shared, course.wire) {
                *expected.entry(text).or_default() += 1;
            }
        }
        for (text, times) in expected {
            let found = count(&self.log, text);
            self.claim(end_s, "named", times <= found, || {
                format!("{text:?} is {found} times in the log, expected {times}")
            });
        }
    }
}

/// Name of a fault in the mission's log.
fn name_of(fault: &Fault, is_shared: bool, wire: Wire) -> Option<&'static str> {
    let takes = fault.ends_s - fault.begins_s;
    match fault.kind {
        Kind::NoHeartbeat => Some("no heartbeat of the autopilot"),
        Kind::PositionUnknown => Some("no recent position"),
        Kind::TakenOver => Some("left its guided mode"),
        // Neither a helm nor DUNE is armed.
        Kind::Disarmed if wire != Wire::Mavlink => Some("left its guided mode"),
        Kind::Disarmed => Some("not armed"),
        Kind::TwoReceivers => {
            Some("two receivers, or two vehicles with one system number; no references are sent")
        }
        Kind::TwoCompasses => {
            Some("two compasses, or two vehicles with one system number; no references are sent")
        }
        Kind::PositionFrozen => Some("the position does not change"),
        Kind::PositionJumped => Some("the position jumped"),
        Kind::NetworkCut => Some("does not answer"),
        Kind::ServiceKilled | Kind::PowerLostAshore if 8.0 < takes && !is_shared => Some("does not answer"),
        // The other one may own the mission.
        Kind::ClockSetAshore if 2.0 < fault.size.abs() && !is_shared => Some("clock_set"),
        _ => None,
    }
}
