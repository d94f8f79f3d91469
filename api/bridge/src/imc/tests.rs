//! DUNE's messages in both directions. Numbers and units are IMC's.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use clock::Clock;
use nalgebra::Vector2;
use parking_lot::Mutex;
use planner::snapshot::VesselStatus;

use super::codec::*;
use super::reader::ImcReader;
use super::*;
use crate::mavlink::AutopilotEvent;
use crate::recent_positions::moved;
use crate::reference::Reference as Asked;
use crate::rehearsal::vehicle::{Placed, Vehicle};
use crate::wire::Received;
use crate::{AuvFix, CraftMeasurement, Measurement, Origin, on_earth};

const OWN: u16 = 0x4F15;
const CRAFT: u16 = 0x0C01;
const AUV: u16 = 0x001E;

fn settings(headings: bool) -> ImcSettings {
    ImcSettings {
        connect: "imc:10.0.2.1:6010".parse().expect("is a network"),
        number: OWN,
        vehicle: "asv".to_owned(),
        auvs: vec!["lauv".to_owned()],
        numbers: BTreeMap::new(),
        beacons: BTreeMap::from([(3, "lauv".to_owned())]),
        headings,
        asks: true,
    }
}

fn bytes(source: u16, time_s: f64, message: impl Into<Message>) -> Vec<u8> {
    let header = Header { time_s, source, ..Header::default() };
    packet(&header, &message.into(), ByteOrder::Little)
}

fn announced(sys_name: &str) -> Announce {
    Announce { sys_name: sys_name.to_owned(), ..Announce::default() }
}

/// A state 1000 m north and 500 m east of 41.185° −8.705°, to the east at 1 m/s.
fn state() -> EstimatedState {
    EstimatedState {
        lat: 41.185_f64.to_radians(),
        lon: -8.705_f64.to_radians(),
        x: 1000.0,
        y: 500.0,
        psi: 1.5,
        vy: 1.0,
        r: 0.25,
        phi: 0.125,
        theta: -0.125,
        depth: 12.0,
        ..EstimatedState::default()
    }
}

/// That place, by the ellipsoid's radii of curvature.
fn place() -> Origin {
    let (a, e2, sin) = (6_378_137.0, 6.694_38e-3, 41.185_f64.to_radians().sin());
    let root = (1.0 - e2 * sin * sin).sqrt();
    let (meridian, normal) = (a * (1.0 - e2) / root.powi(3), a / root);
    let east = 500.0 / normal / 41.185_f64.to_radians().cos();
    on_earth(41.185 + (1000.0 / meridian).to_degrees(), -8.705 + east.to_degrees()).expect("is on Earth")
}

/// A reader that knows craft and AUV.
fn reader() -> ImcReader {
    let mut reader = ImcReader::new(settings(false));
    for (number, name) in [(CRAFT, "asv"), (AUV, "lauv")] {
        assert_eq!(reader.push(&bytes(number, 1.0, announced(name)), true, 0.0, 100.0), []);
    }
    reader
}

fn fixes(heard: Vec<AutopilotEvent>) -> Vec<AuvFix> {
    let fix = |event| match event {
        AutopilotEvent::Measured(Measurement::Auv(fix)) => Some(fix),
        _ => None,
    };
    heard.into_iter().filter_map(fix).collect()
}

#[test]
fn the_craft_is_where_its_offset_puts_it_and_other_systems_are_not_the_craft() {
    let mut reader = reader();
    let heard = reader.push(&bytes(CRAFT, 1.0, state()), true, 1.0, 101.0);
    let measured: Vec<_> = heard
        .iter()
        .filter_map(|event| match event {
            AutopilotEvent::Measured(Measurement::Craft { measured, .. }) => Some(*measured),
            _ => None,
        })
        .collect();
    let CraftMeasurement::Position(found) = measured[0] else { panic!("{measured:?}") };
    assert!(moved(&place(), &found).norm() < 0.2, "{found:?}");
    assert_eq!(
        measured[1..],
        [
            CraftMeasurement::GroundVelocity(Vector2::new(0.0, 1.0)),
            CraftMeasurement::Heading(1.5),
            CraftMeasurement::YawRate(0.25),
        ]
    );
    assert_eq!(heard.last(), Some(&AutopilotEvent::Attitude { roll: 0.125, pitch: -0.125 }));
    assert_eq!(reader.push(&bytes(0x0C02, 2.0, state()), true, 1.1, 101.0), []);
    assert_eq!(reader.push(&bytes(CRAFT, 1.0, state()), true, 1.2, 101.0), []);
    let nowhere = EstimatedState { x: f32::NAN, ..state() };
    assert_eq!(reader.push(&bytes(CRAFT, 3.0, nowhere), true, 1.3, 101.0), []);
    let unturned = EstimatedState { psi: f32::INFINITY, ..state() };
    assert_eq!(reader.push(&bytes(CRAFT, 4.0, unturned), true, 1.4, 101.0), []);
    let counts = reader.packets.rejects.to_string();
    assert_eq!(counts, "craft without a position: 1, repeated message: 1, state that is no number: 1");
}

#[test]
fn it_is_steered_in_follow_reference_of_this_bridge_alone() {
    let mut reader = reader();
    let mut time_s = 4.0;
    let mut beat = |message: Message, op_mode: u8, maneuver_type: u16| {
        time_s += 1.0;
        reader.push(&bytes(CRAFT, time_s, message), true, 0.0, 1.0);
        let state = VehicleState { op_mode, maneuver_type, ..VehicleState::default() };
        match &reader.push(&bytes(CRAFT, time_s, state), true, 0.0, 1.0)[..] {
            [AutopilotEvent::Time(_), AutopilotEvent::Heartbeat(beat)] => {
                (beat.mode.is_guided, beat.mode.to_string())
            }
            other => panic!("{other:?}"),
        }
    };
    let by =
        |control_src, control_ent| FollowReference { control_src, control_ent, ..FollowReference::default() };
    let silent: Message = Heartbeat {}.into();
    let ours = (true, "FollowReference".to_owned());
    let theirs = (false, "FollowReference of another system".to_owned());
    for (message, expected) in [
        (silent.clone(), &ours),
        (by(0x4001, 0xFF).into(), &theirs),
        (by(OWN, 0xFF).into(), &ours),
        (by(OWN, 7).into(), &theirs),
        (
            FollowRefState { control_src: 0xFFFF, control_ent: 0xFF, ..FollowRefState::default() }.into(),
            &ours,
        ),
    ] {
        assert_eq!(beat(message, 3, 478), *expected);
    }
    for (op_mode, maneuver, name) in [
        (0, 0xFFFF, "SERVICE"),
        (3, 450, "manoeuvre 450"),
        (4, 478, "EXTERNAL"),
        (5, 0, "BOOT"),
        (9, 0, "mode 9"),
    ] {
        assert_eq!(beat(silent.clone(), op_mode, maneuver), (false, name.to_owned()));
    }
}

#[test]
fn two_systems_of_one_name_are_both_left_alone_until_one_is_gone() {
    let mut reader = reader();
    let mut said = |number, name: &str, now| {
        let heard = reader.push(&bytes(number, now, announced(name)), true, now, 100.0);
        (reader.craft(), heard.len())
    };
    assert_eq!(said(CRAFT, "asv", 10.0), (Some(CRAFT), 0));
    assert_eq!(said(0x0C07, "asv", 11.0), (None, 1));
    assert_eq!(said(CRAFT, "asv", 12.0), (None, 0), "it is told once");
    assert_eq!(said(CRAFT, "asv", 41.5), (Some(CRAFT), 0));
    // A number that is in use keeps its name.
    assert_eq!(said(CRAFT, "other", 42.0), (Some(CRAFT), 0));
    assert_eq!(said(0x0C08, "two\nlines", 42.0), (Some(CRAFT), 0));
    assert_eq!(reader.packets.rejects.to_string(), "name that is no text: 1, two names of one system: 1");
    for number in 1..2000 {
        reader.push(&bytes(number, 1.0, announced(&number.to_string())), true, 42.0, 100.0);
    }
    assert!(reader.packets.rejects.to_string().contains("more systems than are remembered"));
}

#[test]
fn auvs_have_fixes_of_their_own_state_of_modems_and_of_relays() {
    let mut reader = reader();
    let mut fix = |source, message: Message, now: f64| {
        let heard = reader.push(&bytes(source, now, message), true, now, 100.0 + now);
        fixes(heard).into_iter().next()
    };
    let uncertain = NavigationUncertainty { x: 4.0, y: 9.0, ..NavigationUncertainty::default() };
    assert_eq!(fix(AUV, uncertain.into(), 1.0), None);
    let own = fix(AUV, state().into(), 2.0).expect("is a fix");
    assert_eq!((&*own.auv, own.t_s, own.sigma_m, own.depth_m), ("lauv", 102.0, Some(3.0), Some(12.0)));
    assert_eq!(own.ground_velocity, Some(Vector2::new(0.0, 1.0)));
    let unknown = EstimatedState { depth: -1.0, ..state() };
    let later = fix(AUV, unknown.into(), 20.0).expect("is a fix");
    assert_eq!((later.sigma_m, later.depth_m), (None, None));
    // A vector of the craft's modem, until DUNE makes fixes of them.
    let target = "lauv".to_owned();
    let vector = UsblPositionExtended {
        target: target.clone(),
        n: 30.0,
        e: -40.0,
        d: 7.0,
        ..UsblPositionExtended::default()
    };
    assert_eq!(fix(CRAFT, vector.clone().into(), 21.0), None, "the craft has no place");
    fix(CRAFT, state().into(), 22.0);
    let seen = fix(CRAFT, vector.clone().into(), 23.0).expect("is a fix");
    let away = moved(&place(), &seen.position);
    assert!((away - Vector2::new(30.0, -40.0)).norm() < 0.4 && seen.depth_m == Some(7.0), "{away}");
    let [lat, lon] = [0.7, -0.15];
    let made = UsblFixExtended { target: target.clone(), lat, lon, z_units: 1, z: 8.0, accuracy: 2.5 };
    let made = fix(CRAFT, made.into(), 24.0).expect("is a fix");
    assert_eq!((made.sigma_m, made.depth_m), (Some(2.5), Some(8.0)));
    assert!((made.position.lat_deg - lat.to_degrees()).abs() < 1e-12);
    assert_eq!(fix(CRAFT, vector.clone().into(), 25.0), None);
    fix(CRAFT, state().into(), 84.0);
    assert!(fix(CRAFT, vector.clone().into(), 85.0).is_some());
    assert_eq!(
        fix(CRAFT, UsblPositionExtended { n: 3e4, ..vector }.into(), 85.5),
        None,
        "sound carries less far"
    );
    // Ranges, from where the craft is.
    let range = UamRxRange { sys: target.clone(), value: 45.5, ..UamRxRange::default() };
    let ranged = fix(CRAFT, range.clone().into(), 86.0).expect("is a range");
    assert_eq!(ranged.range_m, Some(45.5));
    assert!(moved(&place(), &ranged.position).norm() < 0.2);
    assert_eq!(fix(AUV, range.clone().into(), 87.0), None, "another's range is from elsewhere");
    assert_eq!(fix(CRAFT, range.into(), 87.5), None, "the craft's place is old");
    fix(CRAFT, state().into(), 87.6);
    assert!(fix(CRAFT, LblRange { id: 3, range: 50.0 }.into(), 88.0).is_some());
    assert_eq!(fix(CRAFT, LblRange { id: 4, range: 50.0 }.into(), 89.0), None);
    let relayed = RemoteSensorInfo { id: target, lat, lon, alt: -3.5, ..RemoteSensorInfo::default() };
    assert_eq!(fix(CRAFT, relayed.into(), 90.0).expect("is a fix").depth_m, Some(3.5));
    let stranger = RemoteSensorInfo { id: "244660000".to_owned(), lat, lon, ..RemoteSensorInfo::default() };
    assert_eq!(fix(CRAFT, stranger.into(), 91.0), None);
}

#[test]
fn other_vessels_have_radians_and_knots() {
    let said = AisInfo {
        mmsi: "244660000".to_owned(),
        name: "FERRY@@@".to_owned(),
        nav_status: 5,
        lat: 0.7,
        lon: -0.15,
        course: 1.5,
        speed: 10.0,
        a: 50.0,
        b: 10.0,
        c: 4.0,
        d: 6.0,
        ..AisInfo::default()
    };
    let vessel = |said: AisInfo| match &reader().push(&bytes(CRAFT, 9.0, said), true, 0.0, 1.0)[..] {
        [AutopilotEvent::Measured(Measurement::Vessel(vessel))] => Some(vessel.clone()),
        _ => None,
    };
    let seen = vessel(said.clone()).expect("is a vessel");
    let fix = seen.fix.expect("has a position");
    assert_eq!((seen.mmsi, seen.name.as_deref(), fix.course), (244_660_000, Some("FERRY"), Some(1.5)));
    assert!((fix.speed.expect("is known") - 5.144_444).abs() < 1e-6);
    assert_eq!((fix.status, seen.dimensions), (VesselStatus::Moored, Some([50.0, 10.0, 4.0, 6.0])));
    let silent = AisInfo { course: 360_f32.to_radians(), speed: 102.3, a: 0.0, b: 0.0, ..said.clone() };
    let silent = vessel(silent).expect("is a vessel");
    let fix = silent.fix.expect("has a position");
    assert_eq!((fix.course, fix.speed, silent.dimensions), (None, None, None));
    let fixed = vessel(AisInfo { lat: 0.0, lon: 0.0, ..said.clone() }).expect("is a vessel");
    assert_eq!(fixed.fix, None);
    assert_eq!(vessel(AisInfo { mmsi: "x".to_owned(), ..said }), None);
}

/// A link that knows the craft and where it is, with what it sends, and its clock.
fn link(headings: bool) -> (ImcLink, impl Fn() -> Vec<Packet>, impl FnMut(&mut ImcLink, u16, Message)) {
    let (sent, clock) = (Arc::new(Mutex::new(vec![])), Clock::simulated(1.8e9));
    let taken = Arc::clone(&sent);
    let send = move |bytes: &[u8]| sent.lock().extend(PacketReader::default().push(bytes, true));
    let mut time_s = 0.0;
    let at = clock.now();
    let say = move |link: &mut ImcLink, source, message: Message| {
        time_s += 1.0;
        let piece = Received { wire: 0, bytes: bytes(source, time_s, message), is_datagram: true, at };
        link.push(&piece, time_s, 1.8e9 + time_s);
    };
    let link = ImcLink::new(Box::new(send), settings(headings), clock);
    (link, move || std::mem::take(&mut *taken.lock()), say)
}

#[tokio::test(start_paused = true)]
async fn a_reference_is_a_place_ahead_of_the_craft_and_a_stop_its_own_place() {
    let (mut link, sent, mut say) = link(false);
    let ahead = Asked { speed: 1.5, heading: FRAC_PI_2 };
    link.reference(&ahead, 1.0);
    assert_eq!(sent(), [], "the craft is not known");
    say(&mut link, CRAFT, announced("asv").into());
    link.reference(&ahead, 2.0);
    assert_eq!(sent(), [], "its place is not known");
    say(&mut link, CRAFT, state().into());
    for (at, asked, metres) in [
        (3.0, ahead, 40.0),
        (3.5, Asked { speed: 3.0, ..ahead }, 60.0),
        (4.0, Asked { speed: 0.0, ..ahead }, 0.0),
    ] {
        link.reference(&asked, at);
        link.reference(&asked, at + 0.4);
        let packets = sent();
        let [Packet { header, message: Some(Message::Reference(place_and_speed)) }] = &packets[..] else {
            panic!("{packets:?}");
        };
        assert_eq!((header.source, header.destination), (OWN, CRAFT));
        let Reference { flags, speed, z, lat, lon, .. } = place_and_speed;
        assert_eq!((*flags, speed.clone()), (7, Some(DesiredSpeed { value: asked.speed, speed_units: 0 })));
        assert_eq!(z.clone().map(|z| (z.value, z.z_units)), Some((0.0, 1)));
        let there = on_earth(lat.to_degrees(), lon.to_degrees()).expect("is on Earth");
        let away = moved(&place(), &there) - Vector2::new(0.0, metres);
        assert!(away.norm() < 0.5, "{away}");
    }
    link.reference(&Asked { speed: 0.04, ..ahead }, 5.0);
    let Some(Message::Reference(slow)) = &sent()[0].message else { panic!("is a reference") };
    assert_eq!(slow.speed.clone().map(|speed| speed.value), Some(0.0), "DUNE ends its control at 0 alone");
    link.release(1.0);
    let Some(Message::Reference(last)) = &sent()[0].message else { panic!("is a reference") };
    assert_eq!((last.flags, last.speed.clone()), (0x87, Some(DesiredSpeed::default())));
    say(&mut link, 0x0C07, announced("asv").into());
    link.reference(&ahead, 9.0);
    assert_eq!(sent(), [], "there are two of them");
}

#[tokio::test(start_paused = true)]
async fn by_headings_each_reference_is_a_heading_and_a_speed() {
    let (mut link, sent, mut say) = link(true);
    say(&mut link, CRAFT, announced("asv").into());
    link.start();
    assert_eq!(sent(), [], "a person sets EXTERNAL");
    link.reference(&Asked { speed: 1.5, heading: -2.0 }, 1.0);
    link.release(0.0);
    let messages: Vec<Message> = sent().into_iter().filter_map(|packet| packet.message).collect();
    let speed = |value| Message::from(DesiredSpeed { value, speed_units: 0 });
    assert_eq!(messages, [DesiredHeading { value: -2.0 }.into(), speed(1.5), speed(0.0)]);
}

#[tokio::test(start_paused = true)]
async fn dune_is_asked_for_a_manoeuvre_that_ends_within_three_seconds_and_its_answer_is_kept() {
    let (mut link, sent, mut say) = link(false);
    say(&mut link, CRAFT, announced("asv").into());
    link.ask();
    assert_eq!(sent(), [], "its mode is not known");
    let service = VehicleState { maneuver_type: 0xFFFF, ..VehicleState::default() };
    say(&mut link, CRAFT, service.into());
    link.ask();
    link.start();
    let requests: Vec<PlanControl> = sent()
        .into_iter()
        .filter_map(|packet| match packet.message {
            Some(Message::PlanControl(request)) if packet.header.destination == CRAFT => Some(request),
            _ => None,
        })
        .collect();
    let asked = |op| requests.iter().find(|request| request.op == op && request.kind == 0).expect("is asked");
    let [load, start] = [2, 0].map(asked);
    assert_ne!(load.request_id, start.request_id);
    for manoeuvre in [&load.arg, &start.arg] {
        let manoeuvre = manoeuvre.as_ref().expect("is in the plan");
        assert_eq!((manoeuvre.control_src, manoeuvre.control_ent), (OWN, 0xFF));
        assert!(0.0 < manoeuvre.timeout && manoeuvre.timeout < 3.0);
    }
    let state = |state| PlanControlState { state, plan_id: PLAN.to_owned(), ..PlanControlState::default() };
    say(&mut link, CRAFT, state(0).into());
    assert_eq!(link.reader.takes_plan, None);
    say(&mut link, CRAFT, state(1).into());
    assert_eq!(link.reader.takes_plan, Some(Ok(())));
    let refusal = PlanControl {
        kind: 2,
        plan_id: PLAN.to_owned(),
        info: "not supported".to_owned(),
        ..PlanControl::default()
    };
    say(&mut link, CRAFT, refusal.into());
    assert_eq!(link.reader.takes_plan, Some(Err("not supported".to_owned())));
    link.ask();
    assert_eq!(sent(), [], "it has answered");
}

#[tokio::test(start_paused = true)]
async fn the_bridge_announces_where_it_can_be_reached() {
    let (mut link, sent, _) = link(false);
    link.heartbeat();
    let packets = sent();
    assert!(packets.iter().all(|packet| packet.header.destination == 0xFFFF && packet.header.source == OWN));
    let [Packet { message: Some(Message::Announce(said)), .. }, Packet { message: Some(beat), .. }] =
        &packets[..]
    else {
        panic!("{packets:?}");
    };
    assert_eq!((&*said.sys_name, &*said.services), ("pilotfish-asv", "imc+udp://10.0.2.1:6010/"));
    assert_eq!(*beat, Heartbeat {}.into());
}

/// A vehicle of a rehearsal at `t_s`, north of its origin.
fn simulated(name: &str, t_s: f64, north: f64) -> (Vehicle, Origin) {
    let vehicle = Vehicle {
        name: name.to_owned(),
        t_s,
        position: Vector2::new(north, 0.0),
        // The AUV does not say how it moves.
        velocity: (name == "asv").then(|| Vector2::new(1.0, 0.0)),
        heading: 0.5,
        yaw_rate: 0.0,
        depth_m: 3.0,
    };
    (vehicle, Origin { lat_deg: 41.0 + north / 111_320.0, lon_deg: -8.0 })
}

#[tokio::test(start_paused = true)]
async fn a_rehearsal_is_followed_like_a_craft_until_its_references_end_or_a_person_stops_it() {
    let mut vehicles = ImcVehicles::new("imc:127.0.0.1:1".parse().expect("is a network"));
    let (sent, clock) = (Arc::new(Mutex::new(vec![])), Clock::simulated(1.8e9));
    let (taken, at) = (Arc::clone(&sent), clock.now());
    let send = Box::new(move |bytes: &[u8]| sent.lock().extend(bytes));
    let mut link = ImcLink::new(send, settings(false), clock);
    let piece = |bytes: Vec<u8>| Received { wire: 0, bytes, is_datagram: true, at };
    let mut second = |link: &mut ImcLink, t_s: f64| {
        vehicles.take(&piece(std::mem::take(&mut *taken.lock())), t_s);
        let [(craft, here), (auv, there)] =
            [simulated("asv", t_s, t_s), simulated("lauv", 4.0 * (t_s / 4.0).floor(), 50.0)];
        let placed = |vehicle, place| Placed { vehicle, place, unix_s: 1.8e9 + t_s };
        let (packets, steered) = vehicles.say(t_s, &placed(&craft, here), &[placed(&auv, there)]);
        let heard: Vec<_> =
            packets.into_iter().flat_map(|bytes| link.push(&piece(bytes), t_s, 1.8e9 + t_s)).collect();
        let mode = heard.iter().find_map(|event| match event {
            AutopilotEvent::Heartbeat(beat) => Some(beat.may_be_steered()),
            _ => None,
        });
        (mode, fixes(heard).len(), steered)
    };
    assert_eq!(second(&mut link, 0.0), (Some(false), 1, None));
    link.start();
    assert_eq!(second(&mut link, 1.0), (Some(true), 0, None));
    link.reference(&Asked { speed: 1.5, heading: FRAC_PI_2 }, 1.0);
    let (mode, _, steered) = second(&mut link, 2.0);
    let steered = steered.expect("is steered");
    // The craft is a metre on its way by then.
    assert_eq!((mode, steered.speed), (Some(true), 1.5));
    assert!((steered.heading - FRAC_PI_2).abs() < 0.05, "{steered:?}");
    assert_eq!(second(&mut link, 4.0).1, 1, "a fix is told once");
    assert_eq!(second(&mut link, 5.0), (Some(false), 0, None), "references have ended");
    link.start();
    link.reference(&Asked { speed: 1.5, heading: FRAC_PI_2 }, 6.0);
    assert!(second(&mut link, 6.0).2.is_some());
    link.release(0.0);
    assert_eq!(second(&mut link, 7.0), (Some(false), 0, None), "the bridge has ended it");
}
