//! Writes a reference for an autopilot.

use std::f64::consts::TAU;

use super::sentence::checksum;
use crate::reference::Reference;

/// Talker: integrated navigation.
const TALKER: &str = "IN";
/// Steps of a written heading in a turn: 0.1°, as in heading sentences (xxx.x).
const HEADING_STEPS: f64 = 3600.0;
const STEPS_PER_DEGREE: f64 = 10.0;

/// `reference` in four sentences, each with its checksum and line end: HTC, HTD, APB and `$PPLTF`.
///
/// Headings are true, degrees in [0, 360), to 0.1°. Autopilots follow the sentence that they know.
///
/// ```text
/// $INHTC,V,,,H,N,,,,,045.0,,,T,C*hh                          heading/track control command
/// $INHTD,V,,,H,N,,,,,045.0,,,T,,,,*hh                        heading/track control data
/// $INAPB,A,A,0.00,R,N,V,V,045.0,T,PLAN,045.0,T,045.0,T,A*hh  autopilot sentence B
/// $PPLTF,045.0,T,1.50,M*hh                                   heading and speed, m/s
/// ```
///
/// - HTC and HTD: no override, steering mode H (the commanded heading comes from elsewhere), turns
///   not limited, heading-to-steer in field 10, true (T) in field 13. HTC is the command in IEC
///   61162-1 and HTD the controller's answer: both are written, for autopilots that read HTD only.
///   The statuses in HTD are the controller's own and empty. Source: IEC 61162-1; Furuno VR-3000
///   operator's manual, page 31 (HTD).
/// - APB: no cross-track error, not arrived, and all three bearings are the heading. Autopilots
///   steer different ones (gpsd, "NMEA Revealed", APB), and correct the cross-track error. pypilot
///   takes a true bearing as course over ground.
/// - `$PPLTF`: our own, because no standard sentence commands a speed. VTG and VHW would count as
///   measurements; PRC is the position of a lever, and Maritime Robotics' `$PMARCRS` commands a
///   course.
pub fn heading_and_speed_sentences(reference: &Reference) -> String {
    let Reference { speed, heading } = *reference;
    debug_assert!(speed.is_finite() && heading.is_finite(), "references are finite");
    // Never astern; `+ 0.0` as below.
    let (heading, speed) = (degrees_true(heading), speed.max(0.0) + 0.0);
    let heading_control = format!("V,,,H,N,,,,,{heading},,,T");
    [
        format!("{TALKER}HTC,{heading_control},C"),
        format!("{TALKER}HTD,{heading_control},,,,"),
        format!("{TALKER}APB,A,A,0.00,R,N,V,V,{heading},T,PLAN,{heading},T,{heading},T,A"),
        format!("PPLTF,{heading},T,{speed:.2},M"),
    ]
    .map(|payload| format!("${payload}*{:02X}\r\n", checksum(payload.as_bytes())))
    .concat()
}

/// Degrees in [0, 360): rounded first, so that just west of north is 000.0 and never 360.0.
fn degrees_true(heading: f64) -> String {
    // `+ 0.0` turns −0.0 into 0.0: otherwise the sign is written.
    let steps = (heading / TAU * HEADING_STEPS).round().rem_euclid(HEADING_STEPS) + 0.0;
    format!("{:05.1}", steps / STEPS_PER_DEGREE)
}
