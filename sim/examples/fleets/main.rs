//! Drawn fleets: kinematic craft that share AUVs on lanes, steered once a second by the planner's
//! assignment or by another one, each with the planner's own plan for its part.
//!
//! ```text
//! cargo run --release -p pilotfish-sim --example fleets -- --seeds 1-30 --craft 2 --auvs 4 --goal visit
//! ```
//! A JSON line for each flight. `--assign` names the assignments to fly: `fleet` (the planner's),
//! `one` (the first craft alone), `split` (the best of all fixed ones, in hindsight), `nearest`,
//! `auction` (sequential, single items) and `territories` (k-means), these three anew each minute.
//! `hindsight` is the mean age of the best visits that are found with the true future.
//! `--dies` stops a drawn craft for good at a drawn time. `--far` and `--minutes` as they say.

mod hindsight;

use std::collections::BTreeMap;
use std::{env, error::Error};

use nalgebra::Vector2;
use pilotfish_sim::fleet::Assigner;
use planner::angle::{Course, Heading, direction, wrap};
use planner::fleet::{Assignment, CraftAssignment, Fleet, Member};
use planner::snapshot::{Limits, Reduce, VehicleId, Visits};
use planner::stop::Stop;
use planner::{Asc, Auv, AuvState, Goal, Parameters, PlanRequest, PreviousPlan, Workspace, plan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use hindsight::Hindsight;

type Failure = Box<dyn Error + Send + Sync>;

const TURN_RATE: f64 = 0.3;
const SPEED: f64 = 1.5;
const ACCELERATION: f64 = 0.3;
const LAG: f64 = 1.5;
/// Distance within which an AUV is served, m, and time between two assignments of other rules, s.
const WITHIN: f64 = 20.0;
const ANEW: usize = 60;

/// An AUV on lanes.
struct Lanes {
    corners: Vec<Vector2<f64>>,
    speed: f64,
}

impl Lanes {
    fn draw(rng: &mut ChaCha8Rng, far: f64) -> Self {
        let along = direction(rng.random_range(-3.1..3.1));
        let mut across = Vector2::new(-along.y, along.x) * rng.random_range(15.0..40.0);
        let length = rng.random_range(80.0..200.0);
        let mut at = Vector2::new(rng.random_range(-far..far), rng.random_range(-far..far));
        let mut corners = vec![at];
        for lane in 0..60 {
            at += along * if lane % 2 == 0 { length } else { -length };
            corners.push(at);
            at += across;
            corners.push(at);
            if lane % 6 == 5 {
                across = -across;
            }
        }
        Self { corners, speed: rng.random_range(0.3..0.8) }
    }

    fn at(&self, t: f64) -> (Vector2<f64>, f64) {
        let mut left = self.speed * t;
        for leg in self.corners.windows(2) {
            let way = leg[1] - leg[0];
            if left <= way.norm() {
                return (leg[0] + way * (left / way.norm()), way.y.atan2(way.x));
            }
            left -= way.norm();
        }
        (self.corners[self.corners.len() - 1], 0.0)
    }
}

#[derive(Clone)]
struct Craft {
    id: VehicleId,
    position: Vector2<f64>,
    heading: f64,
    speed: f64,
}

impl Craft {
    /// A tenth of a second later.
    fn step(&mut self, (speed, heading): (f64, f64)) {
        let turn = wrap(heading - self.heading).clamp(-TURN_RATE, TURN_RATE);
        self.heading += 0.1 * turn;
        self.speed += 0.1 * ((speed.clamp(0.0, SPEED) - self.speed) / LAG).clamp(-ACCELERATION, ACCELERATION);
        self.position += direction(self.heading) * (0.1 * self.speed);
    }
}

/// A drawn fleet.
struct Scene {
    auvs: Vec<(VehicleId, Lanes)>,
    craft: Vec<Craft>,
    /// Which craft stops for good, and when, s.
    dies: Option<(usize, usize)>,
    seconds: usize,
    goal: String,
}

impl Scene {
    fn goal(&self) -> Result<Goal, Failure> {
        let auvs: Vec<_> = self.auvs.iter().map(|(id, _)| id.clone()).collect();
        Ok(match &*self.goal {
            "visit" => Goal::Visit(Visits::new(auvs)),
            "worst" => Goal::Visit(Visits { reduce: Reduce::Max, ..Visits::new(auvs) }),
            "midpoint" => Goal::Midpoint { auvs },
            "range" => Goal::Range { auvs, range_m: 5000.0 },
            other => return Err(format!("no goal {other}").into()),
        })
    }

    fn request(&self, t: usize, craft: &Craft, goal: Goal, previous: Option<PreviousPlan>) -> PlanRequest {
        let auv = |(id, lanes): &(VehicleId, Lanes)| {
            let (at, course) = lanes.at(t as f64);
            Auv::new(&*id.0, AuvState::new(at, 10.0, Course::new(course), lanes.speed))
        };
        let asc = Asc::new(craft.position, Heading::new(craft.heading), craft.speed);
        let auvs = self.auvs.iter().map(auv).collect();
        let mut request = PlanRequest::new(t as f64, asc, auvs, goal);
        request.limits = Some(Limits { speed_max: SPEED, speed_min: 0.0, ..Limits::MEDUSA }.into());
        request.previous_plan = previous;
        request
    }
}

/// What a flight showed.
#[derive(Default)]
struct Outcome {
    ages: f64,
    worst: f64,
    square: f64,
    least: f64,
    energy: f64,
    changes: usize,
    gap: Vec<f64>,
    ms: Vec<f64>,
}

/// A flight under way.
struct Flight<'a> {
    scene: &'a Scene,
    rule: &'a Assigner,
    separation: f64,
    craft: Vec<Craft>,
    plans: BTreeMap<VehicleId, PreviousPlan>,
    before: Option<Assignment>,
    workspace: Workspace,
    seen: Outcome,
}

impl Flight<'_> {
    /// The fleet at `t`, s, as a client posts it.
    fn fleet(&self, t: usize) -> Result<Fleet, Failure> {
        let member = |craft: &Craft| {
            let (goal, previous) = (self.scene.goal()?, self.plans.get(&craft.id).cloned());
            let mut request = self.scene.request(t, craft, goal, previous);
            request.vessel_separation_m = Some(self.separation);
            Ok(Member { id: craft.id.clone(), serves: None, is_away: false, place_before: 0, request })
        };
        let members: Vec<Member> = self.craft.iter().map(member).collect::<Result<_, Failure>>()?;
        let gone = self.before.iter().flat_map(|before| &before.craft).filter_map(|gone| {
            let is_gone = members.iter().all(|member| member.id != gone.id);
            let previous_plan = self.plans.get(&gone.id).cloned();
            let request = PlanRequest { previous_plan, ..members[0].request.clone() };
            is_gone.then(|| Member {
                id: gone.id.clone(),
                serves: None,
                is_away: false,
                place_before: 0,
                request,
            })
        });
        let gone: Vec<_> = gone.collect();
        Fleet::new(members, (self.before.as_ref(), &gone), &|| false)
            .map_err(|faults| format!("{faults:?}").into())
    }

    fn assign(&mut self, t: usize, fleet: &Fleet) -> Assignment {
        let is_new = |before: &Assignment| before.craft.len() != self.craft.len() || t.is_multiple_of(ANEW);
        let assignment = match (self.rule, &self.before) {
            (Assigner::Planner, _) => fleet.assign(&Parameters::default(), &Stop::never()),
            (_, Some(before)) if !is_new(before) => before.clone(),
            _ => {
                let places: Vec<_> = self.craft.iter().map(|craft| craft.position).collect();
                let auvs = self.scene.auvs.iter().map(|(_, lanes)| lanes.at(t as f64).0);
                let of = self.rule.assign(&places, &auvs.collect::<Vec<_>>(), &|_, _| true);
                let part = |k: usize| {
                    let own = self.scene.auvs.iter().zip(&of).filter(|(_, of)| **of == Some(k));
                    own.map(|((id, _), _)| id.clone()).collect()
                };
                let parts = self.craft.iter().enumerate();
                let parts = parts.map(|(k, craft)| CraftAssignment {
                    id: craft.id.clone(),
                    auvs: part(k),
                    beside: false,
                });
                Assignment { craft: parts.collect(), ..Assignment::default() }
            }
        };
        if *self.rule == Assigner::Planner && 0.0 < assignment.cost {
            self.seen.gap.push(1.0 - assignment.bound / assignment.cost);
        }
        let of = |assignment: &Assignment, id: &VehicleId| {
            let craft = assignment.craft.iter().find(|craft| craft.auvs.contains(id));
            craft.map(|craft| craft.id.clone())
        };
        let auvs = || self.scene.auvs.iter().map(|(id, _)| id);
        if let Some(before) = &self.before {
            self.seen.changes += auvs().filter(|id| of(before, id) != of(&assignment, id)).count();
        }
        assignment
    }

    /// The references, speed and heading, of all craft.
    fn steer(&mut self, t: usize) -> Result<Vec<(f64, f64)>, Failure> {
        let begun = std::time::Instant::now();
        let fleet = self.fleet(t)?;
        let assignment = self.assign(t, &fleet);
        let parameters = Parameters::default();
        let workspace = &mut self.workspace;
        let plans = fleet.plans(&assignment, |snapshot, _| plan(&snapshot, &parameters, workspace));
        let references =
            plans.iter().map(|plan| (plan.reference.speed, plan.reference.heading.radians())).collect();
        self.plans.clear();
        for (k, (craft, planned)) in self.craft.iter().zip(&plans).enumerate() {
            let mut previous = PreviousPlan::from(planned);
            let keep = |id: &VehicleId| Fleet::tells_of(k, &assignment, id);
            previous.targets.iter_mut().for_each(|targets| targets.retain(|target| keep(&target.id)));
            self.plans.insert(craft.id.clone(), previous);
        }
        self.before = Some(assignment);
        self.seen.ms.push(1e3 * begun.elapsed().as_secs_f64());
        Ok(references)
    }

    /// Sails a second, and measures.
    fn sail(&mut self, t: usize, references: &[(f64, f64)], ages: &mut [f64]) {
        let (craft, seen, auvs) = (&mut self.craft, &mut self.seen, &self.scene.auvs);
        for _ in 0..10 {
            for (craft, reference) in craft.iter_mut().zip(references) {
                craft.step(*reference);
            }
            for (i, one) in craft.iter().enumerate() {
                for other in &craft[..i] {
                    seen.least = seen.least.min((one.position - other.position).norm());
                }
            }
        }
        seen.energy += craft.iter().map(|craft| craft.speed.powi(3)).sum::<f64>();
        let share = 1.0 / (auvs.len() * self.scene.seconds) as f64;
        for (age, (_, lanes)) in ages.iter_mut().zip(auvs) {
            let at = lanes.at((t + 1) as f64).0;
            let distances = craft.iter().map(|craft| (craft.position - at).norm());
            let distance = distances.fold(f64::INFINITY, f64::min);
            *age = if distance <= WITHIN { 0.0 } else { *age + 1.0 };
            seen.square += distance.powi(2) * share;
            seen.ages += *age * share;
            seen.worst = f64::max(seen.worst, *age);
        }
    }
}

fn fly(scene: &Scene, rule: &Assigner, separation: f64) -> Result<Outcome, Failure> {
    let (plans, before, workspace) = (BTreeMap::new(), None, Workspace::default());
    let seen = Outcome { least: f64::INFINITY, ..Outcome::default() };
    let craft = scene.craft.clone();
    let mut flight = Flight { scene, rule, separation, craft, plans, before, workspace, seen };
    let mut ages = vec![0.0; scene.auvs.len()];
    for t in 0..scene.seconds {
        if let Some((k, _)) = scene.dies.filter(|(_, at)| *at == t) {
            flight.craft.remove(k.min(flight.craft.len() - 1));
        }
        let references = flight.steer(t)?;
        flight.sail(t, &references, &mut ages);
    }
    Ok(flight.seen)
}

fn option(name: &str, otherwise: &str) -> String {
    let mut arguments = env::args().skip_while(|argument| argument != name).skip(1);
    arguments.next().unwrap_or_else(|| otherwise.to_owned())
}

fn range(text: &str) -> Result<(u64, u64), Failure> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    Ok((from.parse()?, to.parse()?))
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, reason = "an index")]
    let at = (share * (values.len().max(1) - 1) as f64) as usize;
    values.get(at).copied().unwrap_or(f64::NAN)
}

fn main() -> Result<(), Failure> {
    let (from, to) = range(&option("--seeds", "1-10"))?;
    let ((craft_least, craft_most), (auvs_least, auvs_most)) =
        (range(&option("--craft", "2"))?, range(&option("--auvs", "4"))?);
    let (far, minutes): (f64, f64) = (option("--far", "500").parse()?, option("--minutes", "30").parse()?);
    let separation: f64 = option("--separation", "30").parse()?;
    let (goal, assign) = (option("--goal", "visit"), option("--assign", "fleet"));
    for seed in from..=to {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (n_craft, n) =
            (rng.random_range(craft_least..=craft_most), rng.random_range(auvs_least..=auvs_most));
        let auvs = (0..n).map(|i| (VehicleId(format!("auv-{i}")), Lanes::draw(&mut rng, far))).collect();
        let mut craft: Vec<Craft> = vec![];
        while (craft.len() as u64) < n_craft {
            let position = Vector2::new(rng.random_range(-150.0..150.0), rng.random_range(-150.0..150.0));
            if craft.iter().all(|other| 80.0 < (other.position - position).norm()) {
                let id = VehicleId(format!("asc-{}", craft.len()));
                craft.push(Craft { id, position, heading: rng.random_range(-3.1..3.1), speed: 0.0 });
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "minutes of a flight")]
        let seconds = (60.0 * minutes.max(1.0)) as usize;
        let dies = (rng.random_range(0..craft.len()), rng.random_range(seconds / 5..seconds / 2));
        let dies = env::args().any(|argument| argument == "--dies").then_some(dies);
        if dies.is_some() && (craft.len() < 2 || assign.contains("one")) {
            return Err("a craft that dies leaves another one: --craft 2 or more, and not `one`".into());
        }
        let all = craft.clone();
        let mut scene = Scene { auvs, craft, dies, seconds, goal: goal.clone() };
        for name in assign.split(',') {
            scene.craft = all.iter().take(if name == "one" { 1 } else { all.len() }).cloned().collect();
            if name == "hindsight" {
                let track =
                    |(_, lanes): &(VehicleId, Lanes)| (0..seconds).map(|t| lanes.at(t as f64).0).collect();
                let tracks = scene.auvs.iter().map(track).collect();
                let craft = scene.craft.iter().map(|craft| craft.position).collect();
                let age = Hindsight { tracks, craft }.mean_age(seed);
                println!("{}", json!({ "seed": seed, "assign": name, "score": age }));
                continue;
            }
            let rules = match name {
                "fleet" | "one" => vec![Assigner::Planner],
                "split" => {
                    let (m, n) = (scene.craft.len(), scene.auvs.len());
                    let digits = |mut code: usize| {
                        let mut next = || (code % m, code /= m).0;
                        Assigner::Fixed((0..n).map(|_| next()).collect())
                    };
                    (0..m.pow(u32::try_from(n)?)).map(digits).collect()
                }
                other => {
                    let rule = Assigner::RULES.into_iter().find(|rule| rule.guide() == other);
                    vec![rule.ok_or_else(|| format!("no assignment {other}"))?]
                }
            };
            let flights = rules.iter().map(|rule| Ok((fly(&scene, rule, separation)?, rule)));
            let flights: Vec<_> = flights.collect::<Result<_, Failure>>()?;
            let score = |seen: &Outcome| match &*scene.goal {
                "visit" => seen.ages,
                "worst" => seen.worst,
                _ => seen.square.sqrt(),
            };
            let best = flights.into_iter().min_by(|a, b| score(&a.0).total_cmp(&score(&b.0)));
            let Some((mut seen, rule)) = best else { continue };
            let split = if let Assigner::Fixed(of) = rule { Some(of) } else { None };
            let (gap, ms, ms99) =
                (quantile(&mut seen.gap, 0.5), quantile(&mut seen.ms, 0.5), quantile(&mut seen.ms, 0.99));
            println!(
                "{}",
                json!({ "seed": seed, "assign": name, "craft": n_craft, "auvs": n, "score": score(&seen),
                    "age_s": seen.ages, "worst_s": seen.worst, "rms_m": seen.square.sqrt(), "least_m": seen.least,
                    "energy": seen.energy, "changes": seen.changes, "gap": gap, "ms": ms, "ms99": ms99, "split": split })
            );
        }
    }
    Ok(())
}
