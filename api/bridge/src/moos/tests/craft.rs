//! The craft, AUVs, ranges and vessels in variables.

use nalgebra::Vector2;
use proptest::prelude::*;

use super::*;
use crate::moos::packet::greeting;
use crate::moos::{MoosVehicles, NoDatum, datum_of};
use crate::recent_positions::moved;
use crate::reference::Reference;
use crate::rehearsal::vehicle::{Placed, Vehicle};
use crate::{AuvFix, CraftMeasurement, VesselMessage};

/// The measurements of the craft among `events`.
fn craft(events: &[AutopilotEvent]) -> Vec<(f64, CraftMeasurement)> {
    let craft = |measurement: &Measurement| match measurement {
        Measurement::Craft { t_s, measured, .. } => Some((((t_s - NOW_S) * 1e3).round() / 1e3, *measured)),
        _ => None,
    };
    measured(events).into_iter().filter_map(craft).collect()
}

fn fix(events: &[AutopilotEvent]) -> Option<&AuvFix> {
    measured(events).into_iter().find_map(|measurement| match measurement {
        Measurement::Auv(fix) => Some(fix),
        _ => None,
    })
}

fn vessel(events: &[AutopilotEvent]) -> Option<&VesselMessage> {
    measured(events).into_iter().find_map(|measurement| match measurement {
        Measurement::Vessel(message) => Some(message),
        _ => None,
    })
}

/// North and east of the datum, whole m: the sphere is off by some decimetres.
fn place(position: &Origin) -> [f64; 2] {
    moved(&DATUM, position).map(f64::round).into()
}

#[test]
fn navigation_is_read_in_degrees_if_there_are_any_and_else_in_metres_from_the_datum() {
    let mut client = client(Some(DATUM), false);
    let xy = [("NAV_X", Number(30.0)), ("NAV_Y", Number(-40.0))];
    let events = heard(&mut client, 0.0, xy);
    let [(at, CraftMeasurement::Position(position))] = craft(&events)[..] else { panic!("{events:?}") };
    assert_eq!((at, place(&position)), (0.0, [-40.0, 30.0]));
    let both = [("NAV_LAT", Number(43.83)), ("NAV_LONG", Number(-70.33))];
    let here = Origin { lat_deg: 43.83, lon_deg: -70.33 };
    assert_eq!(craft(&heard(&mut client, 0.1, both)), [(0.1, CraftMeasurement::Position(here))]);
    let events = heard(&mut client, 0.2, [("NAV_X", Number(0.0)), ("NAV_Y", Number(0.0))]);
    assert_eq!(events, []);
    let events = heard(&mut client, 0.3, [("NAV_HEADING", Number(270.0)), ("NAV_SPEED", Number(1.5))]);
    let [(_, CraftMeasurement::Heading(heading)), (_, speed)] = craft(&events)[..] else {
        panic!("{events:?}")
    };
    assert!((heading + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!(speed, CraftMeasurement::GroundSpeed(1.5));
    // Over ground is better than a speed whose medium nobody knows.
    let over_ground = [
        ("NAV_SPEED_OVER_GROUND", Number(2.0)),
        ("NAV_HEADING_OVER_GROUND", Number(0.0)),
        ("NAV_SPEED", Number(1.0)),
    ];
    let velocity = CraftMeasurement::GroundVelocity(Vector2::new(2.0, 0.0));
    assert_eq!(craft(&heard(&mut client, 0.4, over_ground)), [(0.4, velocity)]);
}

#[test]
fn numbers_of_two_moments_are_no_position_and_metres_need_a_datum() {
    let mut client = client(None, false);
    assert_eq!(heard(&mut client, 0.0, [("NAV_LAT", Number(43.83))]), []);
    assert_eq!(heard(&mut client, 0.1, [("NAV_LONG", Number(-70.33))]), []);
    assert_eq!(heard(&mut client, 5.0, [("NAV_X", Number(0.0)), ("NAV_Y", Number(0.0))]), []);
    assert_eq!(client.rejects().to_string(), "x and y without a datum: 1");
}

#[test]
fn the_node_report_of_the_craft_counts_while_its_navigation_is_silent() {
    let mut client = client(None, false);
    let report = "NAME=craft,X=5,Y=6,SPD=1.5,HDG=90,LAT=43.8253,LON=-70.3304,TYPE=kayak";
    let local = || [("NODE_REPORT_LOCAL", Text(report))];
    let heading = CraftMeasurement::Heading(std::f64::consts::FRAC_PI_2);
    let expected = [heading, CraftMeasurement::Position(DATUM), CraftMeasurement::GroundSpeed(1.5)];
    let events = heard(&mut client, 0.0, local());
    assert_eq!(craft(&events), expected.map(|measured| (0.0, measured)));
    // From it the places of x and y are known.
    let events = heard(&mut client, 0.1, [("NODE_REPORT", Text("NAME=AUV-1,X=25,Y=16"))]);
    assert_eq!(fix(&events).map(|fix| place(&fix.position)), Some([10.0, 20.0]));
    heard(&mut client, 0.2, [("NAV_LAT", Number(43.83)), ("NAV_LONG", Number(-70.33))]);
    assert_eq!(heard(&mut client, 2.0, local()), []);
    assert_eq!(craft(&heard(&mut client, 2.3, local())).len(), 3);
}

#[test]
fn node_reports_of_auvs_are_fixes_and_those_of_others_vessels() {
    let mut client = client(Some(DATUM), false);
    let report = |name: &str, after: f64| {
        let t_s = NOW_S + after;
        format!("NAME={name},X=30,Y=-40,SPD=2,HDG=90,DEP=4.5,LENGTH=3.8,TRAJECTORY={{1,2:3,4}},TIME={t_s:.2}")
    };
    let text = report("auv-1", -20.0);
    let events = heard(&mut client, 0.0, [("NODE_REPORT", Text(&text))]);
    let fix = fix(&events).expect("is a fix");
    assert_eq!((&*fix.auv, fix.t_s - NOW_S, place(&fix.position)), ("auv-1", -20.0, [-40.0, 30.0]));
    assert_eq!((fix.depth_m, fix.range_m), (Some(4.5), None));
    let velocity = fix.ground_velocity.expect("is in the report");
    assert!((velocity - Vector2::new(0.0, 2.0)).norm() < 1e-12);
    // A relay repeats it. A time that cannot be is that of the arrival.
    assert_eq!(heard(&mut client, 1.0, [("NODE_REPORT", Text(&text))]), []);
    let text = report("auv-1", -100.0);
    let events = heard(&mut client, 2.0, [("NODE_REPORT", Text(&text))]);
    assert_eq!(super::craft::fix(&events).map(|fix| fix.t_s - NOW_S), Some(2.0));
    // Another vehicle with the craft's own name is neither.
    let text = report("Craft", 0.0);
    assert_eq!(heard(&mut client, 3.0, [("NODE_REPORT", Text(&text))]), []);
    let text = report("barge", 0.0);
    let events = heard(&mut client, 4.0, [("NODE_REPORT", Text(&text))]);
    let barge = vessel(&events).expect("is a vessel");
    assert_eq!((barge.name.as_deref(), barge.dimensions), (Some("barge"), Some([1.9, 1.9, 0.0, 0.0])));
    assert!(999_999_999 < barge.mmsi && barge.fix.is_some_and(|fix| fix.age_s == 4.0));
    // Nothing was measured in the future, whatever a clock says.
    let text = report("auv-1", 9.0);
    let events = heard(&mut client, 4.5, [("NODE_REPORT", Text(&text))]);
    assert_eq!(super::craft::fix(&events).map(|fix| fix.t_s - NOW_S), Some(4.5));
    assert_eq!(heard(&mut client, 4.6, [("NODE_REPORT", Text(&text))]), [], "a relay repeats it");
    for text in ["", "TIME=1", "NAME=auv-1", "NAME=auv-1,X=nan,Y=1", "NAME=auv-1,X=1e300,Y=1"] {
        assert_eq!(heard(&mut client, 5.0, [("NODE_REPORT", Text(text))]), [], "{text}");
    }
    let expected = "clock: 3, node report: 2, node report without a position: 3, repeated report: 2";
    assert_eq!(client.rejects().to_string(), expected);
}

#[test]
fn ranges_of_this_craft_to_auvs_are_fixes_from_where_it_was() {
    let mut client = client(Some(DATUM), false);
    let range = |text| [("CRS_RANGE_REPORT", Text(text))];
    let good = "vname=craft,range=52.5,target=AUV-1,time=1699999999.5";
    assert_eq!(heard(&mut client, 0.0, range(good)), []);
    heard(&mut client, 0.0, [("NAV_X", Number(3.0)), ("NAV_Y", Number(4.0))]);
    let events = heard(&mut client, 1.0, range(good));
    let fix = fix(&events).expect("is a range");
    assert_eq!((fix.t_s - NOW_S, fix.range_m, place(&fix.position)), (-0.5, Some(52.5), [4.0, 3.0]));
    for text in
        ["vname=other,range=1,target=auv-1", "range=-1,target=auv-1", "range=1,target=buoy", "range=1"]
    {
        assert_eq!(heard(&mut client, 1.0, range(text)), [], "{text}");
    }
    // The craft's position is too old.
    assert_eq!(heard(&mut client, 4.0, range("range=1,target=auv-1")), []);
}

#[test]
fn a_rehearsal_s_vehicles_are_read_as_craft_and_auv_and_its_desired_values_end() {
    let vehicle = |name: &str, t_s| Vehicle {
        name: name.to_owned(),
        t_s,
        position: Vector2::new(10.0, 20.0),
        velocity: (name == "craft").then(|| Vector2::new(0.0, 2.0)),
        heading: 0.5,
        yaw_rate: 0.0,
        depth_m: 4.5,
    };
    let mut vehicles = MoosVehicles::default();
    assert!(vehicles.take(&[], NOW_S).is_some_and(|sent| sent.starts_with(&greeting())));
    let (craft, auv) = (vehicle("craft", 0.0), vehicle("auv-1", -8.0));
    let placed = |vehicle, unix_s| Placed { vehicle, place: DATUM, unix_s };
    let bytes = MoosVehicles::say(&placed(&craft, NOW_S), &[placed(&auv, NOW_S - 8.0)]);
    let mut client = client(Some(DATUM), true);
    let events = client.push(&bytes, 10.0, NOW_S);
    let fix = fix(&events).expect("is a fix");
    assert_eq!((fix.t_s - NOW_S, fix.depth_m, fix.ground_velocity), (-8.0, Some(4.5), None));
    assert!(moved(&DATUM, &fix.position).norm() < 0.01);
    let read: Vec<CraftMeasurement> =
        super::craft::craft(&events).into_iter().map(|(_, read)| read).collect();
    assert!(read.contains(&CraftMeasurement::Position(DATUM)), "{read:?}");
    assert!(read.iter().any(|read| matches!(read, CraftMeasurement::GroundVelocity(v) if (v - Vector2::new(0.0, 2.0)).norm() < 1e-9)));
    let asked = Reference { speed: 1.5, heading: 0.25 };
    // No bytes would close the connection.
    assert_eq!(vehicles.take(&client.reference(&asked, 10.0), NOW_S), None);
    let steered = vehicles.reference(NOW_S + 3.0).expect("is steered");
    assert!((steered.heading - 0.25).abs() < 1e-9 && steered.speed == 1.5);
    assert_eq!(vehicles.reference(NOW_S + 3.1), None);
}

#[test]
fn a_mission_file_says_where_the_datum_is() {
    let text = "ServerPort=9001\nLatOrigin = 43.8253 // a lake\nLONGORIGIN= -70.3304\n
        ProcessConfig = uSimMarine\n{\n  LatOrigin = 1\n}\n";
    assert_eq!(datum_of(text), Ok(DATUM));
    for text in ["", "LatOrigin = $(LAT)\nLongOrigin = 1", "LatOrigin = 91\nLongOrigin = 1", "LatOrigin = 1"]
    {
        assert_eq!(datum_of(text), Err(NoDatum), "{text}");
    }
}

proptest! {
    #[test]
    fn any_values_give_finite_measurements(
        number in prop_oneof![any::<f64>(), -200.0..200.0_f64],
        other in prop_oneof![any::<f64>(), -200.0..200.0_f64],
        text in prop_oneof!["\\PC{0,60}", "(NAME=[a-c]{0,2}|X=-?[0-9]{1,400}|Y=1e[0-9]{1,3}|SPD=[0-9.]{1,9}|HDG=[0-9e]{1,9}|LAT=9[0-9]|LON=-?1[0-9]{2}|TIME=[0-9]{1,20}|,){1,12}"],
    ) {
        let mut client = client(Some(DATUM), true);
        let pairs = [["NAV_LAT", "NAV_LONG"], ["NAV_X", "NAV_Y"], ["NAV_SPEED_OVER_GROUND", "NAV_HEADING_OVER_GROUND"], ["NAV_HEADING", "NAV_SPEED"]];
        for [first, second] in pairs {
            let events = heard(&mut client, 0.0, [(first, Number(number)), (second, Number(other))]);
            for (t_s, measured) in craft(&events) {
                prop_assert!(t_s.is_finite());
                let is_finite = match measured {
                    CraftMeasurement::Position(place) => place.lat_deg.abs() <= 90.0 && place.lon_deg.abs() <= 180.0,
                    CraftMeasurement::GroundVelocity(velocity) => velocity.iter().all(|speed| speed.is_finite()),
                    CraftMeasurement::Heading(number) | CraftMeasurement::GroundSpeed(number) => number.is_finite(),
                    _ => false,
                };
                prop_assert!(is_finite, "{measured:?}");
            }
        }
        for key in ["NODE_REPORT", "NODE_REPORT_LOCAL", "CRS_RANGE_REPORT", "IVPHELM_STATE", "MOOS_MANUAL_OVERIDE"] {
            for measurement in measured(&heard(&mut client, 0.1, [(key, Text(&text))])) {
                prop_assert!(!format!("{measurement:?}").contains("NaN"), "{measurement:?}");
            }
        }
    }
}
