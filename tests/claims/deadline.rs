//! An answer in time, from whatever was finished by then; and the same answer as ever if everything was.

use std::{
    sync::{
        Arc, Condvar, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread::sleep,
    time::Duration,
};

use axum::http::StatusCode;
use planner::{
    parameters::Parameters,
    plan::{Degraded, Method, Plan, SolverReport, Workspace, plan, plan_until},
    snapshot::Snapshot,
    solve::SolverStatus,
    stop::Stop,
};
use serde_json::json;
use service::{Settings, app, examples::EXAMPLES};
use tests::{
    client::{Answer, example, post, send_to},
    followed, goals, observation, snapshot,
};

/// Due at look number `n`, the first being 0; and how often it was looked at.
fn due_at(n: usize) -> (Stop, Arc<AtomicUsize>) {
    let looks = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&looks);
    let stop = Stop::when(move || n <= counted.fetch_add(1, Ordering::Relaxed));
    (stop, looks)
}

fn stopped_at(n: usize, snapshot: &Snapshot, workspace: &mut Workspace) -> Plan {
    plan_until(snapshot, &Parameters::default(), workspace, &due_at(n).0)
}

/// The answer without the solver's report, which tells how far it came.
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
        let alone = plan(&snapshot, &Parameters::default(), &mut Workspace::default());
        let (stop, looks) = due_at(usize::MAX);
        let watched = plan_until(
            &snapshot,
            &Parameters::default(),
            &mut Workspace::default(),
            &stop,
        );
        assert_eq!(watched, alone);
        assert!(!watched.solver.deadline_hit);
        // Once before each SCP iteration, and at least once for each of the interior-point solver.
        let least = alone.solver.iterations as usize + alone.solver.scp_iterations;
        assert!(least <= looks.load(Ordering::Relaxed));
    }
}

#[test]
fn whenever_the_signal_comes_the_last_finished_iteration_answers_and_before_the_first_the_law_does() {
    let snapshot = snapshot(observation(goals()[1].clone()));
    let whole = decision(plan(&snapshot, &Parameters::default(), &mut Workspace::default()));
    let law = decision(stopped_at(0, &snapshot, &mut Workspace::default()));
    assert_eq!(
        (law.method, law.degraded),
        (Method::SaturatedLos, Some(Degraded::Deadline))
    );
    assert_eq!(law.reference, law.baseline.reference);

    // One workspace for all: what was cut short leaves no trace in it.
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
fn without_a_finished_iteration_a_previous_plan_is_followed_further() {
    let later = followed(2.0);
    for n in [0, 1, 4] {
        let answer = stopped_at(n, &snapshot(later.clone()), &mut Workspace::default());
        assert_eq!(
            (answer.method, answer.degraded),
            (Method::PreviousPlan, Some(Degraded::Deadline))
        );
        assert!(answer.solver.deadline_hit);
    }
}

/// A gate that a planner waits at, whatever its arguments.
struct Gate {
    open: Mutex<bool>,
    opened: Condvar,
}

impl Gate {
    const fn shut() -> Self {
        Self {
            open: Mutex::new(false),
            opened: Condvar::new(),
        }
    }

    fn wait(&self) {
        let open = self.open.lock().expect("no thread panics with it");
        drop(
            self.opened
                .wait_while(open, |open| !*open)
                .expect("no thread panics with it"),
        );
    }

    fn open(&self) {
        *self.open.lock().expect("no thread panics with it") = true;
        self.opened.notify_all();
    }
}

/// One for each test that needs one.
static GATES: [Gate; 3] = [Gate::shut(), Gate::shut(), Gate::shut()];

/// A planner that does not begin before gate number `GATE` is open.
fn stubborn<const GATE: usize>(
    snapshot: &Snapshot,
    parameters: &Parameters,
    workspace: &mut Workspace,
    stop: &Stop,
) -> Plan {
    GATES[GATE].wait();
    plan_until(snapshot, parameters, workspace, stop)
}

fn assert_degraded_by_the_deadline(answer: &Answer) {
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    let plan = answer.json();
    assert_eq!(
        (&plan["outcome"], &plan["reason"], &plan["method"]),
        (&json!("degraded"), &json!("deadline"), &json!("saturated_los"))
    );
    assert_eq!(plan["solver"]["deadline_hit"], true);
    assert_eq!(plan["reference"]["speed_mps"], plan["baseline"]["speed_mps"]);
}

#[tokio::test]
async fn a_planner_that_does_not_stop_holds_up_no_answer_and_no_other_request() {
    let service = app(Settings {
        plan: stubborn::<0>,
        planners: 1,
        waiting: 1,
        ..Settings::default()
    });
    let mut hasty = example("track");
    hasty["deadline_ms"] = json!(500.0);
    // The first is with the planner when its deadline comes, the second waits for it.
    for _ in 0..2 {
        let answer = send_to(service.clone(), post("/v1/plan", hasty.to_string())).await;
        assert_degraded_by_the_deadline(&answer);
    }
    GATES[0].open();
    let whole = send_to(service, post("/v1/plan", EXAMPLES[0].body)).await.json();
    assert_eq!(
        (&whole["outcome"], &whole["solver"]["deadline_hit"]),
        (&json!("ok"), &json!(false))
    );
}

#[tokio::test]
async fn the_sooner_of_both_deadlines_counts() {
    let service = app(Settings {
        plan: stubborn::<1>,
        deadline: Duration::from_millis(500),
        ..Settings::default()
    });
    let mut patient = example("track");
    patient["deadline_ms"] = json!(60_000.0);
    let answer = send_to(service, post("/v1/plan", patient.to_string())).await;
    assert_degraded_by_the_deadline(&answer);
    GATES[1].open();
}

/// A planner that uses its time up, and then gives the plan that it had at once.
fn unhurried(snapshot: &Snapshot, parameters: &Parameters, workspace: &mut Workspace, stop: &Stop) -> Plan {
    let plan = plan(snapshot, parameters, workspace);
    while !stop.is_due() {
        sleep(Duration::from_micros(100));
    }
    plan
}

#[tokio::test]
async fn an_explanation_for_which_no_time_is_left_keeps_no_comparison_waiting_and_spoils_none() {
    let compare = |plan, deadline_ms: f64| {
        let service = app(Settings {
            plan,
            deadline: Duration::from_mins(1),
            ..Settings::default()
        });
        let mut request = example("track");
        request["deadline_ms"] = json!(deadline_ms);
        let request = post("/v1/plan/compare?explain=true", request.to_string());
        async move {
            let answer = send_to(service, request).await;
            assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
            answer.json()
        }
    };
    // Half of the last millisecond is too short to solve a program for the explanation. On a busy machine the plan itself
    // may be late.
    let compared = compare(unhurried, 2e3).await;
    let mpc = &compared["plans"]["mpc"];
    assert!(mpc["outcome"] == "ok" || mpc["reason"] == "deadline", "{mpc}");
    assert!(compared.get("explanation").is_none());
    let compared = compare(plan_until, 60e3).await;
    assert!(compared["explanation"].is_object());
}

#[tokio::test]
async fn a_comparison_is_answered_whatever_the_deadline() {
    let service = app(Settings::default());
    for deadline_ms in [0.05, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0] {
        let mut hasty = example("intermittent");
        hasty["deadline_ms"] = json!(deadline_ms);
        let request = post("/v1/plan/compare?explain=true", hasty.to_string());
        let answer = send_to(service.clone(), request).await;
        assert_eq!(answer.status, StatusCode::OK, "{deadline_ms}: {}", answer.text);
        assert!(answer.json()["plans"]["mpc"]["reference"].is_object());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hung_planner_stops_the_heartbeat() {
    static WELL: AtomicUsize = AtomicUsize::new(0);
    static HUNG: AtomicUsize = AtomicUsize::new(0);
    // A quarter of it is the time for a plan, even in a debug build on a busy machine.
    let period = Duration::from_secs(8);
    let _well = app(Settings {
        heartbeat: Some((period, || _ = WELL.fetch_add(1, Ordering::Relaxed))),
        ..Settings::default()
    });
    let _hung = app(Settings {
        plan: stubborn::<2>,
        heartbeat: Some((period, || _ = HUNG.fetch_add(1, Ordering::Relaxed))),
        ..Settings::default()
    });
    let beats = async {
        while WELL.load(Ordering::Relaxed) < 4 {
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    };
    tokio::time::timeout(Duration::from_mins(1), beats)
        .await
        .expect("beats");
    assert_eq!(HUNG.load(Ordering::Relaxed), 0);
    GATES[2].open();
}
