//! A small world: modems print the known position of an AUV, and the adapters must find it.
//!
//! The second route to every position: Earth-centred coordinates of craft and AUV. Matrices written
//! out here turn their difference into the craft's tangent plane and body; modems print that.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

use super::super::mounting::Mounting;
use super::super::{
    CraftPose, Frame, KnownDepth, Modem, ModemKind, PoseHistory, Settings, seatrac, sentences,
};
use crate::{AuvFix, Origin};

const C: f64 = 1487.0;
const RECEIVED_S: f64 = 1_779_500_000.0;
const DECLINATION: f64 = -0.21;
/// Depth of the transducer below the antenna and below the surface.
const TRANSDUCER_DEPTH: f64 = 1.6;

fn earth_centred(lat_deg: f64, lon_deg: f64, height: f64) -> Vector3<f64> {
    let (a, f) = (6_378_137.0, 1.0 / 298.257_223_563);
    let e2: f64 = f * (2.0 - f);
    let ((sin, cos), (sin_l, cos_l)) = (lat_deg.to_radians().sin_cos(), lon_deg.to_radians().sin_cos());
    let n = a / (1.0 - e2 * sin * sin).sqrt();
    Vector3::new((n + height) * cos * cos_l, (n + height) * cos * sin_l, (n * (1.0 - e2) + height) * sin)
}

/// Rows north, east, down of the tangent plane.
fn tangent(lat_deg: f64, lon_deg: f64) -> Matrix3<f64> {
    let ((s, c), (sl, cl)) = (lat_deg.to_radians().sin_cos(), lon_deg.to_radians().sin_cos());
    Matrix3::new(-s * cl, -s * sl, c, -sl, cl, 0.0, -c * cl, -c * sl, -s)
}

fn about_z(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

fn about_y(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

fn about_x(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

#[derive(Clone, Debug)]
struct World {
    craft: CraftPose,
    mounting: Mounting,
    auv: Origin,
    depth: f64,
}

fn world() -> impl Strategy<Value = World> {
    let place = prop_oneof![
        Just((0.0_f64, 0.0_f64)),
        Just((38.4, -9.1)),
        Just((60.0, 5.0)),
        Just((-72.0, 120.0)),
        Just((60.0, 179.9999)),
        Just((-17.0, -179.9999)),
    ];
    let attitude = (-PI..PI, -0.2..0.2, -0.2..0.2);
    let lever = (-8.0..8.0, -3.0..3.0, 0.0..3.0, -PI..PI, -0.1..0.1, -0.1..0.1);
    // Steep enough for a depth to intersect the line of sight at each attitude above.
    let auv = (10.0..40.0, -PI..PI, 15.0..60.0);
    (place, attitude, lever, auv).prop_map(|((lat_deg, lon_deg), (heading, pitch, roll), lever, auv)| {
        let (distance, bearing, depth): (f64, f64, f64) = auv;
        let (north, east) = (distance * bearing.cos(), distance * bearing.sin());
        // Approximate: the world must know the position, not the distance.
        let lat = lat_deg + north / 111_000.0;
        let lon = lon_deg + east / (111_000.0 * lat_deg.to_radians().cos());
        World {
            craft: CraftPose { position: Origin { lat_deg, lon_deg }, heading, roll, pitch },
            mounting: Mounting {
                forward_m: lever.0,
                starboard_m: lever.1,
                down_m: lever.2,
                heading_offset_rad: lever.3,
                pitch_offset_rad: lever.4,
                roll_offset_rad: lever.5,
                depth_m: Some(TRANSDUCER_DEPTH),
            },
            auv: Origin { lat_deg: lat, lon_deg: (lon + 180.0).rem_euclid(360.0) - 180.0 },
            depth,
        }
    })
}

impl World {
    fn body(&self) -> Matrix3<f64> {
        about_z(self.craft.heading) * about_y(self.craft.pitch) * about_x(self.craft.roll)
    }

    /// North, east, down from the transducer to the AUV.
    fn sight(&self) -> Vector3<f64> {
        let (craft, mounting) = (self.craft.position, &self.mounting);
        let lever = Vector3::new(mounting.forward_m, mounting.starboard_m, mounting.down_m);
        // Depth and height refer to the same surface.
        let antenna_height = (self.body() * lever).z - TRANSDUCER_DEPTH;
        let antenna = earth_centred(craft.lat_deg, craft.lon_deg, antenna_height);
        let auv = earth_centred(self.auv.lat_deg, self.auv.lon_deg, -self.depth);
        tangent(craft.lat_deg, craft.lon_deg) * (auv - antenna) - self.body() * lever
    }

    /// Forward, starboard, down of the transducer.
    fn local(&self) -> Vector3<f64> {
        let mounting = &self.mounting;
        let in_craft = about_z(mounting.heading_offset_rad)
            * about_y(mounting.pitch_offset_rad)
            * about_x(mounting.roll_offset_rad);
        (self.body() * in_craft).transpose() * self.sight()
    }

    fn settings(&self, modem: ModemKind) -> Settings {
        Settings {
            modem,
            names: [("3".to_owned(), "auv-c".to_owned())].into(),
            mounting: Some(self.mounting),
            sound_speed_mps: C,
            sigma_m: Some(4.0),
            magnetic_declination_rad: DECLINATION,
        }
    }

    /// The adapter's fix from `text`, with the craft here only at `arrival_s`.
    fn fix(&self, modem: ModemKind, text: &str, arrival_s: f64) -> AuvFix {
        let mut modem = Modem::new(&self.settings(modem)).expect("is usable");
        let known = KnownDepth { t_s: arrival_s, depth_m: self.depth, sigma_m: 0.1 };
        modem.note_depth("auv-c", known);
        let mut poses = PoseHistory::default();
        let mut elsewhere = self.craft;
        elsewhere.position.lat_deg += 0.001;
        elsewhere.heading += 0.1;
        // Rounding changes the time by less than a microsecond and the pose by less than 0.2 mm.
        for (t_s, pose) in
            [(arrival_s - 1.0, elsewhere), (arrival_s, self.craft), (arrival_s + 1.0, elsewhere)]
        {
            poses.push(t_s, pose);
        }
        let mut fixes = modem.push(text.as_bytes(), RECEIVED_S, &poses);
        let fix = fixes.pop().unwrap_or_else(|| panic!("{text}: {}", modem.rejects));
        assert_eq!((fix.auv.as_str(), fixes.len()), ("auv-c", 0));
        fix
    }

    /// Horizontal distance from the truth, m.
    fn error(&self, fix: &AuvFix) -> f64 {
        let place = |at: &Origin| earth_centred(at.lat_deg, at.lon_deg, 0.0);
        (place(&fix.position) - place(&self.auv)).norm()
    }

    /// Within 1 cm, at the right depth, sent one travel time before it arrived.
    fn check(&self, fix: &AuvFix, sent_s: f64, tolerance: f64) -> Result<(), TestCaseError> {
        let error = self.error(fix);
        prop_assert!(error < tolerance, "{error} m from the truth");
        prop_assert!((fix.depth_m.expect("is known") - self.depth).abs() < tolerance);
        prop_assert!((fix.t_s - sent_s).abs() < 1e-3, "{} s", fix.t_s - sent_s);
        Ok(())
    }
}

fn evologics(body: &str) -> String {
    format!("+++AT:{}:{body}\r\n", body.len())
}

proptest! {
    #[test]
    fn evologics_positions_are_those_of_the_auv(world in world(), age in 0.0..5.0) {
        let (xyz, ned) = (world.local(), about_z(-DECLINATION) * world.sight());
        let travel = world.sight().norm() / C;
        let text = evologics(&format!(
            "USBLLONG,{:.6},{:.6},3,{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},0,0,0,{:.0},-36,77,1.2375",
            500.0 + age, 500.0, xyz.x, -xyz.y, -xyz.z, ned.y, ned.x, -ned.z, travel * 1e6,
        ));
        for frame in [Frame::Body, Frame::Earth] {
            let fix = world.fix(ModemKind::Evologics { frame }, &text, RECEIVED_S - age);
            world.check(&fix, RECEIVED_S - age - travel, 0.01)?;
            prop_assert_eq!(fix.sigma_m, Some(1.2375));
        }
    }

    #[test]
    fn evologics_angles_and_a_depth_give_the_auv_s_position(world in world(), age in 0.0..5.0) {
        let (xyz, ned) = (world.local(), about_z(-DECLINATION) * world.sight());
        prop_assume!(world.sight().z / world.sight().norm() > 0.2);
        let angles = |x: f64, y: f64, z: f64| (y.atan2(x), z.atan2(x.hypot(y)));
        let (local, inertial) = (angles(xyz.x, -xyz.y, -xyz.z), angles(ned.y, ned.x, -ned.z));
        let text = evologics(&format!(
            "USBLANGLES,{:.6},{:.6},3,{:.7},{:.7},{:.7},{:.7},0,0,0,-36,77,0.0114",
            500.0 + age, 500.0, local.0, local.1, inertial.0, inertial.1,
        ));
        for frame in [Frame::Body, Frame::Earth] {
            let fix = world.fix(ModemKind::Evologics { frame }, &text, RECEIVED_S - age);
            world.check(&fix, RECEIVED_S - age - world.sight().norm() / C, 0.01)?;
            prop_assert!(fix.sigma_m.expect("is computed") > 0.0114 * world.sight().norm() * 0.1);
        }
    }

    #[test]
    fn seatrac_fixes_are_those_of_the_auv(world in world()) {
        let (frd, sight) = (world.local(), world.sight());
        let ned = about_z(-DECLINATION) * sight;
        #[expect(clippy::cast_possible_truncation, reason = "a test's numbers fit")]
        let tenths = |value: f64| (value * 10.0).round() as i16;
        let azimuth = frd.y.atan2(frd.x).to_degrees().rem_euclid(360.0);
        let elevation = (-frd.z).atan2(frd.x.hypot(frd.y)).to_degrees();
        let mut message = vec![0x42, 1, 3, 0b111, 6];
        let words = [0, 0, 0, tenths(TRANSDUCER_DEPTH), tenths(C), 0, 0, 0, 0, 0, tenths(sight.norm())];
        message.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        message.push(4);
        let words = [0, 0, 0, 0, tenths(azimuth), tenths(elevation), 0];
        message.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        let words = [tenths(ned.y), tenths(ned.x), tenths(ned.z + TRANSDUCER_DEPTH)];
        message.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        // Half a decimetre in each coordinate; and half of 0.1° over 75 m, in range and two angles.
        for (frame, tolerance) in [(Frame::Earth, 0.08), (Frame::Body, 0.15)] {
            let fix = world.fix(ModemKind::Seatrac { frame }, &seatrac::line(&message), RECEIVED_S);
            world.check(&fix, RECEIVED_S - sight.norm() / C, tolerance)?;
            prop_assert_eq!(fix.sigma_m, Some(4.0));
        }
    }

    #[test]
    fn apos_sentences_give_the_auv_s_position(world in world(), age in 0.0..5.0) {
        let sight = world.sight();
        let ahead = about_z(-world.craft.heading) * sight;
        let t_s: f64 = RECEIVED_S - age;
        let of_day = t_s.rem_euclid(86_400.0);
        let (hours, minutes) = ((of_day / 3600.0).floor(), (of_day / 60.0).floor() % 60.0);
        let time = format!("{hours:02}{minutes:02}{:09.6}", of_day % 60.0);
        for (orientation, x, y) in [("H", ahead.y, ahead.x), ("N", sight.x, sight.y), ("E", sight.y, sight.x)] {
            let body = format!("PSIMSSB,{time},3,A,,C,{orientation},M,{x:.3},{y:.3},{:.3},2.5,N,,", sight.z);
            let fix = world.fix(ModemKind::Sentences, &sentences::line(&body), t_s);
            world.check(&fix, t_s - sight.norm() / C, 0.01)?;
            prop_assert_eq!(fix.sigma_m, Some(2.5));
        }
    }

    #[test]
    fn a_range_is_from_the_transducer_as_the_craft_turned(world in world(), age in 0.0..5.0) {
        let range = world.sight().norm();
        let pattern = r"^(?<id>\d+) (?<range_m>\S+) after (?<age_s>\S+)$".to_owned();
        let text = format!("3 {range:.4} after {age:.6}\n");
        let fix = world.fix(ModemKind::Pattern { pattern }, &text, RECEIVED_S - age);
        prop_assert!((fix.range_m.expect("is measured") - range).abs() < 1e-4);
        let sent_s: f64 = RECEIVED_S - age - range / C;
        prop_assert!((fix.t_s - sent_s).abs() < 1e-3);
        // The AUV is as far from the place of the range as the sight is long horizontally.
        let off: f64 = world.error(&fix) - world.sight().xy().norm();
        prop_assert!(off.abs() < 0.02, "{off} m");
        prop_assert_eq!(fix.depth_m, Some(world.depth));
    }

    #[test]
    fn patterns_give_the_auv_s_position(world in world(), age in 0.0..5.0) {
        let (frd, sight) = (world.local(), world.sight());
        let body = format!("at 3 {:.4} {:.4} {:.4} after {age:.6}\n", frd.x, frd.y, frd.z);
        let north = format!("at 3 {:.4} {:.4} {:.4} after {age:.6}\n", sight.x, sight.y, sight.z);
        let bearing = frd.y.atan2(frd.x).to_degrees();
        let elevation = -(frd.z / frd.norm()).asin().to_degrees();
        let polar = format!("at 3 {:.4} {bearing:.5} {elevation:.5} after {age:.6}\n", frd.norm());
        for (text, [first, second, third]) in [
            (body, ["forward_m", "starboard_m", "down_m"]),
            (north, ["north_m", "east_m", "down_m"]),
            (polar, ["range_m", "bearing_deg", "elevation_deg"]),
        ] {
            let pattern = format!(
                r"^at (?<id>\d+) (?<{first}>\S+) (?<{second}>\S+) (?<{third}>\S+) after (?<age_s>\S+)$"
            );
            let fix = world.fix(ModemKind::Pattern { pattern }, &text, RECEIVED_S - age);
            world.check(&fix, RECEIVED_S - age - sight.norm() / C, 0.01)?;
        }
    }
}
