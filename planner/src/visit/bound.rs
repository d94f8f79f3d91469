//! A lower bound on the cost of any schedule: the craft serves one AUV at a time.
//!
//! ```text
//! cᵢ(t) ≥ fᵢ + gᵢ aᵢ(t),   aᵢ the time since AUV i was last served
//! Σᵢ (nᵢ τᵢ + Tᵢ) ≤ R
//! ```
//! with the growth without service gᵢ, the floor fᵢ = min(cᵢ(0), the least cost after service), the
//! number nᵢ and the total length Tᵢ of AUV i's periods of service, and its share τᵢ of the times
//! between them. This relaxes every schedule:
//!
//! - Costs rise at gᵢ while not served, and service reduces them at best to fᵢ.
//! - The AUVs that share the craft's time (`sharing`) are always more than 2 `within` apart, so no
//!   two are served at the same time. Adjacent periods of the same AUV count as one, which costs no
//!   more. Between a period of j at t and the next of i at t + Δ the craft travels through the
//!   water at least ‖pᵢ − pⱼ‖ − 2 `within` at the speed u, while AUV i approaches at vᵢ at most
//!   (seen from t) or AUV j departs at vⱼ at most (seen from t + Δ): Δ ≥ dᵢⱼ = (min ‖pᵢ − pⱼ‖ − 2
//!   `within`) / (u + min(vᵢ, vⱼ)).
//! - For any ψ ≥ 0 and τᵢ = minⱼ (ψⱼ + dᵢⱼ) − ψᵢ, dᵢⱼ ≥ τᵢ + ψᵢ − ψⱼ. All periods but the first
//!   follow a Δ, and the first begins no earlier than the arrival rᵢ. In the sum over a schedule
//!   all other ψ cancel: R = H + max(0, τᵢ + ψᵢ − rᵢ), the largest of all i. With ψ = 0, τᵢ⁰ is the
//!   least time from any other AUV. With ψᵢ = max τ⁰ − τᵢ⁰, τᵢ = τᵢ⁰ + minⱼ (dᵢⱼ − τⱼ⁰): a distant
//!   AUV takes the way back, too. The better of the two counts.
//!
//! For every price μ ≥ 0 of the craft's time (weak duality)
//! ```text
//! Σᵢ min over nᵢ, Tᵢ of (costᵢ(nᵢ, Tᵢ) + μ (nᵢ τᵢ + Tᵢ)) − μ R
//! ```
//! is a bound for schedules whose AUVs move straight between visits, as costs and distances assume.
//! With n periods the times between, s₀ … sₙ, cost a s₀ + Σ sₖ²/2 + θ sₙ and sum to H − T: all have
//! the same marginal cost, at most μ. A golden-section search finds the best μ.

use crate::facts::bisection::last_at_which;
use crate::facts::visit::Reduce;
use crate::visit::fleet::{Candidate, Fleet};
use crate::visit::intercept::Craft;

/// AUVs nearer to another one than this, s, do not share the craft's time: visits could be endless.
const TRAVEL_MIN: f64 = 1.0;

/// Steps of the search for a price (each interval 0.62 of the last), and least price over largest.
const PRICES: usize = 32;
const PRICE_RATIO: f64 = 1e-4;

/// Exceeds the periods of a second's travel in the longest horizon.
const PERIODS_MAX: u32 = 1 << 14;

/// Steps of the search for a largest cost.
const HALVINGS: u32 = 40;

/// An AUV in the relaxation.
#[derive(Clone)]
struct Relaxed {
    /// fᵢ in units of the cost, and gᵢ in those per s.
    floor: f64,
    growth: f64,
    /// Weights: [`Candidate::share`], and relative to the mean weight.
    share: f64,
    relative: f64,
    /// aᵢ(0), s, and the present cost.
    age: f64,
    /// Earliest service, s after now.
    reach: f64,
    /// τᵢ, s; `None` if the AUV does not share the craft's time.
    travel: Option<f64>,
    /// Least cost with the craft always near, times s.
    alone: f64,
}

/// The relaxed problem.
#[derive(Clone)]
struct Relaxation {
    auvs: Vec<Relaxed>,
    /// Those that share the craft's time, and dᵢⱼ by i and j, s.
    sharing: Vec<usize>,
    between: Vec<Vec<f64>>,
    horizon: f64,
    afterwards: f64,
    /// R, s, of each craft.
    time: f64,
    n_craft: f64,
}

/// A lower bound on the cost of any schedules of several craft with the same AUVs, if all are
/// reached: that of one craft with the time, the best speed and the best arrivals of all.
pub(crate) fn least_cost_of(fleets: &[&Fleet]) -> Option<f64> {
    let first = fleets.first()?;
    let speed = fleets.iter().map(|fleet| fleet.craft.speed).fold(0.0, f64::max);
    let fastest = |fleet: &Fleet| Fleet { craft: Craft { speed, ..fleet.craft }, ..fleet.clone() };
    let mut all = Relaxation::of(&fastest(first));
    for fleet in &fleets[1..] {
        let other = Relaxation::of(&fastest(fleet));
        for (auv, candidate) in all.auvs.iter_mut().zip(&first.candidates) {
            let same = fleet.candidates.iter().position(|other| other.auv == candidate.auv)?;
            auv.reach = auv.reach.min(other.auvs[same].reach);
            auv.alone = auv.alone.min(other.auvs[same].alone);
        }
    }
    all.n_craft = fleets.len() as f64;
    Some(first.shared_bound(&all.with_no_potentials()))
}

impl Fleet {
    /// A lower bound on [`Fleet::cost`] of any schedule.
    pub(crate) fn least_cost(&self) -> f64 {
        self.bound(&self.start()).max(self.shared_bound(&Relaxation::of(self)))
    }

    /// The bound of the relaxed problem `there`, by the better of two ψ.
    fn shared_bound(&self, there: &Relaxation) -> f64 {
        let travels: Vec<_> = there.auvs.iter().filter_map(|auv| auv.travel).collect();
        let longest = travels.iter().copied().fold(0.0, f64::max);
        let potentials: Vec<_> = travels.iter().map(|travel| longest - travel).collect();
        let back = there.clone().with(&potentials);
        let best = |bound: fn(&Relaxation) -> f64| bound(there).max(bound(&back));
        let mean = best(Relaxation::mean);
        match self.reduce {
            Reduce::Mean => mean,
            Reduce::Max => self.reduced_by(best(Relaxation::largest), mean),
        }
    }
}

impl Relaxation {
    fn of(fleet: &Fleet) -> Self {
        let fastest = fleet.candidates.iter().map(|candidate| candidate.track.fastest);
        // With a faster AUV, a schedule's craft is assumed as fast.
        let craft = Craft { speed: fastest.fold(fleet.craft.speed, f64::max), ..fleet.craft };
        let from = fleet.departure(&fleet.start());
        let n = fleet.candidates.len();
        let from_one = |a| (0..n).map(|b| travel(fleet, &craft, a, b)).collect();
        let between: Vec<Vec<f64>> = (0..n).map(from_one).collect();
        let growth = fleet.law.unserved(0.0, 1.0).cost;
        let sharing = sharing(&between);
        let auv = |candidate: &Candidate| {
            let reach = craft.reach(&candidate.track, &from, fleet.within, fleet.horizon);
            let reach = reach.unwrap_or(fleet.horizon);
            let place = fleet.service_place(candidate.shallowest);
            let floor = candidate.cost.min(fleet.law.steady(place));
            let before = fleet.law.unserved(candidate.cost, reach);
            let after = fleet.law.served(before.cost, fleet.horizon - reach, place);
            let last = if reach < fleet.horizon { after.cost } else { before.cost };
            Relaxed {
                floor,
                growth,
                share: candidate.share,
                relative: fleet.relative(candidate),
                age: if growth > 0.0 { (candidate.cost - floor) / growth } else { 0.0 },
                reach,
                travel: None,
                alone: before.integral + after.integral + fleet.afterwards * last,
            }
        };
        let shared = 1 < sharing.len() && growth > 0.0;
        let relaxation = Self {
            auvs: fleet.candidates.iter().map(auv).collect(),
            sharing: if shared { sharing } else { Vec::new() },
            between,
            horizon: fleet.horizon,
            afterwards: fleet.afterwards,
            time: fleet.horizon,
            n_craft: 1.0,
        };
        relaxation.with_no_potentials()
    }

    fn with_no_potentials(self) -> Self {
        let n = self.sharing.len();
        self.with(&vec![0.0; n])
    }

    /// With the τ and R of these ψ of `sharing`.
    fn with(mut self, potentials: &[f64]) -> Self {
        self.time = self.horizon;
        let sharing = || self.sharing.iter().zip(potentials);
        for (to, own) in sharing() {
            let others = sharing().filter(|(other, _)| *other != to);
            let ways = others.map(|(other, psi)| psi + self.between[*to][*other] - own);
            let travel = ways.fold(f64::INFINITY, f64::min);
            self.time = self.time.max(self.horizon + travel + own - self.auvs[*to].reach);
            self.auvs[*to].travel = Some(travel);
        }
        self
    }

    /// Bound of the mean cost at the best price.
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

    /// The bound at a price of the craft's time, in units of the cost, times s.
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
        self.auvs.iter().map(cost).sum::<f64>() - price * self.time * self.n_craft
    }

    /// The least over n and T of the age's integral, its weighted end, and the priced time, s².
    ///
    /// It is convex in the number of periods from one on.
    fn of_periods(&self, auv: &Relaxed, travel: f64, price: f64) -> f64 {
        let never =
            (auv.age + 0.5 * self.horizon) * self.horizon + self.afterwards * (auv.age + self.horizon);
        let cost = |n: u32| self.of_n_periods(auv, f64::from(n), price) + price * f64::from(n) * travel;
        let rises = |n: u32| cost(n) <= cost(n + 1);
        // Doubling, then bisection, to the first number from which the cost rises.
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

    /// The same for n periods, without travel. The sum of the times between is convex and piecewise
    /// linear in their marginal cost m: Newton's method from above ends after its three pieces.
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

    /// Bound of the largest relative cost: the least one that the craft has time to maintain.
    /// Periods of an AUV are at most m seconds apart: n ≥ (H − s₀ − T)/m of them.
    fn largest(&self) -> f64 {
        let is_too_little = |cost: f64| {
            let needed = |auv: &Relaxed| {
                let m = (cost / auv.relative - auv.floor) / auv.growth;
                let uncovered = (self.horizon - (m - auv.age).max(0.0)).max(0.0);
                let travel = auv.travel.unwrap_or(0.0);
                uncovered * (travel / m.max(f64::MIN_POSITIVE)).min(1.0)
            };
            let sharing = self.auvs.iter().filter(|auv| auv.travel.is_some() && 0.0 < auv.relative);
            self.time * self.n_craft < sharing.map(needed).sum::<f64>()
        };
        let unserved = |auv: &Relaxed| auv.relative * (auv.floor + auv.growth * (auv.age + self.horizon));
        let most = self.auvs.iter().map(unserved).fold(0.0, f64::max);
        last_at_which(is_too_little, [0.0, most], HALVINGS)
    }
}

/// Candidates that are always far from each other; the first ones of those that are not.
fn sharing(between: &[Vec<f64>]) -> Vec<usize> {
    let mut sharing: Vec<usize> = Vec::new();
    for (place, from) in between.iter().enumerate() {
        if sharing.iter().all(|other| TRAVEL_MIN <= from[*other]) {
            sharing.push(place);
        }
    }
    sharing
}

/// Least time from one candidate to another, s; negative if both can be served at once.
fn travel(fleet: &Fleet, craft: &Craft, a: usize, b: usize) -> f64 {
    let (a, b) = (&fleet.candidates[a].track, &fleet.candidates[b].track);
    // Error of a schedule's model of a turn: immediate drift, and an arc that ends where it began.
    let turn = craft.current.norm() * std::f64::consts::PI / craft.turn_rate
        + 2.0 * fleet.tuned.kept_in_turn * fleet.speed_now / craft.turn_rate;
    let apart = a.nearest(b) - 2.0 * fleet.within - turn;
    apart / (craft.speed + a.fastest.min(b.fastest))
}
