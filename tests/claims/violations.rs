//! Violated limits in an answer.

use nalgebra::Vector2;
use planner::{
    los::LosLaw,
    plan::{CostTerms, Method, SoftLimit, Subject, Unit, Violation},
    program::Slack,
    snapshot::{Acoustics, KeepOut, Limits, PlanRequest},
};
use serde_json::{Map, Value, json};
use tests::{auv, goals, observation, place, planned, snapshot, state};
use wire::{Answer, PlanResponse};

/// A craft that violates every limit of position: inside one of three discs, outside its area,
/// above an AUV at the surface and out of range of another.
fn amiss() -> PlanRequest {
    let mut scene = observation(goals()[0].clone());
    let disc = |north, radius| KeepOut::new(Vector2::new(north, 0.5), radius);
    scene.keep_outs = vec![disc(60.0, 3.0), disc(0.5, 6.0), disc(-60.0, 4.0)];
    scene.area = [[20.0, -50.0], [80.0, -50.0], [80.0, 50.0], [20.0, 50.0]].to_vec();
    scene.acoustics = Some(Acoustics { range_max_m: 30.0 });
    scene.surfacing_separation_m = Some(5.0);
    place(&mut scene, 1, Vector2::new(1.0, 1.0));
    state(&mut scene, 1).depth_m = 1.0;
    scene.auvs.push(auv("far", 200.0, 0.0, 0.0));
    scene
}

/// [`amiss`] with lists of possible violators that begin elsewhere.
fn listed_from(n: usize) -> PlanRequest {
    let mut scene = amiss();
    scene.keep_outs.rotate_left(n);
    scene.auvs.rotate_left(n);
    scene
}

fn broken(scene: PlanRequest) -> Vec<Violation> {
    planned(scene).violations
}

fn of_limit(violations: &[Violation], limit: SoftLimit) -> Violation {
    let found = violations.iter().find(|violation| violation.limit == limit);
    *found.unwrap_or_else(|| panic!("{limit:?} is broken: {violations:?}"))
}

#[test]
fn a_broken_limit_names_its_violator_at_any_place_in_the_list() {
    let as_listed = broken(amiss());
    for n in 0..3 {
        let violations = broken(listed_from(n));
        let place = |i: usize| (i + 3 - n) % 3;
        for (limit, pointer) in [
            (SoftLimit::AcousticRange, Some(Subject::Auv(place(2)))),
            (SoftLimit::Area, Some(Subject::Area)),
            (SoftLimit::KeepOut, Some(Subject::KeepOut(place(1)))),
            (SoftLimit::SurfacingSeparation, Some(Subject::Auv(place(1)))),
        ] {
            let (violation, before) = (of_limit(&violations, limit), of_limit(&as_listed, limit));
            assert_eq!(violation.pointer, pointer, "listed from {n}: {limit:?}");
            assert_eq!((violation.t_s, violation.amount), (before.t_s, before.amount));
        }
    }
}

#[test]
fn a_disc_and_an_auv_at_the_surface_are_distinguished() {
    let discs_only = broken(PlanRequest { surfacing_separation_m: None, ..amiss() });
    let about_discs = |violation: &Violation| violation.limit == SoftLimit::KeepOut;
    let about_auvs = |violation: &Violation| violation.limit == SoftLimit::SurfacingSeparation;
    assert!(discs_only.iter().any(about_discs) && !discs_only.iter().any(about_auvs));
    let auvs_only = broken(PlanRequest { keep_outs: vec![], ..amiss() });
    let violation = of_limit(&auvs_only, SoftLimit::SurfacingSeparation);
    assert_eq!(violation.pointer, Some(Subject::Auv(1)));
    assert!(!auvs_only.iter().any(about_discs));
}

#[test]
fn a_plan_names_the_limit_of_motion_that_it_violates() {
    // It goes at 0.3 m/s, and needs seconds to become as fast as it must be.
    let limits = Limits { speed_min: 1.0, ..Limits::MEDUSA };
    let plan = planned(PlanRequest { limits: Some(limits.into()), ..observation(goals()[0].clone()) });
    assert_eq!(plan.method, Method::Mpc);
    let violation = of_limit(&plan.violations, SoftLimit::ForwardSpeed);
    assert!(0.5 < violation.amount && violation.amount < 0.7, "{violation:?}");
}

#[test]
fn the_words_of_answers_are_fixed() {
    for (value, word) in [
        (json!(SoftLimit::ForwardSpeed), "forward_speed"),
        (json!(SoftLimit::TurnRate), "turn_rate"),
        (json!(SoftLimit::AcousticRange), "acoustic_range"),
        (json!(SoftLimit::Area), "area"),
        (json!(SoftLimit::KeepOut), "keep_out"),
        (json!(SoftLimit::SurfacingSeparation), "surfacing_separation"),
        (json!(SoftLimit::NoGo), "no_go"),
        (json!(Slack::Motion), "motion"),
        (json!(Slack::AcousticRange), "acoustic_range"),
        (json!(Slack::OtherRange), "other_range"),
        (json!(Slack::Area), "area"),
        (json!(Slack::KeepOut), "keep_out"),
        (json!(Unit::Metres), "m"),
        (json!(Unit::MetresPerSecond), "m/s"),
        (json!(Unit::MetresPerSecondSquared), "m/s²"),
        (json!(Unit::OfMotion), "m/s or m/s²"),
    ] {
        assert_eq!(value, word);
    }
    let terms = serde_json::to_string(&CostTerms::default()).expect("becomes JSON");
    let names = "acceleration broken_limits energy terminal tracking velocity".split(' ');
    let names: Vec<_> = names.map(|name| format!("\"{name}\":0.0")).collect();
    let expected = names.join(",");
    assert_eq!(terms, format!("{{{expected}}}"));
}

#[test]
fn the_pointer_of_a_violation_leads_to_its_member_of_the_request() {
    let snapshot = snapshot(listed_from(2));
    let request = serde_json::to_value(&*snapshot).expect("becomes JSON");
    let plan = planned(listed_from(2));
    let metadata = Map::new();
    let answer = Answer::new(&snapshot, &plan, std::time::Duration::ZERO, &metadata);
    for response in [answer.planned(), answer.law(LosLaw::SaturatedLos, &plan.baseline)] {
        let text = serde_json::to_string(&response).expect("becomes JSON");
        let received: PlanResponse = serde_json::from_str(&text).expect("has the shape");
        assert_eq!(received.violations, response.violations);
        let about = |limit: SoftLimit| -> &Value {
            let pointer = of_limit(&received.violations, limit).pointer;
            let pointer = pointer.unwrap_or_else(|| panic!("{limit:?} is broken by something: {text}"));
            request.pointer(&pointer.to_string()).expect("is in the request")
        };
        assert_eq!(about(SoftLimit::AcousticRange)["id"], "far");
        assert_eq!(about(SoftLimit::Area), &request["area"]);
        assert_eq!(about(SoftLimit::KeepOut)["radius_m"], json!(6.0));
        assert_eq!(about(SoftLimit::SurfacingSeparation)["id"], "auv-2");
        for broken in &received.violations {
            let of_motion = matches!(broken.limit, SoftLimit::ForwardSpeed | SoftLimit::TurnRate);
            assert_eq!(broken.pointer.is_none(), of_motion, "{broken:?}");
        }
    }
}
