//! `pilotfish bridge`: a craft's autopilot and a live mission, and `pilotfish preflight`, which looks before departure.

use std::{
    collections::BTreeSet,
    error::Error,
    fs, io,
    path::{Path, PathBuf},
    process,
    str::FromStr,
    sync::mpsc::{RecvTimeoutError, sync_channel},
    thread,
    time::Duration,
};

use bridge::{
    acoustics::{self, Modem},
    follow::{Bridge as Follower, Mission, Settings},
    helm::HelmSettings,
    mission::Missions,
    preflight::{Verdict, checks},
    wire::Endpoint,
};
use clap::{Args, Subcommand, ValueEnum};
use serde_json::{Value, json};

use super::{config::Config, out_file::print, serve::serve_and};

/// How long the autopilot is waited for before anything is asked of the service.
const PATIENCE: Duration = Duration::from_hours(24);
/// How long an embedded service may take to start: it may have a log to read.
const START: Duration = Duration::from_mins(1);

#[derive(Debug, Subcommand)]
pub(crate) enum Bridge {
    /// An autopilot that speaks MAVLink: ArduPilot's Rover; PX4, tried by message only.
    Mavlink {
        #[command(flatten)]
        autopilot: Autopilot,
        #[command(flatten)]
        rest: Following,
        /// Order the guided mode and switch the motors on, once; without it a person does.
        #[arg(long)]
        take_control: bool,
    },
    /// An autopilot that speaks NMEA 0183: it sends position, heading and speed, and takes HTC, HTD and APB.
    Nmea {
        /// The autopilot: udp:HOST:PORT listens, udpout:HOST:PORT, tcp:HOST:PORT, serial:DEVICE:BAUD
        #[arg(long, value_name = "WIRE")]
        connect: Endpoint,
        #[command(flatten)]
        rest: Following,
    },
    /// A craft that follows ROS 2 topics; its parameters come after --ros-args (docs/ros2.md).
    #[cfg(feature = "ros2")]
    Ros2 {
        #[command(flatten)]
        rest: Following,
        /// --ros-args and what follows it.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
}

#[derive(Debug, Args)]
pub(crate) struct Preflight {
    #[command(flatten)]
    autopilot: Autopilot,
    #[command(flatten)]
    sensors: Sensors,
    #[command(flatten)]
    mission: MissionFlags,
    /// How long to look, s.
    #[arg(long, value_name = "S", default_value_t = 20)]
    look: u64,
}

/// An autopilot on MAVLink.
#[derive(Debug, Args)]
pub(crate) struct Autopilot {
    /// The autopilot: udp:HOST:PORT listens, udpout:HOST:PORT, tcp:HOST:PORT, serial:DEVICE:BAUD
    #[arg(long, value_name = "WIRE")]
    connect: Endpoint,
    /// The autopilot's system number, where several are heard.
    #[arg(long, value_name = "N")]
    system: Option<u8>,
    /// An AUV that speaks MAVLink as system N; may be repeated.
    #[arg(long, value_name = "N=NAME")]
    auv: Vec<NamedSystem>,
}

/// How the mission is followed, whatever steers.
#[derive(Debug, Args)]
pub(crate) struct Following {
    #[command(flatten)]
    sensors: Sensors,
    #[command(flatten)]
    mission: MissionFlags,
    /// References a second, from 2 to 50.
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = rate)]
    rate: f64,
    /// Time between two posts of what was heard, s, from 0.05 to 5.
    #[arg(long, value_name = "S", default_value_t = 0.2, value_parser = interval)]
    report_interval: f64,
    /// Follow what line of sight would do, to compare with, and not the plan.
    #[arg(long)]
    line_of_sight: bool,
    /// Send nothing that moves the craft; the references are in the lines printed.
    #[arg(long)]
    dry_run: bool,
    /// End after so long, s; the craft's own time-out stops it.
    #[arg(long, value_name = "S")]
    end_after: Option<f64>,
}

/// What else tells of the craft and of its AUVs.
#[derive(Debug, Args)]
struct Sensors {
    /// A wire with NMEA 0183 of the craft (position, heading, speed through the water); may be repeated.
    #[arg(long, value_name = "WIRE")]
    nmea: Vec<Endpoint>,
    /// An acoustic modem: its wire and the file of its settings; may be repeated.
    #[arg(long, value_name = "WIRE=FILE")]
    modem: Vec<NamedModem>,
    /// Standard deviation of fixes that say nothing of their accuracy, m, from 0.01 to 1000.
    #[arg(long, value_name = "M", default_value_t = 1.0, value_parser = sigma)]
    sigma: f64,
}

/// Which mission is kept, and where.
#[derive(Debug, Args)]
struct MissionFlags {
    /// The service; without one, a service of the bridge's own keeps the mission in --data.
    #[arg(long, value_name = "URL")]
    url: Option<String>,
    /// File with the token that the service wants.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Certificate of a service that has one of its own, PEM; without it, the authorities that browsers know count.
    #[arg(long, value_name = "FILE", requires = "url")]
    certificate: Option<PathBuf>,
    /// Join this mission.
    #[arg(long, value_name = "ID", conflicts_with_all = ["setup", "goal"])]
    mission: Option<String>,
    /// Make the mission of this body of POST /v1/missions.
    #[arg(long, value_name = "FILE", conflicts_with = "goal")]
    setup: Option<PathBuf>,
    /// What to do with the AUVs [default: track, of one AUV]
    #[arg(long)]
    goal: Option<Goal>,
    /// Of --goal intermittent: time with each AUV, s.
    #[arg(long, value_name = "S", default_value_t = 240.0)]
    dwell: f64,
    /// Time between two plans, s, from 0.5.
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    period: f64,
    /// The bridge's mission: one that is started again under the same name goes on with it.
    #[arg(long, default_value = "craft")]
    name: String,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Goal {
    /// Stay above the first AUV.
    Track,
    /// Be with each AUV in turn.
    Intermittent,
    /// Stay above their midpoint.
    Midpoint,
}

#[derive(Clone, Debug)]
struct NamedSystem(u8, String);

#[derive(Clone, Debug)]
struct NamedModem(Endpoint, PathBuf);

impl FromStr for NamedSystem {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = "write the number of its system and its name, such as 2=auv-1";
        let (number, name) = text.split_once('=').ok_or(wrong)?;
        let number = number.parse().map_err(|_| wrong)?;
        if name.is_empty() {
            Err(wrong)
        } else {
            Ok(Self(number, name.to_owned()))
        }
    }
}

impl FromStr for NamedModem {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (wire, file) = text
            .rsplit_once('=')
            .ok_or("write its wire and the file of its settings, such as tcp:192.168.0.209:9200=usbl.json")?;
        let endpoint = wire
            .parse()
            .map_err(|error: bridge::wire::NoEndpoint| error.to_string())?;
        Ok(Self(endpoint, PathBuf::from(file)))
    }
}

/// Why there is no bridge.
#[derive(Debug, thiserror::Error)]
enum NoBridge {
    #[error(
        "no AUV: name one with --auv N=NAME or in a modem's settings, or give --setup FILE or --mission ID"
    )]
    NoAuv,
    #[error("several AUVs want a --goal: intermittent, midpoint, or track for the first")]
    NoGoal,
    #[error("{} cannot be read", .0.display())]
    Unreadable(PathBuf, #[source] io::Error),
    #[error("{} is not JSON", .0.display())]
    NoJson(PathBuf, #[source] serde_json::Error),
    #[error("the file of --certificate has no certificate")]
    NoCertificate(#[source] Box<dyn Error + Send + Sync>),
    #[error("the service of the bridge did not start")]
    NoService,
    #[error("{0} of {1} checks failed: see to them before departure")]
    NotReady(usize, usize),
}

/// Follows the mission until it is over.
pub(crate) fn bridge(bridge: Bridge, config: &Config) -> Result<(), Box<dyn Error>> {
    let (helm, auvs, following, take_control) = match bridge {
        Bridge::Mavlink {
            autopilot,
            rest,
            take_control,
        } => {
            let auvs = autopilot.names();
            (autopilot.helm(), auvs, rest, take_control)
        }
        Bridge::Nmea { connect, rest } => (HelmSettings::Nmea { connect }, vec![], rest, false),
        #[cfg(feature = "ros2")]
        Bridge::Ros2 { rest, arguments } => {
            let (wire, auvs) = ros2(arguments)?;
            (HelmSettings::Ros2(Box::new(wire)), auvs, rest, false)
        }
    };
    let (sensors, names) = following.sensors.open()?;
    let mission = following.mission.mission([auvs, names].concat())?;
    let missions = following.mission.service(config)?;
    let settings = Settings {
        rate_hz: following.rate,
        report_interval: Duration::from_secs_f64(following.report_interval),
        take_control,
        line_of_sight: following.line_of_sight,
        dry_run: following.dry_run,
        ..sensors
    };
    let mut follower = Follower::open(helm, settings);
    tracing::info!("waiting for the craft");
    follower.meet(PATIENCE);
    follower.keep(missions, mission);
    for contradiction in follower.contradictions() {
        tracing::warn!("{contradiction}");
    }
    follower.run(following.end_after.map(Duration::from_secs_f64))?;
    Ok(())
}

/// Looks, prints a line a check, and fails if one failed.
pub(crate) fn preflight(arguments: &Preflight, config: &Config) -> Result<(), Box<dyn Error>> {
    let (sensors, names) = arguments.sensors.open()?;
    let mission = arguments
        .mission
        .mission([arguments.autopilot.names(), names].concat())?;
    let missions = arguments.mission.service(config)?;
    let settings = Settings {
        dry_run: true,
        ..sensors
    };
    let mut follower = Follower::open(arguments.autopilot.helm(), settings);
    let look = Duration::from_secs(arguments.look);
    if follower.meet(look) {
        follower.keep(missions, mission);
        // Why there can be no mission is a check of its own.
        if let Err(error) = follower.run(Some(look)) {
            tracing::warn!(%error, "looked for less long");
        }
    }
    let checks = checks(&follower);
    let lines: Vec<String> = checks.iter().map(ToString::to_string).collect();
    print(&(lines.join("\n") + "\n"))?;
    let failed = checks
        .iter()
        .filter(|check| check.verdict == Verdict::Fails)
        .count();
    if failed > 0 {
        return Err(NoBridge::NotReady(failed, checks.len()).into());
    }
    Ok(())
}

/// The node that `arguments` describe, and its AUVs.
#[cfg(feature = "ros2")]
fn ros2(arguments: Vec<String>) -> Result<(bridge::ros2::Ros2Wire, Vec<String>), Box<dyn Error>> {
    use bridge::ros2;
    let arguments = ros2::Arguments::parse(arguments)?;
    let settings = ros2::Settings::new(
        &arguments,
        |name| std::env::var(name).ok(),
        |file| fs::read_to_string(file),
    )?;
    let auvs = settings.auvs.clone();
    Ok((ros2::Ros2Wire::new(settings)?, auvs))
}

impl Autopilot {
    fn helm(&self) -> HelmSettings {
        let auvs = self
            .auv
            .iter()
            .map(|NamedSystem(number, name)| (*number, name.clone()));
        HelmSettings::Mavlink {
            connect: self.connect.clone(),
            system: self.system,
            auvs: auvs.collect(),
        }
    }

    fn names(&self) -> Vec<String> {
        self.auv.iter().map(|NamedSystem(_, name)| name.clone()).collect()
    }
}

impl Sensors {
    /// Their part of the settings, and the AUVs that modems name.
    fn open(&self) -> Result<(Settings, Vec<String>), Box<dyn Error>> {
        let (mut modems, mut names) = (vec![], vec![]);
        for NamedModem(endpoint, file) in &self.modem {
            let settings: acoustics::Settings = serde_json::from_value(json_of(file)?)
                .map_err(|error| NoBridge::NoJson(file.clone(), error))?;
            names.extend(settings.names.values().cloned());
            modems.push((endpoint.clone(), Modem::new(&settings)?));
        }
        let settings = Settings {
            nmea: self.nmea.clone(),
            modems,
            sigma_m: self.sigma,
            ..Settings::default()
        };
        Ok((settings, names))
    }
}

impl MissionFlags {
    fn mission(&self, mut auvs: Vec<String>) -> Result<Mission, NoBridge> {
        let mut seen = BTreeSet::new();
        auvs.retain(|auv| seen.insert(auv.clone()));
        if let Some(id) = &self.mission {
            return Ok(Mission::Joined(id.clone()));
        }
        let setup = match &self.setup {
            Some(file) => json_of(file)?,
            None => self.body(&auvs)?,
        };
        Ok(Mission::Named(self.name.clone(), setup))
    }

    /// A mission of the AUVs on the command line.
    fn body(&self, auvs: &[String]) -> Result<Value, NoBridge> {
        let first = auvs.first().ok_or(NoBridge::NoAuv)?;
        let goal = match (self.goal, auvs.len()) {
            (Some(Goal::Track), _) | (None, 1) => json!({ "kind": "track", "auv": first }),
            (Some(Goal::Intermittent), _) => {
                json!({ "kind": "intermittent", "auvs": auvs, "dwell_s": self.dwell, "epoch_s": 0.0 })
            }
            (Some(Goal::Midpoint), _) => json!({ "kind": "midpoint", "auvs": auvs }),
            (None, _) => return Err(NoBridge::NoGoal),
        };
        let auvs: Vec<Value> = auvs.iter().map(|id| json!({ "id": id })).collect();
        let live = json!({ "auvs": auvs, "goal": goal, "period_s": self.period });
        Ok(json!({ "schema_version": "1.0", "title": self.name, "live": live }))
    }

    /// The service at --url, or one of the bridge's own.
    fn service(&self, config: &Config) -> Result<Missions, NoBridge> {
        let read = |file: &PathBuf| {
            let text = fs::read_to_string(file);
            text.map_err(|error| NoBridge::Unreadable(file.clone(), error))
        };
        let token = self.token_file.as_ref().map(read).transpose()?;
        let certificate = self.certificate.as_ref().map(read).transpose()?;
        let url = match &self.url {
            Some(url) => url.clone(),
            None => own_service(config)?,
        };
        let token = token.map(|token| token.trim().to_owned());
        let certificate = certificate.as_ref().map(String::as_bytes);
        Missions::new(&url, token, certificate).map_err(|error| NoBridge::NoCertificate(error.into()))
    }
}

/// Starts a service on any free port of this machine, and answers its URL. The program ends with it.
fn own_service(config: &Config) -> Result<String, NoBridge> {
    let config = config.on_any_loopback_port();
    let (sender, url) = sync_channel(1);
    thread::spawn(move || {
        let served = serve_and(&config, |address, has_tls| {
            let scheme = if has_tls { "https" } else { "http" };
            // Its reader waits for it.
            let _ = sender.send(format!("{scheme}://{address}"));
        });
        match served {
            Ok(()) => process::exit(0),
            Err(error) => {
                tracing::error!(error = &error as &dyn Error, "the service of the bridge");
                process::exit(1);
            }
        }
    });
    match url.recv_timeout(START) {
        Ok(url) => {
            tracing::info!(url, "the mission is kept by a service of the bridge's own");
            Ok(url)
        }
        Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => Err(NoBridge::NoService),
    }
}

fn json_of(file: &Path) -> Result<Value, NoBridge> {
    let text = fs::read_to_string(file).map_err(|error| NoBridge::Unreadable(file.to_owned(), error))?;
    serde_json::from_str(&text).map_err(|error| NoBridge::NoJson(file.to_owned(), error))
}

fn rate(text: &str) -> Result<f64, String> {
    within(text, 2.0, 50.0)
}

fn interval(text: &str) -> Result<f64, String> {
    within(text, 0.05, 5.0)
}

fn sigma(text: &str) -> Result<f64, String> {
    within(text, 0.01, 1000.0)
}

fn within(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text
        .parse::<f64>()
        .ok()
        .filter(|number| (least..=most).contains(number));
    number.ok_or_else(|| format!("must be a number from {least} to {most}"))
}
