//! Messages in both directions, and control of the craft. Numbers, bits and units are MAVLink's.

use std::collections::BTreeMap;

use ::mavlink::dialects::ardupilotmega::{
    AIS_VESSEL_DATA, ATTITUDE_DATA, AisFlags, AisNavStatus, EKF_STATUS_REPORT_DATA, ESTIMATOR_STATUS_DATA,
    EkfStatusFlags, EstimatorStatusFlags, FOLLOW_TARGET_DATA, GLOBAL_POSITION_INT_DATA, MavAutopilot,
    MavFrame, MavMessage, MavSeverity, MavType, SYS_STATUS_DATA,
};
use ::mavlink::types::CharArray;
use ::mavlink::{MavHeader, MavlinkReader as FrameReader};
use clock::Clock;
use nalgebra::Vector2;
use planner::snapshot::VesselStatus;
use proptest::prelude::*;

use super::*;
use crate::{
    Alarm, AuvFix, CraftMeasurement, Measurement, Origin, VesselFix,
    autopilot_link::{AutopilotLink, AutopilotSettings},
    reference::Reference,
    tests::{ARDUPILOT, BOAT, frame, heartbeat},
    wire::Received,
};

const HERE: GLOBAL_POSITION_INT_DATA = GLOBAL_POSITION_INT_DATA {
    lat: 384_100_000,
    lon: -91_200_000,
    alt: -12_500,
    vx: 100,
    vy: -50,
    hdg: 9_000,
    ..GLOBAL_POSITION_INT_DATA::DEFAULT
};

fn place() -> MavMessage {
    MavMessage::GLOBAL_POSITION_INT(HERE)
}

/// An AUV at [`HERE`] and this altitude, m, that knows something.
fn target(alt: f32, est_capabilities: u8) -> MavMessage {
    MavMessage::FOLLOW_TARGET(FOLLOW_TARGET_DATA {
        lat: HERE.lat,
        lon: HERE.lon,
        alt,
        vel: [0.5, 0.25, 0.0],
        position_cov: [1.5, 1.5, 0.0],
        est_capabilities,
        ..FOLLOW_TARGET_DATA::DEFAULT
    })
}

/// A reader that has heard the autopilot of system 1, and knows system 7 as an AUV.
fn reader() -> MavlinkReader {
    let mut reader = MavlinkReader::new(None, BTreeMap::from([(7, "auv-1".to_owned())]));
    let beat = heartbeat(BOAT, ARDUPILOT, 15);
    assert_eq!(reader.push(&frame(1, 1, &beat), 0.0), []);
    let heard = reader.push(&frame(1, 1, &beat), 1.0);
    assert!(matches!(heard[..], [AutopilotEvent::Heartbeat(beat)] if beat.mode.is_guided && beat.is_armed));
    reader
}

fn measured(heard: &[AutopilotEvent]) -> Vec<CraftMeasurement> {
    let of_the_craft = |heard: &AutopilotEvent| match heard {
        AutopilotEvent::Measured(Measurement::Craft { measured, .. }) => Some(*measured),
        _ => None,
    };
    heard.iter().filter_map(of_the_craft).collect()
}

/// The fix in an AUV's `message`.
fn fix(message: &MavMessage) -> Option<AuvFix> {
    match &reader().push(&frame(7, 1, message), 5.0)[..] {
        [AutopilotEvent::Measured(Measurement::Auv(fix))] => Some(fix.clone()),
        _ => None,
    }
}

#[test]
fn the_charge_of_the_battery_is_read_if_the_autopilot_knows_it() {
    let charge = |battery_remaining| {
        let status = SYS_STATUS_DATA { battery_remaining, ..SYS_STATUS_DATA::DEFAULT };
        reader().push(&frame(1, 1, &MavMessage::SYS_STATUS(status)), 0.0)
    };
    assert_eq!(charge(80), [AutopilotEvent::Battery(0.8)]);
    assert_eq!((charge(0), charge(-1), charge(101)), (vec![AutopilotEvent::Battery(0.0)], vec![], vec![]));
}

/// The only message in `bytes`.
fn read(bytes: &[u8]) -> (MavHeader, MavMessage) {
    FrameReader::new(bytes).read_any_message().expect("is a whole frame")
}

#[test]
fn the_craft_has_its_autopilot_s_state_in_degrees_and_metres_per_second() {
    let heard = reader().push(&frame(1, 1, &place()), 5.0);
    let here = Origin { lat_deg: 38.41, lon_deg: -9.12 };
    assert_eq!(
        measured(&heard),
        [
            CraftMeasurement::Position(here),
            CraftMeasurement::GroundVelocity(Vector2::new(1.0, -0.5)),
            CraftMeasurement::Heading(std::f64::consts::FRAC_PI_2),
        ]
    );
}

#[test]
fn the_first_surface_craft_is_taken_by_its_second_heartbeat_and_others_are_named_once() {
    let mut reader = MavlinkReader::new(None, BTreeMap::new());
    let mut beat = |system, kind| reader.push(&frame(system, 1, &heartbeat(kind, ARDUPILOT, 15)), 0.0);
    let aircraft = MavType::MAV_TYPE_FIXED_WING;
    assert_eq!(beat(5, aircraft), []);
    let named = AutopilotEvent::NoCraft { system: 5, kind: "MAV_TYPE_FIXED_WING".to_owned() };
    assert_eq!(beat(5, aircraft), [named]);
    assert_eq!(beat(5, aircraft), []);
    // After a start its autopilot briefly states another type.
    assert_eq!(beat(1, MavType::MAV_TYPE_GENERIC), []);
    assert_eq!(beat(1, BOAT), []);
    assert!(matches!(beat(1, BOAT)[..], [AutopilotEvent::Heartbeat(_)]));
    // A craft whose type changes is no longer steered.
    assert_eq!(beat(1, aircraft), []);
    assert_eq!(reader.craft, Some(1));
    // The operator gives a number, not a type.
    let mut reader = MavlinkReader::new(Some(5), BTreeMap::new());
    let twice = frame(5, 1, &heartbeat(aircraft, ARDUPILOT, 15)).repeat(2);
    let heard = reader.push(&twice, 0.0);
    assert!(matches!(heard[..], [AutopilotEvent::NoCraft { system: 5, .. }]));
}

#[test]
fn an_auv_is_another_system_and_a_third_system_is_ignored() {
    let fix = fix(&place()).expect("is a fix");
    assert_eq!((&*fix.auv, fix.t_s, fix.depth_m), ("auv-1", 5.0, Some(12.5)));
    assert_eq!(fix.ground_velocity, Some(Vector2::new(1.0, -0.5)));
    for (system, component) in [(9, 1), (1, 191), (255, 190)] {
        assert_eq!(reader().push(&frame(system, component, &place()), 5.0), []);
    }
}

#[test]
fn a_follow_target_has_the_values_of_its_capabilities() {
    let velocity = Vector2::new(0.5, 0.25);
    for (capabilities, found) in [(0, None), (1, Some(None)), (3, Some(Some(velocity)))] {
        let fix = fix(&target(-3.0, capabilities));
        assert_eq!(fix.as_ref().map(|fix| fix.ground_velocity), found);
        assert!(fix.is_none_or(|fix| (fix.sigma_m, fix.depth_m) == (Some(1.5), Some(3.0))));
    }
}

#[test]
fn invalid_numbers_and_positions_are_rejected_by_name() {
    let mut reader = reader();
    let nowhere = MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA::DEFAULT);
    let attitude =
        MavMessage::ATTITUDE(ATTITUDE_DATA { yaw: f32::NAN, yawspeed: 0.25, ..ATTITUDE_DATA::DEFAULT });
    assert_eq!(reader.push(&frame(1, 1, &nowhere), 0.0), []);
    let heard = reader.push(&frame(1, 1, &attitude), 0.0);
    assert_eq!(measured(&heard), [CraftMeasurement::YawRate(0.25)], "the rest of it counts");
    let reasons: Vec<_> = reader.rejects.iter().collect();
    assert_eq!(reasons, [("attitude that is no number", 1), ("craft without a position", 1)]);
}

#[test]
fn a_depth_is_below_the_water_surface_and_not_relative_to_sea_level() {
    let depth = |relative_alt, alt| {
        let said = GLOBAL_POSITION_INT_DATA { relative_alt, alt, ..HERE };
        fix(&MavMessage::GLOBAL_POSITION_INT(said)).expect("is a fix").depth_m
    };
    // In a lake 320 m above the sea: 40 m deep, at the surface, and without a home.
    assert_eq!(depth(-40_000, 280_000), Some(40.0));
    assert_eq!(depth(200, 320_200), Some(0.0));
    assert_eq!(depth(0, 280_000), None);
    // In the sea: with and without a home, and at the surface.
    assert_eq!(depth(-12_500, -12_000), Some(12.5));
    assert_eq!(depth(0, -12_500), Some(12.5));
    assert_eq!(depth(0, 0), Some(0.0));
    assert_eq!(fix(&target(280.0, 1)).expect("is a fix").depth_m, None);
}

#[test]
fn an_auv_has_no_fixes_while_its_own_filter_does_not_know_the_position() {
    // EKF_POS_HORIZ_ABS and EKF_CONST_POS_MODE; the same bits of ESTIMATOR_STATUS.
    let (absolute, constant) = (0x10, 0x80);
    let ekf = |flags| {
        MavMessage::EKF_STATUS_REPORT(EKF_STATUS_REPORT_DATA {
            flags: EkfStatusFlags::from_bits_retain(flags),
            ..EKF_STATUS_REPORT_DATA::DEFAULT
        })
    };
    let estimator = |flags| {
        MavMessage::ESTIMATOR_STATUS(ESTIMATOR_STATUS_DATA {
            flags: EstimatorStatusFlags::from_bits_retain(flags),
            ..ESTIMATOR_STATUS_DATA::DEFAULT
        })
    };
    for status in [&ekf as &dyn Fn(u16) -> MavMessage, &estimator] {
        let mut reader = reader();
        let mut has_fix = |flags: u16| {
            assert_eq!(reader.push(&frame(7, 1, &status(flags)), 0.0), [], "it is no status of the craft");
            !reader.push(&frame(7, 1, &place()), 0.0).is_empty()
        };
        assert!(has_fix(absolute));
        assert!(!has_fix(absolute | constant));
        assert!(!has_fix(0));
        assert!(has_fix(absolute));
        assert_eq!(reader.rejects.to_string(), "AUV that does not know its position: 2");
    }
}

#[test]
fn a_repeated_message_counts_once_unless_its_sender_has_no_clock() {
    let at =
        |time_boot_ms| MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA { time_boot_ms, ..HERE });
    for system in [1, 7] {
        let mut reader = reader();
        let mut counts = |times: [u32; 4]| {
            let heard = times.map(|time| reader.push(&frame(system, 1, &at(time)), 0.0));
            heard.map(|events| !events.is_empty())
        };
        assert_eq!(counts([4711, 4711, 4711, 4712]), [true, false, false, true]);
        assert_eq!(counts([0, 0, 0, 0]), [true; 4]);
        assert_eq!(reader.rejects.to_string(), "repeated message: 2");
    }
}

/// The target of `reference`, after its check, and the bits of its mask.
fn target_of(autopilot: Autopilot, speed: f64, heading: f64) -> ([f32; 3], u16) {
    let reference = Reference { speed, heading };
    let (header, message) = read(&MavlinkWriter::new(3).reference(autopilot, &reference, 77));
    let MavMessage::SET_POSITION_TARGET_LOCAL_NED(target) = message else {
        panic!("{message:?}");
    };
    assert_eq!((header.system_id, header.component_id), (3, 191));
    assert_eq!((target.target_system, target.target_component), (3, 1));
    assert_eq!(target.coordinate_frame, MavFrame::MAV_FRAME_LOCAL_NED);
    ([target.vx, target.vy, target.yaw], target.type_mask.bits())
}

#[test]
fn ardupilot_gets_a_speed_ahead_never_astern_and_a_heading() {
    for (speed, ahead) in [(1.25, 1.25), (-1.0, 0.0)] {
        let target = target_of(Autopilot::ArduPilot, speed, -2.0);
        assert_eq!(target, ([ahead, 0.0, -2.0], 0x9C7));
    }
}

#[test]
fn px4_gets_a_velocity_of_speed_and_bearing() {
    let ([north, east, _], mask) = target_of(Autopilot::Px4, 2.0, 0.5);
    // Yaw, bit 10, is to be ignored.
    assert_eq!(mask, 0x9C7 | 1 << 10);
    let expected = [2.0 * 0.5_f64.cos(), 2.0 * 0.5_f64.sin()];
    assert!((f64::from(north) - expected[0]).abs() < 1e-6 && (f64::from(east) - expected[1]).abs() < 1e-6);
}

#[test]
fn a_text_for_the_ground_station_is_cut_between_characters() {
    for (text, arrives) in [("Pilotfish steering", 18), (&*"ä".repeat(40), 50), (&*"aä".repeat(20), 49)] {
        let (_, message) = read(&MavlinkWriter::new(1).text(MavSeverity::MAV_SEVERITY_WARNING, text));
        let MavMessage::STATUSTEXT(said) = message else {
            panic!("{message:?}");
        };
        assert_eq!(said.text.to_str(), Ok(&text[..arrives]));
        assert_eq!(said.severity, MavSeverity::MAV_SEVERITY_WARNING);
    }
}

#[test]
fn px4_follows_references_in_offboard_only() {
    let mut reader = MavlinkReader::new(None, BTreeMap::new());
    let mut is_guided = |main_mode: u32| {
        let beat = heartbeat(BOAT, MavAutopilot::MAV_AUTOPILOT_PX4, main_mode << 16);
        let twice = frame(1, 1, &beat).repeat(2);
        matches!(reader.push(&twice, 0.0).last(), Some(AutopilotEvent::Heartbeat(beat)) if beat.mode.is_guided)
    };
    assert!(is_guided(6));
    assert!(!is_guided(4));
}

#[test]
fn contradictory_heartbeats_forbid_references() {
    let settings = AutopilotSettings::Mavlink {
        connect: "tcp:autopilot:1".parse().expect("an endpoint"),
        system: None,
        auvs: BTreeMap::new(),
    };
    let mut link = AutopilotLink::open(settings, &Clock::simulated(0.0), |_| Box::new(|_| ()));
    let clock = clock::Clock::simulated(0.0);
    let mut may_be_steered = |mode, t_s| {
        let beat = heartbeat(BOAT, ARDUPILOT, mode);
        let piece = Received { wire: 0, at: clock.now(), bytes: frame(1, 1, &beat), is_datagram: true };
        link.push(&piece, t_s, t_s);
        matches!(link.control(t_s), Control::Reported(Some((beat, _))) if beat.may_be_steered())
    };
    let [guided, manual] = [15, 0];
    assert!(!may_be_steered(manual, 0.0));
    // A person sets the mode: it counts at once.
    assert!(!may_be_steered(manual, 1.0));
    assert!(may_be_steered(guided, 2.0));
    // Another sender says five times a second that the mode is still set.
    for second in 3..8 {
        let second = f64::from(second);
        assert!(!may_be_steered(manual, second));
        assert!((1..5).all(|fifth| !may_be_steered(guided, second + 0.2 * f64::from(fifth))));
    }
    assert!(!may_be_steered(guided, 9.9));
    assert!(may_be_steered(guided, 10.1));
}

fn control(mode: u32, is_armed: bool, age: f64) -> Control {
    let beat = Heartbeat::of_mavlink(Autopilot::ArduPilot, mode, is_armed);
    Control::Reported(Some((beat, age)))
}

fn known(mode: u32, is_armed: bool) -> Conditions {
    Conditions {
        control: control(mode, is_armed, 0.5),
        distrust: None,
        state_age: Some(0.1),
        reference: Some(Reference { speed: 1.0, heading: 0.0 }),
        has_planned: true,
        is_paused: false,
    }
}

#[test]
fn control_is_taken_once_and_not_after_a_person_took_over() {
    let mut authority = Authority::new(true);
    let ordered = Action::OrderGuided(Autopilot::ArduPilot);
    let sent = known(15, true).reference.map(Action::Send).expect("is present");
    for (now, mode, is_armed, action) in [
        (10.0, 4, false, ordered),
        (11.9, 4, false, Action::Silent(Silence::NotGuided)),
        (12.1, 15, false, Action::OrderArm),
        (14.2, 15, true, sent),
        (15.0, 4, true, Action::Silent(Silence::TakenOver)),
        (15.1, 15, false, Action::Silent(Silence::NotArmed)),
        (500.0, 4, true, Action::Silent(Silence::TakenOver)),
        (500.1, 15, false, Action::Silent(Silence::NotArmed)),
        (501.0, 15, true, sent),
    ] {
        assert_eq!(authority.decide(now, &known(mode, is_armed)), action, "{now} s");
    }
}

#[test]
fn an_autopilot_that_rejects_orders_gets_six_at_most() {
    let mut authority = Authority::new(true);
    let actions = (0..100_u8).map(|second| authority.decide(f64::from(second), &known(15, false)));
    let ordered = actions.filter(|action| !matches!(action, Action::Silent(_)));
    assert_eq!(ordered.count(), 6);
}

#[test]
fn px4_gets_references_in_other_modes_and_can_enter_offboard() {
    let mut authority = Authority::new(false);
    let reference = known(15, true).reference.expect("is present");
    let (offered, sent) = (Action::Offer(reference), Action::Send(reference));
    for (now, main_mode, action) in [(0.0, 4, offered), (1.0, 6, sent), (2.0, 4, offered)] {
        let beat = Heartbeat::of_mavlink(Autopilot::Px4, main_mode << 16, true);
        let control = Control::Reported(Some((beat, 0.5)));
        let known = Conditions { control, ..known(15, true) };
        assert_eq!(authority.decide(now, &known), action);
    }
}

#[test]
fn each_missing_condition_stops_references_with_its_own_reason() {
    type Change = fn(&mut Conditions);
    let decide = |change: Change| {
        let mut conditions = known(15, true);
        change(&mut conditions);
        Authority::new(false).decide(0.0, &conditions)
    };
    let cases: [(Change, Silence); 11] = [
        (|c| c.control = Control::Reported(None), Silence::NoHeartbeat),
        (|c| c.control = control(15, true, 3.1), Silence::NoHeartbeat),
        (|c| c.distrust = Some(Alarm::PositionFrozen), Silence::Distrust(Alarm::PositionFrozen)),
        (|c| c.state_age = None, Silence::NoPosition),
        (|c| c.state_age = Some(3.1), Silence::NoPosition),
        (|c| c.reference = None, Silence::PlanStale),
        (|c| (c.reference, c.has_planned) = (None, false), Silence::NoPlan),
        (|c| (c.reference, c.is_paused) = (None, true), Silence::MissionPaused),
        (|c| *c = known(15, false), Silence::NotArmed),
        (|c| *c = known(4, true), Silence::NotGuided),
        (|c| *c = known(4, false), Silence::NotGuided),
    ];
    for (change, silence) in cases {
        assert_eq!(decide(change), Action::Silent(silence));
    }
    // A wire without mode.
    let action = decide(|c| c.control = Control::Unreported);
    assert!(matches!(action, Action::Send(_)));
}

#[test]
fn parameters_that_contradict_the_mission_are_named() {
    let mut parameters = Parameters::default();
    for (name, value) in [("WP_SPEED", 1.0), ("GUID_OPTIONS", 8.0), ("ATC_SPEED_I", 0.2), ("OTHER", 1.0)] {
        parameters.note(name, value);
    }
    let contradictions = parameters.contradictions(1.5);
    let named: Vec<_> = contradictions.iter().map(|found| found.parameter).collect();
    assert_eq!(named, ["WP_SPEED", "GUID_OPTIONS"]);
    assert_eq!(parameters.contradictions(0.5).len(), 1);
    assert_eq!((parameters.speed_max(), parameters.get("OTHER")), (Some(1.0), None));
}

#[test]
fn a_craft_with_two_thrusters_steers_at_rest() {
    let mut parameters = Parameters::default();
    assert_eq!(parameters.steerage_way(), None);
    parameters.note("SERVO1_FUNCTION", 26.0);
    assert_eq!(parameters.steerage_way(), Some(0.2));
    parameters.note("SERVO1_FUNCTION", 73.0);
    assert_eq!(parameters.steerage_way(), None);
}

/// `frame` with one byte changed, lost or doubled, or truncated.
fn damaged(frame: &[u8], kind: u8, at: prop::sample::Index, byte: u8) -> Vec<u8> {
    let mut damaged = frame.to_vec();
    let at = at.index(damaged.len());
    match kind {
        0 => damaged[at] ^= byte,
        1 => drop(damaged.remove(at)),
        2 => damaged.insert(at, byte),
        _ => damaged.truncate(at),
    }
    damaged
}

proptest! {
    #[test]
    fn splitting_a_stream_changes_nothing(cuts in proptest::collection::vec(1..40_usize, 1..40)) {
        let whole: Vec<u8> = [frame(1, 1, &place()), b"\xFD\x09noise".to_vec(), frame(7, 1, &place()), frame(1, 1, &place())].concat();
        let at_once = reader().push(&whole, 1.0);
        let mut reader = reader();
        let (mut rest, mut pieces) = (&whole[..], vec![]);
        for cut in cuts.into_iter().chain([whole.len()]) {
            let (piece, after) = rest.split_at(cut.min(rest.len()));
            pieces.extend(reader.push(piece, 1.0));
            rest = after;
        }
        prop_assert_eq!(at_once, pieces);
    }

    #[test]
    fn damaged_frames_add_no_measurement(
        damages in prop::collection::vec((0..4_u8, any::<prop::sample::Index>(), 1..=u8::MAX), 1..40),
    ) {
        let whole = frame(1, 1, &place());
        let mut stream: Vec<u8> = damages.into_iter().flat_map(|(kind, at, byte)| damaged(&whole, kind, at, byte)).collect();
        // A frame without its beginning may consume the start of the next ones.
        stream.extend(whole.repeat(10));
        let said = measured(&reader().push(&whole, 1.0));
        let heard = measured(&reader().push(&stream, 1.0));
        prop_assert!(!heard.is_empty());
        // A checksum of 16 bits lets one damaged frame in 65,536 pass, with its three measurements.
        let new = heard.iter().filter(|one| !said.contains(one)).count();
        prop_assert!(new <= 3, "{heard:?}");
    }
}

#[test]
fn the_autopilot_s_vessels_have_the_values_that_their_flags_allow() {
    let mut name = [0; 20];
    name[..7].copy_from_slice(b"EXAMPLE");
    let heard = |flags: AisFlags, heading: u16| {
        let vessel = MavMessage::AIS_VESSEL(AIS_VESSEL_DATA {
            MMSI: 244_123_456,
            lat: HERE.lat,
            lon: HERE.lon,
            COG: 9_000,
            heading,
            velocity: 250,
            dimension_bow: 70,
            dimension_stern: 30,
            dimension_port: 8,
            dimension_starboard: 4,
            tslc: 3,
            navigational_status: AisNavStatus::AIS_NAV_STATUS_FISHING,
            flags,
            name: CharArray::new(name),
            ..AIS_VESSEL_DATA::DEFAULT
        });
        match &reader().push(&frame(1, 1, &vessel), 5.0)[..] {
            [AutopilotEvent::Measured(Measurement::Vessel(message))] => message.clone(),
            other => panic!("{other:?}"),
        }
    };
    let east = Some(std::f64::consts::FRAC_PI_2);
    let known = heard(AisFlags::all(), 9_000);
    let position = Origin { lat_deg: 38.41, lon_deg: -9.12 };
    let status = VesselStatus::Fishing;
    let fix = VesselFix { age_s: 3.0, position, course: east, speed: Some(2.5), heading: east, status };
    assert_eq!((known.mmsi, known.name.as_deref(), known.fix), (244_123_456, Some("EXAMPLE"), Some(fix)));
    assert_eq!((known.is_own, known.dimensions), (false, Some([70.0, 30.0, 8.0, 4.0])));
    // 511° is no heading.
    let unknown = heard(AisFlags::empty(), 51_100);
    let fix = VesselFix { course: None, speed: None, heading: None, ..fix };
    assert_eq!((unknown.fix, unknown.name, unknown.dimensions), (Some(fix), None, None));
}
