//! The search over sequences of visits.
//!
//! Tours by the clock and the visits of the schedule before come first: no schedule is worse than they are. Then visits are tried in order of time, slot by slot. What cannot
//! become better than the best schedule known is left out (branch and bound, of few AUVs); of what remains in a slot, the most promising go on (beam). While none is left out for that, the result is the best
//! of all sequences. The work is bounded by counts, never by a clock, so that equal problems have equal results.

use std::cell::Cell;

use smallvec::SmallVec;

use crate::visit::{
    cost::Dwells,
    fleet::Fleet,
    state::{State, Stay, TIE},
};

/// Slots of time in which schedules are compared with each other.
const SLOTS: usize = 60;

/// Most candidates with which bounds are worth their time: each costs an arrival for every candidate.
const BOUNDED_MAX: usize = 4;

/// Times of service that are tried with more candidates than that.
const DWELLS_OF_MANY: usize = 3;

/// Times of service that a tour is tried with, s more than the least one.
const TOUR_DWELLS: [f64; 4] = [0.0, 30.0, 90.0, 210.0];

/// Most visits of a tour: of AUVs that are served side by side, one would have thousands.
const TOUR_VISITS_MAX: usize = 500;

/// Most arrivals and stays that are computed, as a multiple of the visits tried. AUVs that are minutes apart need a tenth of them. Of AUVs
/// side by side, whose visits take a second, a search would have thousands of times more.
const WORK: usize = 8;

/// Shortest visit that is planned, s.
const STAY_MIN: f64 = 1.0;

/// The craft with an AUV already, in the visit of the schedule before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Present {
    pub(crate) candidate: usize,
    /// When that visit began, s after now, not positive.
    pub(crate) since: f64,
    /// When it was to end.
    pub(crate) leave: f64,
}

/// A visit to be tried: the candidate, and for how long, s.
pub(crate) type Planned = (usize, f64);

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
#[derive(Clone, Copy)]
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
    /// Arrivals and stays that were computed.
    work: &'a Cell<usize>,
}

impl Fleet {
    /// The best schedule whose first visit is to `first`; none if the craft cannot reach it. `before` is what is left of the schedule
    /// before: it is no worse than to go on with that. Once `due`, or after much work, it is the best so far, or a visit that does not
    /// end.
    pub(crate) fn best_first(
        &self,
        first: usize,
        (present, before): (Option<Present>, &[Planned]),
        tried_max: usize,
        due: &dyn Fn() -> bool,
    ) -> Option<Found> {
        let n = self.candidates.len();
        let children = (n - 1).max(1) * 2;
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
        let least = self.dwell_min.max(STAY_MIN);
        let tours = self.tours(first);
        let tours = tours
            .iter()
            .flat_map(|order| TOUR_DWELLS.map(|dwell| (order, dwell)));
        for (order, dwell) in tours {
            let times = if order.len() < 2 { 1 } else { TOUR_VISITS_MAX };
            let again = order.iter().cycle().take(times);
            let visits = again.map(|to| (*to, (self.dwell_min + dwell).max(STAY_MIN)));
            search.sail(visits, present, &|| spent(work_max / 2));
            if !search.exact {
                break;
            }
        }
        let inserted = before.first().filter(|(to, _)| *to != first);
        let rest = before.iter().map(|(to, dwell)| (*to, dwell.max(least)));
        let visits = inserted.map(|_| (first, least)).into_iter().chain(rest);
        // What was scheduled goes on whatever the time: it is short.
        search.sail(visits, present, &|| inserted.is_some() && due());
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
                    let Node { before, stay, state } = self.nodes[node];
                    if !self.bounded() {
                        self.complete(before, &stay, &state);
                    }
                    for to in (0..self.fleet.candidates.len()).filter(|to| state.with != Some(*to)) {
                        self.visit(Some(node), &state, to, None);
                    }
                }
            }
        }
    }

    /// These visits one after the other until it is `due`, at least one, and the last to the end.
    fn sail(
        &mut self,
        visits: impl Iterator<Item = Planned>,
        mut present: Option<Present>,
        due: &dyn Fn() -> bool,
    ) {
        let (mut before, mut state) = (None, self.fleet.start());
        let start = self.nodes.len();
        for (to, dwell) in visits {
            let Some((arrive, there)) = self.arrival(&state, to) else {
                break;
            };
            let leave = present
                .take()
                .map_or(arrive + dwell, |present| present.leave.max(arrive));
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
            let Node { before, stay, state } = self.nodes[last];
            self.complete(before, &stay, &state);
        }
        // Nothing goes on from here.
        if self.best.is_none_or(|(last, ..)| last < start) {
            self.nodes.truncate(start);
        }
    }

    /// Adds every visit to `to` after `state`.
    fn visit(&mut self, before: Option<usize>, state: &State, to: usize, present: Option<Present>) {
        let horizon = self.fleet.horizon;
        let Some((arrive, there)) = self.arrival(state, to) else {
            return;
        };
        let dwells = self.dwells(&there, to);
        let mut leaves: SmallVec<[f64; 6]> = dwells.iter().map(|dwell| arrive + dwell).collect();
        if let Some(present) = present {
            // A visit that has begun: its rest, which may be none.
            let rests = [present.since + self.fleet.dwell_min, present.leave];
            leaves.extend(rests.map(|leave| leave.max(arrive)));
        }
        let earliest = before.map_or(0, |before| self.slot(self.nodes[before].state.time) + 1);
        for leave in leaves {
            let node = self.node(before, to, arrive, (&there, leave));
            if self.bounded() || horizon <= leave {
                self.complete(before, &node.stay, &node.state);
            }
            if leave < horizon {
                let slot = self.slot(leave).max(earliest).min(SLOTS - 1);
                self.slots[slot].push(self.nodes.len());
                self.nodes.push(node);
            }
        }
    }

    /// The earliest arrival at `to`, s after now, and all costs then.
    fn arrival(&self, state: &State, to: usize) -> Option<(f64, State)> {
        self.work.set(self.work.get() + 1);
        let fleet = self.fleet;
        let (track, from) = (&fleet.candidates[to].track, fleet.departure(state));
        let arrival = fleet.craft.arrive(track, &from, fleet.within, fleet.horizon)?;
        Some((arrival.time, fleet.travelled(state, to, arrival)))
    }

    fn dwells(&self, there: &State, to: usize) -> Dwells {
        let range = self.fleet.candidates[to].track.depth_at(there.time);
        let least = self.fleet.dwell_min.max(STAY_MIN);
        let mut dwells = self.fleet.law.dwells(there.costs[to], range, least);
        if !self.bounded() {
            dwells.truncate(DWELLS_OF_MANY);
        }
        dwells
    }

    /// The visit to `to` that arrives with the costs `there` and ends when it should leave, or at the end of the horizon.
    fn node(&self, before: Option<usize>, to: usize, arrive: f64, (there, leave): (&State, f64)) -> Node {
        self.work.set(self.work.get() + 1);
        let leave = leave.min(self.fleet.horizon);
        let state = self.fleet.stayed(there, to, leave);
        Node {
            before,
            stay: Stay {
                candidate: to,
                arrive,
                leave,
                cost_before: there.costs[to],
                cost_after: state.costs[to],
            },
            state,
        }
    }

    /// Whether bounds are used.
    fn bounded(&self) -> bool {
        self.fleet.candidates.len() <= BOUNDED_MAX
    }

    /// Compares the schedule that goes on with `stay`, at whose end all costs are `left`, until the end with the best.
    fn complete(&mut self, before: Option<usize>, stay: &Stay, left: &State) {
        let end = self.fleet.stayed(left, stay.candidate, self.fleet.horizon);
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
    fn promising(&mut self, slot: usize, width: usize) -> Vec<usize> {
        let fleet = self.fleet;
        let mut here = std::mem::take(&mut self.slots[slot]);
        if let (true, Some((_, _, known))) = (self.bounded(), self.best) {
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

    fn found(&self) -> Option<Found> {
        let (last, end, value) = self.best?;
        let mut stays = Vec::new();
        let mut at = Some(last);
        while let Some(node) = at {
            stays.push(self.nodes[node].stay);
            at = self.nodes[node].before;
        }
        stays.reverse();
        // A visit that has begun and need not go on is over.
        if 1 < stays.len() && stays[0].leave <= 0.0 {
            stays.remove(0);
        }
        Some(Found {
            stays,
            cost: self.fleet.cost(&end),
            value,
            missed: self.fleet.missed(&end).0,
            exact: self.exact,
        })
    }
}
