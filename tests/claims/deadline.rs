//! Answers in time from the work finished by then, and unchanged answers if all work was finished.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use clock::Clock;
use planner::{
    los::LosLaw,
    parameters::Parameters,
    plan::{Degraded, Method, Plan, SolverReport, Workspace, baselines, plan, plan_until},
    snapshot::Snapshot,
    solve::SolverStatus,
    stop::Stop,
};
use serde_json::{Value, json};
use service::{Settings, app, examples::EXAMPLES};
use tests::client::{Answer, example, post, send_to, simulated_machine};
use tests::{followed, goals, observation, snapshot};

/// A signal that is due at look `n` from 0 on, and the number of looks.
pub(crate) fn due_at(n: usize) -> (Stop, Arc<AtomicUsize>) {
    let looks = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&looks);
    let stop = Stop::when(move || n <= counted.fetch_add(1, Ordering::Relaxed));
    (stop, looks)
}

fn stopped_at(n: usize, snapshot: &Snapshot, workspace: &mut Workspace) -> Plan {
    plan_until(snapshot, &Parameters::default(), workspace, &due_at(n).0)
}

/// The answer without the solver's report of its progress.
fn decision(mut plan: Plan) -> Plan {
    plan.solver = SolverReport {
        status: SolverStatus::Unsolved,
        scp_iterations: 0,
        iterations: 0,
        deadline_hit: false,
        solve_time_ms: None,
        residuals: None,
    };
    plan
}

#[test]
fn a_signal_that_is_never_due_changes_no_bit() {
    for goal in goals() {
        let snapshot = snapshot(observation(goal));
        let (parameters, mut workspace) = (Parameters::default(), Workspace::default());
        let alone = plan(&snapshot, &parameters, &mut workspace);
        let (stop, looks) = due_at(usize::MAX);
        let watched = plan_until(&snapshot, &parameters, &mut Workspace::default(), &stop);
        assert_eq!(watched, alone);
        assert!(!watched.solver.deadline_hit);
        // Once before each SCP iteration, and at least once for each of the interior-point solver.
        let least = alone.solver.iterations as usize + alone.solver.scp_iterations;
        assert!(least <= looks.load(Ordering::Relaxed));
    }
}

#[test]
fn the_last_finished_iteration_answers_or_else_the_law() {
    let snapshot = snapshot(observation(goals()[1].clone()));
    let whole = decision(plan(&snapshot, &Parameters::default(), &mut Workspace::default()));
    let law = decision(stopped_at(0, &snapshot, &mut Workspace::default()));
    assert_eq!((law.method, law.degraded), (Method::SaturatedLos, Some(Degraded::Deadline)));
    assert_eq!(law.reference, law.baseline.reference);

    // One workspace for all: interrupted work leaves no trace in it.
    let mut workspace = Workspace::default();
    let mut answers: Vec<Plan> = Vec::new();
    loop {
        let (stop, looks) = due_at(answers.len());
        let answer = plan_until(&snapshot, &Parameters::default(), &mut workspace, &stop);
        let hit = answer.solver.deadline_hit;
        assert_eq!(hit, answers.len() < looks.load(Ordering::Relaxed));
        // A certificate stands behind an answer that is not degraded, whatever its method.
        let unproved = answer.solver.residuals.is_none();
        assert_eq!(answer.degraded, unproved.then_some(Degraded::Deadline));
        answers.push(decision(answer));
        if !hit {
            break;
        }
    }
    let costs = answers.iter().map(|answer| answer.predicted.cost);
    assert!(costs.rev().is_sorted(), "later signals leave better answers");
    assert_eq!((&answers[0], &answers[answers.len() - 1]), (&law, &whole));
    let cut_short = |answer: &&Plan| answer.degraded.is_none() && **answer != whole;
    assert!(answers.iter().any(|answer| cut_short(&answer)));
}

#[test]
fn a_previous_plan_continues_without_a_finished_iteration() {
    let later = followed(2.0);
    for n in [0, 1, 4] {
        let answer = stopped_at(n, &snapshot(later.clone()), &mut Workspace::default());
        assert_eq!((answer.method, answer.degraded), (Method::PreviousPlan, Some(Degraded::Deadline)));
        assert!(answer.solver.deadline_hit);
    }
}

/// A gate at which the planner of a test waits, for any arguments.
static GATE: (Mutex<bool>, Condvar) = (Mutex::new(false), Condvar::new());

/// A planner that does not begin before the gate is open.
fn stubborn(snapshot: &Snapshot, parameters: &Parameters, workspace: &mut Workspace, stop: &Stop) -> Plan {
    let (is_open, opened) = &GATE;
    let is_open = is_open.lock().expect("no thread panics with it");
    drop(opened.wait_while(is_open, |is_open| !*is_open));
    plan_until(snapshot, parameters, workspace, stop)
}

fn assert_degraded_by_the_deadline(answer: &Answer) {
    let plan = answer.expected(200);
    let how = json!([plan["outcome"], plan["reason"], plan["method"]]);
    assert_eq!(how, json!(["degraded", "deadline", "saturated_los"]));
    assert_eq!(plan["solver"]["deadline_hit"], true);
    assert_eq!(plan["reference"]["speed_mps"], plan["baseline"]["speed_mps"]);
}

/// On real threads: their speed does not matter, because the planner waits for the test.
#[tokio::test]
async fn a_planner_that_does_not_stop_delays_no_answer_or_other_request() {
    let service = app(Settings {
        plan: stubborn,
        planners: 1,
        waiting: 1,
        // Reading may take that long.
        deadline: Duration::from_hours(1),
        ..Settings::default()
    });
    let mut hasty = example("track");
    hasty["deadline_ms"] = json!(1.0);
    // The planner has the first at its deadline, and the second waits.
    for _ in 0..2 {
        let answer = send_to(service.clone(), post("/v1/plan", hasty.to_string())).await;
        assert_degraded_by_the_deadline(&answer);
    }
    let (is_open, opened) = &GATE;
    *is_open.lock().expect("no thread panics with it") = true;
    opened.notify_all();
    let whole = send_to(service, post("/v1/plan", EXAMPLES[0].body)).await.json();
    let how = json!([whole["outcome"], whole["solver"]["deadline_hit"]]);
    assert_eq!(how, json!(["ok", false]));
}

/// A service that answers within `limit` and whose work waits `lag` for a thread: it reads a
/// request after `lag` and plans after twice that.
fn slow_service(lag: Duration, limit: Duration) -> (Clock, axum::Router) {
    let settings = Settings { deadline: limit, ..simulated_machine() };
    let clock = settings.clock.clone();
    clock.delay_threads(lag);
    (clock, app(settings))
}

#[tokio::test(start_paused = true)]
async fn the_earlier_of_both_deadlines_counts() {
    const LAG: Duration = Duration::from_millis(400);
    for (limit, deadline_ms) in [(Duration::from_millis(500), 60_000.0), (Duration::from_mins(1), 500.0)] {
        let (clock, service) = slow_service(LAG, limit);
        let start = clock.now();
        let mut request = example("track");
        request["deadline_ms"] = json!(deadline_ms);
        let answer = send_to(service, post("/v1/plan", request.to_string())).await;
        assert_degraded_by_the_deadline(&answer);
        // The lower levels also wait for a thread.
        assert_eq!(clock.since(start), Duration::from_millis(500) + LAG);
    }
}

#[tokio::test(start_paused = true)]
async fn an_explanation_without_time_left_delays_no_comparison() {
    // The request waits for a thread to be read, to be planned, and for the lower levels.
    for (lag_ms, took_ms, is_explained) in [(1_100, 3_100, false), (900, 1_800, true), (0, 0, true)] {
        let (clock, service) = slow_service(Duration::from_millis(lag_ms), Duration::from_mins(1));
        let start = clock.now();
        let mut request = example("track");
        request["deadline_ms"] = json!(2e3);
        let request = post("/v1/plan/compare?explain=true", request.to_string());
        let compared = send_to(service, request).await.expected(200);
        assert_eq!(clock.since(start), Duration::from_millis(took_ms));
        let mpc = &compared["plans"]["mpc"];
        assert_eq!(mpc["outcome"] == "ok", is_explained, "{compared}");
        assert_eq!(compared["explanation"].is_object(), is_explained, "{compared}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_law_is_degraded_only_if_the_deadline_shortened_its_schedule() {
    for (name, laws) in [("visit", "degraded"), ("track", "ok")] {
        let (_, service) = slow_service(Duration::from_millis(600), Duration::from_secs(1));
        let request = post("/v1/plan/compare", example(name).to_string());
        let compared = send_to(service.clone(), request).await.json();
        for law in LosLaw::ALL {
            let plan = &compared["plans"][law.name()];
            let reason = (laws == "degraded").then_some("deadline");
            assert_eq!(json!([plan["outcome"], plan["reason"]]), json!([laws, reason]));
            assert_eq!(plan["trajectory"].as_array().map(Vec::len), Some(31));
        }
        let mut strict = example(name);
        strict["fallback"] = json!("none");
        let refused = send_to(service, post("/v1/plan/compare", strict.to_string())).await;
        refused.must_refuse(504, "timed_out");
    }
}

#[test]
fn laws_and_plan_share_a_schedule_and_keep_the_deadline() {
    let request = serde_json::from_value(example("visit")).expect("has the shape");
    let (snapshot, parameters) = (snapshot(request), Parameters::default());
    let (never, looks) = due_at(usize::MAX);
    let whole = baselines(&snapshot, &parameters, &never);
    let looks = looks.load(Ordering::Relaxed);
    let plan = plan(&snapshot, &parameters, &mut Workspace::default());
    assert_eq!(whole[0], plan.baseline);
    assert!(whole.iter().all(|law| law.degraded.is_none()));
    let tried = parameters.scheduling.visits_tried / 100;
    assert!((tried..100 * tried).contains(&looks), "{looks}: once for all laws");
    for n in [0, 1, looks / 2, looks - 1] {
        let (stop, looked) = due_at(n);
        for law in baselines(&snapshot, &parameters, &stop) {
            assert_eq!(law.degraded, Some(Degraded::Deadline));
        }
        assert!(looked.load(Ordering::Relaxed) <= n + 40, "each first visit is tried");
    }
}

#[test]
fn estimates_without_time_use_the_newest_reports_and_keep_the_track() {
    let mut request = tests::observation(goals()[0].clone());
    let at = |k: u32| {
        let (t_s, wrong) = (f64::from(k) * 10.0, if k < 40 { 900.0 } else { 0.0 });
        json!({ "t_s": t_s, "north_m": 100.0 + wrong, "east_m": 0.3 * t_s, "sigma_m": 1.5 })
    };
    let reports: Vec<_> = (0..64).map(at).collect();
    let auv = json!({ "id": request.auvs[0].id, "reports": reports });
    request.t_s = 640.0;
    request.auvs[0] = serde_json::from_value(auv).expect("has the shape");
    let whole = Snapshot::try_from(request.clone()).expect("is valid");
    let hasty = Snapshot::until(request, &|| true).expect("is valid");
    assert!(hasty.cut_short() && !whole.cut_short());
    let [whole, estimate] = [&whole, &hasty].map(|snapshot| &snapshot.estimates()[0]);
    assert!((whole.state.position() - estimate.state.position()).norm() < 3.0);
    assert!((whole.state.speed_mps - estimate.state.speed_mps).abs() < 0.1);
    assert_eq!((&*estimate.rejected, estimate.looked_at), (&[] as &[usize], 8));
    assert!(!estimate.track.is_empty());
    let plan = plan(&hasty, &Parameters::default(), &mut Workspace::default());
    // No program is solved for less than what is known.
    assert!(plan.solver.deadline_hit);
    assert_eq!(plan.degraded, Some(Degraded::Deadline));
    assert_eq!(plan.baseline.degraded, Some(Degraded::Deadline));
}

/// The planners that work until they are stopped: those that have begun, and that have ended.
static WORK: [AtomicUsize; 2] = [AtomicUsize::new(0), AtomicUsize::new(0)];

/// Calls, and cancels once the planner has begun and `meanwhile` is done.
async fn given_up(service: &axum::Router, path: &str, body: &Value, meanwhile: impl AsyncFnOnce()) {
    let [begun, ended] = &WORK;
    let before = begun.load(Ordering::Relaxed);
    let call = tokio::spawn(send_to(service.clone(), post(path, body.to_string())));
    while begun.load(Ordering::Relaxed) == before {
        tokio::task::yield_now().await;
    }
    assert_eq!(ended.load(Ordering::Relaxed), before);
    meanwhile().await;
    call.abort();
    while ended.load(Ordering::Relaxed) == before {
        tokio::task::yield_now().await;
    }
}

/// With the threads of the machine, and a deadline beyond the test.
#[tokio::test]
async fn work_for_a_disconnected_client_ends_and_all_work_is_admitted() {
    let mut settings = Settings { planners: 1, deadline: Duration::from_hours(1), ..Settings::default() };
    settings.plan = |snapshot, parameters, workspace, stop| {
        WORK[0].fetch_add(1, Ordering::Relaxed);
        while !stop.is_due() {
            std::thread::yield_now();
        }
        WORK[1].fetch_add(1, Ordering::Relaxed);
        plan_until(snapshot, parameters, workspace, stop)
    };
    let service = app(settings.clone());
    let batch = json!({ "requests": [example("track"), example("track")] });
    given_up(&service, "/v1/plan", &example("track"), async || ()).await;
    given_up(&service, "/v1/plan/compare", &example("visit"), async || ()).await;
    given_up(&service, "/v1/plan/batch", &batch, async || ()).await;
    // The second of the batch did not begin.
    let ready = send_to(service, post("/v1/plan/validate", EXAMPLES[0].body)).await;
    ready.must_be(200);
    assert_eq!(WORK[0].load(Ordering::Relaxed), 3);
    let full = app(Settings { waiting: 0, ..settings });
    let route = async || {
        let refused = send_to(full.clone(), post("/v1/routes", "lat,lon\n1,1")).await;
        refused.must_be(503);
    };
    given_up(&full, "/v1/plan", &example("track"), route).await;
}

#[tokio::test(start_paused = true)]
async fn a_hung_planner_stops_the_heartbeat() {
    const PERIOD: Duration = Duration::from_secs(8);
    static BEATS: AtomicUsize = AtomicUsize::new(0);
    let settings = Settings {
        heartbeat: Some((PERIOD, || _ = BEATS.fetch_add(1, Ordering::Relaxed))),
        ..simulated_machine()
    };
    let clock = settings.clock.clone();
    let _service = app(settings);
    clock.sleep(PERIOD.saturating_sub(Duration::from_millis(1))).await;
    // Four beats a period.
    assert_eq!(BEATS.load(Ordering::Relaxed), 4);
    clock.delay_threads(Duration::MAX);
    clock.sleep(Duration::from_hours(1)).await;
    assert_eq!(BEATS.load(Ordering::Relaxed), 4);
}
