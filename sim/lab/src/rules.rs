//! Rules that visit AUVs without a schedule, for comparison: the clock, and operators' habits.
//!
//! A rule uses the planner's input: the same snapshots, estimates and forecasts, with costs from
//! them. It replaces the goal `visit` by one that the planner or a line-of-sight law follows.

use nalgebra::Vector2;
use planner::{
    Heard, Hearing,
    goal::GoalForecast,
    parameters::Parameters,
    snapshot::{Goal, PlanRequest, Snapshot, Task, VehicleId, VisitCost, Visits},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim::guide::{Guidance, Guide, GuideError};
use sim::visits::{Costs, ServedAt};

mod greedy;
mod tour;

pub use greedy::GreedyGuide;
use tour::short_tour;

/// Tried turns by the clock, s: at 1.5 m/s the shortest is 60 m, the longest over a kilometre.
const TURNS: [f64; 8] = [40.0, 60.0, 80.0, 120.0, 240.0, 360.0, 540.0, 810.0];

/// Stays beyond the goal's least time that are tried, s: fixes and data take time, an age none.
const STAYS: [f64; 3] = [0.0, 60.0, 180.0];

/// Name of the guide that plans.
const PLANNER: &str = "mpc";

/// Steps to a moving AUV's meeting point: each leaves the ratio of speeds of the error, mostly 1/5.
const MEETING_STEPS: usize = 4;

/// Slant range of a goal without data, m: the largest accepted.
const RANGE: f64 = 2.0e4;

/// A rule that says which AUV is next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// Each for the same time, in the order of a short tour.
    Clock,
    /// The one that was not served for longest.
    OldestFirst,
    /// The nearest that was not served since all others were.
    NearestFirst,
    /// The one with the greatest cost for the time until it has been served.
    CostPerTime,
    /// None: the craft stays at the mean of all.
    Midpoint,
    /// None: the craft stays where the farthest is nearest.
    MinimaxRange,
    /// Localises: at full speed on the heading whose next measurement tells most.
    Greedy,
}

impl Rule {
    /// All rules that visit AUVs.
    pub const ALL: [Self; 6] = [
        Self::Clock,
        Self::OldestFirst,
        Self::NearestFirst,
        Self::CostPerTime,
        Self::Midpoint,
        Self::MinimaxRange,
    ];

    /// Names of its controllers: with the planner (also the rule's own), and with line of sight.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            Self::Clock => ["clock", "clock_los"],
            Self::OldestFirst => ["oldest_first", "oldest_first_los"],
            Self::NearestFirst => ["nearest_first", "nearest_first_los"],
            Self::CostPerTime => ["cost_per_time", "cost_per_time_los"],
            Self::Midpoint => ["midpoint", "midpoint_los"],
            Self::MinimaxRange => ["minimax_range", "minimax_range_los"],
            Self::Greedy => ["greedy", "greedy"],
        }
    }

    /// Its verb.
    pub(crate) fn does(self) -> &'static str {
        if self == Self::Greedy { "localises" } else { "visits" }
    }

    /// Times to try, s: of a turn by the clock, or of a stay beyond the goal's least time.
    pub fn dwells(self) -> &'static [f64] {
        match self {
            Self::Clock => &TURNS,
            Self::OldestFirst | Self::NearestFirst | Self::CostPerTime => &STAYS,
            Self::Midpoint | Self::MinimaxRange | Self::Greedy => &[],
        }
    }
}

/// A guide whose goal `visit` a rule replaces; another goal is left as it is.
pub struct RuleGuide {
    guide: Box<dyn Guide>,
    rule: Rule,
    /// One of [`Rule::dwells`], or another.
    dwell: f64,
    memory: Option<Memory>,
}

struct Memory {
    costs: Costs,
    /// The place of each among the snapshot's AUVs.
    places: Vec<usize>,
    /// Time of the first call and of the last one, s.
    began: f64,
    then: f64,
    /// Places in the order of a short tour.
    tour: Vec<usize>,
    /// Acoustic hearing of each AUV.
    hearing: Vec<Hearing>,
    /// Those that were served since all others were.
    served: Vec<bool>,
    /// The next place, and the time at which the craft came near it.
    next: Option<(usize, Option<f64>)>,
}

struct Observed {
    /// Time until the craft can be near it, s.
    travel: f64,
    served: bool,
    silent: bool,
}

impl RuleGuide {
    /// `guide` by `rule`; `dwell` is the time of a turn or of a stay beyond the least, s.
    pub fn new(guide: Box<dyn Guide>, rule: Rule, dwell: f64) -> Self {
        Self { guide, rule, dwell, memory: None }
    }

    /// The goal instead of `visits`, and the index of the followed AUV in the snapshot.
    fn goal(&mut self, snapshot: &Snapshot, visits: &Visits) -> (Goal, Option<usize>) {
        let now = snapshot.t_s;
        let forecast = GoalForecast::holding(snapshot, None);
        let memory = &mut self.memory;
        let memory = memory.get_or_insert_with(|| Memory::new(snapshot, visits, &forecast));
        let seen = memory.observe(snapshot, &forecast);
        let none = seen.iter().all(|seen| seen.silent);
        // If no AUV was heard, all may still be there.
        let tour = memory.tour.iter().copied();
        let heard: Vec<usize> = tour.filter(|place| none || !seen[*place].silent).collect();
        let auvs = heard.iter().map(|place| memory.costs.auvs[*place].clone());
        let auvs: Vec<_> = auvs.collect();
        match self.rule {
            Rule::Clock => {
                let turn = ((now - memory.began) / self.dwell).floor();
                #[expect(clippy::cast_possible_truncation, reason = "a mission's turns")]
                let followed = heard[turn as usize % heard.len()];
                let goal = if visits.cost.takes_ranges() {
                    memory.stay(visits, followed)
                } else {
                    Goal::Intermittent { auvs, dwell_s: self.dwell, epoch_s: memory.began }
                };
                (goal, Some(memory.places[followed]))
            }
            Rule::OldestFirst | Rule::NearestFirst | Rule::CostPerTime => {
                let next = memory.next(self.rule, now, visits.dwell_min() + self.dwell, (&seen, &heard));
                (memory.stay(visits, next), Some(memory.places[next]))
            }
            Rule::Midpoint | Rule::Greedy => (Goal::Midpoint { auvs }, None),
            Rule::MinimaxRange => {
                let range_m = match visits.cost {
                    VisitCost::Data { range_max_m, .. } => range_max_m,
                    VisitCost::Age | VisitCost::Uncertainty { .. } => RANGE,
                };
                (Goal::Range { auvs, range_m }, None)
            }
        }
    }
}

impl Memory {
    fn new(snapshot: &Snapshot, visits: &Visits, forecast: &GoalForecast) -> Self {
        let costs = Costs::new(visits);
        let positions: Vec<Vector2<f64>> = forecast.members().map(|auv| auv.at(0.0).position).collect();
        let ids: Vec<&VehicleId> = snapshot.auvs.iter().map(|auv| &auv.id).collect();
        let place = |id: &VehicleId| ids.iter().position(|known| *known == id);
        let places = costs.auvs.iter().map(place);
        let places = places.map(|place| place.expect("a goal names vehicles of its snapshot"));
        Self {
            places: places.collect(),
            began: snapshot.t_s,
            then: snapshot.t_s,
            tour: short_tour(&snapshot.asc.position(), &positions),
            hearing: vec![Hearing::default(); costs.auvs.len()],
            served: vec![false; costs.auvs.len()],
            next: None,
            costs,
        }
    }

    /// Observations of each AUV, with the costs carried on until now.
    fn observe(&mut self, snapshot: &Snapshot, forecast: &GoalForecast) -> Vec<Observed> {
        let (here, elapsed) = (snapshot.asc.position(), snapshot.t_s - self.then);
        self.then = snapshot.t_s;
        let within = self.costs.visits.within();
        let mut all = vec![];
        for (place, auv) in forecast.members().enumerate() {
            let off = |ahead: f64| auv.at(ahead).position - here;
            let distance = |ahead: f64| off(ahead).norm();
            let depth = auv.depth_at(0.0).max(0.0);
            let heard = Heard::of(snapshot, self.places[place], distance(0.0));
            let hearing = self.hearing[place].later(elapsed, &heard);
            self.hearing[place] = hearing;
            let silent = hearing.is_silent(&heard, Parameters::default().report_age_max);
            let served = !silent && self.costs.serves(distance(0.0), depth);
            self.costs.advance(place, elapsed, served.then(|| ServedAt { off: off(0.0), depth }));
            self.served[place] |= served;
            let speed = snapshot.limits().speed_max;
            let travel = (0..MEETING_STEPS).fold(0.0, |time, _| (distance(time) - within).max(0.0) / speed);
            all.push(Observed { travel, served, silent });
        }
        all
    }

    /// The goal to stay with the AUV at `place`: above it, or on arcs about it with ranges.
    fn stay(&self, visits: &Visits, place: usize) -> Goal {
        let auv = self.costs.auvs[place].clone();
        if !visits.cost.takes_ranges() {
            return Goal::Track { auv };
        }
        let costs_now = [(auv.clone(), self.costs.costs[place])].into();
        Goal::Visit(Visits {
            cost: visits.cost,
            within_m: visits.within_m,
            dwell_min_s: visits.dwell_min_s,
            costs_now,
            ..Visits::new(vec![auv])
        })
    }

    /// The next place: the same until the craft was there for `stay` s, then the rule's choice.
    fn next(&mut self, rule: Rule, now: f64, stay: f64, (seen, heard): (&[Observed], &[usize])) -> usize {
        if let Some((place, arrived)) = &mut self.next
            && heard.contains(place)
        {
            if seen[*place].served {
                arrived.get_or_insert(now);
            }
            if arrived.is_none_or(|arrived| now - arrived < stay) {
                return *place;
            }
        }
        let over = self.next.map(|(place, _)| place);
        let one = heard.len() < 2;
        let others = heard.iter().copied().filter(|place| one || Some(*place) != over);
        if others.clone().all(|place| self.served[place]) {
            self.served.fill(false);
        }
        let key = |place: usize| match rule {
            Rule::OldestFirst => -self.costs.ages[place],
            Rule::CostPerTime => {
                let weight = self.costs.visits.weight(&self.costs.auvs[place]);
                -weight * self.costs.costs[place] / (seen[place].travel + stay).max(1.0)
            }
            Rule::NearestFirst => f64::from(u8::from(self.served[place])),
            Rule::Clock | Rule::Midpoint | Rule::MinimaxRange | Rule::Greedy => 0.0,
        };
        let order = |a: &usize, b: &usize| {
            let nearer = seen[*a].travel.total_cmp(&seen[*b].travel);
            key(*a).total_cmp(&key(*b)).then(nearer)
        };
        let next = others.min_by(order).expect("a goal names a vehicle");
        self.next = Some((next, seen[next].served.then_some(now)));
        next
    }
}

impl Guide for RuleGuide {
    fn name(&self) -> &'static str {
        self.rule.names()[usize::from(self.guide.name() != PLANNER)]
    }

    fn craft_estimate(&self) -> Option<&planner::craft::CraftEstimate> {
        self.guide.craft_estimate()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let Goal::Visit(visits) = &snapshot.goal.goal else { return self.guide.guide(snapshot) };
        let (goal, serves) = self.goal(snapshot, visits);
        let offset = snapshot.goal.offset;
        let request = PlanRequest { goal: Task { goal, offset }, ..PlanRequest::clone(snapshot) };
        let guidance = self.guide.guide(&snapshot.again(request)?)?;
        Ok(Guidance { serves, ..guidance })
    }
}

#[cfg(test)]
mod tests;
