//! Drawn encounters with other vessels, sailed by a kinematic craft that the planner steers once a
//! second behind an AUV.
//!
//! ```text
//! cargo run --release -p pilotfish-sim --example encounters -- --seeds 1-1000 --vessels 1
//! cargo run --release -p pilotfish-sim --example encounters -- --seeds 1-500 --vessels 2-8 --craft otter
//! ```
//! Rows of a table in Markdown: violations of the distance to keep, those for which a search with
//! the true future finds a clear way (at 0.8 of the craft's speed), and the deepest; by kind of encounter
//! the share of passes on the side that the rules ask for, the first action (turn, time before the
//! closest approach); changes of the planned side; and the distance from the AUV without traffic,
//! beside the same once the vessels are past. With `--show SEED` the tracks of one encounter as CSV.

use std::f64::consts::FRAC_PI_2;
use std::{collections::BTreeMap, env, error::Error, ops::RangeInclusive, thread};

use nalgebra::Vector2;
use planner::angle::{Course, Heading, direction, wrap};
use planner::snapshot::{Avoidance, EncounterKind, Vessel, VesselStatus};
use planner::{Asc, Auv, AuvState, Goal, Limits, Parameters, PlanRequest, Snapshot, Workspace, plan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Failure = Box<dyn Error + Send + Sync>;

/// Time of an encounter, s.
const DURATION: usize = 700;
const SEPARATION: f64 = 30.0;

/// A kinematic craft: a heading that turns at a limited rate after a lag, and a speed likewise.
#[derive(Clone, Copy)]
struct Hull {
    limits: Limits,
    heading_lag: f64,
    speed_lag: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Behaviour {
    /// Keeps its course and speed.
    StandsOn,
    /// Turns by this angle at this time.
    Turns(f64, f64),
}

#[derive(Clone)]
struct Ship {
    start: Vector2<f64>,
    course: f64,
    speed: f64,
    length: f64,
    behaviour: Behaviour,
    /// Time between its reports, s, and their age when they come.
    interval: usize,
    latency: f64,
}

impl Ship {
    fn at(&self, time: f64) -> (Vector2<f64>, f64) {
        let (turn, when) = match self.behaviour {
            Behaviour::StandsOn => (0.0, f64::INFINITY),
            Behaviour::Turns(turn, when) => (turn, when),
        };
        let before = time.min(when);
        let later = direction(self.course + turn) * (time - before);
        let place = self.start + (direction(self.course) * before + later) * self.speed;
        (place, if time < when { self.course } else { self.course + turn })
    }
}

struct Drawn {
    auv: AuvState,
    ships: Vec<Ship>,
    hull: Hull,
}

/// What became of an encounter.
#[derive(Default)]
struct Outcome {
    /// Least distance beyond the one to keep, m.
    clearance: f64,
    has_way: Option<bool>,
    kinds: BTreeMap<usize, EncounterKind>,
    right_side: BTreeMap<usize, bool>,
    first_action: Option<(f64, f64)>,
    side_changes: usize,
    sides: BTreeMap<usize, f64>,
    course_changes: usize,
    manoeuvred: bool,
    after: f64,
    plan_ms: Vec<f64>,
}

fn draw(seed: u64, n: RangeInclusive<usize>, craft: &str, turning: f64) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let medusa = Hull { limits: Limits::MEDUSA, heading_lag: 1.0, speed_lag: 3.0 };
    let hull = match craft {
        "otter" => Hull {
            limits: Limits {
                speed_max: 3.0,
                turn_rate_max: 0.4,
                acceleration_max: 0.3,
                deceleration_max: 0.3,
                ..Limits::MEDUSA
            },
            ..medusa
        },
        "random" => Hull {
            limits: Limits {
                speed_max: rng.random_range(1.2..5.0),
                turn_rate_max: rng.random_range(0.1..0.6),
                acceleration_max: rng.random_range(0.05..0.6),
                deceleration_max: rng.random_range(0.05..0.6),
                ..Limits::MEDUSA
            },
            heading_lag: rng.random_range(0.3..4.0),
            speed_lag: rng.random_range(0.5..6.0),
        },
        _ => medusa,
    };
    let speed = rng.random_range(0.3..0.6) * hull.limits.speed_max.min(2.5);
    let course = rng.random_range(-3.1..3.1);
    let auv = AuvState::new(Vector2::zeros(), 10.0, Course::new(course), speed);
    let ships = (0..rng.random_range(n)).map(|_| {
        let meets = rng.random_range(150.0..400.0);
        let cpa: f64 = rng.random_range(-100.0..100.0);
        let speed: f64 = if rng.random_bool(0.1) { 0.0 } else { rng.random_range(0.5..15.0) };
        let turn = rng.random_range(-3.1..3.1);
        let ship_course = wrap(course + turn);
        let across = direction(ship_course + FRAC_PI_2);
        let meeting = auv.position() + auv.velocity() * meets + across * cpa;
        Ship {
            start: meeting - direction(ship_course) * speed * meets,
            course: ship_course,
            speed,
            length: if speed < 5.0 { rng.random_range(5.0..30.0) } else { rng.random_range(10.0..120.0) },
            behaviour: if rng.random_bool(turning) {
                Behaviour::Turns(rng.random_range(-0.8..0.8), rng.random_range(30.0..300.0))
            } else {
                Behaviour::StandsOn
            },
            interval: rng.random_range(2..11),
            latency: rng.random_range(0.0..3.0),
        }
    });
    let ships = ships.collect::<Vec<_>>();
    // Nobody is too near at the start.
    let ships = ships.into_iter().filter(|ship| 150.0 + 0.5 * ship.length < ship.at(0.0).0.norm()).collect();
    Drawn { auv, ships, hull }
}

fn fly(drawn: &Drawn, seed: u64, show: bool) -> Result<Outcome, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0xA15);
    let (hull, parameters, mut workspace) = (drawn.hull, Parameters::default(), Workspace::default());
    let mut outcome = Outcome { clearance: f64::INFINITY, ..Outcome::default() };
    let behind = direction(drawn.auv.course_rad) * -3.0;
    let (mut position, mut heading, mut speed) = (behind, drawn.auv.course_rad, drawn.auv.speed_mps);
    let (mut yaw_rate, mut previous) = (0.0, None);
    let mut heard: Vec<Option<Vessel>> = vec![None; drawn.ships.len()];
    let (mut side, mut last_near, mut after) = (0.0_f64, 0.0, Vec::new());
    for t in 0..DURATION {
        let now = t as f64;
        let auv = drawn.auv.position() + drawn.auv.velocity() * now;
        for (i, ship) in drawn.ships.iter().enumerate() {
            let (place, course) = ship.at(now - ship.latency);
            if (t + i) % ship.interval == 0 {
                let noise = Vector2::new(rng.random_range(-5.0..5.0), rng.random_range(-5.0..5.0));
                let seen = place + noise;
                heard[i] = Some(Vessel {
                    id: format!("ship-{i}").as_str().into(),
                    name: None,
                    t_s: Some(now - ship.latency),
                    north_m: seen.x,
                    east_m: seen.y,
                    lat_deg: None,
                    lon_deg: None,
                    course_rad: (0.3 < ship.speed).then(|| wrap(course + rng.random_range(-0.03..0.03))),
                    speed_mps: Some((ship.speed + rng.random_range(-0.05..0.05)).max(0.0)),
                    heading_rad: None,
                    length_m: Some(ship.length),
                    sigma_m: Some(5.0),
                    plan: Vec::new(),
                    status: VesselStatus::UnderWay,
                });
            }
        }
        let state = AuvState { north_m: auv.x, east_m: auv.y, ..drawn.auv };
        let asc = Asc { yaw_rate_radps: yaw_rate, ..Asc::new(position, Heading::new(heading), speed) };
        let mut request =
            PlanRequest::new(now, asc, vec![Auv::new("auv", state)], Goal::Track { auv: "auv".into() });
        request.limits = Some(hull.limits.into());
        request.traffic = heard.iter().flatten().cloned().collect();
        request.vessel_separation_m = Some(SEPARATION);
        request.previous_plan = previous.take();
        let begun = std::time::Instant::now();
        let answer = plan(&Snapshot::try_from(request)?, &parameters, &mut workspace);
        outcome.plan_ms.push(begun.elapsed().as_secs_f64() * 1e3);
        observe(&mut outcome, answer.avoidance.as_ref(), drawn.auv.course_rad, &mut side);
        if show {
            let to = answer.avoidance.as_ref().map_or("", |avoidance| &avoidance.sentence);
            print!(
                "{now},{:.1},{:.1},{:.1},{:.1},{:.2},{:.2}",
                position.x, position.y, auv.x, auv.y, heading, speed
            );
            for ship in &drawn.ships {
                let place = ship.at(now).0;
                print!(
                    ",{:.1},{:.1},{:.1}",
                    place.x,
                    place.y,
                    (place - position).norm() - 0.5 * ship.length - SEPARATION
                );
            }
            println!(",{},{to}", serde_json::to_string(&answer.method)?);
        }
        let reference = answer.reference;
        previous = Some((&answer).into());
        // A tenth of a second a step.
        for step in 0..10 {
            let off = wrap(reference.heading.radians() - heading);
            let rate = (off / hull.heading_lag.max(0.3))
                .clamp(-hull.limits.turn_rate_max, hull.limits.turn_rate_max);
            yaw_rate += (rate - yaw_rate) * 0.1 / 0.4;
            heading = wrap(heading + yaw_rate * 0.1);
            let push = ((reference.speed - speed) / hull.speed_lag)
                .clamp(-hull.limits.deceleration_max, hull.limits.acceleration_max);
            speed += push * 0.1;
            position += direction(heading) * speed * 0.1;
            let time = now + 0.1 * f64::from(step + 1);
            for (i, ship) in drawn.ships.iter().enumerate() {
                let (place, course) = ship.at(time);
                let there = position - place;
                let clearance = there.norm() - 0.5 * ship.length - SEPARATION;
                outcome.clearance = outcome.clearance.min(clearance);
                if clearance < 40.0 + 20.0 * ship.speed {
                    last_near = time;
                }
                sides(&mut outcome, i, &there, course, ship.speed);
            }
        }
        let auv = drawn.auv.position() + drawn.auv.velocity() * (now + 1.0);
        after.push(((now, last_near), (position - auv).norm()));
    }
    let late = after.iter().filter(|((now, _), _)| last_near + 200.0 < *now || 650.0 < *now);
    let (n, sum) = late.fold((0.0, 0.0), |(n, sum), (_, miss)| (n + 1.0, sum + miss * miss));
    outcome.after = if last_near + 250.0 < DURATION as f64 && 0.0 < n { (sum / n).sqrt() } else { f64::NAN };
    if outcome.clearance < 0.0 {
        outcome.has_way = Some(has_a_way(drawn, behind));
    }
    Ok(outcome)
}

fn observe(outcome: &mut Outcome, avoidance: Option<&Avoidance>, course: f64, side: &mut f64) {
    let Some(avoidance) = avoidance else { return };
    for encounter in &avoidance.encounters {
        let i: usize = encounter.vessel.0[5..].parse().unwrap_or(0);
        outcome.kinds.entry(i).or_insert(encounter.kind);
        if encounter.acts && 20.0 < encounter.starboard_m.abs() {
            let side = encounter.starboard_m.signum();
            let before = outcome.sides.insert(i, side);
            outcome.side_changes += usize::from(before.is_some_and(|before| before != side));
        }
    }
    if let Some(manoeuvre) = &avoidance.manoeuvre {
        outcome.manoeuvred = true;
        let until = avoidance.encounters.iter().map(|met| met.tcpa_s).fold(0.0, f64::max);
        let aside_first = wrap(manoeuvre.heading_rad - course);
        let _ = outcome.first_action.get_or_insert((aside_first, until));
        let aside = wrap(manoeuvre.heading_rad - course);
        if 0.2 < aside.abs() && aside.abs() < 2.9 {
            if *side * aside < 0.0 {
                outcome.course_changes += 1;
            }
            *side = aside.signum();
        }
    }
}

/// Notes on which side a vessel passes.
fn sides(outcome: &mut Outcome, i: usize, there: &Vector2<f64>, course: f64, speed: f64) {
    let along = direction(course);
    let (ahead, starboard) = (there.dot(&along), along.perp(there));
    let right = match outcome.kinds.get(&i) {
        // The craft has the vessel on its port side, abeam.
        Some(EncounterKind::HeadOn) if ahead.abs() < 0.1 * speed + 0.3 => starboard < 0.0,
        Some(EncounterKind::CrossingGiveWay) if starboard.abs() < 0.5 && ahead.abs() < 60.0 * speed => {
            ahead < 0.0
        }
        _ => return,
    };
    outcome.right_side.entry(i).and_modify(|before| *before &= right).or_insert(right);
}

/// `true` if a point of 0.8 of the craft's speed that knows the future has a clear way.
fn has_a_way(drawn: &Drawn, start: Vector2<f64>) -> bool {
    const CELL: f64 = 5.0;
    const HALF: i32 = 120;
    let step = CELL / (0.8 * drawn.hull.limits.speed_max);
    let mut reached = std::collections::HashSet::from([(0_i32, 0_i32)]);
    let mut time = 0.0;
    while time < DURATION as f64 {
        time += step;
        let clear = |cell: &(i32, i32)| {
            let place = start + Vector2::new(f64::from(cell.0), f64::from(cell.1)) * CELL;
            let is_clear =
                |at: f64, ship: &Ship| SEPARATION + 0.5 * ship.length < (place - ship.at(at).0).norm();
            drawn.ships.iter().all(|ship| is_clear(time, ship) && is_clear(time - 0.5 * step, ship))
        };
        let mut next = std::collections::HashSet::new();
        for (north, east) in &reached {
            for (a, b) in [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)] {
                let cell = (north + a, east + b);
                if cell.0.abs() <= HALF && cell.1.abs() <= HALF && clear(&cell) {
                    let _ = next.insert(cell);
                }
            }
        }
        if next.is_empty() {
            return false;
        }
        // Where no vessel comes any more, all is clear.
        reached = next;
        let last = drawn
            .ships
            .iter()
            .map(|ship| (ship.at(time).0 - start).dot(&direction(ship.course)) / ship.speed.max(0.1));
        if last.fold(f64::INFINITY, f64::min) > 200.0 {
            break;
        }
    }
    true
}

fn option<T: std::str::FromStr>(name: &str, default: T) -> T {
    let given = env::args().skip_while(|argument| argument != name).nth(1);
    given.and_then(|given| given.parse().ok()).unwrap_or(default)
}

fn range(text: &str) -> RangeInclusive<u64> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    from.parse().unwrap_or(1)..=to.parse().unwrap_or(1)
}

fn main() -> Result<(), Failure> {
    let seeds = range(&option("--seeds", "1-20".to_owned()));
    let vessels = range(&option("--vessels", "1".to_owned()));
    let vessels = usize::try_from(*vessels.start())?..=usize::try_from(*vessels.end())?;
    let (craft, turning) = (option("--craft", "medusa".to_owned()), option("--turning", 0.0));
    let show: u64 = option("--show", 0);
    if 0 < show {
        fly(&draw(show, vessels, &craft, turning), show, true).map(drop)?;
        return Ok(());
    }
    let threads: u64 = option("--threads", 1);
    let seeds: Vec<u64> = seeds.collect();
    let fly_some = |k: u64| -> Result<Vec<(u64, Outcome)>, Failure> {
        let own = seeds.iter().filter(|seed| **seed % threads == k);
        own.map(|seed| Ok((*seed, fly(&draw(*seed, vessels.clone(), &craft, turning), *seed, false)?)))
            .collect()
    };
    let outcomes: Vec<(u64, Outcome)> = thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|k| scope.spawn(move || fly_some(k))).collect();
        let parts: Result<Vec<_>, Failure> =
            running.into_iter().map(|thread| thread.join().map_err(|_| "a flight panicked")?).collect();
        parts.map(|parts| parts.into_iter().flatten().collect())
    })?;
    report(&outcomes);
    Ok(())
}

fn report(outcomes: &[(u64, Outcome)]) {
    let n = outcomes.len();
    let violated: Vec<_> = outcomes.iter().filter(|(_, outcome)| outcome.clearance < 0.0).collect();
    let avoidable: Vec<_> = violated.iter().filter(|(_, outcome)| outcome.has_way == Some(true)).collect();
    let deepest = outcomes.iter().map(|(_, outcome)| -outcome.clearance).fold(0.0, f64::max);
    println!(
        "encounters {n}, violated {}, of these with a way {}, deepest {deepest:.1} m",
        violated.len(),
        avoidable.len()
    );
    let named = |list: &[&&(u64, Outcome)]| {
        list.iter()
            .map(|(seed, outcome)| format!("{seed} ({:.1})", outcome.clearance))
            .collect::<Vec<_>>()
            .join(" ")
    };
    println!("  with a way: {}", named(&avoidable));
    for kind in [EncounterKind::HeadOn, EncounterKind::CrossingGiveWay] {
        let of_kind = outcomes.iter().flat_map(|(seed, outcome)| {
            outcome
                .kinds
                .iter()
                .filter(|(_, met)| **met == kind)
                .map(move |(i, _)| (*seed, outcome.right_side.get(i)))
        });
        let (mut right, mut all, mut wrong) = (0, 0, Vec::new());
        for (seed, side) in of_kind {
            all += 1;
            right += usize::from(side != Some(&false));
            if side == Some(&false) {
                wrong.push(seed);
            }
        }
        println!("{kind:?}: {right} of {all} on the right side; wrong {wrong:?}");
    }
    let changes: Vec<_> = outcomes
        .iter()
        .filter(|(_, outcome)| 0 < outcome.side_changes)
        .map(|(seed, outcome)| (*seed, outcome.side_changes))
        .collect();
    println!(
        "manoeuvred {}, planned side changed in {} {changes:?}",
        outcomes.iter().filter(|(_, o)| o.manoeuvred).count(),
        changes.len()
    );
    let mut turns: Vec<f64> = outcomes
        .iter()
        .filter_map(|(_, o)| o.first_action)
        .map(|(turn, _)| turn.abs().to_degrees())
        .collect();
    let mut times: Vec<f64> =
        outcomes.iter().filter_map(|(_, o)| o.first_action).map(|(_, time)| time).collect();
    let mut after: Vec<f64> =
        outcomes.iter().map(|(_, o)| o.after).filter(|after| after.is_finite()).collect();
    let mut plans: Vec<f64> = outcomes.iter().flat_map(|(_, o)| o.plan_ms.iter().copied()).collect();
    for (name, values) in [
        ("first turn, deg", &mut turns),
        ("before the closest approach, s", &mut times),
        ("distance once clear, m", &mut after),
        ("plan, ms", &mut plans),
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
