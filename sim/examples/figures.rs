//! AUVs that fix themselves by ranges of the craft: the planner's figures beside the best constant
//! circle and zigzag, tuned on other seeds, and beside staying above.
//!
//! ```text
//! cargo run --release -p pilotfish-sim --example figures -- --scenarios localise-straight,localise-lanes
//! cargo run --release -p pilotfish-sim --example figures -- --seeds 200-219 --tuned-on 100-103 --craft random
//! ```
//! Rows of a table in Markdown: the AUVs' true error in the second half hour, root mean square over
//! the seeds, its ratio to the best circle (mean of pairs, and half width of their 95 % interval),
//! the error that the AUVs state, propulsion energy in kJ, and the time of a plan (median, 99 %).

use std::{env, error::Error, ops::RangeInclusive, thread};

use pilotfish_sim::{
    guide::MpcGuide,
    metrics::Metrics,
    mission::run,
    scenario::{Files, Scenario},
};
use planner::{FixedFigure, Parameters, snapshot::FigureKind};

type Failure = Box<dyn Error + Send + Sync>;

const SCENARIOS: &str = "localise-straight,localise-lanes,localise-dives,localise-two,localise-three";
/// Radii, m, and shares of the speed that are tried.
const RADII: [f64; 8] = [20.0, 30.0, 45.0, 65.0, 95.0, 140.0, 200.0, 290.0];
const SHARES: [f64; 2] = [0.7, 1.0];

/// True error, stated error, m, and energy, kJ.
#[derive(Clone, Copy)]
struct Outcome {
    error: f64,
    stated: f64,
    energy: f64,
    /// Time of a plan, median and 99 %, ms.
    times: [f64; 2],
}

fn fly(scenario: &Scenario, seed: u64, figure: Option<FixedFigure>) -> Result<Outcome, Failure> {
    let parameters = Parameters { figure, ..Parameters::default() };
    let record = run(scenario, &mut MpcGuide::new(parameters), seed, &mut |_| {})?;
    let metrics = Metrics::of(&record).surface_craft.ok_or("no craft")?;
    let navigation = metrics.localisation.ok_or("the goal does not localise")?;
    Ok(Outcome {
        error: navigation.rms_m,
        stated: navigation.stated_rms_m,
        energy: metrics.energy_j / 1000.0,
        times: [metrics.solve_ms_p50, metrics.solve_ms_p99].map(Option::unwrap_or_default),
    })
}

/// The missions of all seeds, on two threads.
fn fly_all(scenario: &Scenario, seeds: &[u64], figure: Option<FixedFigure>) -> Result<Vec<Outcome>, Failure> {
    let (one, other) = seeds.split_at(seeds.len() / 2);
    let half =
        |seeds: &[u64]| seeds.iter().map(|seed| fly(scenario, *seed, figure)).collect::<Result<Vec<_>, _>>();
    let (first, second) = thread::scope(|scope| {
        let first = scope.spawn(|| half(one));
        (first.join(), half(other))
    });
    let first = first.map_err(|_| "a mission panicked")?;
    Ok([first?, second?].concat())
}

fn rms(outcomes: &[Outcome], of: fn(&Outcome) -> f64) -> f64 {
    mean(outcomes.iter().map(|outcome| of(outcome).powi(2))).sqrt()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), value| (n + 1.0, sum + value));
    sum / n
}

/// The best radius of a rising grid, which ends where a larger one is worse, then the best speed.
fn best(scenario: &Scenario, seeds: &[u64], kind: FigureKind) -> Result<FixedFigure, Failure> {
    let mut best: Option<(f64, FixedFigure)> = None;
    let mut is_better = |radius, speed_share| {
        let figure = FixedFigure { kind, radius_m: radius, speed_share };
        let error = rms(&fly_all(scenario, seeds, Some(figure))?, |outcome| outcome.error);
        let better = best.is_none_or(|(least, _)| error < least);
        if better {
            best = Some((error, figure));
        }
        Ok::<_, Failure>(better)
    };
    let mut radius = RADII[0];
    for tried in RADII {
        if !is_better(tried, SHARES[1])? {
            break;
        }
        radius = tried;
    }
    is_better(radius, SHARES[0])?;
    Ok(best.ok_or("no figures")?.1)
}

fn seeds(text: &str) -> Result<Vec<u64>, Failure> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let range: RangeInclusive<u64> = from.parse()?..=to.parse()?;
    Ok(range.collect())
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let given = |name: &str, usual: &str| {
        let at = arguments.iter().position(|argument| argument == name);
        at.and_then(|at| arguments.get(at + 1)).map_or(usual.to_owned(), Clone::clone)
    };
    let reported = seeds(&given("--seeds", "200-203"))?;
    let tuned_on = seeds(&given("--tuned-on", "100-101"))?;
    let craft = given("--craft", "");
    println!("| scenario | craft | figure | error, m | to the circle | stated, m | energy, kJ | plan, ms |");
    println!("|---|---|---|---|---|---|---|---|");
    for name in given("--scenarios", SCENARIOS).split(',') {
        let mut scenario = Scenario::named(name).ok_or("no such scenario")?;
        if !craft.is_empty() {
            let text = std::fs::read_to_string(format!("sim/scenarios/{name}.toml"))?;
            let lines = text.lines().map(|line| match line.strip_prefix("class = ") {
                Some(_) => format!("class = \"{craft}\""),
                None => line.to_owned(),
            });
            let text = lines.collect::<Vec<_>>().join("\n");
            scenario = Scenario::parse(&text, name, Files::default())?;
        }
        let circle = best(&scenario, &tuned_on, FigureKind::Circle)?;
        let zigzag = best(&scenario, &tuned_on, FigureKind::ZigzagAstern)?;
        let above = FixedFigure { kind: FigureKind::Above, radius_m: 0.0, speed_share: 1.0 };
        let rows = [
            ("planned".to_owned(), None),
            (format!("circle {} m, {}", circle.radius_m, circle.speed_share), Some(circle)),
            (format!("zigzag {} m, {}", zigzag.radius_m, zigzag.speed_share), Some(zigzag)),
            ("above".to_owned(), Some(above)),
        ];
        let reference = fly_all(&scenario, &reported, Some(circle))?;
        for (label, figure) in rows {
            let flown = fly_all(&scenario, &reported, figure)?;
            let ratios: Vec<f64> =
                flown.iter().zip(&reference).map(|(one, other)| one.error / other.error).collect();
            let middle = mean(ratios.iter().copied());
            let spread = mean(ratios.iter().map(|ratio| (ratio - middle).powi(2)));
            let n = mean(ratios.iter().map(|_| 1.0)) * reported.len() as f64;
            let width = 1.96 * (spread / (n - 1.0).max(1.0)).sqrt();
            println!(
                "| {name} | {craft} | {label} | {:.2} | {middle:.2} ± {width:.2} | {:.2} | {:.0} | {:.1}, {:.1} |",
                rms(&flown, |outcome| outcome.error),
                rms(&flown, |outcome| outcome.stated),
                mean(flown.iter().map(|outcome| outcome.energy)),
                mean(flown.iter().map(|outcome| outcome.times[0])),
                mean(flown.iter().map(|outcome| outcome.times[1])),
            );
        }
    }
    Ok(())
}
