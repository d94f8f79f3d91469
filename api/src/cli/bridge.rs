//! `pilotfish bridge` connects an autopilot to a mission; `pilotfish preflight` checks beforehand.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{fs, io, process};

use bridge::acoustics::{self, Modem};
use bridge::autopilot_link::AutopilotSettings;
use bridge::follow::{Bridge as Follower, Settings};
use bridge::imc::ImcSettings;
use bridge::mission_client::{MissionClient, TokenFile, Transport};
use bridge::mission_link::MissionChoice;
use bridge::moos::datum_of;
use bridge::preflight::{Verdict, checks};
use bridge::wire::{self, Endpoint, InvalidEndpoint};
use clap::{Args, Subcommand, ValueEnum, value_parser};
use clock::Clock;
use serde_json::{Value, json};
use tokio::{runtime, sync::oneshot};

use super::config::Config;
use super::declared_areas::DeclaredAreas;
use super::declared_routes::DeclaredRoutes;
use super::failure::{Failure, because_of};
use super::out_file::print;
use super::serve::{HangUp, serve_and};

/// Longest wait for the autopilot.
const PATIENCE: Duration = Duration::from_hours(24);
/// Longest start of the bridge's own service, which may have a log to read.
const START: Duration = Duration::from_mins(1);

#[derive(Debug, Subcommand)]
pub(crate) enum Bridge {
    /// An autopilot on MAVLink: ArduPilot Rover, or PX4 (messages only tested).
    Mavlink {
        #[command(flatten)]
        autopilot: Autopilot,
        #[command(flatten)]
        rest: Following,
        /// Order the guided mode and arm the craft, six times at most, until it follows for the first
        /// time. Without it a person does both.
        #[arg(long)]
        take_control: bool,
    },
    /// An autopilot on NMEA 0183: sends position, heading and speed; follows HTC, HTD or APB.
    Nmea {
        /// The autopilot: udp:HOST:PORT listens, udpout:HOST:PORT, tcp:HOST:PORT,
        /// serial:DEVICE:BAUD
        #[arg(long, value_name = "WIRE")]
        connect: Endpoint,
        #[command(flatten)]
        rest: Following,
    },
    /// A MOOSDB with the IvP helm, which two behaviours let follow the plan (docs/at-sea.md).
    Moos {
        #[command(flatten)]
        database: Database,
        #[command(flatten)]
        rest: Following,
    },
    /// A craft that runs DUNE, on IMC: follows places ahead in the manoeuvre FollowReference.
    Imc {
        #[command(flatten)]
        dune: Dune,
        #[command(flatten)]
        rest: Following,
        /// Start FollowReference, six times at most, until the craft follows for the first time. Without
        /// it a person does, with the bridge's number as control source.
        #[arg(long, conflicts_with = "headings")]
        take_control: bool,
    },
}

/// A craft that runs DUNE, and the network on which it is.
#[derive(Debug, Args)]
pub(crate) struct Dune {
    /// The network: imc:ADDRESS:PORT, an address of this computer that the vehicles reach; or the
    /// craft alone: tcp:HOST:PORT, udp:HOST:PORT, udpout:HOST:PORT, serial:DEVICE:BAUD
    #[arg(long, value_name = "WIRE")]
    connect: Endpoint,
    /// The craft, by the name that it announces; on wires without announcements N=NAME, as for
    /// --auv.
    #[arg(long, value_name = "[N=]NAME", value_parser = numbered)]
    vehicle: (Option<u16>, String),
    /// An AUV, by the name that it announces and that modems give it, or by its number N too, such
    /// as 0x001e=lauv-1; may be repeated.
    #[arg(long, value_name = "[N=]NAME", value_parser = numbered)]
    auv: Vec<(Option<u16>, String)>,
    /// An AUV whose ranges are those to the LBL beacon N; may be repeated.
    #[arg(long, value_name = "N=NAME", value_parser = named_system)]
    beacon: Vec<(u8, String)>,
    /// The bridge's own number; each bridge on a network needs another one.
    #[arg(long, value_name = "N", default_value = "0x4f15", value_parser = system_number)]
    imc_id: u16,
    /// Send headings and speeds (DesiredHeading, DesiredSpeed) in the mode EXTERNAL, not places
    /// with speeds (Reference): nothing of DUNE ends them.
    #[arg(long)]
    headings: bool,
}

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Preflight {
    #[command(subcommand)]
    other: Option<OtherPreflight>,
    #[command(flatten)]
    autopilot: Option<Autopilot>,
    #[command(flatten)]
    rest: Listening,
}

/// A craft without MAVLink.
#[derive(Debug, Subcommand)]
enum OtherPreflight {
    /// A craft that runs DUNE, on IMC.
    Imc {
        #[command(flatten)]
        dune: Dune,
        #[command(flatten)]
        rest: Listening,
    },
    /// A MOOSDB with the IvP helm.
    Moos {
        #[command(flatten)]
        database: Database,
        #[command(flatten)]
        rest: Listening,
    },
}

/// Listening to a craft, and planning for it.
#[derive(Debug, Args)]
struct Listening {
    #[command(flatten)]
    sensors: Sensors,
    #[command(flatten)]
    mission: MissionFlags,
    /// Time to listen, s.
    #[arg(long, value_name = "S", default_value_t = 60)]
    look: u64,
}

/// An autopilot on MAVLink.
#[derive(Debug, Args)]
pub(crate) struct Autopilot {
    /// The autopilot: udp:HOST:PORT listens, udpout:HOST:PORT, tcp:HOST:PORT, serial:DEVICE:BAUD
    #[arg(long, value_name = "WIRE")]
    connect: Endpoint,
    /// System number of the autopilot, if several are on the wire.
    #[arg(long, value_name = "N")]
    system: Option<u8>,
    /// An AUV that speaks MAVLink as system N; may be repeated.
    #[arg(long, value_name = "N=NAME", value_parser = named_system)]
    auv: Vec<(u8, String)>,
}

/// The MOOSDB of a craft.
#[derive(Debug, Args)]
pub(crate) struct Database {
    /// The database: tcp:HOST:PORT
    #[arg(long, value_name = "WIRE", default_value = "tcp:localhost:9000", value_parser = stream)]
    connect: Endpoint,
    /// The craft's mission file with its macros expanded, for LatOrigin and LongOrigin.
    #[arg(long, value_name = "FILE")]
    moos_file: Option<PathBuf>,
    /// An AUV, by its name in node reports; may be repeated.
    #[arg(long, value_name = "NAME")]
    auv: Vec<String>,
    /// Write DESIRED_HEADING and DESIRED_SPEED instead, for a craft without helm. Nothing then
    /// arbitrates, and nothing stops the craft but its controller.
    #[arg(long)]
    desired: bool,
}

/// Following a mission, with any autopilot.
#[derive(Debug, Args)]
pub(crate) struct Following {
    #[command(flatten)]
    sensors: Sensors,
    #[command(flatten)]
    mission: MissionFlags,
    /// References per second, from 2 to 50.
    #[arg(long, value_name = "HZ", default_value_t = 10.0, value_parser = |text: &str| within(text, 2.0, 50.0))]
    rate: f64,
    /// Time between two reports to the service, s, from 0.05 to 5.
    #[arg(long, value_name = "S", default_value_t = 0.2, value_parser = |text: &str| within(text, 0.05, 5.0))]
    report_interval: f64,
    /// Follow line of sight instead of the plan, for comparison.
    #[arg(long)]
    line_of_sight: bool,
    /// Send nothing that moves the craft; the status lines show the references.
    #[arg(long)]
    dry_run: bool,
    /// End after this time, s, that of waiting for the craft included; the craft's own time-out
    /// stops it.
    #[arg(long, value_name = "S", value_parser = |text: &str| within(text, 0.0, 1e9))]
    end_after: Option<f64>,
}

/// Further sensors of the craft, and modems.
#[derive(Debug, Args)]
struct Sensors {
    /// A wire with NMEA 0183 of the craft (position, heading, speed through water), or of its AIS
    /// receiver; may be repeated.
    #[arg(long, value_name = "WIRE")]
    nmea: Vec<Endpoint>,
    /// MMSI of the craft's own AIS transponder [default: that of its VDO sentences]
    #[arg(long, value_name = "MMSI", value_parser = value_parser!(u32).range(1..=999_999_999))]
    own_mmsi: Option<u32>,
    /// An acoustic modem: its wire and its settings file; may be repeated.
    #[arg(long, value_name = "WIRE=FILE", value_parser = wire_and_file)]
    modem: Vec<(Endpoint, PathBuf)>,
    /// Standard deviation of fixes that state none, m, from 0.01 to 1000.
    #[arg(long, value_name = "M", default_value_t = 1.0, value_parser = |text: &str| within(text, 0.01, 1000.0))]
    sigma: f64,
}

/// The mission to follow, and its place.
#[derive(Debug, Args)]
struct MissionFlags {
    /// The service; repeated, services that share their missions: the next is asked if one does not
    /// answer. Without it, the bridge runs its own and keeps the mission in --data.
    #[arg(long, value_name = "URL")]
    url: Vec<String>,
    /// File with the token for the service.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Certificate to trust (PEM), for a service whose certificate browsers do not know.
    #[arg(long, value_name = "FILE", requires = "url")]
    certificate: Option<PathBuf>,
    /// Join this mission.
    #[arg(long, value_name = "ID", conflicts_with_all = ["setup", "goal", "route", "no_go"])]
    mission: Option<String>,
    /// Create the mission from this file: the body of POST /v1/missions.
    #[arg(long, value_name = "FILE", conflicts_with = "goal")]
    setup: Option<PathBuf>,
    #[command(flatten)]
    routes: DeclaredRoutes,
    #[command(flatten)]
    areas: DeclaredAreas,
    /// Goal of a new mission [default with one AUV: track]
    #[arg(long)]
    goal: Option<Goal>,
    /// Time with each AUV (--goal intermittent), s.
    #[arg(long, value_name = "S", default_value_t = 240.0)]
    dwell: f64,
    /// Growth of an AUV's variance along either axis between ranges (--goal localise), m²/s.
    #[arg(long, value_name = "M2PS", default_value_t = 0.03)]
    growth: f64,
    /// Time between two plans, s, at least 0.5.
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    period: f64,
    /// Name of the mission: a bridge that starts again with the same name continues it, and the
    /// bridges of a fleet join it.
    #[arg(long, default_value = "craft")]
    name: String,
    /// The craft of a fleet that this bridge steers, by its name in the mission's `surface_craft`.
    #[arg(long, value_name = "NAME")]
    craft: Option<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Goal {
    /// Stay above the first AUV.
    Track,
    /// Be with each AUV in turn.
    Intermittent,
    /// Stay above their midpoint.
    Midpoint,
    /// Serve one after the other, so that none waits long.
    Visit,
    /// Sail so that ranges to the craft fix them.
    Localise,
}

/// Follows the mission until it is over.
pub(crate) fn bridge(bridge: Bridge, config: &Config) -> Result<(), Box<dyn Error>> {
    run(follow(bridge, config, &Clock::machine()))
}

/// Prints one line per check; fails if a check fails.
pub(crate) fn preflight(arguments: &Preflight, config: &Config) -> Result<(), Box<dyn Error>> {
    run(look(arguments, config, &Clock::machine()))
}

/// Runs a bridge's loop on this thread, and its mission's tasks, which may be busy, on another.
fn run(bridge: impl Future<Output = Result<(), Box<dyn Error>>>) -> Result<(), Box<dyn Error>> {
    let runtime = runtime::Builder::new_multi_thread().worker_threads(1).enable_time().build()?;
    let ended = runtime.block_on(bridge);
    // Stops without waiting for unanswered requests and the bridge's own service.
    runtime.shutdown_background();
    ended
}

async fn follow(bridge: Bridge, config: &Config, clock: &Clock) -> Result<(), Box<dyn Error>> {
    let (link, auvs, following, take_control) = match bridge {
        Bridge::Mavlink { autopilot, rest, take_control } => {
            let auvs = autopilot.names();
            (autopilot.link(), auvs, rest, take_control)
        }
        Bridge::Nmea { connect, rest } => (AutopilotSettings::Nmea { connect }, vec![], rest, false),
        Bridge::Moos { database, rest } => (database.link()?, database.auv, rest, false),
        Bridge::Imc { dune, rest, take_control } => {
            let (link, auvs) = dune.open(false);
            (link, auvs, rest, take_control)
        }
    };
    let (sensors, names) = following.sensors.open()?;
    let mission = following.mission.mission([auvs, names].concat())?;
    let missions = following.mission.service(config, clock).await?;
    let settings = Settings {
        rate_hz: following.rate,
        report_interval: Duration::from_secs_f64(following.report_interval),
        take_control,
        line_of_sight: following.line_of_sight,
        dry_run: following.dry_run,
        ..sensors
    };
    let began = clock.now();
    let limit = following.end_after.map(Duration::from_secs_f64);
    let mut follower = Follower::open(clock, link, settings, wire::open);
    tracing::info!("waiting for the craft");
    let patience = limit.map_or(PATIENCE, |limit| limit.min(PATIENCE));
    let is_heard = follower.wait_for_craft(patience).await;
    if let (false, Some(end_after)) = (is_heard, following.end_after) {
        return Err(format!("no craft was heard on --connect within {end_after} s").into());
    }
    follower.follow(missions, mission).await;
    for contradiction in follower.contradictions() {
        tracing::warn!("{contradiction}");
    }
    let left = limit.map(|limit| limit.saturating_sub(clock.since(began)));
    follower.run(left).await?;
    Ok(())
}

async fn look(arguments: &Preflight, config: &Config, clock: &Clock) -> Result<(), Box<dyn Error>> {
    let (link, auvs, rest) = match (&arguments.other, &arguments.autopilot) {
        (Some(OtherPreflight::Moos { database, rest }), _) => (database.link()?, database.auv.clone(), rest),
        (Some(OtherPreflight::Imc { dune, rest }), _) => {
            let (link, auvs) = dune.open(true);
            (link, auvs, rest)
        }
        (None, Some(autopilot)) => (autopilot.link(), autopilot.names(), &arguments.rest),
        (None, None) => return Err("give --connect WIRE of an autopilot, or moos or imc".into()),
    };
    let (sensors, names) = rest.sensors.open()?;
    let auvs = [auvs, names].concat();
    let mission = rest.mission.mission(auvs.clone())?;
    let missions = rest.mission.service(config, clock).await?;
    let settings = Settings { dry_run: true, ..sensors };
    let mut follower = Follower::open(clock, link, settings, wire::open);
    let look = Duration::from_secs(rest.look);
    if follower.wait_for_craft(look).await {
        follower.follow(missions, mission).await;
        // A mission that cannot be created has its own check.
        if let Err(error) = follower.run(Some(look)).await {
            tracing::warn!(%error, "stopped listening early");
        }
    }
    let checks = checks(&follower, &auvs);
    let lines: Vec<String> = checks.iter().map(ToString::to_string).collect();
    print(&(lines.join("\n") + "\n"))?;
    let failed = checks.iter().filter(|check| check.verdict == Verdict::Fails).count();
    if failed > 0 {
        let n_checks = checks.len();
        return Err(format!("{failed} of {n_checks} checks failed: correct them before departure").into());
    }
    Ok(())
}

impl Autopilot {
    fn link(&self) -> AutopilotSettings {
        AutopilotSettings::Mavlink {
            connect: self.connect.clone(),
            system: self.system,
            auvs: self.auv.iter().cloned().collect(),
        }
    }

    fn names(&self) -> Vec<String> {
        self.auv.iter().map(|(_, name)| name.clone()).collect()
    }
}

impl Database {
    fn link(&self) -> Result<AutopilotSettings, Failure> {
        let datum = self.moos_file.as_ref().map(|file| {
            datum_of(&text_of(file)?).map_err(because_of(format!("{} has no datum", file.display())))
        });
        Ok(AutopilotSettings::Moos {
            connect: self.connect.clone(),
            auvs: self.auv.clone(),
            datum: datum.transpose()?,
            is_raw: self.desired,
        })
    }
}

impl Dune {
    /// The link, which `asks` before departure whether DUNE takes FollowReference, and the names of
    /// AUVs.
    fn open(&self, asks: bool) -> (AutopilotSettings, Vec<String>) {
        let Self { connect, vehicle, auv, beacon, imc_id, headings } = self;
        let numbered = [vehicle].into_iter().chain(auv);
        let numbers: BTreeMap<u16, String> =
            numbered.filter_map(|(number, name)| Some(((*number)?, name.clone()))).collect();
        let auvs: Vec<String> = auv.iter().map(|(_, name)| name.clone()).collect();
        let names = auvs.iter().chain(beacon.iter().map(|(_, name)| name)).cloned().collect();
        let link = AutopilotSettings::Imc(ImcSettings {
            connect: connect.clone(),
            number: *imc_id,
            vehicle: vehicle.1.clone(),
            auvs,
            numbers,
            beacons: beacon.iter().cloned().collect(),
            headings: *headings,
            asks,
        });
        (link, names)
    }
}

impl Sensors {
    /// Settings with these sensors, and the AUVs in the modems' settings.
    fn open(&self) -> Result<(Settings, Vec<String>), Box<dyn Error>> {
        let (mut modems, mut names) = (vec![], vec![]);
        for (endpoint, file) in &self.modem {
            let settings = serde_json::from_str::<acoustics::Settings>(&text_of(file)?);
            let wrong = format!("{} cannot be read as the settings of a modem", file.display());
            let settings = settings.map_err(because_of(wrong))?;
            names.extend(settings.names.values().cloned());
            modems.push((endpoint.clone(), Modem::new(&settings)?));
        }
        let settings = Settings {
            nmea: self.nmea.clone(),
            own_mmsi: self.own_mmsi,
            modems,
            sigma_m: self.sigma,
            ..Settings::default()
        };
        Ok((settings, names))
    }
}

impl MissionFlags {
    fn mission(&self, mut auvs: Vec<String>) -> Result<MissionChoice, Box<dyn Error>> {
        let mut seen = BTreeSet::new();
        auvs.retain(|auv| seen.insert(auv.clone()));
        if let Some(id) = &self.mission {
            return Ok(MissionChoice::Joined(id.clone()));
        }
        let mut setup = match &self.setup {
            Some(file) => json_of(file)?,
            None => self.body(&auvs)?,
        };
        if let Some(live) = setup.get_mut("live") {
            self.routes.put_into(live)?;
            self.areas.put_into(live)?;
        }
        Ok(MissionChoice::named(self.name.clone(), setup))
    }

    /// The body of a mission with these AUVs.
    fn body(&self, auvs: &[String]) -> Result<Value, Box<dyn Error>> {
        let first = auvs.first().ok_or(
            "no AUV: name one with --auv or in a modem's settings, or give --setup FILE or --mission ID",
        )?;
        let goal = match (self.goal, auvs.len()) {
            (Some(Goal::Track), _) | (None, 1) => json!({ "kind": "track", "auv": first }),
            (Some(Goal::Intermittent), _) => {
                json!({ "kind": "intermittent", "auvs": auvs, "dwell_s": self.dwell, "epoch_s": 0.0 })
            }
            (Some(Goal::Midpoint), _) => json!({ "kind": "midpoint", "auvs": auvs }),
            (Some(Goal::Visit), _) => json!({ "kind": "visit", "auvs": auvs }),
            (Some(Goal::Localise), _) => {
                json!({ "kind": "localise", "auvs": auvs, "growth_m2ps": self.growth })
            }
            (None, _) => {
                let goals = "visit, localise, intermittent, midpoint, or track (the first AUV)";
                return Err(format!("several AUVs need a --goal: {goals}").into());
            }
        };
        let auvs: Vec<Value> = auvs.iter().map(|id| json!({ "id": id })).collect();
        let mut live = json!({ "auvs": auvs, "goal": goal, "period_s": self.period });
        if let Some(origin) = self.routes.origin()? {
            live["origin"] = json!(origin);
        }
        Ok(json!({ "schema_version": "1.0", "title": self.name, "live": live }))
    }

    /// The services at --url, or the bridge's own.
    async fn service(&self, config: &Config, clock: &Clock) -> Result<MissionClient, Box<dyn Error>> {
        let token = self.token_file.as_ref();
        let token = token.map(|file| TokenFile::read(file.clone()).map_err(unreadable(file)));
        let certificate = self.certificate.as_ref();
        let certificate = certificate.map(|file| fs::read(file).map_err(unreadable(file)));
        let (token, certificate) = (token.transpose()?, certificate.transpose()?);
        let urls =
            if self.url.is_empty() { vec![own_service(config, clock).await?] } else { self.url.clone() };
        let transport = Transport::http(clock, certificate.as_deref());
        let none = "the file of --certificate contains no certificate";
        let transport = transport.map_err(because_of(none))?;
        Ok(MissionClient::new(&urls, token, transport).of_craft(self.craft.clone()))
    }
}

/// Starts a service on a free port of this machine and returns its URL. The program ends with it.
async fn own_service(config: &Config, clock: &Clock) -> Result<String, &'static str> {
    let config = config.on_any_loopback_port();
    let (sender, url) = oneshot::channel();
    clock.spawn_blocking(move || {
        let served = serve_and(&config, HangUp::Reloads, |address, has_tls| {
            let scheme = if has_tls { "https" } else { "http" };
            // The receiver waits for it.
            let _ = sender.send(format!("{scheme}://{address}"));
        });
        match served {
            Ok(()) => process::exit(0),
            Err(error) => {
                tracing::error!(error = &*error, "the bridge's own service stopped");
                process::exit(1);
            }
        }
    });
    let Ok(Ok(url)) = clock.timeout(START, url).await else {
        return Err("the bridge's own service did not start");
    };
    tracing::info!(url, "the bridge's own service keeps the mission; open it in a browser");
    Ok(url)
}

fn json_of(file: &Path) -> Result<Value, Failure> {
    let json = serde_json::from_str(&text_of(file)?);
    json.map_err(because_of(format!("{} is not JSON", file.display())))
}

fn text_of(file: &Path) -> Result<String, Failure> {
    let text = fs::read_to_string(file).map_err(unreadable(file))?;
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}

fn unreadable(file: &Path) -> impl FnOnce(io::Error) -> Failure {
    because_of(format!("{} cannot be read", file.display()))
}

/// The number of a system of IMC, decimal or with 0x.
fn system_number(text: &str) -> Result<u16, &'static str> {
    let number =
        text.strip_prefix("0x").map_or_else(|| text.parse(), |digits| u16::from_str_radix(digits, 16));
    let number = number.ok().filter(|number| (1..u16::MAX).contains(number));
    number.ok_or("write a number from 1 to 65534, such as 0x001e")
}

fn numbered(text: &str) -> Result<(Option<u16>, String), &'static str> {
    let (number, name) = text.rsplit_once('=').map_or((None, text), |(number, name)| (Some(number), name));
    if name.is_empty() {
        return Err("write a name, such as lauv-1, or a number and a name, such as 0x001e=lauv-1");
    }
    Ok((number.map(system_number).transpose()?, name.to_owned()))
}

fn named_system(text: &str) -> Result<(u8, String), &'static str> {
    let named = text.split_once('=').filter(|(_, name)| !name.is_empty());
    let named = named.and_then(|(number, name)| Some((number.parse().ok()?, name.to_owned())));
    named.ok_or("write its system number and its name, such as 2=auv-1")
}

/// The wire to a MOOSDB, which answers on no other.
fn stream(text: &str) -> Result<Endpoint, String> {
    match text.parse().map_err(|error: InvalidEndpoint| error.to_string())? {
        database @ Endpoint::Tcp(_) => Ok(database),
        other => Err(format!("a MOOSDB does not answer on {other}: write tcp:HOST:PORT")),
    }
}

fn wire_and_file(text: &str) -> Result<(Endpoint, PathBuf), String> {
    let both = text.rsplit_once('=');
    let (wire, file) =
        both.ok_or("write its wire and its settings file, such as tcp:192.168.0.209:9200=usbl.json")?;
    let endpoint = wire.parse().map_err(|error: InvalidEndpoint| error.to_string())?;
    Ok((endpoint, file.into()))
}

fn within(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (least..=most).contains(number));
    number.ok_or_else(|| format!("must be a number from {least} to {most}"))
}
