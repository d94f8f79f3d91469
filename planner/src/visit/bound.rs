//! No schedule costs less, because one craft cannot be with all AUVs at once.
//!
//! ```text
//! cᵢ(t) ≥ fᵢ + gᵢ aᵢ(t),   aᵢ the time since AUV i was last served
//! Σᵢ (nᵢ τᵢ + Tᵢ) ≤ R
//! ```
//! with gᵢ the growth without service, fᵢ = min(cᵢ(0), the least cost that service can lead to), nᵢ the number of periods of service of AUV
//! i, Tᵢ their length in all, and τᵢ the least time from any other AUV to it. This is a relaxation of every schedule:
//!
//! - Costs rise at gᵢ while not served, and service takes them at best to fᵢ.
//! - The AUVs that share the craft's time (`sharing`) are always more than 2 `within` apart. So no two are served at the same time. Periods of the same AUV
//!   with no other one between count as one, which costs no more. Between a period of j at t and the next of i at t + Δ the craft goes, through the water,
//!   at least ‖pᵢ − pⱼ‖ − 2 `within`, at the speed u, and AUV i comes nearer at no more than vᵢ (seen from t) or AUV j goes away at no more than
//!   vⱼ (seen from t + Δ): Δ ≥ (min ‖pᵢ − pⱼ‖ − 2 `within`) / (u + min(vᵢ, vⱼ)). All periods but the first have such a
//!   Δ before them, and the first begins no earlier than the craft can be there, rᵢ: R = H + max(0, τᵢ − rᵢ), the largest of all i.
//!
//! For every price μ ≥ 0 of the craft's time (weak duality)
//! ```text
//! Σᵢ min over nᵢ, Tᵢ of (costᵢ(nᵢ, Tᵢ) + μ (nᵢ τᵢ + Tᵢ)) − μ R
//! ```
//! is a bound of schedules whose AUVs go straight between two visits: costs are served along straight ways, distances are those of the tracks. With n periods the times between, s₀ … sₙ, cost a s₀ + Σ sₖ²/2 + θ sₙ and sum to H − T: all of them have the same marginal cost, at
//! most μ. The bound is concave in μ; the best μ is found by golden section.

use crate::{
    facts::visit::Reduce,
    visit::{
        fleet::{Candidate, Fleet},
        intercept::Craft,
        state::KEPT_IN_TURN,
    },
};

/// AUVs to which it takes less than this from the nearest other one do not share the craft's time, s: they would be visited without end.
const TRAVEL_MIN: f64 = 1.0;

/// Steps of the search for a price, each 0.62 times as long, and by what ratio the least price is below the largest.
const PRICES: usize = 32;
const PRICE_RATIO: f64 = 1e-4;

/// More periods than of a second's travel fit in the longest horizon.
const PERIODS_MAX: u32 = 1 << 14;

/// Steps of the search for a largest cost.
const HALVINGS: usize = 40;

/// An AUV in the relaxation.
struct Relaxed {
    /// fᵢ, gᵢ, in units of the cost, and of the cost per s.
    floor: f64,
    growth: f64,
    /// Weights, as in [`Candidate::share`] and relative to their mean.
    share: f64,
    relative: f64,
    /// aᵢ(0), s; and what its cost is now.
    age: f64,
    /// Earliest service, s after now.
    reach: f64,
    /// τᵢ, s; none if it does not share the craft's time.
    travel: Option<f64>,
    /// What it costs at least if the craft were with it alone, times s.
    alone: f64,
}

/// The relaxed problem.
struct Relaxation {
    auvs: Vec<Relaxed>,
    horizon: f64,
    afterwards: f64,
    /// R, s.
    time: f64,
}

impl Fleet {
    /// No schedule has a lower [`Fleet::cost`].
    pub(crate) fn least_cost(&self) -> f64 {
        let relaxation = Relaxation::of(self);
        let mean = relaxation.mean();
        match self.reduce {
            Reduce::Mean => self.bound(&self.start()).max(mean),
            Reduce::Max => {
                let alone = self.bound(&self.start());
                alone.max(self.reduced_by(relaxation.largest(), mean))
            }
        }
    }
}

impl Relaxation {
    fn of(fleet: &Fleet) -> Self {
        let fastest = fleet.candidates.iter().map(|candidate| candidate.track.fastest);
        // While it is with an AUV that is faster, a schedule's craft is as fast.
        let craft = Craft {
            speed: fastest.fold(fleet.craft.speed, f64::max),
            ..fleet.craft
        };
        let from = fleet.departure(&fleet.start());
        let sharing = sharing(fleet, &craft);
        let auv = |(place, candidate): (usize, &Candidate)| {
            let reach = craft.reach(&candidate.track, &from, fleet.within, fleet.horizon);
            let reach = reach.unwrap_or(fleet.horizon);
            let (growth, floor) = (
                fleet.law.unserved(0.0, 1.0).cost,
                candidate.cost.min(fleet.law.steady(candidate.shallowest)),
            );
            let before = fleet.law.unserved(candidate.cost, reach);
            let after = fleet
                .law
                .served(before.cost, fleet.horizon - reach, candidate.shallowest);
            let others = sharing.iter().filter(|other| **other != place);
            let travel = others
                .map(|other| travel(fleet, &craft, place, *other))
                .fold(f64::INFINITY, f64::min);
            let last = if reach < fleet.horizon {
                after.cost
            } else {
                before.cost
            };
            Relaxed {
                floor,
                growth,
                share: candidate.share,
                relative: fleet.relative(candidate),
                age: if growth > 0.0 {
                    (candidate.cost - floor) / growth
                } else {
                    0.0
                },
                reach,
                travel: (sharing.contains(&place) && travel.is_finite() && growth > 0.0).then_some(travel),
                alone: before.integral + after.integral + fleet.afterwards * last,
            }
        };
        let auvs: Vec<_> = fleet.candidates.iter().enumerate().map(auv).collect();
        let first = auvs
            .iter()
            .map(|auv| auv.travel.map_or(0.0, |travel| travel - auv.reach));
        Self {
            time: fleet.horizon + first.fold(0.0, f64::max),
            auvs,
            horizon: fleet.horizon,
            afterwards: fleet.afterwards,
        }
    }

    /// Bound of the mean cost, at the best price.
    fn mean(&self) -> f64 {
        let whole = self.horizon + self.afterwards;
        let marginal = |auv: &Relaxed| auv.share * auv.growth * (auv.age + whole);
        let largest = self.auvs.iter().map(marginal).fold(0.0, f64::max);
        let at = |log: f64| self.priced(largest * log.exp()) / whole;
        let shorter = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (PRICE_RATIO.ln(), 0.0);
        let mut best = self.priced(0.0) / whole;
        let (mut inner, mut outer) = (high - shorter * (high - low), low + shorter * (high - low));
        let (mut at_inner, mut at_outer) = (at(inner), at(outer));
        for _ in 0..PRICES {
            best = best.max(at_inner).max(at_outer);
            if at_inner < at_outer {
                (low, inner, at_inner) = (inner, outer, at_outer);
                outer = low + shorter * (high - low);
                at_outer = at(outer);
            } else {
                (high, outer, at_outer) = (outer, inner, at_inner);
                inner = high - shorter * (high - low);
                at_inner = at(inner);
            }
        }
        best
    }

    /// The bound at this price of the craft's time, in units of the cost, times s.
    fn priced(&self, price: f64) -> f64 {
        let cost = |auv: &Relaxed| match auv.travel {
            Some(travel) if 0.0 < auv.share => {
                let scale = auv.share * auv.growth;
                let shared = scale * self.of_periods(auv, travel, price / scale);
                let floor = auv.share * auv.floor * (self.horizon + self.afterwards);
                (floor + shared).max(auv.share * auv.alone)
            }
            _ => auv.share * auv.alone,
        };
        self.auvs.iter().map(cost).sum::<f64>() - price * self.time
    }

    /// The least over n and T of the age's integral, its end weighed, and the craft's time at `price`, s².
    ///
    /// From one period on it is convex in their number.
    fn of_periods(&self, auv: &Relaxed, travel: f64, price: f64) -> f64 {
        let never =
            (auv.age + 0.5 * self.horizon) * self.horizon + self.afterwards * (auv.age + self.horizon);
        let cost = |n: u32| self.of_n_periods(auv, f64::from(n), price) + price * f64::from(n) * travel;
        let rises = |n: u32| cost(n) <= cost(n + 1);
        // Doubled until it rises, then halved: that is the first number from which on it rises.
        let (mut below, mut above) = (0, 1);
        while !rises(above) && above < PERIODS_MAX {
            (below, above) = (above, 2 * above);
        }
        while below + 1 < above {
            let between = u32::midpoint(below, above);
            if rises(between) {
                above = between;
            } else {
                below = between;
            }
        }
        never.min(cost(above))
    }

    /// The same for n periods, the time on the way apart. The sum of the times between is convex and piecewise linear in their marginal
    /// cost m: Newton's method from above ends after its three pieces.
    fn of_n_periods(&self, auv: &Relaxed, n: f64, price: f64) -> f64 {
        let between = |m: f64| ((m - auv.age).max(auv.reach), m, (m - self.afterwards).max(0.0));
        let sum = |m: f64| {
            let (first, inner, last) = between(m);
            first + (n - 1.0) * inner + last
        };
        let mut m = price;
        for _ in 0..4 {
            let over = sum(m) - self.horizon;
            if over <= 0.0 {
                break;
            }
            let grows = |grows: bool| f64::from(u8::from(grows));
            let slope = n - 1.0 + grows(auv.reach < m - auv.age) + grows(self.afterwards < m);
            m -= over / slope.max(1.0);
        }
        let (first, inner, last) = between(m);
        (auv.age + 0.5 * first) * first
            + 0.5 * (n - 1.0) * inner * inner
            + (0.5 * last + self.afterwards) * last
            + price * (self.horizon - sum(m)).max(0.0)
    }

    /// Bound of the largest relative cost: the least at which the craft has enough time to let none exceed it. Between the periods of
    /// an AUV there are no more than m seconds: n ≥ (H − s₀ − T)/m of them.
    fn largest(&self) -> f64 {
        let enough = |cost: f64| {
            let needed = |auv: &Relaxed| {
                let m = (cost / auv.relative - auv.floor) / auv.growth;
                let uncovered = (self.horizon - (m - auv.age).max(0.0)).max(0.0);
                let travel = auv.travel.unwrap_or(0.0);
                uncovered * (travel / m.max(f64::MIN_POSITIVE)).min(1.0)
            };
            let sharing = self
                .auvs
                .iter()
                .filter(|auv| auv.travel.is_some() && 0.0 < auv.relative);
            sharing.map(needed).sum::<f64>() <= self.time
        };
        let unserved = |auv: &Relaxed| auv.relative * (auv.floor + auv.growth * (auv.age + self.horizon));
        let (mut low, mut high) = (0.0, self.auvs.iter().map(unserved).fold(0.0, f64::max));
        for _ in 0..HALVINGS {
            let cost = 0.5 * (low + high);
            if enough(cost) {
                high = cost;
            } else {
                low = cost;
            }
        }
        low
    }
}

/// The candidates that are far from each other, all the time: of those that are not, the first ones.
fn sharing(fleet: &Fleet, craft: &Craft) -> Vec<usize> {
    let mut sharing: Vec<usize> = Vec::new();
    for place in 0..fleet.candidates.len() {
        if sharing
            .iter()
            .all(|other| TRAVEL_MIN <= travel(fleet, craft, place, *other))
        {
            sharing.push(place);
        }
    }
    sharing
}

/// The least time from one candidate to another, s; negative if both can be served at once.
fn travel(fleet: &Fleet, craft: &Craft, a: usize, b: usize) -> f64 {
    let (a, b) = (&fleet.candidates[a].track, &fleet.candidates[b].track);
    // By so much a schedule's picture of a turn may put the craft ahead: it drifts at once, and its arc ends where it began.
    let turn = craft.current.norm() * std::f64::consts::PI / craft.turn_rate
        + 2.0 * KEPT_IN_TURN * fleet.speed_now / craft.turn_rate;
    let apart = a.nearest(b) - 2.0 * fleet.within - turn;
    apart / (craft.speed + a.fastest.min(b.fastest))
}
