//! The candidates for visits and the craft, in the frame of the present craft.

use nalgebra::Vector2;

use crate::coast::way::Search;
use crate::estimate::legs::PastWork;
use crate::facts::angle::ned_from_body;
use crate::facts::visit::{Reduce, VisitCost, Visits};
use crate::predict::forecast::AuvForecast;
use crate::predict::motion::Motion;
use crate::snapshot::build::Snapshot;
use crate::tuned::VisitNumbers;
use crate::visit::depth::DepthAhead;
use crate::visit::intercept::{Craft, SampledTrack};

/// Most ways round no-go areas that are searched for a schedule: between all pairs of eight AUVs.
const WAYS_MAX: usize = 36;

/// Parameters of the scheduling.
#[derive(Clone, Debug, PartialEq)]
pub struct SchedulingParameters {
    /// Shortest horizon, s.
    pub horizon_min: f64,
    /// Longest horizon, s.
    pub horizon_max: f64,
    /// Horizon as a multiple of the time for one visit to each AUV.
    pub horizon_tours: f64,
    /// Largest number of visits in the search; if it covers all sequences, it is optimal.
    pub visits_tried: usize,
    /// Share of its cost by which another next visit must be better than that of the previous
    /// schedule; twice that if not all sequences were compared.
    pub keep_margin: f64,
    /// Price of a missed deadline, as a multiple of the cost without any service.
    pub deadline_price: f64,
    /// Longest time for which an AUV without a path is foreseen to keep its course at the mean, s.
    pub straight_most: f64,
}

impl Default for SchedulingParameters {
    fn default() -> Self {
        Self {
            horizon_min: 1800.0,
            horizon_max: 7200.0,
            horizon_tours: 3.0,
            visits_tried: 24_000,
            // Exceeds the noise of costs, and is below an operator's notion of better.
            keep_margin: 0.03,
            // Exceeds any benefit of missing a deadline.
            deadline_price: 10.0,
            straight_most: f64::INFINITY,
        }
    }
}

/// An AUV that can be visited.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// Its index in the snapshot.
    pub(crate) auv: usize,
    pub(crate) track: SampledTrack,
    /// Weight of its cost; the sum over all is 1.
    pub(crate) share: f64,
    pub(crate) cost: f64,
    /// Its pending deadline, s after now.
    pub(crate) deadline: Option<f64>,
    /// Least slant range at which it can be served, m.
    pub(crate) shallowest: f64,
    /// Detours to it round no-go areas, m, from the craft and each AUV; infinite without a way.
    pub(crate) detours: Vec<f64>,
}

/// The scheduling problem.
#[derive(Clone, Debug)]
pub(crate) struct Fleet {
    pub(crate) tuned: VisitNumbers,
    pub(crate) craft: Craft,
    pub(crate) speed_now: f64,
    /// From near to far, whatever names and order: a mirror image has the same order but for ties.
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) law: VisitCost,
    pub(crate) within: f64,
    /// Distance from an AUV that is served, m: 0 right above, or the radius of an arc.
    pub(crate) arc: f64,
    pub(crate) dwell_min: f64,
    pub(crate) reduce: Reduce,
    pub(crate) horizon: f64,
    /// Time for which the costs at the horizon count, s: the mean time to the next service.
    pub(crate) afterwards: f64,
    pub(crate) deadline_price: f64,
    /// Indices in the snapshot of AUVs that the craft does not reach within the horizon.
    pub(crate) out_of_reach: Vec<usize>,
}

/// An AUV that the goal depends on, with its cost and deadline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScheduledAuv {
    /// Its index in the snapshot.
    pub(crate) auv: usize,
    pub(crate) weight: f64,
    pub(crate) cost: f64,
    /// Deadline, s after now.
    pub(crate) deadline: Option<f64>,
}

impl Fleet {
    /// The `members` that the craft of `snapshot` can visit at this speed and turn rate.
    pub(crate) fn new(
        snapshot: &Snapshot,
        visits: &Visits,
        members: &[ScheduledAuv],
        (forecasts, depths): (&[AuvForecast], &[DepthAhead]),
        (speed, turn_rate): (f64, f64),
        parameters: &SchedulingParameters,
        ways: &Search<'_>,
    ) -> Self {
        let craft_from_ned = ned_from_body(snapshot.asc.heading().radians()).transpose();
        let here = snapshot.asc.position();
        let craft = Craft { speed, turn_rate, current: craft_from_ned * snapshot.current() };
        let frame = |motion: &Motion| craft_from_ned * (motion.position - here);
        let mut members = members.to_vec();
        let place = |member: &ScheduledAuv| frame(&forecasts[member.auv].at(0.0));
        members.sort_by(|a, b| in_order(&place(a), &place(b)));
        let places: Vec<_> = members.iter().map(place).collect();
        let tour = tour(&places, &craft, visits.dwell_min());
        let horizon = (parameters.horizon_tours * tour).clamp(parameters.horizon_min, parameters.horizon_max);
        let candidate = |member: &ScheduledAuv| {
            let forecast = &forecasts[member.auv];
            let (track, here) = (&snapshot.estimates()[member.auv].track, forecast.at(0.0).position);
            let mut past = PastWork::of(track, &here, snapshot.tuned().visit.first_turn);
            past.between_turns = past.between_turns.min(parameters.straight_most);
            let depth = |time| depths[member.auv].at(time);
            let track = SampledTrack::new(forecast, past, horizon, &craft.current, frame, depth);
            Candidate {
                auv: member.auv,
                share: member.weight,
                cost: member.cost,
                deadline: member.deadline.filter(|deadline| *deadline < horizon),
                shallowest: track.shallowest(),
                detours: Vec::new(),
                track,
            }
        };
        let mut fleet = Self {
            tuned: snapshot.tuned().visit,
            craft,
            speed_now: snapshot.asc.speed_mps.clamp(0.0, speed),
            candidates: members.iter().map(candidate).collect(),
            law: visits.cost,
            within: visits.within(),
            arc: visits.arc(),
            dwell_min: visits.dwell_min(),
            reduce: visits.reduce,
            horizon,
            afterwards: 0.5 * tour,
            deadline_price: 0.0,
            out_of_reach: Vec::new(),
        };
        if !ways.land.is_empty() {
            fleet.find_detours(here, |auv| forecasts[auv].at(0.0).position, forecasts.len(), ways);
        }
        fleet.drop_unreachable();
        fleet.deadline_price = parameters.deadline_price * fleet.without_visits();
        fleet
    }

    /// The same problem with other candidates.
    pub(crate) fn with(&self, candidates: Vec<Candidate>) -> Self {
        Self { candidates, out_of_reach: Vec::new(), ..*self }
    }

    /// The detours from the craft, `here`, to all candidates, then between these, which are `at`
    /// their present places; the first [`WAYS_MAX`] of them.
    fn find_detours(
        &mut self,
        here: Vector2<f64>,
        at: impl Fn(usize) -> Vector2<f64>,
        n: usize,
        ways: &Search<'_>,
    ) {
        let auvs: Vec<usize> = self.candidates.iter().map(|candidate| candidate.auv).collect();
        for candidate in &mut self.candidates {
            candidate.detours = vec![0.0; n + 1];
        }
        let from_craft = (0..auvs.len()).map(|to| (None, to));
        let between = (0..auvs.len()).flat_map(|to| (0..to).map(move |from| (Some(from), to)));
        for (from, to) in from_craft.chain(between).take(WAYS_MAX) {
            let begin = from.map_or(here, |from| at(auvs[from]));
            let detour = ways.detour(&begin, &at(auvs[to]));
            self.candidates[to].detours[from.map_or(0, |from| auvs[from] + 1)] = detour;
            if let Some(from) = from {
                self.candidates[from].detours[auvs[to] + 1] = detour;
            }
        }
    }

    /// Drops the candidates out of reach and normalises the shares of the others.
    fn drop_unreachable(&mut self) {
        let start = self.start();
        let (reached, out): (Vec<_>, Vec<_>) =
            (0..self.candidates.len()).partition(|to| self.arrive(&start, *to).is_some());
        let [candidates, others] = [reached, out]
            .map(|places| places.iter().map(|i| self.candidates[*i].clone()).collect::<Vec<_>>());
        self.out_of_reach = others.iter().map(|candidate| candidate.auv).collect();
        let sum: f64 = candidates.iter().map(|candidate| candidate.share).sum();
        self.candidates = candidates;
        for candidate in &mut self.candidates {
            candidate.share /= sum;
        }
    }

    /// The cost without any service.
    fn without_visits(&self) -> f64 {
        let mut state = self.start();
        self.pass(&mut state, self.horizon, None, (Vector2::zeros(), Vector2::zeros()));
        self.cost(&state).max(f64::MIN_POSITIVE)
    }
}

/// Approximate time of a tour, s: from each point to the nearest other, and the least stay there.
fn tour(places: &[Vector2<f64>], craft: &Craft, dwell: f64) -> f64 {
    let nearest = |from: &Vector2<f64>| {
        let others = places.iter().filter(|to| *to != from);
        let distance = others.map(|to| (to - from).norm()).fold(f64::INFINITY, f64::min);
        if distance.is_finite() { distance } else { 0.0 }
    };
    places.iter().map(|from| dwell + nearest(from) / craft.speed).sum()
}

/// From near to far, to the millimetre, then from ahead to astern, then from starboard to port.
fn in_order(a: &Vector2<f64>, b: &Vector2<f64>) -> std::cmp::Ordering {
    // Rounding makes −0 of small negative numbers, which is before 0.
    let millimetres = |metres: f64| (1e3 * metres).round() + 0.0;
    let apart = millimetres(a.norm()).total_cmp(&millimetres(b.norm()));
    let ahead = millimetres(b.x).total_cmp(&millimetres(a.x));
    apart.then(ahead).then(b.y.total_cmp(&a.y)).then(b.x.total_cmp(&a.x))
}
