//! Forecasts and distances of the planner behind AUVs with tracking errors: patterns × errors ×
//! declarations. Beside it line of sight behind a Kalman filter; its noise and the gains are tuned
//! for each pattern and error on other seeds.
//!
//! ```text
//! cargo run --release -p pilotfish-sim --example tracks -- --seeds 200-219 --tuned-on 100-109
//! cargo run --release -p pilotfish-sim --example tracks -- --patterns lanes --errors none
//! ```
//! Rows of a table in Markdown; the last column has how often the truth was within the 50, 80 and
//! 95 % ellipse of a forecast of 20, 40 and 60 s, and its squared distance in standard deviations
//! over its expectation, 2.

use std::{collections::HashMap, env, error::Error, ops::RangeInclusive};

use nalgebra::{Matrix2, Vector2};
use pilotfish_sim::{
    guide::{Guide, LosGuide, MpcGuide},
    mission::Mission,
    record::SurfaceCraftRow,
    scenario::{Files, Scenario},
    world::World,
};
use planner::angle::Heading;
use planner::forecast::Motion;
use planner::los::{AscNow, LosGains, LosLaw, LosTuning, Reference, TrackingLaw};
use planner::plan::TargetPoint;
use planner::snapshot::{Forecast, Report};
use planner::{Parameters, Plan, Snapshot};

/// Name, and members of `path.random_survey`, then of the AUV.
const PATTERNS: [(&str, &str, &str); 7] = [
    (
        "lanes",
        r#"pattern = "lawn_mower", leg_m = {uniform = [120, 200]}, spacing_m = {uniform = [20, 40]}"#,
        "",
    ),
    ("boxes", r#"pattern = "box", leg_m = {uniform = [120, 200]}"#, ""),
    (
        "unequal",
        r#"pattern = "unequal_lanes", leg_m = {uniform = [140, 240]}, spacing_m = {uniform = [20, 40]}"#,
        "",
    ),
    ("waypoints", r#"pattern = "waypoints", leg_m = 200"#, ""),
    ("spiral", r#"pattern = "spiral", leg_m = 250, spacing_m = {uniform = [20, 40]}"#, ""),
    (
        "eights",
        r#"pattern = "figure_of_eight", leg_m = {uniform = [120, 200]}, spacing_m = {uniform = [20, 40]}"#,
        "",
    ),
    (
        "pauses",
        r#"pattern = "lawn_mower", leg_m = {uniform = [120, 200]}, spacing_m = {uniform = [20, 40]}"#,
        "speed_profile = [{along_m = 150, speed_mps = 0.9}, {along_m = 151, speed_mps = 0.05}, \
         {along_m = 154, speed_mps = 0.05}, {along_m = 155, speed_mps = 0.9}, {along_m = 500, speed_mps = 0.9}, \
         {along_m = 501, speed_mps = 0.05}, {along_m = 504, speed_mps = 0.05}, {along_m = 505, speed_mps = 0.9}]",
    ),
];
/// Name, and members of `tracking_error`.
const ERRORS: [(&str, &str); 11] = [
    ("none", ""),
    ("weave-1", "weave = {amplitude_m = 1, period_s = 20, damping = 0.1}"),
    ("weave-3", "weave = {amplitude_m = 3, period_s = 40, damping = 0.1}"),
    ("weave-4", "weave = {amplitude_m = 4, period_s = 60, damping = 0.1}"),
    ("weave-6", "weave = {amplitude_m = 6, period_s = 120, damping = 0.1}"),
    ("sine-4", "weave = {amplitude_m = 4, period_s = 60}"),
    ("late-5", "turns_late_m = 5"),
    ("late-15", "turns_late_m = 15"),
    ("late-30", "turns_late_m = 30"),
    ("early-10", "turns_late_m = -10"),
    ("slow-dives", "slower_diving_share = 0.3"),
];
/// Name, members of `knowledge`, and of the AUV.
const DECLARED: [(&str, &str, &str); 6] = [
    ("sailed", "paths = true", r#"declares = "sailed""#),
    ("plan", "paths = true", ""),
    ("plan-20m", "paths = true", "navigation_error = {north_m = 16, east_m = -12}"),
    (
        "plan-drift",
        "paths = true",
        "navigation_error = {drift_share = 0.01, drift_heading_rad = {uniform = [-3.14, 3.14]}}",
    ),
    ("inferred", "", ""),
    ("unknown", "known_paths_only = true", ""),
];

/// Duration of a mission, and the start of what is scored, s.
const DURATION: usize = 1200;
const SETTLED: usize = 120;
/// Horizons of the forecasts that are scored, s.
const HORIZONS: [usize; 3] = [20, 40, 60];
/// Quantiles of χ² with two degrees of freedom at 50, 80 and 95 %.
const QUANTILES: [f64; 3] = [1.386, 3.219, 5.991];
/// Error of the last horizon beyond which a route was wrong, m: ten standard deviations of a fix.
const WRONG: f64 = 15.0;

type Failure = Box<dyn Error + Send + Sync>;

fn scenario(pattern: usize, error: usize, declared: usize) -> Result<Scenario, Failure> {
    let (_, survey, profile) = PATTERNS[pattern];
    let (_, knowledge, auv) = DECLARED[declared];
    let speed = if profile.is_empty() { "speed_mps = 0.9" } else { profile };
    let text = format!(
        r#"
schema_version = "1"
name = "tracks"
title = "tracks"
duration_s = {DURATION}
settled_after_s = {SETTLED}
[surface_craft]
class = "otter"
north_m = -15
east_m = -8
heading_rad = 0.8
speed_mps = 0.3
contact_range_m = 40
goal.track.auv = "auv-1"
[[auvs]]
id = "auv-1"
depth_m = 9
dive = {{depth_min_m = 8, depth_max_m = 11, pitch_rad = 0.1}}
path.random_survey = {{{survey}}}
tracking_error = {{{}}}
{speed}
{auv}
[knowledge]
{knowledge}
[knowledge.acoustics]
frame_s = 10
slot_length_s = 1
slots_s = {{auv-1 = 0}}
latency_s = 2
course_and_speed = false
position_sigma_m = 1.5
depth_sigma_m = 0.1
range_max_m = 1000
loss = 0.3
"#,
        ERRORS[error].1
    );
    Ok(Scenario::parse(&text, "tracks.toml", Files::default())?)
}

/// A mission once a second: where the AUV was, and what a guide heard of it.
struct Heard {
    world: World,
    briefed: Snapshot,
    truth: Vec<Vector2<f64>>,
    /// New reports of every second.
    news: Vec<Vec<Report>>,
}

/// A guide's mission: its distances from the AUV once a second, and its plans' forecasts.
struct Flown {
    heard: Heard,
    distances: Vec<f64>,
    beliefs: Vec<Belief>,
}

/// A forecast at the horizons, and `true` if it is along a path.
#[derive(Clone, Copy)]
struct Belief {
    on_path: bool,
    ahead: [(Vector2<f64>, Matrix2<f64>); 3],
}

impl Belief {
    fn of(plan: &Plan) -> Self {
        let (target, covariances) = (&plan.targets[0], &plan.position_covariances[0]);
        let now = plan.trajectory[0].t_s;
        let at = |horizon: usize| {
            let time = now + seconds(horizon);
            let next = target.trajectory.partition_point(|point| point.t_s < time);
            let [one, other] = [next - 1, next].map(|k| &target.trajectory[k]);
            let share = (time - one.t_s) / (other.t_s - one.t_s);
            let place = |point: &TargetPoint| Vector2::new(point.north_m, point.east_m);
            (
                place(one).lerp(&place(other), share),
                covariances[next - 1] * (1.0 - share) + covariances[next] * share,
            )
        };
        Self { on_path: target.forecast == Forecast::Path, ahead: HORIZONS.map(at) }
    }
}

fn seconds(n: usize) -> f64 {
    f64::from(u32::try_from(n).expect("a mission has few seconds"))
}

fn fly(scenario: &Scenario, seed: u64, mut planner: Option<MpcGuide>) -> Result<Flown, Failure> {
    let mut law = LosGuide::new(Parameters::default().los);
    let world = scenario.start(seed)?.world;
    let mut mission = Mission::new(scenario, "tracks", seed)?;
    let (mut news, mut beliefs, mut briefed, mut newest) = (vec![], vec![], None, f64::NEG_INFINITY);
    while !mission.is_over() {
        let snapshot = mission.observe()?.expect("there is a craft");
        let guidance = match &mut planner {
            Some(planner) => planner.guide(&snapshot)?,
            None => law.guide(&snapshot)?,
        };
        if let Some((_, plan)) = planner.as_ref().and_then(MpcGuide::planned) {
            beliefs.push(Belief::of(plan));
        }
        let reports = snapshot.auvs[0].reports.iter().flatten();
        news.push(reports.filter(|report| newest < report.t_s).copied().collect::<Vec<_>>());
        newest = news.iter().flatten().map(|report| report.t_s).fold(newest, f64::max);
        mission.step(Some((&snapshot, guidance)));
        briefed.get_or_insert(snapshot);
    }
    let rows = &mission.record().rows;
    let craft = rows.iter().filter_map(|row| row.surface_craft.as_ref());
    Ok(Flown {
        distances: craft.map(SurfaceCraftRow::distance).collect(),
        beliefs,
        heard: Heard {
            world,
            briefed: briefed.expect("has seconds"),
            truth: rows.iter().map(|row| row.auvs[0].position).collect(),
            news,
        },
    })
}

/// A Kalman filter of constant velocity with white acceleration, and a law behind it.
#[derive(Clone, Copy)]
struct Behind {
    /// Spectral density of the acceleration, m²/s³.
    noise: f64,
    law: LosTuning,
}

impl Behind {
    /// The neighbours along each axis of an endless grid.
    fn neighbours(self) -> Vec<Self> {
        let mut all = vec![];
        for factor in [0.5, 2.0] {
            let noise = self.noise * factor * factor;
            all.push(Self { noise, ..self });
            let (mut nearer, mut stiffer) = (self, self);
            nearer.law.gains.look_ahead *= factor;
            stiffer.law.gains.along_track_gain *= factor;
            all.extend([nearer, stiffer]);
        }
        let mut other = self;
        other.law.law = match self.law.law {
            LosLaw::SaturatedLos => LosLaw::TrackerFrame,
            _ => LosLaw::SaturatedLos,
        };
        all.push(other);
        all
    }

    /// Its distances from the AUV once a second.
    fn distances(self, heard: &Heard) -> Vec<f64> {
        let mut world = heard.world.clone();
        world.auvs.clear();
        let mut law = TrackingLaw::new(self.law, None);
        // Both axes have one covariance.
        let (mut at, mut means, mut variance) = (0.0, [Vector2::zeros(); 2], None::<Matrix2<f64>>);
        let snapshot = &heard.briefed;
        let follow = |(second, truth): (usize, &Vector2<f64>)| {
            for report in &heard.news[second] {
                let measured = [report.position().x, report.position().y];
                let noise = report.sigma_m.powi(2);
                let known = variance.unwrap_or(Matrix2::new(1e6, 0.0, 0.0, 1.0));
                let dt = report.t_s - at;
                let forward = Matrix2::new(1.0, dt, 0.0, 1.0);
                let grown = Matrix2::new(dt.powi(3) / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt) * self.noise;
                let known =
                    if variance.is_some() { forward * known * forward.transpose() + grown } else { known };
                let gain = known.column(0) / (known.m11 + noise);
                for (mean, measured) in means.iter_mut().zip(measured) {
                    *mean = forward * *mean;
                    *mean += gain * (measured - mean.x);
                }
                variance = Some(known - gain * known.row(0));
                at = report.t_s;
            }
            let craft = world.surface_craft.as_ref().expect("there is one");
            let distance = (craft.position() - truth).norm();
            let asc = AscNow {
                position: craft.position(),
                heading: Heading::new(craft.state[2]),
                current: Vector2::zeros(),
            };
            let age = world.time() - at;
            let target = Motion {
                position: Vector2::from(means.map(|mean| mean.x + mean.y * age)),
                velocity: Vector2::from(means.map(|mean| mean.y)),
            };
            let reference = law.steer(world.time(), &asc, &target, snapshot.limits());
            let craft = &snapshot.craft_prior().craft;
            let reference: Reference = craft.command(&reference, &asc.current, snapshot.limits().speed_max);
            (0..10).for_each(|_| world.step(Some(&reference)));
            distance
        };
        heard.truth.iter().enumerate().map(follow).collect()
    }

    /// The best on these missions: no neighbour is better.
    fn tuned(missions: &[Heard]) -> Self {
        let score = |behind: Self| mean(missions.iter().map(|heard| rms(&behind.distances(heard))));
        let gains = LosGains { look_ahead: 5.0, along_track_gain: 0.2 };
        let law = LosTuning {
            law: LosLaw::SaturatedLos,
            gains,
            integral_gain: Parameters::default().integral_gain,
        };
        let mut best = Self { noise: 0.005, law };
        let mut least = score(best);
        let mut improved = true;
        while improved {
            improved = false;
            for neighbour in best.neighbours() {
                let found = score(neighbour);
                if found < least {
                    (best, least, improved) = (neighbour, found, true);
                }
            }
        }
        best
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), value| (n + 1.0, sum + value));
    sum / n
}

fn rms(distances: &[f64]) -> f64 {
    mean(distances[SETTLED..].iter().map(|distance| distance * distance)).sqrt()
}

fn p95(distances: &[f64]) -> f64 {
    let mut settled = distances[SETTLED..].to_vec();
    settled.sort_by(f64::total_cmp);
    settled[settled.len() * 95 / 100]
}

/// Shares of time over all missions of a row, and of forecasts within the truth's reach.
fn beliefs(missions: &[Flown]) -> String {
    let settled = |flown: &Flown| SETTLED..flown.beliefs.len() - HORIZONS[2];
    let miss = |flown: &Flown, second: usize, k: usize| {
        let (place, covariance) = flown.beliefs[second].ahead[k];
        (flown.heard.truth[second + HORIZONS[k]] - place, covariance)
    };
    let all = || missions.iter().flat_map(|flown| settled(flown).map(move |second| (flown, second)));
    let on_path = || all().filter(|(flown, second)| flown.beliefs[*second].on_path);
    let share = |of: usize, whole: usize| 100.0 * seconds(of) / seconds(whole.max(1));
    let wrong = on_path().filter(|(flown, second)| WRONG < miss(flown, *second, 2).0.norm());
    // From then on, the route was never lost again.
    let kept = |flown: &Flown| {
        let lost = flown.beliefs.iter().rposition(|belief| !belief.on_path);
        seconds(lost.map_or(0, |lost| lost + 1))
    };
    let first = |flown: &Flown| {
        let found = flown.beliefs.iter().position(|belief| belief.on_path);
        seconds(found.unwrap_or(flown.beliefs.len()))
    };
    let calibration = |k: usize| {
        let nees = all().filter_map(|(flown, second)| {
            let (miss, covariance) = miss(flown, second, k);
            Some(miss.dot(&(covariance.try_inverse()? * miss)))
        });
        let nees: Vec<f64> = nees.collect();
        let within =
            QUANTILES.map(|most| share(nees.iter().filter(|nees| **nees <= most).count(), nees.len()));
        let normal = mean(nees.iter().copied()) / 2.0;
        format!("{:.0} {:.0} {:.0} ({normal:.1})", within[0], within[1], within[2])
    };
    let columns: Vec<String> = (0..HORIZONS.len()).map(calibration).collect();
    format!(
        "{:.0} | {:.0} | {:.0} | {:.0} | {} |",
        share(on_path().count(), all().count()),
        share(wrong.count(), on_path().count()),
        mean(missions.iter().map(first)),
        mean(missions.iter().map(kept)),
        columns.join(" | "),
    )
}

/// Numbers of the chosen names, all if none is chosen.
fn chosen(names: &[&str], argument: Option<&String>) -> Result<Vec<usize>, Failure> {
    let Some(argument) = argument else { return Ok((0..names.len()).collect()) };
    let number = |name: &str| {
        let found = names.iter().position(|known| *known == name);
        found.ok_or_else(|| format!("no {name:?}, only {}", names.join(", ")).into())
    };
    argument.split(',').map(number).collect()
}

fn seeds(argument: Option<&String>, usual: &str) -> Result<RangeInclusive<u64>, Failure> {
    let text = argument.map_or(usual, String::as_str);
    let (first, last) = text.split_once('-').ok_or("seeds are written as 200-219")?;
    Ok(first.parse()?..=last.parse()?)
}

fn main() -> Result<(), Failure> {
    let given: Vec<String> = env::args().skip(1).collect();
    let known = ["--patterns", "--errors", "--declared", "--seeds", "--tuned-on"];
    let pair = |pair: &[String]| match pair {
        [name, value] if known.contains(&name.as_str()) => Ok((name.clone(), value.clone())),
        _ => Err(format!("{pair:?}; known are {}, each with a value", known.join(", "))),
    };
    let given: HashMap<String, String> = given.chunks(2).map(pair).collect::<Result<_, _>>()?;
    let argument = |name: &str| given.get(name);
    let patterns = chosen(&PATTERNS.map(|(name, ..)| name), argument("--patterns"))?;
    let errors = chosen(&ERRORS.map(|(name, _)| name), argument("--errors"))?;
    let declared = chosen(&DECLARED.map(|(name, ..)| name), argument("--declared"))?;
    let scored = seeds(argument("--seeds"), "200-219")?;
    let tuned_on = seeds(argument("--tuned-on"), "100-109")?;
    println!(
        "| pattern | error | declared | planner RMS, m | p95 | law RMS | p95 | ratio | worst | on a route, % | of it wrong, % | \
         found at, s | kept from, s | 20 s | 40 s | 60 s |\n|{}",
        "---|".repeat(16)
    );
    for &pattern in &patterns {
        for &error in &errors {
            // A law knows no route: what is declared changes nothing for it but the fixes' place.
            let unknown = scenario(pattern, error, DECLARED.len() - 1)?;
            let heard = tuned_on.clone().map(|seed| Ok(fly(&unknown, seed, None)?.heard));
            let heard = heard.collect::<Result<Vec<_>, Failure>>()?;
            let law = Behind::tuned(&heard);
            let LosGains { look_ahead, along_track_gain } = law.law.gains;
            eprintln!(
                "{} {}: {} of {look_ahead} m, {along_track_gain} 1/s behind {} m²/s³",
                PATTERNS[pattern].0,
                ERRORS[error].0,
                law.law.law.name(),
                law.noise
            );
            for &declared in &declared {
                let scenario = scenario(pattern, error, declared)?;
                let flown = scored.clone().map(|seed| {
                    let planner = MpcGuide::new(Parameters::default());
                    fly(&scenario, seed, Some(planner))
                });
                let flown = flown.collect::<Result<Vec<_>, Failure>>()?;
                let laws: Vec<Vec<f64>> = flown.iter().map(|flown| law.distances(&flown.heard)).collect();
                let ratios = flown.iter().zip(&laws);
                let ratios: Vec<f64> = ratios.map(|(flown, law)| rms(&flown.distances) / rms(law)).collect();
                let of = |score: fn(&[f64]) -> f64| {
                    let planner = mean(flown.iter().map(|flown| score(&flown.distances)));
                    (planner, mean(laws.iter().map(|law| score(law))))
                };
                let ((rms, law_rms), (p95, law_p95)) = (of(rms), of(p95));
                println!(
                    "| {} | {} | {} | {rms:.2} | {p95:.1} | {law_rms:.2} | {law_p95:.1} | {:.2} | {:.2} | {}",
                    PATTERNS[pattern].0,
                    ERRORS[error].0,
                    DECLARED[declared].0,
                    mean(ratios.iter().map(|ratio| ratio.ln())).exp(),
                    ratios.iter().copied().fold(0.0, f64::max),
                    beliefs(&flown),
                );
            }
        }
    }
    Ok(())
}
