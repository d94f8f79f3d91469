//! Memory of a workspace.

use allocation_counter::measure;
use pilotfish_planner::{
    Asc, Auv, AuvState, Goal, Parameters, Snapshot, Workspace,
    angle::{Course, Heading},
    nalgebra::Vector2,
    plan::plan_until,
    snapshot::{KeepOut, PlanRequest, Tuning},
    solve::KEPT_BYTES_MAX,
    stop::Stop,
};

/// A request with `n_auvs` in acoustic ranges, `n_discs` and `n_steps`.
fn shape(n_auvs: usize, n_discs: usize, n_steps: usize) -> Snapshot {
    let at = |k: usize| Vector2::new(30.0 * f64::from(u8::try_from(k).expect("small")), 40.0);
    let auv = |k: usize| {
        let state = AuvState::new(at(k), 8.0, Course::new(0.0), 0.3);
        Auv::new(format!("auv-{k}").as_str(), state)
    };
    let auvs: Vec<_> = (0..n_auvs).map(auv).collect();
    let craft = Asc::new(Vector2::zeros(), Heading::new(0.0), 1.0);
    let goal = Goal::Range { auvs: auvs.iter().map(|auv| auv.id.clone()).collect(), range_m: 500.0 };
    let mut request = PlanRequest::new(0.0, craft, auvs, goal);
    request.keep_outs = (0..n_discs).map(|k| KeepOut::new(at(k) * -1.0, 3.0)).collect();
    request.tuning = Some(Tuning { steps_s: Some(vec![1.0; n_steps]), ..Tuning::default() });
    Snapshot::try_from(request).expect("is valid")
}

fn planned(workspace: &mut Workspace, snapshot: &Snapshot) {
    let looks = std::sync::atomic::AtomicU32::new(0);
    // The subproblem is stated and its solver set up; the result is irrelevant.
    let stop = Stop::when(move || 4 < looks.fetch_add(1, std::sync::atomic::Ordering::Relaxed));
    let _ = plan_until(snapshot, &Parameters::default(), workspace, &stop);
}

#[test]
fn the_stated_size_of_a_workspace_is_its_allocation() {
    for (n_auvs, n_discs, n_steps) in [(1, 0, 30), (2, 3, 30), (16, 0, 30), (16, 32, 30), (16, 32, 120)] {
        let snapshot = shape(n_auvs, n_discs, n_steps);
        let mut workspace = Workspace::default();
        planned(&mut Workspace::default(), &snapshot);
        let taken = measure(|| planned(&mut workspace, &snapshot)).bytes_current;
        let (said, taken) = (workspace.bytes(), usize::try_from(taken).expect("takes memory"));
        let is_near = 3 * taken < 4 * said && 3 * said < 4 * taken;
        assert!(is_near, "{said} said, {taken} taken");
    }
}

#[test]
fn a_workspace_respects_its_limit_for_any_shapes() {
    let mut workspace = Workspace::default();
    let mut most = 0;
    for n_discs in 0..12 {
        planned(&mut workspace, &shape(16, n_discs, 120));
        most = most.max(workspace.bytes());
        // A value larger than the limit remains while in use.
        assert!(workspace.bytes() <= 4 * KEPT_BYTES_MAX, "{}", workspace.bytes());
    }
    assert!(KEPT_BYTES_MAX < most);
    let before = workspace.bytes();
    let freed = measure(|| workspace.shrink()).bytes_current;
    assert!(workspace.bytes() <= 2 * KEPT_BYTES_MAX);
    let less = i64::try_from(before - workspace.bytes()).expect("is small");
    assert!(3 * less <= 4 * -freed, "{before} {less} {freed}");
}

#[test]
fn ordinary_shapes_are_set_up_once() {
    let shapes: Vec<_> = (0..8).map(|n_discs| shape(2, n_discs, 30)).collect();
    let mut workspace = Workspace::default();
    let mut round = || {
        let taken = measure(|| {
            for shape in &shapes {
                planned(&mut workspace, shape);
            }
            workspace.shrink();
        });
        (taken.bytes_current, taken.bytes_total)
    };
    let (first, again) = (round(), round());
    assert_eq!(again.0, 0, "nothing more is kept");
    assert!(3 * again.1 < first.1, "{again:?} after {first:?}");
}
