//! Drawn coasts between a kinematic craft and an AUV at rest: bays, islands, straits, spirals,
//! rough coasts. The planner steers once a second until the craft is within 5 m of the AUV.
//!
//! ```text
//! cargo run --release -p pilotfish-sim --example coasts -- --seeds 1-500 > flights.jsonl
//! python tests/python/coasts.py flights.jsonl
//! ```
//! A JSON line for each flight, with all that another program needs to judge it: areas, start, AUV
//! and track, beside the planner's own view: time of arrival (null for none), depth in an area,
//! times of plans on a processor (Linux). `--islands N` draws N small islands of 39 corners
//! instead, to measure times; `--kind K` flies one kind alone.

use std::f64::consts::TAU;
use std::{env, error::Error, io::Write, ops::Range};

use nalgebra::{Rotation2, Vector2};
use planner::angle::{Course, Heading, direction, wrap};
use planner::snapshot::{NoGo, no_go_depths};
use planner::{Asc, Auv, AuvState, Goal, Parameters, PlanRequest, Snapshot, Workspace, plan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

type Failure = Box<dyn Error + Send + Sync>;
type Ring = Vec<Vector2<f64>>;

const SPEED: f64 = 1.5;
const TURN_RATE: f64 = 0.3;
const ACCELERATION: f64 = 0.3;
const HEADING_LAG: f64 = 1.0;
const SPEED_LAG: f64 = 2.0;
/// Distance that the planner's ways keep for this craft, m; passages are drawn by it.
const CLEARANCE: f64 = 1.31;
/// Longest flight, s, and the time in which a craft that moves less than 2 m has given up.
const DURATION: usize = 900;
const STILL: usize = 100;

const KINDS: [&str; 6] = ["bay", "islands", "wide strait", "narrow strait", "spiral", "rough coast"];

struct Coast {
    kind: &'static str,
    no_go: Vec<NoGo>,
    start: Vector2<f64>,
    auv: Vector2<f64>,
    heading: f64,
}

/// A ring of corners in any frame.
fn ring(corners: &[(f64, f64)]) -> Ring {
    corners.iter().map(|(north, east)| Vector2::new(*north, *east)).collect()
}

/// A U of walls, half of them with hooks at the mouth: the craft in it, the AUV behind its end.
fn bay(rng: &mut ChaCha8Rng) -> (Vec<Ring>, [Vector2<f64>; 2]) {
    let (w, d) = (rng.random_range(20.0..80.0) / 2.0, rng.random_range(30.0..120.0));
    let t = rng.random_range(3.0..20.0_f64);
    let h = if rng.random_bool(0.5) { rng.random_range(0.2..0.7) * w } else { 0.0 };
    let half = |s: f64| [(d - t, s * (w - h)), (d - t, s * w), (0.0, s * w)];
    let mut walls = vec![(-t, -w - t), (d, -w - t), (d, -w + h)];
    walls.extend(&half(-1.0)[usize::from(h == 0.0) * 2..]);
    walls.extend(half(1.0)[usize::from(h == 0.0) * 2..].iter().rev());
    walls.extend([(d, w - h), (d, w + t), (-t, w + t)]);
    let inside = Vector2::new(rng.random_range(5.0..0.6 * d), rng.random_range(-0.6..0.6) * w);
    let behind = Vector2::new(-t - rng.random_range(6.0..60.0), rng.random_range(-1.0..1.0) * w);
    (vec![ring(&walls)], [inside, behind])
}

fn island(at: Vector2<f64>, radius: f64, corners: Option<u32>, rng: &mut ChaCha8Rng) -> Ring {
    let waves: [(f64, f64); 4] =
        std::array::from_fn(|_| (rng.random_range(0.0..0.35), rng.random_range(0.0..TAU)));
    let n = corners.unwrap_or_else(|| rng.random_range(6..=30));
    let corner = |i: usize| {
        let angle = TAU * i as f64 / f64::from(n);
        let wave = (2..).zip(waves).map(|(k, (share, phase))| share * (f64::from(k) * angle + phase).sin());
        let share: f64 = 1.0 + wave.sum::<f64>() + rng.random_range(-0.1..0.1);
        at + direction(angle) * radius * share.max(0.2)
    };
    (0..n as usize).map(corner).collect()
}

fn islands(
    rng: &mut ChaCha8Rng,
    n: usize,
    (radii, half, corners): (Range<f64>, f64, Option<u32>),
) -> (Vec<Ring>, [Vector2<f64>; 2]) {
    let length = 250.0;
    let one = |_| {
        let at = Vector2::new(rng.random_range(30.0..length - 30.0), rng.random_range(-half..half));
        let radius = rng.random_range(radii.clone());
        island(at, radius, corners, rng)
    };
    let rings = (0..n).map(one).collect();
    let ends = [0.0, length].map(|north| Vector2::new(north, rng.random_range(-20.0..20.0)));
    (rings, ends)
}

/// A jagged wall across a closed basin, with a passage of `factor` times what the planner needs.
fn strait(rng: &mut ChaCha8Rng, factor: f64) -> (Vec<Ring>, [Vector2<f64>; 2]) {
    let (w, l, gap) = (60.0, 160.0, CLEARANCE * factor);
    let (middle, thick) = (rng.random_range(-40.0..40.0), rng.random_range(2.0..25.0));
    let frame = [
        ring(&[(-20.0, -w - 10.0), (l + 20.0, -w - 10.0), (l + 20.0, -w), (-20.0, -w)]),
        ring(&[(-20.0, w), (l + 20.0, w), (l + 20.0, w + 10.0), (-20.0, w + 10.0)]),
        ring(&[(-20.0, -w), (-10.0, -w), (-10.0, w), (-20.0, w)]),
        ring(&[(l + 10.0, -w), (l + 20.0, -w), (l + 20.0, w), (l + 10.0, w)]),
    ];
    let mut wall = |from: f64, to: f64| {
        let n = rng.random_range(2..=8);
        let mut side = |sign: f64| -> Ring {
            let corner = |i: i32| {
                let bulge = if 0 < i && i < n { rng.random_range(0.0..12.0) } else { 0.0 };
                let east = from + (to - from) * f64::from(i) / f64::from(n);
                Vector2::new(l / 2.0 + sign * (thick / 2.0 + bulge), east)
            };
            (0..=n).map(corner).collect()
        };
        let (mut south, north) = (side(-1.0), side(1.0));
        south.extend(north.into_iter().rev());
        south
    };
    let walls = [wall(-w - 5.0, middle - gap), wall(middle + gap, w + 5.0)];
    let mut end = |north| Vector2::new(north, rng.random_range(-40.0..40.0));
    let ends = [end(5.0), end(l - 5.0)];
    (frame.into_iter().chain(walls).collect(), ends)
}

/// A wall that winds outwards: the craft at its centre.
fn spiral(rng: &mut ChaCha8Rng) -> (Vec<Ring>, [Vector2<f64>; 2]) {
    let (turns, gap) = (rng.random_range(1.2..2.2_f64), rng.random_range(10.0..18.0));
    #[expect(clippy::cast_possible_truncation, reason = "at most 53")]
    let n = (24.0 * turns) as u32;
    let side = |off: f64| {
        (0..n).map(move |i| {
            let angle = TAU * turns * f64::from(i) / f64::from(n - 1);
            direction(angle) * (8.0 + gap * angle / TAU + off)
        })
    };
    let wall = side(1.5).chain(side(-1.5).rev()).collect();
    let inside = Vector2::new(rng.random_range(-2.0..2.0), rng.random_range(-2.0..2.0));
    (vec![wall], [inside, direction(rng.random_range(0.0..TAU)) * (8.0 + gap * turns + 15.0)])
}

/// A coast halved six times with shifts, and a few islands before it: both ends anywhere in the
/// water.
fn rough_coast(rng: &mut ChaCha8Rng) -> (Vec<Ring>, [Vector2<f64>; 2]) {
    let mut line = ring(&[(-50.0, 0.0), (250.0, 0.0)]);
    for _ in 0..6 {
        let mut finer = vec![line[0]];
        for pair in line.windows(2) {
            let d = (pair[1] - pair[0]).norm().min(3.0 * (pair[1].x - pair[0].x));
            let along = 0.2 * (pair[1].x - pair[0].x);
            let shift = Vector2::new(rng.random_range(-along..along), rng.random_range(-0.38..0.38) * d);
            finer.extend([(pair[0] + pair[1]) / 2.0 + shift, pair[1]]);
        }
        line = finer;
    }
    line.extend(ring(&[(250.0, -200.0), (-50.0, -200.0)]));
    let mut rings = vec![line];
    for _ in 0..rng.random_range(0..=8) {
        let at = Vector2::new(rng.random_range(0.0..200.0), rng.random_range(-10.0..80.0));
        let radius = rng.random_range(4.0..12.0);
        rings.push(island(at, radius, None, rng));
    }
    let mut water = || Vector2::new(rng.random_range(-20.0..220.0), rng.random_range(-60.0..90.0));
    let ends = [water(), water()];
    (rings, ends)
}

/// Distance of a point from the sides of `rings`, m.
fn off(rings: &[Ring], point: &Vector2<f64>) -> f64 {
    let from_side = |a: &Vector2<f64>, b: &Vector2<f64>| {
        let (along, to) = (b - a, point - a);
        (to - along * (to.dot(&along) / along.norm_squared()).clamp(0.0, 1.0)).norm()
    };
    let from_ring = |ring: &Ring| {
        let next = ring.iter().cycle().skip(1);
        ring.iter().zip(next).map(|(a, b)| from_side(a, b)).fold(f64::INFINITY, f64::min)
    };
    rings.iter().map(from_ring).fold(f64::INFINITY, f64::min)
}

fn draw(seed: u64, many: Option<usize>) -> Result<Coast, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let kind = KINDS[usize::try_from(seed % KINDS.len() as u64)?];
    loop {
        let (rings, ends) = match (kind, many) {
            (_, Some(n)) => islands(&mut rng, n, (4.0..6.0, 500.0, Some(39))),
            ("bay", _) => bay(&mut rng),
            ("islands", _) => {
                let n = rng.random_range(4..=18);
                islands(&mut rng, n, (6.0..35.0, 60.0, None))
            }
            ("wide strait", _) => strait(&mut rng, 1.15),
            ("narrow strait", _) => strait(&mut rng, 0.8),
            ("spiral", _) => spiral(&mut rng),
            _ => rough_coast(&mut rng),
        };
        let turned = Rotation2::new(rng.random_range(0.0..TAU));
        let corners = |ring: &Ring| ring.iter().map(|corner| (turned * corner).into()).collect();
        let no_go: Vec<NoGo> = rings.iter().map(corners).map(NoGo::new).collect();
        let heading = rng.random_range(-3.0..3.0);
        let depth = no_go_depths(&no_go);
        let is_free =
            |end: &Vector2<f64>| depth(&(turned * end)) <= 0.0 && 1.05 * CLEARANCE < off(&rings, end);
        if !ends.iter().all(is_free) {
            continue;
        }
        let [start, auv] = ends.map(|end| turned * end);
        let coast = Coast { kind, no_go, start, auv, heading };
        if Snapshot::try_from(request(&coast)?).is_ok() {
            return Ok(coast);
        }
    }
}

/// The first request of a flight.
fn request(coast: &Coast) -> Result<PlanRequest, Failure> {
    let loops = json!({
        "heading_loop": { "time_constant_s": HEADING_LAG, "delay_s": 0.0, "rate_max_radps": TURN_RATE },
        "surge_loop": { "time_constant_s": SPEED_LAG, "delay_s": 0.0 },
    });
    let limits = json!({
        "speed_max_mps": SPEED, "turn_rate_max_radps": TURN_RATE,
        "acceleration_max_mps2": ACCELERATION, "deceleration_max_mps2": ACCELERATION,
    });
    let auv = AuvState::new(coast.auv, 10.0, Course::new(0.0), 0.0);
    let asc = Asc::new(coast.start, Heading::new(coast.heading), 0.3);
    let goal = Goal::Track { auv: "auv".into() };
    let mut request = PlanRequest::new(0.0, asc, vec![Auv::new("auv", auv)], goal);
    request.no_go.clone_from(&coast.no_go);
    request.limits = serde_json::from_value(limits)?;
    request.craft = serde_json::from_value(loops)?;
    Ok(request)
}

/// Time of this thread on a processor, ms: on a busy machine the clock tells what others do.
fn cpu_ms() -> Result<f64, Failure> {
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    Ok(spent.split(' ').next().unwrap_or_default().parse::<f64>()? * 1e-6)
}

fn rounded(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

fn fly(seed: u64, coast: &Coast, show: bool) -> Result<Value, Failure> {
    let (parameters, mut workspace) = (Parameters::default(), Workspace::default());
    let (depth, mut request) = (no_go_depths(&coast.no_go), request(coast)?);
    let (mut position, mut heading, mut speed, mut rate) = (coast.start, coast.heading, 0.3, 0.0);
    let (mut length, mut deepest, mut inside, mut arrived) = (0.0, 0.0_f64, 0.0, None);
    let (mut track, mut plan_ms) = (vec![position], Vec::new());
    for t in 0..DURATION {
        request.t_s = t as f64;
        request.asc = Asc { yaw_rate_radps: rate, ..Asc::new(position, Heading::new(heading), speed) };
        let begun = cpu_ms()?;
        let answer = plan(&Snapshot::try_from(request.clone())?, &parameters, &mut workspace);
        plan_ms.push(rounded(cpu_ms()? - begun));
        let reference = answer.reference;
        if show {
            let to = |k: usize| answer.goal.get(k).map(|at| (at.north_m.round(), at.east_m.round()));
            let worst: Vec<_> = answer.violations.iter().map(|v| (v.limit, v.amount)).collect();
            eprintln!(
                "{t} ({:.2}, {:.2}) {heading:.2} {speed:.2} -> {:.2} {:.2} {:?} goal {:?} {:?} {worst:.3?}",
                position.x,
                position.y,
                reference.heading.radians(),
                reference.speed,
                answer.method,
                to(6),
                to(12)
            );
        }
        request.previous_plan = Some((&answer).into());
        for _ in 0..10 {
            let asked = wrap(reference.heading.radians() - heading) / HEADING_LAG;
            rate = asked.clamp(-TURN_RATE, TURN_RATE);
            heading = wrap(heading + rate * 0.1);
            speed += ((reference.speed - speed) / SPEED_LAG).clamp(-ACCELERATION, ACCELERATION) * 0.1;
            position += direction(heading) * speed * 0.1;
            length += speed * 0.1;
            track.push(position);
            let now = depth(&position);
            deepest = deepest.max(now);
            inside += if 0.0 < now { 0.1 } else { 0.0 };
        }
        if (position - coast.auv).norm() < 5.0 {
            arrived = Some(t + 1);
            break;
        }
        let before = track.len().checked_sub(10 * STILL).map(|k| track[k]);
        if before.is_some_and(|before| (position - before).norm() < 2.0) {
            break;
        }
    }
    let pair = |place: &Vector2<f64>| [rounded(place.x), rounded(place.y)];
    Ok(json!({
        "seed": seed, "kind": coast.kind, "no_go": coast.no_go, "start": pair(&coast.start), "auv": pair(&coast.auv),
        "clearance_m": CLEARANCE, "speed_mps": SPEED, "arrived_s": arrived, "length_m": rounded(length),
        "deepest_m": deepest, "inside_s": inside, "plan_ms": plan_ms,
        "track": track.iter().step_by(2).map(pair).collect::<Vec<_>>(),
    }))
}

fn option<T: std::str::FromStr>(name: &str, default: T) -> T {
    let given = env::args().skip_while(|argument| argument != name).nth(1);
    given.and_then(|given| given.parse().ok()).unwrap_or(default)
}

fn main() -> Result<(), Failure> {
    let (seeds, most) = (option("--seeds", "1-20".to_owned()), option("--islands", -1_i64));
    let (from, to) = seeds.split_once('-').unwrap_or((&seeds, &seeds));
    let mut out = std::io::stdout();
    for seed in from.parse()?..=to.parse()? {
        if option("--kind", seed % KINDS.len() as u64) == seed % KINDS.len() as u64 {
            writeln!(
                out,
                "{}",
                fly(
                    seed,
                    &draw(seed, usize::try_from(most).ok())?,
                    env::args().any(|argument| argument == "--show")
                )?
            )?;
        }
    }
    Ok(())
}
