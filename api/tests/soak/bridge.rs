//! A boat whose bridge or service is killed, with real processes and sockets. Voyages
//! (`tests/voyage.rs`) test in simulated time what a bridge may send, and when.
//!
//! A stand-in of the autopilot's rules ([`tests::autopilot`]) always sails the mission, and
//! ArduPilot's Rover does if `PILOTFISH_ARDUROVER` is the path of its simulator:
//!
//! ```text
//! PILOTFISH_ARDUROVER=~/ardupilot/build/sitl/bin/ardurover \
//!     cargo test -p pilotfish --test soak bridge -- --nocapture
//! ```

use std::io::Write as _;
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use std::{env, thread};

use mavlink::MavlinkReader;
use mavlink::dialects::ardupilotmega::{
    COMMAND_LONG_DATA, MavCmd, MavMessage, MavModeFlag, MavParamType, PARAM_SET_DATA,
};
use mavlink::types::CharArray;
use nalgebra::Vector2;
use serde_json::Value;
use tests::{
    autopilot::{Boat, GUIDED, HOLD, ORIGIN, SYSTEM, frame, place},
    server::Server,
};

use crate::command::{ask, has_all, pilotfish, serving};
use crate::kill::record_at;

/// The AUV's speed to the north, m/s, and its first position (north, east), m.
const AUV_SPEED: f64 = 0.6;
const AUV_START: [f64; 2] = [20.0, 5.0];
/// Greatest distance of a boat that follows, m.
const NEAR: f64 = 2.0;
/// A longer wait fails the test.
const PATIENCE: Duration = Duration::from_secs(90);

/// A boat that the test observes, and on which it plays a person.
trait Craft {
    /// The bridge's address of the boat.
    fn endpoint(&self) -> String;
    /// (north, east), m from [`ORIGIN`].
    fn position(&mut self) -> Vector2<f64>;
    /// Speed over ground, m/s.
    fn speed(&mut self) -> f64;
    /// A person sets the mode.
    fn set_mode(&mut self, mode: u32);
    /// `true` if the boat is in that mode, and armed.
    fn is_guided_and_armed(&mut self) -> bool;
    /// Takes an AUV's messages, ten times a second.
    fn hear(&mut self, position: &Vector2<f64>, velocity: &Vector2<f64>);
}

/// The boat of [`tests::autopilot`] behind a socket, with one client at a time.
struct StandIn {
    boat: Boat,
    current: Vector2<f64>,
    listener: TcpListener,
    client: Option<(TcpStream, MavlinkReader<TcpStream>)>,
    began: Instant,
    sailed: Instant,
    step: u64,
}

impl StandIn {
    /// In a current (north, east), m/s.
    fn moored(current: Vector2<f64>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        listener.set_nonblocking(true).expect("the listener can be asked");
        Self {
            boat: Boat::moored(),
            current,
            listener,
            client: None,
            began: Instant::now(),
            sailed: Instant::now(),
            step: 0,
        }
    }
}

impl Craft for StandIn {
    fn endpoint(&self) -> String {
        format!("tcp:{}", self.listener.local_addr().expect("it listens"))
    }

    fn position(&mut self) -> Vector2<f64> {
        self.boat.position
    }

    fn speed(&mut self) -> f64 {
        self.boat.speed
    }

    fn set_mode(&mut self, mode: u32) {
        self.boat.mode = mode;
    }

    fn is_guided_and_armed(&mut self) -> bool {
        self.boat.mode == GUIDED && self.boat.is_armed
    }

    /// Sails until now, and reports that.
    fn hear(&mut self, position: &Vector2<f64>, velocity: &Vector2<f64>) {
        if let Ok((stream, _)) = self.listener.accept() {
            stream.set_read_timeout(Some(Duration::from_millis(1))).expect("a time-out");
            let reader = MavlinkReader::new(stream.try_clone().expect("a second handle"));
            self.client = Some((stream, reader));
        }
        let (now, mut answers) = (Instant::now(), vec![]);
        let t_s = now.duration_since(self.began).as_secs_f64();
        if let Some((_, reader)) = &mut self.client {
            while let Ok((header, message)) = reader.read_any_message::<MavMessage>() {
                if header.component_id != 1 {
                    self.boat.take(&message, t_s, &mut answers);
                }
            }
        }
        let dt = now.duration_since(self.sailed).as_secs_f64();
        self.boat.step(t_s, dt, &self.current);
        let mut said = self.boat.messages(STEPS * self.step, &self.current);
        said.append(&mut answers);
        let mut bytes: Vec<u8> = said.iter().flat_map(|message| frame(SYSTEM, message)).collect();
        bytes.extend(frame(AUV, &place(position, velocity, None)));
        if let Some((stream, _)) = &mut self.client
            && stream.write_all(&bytes).is_err()
        {
            self.client = None;
        }
        (self.sailed, self.step) = (now, self.step + 1);
    }
}

/// Variable with the path of ArduPilot's Rover.
const ARDUROVER: &str = "PILOTFISH_ARDUROVER";
/// The AUV's system.
const AUV: u32 = 101;
/// Steps of [`Boat::messages`] between two calls of [`Craft::hear`].
const STEPS: u64 = 5;

/// `pilotfish bridge`, killed when dropped.
struct Bridge(Child);

impl Drop for Bridge {
    fn drop(&mut self) {
        // It may be over.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn bridge(endpoint: &str, address: &str, flags: &[&str]) -> Bridge {
    let craft = format!("bridge mavlink --connect {endpoint} --auv 101=auv-1 --sigma 0.1");
    let service = format!("--url http://{address} --name rehearsal");
    let mut program = pilotfish();
    program.args(craft.split(' ')).args(service.split(' ')).args(flags);
    program.env("PILOTFISH_LOG", "warn").stdout(Stdio::null());
    Bridge(program.spawn().expect("the program starts"))
}

/// Sends the AUV's position ten times a second. Returns `true` if `until` came true in time.
fn sail(
    craft: &mut dyn Craft,
    start: Instant,
    limit: Duration,
    mut until: impl FnMut(&mut dyn Craft) -> bool,
) -> bool {
    let end = Instant::now() + limit;
    while Instant::now() < end {
        craft.hear(&auv(start), &Vector2::new(AUV_SPEED, 0.0));
        if until(craft) {
            return true;
        }
        thread::sleep(Duration::from_millis(100));
    }
    false
}

fn auv(start: Instant) -> Vector2<f64> {
    let [north, east] = AUV_START;
    Vector2::new(north + AUV_SPEED * start.elapsed().as_secs_f64(), east)
}

/// Fails with `otherwise` if the boat does not come near its AUV.
#[track_caller]
fn comes_near(craft: &mut dyn Craft, start: Instant, otherwise: &str) {
    let is_near = |craft: &mut dyn Craft| (craft.position() - auv(start)).norm() < NEAR;
    assert!(sail(craft, start, PATIENCE, is_near), "{otherwise}");
}

fn for_seconds(craft: &mut dyn Craft, start: Instant, seconds: f64) {
    sail(craft, start, Duration::from_secs_f64(seconds), |_| false);
}

/// Names of the missions, newest first.
fn missions(server: &Server) -> Vec<String> {
    let list = ask(server, "GET", "/v1/missions", "").json();
    let missions = list["missions"].as_array().expect("a list").iter();
    let name = |mission: &Value| mission["id"].as_str().expect("a name").to_owned();
    missions.map(name).collect()
}

/// The bridge's notes in the mission's log.
fn notes(server: &Server, mission: &str) -> Vec<String> {
    let events = record_at(&format!("{}/v1/missions/{mission}", server.url()));
    let notes = events.iter().filter_map(|event| event["heard"]["notes"].as_array());
    let text = |note: &Value| note["text"].as_str().expect("a text").to_owned();
    notes.flatten().map(text).collect()
}

/// The mission of both boats: the boat approaches, a person takes over and hands back, the bridge
/// is killed and restarted. Returns the second bridge and the start of the mission.
fn follow_through_a_take_over_and_a_kill(craft: &mut dyn Craft, server: &Server) -> (Bridge, Instant) {
    let address = &server.address;
    let start = Instant::now();
    let first = bridge(&craft.endpoint(), address, &["--take-control"]);
    comes_near(craft, start, "it does not approach");

    craft.set_mode(HOLD);
    for_seconds(craft, start, 6.0);
    assert!(!craft.is_guided_and_armed(), "the bridge took the craft back");
    assert!(craft.speed() < 0.5, "a boat on hold still moves");
    craft.set_mode(GUIDED);
    comes_near(craft, start, "it does not follow when it is handed back");

    drop(first);
    for_seconds(craft, start, 8.0);
    assert!(craft.speed() < 0.5, "nothing stops it, at {} m/s", craft.speed());
    let second = bridge(&craft.endpoint(), address, &[]);
    comes_near(craft, start, "a second bridge does not continue");

    says_in_the_log(
        server,
        &["the guided mode is ordered", "references are sent", "a person or a failsafe has the craft"],
    );
    (second, start)
}

/// Restarts make no second mission, and the log has all notes.
fn says_in_the_log(server: &Server, texts: &[&str]) {
    let missions = missions(server);
    assert_eq!(missions.len(), 1, "a restart made a mission of its own");
    has_all(&notes(server, &missions[0]).join("\n"), texts);
}

#[test]
fn a_boat_follows_its_auv_through_a_take_over_and_kills_of_bridge_and_service() {
    let mut server = serving(&[]);
    let data = server.data.take().expect("has a directory of its own");
    let port = server.port();
    let mut boat = StandIn::moored(Vector2::new(-0.1, 0.2));
    let (_bridge, start) = follow_through_a_take_over_and_a_kill(&mut boat, &server);
    drop(server);
    // A plan may be followed for ten seconds; then the autopilot's own time-out stops the boat.
    for_seconds(&mut boat, start, 17.0);
    assert!(boat.speed() < 0.1, "{} m/s without a plan", boat.speed());
    let mut program = pilotfish();
    program.arg("--data").arg(data.path());
    let server = Server::start_on(program, port);
    comes_near(&mut boat, start, "it does not follow when the service is back");
    says_in_the_log(
        &server,
        &["the service does not answer", "the service answers again", "the plan is too old"],
    );
    // One for the mode, one to arm, and none after them.
    assert_eq!(boat.boat.orders, 2);
}

/// ArduPilot's Rover in its own simulator.
struct ArduPilot {
    process: Child,
    _folder: tempfile::TempDir,
    watch: MavlinkReader<TcpStream>,
    orders: TcpStream,
    seen: (Vector2<f64>, f64, u32, bool),
}

/// First port of instance 7: a running simulator has 5760.
const ARDUPILOT_PORT: u16 = 5760 + 70;
/// Parameters of a plain hull with one rudder and one thruster.
const ARDUPILOT_PARAMETERS: &str = "FRAME_CLASS 2\nWP_SPEED 2\nCRUISE_SPEED 5\nCRUISE_THROTTLE 30\nATC_SPEED_P 0.1\n\
    ATC_STR_RAT_FF 0.75\nRC1_MIN 1000\nRC1_MAX 2000\nRC3_MIN 1000\nRC3_MAX 2000\nSERVO1_MIN 1000\nSERVO1_MAX 2000\n\
    SERVO3_MIN 1000\nSERVO3_MAX 2000\nSIM_TIDE_SPEED 0.2\nSIM_TIDE_DIR 45\nSIM_WIND_SPD 0\nLOG_BACKEND_TYPE 0\nARMING_CHECK 0\n";

impl ArduPilot {
    fn start(program: &str) -> Self {
        let folder = tempfile::tempdir().expect("there is room");
        let parameters = folder.path().join("boat.parm");
        std::fs::write(&parameters, ARDUPILOT_PARAMETERS).expect("is written");
        let [lat, lon] = ORIGIN;
        let process = Command::new(program)
            .args("--model motorboat --speedup 10 -I 7 --sysid 8 --wipe --serial0 tcp:0".split(' '))
            .args(["--home", &format!("{lat},{lon},1,90"), "--defaults"])
            .arg(&parameters)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("PILOTFISH_ARDUROVER is a program");
        let connected = |port| {
            let end = Instant::now() + PATIENCE;
            loop {
                match TcpStream::connect(("127.0.0.1", port)) {
                    Ok(stream) => return stream,
                    Err(error) if Instant::now() > end => panic!("the simulator does not listen: {error}"),
                    Err(_) => thread::sleep(Duration::from_millis(200)),
                }
            }
        };
        let orders = connected(ARDUPILOT_PORT + 2);
        let watch = orders.try_clone().expect("a second handle");
        watch.set_read_timeout(Some(Duration::from_millis(5))).expect("a time-out");
        let mut craft = Self {
            process,
            _folder: folder,
            watch: MavlinkReader::new(watch),
            orders,
            seen: (Vector2::zeros(), 0.0, 0, false),
        };
        // A minute of simulated time at ten times the speed: its filter has settled.
        for _ in 0..80 {
            thread::sleep(Duration::from_millis(100));
            craft.look();
        }
        let mut name = [0; 16];
        name[..11].copy_from_slice(b"SIM_SPEEDUP");
        craft.order(&MavMessage::PARAM_SET(PARAM_SET_DATA {
            param_value: 1.0,
            target_system: 8,
            target_component: 1,
            param_id: CharArray::new(name),
            param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
        }));
        craft.command(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, [33.0, 100_000.0]);
        craft
    }

    fn order(&mut self, message: &MavMessage) {
        self.orders.write_all(&frame(255, message)).expect("the simulator lives");
    }

    fn command(&mut self, command: MavCmd, [param1, param2]: [f32; 2]) {
        self.order(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            param1,
            param2,
            command,
            target_system: 8,
            target_component: 1,
            ..COMMAND_LONG_DATA::DEFAULT
        }));
    }

    fn look(&mut self) {
        while let Ok((header, message)) = self.watch.read_any_message::<MavMessage>() {
            if header.system_id != 8 {
                continue;
            }
            match message {
                MavMessage::HEARTBEAT(beat) => {
                    self.seen.2 = beat.custom_mode;
                    self.seen.3 = beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED);
                }
                MavMessage::GLOBAL_POSITION_INT(at) => {
                    let [lat, lon] = ORIGIN;
                    let metres = 111_319.5;
                    self.seen.0 = Vector2::new(
                        (f64::from(at.lat) * 1e-7 - lat) * metres,
                        (f64::from(at.lon) * 1e-7 - lon) * metres * lat.to_radians().cos(),
                    );
                    self.seen.1 = 0.01 * f64::from(at.vx).hypot(f64::from(at.vy));
                }
                _ => {}
            }
        }
    }
}

impl Drop for ArduPilot {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Craft for ArduPilot {
    fn endpoint(&self) -> String {
        format!("tcp:127.0.0.1:{ARDUPILOT_PORT}")
    }

    fn position(&mut self) -> Vector2<f64> {
        self.look();
        self.seen.0
    }

    fn speed(&mut self) -> f64 {
        self.look();
        self.seen.1
    }

    fn set_mode(&mut self, mode: u32) {
        self.command(MavCmd::MAV_CMD_DO_SET_MODE, [1.0, mode as f32]);
    }

    fn is_guided_and_armed(&mut self) -> bool {
        self.look();
        self.seen.2 == GUIDED && self.seen.3
    }

    fn hear(&mut self, position: &Vector2<f64>, velocity: &Vector2<f64>) {
        let said = frame(AUV, &place(position, velocity, None));
        self.orders.write_all(&said).expect("the simulator lives");
    }
}

#[test]
fn ardupilots_rover_follows_its_auv_through_a_take_over_and_a_kill() {
    let Ok(program) = env::var(ARDUROVER) else {
        println!("skipped: PILOTFISH_ARDUROVER names no simulator of ArduPilot's Rover");
        return;
    };
    let server = serving(&[]);
    let mut boat = ArduPilot::start(&program);
    follow_through_a_take_over_and_a_kill(&mut boat, &server);
}
