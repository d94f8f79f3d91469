//! Drawn encounters with other vessels, sailed by a kinematic craft that the planner steers once a
//! second behind an AUV.
//!
//! ```text
//! cargo run --release -p pilotfish-sim --example encounters -- --seeds 1-1000 --vessels 1
//! cargo run --release -p pilotfish-sim --example encounters -- --seeds 1-500 --vessels 2-8 --craft otter
//! cargo run --release -p pilotfish-sim --example encounters -- --seeds 1-500 --law velocity_obstacle:120:0.3
//! ```
//! Rows of a table in Markdown: violations of the distance to keep, those for which a search with
//! the true future finds a clear way (at 0.8 of the craft's speed), and the deepest; by kind of
//! encounter the share of passes on the side that the rules ask for, the first action (turn, time
//! before the closest approach); changes of the planned side; and the distance from the AUV without
//! traffic, beside the same once the vessels are past. `--judge` says of each wrong pass and changed
//! side whether a point that knows the future had another way; `--opposite 0.3` flies only
//! encounters with a vessel whose course is within that of the opposite one, rad. With `--show
//! SEED` the tracks of one encounter as CSV.

mod drawn;
mod laws;
mod oracle;
mod report;

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::{env, error::Error, ops::RangeInclusive, thread};

use nalgebra::Vector2;
use planner::angle::{Heading, direction, wrap};
use planner::snapshot::Vessel;
use planner::tuned::Tuned;
use planner::{Asc, Auv, AuvState, Goal, Parameters, PlanRequest, Snapshot, Workspace, plan};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::drawn::{Drawn, Hull, Ship, draw, hear};
use crate::laws::{Law, Memory};
use crate::oracle::Point;
use crate::report::{Outcome, judge, report, shown};

type Failure = Box<dyn Error + Send + Sync>;

/// Time of an encounter, s.
const DURATION: usize = 700;
const SEPARATION: f64 = 30.0;

/// A craft under way.
struct Craft {
    hull: Hull,
    position: Vector2<f64>,
    heading: f64,
    speed: f64,
    yaw_rate: f64,
}

impl Craft {
    /// Advances by a tenth of a second towards a speed and a heading.
    fn step(&mut self, speed: f64, heading: f64) {
        let Hull { limits, heading_lag, speed_lag } = self.hull;
        let off = wrap(heading - self.heading) / heading_lag.max(0.3);
        let rate = off.clamp(-limits.turn_rate_max, limits.turn_rate_max);
        self.yaw_rate += (rate - self.yaw_rate) * 0.1 / 0.4;
        self.heading = wrap(self.heading + self.yaw_rate * 0.1);
        let push = (speed - self.speed) / speed_lag;
        self.speed += push.clamp(-limits.deceleration_max, limits.acceleration_max) * 0.1;
        self.position += direction(self.heading) * self.speed * 0.1;
    }

    fn asc(&self) -> Asc {
        let yaw_rate_radps = self.yaw_rate;
        Asc { yaw_rate_radps, ..Asc::new(self.position, Heading::new(self.heading), self.speed) }
    }
}

fn fly(drawn: &Drawn, seed: u64, law: Law, tuned: &Tuned, show: bool) -> Result<Outcome, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0xA15);
    let (parameters, mut workspace, mut memory) =
        (Parameters::default(), Workspace::default(), Memory::default());
    let mut outcome = Outcome::default();
    outcome.clearance = f64::INFINITY;
    if law != Law::Planner {
        // Encounters are of the kind that the planner sees in them.
        outcome.kinds = fly(drawn, seed, Law::Planner, tuned, false)?.kinds;
    }
    let AuvState { course_rad: heading, speed_mps: speed, .. } = drawn.auv;
    let start = direction(heading) * -3.0;
    let mut craft = Craft { hull: drawn.hull, position: start, heading, speed, yaw_rate: 0.0 };
    let mut previous = None;
    let mut heard: Vec<Option<Vessel>> = vec![None; drawn.ships.len()];
    for t in 0..DURATION {
        let now = t as f64;
        outcome.places.push(craft.position);
        let auv = drawn.auv_at(now);
        hear(drawn, t, &mut rng, &mut heard);
        let (speed, heading) = if law == Law::Planner {
            let goal = Goal::Track { auv: "auv".into() };
            let mut request = PlanRequest::new(now, craft.asc(), vec![Auv::new("auv", auv)], goal);
            request.limits = Some(drawn.hull.limits.into());
            request.traffic = heard.iter().flatten().cloned().collect();
            request.vessel_separation_m = Some(SEPARATION);
            request.previous_plan = previous.take();
            let begun = cpu_ms()?;
            let answer = plan(&Snapshot::with(request, tuned, &|| false)?, &parameters, &mut workspace);
            outcome.plan_ms.push(cpu_ms()? - begun);
            if let Some(avoidance) = &answer.avoidance {
                outcome.observe(avoidance, now, heading);
            }
            if show {
                let told = answer.avoidance.as_ref().map_or("", |avoidance| &avoidance.sentence);
                shown(drawn, now, craft.position, told);
            }
            previous = Some((&answer).into());
            (answer.reference.speed, answer.reference.heading.radians())
        } else {
            let velocity = direction(craft.heading) * craft.speed;
            law.steer(&mut memory, &heard, (now, craft.position, velocity), &auv, drawn.hull.limits.speed_max)
        };
        for step in 1..=10 {
            craft.step(speed, heading);
            outcome.pass(drawn, now + 0.1 * f64::from(step), craft.position);
        }
        outcome.misses.push((now, (craft.position - drawn.auv_at(now + 1.0).position()).norm()));
    }
    if law == Law::Planner && outcome.clearance < 0.0 {
        let point = Point { start, from: 0.0, speed: 0.8 * drawn.hull.limits.speed_max };
        outcome.has_way = Some(point.has_a_way(drawn, &BTreeMap::new()));
    }
    Ok(outcome)
}

/// Time of this thread on a processor, ms: what else runs does not count.
fn cpu_ms() -> Result<f64, Failure> {
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    Ok(spent.split(' ').next().ok_or("no time")?.parse::<f64>()? / 1e6)
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
    let law = option("--law", Law::Planner);
    let tuned: &Tuned = &serde_json::from_str(&option("--tuned", "{}".to_owned()))?;
    let show: u64 = option("--show", 0);
    if 0 < show {
        fly(&draw(show, vessels, &craft, turning), show, law, tuned, true).map(drop)?;
        return Ok(());
    }
    let judges = env::args().any(|argument| argument == "--judge");
    let threads: u64 = option("--threads", 1);
    let opposite: f64 = option("--opposite", PI);
    let meets = |seed: &u64| {
        let drawn = draw(*seed, vessels.clone(), &craft, turning);
        let off = |ship: &Ship| wrap(ship.course - drawn.auv.course_rad + PI).abs();
        PI <= opposite || drawn.ships.iter().any(|ship| 0.0 < ship.speed && off(ship) < opposite)
    };
    let seeds: Vec<u64> = seeds.filter(meets).collect();
    let fly_some = |k: u64| -> Result<Vec<(u64, Outcome)>, Failure> {
        let own = seeds.iter().filter(|seed| **seed % threads == k);
        own.map(|seed| {
            let drawn = draw(*seed, vessels.clone(), &craft, turning);
            let outcome = fly(&drawn, *seed, law, tuned, false)?;
            if judges {
                judge(&drawn, *seed, &outcome);
            }
            Ok((*seed, outcome))
        })
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
