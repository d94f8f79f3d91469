//! Random snapshots from the whole accepted range: each answer is finite, within the limits, and by
//! a second implementation of the prediction no worse than line of sight.
//!
//! `SNAPSHOTS=100000 cargo test --release -p tests --test claims any_snapshot -- --nocapture` tries
//! that many and prints how they were answered.

use std::{collections::BTreeMap, f64::consts::PI, iter};

use nalgebra::Vector2;
use planner::{
    angle::wrap,
    craft::CraftModel,
    forecast::AuvForecast,
    goal::GoalForecast,
    los::{LosGains, target_course},
    parameters::{Parameters, Weights},
    plan::{Degraded, Method, Plan, Workspace, plan, scheduled_goal},
    snapshot::{Current, EncounterKind, Goal, PreviousPlan, Snapshot, TrajectoryPoint},
    solve::SolverStatus,
    stop::Stop,
    vessel::{VesselNow, vessels_now},
};
use rand::{RngExt as _, SeedableRng as _, seq::IndexedRandom as _};
use rand_chacha::ChaCha8Rng;
use tests::random;

fn n_snapshots() -> u64 {
    std::env::var("SNAPSHOTS").map_or(400, |n| n.parse().expect("SNAPSHOTS is a number"))
}

/// Answers to the snapshots of one share of the seeds.
#[derive(Default)]
struct Tally {
    refused: u64,
    /// Answers without a solved program though the AUVs are young enough: every limit is soft, so a
    /// solution exists, which the arithmetic does not always reach.
    unsolved: u64,
    answers: BTreeMap<String, u64>,
}

#[test]
fn every_answer_is_within_the_limits_and_no_worse_than_line_of_sight() {
    let n_threads = std::thread::available_parallelism().map_or(1, |n| n.get() as u64);
    let (mut refused, mut unsolved) = (0, 0);
    let mut answers: BTreeMap<String, u64> = BTreeMap::new();
    std::thread::scope(|scope| {
        // In pairs, because every other one is odd.
        let mine = |share: u64| move |seed: &u64| seed / 2 % n_threads == share;
        let begin = |share| scope.spawn(move || tally((0..n_snapshots()).filter(mine(share))));
        let threads: Vec<_> = (0..n_threads).map(begin).collect();
        for thread in threads {
            let share = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            (refused, unsolved) = (refused + share.refused, unsolved + share.unsolved);
            for (how, n) in share.answers {
                *answers.entry(how).or_default() += n;
            }
        }
    });
    println!("{refused} were no snapshots; the others: {answers:#?}");
    assert!(1000 * unsolved <= n_snapshots(), "{unsolved} unsolved");
    // Else the generator is off.
    assert!(10 * refused < n_snapshots(), "{refused} refused");
}

/// A client may send any memory of the craft's filter: it is used whole, or discarded.
#[test]
fn any_memory_of_the_craft_is_used_or_causes_a_warning_and_a_finite_answer() {
    let (parameters, mut workspace) = (Parameters::default(), Workspace::default());
    let mut scene = tests::followed(1.0);
    let plain = plan(&tests::snapshot(scene.clone()), &parameters, &mut workspace);
    let honest = PreviousPlan::from(&plain);
    let memory = honest.craft_estimate.as_ref().expect("every plan has one");
    let memory = memory.memory.clone();
    let with_memory = |memory: &[f64]| {
        let mut previous = honest.clone();
        if let Some(craft) = &mut previous.craft_estimate {
            craft.memory = memory.to_vec();
        }
        previous
    };
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    let (mut used, mut refused) = (0, 0);
    for _ in 0..4000 {
        let mut changed = memory.clone();
        for _ in 0..rng.random_range(1..12) {
            let place = rng.random_range(0..changed.len());
            let old = changed[place];
            changed[place] = *[0.0, -0.0, 1.0, -old, 2.0 * old, 100.0, -100.0, 0.1, -0.16, 4.0]
                .choose(&mut rng)
                .expect("there are some");
        }
        let previous = with_memory(&changed);
        let unusable = previous.has_unusable_memory();
        scene.previous_plan = Some(previous);
        let snapshot = tests::snapshot(scene.clone());
        let answer = plan(&snapshot, &parameters, &mut workspace);
        *(if unusable { &mut refused } else { &mut used }) += 1;
        let numbers = answer.craft.memory();
        assert!(numbers.iter().all(|number| number.is_finite()), "{changed:?}");
        assert!(answer.reference.speed.is_finite(), "{changed:?}");
    }
    assert!(100 < used && 100 < refused, "{used} used, {refused} refused");

    // Each correlation is possible, all of them together are not: the filter gets no number.
    let mut impossible = vec![0.0; memory.len()];
    (impossible[9], impossible[12], impossible[14], impossible[17]) = (1.0, 0.1, -0.163, 0.138);
    let previous = with_memory(&impossible);
    assert!(previous.has_unusable_memory());
    scene.previous_plan = Some(previous);
    let answer = plan(&tests::snapshot(scene), &parameters, &mut workspace);
    assert!(answer.reference.speed.is_finite());
}

fn tally(seeds: impl Iterator<Item = u64>) -> Tally {
    let parameters = Parameters::default();
    let mut workspace = Workspace::default();
    let mut tally = Tally::default();
    for seed in seeds {
        let mut observation = random::observation(seed);
        // Every other pair has levers.
        if seed / 2 % 2 == 1 {
            observation.tuning = Some(random::tuning(seed));
        }
        let Ok(scene) = Snapshot::try_from(observation) else {
            tally.refused += 1;
            continue;
        };
        let answer = plan(&scene, &parameters, &mut workspace);
        assert_usable(seed, &scene, &answer);
        let status = answer.solver.status;
        let how = format!("{:?}, {:?}, {status:?}", answer.method, answer.degraded);
        if !matches!(status, SolverStatus::Solved | SolverStatus::Unsolved) {
            println!("seed {seed}: {how} {:?}", answer.solver);
        }
        tally.unsolved += u64::from(!matches!(answer.degraded, None | Some(Degraded::StaleReport)));
        *tally.answers.entry(how).or_default() += 1;
        assert_no_worse(seed, &scene, &answer, &parameters.of(&scene));
    }
    tally
}

fn assert_usable(seed: u64, scene: &Snapshot, answer: &Plan) {
    // The range of a request's current.
    let slow = |current: Current| Vector2::from(current).amax() <= 3.0;
    let current = answer.current;
    assert!(current.is_none_or(slow), "seed {seed}: {current:?}");
    let (limits, speed) = (scene.limits(), answer.reference_through_water.speed);
    let stopped = answer.method == Method::Hold && speed == 0.0;
    let kept = limits.speed_min <= speed && speed <= limits.speed_max;
    assert!(kept || stopped, "seed {seed}: speed {speed}");
    // A current changes the command of an over-ground loop by its own size at most, and never makes
    // it negative or larger than the largest speed.
    let (commanded, most) = (answer.reference.speed, speed + scene.current().norm());
    let kept = 0.0 <= commanded && commanded <= (most + 1e-12).min(limits.speed_max);
    assert!(kept, "seed {seed}: speed {commanded}");
    for reference in [answer.reference, answer.reference_through_water] {
        let heading = reference.heading.radians();
        assert!(-PI < heading && heading <= PI, "seed {seed}: heading {heading}");
    }
    // The memory in an answer is accepted unchanged.
    let memory = answer.craft.memory();
    let read = planner::craft::CraftEstimate::from_memory(&memory);
    let is_kept = read.is_some_and(|read| read.memory() == memory);
    assert!(is_kept, "seed {seed}: {memory:?}");
    let mut numbers = vec![];
    for point in &answer.trajectory {
        numbers.extend([point.t_s, point.position().x, point.position().y]);
        numbers.extend([point.speed_mps, point.heading().radians()]);
    }
    for predicted in [answer.predicted, answer.baseline.predicted] {
        numbers.extend([predicted.cost, predicted.rms_error_m, predicted.energy_j]);
    }
    for violation in &answer.violations {
        numbers.extend([violation.t_s, violation.amount]);
    }
    for goal in &answer.goal {
        numbers.extend([goal.north_m, goal.east_m, goal.north_mps, goal.east_mps]);
    }
    assert!(numbers.into_iter().all(f64::is_finite), "seed {seed}: {answer:?}");
}

fn assert_no_worse(seed: u64, scene: &Snapshot, answer: &Plan, parameters: &Parameters) {
    if answer.method == Method::Hold {
        return;
    }
    let forward = || Forward::new(scene, parameters, answer);
    let los = forward().line_of_sight(parameters.los);
    let slow = answer.trajectory[1..].iter().any(|point| point.speed_mps < 0.02);
    let ours = match answer.method {
        Method::SaturatedLos => los,
        // Below 0.02 m/s a trajectory has no direction: the stated cost replaces it.
        _ if slow => answer.predicted.cost,
        _ => forward().following(&answer.trajectory),
    };
    // Coordinates of 1000 km round to 0.5 µm, far goals square that: one in 400 is 1.2e-5 off.
    let tolerance = |cost: f64| 2e-5 * cost.abs().max(1.0);
    for (stated, expected, what) in
        [(answer.baseline.predicted.cost, los, "line of sight"), (answer.predicted.cost, ours, "the answer")]
    {
        assert!(
            (stated - expected).abs() <= tolerance(expected),
            "seed {seed}: {what}: cost {stated}, here {expected}"
        );
    }
    assert!(ours <= los + tolerance(los), "seed {seed}: {ours} is worse than {los}");
}

/// The craft's response to references and its cost, in NED; the planner works in the craft's frame.
struct Forward<'a> {
    scene: &'a Snapshot,
    weights: Weights,
    start: Vector2<f64>,
    goal: GoalForecast,
    /// Vessels that are to keep clear of the craft.
    keeps_clear: Vec<usize>,
    /// `true` if the craft goes out of the way of vessels: its goal is then a place.
    manoeuvres: bool,
    /// AUVs with limits: their reports are young enough.
    auvs: Vec<AuvForecast>,
    /// `named`: the goal names it; `in_range`: its range can be kept.
    named: Vec<bool>,
    in_range: Vec<bool>,
    steps: &'a [f64],
    parameters: &'a Parameters,
    /// The craft that is flown.
    craft: CraftModel,
    position: Vector2<f64>,
    psi: f64,
    speed: f64,
    bias: f64,
    /// Heading reference that the craft follows, where one is known.
    followed: Option<f64>,
}

/// Tuned constants of the model, as documented.
const FOLLOW_GAIN: f64 = 0.15;
const FOLLOW_GAIN_LAG: f64 = 0.5;
const DRIFT_SHARE: f64 = 0.8;
const REFERENCE_AHEAD_MAX: f64 = 2.6;
const LEADING_RATE: f64 = 0.17;

fn unit(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}

/// The heading reference with the craft's offset; none without a young enough plan.
fn followed_heading(scene: &Snapshot, parameters: &Parameters) -> Option<f64> {
    let previous = scene.previous_plan.as_ref()?;
    let age = scene.t_s - previous.trajectory.first()?.t_s;
    let young = (0.0..parameters.previous_plan_age_max).contains(&age);
    let heading = previous.asked()?.heading.radians() + scene.craft_model().heading_offset;
    young.then_some(heading)
}

impl<'a> Forward<'a> {
    fn new(scene: &'a Snapshot, parameters: &'a Parameters, answer: &Plan) -> Self {
        let out_of_range = &answer.range_unattainable;
        let held = scene.previous_plan.as_ref().and_then(PreviousPlan::goal_course);
        let (goal, _) = scheduled_goal(scene, parameters, held, &Stop::never());
        let encounters = answer.avoidance.iter().flat_map(|avoidance| &avoidance.encounters);
        let waits = [EncounterKind::CrossingStandOn, EncounterKind::Overtaken];
        let waits = encounters.filter(|met| !met.acts && waits.contains(&met.kind));
        let keeps_clear = waits.filter_map(|met| scene.traffic.iter().position(|one| one.id == met.vessel));
        let young = |i: &usize| scene.estimates()[*i].state.age_s <= parameters.report_age_max;
        let young: Vec<_> = (0..scene.auvs.len()).filter(young).collect();
        let named = |i: usize| scene.goal.goal.vehicles().any(|id| *id == scene.auvs[i].id);
        let psi = scene.asc.heading().radians();
        let craft = *scene.craft_model();
        let followed = followed_heading(scene, parameters);
        let most = craft.limits.turn_rate_max;
        let turn_rate = followed
            .map_or(scene.asc.yaw_rate_radps, |reference| {
                wrap(reference - psi) / (craft.heading_time + craft.heading_delay).max(0.5)
            })
            .clamp(-most, most);
        let surge = scene.craft_estimate().surge.x;
        let drift = -craft.sway_per_yaw_rate * surge * turn_rate;
        let sway = (1.0 - DRIFT_SHARE) * scene.asc.sway_mps + DRIFT_SHARE * drift;
        Self {
            scene,
            weights: parameters.weights_for(scene, &goal),
            start: unit(psi) * surge + unit(psi + PI / 2.0) * sway,
            auvs: young.iter().map(|i| goal.auvs()[*i].clone()).collect(),
            in_range: young.iter().map(|i| named(*i) || !out_of_range.contains(i)).collect(),
            named: young.iter().map(|i| named(*i)).collect(),
            goal,
            keeps_clear: keeps_clear.collect(),
            manoeuvres: answer.avoidance.as_ref().is_some_and(|avoidance| avoidance.manoeuvre.is_some()),
            steps: &parameters.steps,
            parameters,
            craft,
            position: scene.asc.position(),
            psi,
            speed: surge,
            bias: craft.surge_disturbance,
            followed,
        }
    }

    /// Predicted cost of the law in the target's frame, equation by equation.
    fn line_of_sight(self, gains: LosGains) -> f64 {
        let mut held = Some(target_course(&self.goal.at(0.0), Some(self.goal.course())));
        self.run(move |this, time| {
            let goal = this.goal.at(time);
            let course = target_course(&goal, held);
            held = Some(course);
            let (along, abeam) = (unit(course.radians()), unit(course.radians() + PI / 2.0));
            let off = this.position - goal.position;
            let (s, e) = (off.dot(&along), off.dot(&abeam));
            let chi_r = (-e / gains.look_ahead).atan();
            let limits = this.scene.limits();
            let ground_speed = (goal.velocity.norm() * chi_r.cos() - gains.along_track_gain * s)
                .clamp(limits.speed_min, limits.speed_max);
            let water = unit(course.radians() + chi_r) * ground_speed - this.scene.current();
            let psi = if water.norm() < f64::EPSILON { this.psi } else { water.y.atan2(water.x) };
            (water.norm().clamp(limits.speed_min, limits.speed_max), psi)
        })
    }

    /// Predicted cost of following a trajectory.
    fn following(mut self, points: &[TrajectoryPoint]) -> f64 {
        let limits = &mut self.craft.limits;
        limits.speed_max = (0.98 * limits.speed_max).max(limits.speed_max.min(limits.speed_min + 0.05));
        limits.turn_rate_max = limits.turn_rate_max.min(LEADING_RATE.max(0.5 * limits.turn_rate_max));
        let mut stages: Vec<(f64, Vector2<f64>, Vector2<f64>)> =
            vec![(0.0, self.scene.asc.position(), self.start)];
        let mut time = 0.0;
        for (step, point) in self.steps.iter().zip(&points[1..]) {
            time += step;
            stages.push((time, point.position(), unit(point.heading().radians()) * point.speed_mps));
        }
        let current = self.scene.current();
        let at = move |k: usize, time: f64| {
            let ((t0, p0, v0), (t1, _, v1)) = (stages[k], stages[k + 1]);
            let since = time - t0;
            let velocity = v0 + (v1 - v0) * (since / (t1 - t0)).min(1.0);
            (p0 + ((v0 + velocity) / 2.0 + current) * since, velocity)
        };
        self.run(move |this, time| {
            let interval = |time: f64| {
                let mut end = 0.0;
                let inside = this.steps.iter().position(|step| {
                    end += step;
                    time + 1e-6 < end
                });
                inside.unwrap_or(this.steps.len() - 1)
            };
            let craft = &this.craft;
            let heading_lead = (craft.heading_time + craft.heading_delay).max(1.0);
            let (here, _) = at(interval(time), time);
            let back = (here - this.position) * FOLLOW_GAIN.min(FOLLOW_GAIN_LAG / heading_lead);
            let velocity = |ahead: f64| at(interval(time + ahead), time + ahead).1 + back;
            let turned_to = velocity(heading_lead);
            let psi = if turned_to.norm() < 0.02 { this.psi } else { turned_to.y.atan2(turned_to.x) };
            let lag = craft.surge_time + craft.surge_delay;
            let lead = lag.clamp(1.0, 6.0);
            let wanted = (velocity(lead).norm() - this.speed) / lead;
            let speed = this.speed + (lag.max(0.5) + 0.5) * wanted - craft.surge_time * this.bias;
            (speed.clamp(craft.limits.speed_min, craft.limits.speed_max), psi)
        })
    }

    /// Cost of steering by `law`, which gives a speed and a heading.
    fn run(mut self, mut law: impl FnMut(&Self, f64) -> (f64, f64)) -> f64 {
        let mut stages = vec![(self.position, self.start)];
        let (mut time, mut broken) = (0.0, 0.0);
        for step in self.steps {
            let n = step.ceil();
            let dt = step / n;
            let begin = time;
            let mut worst = [0.0_f64; 4];
            let mut share: f64 = 0.0;
            while share < n {
                let t = begin + share * dt;
                let (speed, psi) = law(&self, t);
                self.after(dt, speed, psi);
                share += 1.0;
                let excess = self.excess(begin, *step, share / n);
                worst = [0, 1, 2, 3].map(|i| worst[i].max(excess[i]));
            }
            time = begin + step;
            let w = &self.weights;
            for (amount, (linear, quadratic)) in
                worst.into_iter().zip([w.range_slack, w.other_range_slack, w.area_slack, w.keep_out_slack])
            {
                broken += amount * linear + amount * amount * quadratic;
            }
            stages.push((self.position, unit(self.psi) * self.speed));
        }
        broken + self.cost(&stages)
    }

    fn after(&mut self, dt: f64, speed: f64, psi: f64) {
        let craft = self.craft;
        let limits = &craft.limits;
        let lag = (craft.surge_time + craft.surge_delay).max(dt / 2.0) + dt / 2.0;
        let asked = ((speed - self.speed) / lag).clamp(-limits.deceleration_max, limits.acceleration_max);
        let gain = (asked + self.bias) * dt;
        if let Some(integral_time) = craft.integral_time {
            let most = 1.5 * limits.acceleration_max.min(limits.deceleration_max);
            self.bias = (self.bias + asked * (1.0 - (-dt / integral_time).exp())).clamp(-most, most);
        }
        // The reference approaches the request at the craft's turn rate, faster up to the lead of a
        // steady turn, on one side of the bow.
        let wanted = wrap(psi - self.psi);
        let ahead = self.followed.map_or(wanted, |reference| {
            let (before, slew) = (wrap(reference - self.psi), limits.turn_rate_max * dt);
            let lead = limits.turn_rate_max * (craft.heading_time + craft.heading_delay);
            let step = |short: f64| slew.max(short.min(LEADING_RATE * dt));
            wanted
                .max(before - step(lead + before))
                .min(before + step(lead - before))
                .clamp(-REFERENCE_AHEAD_MAX, REFERENCE_AHEAD_MAX)
        });
        self.followed = Some(self.psi + ahead);
        let rate = (wrap(ahead) / (craft.heading_time + craft.heading_delay).max(dt))
            .clamp(-limits.turn_rate_max, limits.turn_rate_max);
        let mean = unit(self.psi + rate * dt / 2.0) * (self.speed + gain / 2.0);
        self.position += (mean + self.scene.current()) * dt;
        self.psi = wrap(self.psi + rate * dt);
        self.speed += gain;
    }

    /// Excess over acoustic range, area and discs, a share of an interval after its beginning.
    fn excess(&self, begin: f64, step: f64, share: f64) -> [f64; 4] {
        let scene = self.scene;
        let most = |amounts: &mut dyn Iterator<Item = f64>| amounts.fold(0.0, f64::max);
        let range = |named: bool| {
            let kept = self.named.iter().zip(&self.in_range);
            let auvs = self.auvs.iter().zip(kept);
            let auvs = auvs.filter(move |(_, (is_named, in_range))| **is_named == named && **in_range);
            most(&mut auvs.filter_map(|(forecast, _)| {
                let radius = |ahead: f64| Some(radius(scene.range_max()?, forecast, ahead, self.parameters));
                let from = forecast.at(begin).position;
                let to = forecast.at(begin + step).position;
                let allowed = radius(begin)? * (1.0 - share) + radius(begin + step)? * share;
                Some((self.position - (from * (1.0 - share) + to * share)).norm() - allowed)
            }))
        };
        let corners = &scene.area;
        let area = most(&mut (0..corners.len()).map(|i| {
            let [from, to] = [i, (i + 1) % corners.len()].map(|i| Vector2::from(corners[i]));
            let along = (to - from).normalize();
            // Clockwise, seen from above: outside is to port.
            (self.position - from).dot(&Vector2::new(along.y, -along.x))
        }));
        let discs = scene.keep_outs.iter();
        let in_a_disc = most(&mut discs.map(|disc| disc.radius_m - (self.position - disc.centre()).norm()));
        let too_near = self.too_near_an_auv(begin, step, share);
        let keep_out = in_a_disc.max(too_near).max(self.too_near_a_vessel([begin, begin + step], share));
        [range(true), range(false), area, keep_out]
    }

    /// Amount by which the craft is too near to a vessel that is not to keep clear of it. The
    /// distance to keep goes linearly over an interval.
    fn too_near_a_vessel(&self, [begin, end]: [f64; 2], share: f64) -> f64 {
        let vessels = vessels_now(self.scene).filter(|seen| !self.keeps_clear.contains(&seen.vessel));
        let too_near = |seen: VesselNow| {
            let vessel = &self.scene.traffic[seen.vessel];
            let velocity = seen.velocity.unwrap_or_default();
            let sigma_velocity = match seen.velocity {
                _ if vessel.is_made_fast() => 0.0,
                Some(velocity) => 0.05 + 0.01 * velocity.norm(),
                None => vessel.speed_mps.unwrap_or(1.5),
            };
            let kept = |ahead: f64| {
                let grown = sigma_velocity * (self.scene.vessel_age(vessel) + ahead);
                let separation = self.scene.vessel_separation_m.unwrap_or(30.0);
                let sigma = 2.0 * vessel.sigma_m.unwrap_or(10.0).hypot(grown);
                separation + 0.5 * vessel.length_m.unwrap_or(20.0) + sigma.min(50.0)
            };
            let after = vessel.plan.iter().map(|[time, n, e]| (time - self.scene.t_s, Vector2::new(*n, *e)));
            let known: Vec<_> =
                iter::once((0.0, seen.position)).chain(after.filter(|(ahead, _)| 0.0 < *ahead)).collect();
            // Along its plan, and after it by the last leg.
            let place = |ahead: f64| {
                let leg = known.windows(2).find(|leg| ahead <= leg[1].0).or(known.windows(2).last());
                let Some(&[(t0, from), (t1, to)]) = leg else { return seen.position + velocity * ahead };
                let way = to - from;
                let known_velocity = if t0 == 0.0 && t1 < 5.0 {
                    velocity
                } else {
                    (way / (t1 - t0).max(0.1)).cap_magnitude(60.0)
                };
                let beyond = known_velocity * (ahead - t1).max(0.0);
                from + way * ((ahead - t0) / (t1 - t0)).min(1.0) + beyond
            };
            let there = place(begin) * (1.0 - share) + place(end) * share;
            kept(begin) * (1.0 - share) + kept(end) * share - (self.position - there).norm()
        };
        vessels.map(too_near).fold(0.0, f64::max)
    }

    /// Amount by which the craft is too near to an AUV that it localises, or to one at the surface.
    /// Where no distance is kept at one end of an interval, it goes linearly from or to −1 m.
    fn too_near_an_auv(&self, begin: f64, step: f64, share: f64) -> f64 {
        let scene = self.scene;
        let stand_off = match &scene.goal.goal {
            Goal::Localise(localise) => localise.stand_off_m,
            _ => 0.0,
        };
        let separation = scene.surfacing_separation_m.unwrap_or(0.0);
        let end = begin + step;
        let auvs = self.auvs.iter().zip(&self.named);
        auvs.map(|(forecast, named)| {
            let kept = |time: f64| {
                let always = if *named { stand_off } else { 0.0 };
                let most = if forecast.surfaced(time) { always.max(separation) } else { always };
                if 0.0 < most { most } else { -1.0 }
            };
            let (from, to) = (forecast.at(begin).position, forecast.at(end).position);
            let apart = (self.position - (from * (1.0 - share) + to * share)).norm();
            kept(begin) * (1.0 - share) + kept(end) * share - apart
        })
        .fold(0.0, f64::max)
    }

    /// Square of the goal's miss, m²: of the distance, or for a worst range the excess of its
    /// square over the least.
    fn miss(&self, time: f64, position: Vector2<f64>) -> f64 {
        let goal = self.goal.at(time).position;
        let worst = |place: Vector2<f64>| {
            let range = |member: &AuvForecast| {
                (member.at(time).position - place).norm_squared() + member.depth_at(time).powi(2)
            };
            self.goal.members().map(range).fold(0.0, f64::max)
        };
        match self.scene.goal.goal {
            Goal::Range { .. } if self.scene.goal.offset.is_none() && !self.manoeuvres => {
                (worst(position) - worst(goal)).max(0.0)
            }
            _ => (position - goal).norm_squared(),
        }
    }

    fn cost(&self, stages: &[(Vector2<f64>, Vector2<f64>)]) -> f64 {
        let w = &self.weights;
        let mut cost = 0.0;
        let mut time = 0.0;
        let miss = |k: usize, time: f64| {
            let goal = self.goal.at(time);
            let (position, water) = stages[k];
            let off = self.miss(time, position);
            let slip = (water + self.scene.current() - goal.velocity).norm_squared();
            let speed = water.norm();
            let power =
                self.craft.power.linear_w_per_mps * speed + self.craft.power.cubic_w_per_mps3 * speed.powi(3);
            (off, slip, power)
        };
        for (k, dt) in self.steps.iter().enumerate() {
            let (from, to) = (miss(k, time), miss(k + 1, time + dt));
            time += dt;
            cost += dt / 2.0 * (w.position * (from.0 + to.0) + w.velocity * (from.1 + to.1));
            cost += dt / 2.0 * w.energy * (from.2 + to.2);
            let a = (stages[k + 1].1 - stages[k].1) / *dt;
            cost += dt * w.acceleration * a.norm_squared();
        }
        let last = miss(self.steps.len(), time);
        cost + w.terminal_position * last.0 + w.terminal_velocity * last.1
    }
}

/// Horizontal range after depth and back-off.
fn radius(range: f64, forecast: &AuvForecast, ahead: f64, parameters: &Parameters) -> f64 {
    let across = (range.powi(2) - forecast.depth_at(ahead).powi(2)).max(0.0).sqrt();
    (across - parameters.range_back_off * forecast.position_variance(ahead).sqrt()).max(0.0)
}
