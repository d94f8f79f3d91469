//! Encounters as the rules tell them apart, and what the craft then does.

use std::f64::consts::PI;

use super::encounter::{closest_approach, kind};
use crate::facts::traffic::{Avoidance, EncounterKind, Vessel, VesselStatus};
use crate::tests::prelude::*;
use crate::{Parameters, Plan, Workspace, plan};

fn vessel(id: &str, place: [f64; 2], course: f64, speed: f64) -> Vessel {
    Vessel {
        id: id.into(),
        name: None,
        t_s: None,
        north_m: place[0],
        east_m: place[1],
        lat_deg: None,
        lon_deg: None,
        course_rad: Some(course),
        speed_mps: Some(speed),
        heading_rad: None,
        length_m: Some(40.0),
        sigma_m: Some(5.0),
        plan: Vec::new(),
        status: VesselStatus::UnderWay,
    }
}

/// A craft behind an AUV that goes north.
fn request(traffic: Vec<Vessel>) -> PlanRequest {
    let asc = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.7);
    let auv = Auv::new("auv", moving(0.0, 0.0, 5.0, 0.0, 0.7));
    let goal = Goal::Track { auv: auv.id.clone() };
    PlanRequest { traffic, ..PlanRequest::new(100.0, asc, vec![auv], goal) }
}

fn answer(request: PlanRequest) -> Plan {
    let snapshot = Snapshot::try_from(request).expect("is valid");
    plan(&snapshot, &Parameters::default(), &mut Workspace::default())
}

#[test]
fn encounters_are_told_apart_by_bearing_and_course() {
    let own = Vector2::new(1.0, 0.0);
    let met = |bearing_deg: f64, course_deg: f64, speed: f64| {
        let (there, course) = (direction(bearing_deg.to_radians()) * 500.0, course_deg.to_radians());
        kind(&own, &there, &(direction(course) * speed))
    };
    assert_eq!(met(3.0, 183.0, 5.0), EncounterKind::HeadOn);
    assert_eq!(met(-8.0, 176.0, 5.0), EncounterKind::HeadOn);
    assert_eq!(met(45.0, 270.0, 5.0), EncounterKind::CrossingGiveWay);
    assert_eq!(met(110.0, 300.0, 5.0), EncounterKind::CrossingGiveWay);
    assert_eq!(met(-45.0, 90.0, 5.0), EncounterKind::CrossingStandOn);
    assert_eq!(met(0.0, 0.0, 0.5), EncounterKind::Overtaking);
    assert_eq!(met(170.0, 0.0, 5.0), EncounterKind::Overtaken);
    assert_eq!(met(120.0, 0.0, 5.0), EncounterKind::Overtaken);
    assert_eq!(met(10.0, 180.0, 0.1), EncounterKind::KeepClear);
}

#[test]
fn closest_approach_is_that_of_the_straight_lines() {
    let (distance, time) = closest_approach(&Vector2::new(300.0, 40.0), &Vector2::new(-3.0, 0.0));
    assert_eq!((distance, time), (40.0, 100.0));
    let (distance, time) = closest_approach(&Vector2::new(300.0, 40.0), &Vector2::new(3.0, 0.0));
    assert_eq!((distance, time), (300.0_f64.hypot(40.0), 0.0));
}

#[test]
fn the_craft_turns_to_starboard_for_a_vessel_head_on_and_passes_astern_of_one_from_starboard() {
    for (place, course) in [([800.0, 0.0], PI), ([90.0, 700.0], -PI / 2.0), ([75.0, 700.0], -1.5)] {
        let plan = answer(request(vec![vessel("ship", place, course, 5.0)]));
        let avoidance = plan.avoidance.expect("a vessel comes near");
        let manoeuvre = avoidance.manoeuvre.expect("it would come too near");
        let met = &avoidance.encounters[0];
        assert!(met.acts && met.separation_m <= met.passes_m, "{avoidance:?}");
        if met.kind == EncounterKind::HeadOn {
            assert!(0.25 < manoeuvre.heading_rad && met.starboard_m < 0.0, "{avoidance:?}");
        }
        assert!(plan.violations.is_empty());
    }
}

#[test]
fn a_craft_stands_on_until_the_others_inaction_makes_it_act() {
    // From port, so that both come to one point after the time.
    let at = |time: f64| {
        let place = [0.7 * time, -5.0 * time];
        answer(request(vec![vessel("ship", place, PI / 2.0, 5.0)])).avoidance.expect("comes near")
    };
    let (early, late) = (at(250.0), at(50.0));
    let kinds = [&early, &late].map(|avoidance| avoidance.encounters[0].kind);
    assert_eq!(kinds, [EncounterKind::CrossingStandOn; 2]);
    assert!(early.manoeuvre.is_none() && !early.encounters[0].acts, "{early:?}");
    assert!(late.manoeuvre.is_some() && late.encounters[0].acts, "{late:?}");
    // It does not turn to port for a vessel on its port side.
    assert!(0.0 <= wrap(late.manoeuvre.expect("is there").heading_rad), "{late:?}");
}

#[test]
fn one_head_on_is_left_to_port_though_another_one_has_to_be_avoided_before() {
    // A minute into a drawn encounter in which no single turn keeps clear of all on the right sides.
    let ship = |id: &str, place, [north, east]: [f64; 2], length: f64| {
        let course = f64::atan2(east, north);
        let known = vessel(id, place, course, north.hypot(east));
        Vessel { length_m: Some(length), ..known }
    };
    let traffic = vec![
        ship("fast", [1738.6, -45.0], [-9.51, 0.3], 51.0),
        ship("head-on", [-413.7, 116.1], [2.24, -0.56], 12.6),
        ship("beside", [128.7, -544.5], [-1.18, 1.825], 29.0),
        ship("at-rest", [-244.7, 96.4], [0.0, 0.0], 7.6),
        ship("from-astern", [-686.4, 1408.2], [6.46, -13.1], 53.0),
    ];
    let [north, east] = [-0.475, 0.242];
    let (place, course, speed) = (Vector2::new(-28.6, 14.7), f64::atan2(east, north), 0.533);
    let asc = Asc::new(place, Heading::new(course), speed);
    let auv = Auv::new("auv", moving(place.x, place.y, 10.0, course, speed));
    let avoidance = answer(PlanRequest { asc, auvs: vec![auv], ..request(traffic) }).avoidance.expect("near");
    let head_on = avoidance.encounters.iter().find(|met| met.vessel.0 == "head-on").expect("is met");
    assert!(head_on.kind == EncounterKind::HeadOn && head_on.starboard_m < 0.0, "{avoidance:?}");
    assert!(avoidance.encounters.iter().all(|met| met.separation_m <= met.passes_m), "{avoidance:?}");
}

#[test]
fn names_order_and_north_change_nothing() {
    let ships = || vec![vessel("a", [900.0, 30.0], PI, 6.0), vessel("b", [200.0, 800.0], -PI / 2.0, 5.0)];
    let before = answer(request(ships()));
    let renamed = {
        let mut traffic = ships();
        traffic.reverse();
        (traffic[0].id, traffic[1].id) = ("x".into(), "y".into());
        answer(request(traffic))
    };
    let turn = 2.0;
    let rotation = ned_from_body(turn);
    let turned = {
        let mut turned = request(ships());
        for ship in &mut turned.traffic {
            let place = rotation * ship.position();
            (ship.north_m, ship.east_m) = (place.x, place.y);
            ship.course_rad = ship.course_rad.map(|course| wrap(course + turn));
        }
        turned.asc.heading_rad = turn;
        if let Some(state) = &mut turned.auvs[0].state {
            state.course_rad = turn;
        }
        answer(turned)
    };
    let heading = |plan: &Plan| plan.reference.heading.radians();
    assert_eq!(heading(&before), heading(&renamed));
    assert!(wrap(heading(&turned) - turn - heading(&before)).abs() < 1e-6);
    let manoeuvres = [&before, &turned].map(|plan| plan.avoidance.as_ref().and_then(|done| done.manoeuvre));
    let [Some(one), Some(other)] = manoeuvres else { panic!("{manoeuvres:?}") };
    assert!(wrap(other.heading_rad - turn - one.heading_rad).abs() < 1e-6);
}

#[test]
fn a_vessel_at_anchor_stays_and_one_under_way_is_forgotten_after_a_quarter_of_an_hour() {
    let near = |status: VesselStatus, age: f64| {
        let ship = Vessel { status, t_s: Some(100.0 - age), ..vessel("ship", [90.0, 0.0], 0.0, 0.0) };
        let plan = answer(request(vec![ship]));
        plan.trajectory
            .iter()
            .map(|point| (point.position() - Vector2::new(90.0, 0.0)).norm())
            .fold(1e9, f64::min)
    };
    // Half the length, the default distance, and two standard deviations of 5 m.
    assert!(59.5 < near(VesselStatus::AtAnchor, 10_000.0));
    assert!(59.5 < near(VesselStatus::UnderWay, 10.0));
    assert!(near(VesselStatus::UnderWay, 1000.0) < 45.0);
}

#[test]
fn far_vessels_and_those_that_have_passed_change_no_bit() {
    let alone = answer(request(vec![]));
    let far = vec![vessel("far", [9000.0, 9000.0], 0.0, 3.0), vessel("gone", [-2000.0, 300.0], PI, 8.0)];
    let beside = answer(request(far));
    assert_eq!(alone.trajectory, beside.trajectory);
    assert_eq!(alone.reference, beside.reference);
}

#[test]
fn a_velocity_is_averaged_and_a_turn_begins_it_anew() {
    let mut previous = None;
    let mut seen = Vec::new();
    for k in 0..12 {
        // The course jumps to and fro by 3°, then by 17°.
        let noise = if k % 2 == 0 { 0.05 } else { -0.05 };
        let course = if k < 10 { PI + noise } else { PI + 0.3 };
        let mut request = request(vec![vessel("ship", [1500.0 - 30.0 * f64::from(k), 0.0], course, 6.0)]);
        request.t_s = 100.0 + 5.0 * f64::from(k);
        request.previous_plan = previous.take();
        let plan = answer(request);
        let vessels = &plan.avoidance.as_ref().expect("comes near").vessels;
        seen.push(Vector2::new(vessels[0].north_mps, vessels[0].east_mps));
        previous = Some((&plan).into());
    }
    let off = |velocity: &Vector2<f64>| wrap(velocity.y.atan2(velocity.x) - PI).abs();
    assert!(off(&seen[9]) < 0.01 && 0.25 < off(&seen[10]), "{seen:?}");
}

#[test]
fn a_vessel_with_a_plan_is_foreseen_along_it_and_gives_no_way() {
    let met = |vessel: Vessel| answer(request(vec![vessel])).avoidance.expect("may come near");
    // From port: a vessel without a plan is to give way.
    let from_port = vessel("ship", [84.0, -600.0], PI / 2.0, 5.0);
    let straight = vec![[220.0, 84.0, 0.0], [400.0, 84.0, 900.0]];
    let (stands_on, gives_way) = (met(from_port.clone()), met(Vessel { plan: straight, ..from_port }));
    let told = |avoidance: &Avoidance| (avoidance.encounters[0].kind, avoidance.encounters[0].acts);
    assert_eq!(told(&stands_on), (EncounterKind::CrossingStandOn, false));
    assert_eq!(told(&gives_way), (EncounterKind::CrossingGiveWay, true));
    // Head-on, it turns away; on a parallel course, it turns towards the craft.
    let head_on = vessel("ship", [800.0, 0.0], PI, 5.0);
    let away = vec![[110.0, 750.0, 0.0], [130.0, 750.0, 100.0], [170.0, 750.0, 300.0]];
    assert!(met(head_on.clone()).manoeuvre.is_some());
    assert_eq!(met(Vessel { plan: away, ..head_on }).encounters, []);
    let beside = vessel("ship", [60.0, -400.0], 0.0, 5.0);
    let towards = vec![[180.0, 60.0, 0.0], [200.0, 60.0, 100.0]];
    assert_eq!(met(beside.clone()).encounters, []);
    assert!(met(Vessel { plan: towards, ..beside }).manoeuvre.is_some());
}

#[test]
fn a_sentence_tells_the_speed_of_a_slow_manoeuvre_only() {
    let mut seen = vec![];
    for k in 0..40 {
        let k = f64::from(k);
        let crosses = vessel("a", [20.0 + 4.0 * k, 120.0 + 9.0 * k], -PI / 2.0, 2.0 + 0.1 * k);
        let Some(avoidance) = answer(request(vec![crosses])).avoidance else { continue };
        seen.extend(avoidance.manoeuvre.map(|manoeuvre| (manoeuvre.speed_mps, avoidance.sentence)));
    }
    let most = seen.iter().map(|(speed, _)| *speed).fold(0.0, f64::max);
    // Manoeuvres are sailed at full speed, half of it, or none.
    let (slow, fast): (Vec<_>, Vec<_>) = seen.into_iter().partition(|(speed, _)| *speed < 0.75 * most);
    assert!(!slow.is_empty() && !fast.is_empty(), "{} {}", slow.len(), fast.len());
    assert!(fast.iter().all(|(_, sentence)| !sentence.contains("m/s")), "{fast:?}");
    for (speed, sentence) in slow {
        assert!(sentence.contains(&format!(" {speed:.1} m/s")), "{sentence}");
    }
}
