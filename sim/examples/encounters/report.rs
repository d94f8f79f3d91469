//! What becomes of an encounter, and the table of many.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use planner::angle::{direction, wrap};
use planner::snapshot::{Avoidance, EncounterKind};

use crate::drawn::Drawn;
use crate::oracle::{Point, Side};
use crate::{DURATION, SEPARATION};

/// Time that a plan foresees, s.
const LOOK_AHEAD: f64 = 300.0;

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
    /// Time, s, and distance, m, of each vessel's first pass on another side.
    pub(crate) wrong: BTreeMap<usize, (f64, f64)>,
    /// Time from which each vessel was a risk, s, and each place of the craft, one a second.
    risk_from: BTreeMap<usize, f64>,
    pub(crate) places: Vec<Vector2<f64>>,
    /// Changes of a planned side: time, vessel, side, and the words of both plans.
    pub(crate) changes: Vec<(f64, usize, f64, String)>,
    told: String,
    /// Turn of the first manoeuvre, rad, and the time until the closest approach, s.
    first_action: Option<(f64, f64)>,
    /// The present manoeuvre's heading, rad, and end, s, and how many there were.
    present: (f64, f64),
    manoeuvres: usize,
    /// The side on which the craft means to pass each vessel, and how often one changed.
    sides: BTreeMap<usize, f64>,
    side_changes: usize,
    /// The same with passes that no plan reaches yet.
    far_sides: BTreeMap<usize, f64>,
    far_changes: usize,
    last_near: f64,
    /// Times, s, and distances from the AUV, m.
    pub(crate) misses: Vec<(f64, f64)>,
    pub(crate) plan_ms: Vec<f64>,
}

impl Outcome {
    /// Notes what a plan does about the vessels; `course` is the AUV's, rad.
    pub(crate) fn observe(&mut self, avoidance: &Avoidance, now: f64, course: f64) {
        for encounter in &avoidance.encounters {
            let i: usize = encounter.vessel.0[5..].parse().unwrap_or(0);
            self.kinds.entry(i).or_insert(encounter.kind);
            let _ = self.risk_from.entry(i).or_insert(now);
            // A pass right ahead or astern has no side, and what is past changes none.
            let has_side = 0.5 * encounter.passes_m < encounter.starboard_m.abs() && 0.0 < encounter.tcpa_s;
            let side = encounter.starboard_m.signum();
            if encounter.acts && has_side {
                let before = self.far_sides.insert(i, side);
                self.far_changes += usize::from(before.is_some_and(|before| before != side));
            }
            if encounter.acts && has_side && encounter.tcpa_s < LOOK_AHEAD {
                let before = self.sides.insert(i, side);
                if before.is_some_and(|before| before != side) {
                    self.side_changes += 1;
                    let words = format!(
                        "{:?} passes {:.0} starboard {:.0} tcpa {:.0}\n      was {}\n      now {}",
                        encounter.kind,
                        encounter.passes_m,
                        encounter.starboard_m,
                        encounter.tcpa_s,
                        self.told,
                        avoidance.sentence
                    );
                    self.changes.push((now, i, -side, words));
                }
            }
        }
        self.told = format!("{} {:?}", avoidance.sentence, avoidance.manoeuvre);
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
            if !right {
                let _ = self.wrong.entry(i).or_insert((time, clearance));
            }
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

/// Prints what went wrong in an encounter, and whether it had to, by a search with the true future:
/// `free` for a way at 0.8 of the speed, `no` for none at all of it.
pub(crate) fn judge(drawn: &Drawn, seed: u64, outcome: &Outcome) {
    let most = drawn.hull.limits.speed_max;
    let ways = |from: f64, sides: &BTreeMap<usize, Side>| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole second")]
        let start = outcome.places[from as usize];
        let at = |share: f64| Point { start, from, speed: share * most }.has_a_way(drawn, sides);
        if at(0.8) {
            "free"
        } else if at(1.0) {
            "hard"
        } else {
            "no"
        }
    };
    let rules = |sides: &mut BTreeMap<usize, Side>| {
        for (i, kind) in &outcome.kinds {
            let side = match kind {
                EncounterKind::HeadOn => Side::Abeam(1.0),
                EncounterKind::CrossingGiveWay => Side::Ahead,
                _ => continue,
            };
            let _ = sides.entry(*i).or_insert(side);
        }
    };
    for (i, (time, clearance)) in &outcome.wrong {
        let (ship, risk) = (&drawn.ships[*i], outcome.risk_from[i]);
        println!(
            "{seed} ship-{i} {:?} wrong at {time:.0} s, {clearance:.0} m beyond, speed {:.1}, length {:.0}, risk from {risk:.0} s, {} ships",
            outcome.kinds[i],
            ship.speed,
            ship.length,
            drawn.ships.len()
        );
        let mut sides = BTreeMap::new();
        rules(&mut sides);
        let only: BTreeMap<_, _> = [(*i, sides[i])].into();
        println!(
            "   way from risk: clear {}, with all sides {}; from 12 s: {}, {}",
            ways(risk, &only),
            ways(risk, &sides),
            ways(12.0, &only),
            ways(12.0, &sides)
        );
    }
    for (time, i, side, words) in &outcome.changes {
        let only: BTreeMap<_, _> = [(*i, Side::Abeam(-side))].into();
        let mut sides = only.clone();
        rules(&mut sides);
        println!("{seed} ship-{i} changes side from {side} at {time:.0} s: {words}");
        println!(
            "   way on the side before: clear {}, with all sides {}",
            ways(*time, &only),
            ways(*time, &sides)
        );
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
        "manoeuvred in {}; the planned side changed in {} ({}), of {} passes; with those that no plan reaches in {}",
        count(&|outcome| 0 < outcome.manoeuvres),
        count(&|outcome| 0 < outcome.side_changes),
        which(&|outcome| 0 < outcome.side_changes),
        outcomes.iter().map(|(_, outcome)| outcome.sides.len()).sum::<usize>(),
        count(&|outcome| 0 < outcome.far_changes),
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
