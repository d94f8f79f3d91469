//! The AUVs that may be visited and the craft that visits them, seen from the craft now.

use nalgebra::Vector2;

use crate::{
    estimate::legs::between_turns,
    facts::{
        angle::ned_from_body,
        visit::{Reduce, VisitCost, Visits},
    },
    predict::{forecast::AuvForecast, motion::Motion},
    snapshot::build::Snapshot,
    visit::{
        depth::DepthAhead,
        intercept::{Craft, Track},
    },
};

/// How schedules are made.
#[derive(Clone, Debug, PartialEq)]
pub struct SchedulingParameters {
    /// Shortest time that is planned, s.
    pub horizon_min: f64,
    /// Longest, s.
    pub horizon_max: f64,
    /// Time that is planned, as a multiple of what one visit to each AUV takes.
    pub horizon_tours: f64,
    /// Visits that the search may try in all. With so few AUVs that this is enough for all sequences the schedule is the best
    /// there is.
    pub visits_tried: usize,
    /// By what share of its cost another next visit must be better than that of the schedule before; twice that where not all
    /// sequences were compared.
    pub keep_margin: f64,
    /// What a missed deadline costs, as a multiple of what it costs to serve no AUV at all.
    pub deadline_price: f64,
}

impl Default for SchedulingParameters {
    fn default() -> Self {
        Self {
            horizon_min: 1800.0,
            horizon_max: 7200.0,
            horizon_tours: 3.0,
            visits_tried: 24_000,
            // Above what noisy fixes change a cost by from one second to the next, below what an operator would call better.
            keep_margin: 0.03,
            // Above anything that a deadline could be missed for.
            deadline_price: 10.0,
        }
    }
}

/// An AUV that may be visited.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// Its place among the snapshot's AUVs.
    pub(crate) auv: usize,
    pub(crate) track: Track,
    /// How much its cost counts; the sum over all is 1.
    pub(crate) share: f64,
    /// Its cost now.
    pub(crate) cost: f64,
    /// The deadline by which it is yet to be served, s after now.
    pub(crate) deadline: Option<f64>,
    /// Least slant range at which it can be served, m.
    pub(crate) shallowest: f64,
}

/// The problem of a schedule.
#[derive(Clone, Debug)]
pub(crate) struct Fleet {
    pub(crate) craft: Craft,
    /// Its speed through the water now, m/s.
    pub(crate) speed_now: f64,
    /// From starboard to port, so that no name and no order of the request decides anything, and ties go to starboard.
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) law: VisitCost,
    pub(crate) within: f64,
    pub(crate) dwell_min: f64,
    pub(crate) reduce: Reduce,
    /// Time that is planned, s.
    pub(crate) horizon: f64,
    /// Time for which the costs at the end of the horizon count, s: that until an AUV is served again, on average.
    pub(crate) afterwards: f64,
    /// What a deadline that is missed costs.
    pub(crate) deadline_price: f64,
    /// AUVs that the craft does not reach within the horizon, by their place among the snapshot's.
    pub(crate) out_of_reach: Vec<usize>,
}

/// An AUV that the goal depends on, as the caller knows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// Its place among the snapshot's AUVs.
    pub(crate) auv: usize,
    pub(crate) weight: f64,
    pub(crate) cost: f64,
    /// s after now.
    pub(crate) deadline: Option<f64>,
}

impl Fleet {
    /// The `members` that can be visited by the craft of `snapshot`, which goes at most `speed`, m/s, through the water and turns
    /// at `turn_rate`, rad/s.
    pub(crate) fn new(
        snapshot: &Snapshot,
        visits: &Visits,
        members: &[Member],
        (forecasts, depths): (&[AuvForecast], &[DepthAhead]),
        (speed, turn_rate): (f64, f64),
        parameters: &SchedulingParameters,
    ) -> Self {
        let craft_from_ned = ned_from_body(snapshot.asc.heading().radians()).transpose();
        let here = snapshot.asc.position();
        let craft = Craft {
            speed,
            turn_rate,
            current: craft_from_ned * snapshot.current(),
        };
        let frame = |motion: &Motion| craft_from_ned * (motion.position - here);
        let mut members = members.to_vec();
        let place = |member: &Member| frame(&forecasts[member.auv].at(0.0));
        members.sort_by(|a, b| in_order(&place(a), &place(b)));
        let places: Vec<_> = members.iter().map(place).collect();
        let tour = tour(&places, &craft, visits.dwell_min_s);
        let horizon = (parameters.horizon_tours * tour).clamp(parameters.horizon_min, parameters.horizon_max);
        let candidate = |member: &Member| {
            let between_turns = between_turns(&snapshot.estimates()[member.auv].track);
            let track = Track::new(
                &forecasts[member.auv],
                between_turns,
                horizon,
                &craft.current,
                frame,
                |time| depths[member.auv].at(time),
            );
            Candidate {
                auv: member.auv,
                share: member.weight,
                cost: member.cost,
                deadline: member.deadline.filter(|deadline| *deadline < horizon),
                shallowest: track.shallowest(),
                track,
            }
        };
        let mut fleet = Self {
            craft,
            speed_now: snapshot.asc.speed_mps.clamp(0.0, speed),
            candidates: members.iter().map(candidate).collect(),
            law: visits.cost,
            within: visits.within_m,
            dwell_min: visits.dwell_min_s,
            reduce: visits.reduce,
            horizon,
            afterwards: 0.5 * tour,
            deadline_price: 0.0,
            out_of_reach: Vec::new(),
        };
        fleet.leave_out_who_is_out_of_reach();
        fleet.deadline_price = parameters.deadline_price * fleet.without_visits();
        fleet
    }

    /// Leaves out the candidates that the craft does not reach, and makes the shares of the others sum to 1.
    fn leave_out_who_is_out_of_reach(&mut self) {
        let from = self.departure(&self.start());
        let reached = |candidate: &Candidate| {
            let arrival = self
                .craft
                .arrive(&candidate.track, &from, self.within, self.horizon);
            arrival.is_some()
        };
        let (candidates, others): (Vec<_>, Vec<_>) = self.candidates.iter().cloned().partition(reached);
        self.out_of_reach = others.iter().map(|candidate| candidate.auv).collect();
        let sum: f64 = candidates.iter().map(|candidate| candidate.share).sum();
        self.candidates = candidates;
        for candidate in &mut self.candidates {
            candidate.share /= sum;
        }
    }

    /// What it costs to serve no AUV.
    fn without_visits(&self) -> f64 {
        let mut state = self.start();
        self.pass(
            &mut state,
            self.horizon,
            None,
            (Vector2::zeros(), Vector2::zeros()),
        );
        self.cost(&state).max(f64::MIN_POSITIVE)
    }
}

/// About how long it takes to be at every place once, s: to the nearest other one from each, and the least stay there.
fn tour(places: &[Vector2<f64>], craft: &Craft, dwell: f64) -> f64 {
    let nearest = |from: &Vector2<f64>| {
        let others = places.iter().filter(|to| *to != from);
        let distance = others.map(|to| (to - from).norm()).fold(f64::INFINITY, f64::min);
        if distance.is_finite() { distance } else { 0.0 }
    };
    places
        .iter()
        .map(|from| dwell + nearest(from) / craft.speed)
        .sum()
}

/// From starboard to port, and of those abeam of each other from ahead to astern.
fn in_order(a: &Vector2<f64>, b: &Vector2<f64>) -> std::cmp::Ordering {
    b.y.total_cmp(&a.y).then(b.x.total_cmp(&a.x))
}
