//! The search for the assignment of least cost.
//!
//! Few AUVs and craft: all assignments, by the cost of every set for every craft. Many: the
//! previous assignment and one that is built up AUV by AUV, each improved by moving an AUV to
//! another craft and by exchanging two, until nothing is better or the work is done. Counts bound
//! the work, so that equal problems have equal results.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use crate::tuned::FleetNumbers;

/// Most sets whose costs are compared in full.
const SETS_MAX: usize = 96;

/// Sets after which the search ends otherwise.
const WORK_MAX: usize = 400;

/// Relative difference of equal costs, from sums in another order.
const TIE: f64 = 1e-9;

/// The problem: `n` AUVs, and the craft that may serve each.
pub(super) struct Search<'a> {
    pub(super) n: usize,
    /// AUVs that each craft may serve, as bits.
    pub(super) serves: Vec<u32>,
    /// Cost of a craft, by index, with a set of AUVs, as bits.
    pub(super) cost: &'a dyn Fn(usize, u32) -> f64,
    /// `true` if the largest cost of a craft counts, `false` for the sum.
    pub(super) is_largest: bool,
    pub(super) due: &'a dyn Fn() -> bool,
    numbers: &'a FleetNumbers,
    known: RefCell<BTreeMap<(usize, u32), f64>>,
    work: Cell<usize>,
}

/// The craft of each AUV, by index; none if no craft may serve it.
pub(super) type CraftOf = Vec<Option<usize>>;

/// An assignment that was found.
pub(super) struct Found {
    pub(super) craft_of: CraftOf,
    pub(super) cost: f64,
    pub(super) bound: f64,
    pub(super) exact: bool,
    pub(super) kept: bool,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        n: usize,
        serves: Vec<u32>,
        (cost, is_largest): (&'a dyn Fn(usize, u32) -> f64, bool),
        due: &'a dyn Fn() -> bool,
        numbers: &'a FleetNumbers,
    ) -> Self {
        Self { n, serves, cost, is_largest, due, numbers, known: RefCell::default(), work: Cell::new(0) }
    }

    /// The best assignment, unless `before`, which has stood for `age` seconds, is almost as good.
    pub(super) fn best(&self, before: &CraftOf, age: f64) -> Found {
        let completed = self.completed(before.clone());
        let exact = self.serves.len() << self.n <= SETS_MAX;
        let mut best = completed.clone();
        if exact {
            self.compare_all(&mut vec![None; self.n], 0, &mut best);
        } else {
            best = self.improved(best);
            // Costs change little between two plans: what is known is improved from there.
            if before.iter().any(Option::is_none) {
                let built = self.improved(self.completed(vec![None; self.n]));
                best = if self.is_better(&built, &best) { built } else { best };
            }
        }
        let (least, cost) = (self.total(&best), self.total(&completed));
        let is_known = before.iter().any(Option::is_some);
        let FleetNumbers { keep_margin, keep_margin_at_first, settles_in, .. } = self.numbers;
        let margin = keep_margin + (keep_margin_at_first - keep_margin) * (-age.max(0.0) / settles_in).exp();
        let kept = is_known && best != completed && cost <= least * (1.0 + margin);
        let (craft_of, cost) = if kept { (completed, cost) } else { (best, least) };
        let bound = self.bound().min(least);
        Found { craft_of, cost, bound, exact: exact && !(self.due)(), kept }
    }

    fn may_serve(&self, auv: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.serves.len()).filter(move |craft| self.serves[*craft] & (1 << auv) != 0)
    }

    /// Gives each AUV without a craft to the one to which it adds least, the dearest AUV first.
    fn completed(&self, mut craft_of: CraftOf) -> CraftOf {
        for (auv, craft) in craft_of.iter_mut().enumerate() {
            *craft = craft.filter(|craft| self.serves[*craft] & (1 << auv) != 0);
        }
        while let Some((auv, craft)) = self.dearest_insertion(&craft_of) {
            craft_of[auv] = Some(craft);
            if self.is_spent() {
                break;
            }
        }
        // Without time, each to the first craft that may serve it.
        for (auv, craft) in craft_of.iter_mut().enumerate() {
            *craft = craft.or_else(|| self.may_serve(auv).next());
        }
        craft_of
    }

    fn is_spent(&self) -> bool {
        WORK_MAX <= self.work.get() || (self.due)()
    }

    /// The AUV without a craft whose cheapest insertion costs most, and the craft of that.
    fn dearest_insertion(&self, craft_of: &CraftOf) -> Option<(usize, usize)> {
        let left = (0..self.n).filter(|auv| craft_of[*auv].is_none());
        let insertions = left.filter_map(|auv| {
            let with = |craft| {
                let mut with = craft_of.clone();
                with[auv] = Some(craft);
                self.total(&with)
            };
            let costs = self.may_serve(auv).map(|craft| (with(craft), craft));
            let (cost, craft) = costs.reduce(|best, next| if next.0 < best.0 { next } else { best })?;
            Some((cost, auv, craft))
        });
        let dearest = insertions.reduce(|most, next| if most.0 < next.0 { next } else { most });
        dearest.map(|(_, auv, craft)| (auv, craft))
    }

    /// Moves and exchanges AUVs while that is better.
    fn improved(&self, mut craft_of: CraftOf) -> CraftOf {
        let mut is_improved = true;
        while is_improved {
            is_improved = false;
            for auv in 0..self.n {
                for craft in self.may_serve(auv) {
                    let mut moved = craft_of.clone();
                    moved[auv] = Some(craft);
                    is_improved |= self.take_better(moved, &mut craft_of);
                }
                for other in 0..auv {
                    let mut exchanged = craft_of.clone();
                    exchanged.swap(auv, other);
                    let may = |auv: usize| self.may_serve(auv).any(|craft| exchanged[auv] == Some(craft));
                    if may(auv) && may(other) {
                        is_improved |= self.take_better(exchanged, &mut craft_of);
                    }
                }
            }
        }
        craft_of
    }

    /// Replaces `craft_of` if `other` is better and there is time to look.
    fn take_better(&self, other: CraftOf, craft_of: &mut CraftOf) -> bool {
        let is_better = !self.is_spent() && other != *craft_of && self.is_better(&other, craft_of);
        if is_better {
            *craft_of = other;
        }
        is_better
    }

    fn compare_all(&self, craft_of: &mut CraftOf, auv: usize, best: &mut CraftOf) {
        if (self.due)() {
            return;
        }
        if auv == self.n {
            if self.is_better(craft_of, best) {
                best.clone_from(craft_of);
            }
            return;
        }
        let mut craft = self.may_serve(auv).map(Some).collect::<Vec<_>>();
        if craft.is_empty() {
            craft.push(None);
        }
        for craft in craft {
            craft_of[auv] = craft;
            self.compare_all(craft_of, auv + 1, best);
        }
    }

    fn is_better(&self, one: &CraftOf, other: &CraftOf) -> bool {
        let (one, other) = (self.total(one), self.total(other));
        one < other - TIE * other.abs()
    }

    fn total(&self, craft_of: &CraftOf) -> f64 {
        let costs = (0..self.serves.len()).map(|craft| {
            let auvs = craft_of.iter().enumerate().filter(|(_, of)| **of == Some(craft));
            self.of_set(craft, auvs.fold(0, |set, (auv, _)| set | 1 << auv))
        });
        self.together(costs)
    }

    fn together(&self, costs: impl Iterator<Item = f64>) -> f64 {
        if self.is_largest { costs.fold(0.0, f64::max) } else { costs.sum() }
    }

    /// No set costs less than its AUVs, each with the best craft to itself.
    fn bound(&self) -> f64 {
        let alone = |auv: usize| {
            let costs = self.may_serve(auv).map(|craft| self.of_set(craft, 1 << auv));
            costs.reduce(f64::min)
        };
        self.together((0..self.n).filter_map(alone))
    }

    fn of_set(&self, craft: usize, set: u32) -> f64 {
        if set == 0 {
            return 0.0;
        }
        if let Some(known) = self.known.borrow().get(&(craft, set)) {
            return *known;
        }
        self.work.set(self.work.get() + 1);
        let cost = (self.cost)(craft, set);
        self.known.borrow_mut().insert((craft, set), cost);
        cost
    }
}
