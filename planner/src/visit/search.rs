//! The search over sequences of visits.
//!
//! Tours by the clock and the previous schedule come first, as upper bounds. Then visits are tried
//! in order of time, slot by slot. Sequences that cannot become better than the best known schedule
//! are dropped (branch and bound, for few AUVs); in each slot the most promising remain (beam), of
//! many AUVs only those with the greatest cost over the time until they are served. If the beam
//! drops none, the result is optimal. Counts bound the work, so equal problems have equal
//! results.

use std::cell::Cell;

use smallvec::SmallVec;

use crate::facts::ranges::AUVS_MAX;
use crate::visit::cost::Dwells;
use crate::visit::fleet::Fleet;
use crate::visit::state::{CostState, TIE, VisitWindow};

/// Slots of time in which schedules are compared with each other.
const SLOTS: usize = 60;

/// Most candidates with bounds: each bound costs an arrival for every candidate.
const BOUNDED_MAX: usize = 4;

/// Times of service per visit with more candidates.
const DWELLS_OF_MANY: usize = 3;

/// Most candidates with which each visit is followed by every other candidate.
const ALL_NEXT_MAX: usize = 8;

/// Candidates tried after each visit: with 15, 16 AUVs cost as much in 2.5 times the time.
const NEXT_OF_MANY: usize = 5;

/// Times of service of a tour, s beyond the least one.
const TOUR_DWELLS: [f64; 4] = [0.0, 30.0, 90.0, 210.0];

/// Most visits of a tour; adjacent AUVs would allow thousands.
const TOUR_VISITS_MAX: usize = 500;

/// Most arrivals and visits computed, as a multiple of the visits tried: AUVs minutes apart need a
/// tenth; a search among adjacent AUVs would need thousands of times more.
const WORK: usize = 8;

/// Shortest planned visit, s.
const VISIT_MIN: f64 = 1.0;

/// The craft at an AUV, in a visit of the previous schedule.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PresentVisit {
    pub(crate) candidate: usize,
    /// Beginning of that visit, s after now, not positive.
    pub(crate) since: f64,
    /// Its planned end.
    pub(crate) leave: f64,
}

/// A visit to try: the candidate, and its duration, s.
pub(crate) type PlannedVisit = (usize, f64);

/// A schedule of the search.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) windows: Vec<VisitWindow>,
    /// Its cost without and with missed deadlines.
    pub(crate) cost: f64,
    pub(crate) value: f64,
    /// Candidates with missed deadlines, as bits.
    pub(crate) missed: u32,
    /// `true` if no sequence of these visits is better.
    pub(crate) exact: bool,
}

/// A sequence of visits, represented by its last one.
#[derive(Clone, Copy)]
struct Node {
    before: Option<usize>,
    window: VisitWindow,
    state: CostState,
}

/// The search for the best schedule that begins with one candidate.
struct Search<'a> {
    fleet: &'a Fleet,
    nodes: Vec<Node>,
    /// Nodes by the slot of their departure.
    slots: Vec<Vec<usize>>,
    /// The best complete schedule: its last node, its state at the end, and its value.
    best: Option<(usize, CostState, f64)>,
    exact: bool,
    /// Arrivals and stays that were computed.
    work: &'a Cell<usize>,
}

impl Fleet {
    /// The best schedule whose first visit is to `first`; `None` if the craft cannot reach it. It
    /// is at least as good as to continue with `before`, the rest of the previous schedule. Once
    /// `due`, or after much work, it is the best so far, or a visit without end.
    pub(crate) fn best_first(
        &self,
        first: usize,
        (present, before): (Option<PresentVisit>, &[PlannedVisit]),
        tried_max: usize,
        due: &dyn Fn() -> bool,
    ) -> Option<Found> {
        let n = self.candidates.len();
        let children = (n - 1).clamp(1, ALL_NEXT_MAX - 1) * 2;
        let width = (tried_max / (n * SLOTS * children)).max(2);
        let present = present.filter(|present| present.candidate == first);
        let (work, work_max) = (Cell::new(0), WORK * tried_max / n);
        let spent = |most: usize| due() || most <= work.get();
        let mut search = Search {
            fleet: self,
            nodes: Vec::new(),
            slots: vec![Vec::new(); SLOTS],
            best: None,
            exact: true,
            work: &work,
        };
        let least = self.dwell_min.max(VISIT_MIN);
        let tours = self.tours(first);
        // Long visits first: among adjacent AUVs the short ones would use up all the time.
        let tours = TOUR_DWELLS.iter().rev().flat_map(|dwell| tours.iter().map(move |order| (order, dwell)));
        for (order, dwell) in tours {
            let times = if order.len() < 2 { 1 } else { TOUR_VISITS_MAX };
            let again = order.iter().cycle().take(times);
            let visits = again.map(|to| (*to, (self.dwell_min + dwell).max(VISIT_MIN)));
            search.follow(visits, present, &|| spent(work_max / 2));
            if !search.exact {
                break;
            }
        }
        let inserted = before.first().filter(|(to, _)| *to != first);
        let rest = before.iter().map(|(to, dwell)| (*to, dwell.max(least)));
        let visits = inserted.map(|_| (first, least)).into_iter().chain(rest);
        // The previous schedule is always completed: it is short.
        search.follow(visits, present, &|| inserted.is_some() && due());
        search.visit(None, &self.start(), first, present);
        search.extend_all(width, &|| spent(work_max));
        search.found()
    }
}

impl Search<'_> {
    /// Extends all sequences by further visits, slot by slot, at most `width` from each slot.
    fn extend_all(&mut self, width: usize, due: &dyn Fn() -> bool) {
        for slot in 0..SLOTS {
            // Visits that begin and end in the last slot follow each other there.
            while !self.slots[slot].is_empty() {
                for node in self.promising(slot, width) {
                    if due() {
                        self.exact = false;
                        return;
                    }
                    let Node { before, window, state } = self.nodes[node];
                    if !self.bounded() {
                        self.complete(before, &window, &state);
                    }
                    for to in self.next(&state) {
                        self.visit(Some(node), &state, to, None);
                    }
                }
            }
        }
    }

    /// The next candidates: with many, those of the greatest cost until served, or with a deadline.
    fn next(&self, state: &CostState) -> SmallVec<[usize; AUVS_MAX]> {
        let (fleet, from) = (self.fleet, self.fleet.departure(state).position);
        let others = (0..fleet.candidates.len()).filter(|to| state.with != Some(*to));
        if fleet.candidates.len() <= ALL_NEXT_MAX {
            return others.collect();
        }
        let served = |to: usize| {
            let candidate = &fleet.candidates[to];
            let distance = (candidate.track.at(state.time) - from).norm() - fleet.within;
            let time = distance.max(0.0) / fleet.craft.speed + fleet.dwell_min.max(VISIT_MIN);
            let cost = fleet.law.unserved(state.costs[to], time).cost;
            (candidate.share * cost / time, to)
        };
        let mut served: SmallVec<[_; AUVS_MAX]> = others.map(served).collect();
        served.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let ranked = served.into_iter().enumerate();
        let tried = ranked.filter(|(rank, (_, to))| *rank < NEXT_OF_MANY || state.pending & (1 << to) != 0);
        tried.map(|(_, (_, to))| to).collect()
    }

    /// Follows these visits, at least one, until it is `due`; the last one continues to the end.
    fn follow(
        &mut self,
        visits: impl Iterator<Item = PlannedVisit>,
        mut present: Option<PresentVisit>,
        due: &dyn Fn() -> bool,
    ) {
        let (mut before, mut state) = (None, self.fleet.start());
        let start = self.nodes.len();
        for (to, dwell) in visits {
            let Some((arrive, there)) = self.arrival(&state, to) else {
                break;
            };
            let leave = present.take().map_or(arrive + dwell, |present| present.leave.max(arrive));
            let node = self.node(before, to, arrive, (&there, leave));
            (before, state) = (Some(self.nodes.len()), node.state);
            self.nodes.push(node);
            if self.fleet.horizon <= state.time {
                break;
            }
            if due() {
                self.exact = false;
                break;
            }
        }
        if let Some(last) = before {
            let Node { before, window, state } = self.nodes[last];
            self.complete(before, &window, &state);
        }
        // These nodes have no continuation.
        if self.best.is_none_or(|(last, ..)| last < start) {
            self.nodes.truncate(start);
        }
    }

    /// Adds every visit to `to` after `state`.
    fn visit(&mut self, before: Option<usize>, state: &CostState, to: usize, present: Option<PresentVisit>) {
        let horizon = self.fleet.horizon;
        let Some((arrive, there)) = self.arrival(state, to) else {
            return;
        };
        let dwells = self.dwells(&there, to);
        let mut leaves: SmallVec<[f64; 6]> = dwells.iter().map(|dwell| arrive + dwell).collect();
        if let Some(present) = present {
            // The rest of a present visit may be empty.
            let rests = [present.since + self.fleet.dwell_min, present.leave];
            leaves.extend(rests.map(|leave| leave.max(arrive)));
        }
        let earliest = before.map_or(0, |before| self.slot(self.nodes[before].state.time) + 1);
        for leave in leaves {
            let node = self.node(before, to, arrive, (&there, leave));
            if self.bounded() || horizon <= leave {
                self.complete(before, &node.window, &node.state);
            }
            if leave < horizon {
                let slot = self.slot(leave).max(earliest).min(SLOTS - 1);
                self.slots[slot].push(self.nodes.len());
                self.nodes.push(node);
            }
        }
    }

    /// The earliest arrival at `to`, s after now, and all costs then.
    fn arrival(&self, state: &CostState, to: usize) -> Option<(f64, CostState)> {
        self.work.set(self.work.get() + 1);
        let fleet = self.fleet;
        let arrival = fleet.arrive(state, to)?;
        Some((arrival.time, fleet.travelled(state, to, arrival)))
    }

    fn dwells(&self, there: &CostState, to: usize) -> Dwells {
        let place = self.fleet.service_place(self.fleet.candidates[to].track.depth_at(there.time));
        let least = self.fleet.dwell_min.max(VISIT_MIN);
        let law = self.fleet.law;
        let mut dwells = law.dwells(there.costs[to], place, least, &self.fleet.tuned);
        if !self.bounded() {
            dwells.truncate(DWELLS_OF_MANY);
        }
        dwells
    }

    /// The visit to `to` that arrives with the costs `there` and ends at `leave` or the horizon.
    fn node(&self, before: Option<usize>, to: usize, arrive: f64, (there, leave): (&CostState, f64)) -> Node {
        self.work.set(self.work.get() + 1);
        let leave = leave.min(self.fleet.horizon);
        let state = self.fleet.visited_until(there, to, leave);
        Node {
            before,
            window: VisitWindow {
                candidate: to,
                arrive,
                leave,
                cost_before: there.costs[to],
                cost_after: state.costs[to],
            },
            state,
        }
    }

    fn bounded(&self) -> bool {
        self.fleet.candidates.len() <= BOUNDED_MAX
    }

    /// Compares the best schedule with the one whose last `window` is extended to the horizon.
    fn complete(&mut self, before: Option<usize>, window: &VisitWindow, left: &CostState) {
        let end = self.fleet.visited_until(left, window.candidate, self.fleet.horizon);
        let value = self.fleet.value(&end);
        let better = |best: &(usize, CostState, f64)| value < best.2 - TIE * best.2.abs();
        if self.best.as_ref().is_none_or(better) {
            let window =
                VisitWindow { leave: self.fleet.horizon, cost_after: end.costs[window.candidate], ..*window };
            self.nodes.push(Node { before, window, state: end });
            self.best = Some((self.nodes.len() - 1, end, value));
        }
    }

    /// The nodes of a slot that are extended.
    fn promising(&mut self, slot: usize, width: usize) -> Vec<usize> {
        let fleet = self.fleet;
        let mut here = std::mem::take(&mut self.slots[slot]);
        if let (true, Some((_, _, known))) = (self.bounded(), self.best) {
            here.retain(|node| fleet.bound(&self.nodes[*node].state) < known);
        }
        if width < here.len() {
            self.exact = false;
            let end = fleet.horizon * (slot + 1) as f64 / SLOTS as f64;
            let mut ranked: Vec<_> =
                here.iter().map(|node| (fleet.rank(&self.nodes[*node].state, end), *node)).collect();
            ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            here = ranked.into_iter().take(width).map(|(_, node)| node).collect();
        }
        here
    }

    #[expect(clippy::cast_possible_truncation, reason = "a time within the horizon is in one of 60 slots")]
    fn slot(&self, time: f64) -> usize {
        ((time / self.fleet.horizon * SLOTS as f64) as usize).min(SLOTS - 1)
    }

    fn found(&self) -> Option<Found> {
        let (last, end, value) = self.best?;
        let mut windows = Vec::new();
        let mut at = Some(last);
        while let Some(node) = at {
            windows.push(self.nodes[node].window);
            at = self.nodes[node].before;
        }
        windows.reverse();
        // A present visit that need not continue is over.
        if 1 < windows.len() && windows[0].leave <= 0.0 {
            windows.remove(0);
        }
        Some(Found {
            windows,
            cost: self.fleet.cost(&end),
            value,
            missed: self.fleet.missed(&end).0,
            exact: self.exact && self.fleet.candidates.len() <= ALL_NEXT_MAX,
        })
    }
}
