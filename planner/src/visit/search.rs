//! The search over sequences of visits.
//!
//! Visits are tried in order of time, slot by slot. What cannot become better than the best schedule known is left out (branch and
//! bound); of what remains in a slot, the most promising go on (beam). While none is left out for that, the result is the best
//! of all sequences. The work is bounded by counts, never by a clock, so that equal problems have equal results.

use smallvec::SmallVec;

use crate::visit::{
    fleet::Fleet,
    state::{State, Stay},
};

/// Slots of time in which schedules are compared with each other.
const SLOTS: usize = 60;

/// Most candidates with which bounds are worth their time: each costs an arrival for every candidate.
const BOUNDED_MAX: usize = 4;

/// Relative differences of cost that are none: what sums in another order leave.
pub(crate) const TIE: f64 = 1e-9;

/// The craft with an AUV already, in the visit of the schedule before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Present {
    pub(crate) candidate: usize,
    /// When that visit began, s after now, not positive.
    pub(crate) since: f64,
    /// When it was to end.
    pub(crate) leave: f64,
}

/// A schedule that was found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) stays: Vec<Stay>,
    /// What it costs, missed deadlines apart, and with them.
    pub(crate) cost: f64,
    pub(crate) value: f64,
    /// The candidates whose deadlines it misses, as bits.
    pub(crate) missed: u32,
    /// Whether no sequence of these visits is better.
    pub(crate) exact: bool,
}

/// A sequence of visits so far, as its last one.
struct Node {
    before: Option<usize>,
    stay: Stay,
    state: State,
}

/// The search for the best schedule that begins with one candidate.
struct Search<'a> {
    fleet: &'a Fleet,
    nodes: Vec<Node>,
    /// Nodes by the slot in which they leave.
    slots: Vec<Vec<usize>>,
    /// The best complete schedule: its last node, its state at the end, and its value.
    best: Option<(usize, State, f64)>,
    exact: bool,
}

impl Fleet {
    /// The best schedule whose first visit is to `first`; none if the craft cannot reach it.
    pub(crate) fn best_first(
        &self,
        first: usize,
        present: Option<Present>,
        tried_max: usize,
        due: &dyn Fn() -> bool,
    ) -> Option<Found> {
        let n = self.candidates.len();
        let children = (n - 1).max(1) * 2;
        let width = (tried_max / (n * SLOTS * children)).max(2);
        // One schedule that goes on as promises most, so that the bound has something to compare with.
        let greedy = Search::run(self, (first, present), 1, None, &|| false);
        let value = greedy.best.as_ref()?.2;
        let found = Search::run(self, (first, present), width, Some(value), due);
        let better = found.best.as_ref().is_some_and(|best| best.2 <= value);
        let chosen = if better { &found } else { &greedy };
        chosen.found(found.exact)
    }
}

impl<'a> Search<'a> {
    /// Goes on with at most `width` sequences from each slot. `known` is the value of a schedule that is known.
    fn run(
        fleet: &'a Fleet,
        (first, present): (usize, Option<Present>),
        width: usize,
        known: Option<f64>,
        due: &dyn Fn() -> bool,
    ) -> Self {
        let mut search = Self {
            fleet,
            nodes: Vec::new(),
            slots: vec![Vec::new(); SLOTS],
            best: None,
            exact: true,
        };
        let start = fleet.start();
        search.visit(
            None,
            &start,
            first,
            present.filter(|present| present.candidate == first),
        );
        for slot in 0..SLOTS {
            // Visits that begin and end in the last slot follow each other there.
            while !search.slots[slot].is_empty() {
                if due() {
                    search.exact = false;
                    return search;
                }
                for node in search.promising(slot, width, known) {
                    let state = search.nodes[node].state;
                    for to in (0..fleet.candidates.len()).filter(|to| state.with != Some(*to)) {
                        search.visit(Some(node), &state, to, None);
                    }
                }
            }
        }
        search
    }

    /// Adds every visit to `to` after `state`.
    fn visit(&mut self, before: Option<usize>, state: &State, to: usize, present: Option<Present>) {
        let fleet = self.fleet;
        let track = &fleet.candidates[to].track;
        let Some(arrival) = fleet
            .craft
            .arrive(track, &fleet.departure(state), fleet.within, fleet.horizon)
        else {
            return;
        };
        let there = fleet.travelled(state, to, arrival);
        let cost_before = there.costs[to];
        let dwells = fleet
            .law
            .dwells(cost_before, track.depth_at(arrival.time), fleet.dwell_min);
        let mut leaves: SmallVec<[f64; 6]> = dwells.iter().map(|dwell| arrival.time + dwell).collect();
        if let Some(present) = present {
            // A visit that has begun: its rest.
            let rests = [present.since + fleet.dwell_min, present.leave];
            leaves.extend(rests.into_iter().filter(|leave| arrival.time < *leave));
        }
        let before_slot = before.map_or(0, |before| self.slot(self.nodes[before].state.time) + 1);
        for leave in leaves {
            let leave = leave.min(fleet.horizon);
            let left = fleet.stayed(&there, to, leave);
            let stay = Stay {
                candidate: to,
                arrive: arrival.time,
                leave,
                cost_before,
                cost_after: left.costs[to],
            };
            self.complete(before, &stay, &there);
            if leave < fleet.horizon {
                let slot = self.slot(leave).max(before_slot).min(SLOTS - 1);
                self.nodes.push(Node {
                    before,
                    stay,
                    state: left,
                });
                self.slots[slot].push(self.nodes.len() - 1);
            }
        }
    }

    /// Compares the schedule that stays until the end, from `there` on, with the best.
    fn complete(&mut self, before: Option<usize>, stay: &Stay, there: &State) {
        let end = self.fleet.stayed(there, stay.candidate, self.fleet.horizon);
        let value = self.fleet.value(&end);
        let better = |best: &(usize, State, f64)| value < best.2 - TIE * best.2.abs();
        if self.best.as_ref().is_none_or(better) {
            let stay = Stay {
                leave: self.fleet.horizon,
                cost_after: end.costs[stay.candidate],
                ..*stay
            };
            self.nodes.push(Node {
                before,
                stay,
                state: end,
            });
            self.best = Some((self.nodes.len() - 1, end, value));
        }
    }

    /// The nodes of a slot from which to go on.
    fn promising(&mut self, slot: usize, width: usize, known: Option<f64>) -> Vec<usize> {
        let fleet = self.fleet;
        let mut here = std::mem::take(&mut self.slots[slot]);
        let known = known.into_iter().chain(self.best.as_ref().map(|best| best.2));
        let known = known.fold(f64::INFINITY, f64::min);
        if fleet.candidates.len() <= BOUNDED_MAX && known.is_finite() {
            here.retain(|node| fleet.bound(&self.nodes[*node].state) < known);
        }
        if width < here.len() {
            self.exact = false;
            #[expect(clippy::cast_precision_loss, reason = "at most 60 slots")]
            let end = fleet.horizon * (slot + 1) as f64 / SLOTS as f64;
            let mut ranked: Vec<_> = here
                .iter()
                .map(|node| (fleet.rank(&self.nodes[*node].state, end), *node))
                .collect();
            ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            here = ranked.into_iter().take(width).map(|(_, node)| node).collect();
        }
        here
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a time within the horizon is in one of 60 slots"
    )]
    fn slot(&self, time: f64) -> usize {
        ((time / self.fleet.horizon * SLOTS as f64) as usize).min(SLOTS - 1)
    }

    fn found(&self, exact: bool) -> Option<Found> {
        let (last, end, value) = self.best?;
        let mut stays = Vec::new();
        let mut at = Some(last);
        while let Some(node) = at {
            stays.push(self.nodes[node].stay);
            at = self.nodes[node].before;
        }
        stays.reverse();
        Some(Found {
            stays,
            cost: self.fleet.cost(&end),
            value,
            missed: self.fleet.missed(&end).0,
            exact,
        })
    }
}
