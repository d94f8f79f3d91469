//! Holds a heading over ROS 2, and prints what it hears: `.ci/ros2` runs it against `rclpy`.
//!
//! ```text
//! ros2_echo SPEED_MPS HEADING_DEG --ros-args -p craft:=medusa -p origin.lat_deg:=38.41 -p origin.lon_deg:=-9.12
//! ```
//!
//! Each measurement is a line of JSON on the standard output. The plan leads straight ahead from the craft and is made
//! anew every second. Ends when the standard input does, with a line of what was refused.

use std::{
    env, fs,
    io::{self, Read as _},
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use geodesy::{Datum, Origin, direction};
use pilotfish_bridge::{
    AuvFix, CraftMeasurement, Geographic, Measurement,
    reference::{PlannedReference, Reference, Stage, wrapped},
    ros2::{Arguments, Ros2Error, Ros2Wire, Settings},
};
use serde_json::{Value, json};

/// Faster than the messages of the test, slower than a busy loop.
const PERIOD: Duration = Duration::from_millis(20);

/// Stages of the plan, and s between them.
const STAGES: u32 = 3;
const STAGE_S: f64 = 5.0;

fn main() {
    let arguments = Arguments::parse(env::args().skip(1));
    if let Err(error) = arguments.and_then(|arguments| run(&arguments)) {
        eprintln!("ros2_echo: {error}");
        std::process::exit(1);
    }
}

fn run(arguments: &Arguments) -> Result<(), Ros2Error> {
    let environment = |name: &str| env::var(name).ok();
    let settings = Settings::new(arguments, environment, |path| fs::read_to_string(path))?;
    let mut numbers = arguments
        .others
        .iter()
        .filter_map(|text| text.parse::<f64>().ok());
    let (Some(speed), Some(heading_deg)) = (numbers.next(), numbers.next()) else {
        return Err(Ros2Error::Argument {
            argument: "SPEED_MPS HEADING_DEG".to_owned(),
            expected: "what to hold, and then what is for ROS",
        });
    };
    let reference = Reference {
        speed,
        heading: wrapped(heading_deg.to_radians()),
    };
    let mut wire = Ros2Wire::new(settings)?;
    let mut plan: Option<PlannedReference> = None;
    listen_for_the_end();
    while !ENDED.load(Ordering::Relaxed) {
        let now_s = unix_time_s();
        for measurement in wire.poll(now_s) {
            println!("{}", line(&measurement));
            let Measurement::Craft {
                measured: CraftMeasurement::Position(position),
                ..
            } = measurement
            else {
                continue;
            };
            if plan.as_ref().is_none_or(|plan| plan.planned_s + 1.0 <= now_s) {
                plan = Some(straight_ahead(position, reference, now_s));
            }
        }
        if let Some(plan) = &plan {
            wire.publish(&reference, plan, now_s);
        }
        thread::sleep(PERIOD);
    }
    let refused: serde_json::Map<String, Value> = wire
        .refused()
        .iter()
        .map(|(reason, times)| (reason.to_owned(), times.into()))
        .collect();
    println!("{}", json!({ "refused": refused }));
    Ok(())
}

static ENDED: AtomicBool = AtomicBool::new(false);

/// Waits for the end of the standard input, on a thread of its own.
fn listen_for_the_end() {
    thread::spawn(|| {
        let mut ignored = Vec::new();
        // However it ends, it has ended.
        let _ = io::stdin().read_to_end(&mut ignored);
        ENDED.store(true, Ordering::Relaxed);
    });
}

fn straight_ahead(from: Geographic, reference: Reference, planned_s: f64) -> PlannedReference {
    let here = Origin {
        latitude: from.lat_deg.to_radians(),
        longitude: from.lon_deg.to_radians(),
    };
    let datum = Datum::new(&here).expect("was measured on Earth");
    let stages = (1..=STAGES).map(|stage| {
        let ahead_s = STAGE_S * f64::from(stage);
        let position = direction(reference.heading) * (reference.speed * ahead_s);
        let place = datum.from_local(&position);
        Stage {
            t_s: planned_s + ahead_s,
            position,
            geographic: Geographic::new(place.latitude.to_degrees(), place.longitude.to_degrees()),
            reference,
        }
    });
    PlannedReference {
        planned_s,
        first: reference,
        stages: stages.collect(),
        lags: [0.0, 0.0],
        current: nalgebra::Vector2::zeros(),
        valid_until_s: planned_s + STAGE_S * f64::from(STAGES),
    }
}

fn line(measurement: &Measurement) -> Value {
    match measurement {
        Measurement::Craft { t_s, measured } => {
            let (name, value) = match measured {
                CraftMeasurement::Position(place) => ("position", json!([place.lat_deg, place.lon_deg])),
                CraftMeasurement::GroundVelocity(v) => ("ground_velocity", json!([v.x, v.y])),
                CraftMeasurement::WaterVelocity(v) => ("water_velocity", json!([v.x, v.y])),
                CraftMeasurement::Heading(heading) => ("heading", json!(heading)),
                CraftMeasurement::YawRate(rate) => ("yaw_rate", json!(rate)),
            };
            json!({ "t_s": t_s, "craft": name, "value": value })
        }
        Measurement::Auv(AuvFix {
            auv,
            t_s,
            position,
            sigma_m,
            depth_m,
            ground_velocity,
        }) => json!({
            "t_s": t_s,
            "auv": auv,
            "position": [position.lat_deg, position.lon_deg],
            "sigma_m": sigma_m,
            "depth_m": depth_m,
            "ground_velocity": ground_velocity.map(|v| [v.x, v.y]),
        }),
    }
}

fn unix_time_s() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.expect("the clock is past 1970").as_secs_f64()
}
