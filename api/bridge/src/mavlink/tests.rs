//! Messages there and back, and the rules of who has the craft. Numbers of messages, bits and units are MAVLink's, written out here.

use std::collections::BTreeMap;

use ::mavlink::{
    MAVLinkV2MessageRaw, MavHeader, MavlinkReader as FrameReader,
    dialects::ardupilotmega::{
        ATTITUDE_DATA, FOLLOW_TARGET_DATA, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavAutopilot, MavFrame,
        MavMessage, MavModeFlag,
    },
};
use nalgebra::Vector2;
use proptest::prelude::*;

use super::*;
use crate::{CraftMeasurement, Geographic, Measurement, reference::Reference};

fn frame(system_id: u32, component_id: u8, message: &MavMessage) -> Vec<u8> {
    let header = MavHeader {
        system_id,
        component_id,
        sequence: 0,
    };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(header, message);
    raw.raw_bytes().to_vec()
}

fn heartbeat(autopilot: MavAutopilot, custom_mode: u32) -> MavMessage {
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode,
        autopilot,
        base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
        ..HEARTBEAT_DATA::DEFAULT
    })
}

fn place() -> MavMessage {
    MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
        lat: 384_100_000,
        lon: -91_200_000,
        alt: -12_500,
        vx: 100,
        vy: -50,
        hdg: 9_000,
        ..GLOBAL_POSITION_INT_DATA::DEFAULT
    })
}

/// A reader that has heard the autopilot of system 1, and knows system 7 as an AUV.
fn reader() -> MavlinkReader {
    let mut reader = MavlinkReader::new(None, BTreeMap::from([(7, "auv-1".to_owned())]));
    let beat = heartbeat(MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA, 15);
    let heard = reader.push(&frame(1, 1, &beat), 0.0);
    assert!(matches!(heard[..], [Heard::Heartbeat(beat)] if beat.is_guided() && beat.is_armed));
    reader
}

fn measured(heard: &[Heard]) -> Vec<CraftMeasurement> {
    let of_the_craft = |heard: &Heard| match heard {
        Heard::Measured(Measurement::Craft { measured, .. }) => Some(*measured),
        _ => None,
    };
    heard.iter().filter_map(of_the_craft).collect()
}

/// The only message that `bytes` are.
fn read(bytes: &[u8]) -> (MavHeader, MavMessage) {
    FrameReader::new(bytes)
        .read_any_message()
        .expect("is a whole frame")
}

#[test]
fn the_craft_is_where_its_autopilot_says_in_degrees_and_metres_per_second() {
    let heard = reader().push(&frame(1, 1, &place()), 5.0);
    let here = Geographic {
        lat_deg: 38.41,
        lon_deg: -9.12,
    };
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
fn an_auv_is_another_system_and_a_third_system_is_nothing() {
    let mut reader = reader();
    let heard = reader.push(&frame(7, 1, &place()), 5.0);
    let [Heard::Measured(Measurement::Auv(fix))] = &heard[..] else {
        panic!("{heard:?}");
    };
    assert_eq!(
        (fix.auv.as_str(), fix.t_s, fix.depth_m),
        ("auv-1", 5.0, Some(12.5))
    );
    assert_eq!(fix.ground_velocity, Some(Vector2::new(1.0, -0.5)));
    for (system, component) in [(9, 1), (1, 191), (255, 190)] {
        assert_eq!(reader.push(&frame(system, component, &place()), 5.0), []);
    }
}

#[test]
fn a_follow_target_tells_what_its_capabilities_say() {
    let target = |capabilities| {
        MavMessage::FOLLOW_TARGET(FOLLOW_TARGET_DATA {
            lat: 384_100_000,
            lon: -91_200_000,
            alt: -3.0,
            vel: [0.5, 0.25, 0.0],
            position_cov: [1.5, 1.5, 0.0],
            est_capabilities: capabilities,
            ..FOLLOW_TARGET_DATA::DEFAULT
        })
    };
    let fix = |capabilities| match &reader().push(&frame(7, 1, &target(capabilities)), 0.0)[..] {
        [Heard::Measured(Measurement::Auv(fix))] => Some(fix.clone()),
        _ => None,
    };
    assert_eq!(fix(0), None);
    assert_eq!(fix(1).and_then(|fix| fix.ground_velocity), None);
    let both = fix(3).expect("has a position");
    assert_eq!((both.sigma_m, both.depth_m), (Some(1.5), Some(3.0)));
    assert_eq!(both.ground_velocity, Some(Vector2::new(0.5, 0.25)));
}

#[test]
fn what_is_no_number_or_no_place_is_refused_by_name() {
    let mut reader = reader();
    let nowhere = MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA::DEFAULT);
    let attitude = MavMessage::ATTITUDE(ATTITUDE_DATA {
        yaw: f32::NAN,
        ..ATTITUDE_DATA::DEFAULT
    });
    for said in [nowhere, attitude] {
        assert_eq!(reader.push(&frame(1, 1, &said), 0.0), []);
    }
    let reasons: Vec<_> = reader.refused().iter().collect();
    assert_eq!(
        reasons,
        [("attitude that is no number", 1), ("craft without a position", 1)]
    );
}

#[test]
fn ardupilot_is_sent_a_speed_ahead_and_a_heading() {
    let reference = Reference {
        speed: 1.25,
        heading: -2.0,
    };
    let (header, message) = read(&MavlinkWriter::new(3).reference(Autopilot::ArduPilot, &reference, 77));
    let MavMessage::SET_POSITION_TARGET_LOCAL_NED(target) = message else {
        panic!("{message:?}");
    };
    assert_eq!((header.system_id, header.component_id), (3, 191));
    assert_eq!((target.target_system, target.target_component), (3, 1));
    assert_eq!(target.type_mask.bits(), 0x9C7);
    assert_eq!(target.coordinate_frame, MavFrame::MAV_FRAME_LOCAL_NED);
    assert_eq!([target.vx, target.vy, target.yaw], [1.25, 0.0, -2.0]);
}

#[test]
fn no_reference_asks_for_going_astern() {
    let reference = Reference {
        speed: -1.0,
        heading: 0.0,
    };
    let (_, message) = read(&MavlinkWriter::new(1).reference(Autopilot::ArduPilot, &reference, 0));
    assert!(matches!(message, MavMessage::SET_POSITION_TARGET_LOCAL_NED(target) if target.vx == 0.0));
}

#[test]
fn px4_is_sent_a_velocity_that_is_speed_and_bearing() {
    let reference = Reference {
        speed: 2.0,
        heading: 0.5,
    };
    let (_, message) = read(&MavlinkWriter::new(1).reference(Autopilot::Px4, &reference, 0));
    let MavMessage::SET_POSITION_TARGET_LOCAL_NED(target) = message else {
        panic!("{message:?}");
    };
    // Yaw, bit 10, is to be ignored too.
    assert_eq!(target.type_mask.bits(), 0x9C7 | 1 << 10);
    assert!((f64::from(target.vx) - 2.0 * 0.5_f64.cos()).abs() < 1e-6);
    assert!((f64::from(target.vy) - 2.0 * 0.5_f64.sin()).abs() < 1e-6);
}

#[test]
fn px4_takes_references_in_offboard_alone() {
    let mut reader = MavlinkReader::new(None, BTreeMap::new());
    let mut is_guided = |main_mode: u32| {
        let beat = heartbeat(MavAutopilot::MAV_AUTOPILOT_PX4, main_mode << 16);
        matches!(reader.push(&frame(1, 1, &beat), 0.0)[..], [Heard::Heartbeat(beat)] if beat.is_guided())
    };
    assert!(is_guided(6));
    assert!(!is_guided(4));
}

fn known(mode: u32, is_armed: bool) -> Conditions {
    let beat = Heartbeat {
        autopilot: Autopilot::ArduPilot,
        mode,
        is_armed,
    };
    Conditions {
        control: Control::Reported(Some((beat, 0.5))),
        state_age: Some(0.1),
        reference: Some(Reference {
            speed: 1.0,
            heading: 0.0,
        }),
        has_planned: true,
        is_held: false,
    }
}

#[test]
fn control_is_taken_once_and_never_again_after_a_person_took_over() {
    let mut authority = Authority::new(true);
    assert_eq!(
        authority.decide(0.0, &known(4, false)),
        Action::OrderGuided(Autopilot::ArduPilot)
    );
    assert_eq!(
        authority.decide(0.1, &known(4, false)),
        Action::Silent(Silence::NotGuided)
    );
    assert_eq!(authority.decide(2.1, &known(15, false)), Action::OrderArm);
    assert!(matches!(authority.decide(4.2, &known(15, true)), Action::Send(_)));
    for now in [5.0, 50.0, 500.0] {
        assert_eq!(
            authority.decide(now, &known(4, true)),
            Action::Silent(Silence::TakenOver)
        );
        assert_eq!(
            authority.decide(now, &known(15, false)),
            Action::Silent(Silence::NotArmed)
        );
    }
    assert!(matches!(
        authority.decide(501.0, &known(15, true)),
        Action::Send(_)
    ));
}

#[test]
fn an_autopilot_that_refuses_is_not_ordered_about_for_ever() {
    let mut authority = Authority::new(true);
    let ordered = (0..100_u8)
        .filter(|second| {
            !matches!(
                authority.decide(f64::from(*second), &known(15, false)),
                Action::Silent(_)
            )
        })
        .count();
    assert_eq!(ordered, 6);
}

#[test]
fn px4_is_offered_references_so_that_it_can_be_handed_over_and_back() {
    let beat = |mode| Heartbeat {
        autopilot: Autopilot::Px4,
        mode,
        is_armed: true,
    };
    let known = |mode| Conditions {
        control: Control::Reported(Some((beat(mode), 0.5))),
        ..known(15, true)
    };
    let mut authority = Authority::new(false);
    assert!(matches!(authority.decide(0.0, &known(4 << 16)), Action::Offer(_)));
    assert!(matches!(authority.decide(1.0, &known(6 << 16)), Action::Send(_)));
    assert!(matches!(authority.decide(2.0, &known(4 << 16)), Action::Offer(_)));
}

#[test]
fn each_thing_that_is_missing_silences_by_its_own_name() {
    let whole = known(15, true);
    let cases = [
        (
            Conditions {
                control: Control::Reported(None),
                ..whole
            },
            Silence::NoHeartbeat,
        ),
        (
            Conditions {
                state_age: None,
                ..whole
            },
            Silence::NoPosition,
        ),
        (
            Conditions {
                state_age: Some(3.1),
                ..whole
            },
            Silence::NoPosition,
        ),
        (
            Conditions {
                reference: None,
                ..whole
            },
            Silence::PlanStale,
        ),
        (
            Conditions {
                reference: None,
                has_planned: false,
                ..whole
            },
            Silence::NoPlan,
        ),
        (
            Conditions {
                reference: None,
                is_held: true,
                ..whole
            },
            Silence::MissionHeld,
        ),
        (known(15, false), Silence::NotArmed),
        (known(4, true), Silence::NotGuided),
    ];
    for (conditions, silence) in cases {
        assert_eq!(
            Authority::new(false).decide(0.0, &conditions),
            Action::Silent(silence)
        );
    }
    let beat = Heartbeat {
        autopilot: Autopilot::ArduPilot,
        mode: 15,
        is_armed: true,
    };
    let silent = Conditions {
        control: Control::Reported(Some((beat, 3.1))),
        ..whole
    };
    assert_eq!(
        Authority::new(false).decide(0.0, &silent),
        Action::Silent(Silence::NoHeartbeat)
    );
    let untold = Conditions {
        control: Control::Unreported,
        ..whole
    };
    assert!(matches!(
        Authority::new(false).decide(0.0, &untold),
        Action::Send(_)
    ));
}

#[test]
fn parameters_that_contradict_the_mission_are_named() {
    let mut parameters = Parameters::default();
    for (name, value) in [
        ("WP_SPEED", 1.0),
        ("GUID_OPTIONS", 8.0),
        ("ATC_SPEED_I", 0.2),
        ("OTHER", 1.0),
    ] {
        parameters.note(name, value);
    }
    let named: Vec<_> = parameters
        .contradictions(1.5)
        .iter()
        .map(|found| found.parameter)
        .collect();
    assert_eq!(named, ["WP_SPEED", "GUID_OPTIONS"]);
    assert_eq!(parameters.contradictions(0.5).len(), 1);
    assert_eq!(
        (parameters.speed_max(), parameters.get("OTHER")),
        (Some(1.0), None)
    );
}

#[test]
fn a_craft_with_two_thrusters_steers_without_way() {
    let mut parameters = Parameters::default();
    assert_eq!(parameters.steerage_way(), None);
    parameters.note("SERVO1_FUNCTION", 26.0);
    assert_eq!(parameters.steerage_way(), Some(0.2));
    parameters.note("SERVO1_FUNCTION", 73.0);
    assert_eq!(parameters.steerage_way(), None);
}

proptest! {
    #[test]
    fn a_stream_is_read_the_same_in_whatever_pieces_it_comes(cuts in proptest::collection::vec(1..40_usize, 1..40)) {
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
    fn any_bytes_may_come(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let mut reader = reader();
        let heard = reader.push(&bytes, 1.0);
        // A frame that is right by chance is one of 65,536.
        prop_assert!(measured(&heard).is_empty());
    }
}
