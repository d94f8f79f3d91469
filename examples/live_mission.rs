//! Rehearses a live mission: the work of a surface craft's computer, at up to 20 times real time.
//!
//! ```text
//! cargo run --release -- serve --data /tmp/missions            # the server, in another terminal
//! cargo run --release -p examples --example live_mission
//! ```
//! Once a second of mission time it posts new reports and gets the reference. Kill the server and
//! restart it with the same --data: the mission resumes. Meanwhile the craft follows the last
//! reference while it is valid; unacknowledged reports are posted again.

use std::{
    collections::BTreeMap,
    error::Error,
    fmt,
    process::ExitCode,
    thread,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use clap::Parser;
use examples::{
    remote_missions::{NoAnswer, RemoteMissions, insist},
    small_world::{AUV_IDS, Steer, World, auvs},
};
use wire::{
    CraftDescription, Forecast, Goal, Hold, Origin, Outcome, Task, VehicleId,
    mission::{CurrentReference, Live, Mission, NewMission, Reports, Steering, SteeringState},
};

/// Longest silence of one AUV, s, in the middle of the mission.
const SILENCE_MAX: f64 = 180.0;
/// Duration of the approach, s.
const SETTLED_AFTER: usize = 60;
/// Between two printed lines, s of mission time.
const LINE_INTERVAL: f64 = 20.0;
/// Longest wait for the server at the beginning and at the end.
const PATIENCE: Duration = Duration::from_mins(1);
/// Pause between two attempts to post the last reports.
const REST: Duration = Duration::from_millis(200);

#[derive(Parser)]
pub(crate) struct Arguments {
    /// The server.
    #[arg(long, default_value = "http://127.0.0.1:8080")]
    url: String,
    /// How long the mission lasts, s of mission time.
    #[arg(long, value_name = "S", default_value_t = 900, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    duration: u32,
    /// Seconds of mission time in one, from 1 to 20.
    #[arg(long, value_name = "RATE", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=20))]
    clock_rate: u32,
    /// Seed of the fixes' errors and delays.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    match fly(&Arguments::parse(), &mut |_| {}) {
        Ok(summary) => {
            println!("{summary}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Results of a mission.
#[derive(Debug)]
pub(crate) struct Summary {
    /// Its name on the server.
    pub(crate) mission: String,
    /// Root mean square distance to the midpoint of the AUVs, m.
    pub(crate) rms_m: f64,
    /// The same without the approach.
    pub(crate) settled_rms_m: f64,
    /// Largest distance while one AUV was not heard, m.
    pub(crate) silence_max_m: f64,
    /// Time under a degraded reference, s.
    pub(crate) degraded_s: u32,
    /// Time without a valid reference, s.
    pub(crate) unguided_s: u32,
    /// Posts of reports that the server has acknowledged, by the number that it gave each.
    pub(crate) acknowledged: BTreeMap<u64, Reports>,
    /// Posts of reports that had no answer and were sent again.
    pub(crate) retries: u32,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:<20}{:>10}", "mission", self.mission)?;
        writeln!(f, "{:<20}{:>10.2}", "rms_m", self.rms_m)?;
        writeln!(f, "{:<20}{:>10.2}", "settled_rms_m", self.settled_rms_m)?;
        writeln!(f, "{:<20}{:>10.2}", "silence_max_m", self.silence_max_m)?;
        writeln!(f, "{:<20}{:>10}", "degraded_s", self.degraded_s)?;
        writeln!(f, "{:<20}{:>10}", "unguided_s", self.unguided_s)?;
        writeln!(f, "{:<20}{:>10}", "acknowledged", self.acknowledged.len())?;
        write!(f, "{:<20}{:>10}", "retries", self.retries)
    }
}

/// Flies the mission. `aside` is called every second of mission time with that time, s.
pub(crate) fn fly(arguments: &Arguments, aside: &mut dyn FnMut(f64)) -> Result<Summary, Box<dyn Error>> {
    let missions = RemoteMissions::new(&arguments.url);
    // Unique to this run: the server answers a repeated key with its first answer.
    let run = format!(
        "rehearsal-{}",
        SystemTime::now().duration_since(UNIX_EPOCH)?.as_nanos()
    );
    let new = new_mission(arguments);
    let mission = insist(PATIENCE, || missions.create(&new, &format!("{run}-create")))?;
    insist(PATIENCE, || missions.run(&mission.id, &format!("{run}-run")))?;

    let clock = Clock::new(&mission, arguments.clock_rate);
    let duration = f64::from(arguments.duration);
    let silent = SILENCE_MAX.min(duration / 3.0);
    let silence_start = (duration - silent) / 2.0;
    let silence = silence_start..silence_start + silent;
    let mut world = World::new(clock.now(), duration, silence, arguments.seed);
    let mut bridge = Bridge {
        missions: &missions,
        mission: &mission.id,
        run: &run,
        posts: 0,
        waiting: vec![],
        acknowledged: BTreeMap::new(),
        retries: 0,
        reference: None,
    };
    let mut tally = Tally::default();
    while world.time() < duration {
        // Catches up with the clock after a slow answer.
        while world.time() < duration && world.clock() < clock.now() {
            world.step(bridge.steer(world.clock()));
            if world.is_at_a_whole_second() {
                tally.see(&world, &bridge);
            }
        }
        let next = clock.reaches(world.clock() + 1.0);
        bridge.keep(world.clock(), world.heard());
        bridge.post(next)?;
        bridge.ask()?;
        aside(world.time());
        thread::sleep(next.saturating_duration_since(Instant::now()));
    }
    // Posts the remaining reports.
    let end = Instant::now() + PATIENCE;
    while !bridge.waiting.is_empty() && Instant::now() < end {
        bridge.post(end)?;
        thread::sleep(REST);
    }
    insist(PATIENCE, || {
        missions.finish(&mission.id, &format!("{run}-finish"))
    })?;
    Ok(Summary {
        rms_m: rms(&tally.distances),
        settled_rms_m: rms(tally.distances.get(SETTLED_AFTER..).unwrap_or_default()),
        silence_max_m: tally.silence_max,
        degraded_s: tally.degraded,
        unguided_s: tally.unguided,
        acknowledged: bridge.acknowledged,
        retries: bridge.retries,
        mission: mission.id,
    })
}

fn new_mission(arguments: &Arguments) -> NewMission {
    NewMission {
        schema_version: wire::SCHEMA_VERSION.to_owned(),
        title: Some("rehearsal".to_owned()),
        simulated: None,
        live: Some(Live {
            auvs: auvs(arguments.duration.into()),
            goal: Task::from(Goal::Midpoint {
                auvs: AUV_IDS.map(VehicleId::from).to_vec(),
            }),
            current: None,
            limits: None,
            craft: Some(CraftDescription::of_preset("medusa")),
            keep_outs: vec![],
            area: vec![],
            acoustics: None,
            surfacing_separation_m: None,
            tuning: None,
            forecast: Forecast::Auto,
            hold: Hold::SlowTurn,
            period_s: 1.0,
            clock_rate: arguments.clock_rate.into(),
            // As in the scenarios. Records as GeoJSON need it.
            origin: Some(Origin {
                lat_deg: 38.41,
                lon_deg: -9.12,
            }),
        }),
        metadata: serde_json::Map::new(),
    }
}

/// The mission's clock. It assumes that the server's clock agrees with this computer's.
struct Clock {
    created: f64,
    rate: f64,
}

impl Clock {
    fn new(mission: &Mission, rate: u32) -> Self {
        Self {
            created: mission.created_s,
            rate: rate.into(),
        }
    }

    /// Time of the mission, s.
    fn now(&self) -> f64 {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH);
        let unix = unix.map_or(0.0, |since| since.as_secs_f64());
        self.created + self.rate * (unix - self.created)
    }

    /// The instant of the mission time `time`; now if that is past.
    fn reaches(&self, time: f64) -> Instant {
        Instant::now() + Duration::from_secs_f64((time - self.now()).max(0.0) / self.rate)
    }
}

/// State of the craft's computer, and its calls to the server.
struct Bridge<'a> {
    missions: &'a RemoteMissions,
    mission: &'a str,
    /// Prefix of its idempotency keys.
    run: &'a str,
    /// Number of posts so far, sent or waiting.
    posts: u32,
    /// Unacknowledged reports with their keys, the newest last.
    waiting: Vec<(String, Reports)>,
    acknowledged: BTreeMap<u64, Reports>,
    retries: u32,
    reference: Option<CurrentReference>,
}

impl Bridge<'_> {
    /// The last reference, while it is valid at `time`.
    fn steer(&self, time: f64) -> Option<Steer> {
        let reference = self.reference.as_ref()?.plan.reference;
        (time <= reference.valid_until_s).then_some(Steer {
            speed: reference.speed_mps,
            heading: reference.heading_rad,
        })
    }

    /// Keeps a report of `time` for the service, with whether the craft is steered then.
    fn keep(&mut self, time: f64, mut heard: Reports) {
        let steer = self.steer(time);
        heard.steering = vec![Steering {
            t_s: time,
            state: steer.map_or(SteeringState::NotSteering, |_| SteeringState::Steering),
            why: String::new(),
        }];
        self.waiting.push((format!("{}-{}", self.run, self.posts), heard));
        self.posts += 1;
    }

    /// Posts waiting reports until none is left, `end` has passed or the server does not answer.
    /// The newest goes first: the craft's present position matters most.
    fn post(&mut self, end: Instant) -> Result<(), NoAnswer> {
        while let Some((key, heard)) = self.waiting.last() {
            match self.missions.report(self.mission, heard, key) {
                Ok(accepted) => {
                    let acknowledged = self.waiting.pop().map(|(_, heard)| (accepted.sequence, heard));
                    self.acknowledged.extend(acknowledged);
                }
                Err(error) if error.may_pass() => {
                    self.retries += 1;
                    return Ok(());
                }
                Err(error) => return Err(error),
            }
            if end <= Instant::now() {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Gets the reference. Without an answer, or a plan since the server's start, it stays.
    fn ask(&mut self) -> Result<(), NoAnswer> {
        match self.missions.reference(self.mission) {
            Ok(Some(reference)) => self.reference = Some(reference),
            Ok(None) => {}
            Err(error) if error.may_pass() => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

/// Scores, updated once a second.
#[derive(Default)]
struct Tally {
    distances: Vec<f64>,
    silence_max: f64,
    degraded: u32,
    unguided: u32,
}

impl Tally {
    fn see(&mut self, world: &World, bridge: &Bridge<'_>) {
        let distance = world.distance();
        self.distances.push(distance);
        if world.is_silent() {
            self.silence_max = self.silence_max.max(distance);
        }
        let reference = bridge.reference.as_ref();
        if bridge.steer(world.clock()).is_none() {
            self.unguided += 1;
        } else if reference.is_some_and(|reference| reference.outcome == Outcome::Degraded) {
            self.degraded += 1;
        }
        if world.time() % LINE_INTERVAL != 0.0 {
            return;
        }
        print!("t_s {:>6.0}  distance_m {distance:>6.2}", world.time());
        match reference {
            None => println!("  outcome none"),
            Some(reference) => println!(
                "  outcome {}  method {}  age_s {:.1}",
                name(reference.outcome),
                name(reference.method),
                world.clock() - reference.t_s
            ),
        }
    }
}

/// Root mean square; NaN without values.
fn rms(values: &[f64]) -> f64 {
    let n = u32::try_from(values.len()).map_or(f64::INFINITY, f64::from);
    (values.iter().map(|value| value * value).sum::<f64>() / n).sqrt()
}

/// Its name in JSON.
fn name(value: impl serde::Serialize) -> String {
    let name = serde_json::to_value(value).unwrap_or_default();
    name.as_str().unwrap_or_default().to_owned()
}
