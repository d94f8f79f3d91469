//! Runs the NMEA 0183 adapter on lines of standard input, for tests in other languages.
//!
//! ```text
//! nmea_for_tests read RECEIVED_S   sentences in; measurements and rejects out, JSON
//! nmea_for_tests write             "heading_rad speed_mps" a line in, sentences out
//! ```

use std::error::Error;
use std::io::{self, BufRead as _, Write as _};

use pilotfish_bridge::nmea::{NmeaReader, heading_and_speed_sentences};
use pilotfish_bridge::reference::Reference;
use pilotfish_bridge::{CraftMeasurement, Measurement, VesselFix, VesselMessage};
use serde_json::{Map, Value, json};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["read", received_s] => read(received_s.parse()?),
        ["write"] => write(),
        _ => Err("usage: nmea_for_tests read RECEIVED_S | nmea_for_tests write".into()),
    }
}

fn read(received_s: f64) -> Result<(), Box<dyn Error>> {
    let mut reader = NmeaReader::default();
    let mut out = io::stdout().lock();
    for (number, line) in io::stdin().lock().split(b'\n').enumerate() {
        let mut line = line?;
        line.push(b'\n');
        for measurement in reader.push(&line, received_s) {
            let read = match measurement {
                Measurement::Craft { t_s, measured, .. } => {
                    let (kind, values) = described(measured);
                    json!({"line": number, "t_s": t_s, "kind": kind, "values": values})
                }
                Measurement::Vessel(message) => vessel(number, &message),
                Measurement::Auv(_) => continue,
            };
            writeln!(out, "{read}")?;
        }
    }
    let counts: Map<String, Value> =
        reader.rejects().iter().map(|(reason, times)| (reason.to_owned(), times.into())).collect();
    writeln!(out, "{}", json!({"refused": counts}))?;
    Ok(())
}

fn vessel(line: usize, message: &VesselMessage) -> Value {
    let VesselMessage { mmsi, is_own, fix, name, dimensions } = message;
    let fix = fix.map(|fix| {
        let VesselFix { position, course, speed, heading, status, .. } = fix;
        json!([position.lat_deg, position.lon_deg, course, speed, heading, status])
    });
    json!({"line": line, "kind": "vessel", "mmsi": mmsi, "own": is_own, "fix": fix, "name": name, "dimensions": dimensions})
}

fn described(measured: CraftMeasurement) -> (&'static str, Vec<f64>) {
    match measured {
        CraftMeasurement::Position(position) => ("position_deg", vec![position.lat_deg, position.lon_deg]),
        CraftMeasurement::GroundVelocity(velocity) => ("ground_velocity_mps", vec![velocity.x, velocity.y]),
        CraftMeasurement::GroundSpeed(speed) => ("ground_speed_mps", vec![speed]),
        CraftMeasurement::Heading(heading) => ("heading_rad", vec![heading]),
        CraftMeasurement::YawRate(rate) => ("yaw_rate_radps", vec![rate]),
        CraftMeasurement::WaterVelocity(velocity) => ("water_velocity_mps", vec![velocity.x, velocity.y]),
    }
}

fn write() -> Result<(), Box<dyn Error>> {
    let mut out = io::stdout().lock();
    for line in io::stdin().lock().lines() {
        let line = line?;
        let (heading, speed) = line.split_once(' ').ok_or("a heading and a speed a line")?;
        let reference = Reference { heading: heading.parse()?, speed: speed.parse()? };
        out.write_all(heading_and_speed_sentences(&reference).as_bytes())?;
    }
    Ok(())
}
