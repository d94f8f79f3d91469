//! What becomes of an encounter, and the table of many.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use planner::angle::{direction, wrap};
use planner::snapshot::{Avoidance, EncounterKind};

use crate::drawn::Drawn;
use crate::{DURATION, SEPARATION};

/// What became of an encounter.
#[derive(Default)]
pub(crate) struct Outcome {
    /// Least distance beyond the one to keep, m.
    pub(crate) clearance: f64,
    pub(crate) has_way: Option<bool>,
    /// The kind of the encounter with each vessel.
    pub(crate) kinds: BTreeMap<usize, EncounterKind>,
    /// `true` for each vessel that passed on the side that the rules ask for.
    right_side: BTreeMap<usize, bool>,
    /// Turn of the first manoeuvre, rad, and the time until the closest approach, s.
    first_action: Option<(f64, f64)>,
    /// The present manoeuvre's heading, rad, and end, s, and how many there were.
    present: (f64, f64),
    manoeuvres: usize,
    /// The side on which the craft means to pass each vessel, and how often one changed.
    sides: BTreeMap<usize, f64>,
    side_changes: usize,
    last_near: f64,
    /// Times, s, and distances from the AUV, m.
    pub(crate) misses: Vec<(f64, f64)>,
    pub(crate) plan_ms: Vec<f64>,
}

impl Outcome {
    /// Notes what a plan does about the vessels; `course` is the AUV's, rad.
    pub(crate) fn observe(&mut self, avoidance: &Avoidance, course: f64) {
        for encounter in &avoidance.encounters {
            let i: usize = encounter.vessel.0[5..].parse().unwrap_or(0);
            self.kinds.entry(i).or_insert(encounter.kind);
            // A pass right ahead or astern has no side, and what is past changes none.
            let has_side = 0.5 * encounter.passes_m < encounter.starboard_m.abs() && 0.0 < encounter.tcpa_s;
            if encounter.acts && has_side {
                let side = encounter.starboard_m.signum();
                let before = self.sides.insert(i, side);
                self.side_changes += usize::from(before.is_some_and(|before| before != side));
            }
        }
        if let Some(manoeuvre) = &avoidance.manoeuvre {
            let until = avoidance.encounters.iter().map(|met| met.tcpa_s).fold(0.0, f64::max);
            let aside = wrap(manoeuvre.heading_rad - course);
            let _ = self.first_action.get_or_insert((aside, until));
            let now = (manoeuvre.heading_rad, manoeuvre.until_s);
            let is_other = 1e-6 < (now.0 - self.present.0).abs() + (now.1 - self.present.1).abs();
            self.manoeuvres += usize::from(is_other);
            self.present = now;
        }
    }

    /// Notes how near the craft at `position` is to the ships at a time, and on which side they
    /// pass.
    pub(crate) fn pass(&mut self, drawn: &Drawn, time: f64, position: Vector2<f64>) {
        for (i, ship) in drawn.ships.iter().enumerate() {
            let (place, course) = ship.at(time);
            let there = position - place;
            let clearance = there.norm() - 0.5 * ship.length - SEPARATION;
            self.clearance = self.clearance.min(clearance);
            if clearance < 40.0 + 20.0 * ship.speed {
                self.last_near = time;
            }
            let along = direction(course);
            let (ahead, starboard) = (there.dot(&along), along.perp(&there));
            let right = match self.kinds.get(&i) {
                // The craft has the vessel on its port side, abeam.
                Some(EncounterKind::HeadOn) if ahead.abs() < 0.1 * ship.speed + 0.3 => starboard < 0.0,
                Some(EncounterKind::CrossingGiveWay)
                    if starboard.abs() < 0.5 && ahead.abs() < 60.0 * ship.speed =>
                {
                    ahead < 0.0
                }
                _ => continue,
            };
            self.right_side.entry(i).and_modify(|before| *before &= right).or_insert(right);
        }
    }

    /// Root of the mean square distance from the AUV, m, once the last vessel is past for minutes;
    /// none if one is near to the end.
    fn miss_after(&self) -> Option<f64> {
        let late = self.misses.iter().filter(|(now, _)| self.last_near + 200.0 < *now);
        (self.last_near + 250.0 < DURATION as f64).then(|| rms(late))
    }
}

fn rms<'a>(misses: impl Iterator<Item = &'a (f64, f64)>) -> f64 {
    let (n, sum) = misses.fold((0.0, 0.0), |(n, sum), (_, miss)| (n + 1.0, sum + miss * miss));
    (sum / n).sqrt()
}

/// Prints a row of the tracks: time, craft, AUV, each ship with its clearance, and what the planner
/// says.
pub(crate) fn shown(drawn: &Drawn, now: f64, position: Vector2<f64>, told: &str) {
    let auv = drawn.auv_at(now);
    print!("{now},{:.1},{:.1},{:.1},{:.1}", position.x, position.y, auv.north_m, auv.east_m);
    for ship in &drawn.ships {
        let place = ship.at(now).0;
        let clearance = (place - position).norm() - 0.5 * ship.length - SEPARATION;
        print!(",{:.1},{:.1},{clearance:.1}", place.x, place.y);
    }
    println!(",{told}");
}

pub(crate) fn report(outcomes: &[(u64, Outcome)]) {
    let count = |is: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|(_, outcome)| is(outcome)).count();
    let which = |is: &dyn Fn(&Outcome) -> bool| {
        let those = outcomes.iter().filter(|(_, outcome)| is(outcome));
        those
            .map(|(seed, outcome)| format!("{seed} ({:.1} m)", outcome.clearance))
            .collect::<Vec<_>>()
            .join(" ")
    };
    let deepest = outcomes.iter().map(|(_, outcome)| -outcome.clearance).fold(0.0, f64::max);
    println!(
        "encounters {}, too near in {}, with a way in {}, deepest {deepest:.1} m",
        outcomes.len(),
        count(&|outcome| outcome.clearance < 0.0),
        count(&|outcome| outcome.has_way == Some(true)),
    );
    println!("  with a way: {}", which(&|outcome| outcome.has_way == Some(true)));
    for kind in [EncounterKind::HeadOn, EncounterKind::CrossingGiveWay] {
        let of_kind = |(_, outcome): &(u64, Outcome)| {
            let met = outcome.kinds.iter().filter(|(_, met)| **met == kind);
            let right = met.map(|(i, _)| outcome.right_side.get(i) != Some(&false));
            right.collect::<Vec<_>>()
        };
        let right: Vec<bool> = outcomes.iter().flat_map(of_kind).collect();
        let wrong = outcomes.iter().filter(|outcome| of_kind(outcome).contains(&false));
        let wrong: Vec<u64> = wrong.map(|(seed, _)| *seed).collect();
        let n = right.iter().filter(|right| **right).count();
        println!("{kind:?}: {n} of {} on the right side; wrong {wrong:?}", right.len());
    }
    println!(
        "manoeuvred in {}; the planned side changed in {} ({}), of {} passes",
        count(&|outcome| 0 < outcome.manoeuvres),
        count(&|outcome| 0 < outcome.side_changes),
        which(&|outcome| 0 < outcome.side_changes),
        outcomes.iter().map(|(_, outcome)| outcome.sides.len()).sum::<usize>(),
    );
    let each = |value: &dyn Fn(&Outcome) -> Option<f64>| -> Vec<f64> {
        outcomes.iter().filter_map(|(_, outcome)| value(outcome)).collect()
    };
    let first = |outcome: &Outcome| outcome.first_action;
    for (name, mut values) in [
        ("first turn, deg", each(&|outcome| first(outcome).map(|(turn, _)| turn.abs().to_degrees()))),
        ("before the closest approach, s", each(&|outcome| first(outcome).map(|(_, time)| time))),
        ("manoeuvres", each(&|outcome| Some(outcome.manoeuvres as f64))),
        ("least distance beyond the one to keep, m", each(&|outcome| Some(outcome.clearance))),
        ("distance from the AUV, m", each(&|outcome| Some(rms(outcome.misses.iter())))),
        ("distance once clear, m", each(&Outcome::miss_after)),
        ("plan, ms", outcomes.iter().flat_map(|(_, outcome)| outcome.plan_ms.iter().copied()).collect()),
    ] {
        values.sort_by(f64::total_cmp);
        let at = |percent: usize| {
            let rank = (values.len() * percent).div_ceil(100).saturating_sub(1);
            values.get(rank).copied().unwrap_or(f64::NAN)
        };
        let [low, half, high, highest] = [5, 50, 95, 99].map(at);
        let n = values.len();
        println!("{name}: 5 % {low:.2}, median {half:.2}, 95 % {high:.2}, 99 % {highest:.2}, n {n}");
    }
}
