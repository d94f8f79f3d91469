//! No-go areas are kept out of, and led round.

use nalgebra::Vector2;
use pilotfish_planner::{
    angle::{Course, Heading},
    craft::{Craft, CraftDescription},
    parameters::Parameters,
    plan::{Plan, SoftLimit, Workspace, plan},
    snapshot::{Asc, Auv, AuvState, Goal, LeftOut, Limits, NoGo, PlanRequest, PreviousPlan, Snapshot},
};

/// A bay that opens to the south, with its back to the north.
const BAY: [[f64; 2]; 8] = [
    [-40.0, -20.0],
    [5.0, -20.0],
    [5.0, 20.0],
    [-40.0, 20.0],
    [-40.0, 15.0],
    [0.0, 15.0],
    [0.0, -15.0],
    [-40.0, -15.0],
];

/// A craft 10 m from the back of the bay, which tracks an AUV at rest.
fn scene(craft: [f64; 2], auv: [f64; 2]) -> PlanRequest {
    let state = AuvState::new(auv.into(), 5.0, Course::new(0.0), 0.0);
    let asc = Asc::new(craft.into(), Heading::new(0.0), 0.3);
    PlanRequest {
        current: Some(Vector2::zeros().into()),
        limits: Some(Limits::MEDUSA.into()),
        craft: Some(CraftDescription::from(&Craft::MEDUSA)),
        no_go: vec![NoGo::new(BAY.to_vec())],
        ..PlanRequest::new(0.0, asc, vec![Auv::new("a", state)], Goal::Track { auv: "a".into() })
    }
}

fn planned(request: &PlanRequest, workspace: &mut Workspace) -> (Snapshot, Plan) {
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let answer = plan(&snapshot, &Parameters::default(), workspace);
    (snapshot, answer)
}

/// The craft's places in exactly followed plans, 2 s of each, until it is within 3 m of `to`.
fn way_to(to: [f64; 2], mut request: PlanRequest) -> Vec<Vector2<f64>> {
    let (mut workspace, mut places) = (Workspace::default(), vec![request.asc.position()]);
    while (places[places.len() - 1] - Vector2::from(to)).norm() > 3.0 && places.len() < 150 {
        let (snapshot, answer) = planned(&request, &mut workspace);
        assert_eq!(snapshot.no_go_at(&request.asc.position()), None, "{places:?}");
        let next = answer.trajectory[2];
        request.t_s = next.t_s;
        [request.asc.north_m, request.asc.east_m] = next.position().into();
        (request.asc.heading_rad, request.asc.speed_mps) = (next.heading_rad, next.speed_mps);
        // A craft set on its plan responds to no reference: nothing can be learnt.
        request.previous_plan = Some(PreviousPlan { craft_estimate: None, ..(&answer).into() });
        places.push(next.position());
    }
    places
}

#[test]
fn a_craft_in_a_bay_goes_round_its_arm_to_an_auv_behind_it() {
    let (craft, auv) = ([-10.0, 4.0], [20.0, 3.0]);
    let places = way_to(auv, scene(craft, auv));
    let length: f64 = places.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
    // Taut round the corners of the eastern arm.
    let corners = [craft, [-40.0, 15.0], [-40.0, 20.0], [5.0, 20.0], auv].map(Vector2::from);
    let taut: f64 = corners.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
    // It keeps off the corners and first has to turn round.
    assert!(places.len() < 150 && length < 1.15 * taut, "{} places, {length} {taut}", places.len());
}

#[test]
fn a_goal_inside_is_followed_from_the_nearest_place_outside() {
    let (_, answer) = planned(&scene([20.0, 0.0], [3.0, 1.0]), &mut Workspace::default());
    assert_eq!(answer.goal_in_no_go, Some(0));
    let last = answer.goal.last().expect("a horizon");
    assert!((5.5..7.0).contains(&last.north_m) && (last.east_m - 1.0).abs() < 1e-6, "{last:?}");
}

#[test]
fn a_craft_inside_takes_the_nearest_way_out_and_the_violation_names_the_area() {
    let (snapshot, answer) = planned(&scene([3.5, 0.0], [20.0, 0.0]), &mut Workspace::default());
    assert_eq!(snapshot.no_go_at(&snapshot.asc.position()), Some(0));
    let broken = answer.violations.iter().find(|violation| violation.limit == SoftLimit::NoGo);
    let pointer = broken.and_then(|violation| violation.pointer).map(|subject| subject.to_string());
    assert_eq!(pointer.as_deref(), Some("/no_go/0"));
    let out = answer.trajectory[6].position();
    assert!(5.0 < out.x && out.y.abs() < 1.0, "{out}");
}

#[test]
fn a_craft_in_one_of_two_areas_that_touch_leaves_both() {
    // Shallows before land: the border that they share is nearer than the sea.
    let square = |south, north| NoGo::new(vec![[south, 0.0], [south, 100.0], [north, 100.0], [north, 0.0]]);
    let mut request = scene([15.0, 50.0], [-40.0, 50.0]);
    request.no_go = vec![square(0.0, 20.0), square(20.0, 200.0)];
    let mut workspace = Workspace::default();
    for _ in 0..20 {
        let (_, answer) = planned(&request, &mut workspace);
        let next = answer.trajectory[2];
        request.t_s = next.t_s;
        [request.asc.north_m, request.asc.east_m] = next.position().into();
        (request.asc.heading_rad, request.asc.speed_mps) = (next.heading_rad, next.speed_mps);
        request.previous_plan = Some(PreviousPlan { craft_estimate: None, ..(&answer).into() });
    }
    assert!(request.asc.north_m < 0.0, "{}", request.asc.north_m);
}

#[test]
fn a_craft_that_faces_a_wall_turns_slowly_beside_it() {
    // 2 to 3 m from the western arm, less than a turn takes, with the way out on its side.
    for east in [-12.0, -12.5, -13.0] {
        for heading in [-0.8, -1.2, -1.6, -2.0] {
            let mut request = scene([-10.0, east], [20.0, 3.0]);
            request.asc.heading_rad = heading;
            let (snapshot, answer) = planned(&request, &mut Workspace::default());
            let is_ashore =
                answer.trajectory.iter().any(|point| snapshot.no_go_at(&point.position()).is_some());
            assert!(!is_ashore, "from {east}, {heading}: {:?} {:?}", answer.method, answer.trajectory);
        }
    }
}

#[test]
fn a_visit_takes_the_way_round_into_its_time() {
    let (craft, auv) = ([-10.0, 4.0], [20.0, 3.0]);
    let visits = serde_json::json!({ "auvs": ["a"], "costs_now": { "a": 100.0 }, "within_m": 1.0 });
    let mut request = scene(craft, auv);
    request.goal = Goal::Visit(serde_json::from_value(visits).expect("visits")).into();
    let arrival = |request: &PlanRequest| {
        let schedule = planned(request, &mut Workspace::default()).1.schedule.expect("the goal visits");
        schedule.visits[0].arrive_s
    };
    let round = arrival(&request);
    request.no_go.clear();
    let corners = [craft, [-40.0, 15.0], [-40.0, 20.0], [5.0, 20.0], auv].map(Vector2::from);
    let taut: f64 = corners.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
    let straight = (Vector2::from(auv) - Vector2::from(craft)).norm();
    // The way keeps a metre or so off each of the three corners.
    let longer = (round - arrival(&request)) * Limits::MEDUSA.speed_max;
    assert!((taut - straight..taut - straight + 8.0).contains(&longer), "{longer} {}", taut - straight);
}

#[test]
fn an_auv_to_which_no_way_leads_is_out_of_reach_and_the_others_are_visited() {
    let visits =
        serde_json::json!({ "auvs": ["a", "b"], "costs_now": { "a": 900.0, "b": 1.0 }, "within_m": 1.0 });
    let mut request = scene([-10.0, 4.0], [60.0, 0.0]);
    request.auvs.push(Auv::new("b", AuvState::new([20.0, 3.0].into(), 5.0, Course::new(0.0), 0.0)));
    request.goal = Goal::Visit(serde_json::from_value(visits).expect("visits")).into();
    let first = |request: &PlanRequest| {
        let schedule = planned(request, &mut Workspace::default()).1.schedule.expect("the goal visits");
        let left_out: Vec<_> = schedule.costs.iter().map(|known| known.left_out).collect();
        (schedule.visits[0].auv.0.clone(), left_out)
    };
    assert_eq!(first(&request), ("a".to_owned(), vec![None, None]));
    // An atoll about the first one.
    let square = |by: f64| vec![[60.0 - by, -by], [60.0 - by, by], [60.0 + by, by], [60.0 + by, -by]];
    request.no_go.push(NoGo { holes: vec![square(10.0)], ..NoGo::new(square(20.0)) });
    assert_eq!(first(&request), ("b".to_owned(), vec![Some(LeftOut::OutOfReach), None]));
}
