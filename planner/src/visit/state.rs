//! Effect of a leg or a visit on the costs of all AUVs.

use nalgebra::Vector2;

use crate::facts::angle::wrap;
use crate::facts::ranges::AUVS_MAX;
use crate::facts::visit::Reduce;
use crate::visit::cost::{Later, ServicePlace};
use crate::visit::fleet::{Candidate, Fleet};
use crate::visit::intercept::{Arrival, Departure};

/// Relative difference of equal costs, from sums in another order.
pub(crate) const TIE: f64 = 1e-9;

/// Shortest passage that is a service, s; shorter ones are rounding.
const PASSED_MIN: f64 = 1e-6;

/// Straight pieces of a turn.
const TURN_PIECES: u8 = 6;

/// The costs of all candidates after some visits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CostState {
    /// Time, s after now.
    pub(crate) time: f64,
    /// The candidate that the craft is with; `None` at its present position.
    pub(crate) with: Option<usize>,
    /// Position relative to that, m, and heading, rad, in the craft's present frame.
    offset: Vector2<f64>,
    heading: f64,
    pub(crate) costs: [f64; AUVS_MAX],
    /// Integral over time of the weighted sum of the costs, in units of the cost times s.
    integral: f64,
    /// Largest weighted cost so far, relative to the mean weight.
    peak: f64,
    /// Candidates with a pending deadline.
    pub(crate) pending: u32,
    /// Candidates served after their deadline, and the total delay, s.
    missed: u32,
    late: f64,
}

/// A visit, in seconds after now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VisitWindow {
    pub(crate) candidate: usize,
    pub(crate) arrive: f64,
    pub(crate) leave: f64,
    pub(crate) cost_before: f64,
    pub(crate) cost_after: f64,
}

impl Fleet {
    pub(crate) fn start(&self) -> CostState {
        let mut costs = [0.0; AUVS_MAX];
        let (mut pending, mut peak) = (0, 0.0_f64);
        for (i, candidate) in self.candidates.iter().enumerate() {
            costs[i] = candidate.cost;
            peak = peak.max(self.relative(candidate) * candidate.cost);
            pending |= u32::from(candidate.deadline.is_some()) << i;
        }
        CostState {
            time: 0.0,
            with: None,
            offset: Vector2::zeros(),
            heading: 0.0,
            costs,
            integral: 0.0,
            peak,
            pending,
            missed: 0,
            late: 0.0,
        }
    }

    /// The craft at its departure after `state`.
    pub(crate) fn departure(&self, state: &CostState) -> Departure {
        let with = state.with.map(|with| self.candidates[with].track.at(state.time));
        Departure {
            time: state.time,
            position: with.unwrap_or_else(Vector2::zeros) + state.offset,
            heading: state.heading,
            detour: 0.0,
        }
    }

    /// The craft's earliest arrival at `to` after `state`.
    pub(crate) fn arrive(&self, state: &CostState, to: usize) -> Option<Arrival> {
        let (candidate, from) = (&self.candidates[to], self.departure(state));
        let before = state.with.map_or(0, |with| self.candidates[with].auv + 1);
        let detour = candidate.detours.get(before).copied().unwrap_or(0.0);
        self.craft.arrive(&candidate.track, &Departure { detour, ..from }, self.within, self.horizon)
    }

    /// The state after the leg to `to` with this arrival.
    pub(crate) fn travelled(&self, state: &CostState, to: usize, arrival: Arrival) -> CostState {
        let mut later = *state;
        let (start, auv) = (self.departure(state).position, self.candidates[to].track.at(arrival.time));
        let from = start + self.craft.current * arrival.turning;
        if state.with.is_none() {
            self.turn(&mut later, arrival);
        }
        later.offset = (from - auv) * (self.within / (from - auv).norm().max(self.within));
        if later.time < arrival.time {
            let way = (from, auv + later.offset);
            self.pass(&mut later, arrival.time, None, way);
        }
        later.with = Some(to);
        later.heading = arrival.heading;
        later
    }

    /// `true` if the craft surely passes candidate `who` in the turn towards `to`.
    pub(crate) fn turns_past(&self, who: usize, to: usize) -> bool {
        let mut state = self.start();
        let arrival = self.arrive(&state, to);
        arrival.is_some_and(|arrival| {
            self.turn(&mut state, arrival);
            let unserved = self.law.unserved(self.candidates[who].cost, state.time);
            state.costs[who] < unserved.cost * (1.0 - TIE)
        })
    }

    /// The turn before the leg that ends with `arrival`, in which the craft may pass AUVs.
    fn turn(&self, state: &mut CostState, arrival: Arrival) {
        let angle = wrap(arrival.heading - state.heading);
        let radius = self.tuned.kept_in_turn * self.speed_now / self.craft.turn_rate;
        let at = |share: f64| {
            let turned = share * angle;
            let aside = (1.0 - turned.cos()) * angle.signum();
            Vector2::new(turned.abs().sin(), aside) * radius + self.craft.current * (share * arrival.turning)
        };
        let share = |piece: u8| f64::from(piece) / f64::from(TURN_PIECES);
        for piece in (0..TURN_PIECES).filter(|_| 0.0 < arrival.turning) {
            let (before, after) = (share(piece), share(piece + 1));
            self.pass(state, after * arrival.turning, None, (at(before), at(after)));
        }
    }

    /// The craft's place while it serves an AUV at `depth`, m.
    pub(crate) fn service_place(&self, depth: f64) -> ServicePlace {
        ServicePlace { distance: self.arc, depth }
    }

    /// The state after a visit to `with` until `leave`, s after now, in which the craft approaches.
    pub(crate) fn visited_until(&self, state: &CostState, with: usize, leave: f64) -> CostState {
        let mut later = *state;
        let track = &self.candidates[with].track;
        let nearer = (self.craft.speed - track.fastest).max(0.0) * (leave - state.time);
        let distance = state.offset.norm();
        let nearest = self.arc.min(distance);
        later.offset *= (distance - nearer).max(nearest) / distance.max(f64::MIN_POSITIVE);
        let way = (track.at(state.time) + state.offset, track.at(leave) + later.offset);
        self.pass(&mut later, leave, Some(with), way);
        later
    }

    /// Advances to `end`, s after now, on a `way`, `with` a candidate or alone; serves the passed.
    pub(crate) fn pass(
        &self,
        state: &mut CostState,
        end: f64,
        with: Option<usize>,
        way: (Vector2<f64>, Vector2<f64>),
    ) {
        let start = state.time;
        for (i, candidate) in self.candidates.iter().enumerate() {
            let served =
                if with == Some(i) { Some((start, end)) } else { self.passed(candidate, (start, end), way) };
            let (from, until) = served.unwrap_or((end, end));
            let relative = self.relative(candidate);
            let take = |state: &mut CostState, later: Later| {
                state.integral += candidate.share * later.integral;
                state.peak = state.peak.max(relative * later.cost);
                state.costs[i] = later.cost;
            };
            if start < from {
                let later = self.law.unserved(state.costs[i], from - start);
                take(state, later);
            }
            if from < until {
                let place = self.service_place(candidate.track.depth_at(0.5 * (from + until)));
                let later = self.law.served(state.costs[i], until - from, place);
                take(state, later);
                self.note_service(state, i, from);
            }
            if from <= until && until < end {
                let later = self.law.unserved(state.costs[i], end - until);
                take(state, later);
            }
        }
        state.time = end;
    }

    /// The interval in which the craft, on `way` between these times, is near `candidate`.
    fn passed(
        &self,
        candidate: &Candidate,
        (start, end): (f64, f64),
        way: (Vector2<f64>, Vector2<f64>),
    ) -> Option<(f64, f64)> {
        let from = candidate.track.at(start) - way.0;
        let along = candidate.track.at(end) - way.1 - from;
        // ‖from + share · along‖ = within
        let (a, b) = (along.norm_squared(), from.dot(&along));
        let c = from.norm_squared() - self.within * self.within;
        let discriminant = b * b - a * c;
        let (first, last) = if a > 0.0 && discriminant > 0.0 {
            let root = discriminant.sqrt();
            ((-b - root) / a, (-b + root) / a)
        } else if a <= 0.0 && c <= 0.0 {
            (0.0, 1.0)
        } else {
            return None;
        };
        let at = |share: f64| start + (end - start) * share.clamp(0.0, 1.0);
        (at(first) + PASSED_MIN < at(last)).then(|| (at(first), at(last)))
    }

    /// Records the service of a candidate at `time`, s after now.
    fn note_service(&self, state: &mut CostState, candidate: usize, time: f64) {
        let bit = 1 << candidate;
        let Some(deadline) = self.candidates[candidate].deadline else {
            return;
        };
        if state.pending & bit != 0 {
            state.pending &= !bit;
            state.missed |= if deadline < time { bit } else { 0 };
            state.late += (time - deadline).max(0.0);
        }
    }

    /// Weight of a candidate relative to the mean weight.
    pub(crate) fn relative(&self, candidate: &Candidate) -> f64 {
        candidate.share * self.candidates.len() as f64
    }

    /// Cost of a state at the horizon, without missed deadlines.
    pub(crate) fn cost(&self, state: &CostState) -> f64 {
        self.reduced(state.integral, state.peak, self.sum(&state.costs), self.horizon)
    }

    /// Cost with missed deadlines. AUVs not yet served count as served at that time.
    pub(crate) fn value(&self, state: &CostState) -> f64 {
        self.cost(state) + self.penalty(state)
    }

    /// Order of states of similar times: costs at `time` without visits, and missed deadlines.
    pub(crate) fn rank(&self, state: &CostState, time: f64) -> f64 {
        let mut later = *state;
        for (i, candidate) in self.candidates.iter().enumerate() {
            let grown = self.law.unserved(state.costs[i], (time - state.time).max(0.0));
            later.costs[i] = grown.cost;
            later.integral += candidate.share * grown.integral;
            later.peak = later.peak.max(self.relative(candidate) * grown.cost);
        }
        later.time = time.max(state.time);
        let sum = self.sum(&later.costs);
        self.reduced(later.integral, later.peak, sum, later.time) + self.penalty(&later)
    }

    fn penalty(&self, state: &CostState) -> f64 {
        let (missed, late) = self.missed(state);
        self.deadline_price * (f64::from(missed.count_ones()) + late / self.horizon)
    }

    /// Candidates whose deadlines passed before the time of `state`, and the total delay, s.
    pub(crate) fn missed(&self, state: &CostState) -> (u32, f64) {
        let (mut missed, mut late) = (state.missed, state.late);
        for (i, candidate) in self.candidates.iter().enumerate() {
            let deadline = candidate.deadline.filter(|_| state.pending & (1 << i) != 0);
            if let Some(deadline) = deadline.filter(|deadline| *deadline < state.time) {
                missed |= 1 << i;
                late += state.time - deadline;
            }
        }
        (missed, late)
    }

    fn reduced(&self, integral: f64, peak: f64, sum: f64, time: f64) -> f64 {
        self.reduced_by(peak, (integral + self.afterwards * sum) / (time + self.afterwards))
    }

    /// The objective, from the largest relative cost and the mean.
    pub(crate) fn reduced_by(&self, peak: f64, mean: f64) -> f64 {
        match self.reduce {
            Reduce::Mean => mean,
            Reduce::Max => peak + self.tuned.mean_beside_max * mean,
        }
    }

    fn sum(&self, costs: &[f64; AUVS_MAX]) -> f64 {
        let weighted = self.candidates.iter().zip(costs);
        weighted.map(|(candidate, cost)| candidate.share * cost).sum()
    }

    /// A lower bound on [`Fleet::cost`] of all schedules that continue `state`: every candidate is
    /// served from the craft's first possible arrival to the end, at the least range.
    ///
    /// Costs increase with the previous cost and with the range, and decrease with earlier service.
    pub(crate) fn bound(&self, state: &CostState) -> f64 {
        let from = self.departure(state);
        let (mut integral, mut peak, mut costs) = (state.integral, state.peak, state.costs);
        for (i, candidate) in self.candidates.iter().enumerate() {
            let reached = if state.with == Some(i) {
                state.time
            } else {
                let reached = self.craft.reach(&candidate.track, &from, self.within, self.horizon);
                reached.unwrap_or(self.horizon)
            };
            let before = self.law.unserved(costs[i], reached - state.time);
            let place = self.service_place(candidate.shallowest);
            let after = self.law.served(before.cost, self.horizon - reached, place);
            integral += candidate.share * (before.integral + after.integral);
            peak = peak.max(self.relative(candidate) * before.cost);
            costs[i] = if reached < self.horizon { after.cost } else { before.cost };
        }
        self.reduced(integral, peak, self.sum(&costs), self.horizon)
    }
}
