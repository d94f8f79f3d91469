//! Tuning in a request: the library's parameters, each with its documented effect.

use pilotfish_planner::{
    nalgebra::Vector2,
    parameters::{Parameters, Weights},
    plan::{Degraded, Plan, Programs, Workspace, plan, plan_with},
    program::Program,
    snapshot::{PlanRequest, PreviousPlan, Snapshot, Tuning, ranges_by_shape},
    solve::{Solution, Solvers},
};
use serde_json::json;

/// All examples except the visits, whose schedule has its own horizon.
const EXAMPLES: [(&str, &str); 8] = [
    (
        "about-face",
        include_str!("../../examples/snapshots/about-face.json"),
    ),
    (
        "cross-current",
        include_str!("../../examples/snapshots/cross-current.json"),
    ),
    ("crowded", include_str!("../../examples/snapshots/crowded.json")),
    (
        "intermittent",
        include_str!("../../examples/snapshots/intermittent.json"),
    ),
    ("midpoint", include_str!("../../examples/snapshots/midpoint.json")),
    ("offset", include_str!("../../examples/snapshots/offset.json")),
    ("range", include_str!("../../examples/snapshots/range.json")),
    ("track", include_str!("../../examples/snapshots/track.json")),
];

/// Relative distance of a partial term from its optimum by the solver's tolerance.
const FLATNESS: f64 = 1e-3;

fn example(name: &str) -> PlanRequest {
    let (_, text) = EXAMPLES
        .iter()
        .find(|(other, _)| *other == name)
        .expect("is an example");
    serde_json::from_str(text).expect("is a request")
}

fn snapshot(request: PlanRequest) -> Snapshot {
    Snapshot::try_from(request).expect("is valid")
}

fn with(tuning: Tuning, request: &PlanRequest) -> Snapshot {
    snapshot(PlanRequest {
        tuning: Some(tuning),
        ..request.clone()
    })
}

fn planned(snapshot: &Snapshot) -> Plan {
    plan(snapshot, &Parameters::default(), &mut Workspace::default())
}

fn horizon(steps: &[f64]) -> Tuning {
    Tuning {
        steps_s: Some(steps.to_vec()),
        ..Tuning::default()
    }
}

/// All digits of a plan.
fn digits(plan: &Plan) -> String {
    format!("{plan:?}")
}

#[test]
fn tuning_in_json_is_the_library_s_parameters_to_the_digit() {
    let tuning: Tuning = serde_json::from_value(json!({
        "position_weight_per_m2": 0.5,
        "velocity_weight_per_m2ps2": 20.0,
        "acceleration_weight_per_m2ps4": 300.0,
        "terminal_position_weight_per_m2": 5.0,
        "terminal_velocity_weight_per_m2ps2": 60.0,
        "energy_weight_per_j": 0.3,
        "scp_iterations": 3,
        "steps_s": [1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 8.0, 8.0],
    }))
    .expect("has every member");
    let set = Parameters {
        steps: vec![1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 8.0, 8.0],
        scp_iterations: 3,
        weights: Weights {
            position: 0.5,
            velocity: 20.0,
            acceleration: 300.0,
            terminal_position: 5.0,
            terminal_velocity: 60.0,
            energy: 0.3,
            ..Weights::default()
        },
        ..Parameters::default()
    };
    for (name, _) in EXAMPLES {
        let request = example(name);
        let on_the_wire = planned(&with(tuning.clone(), &request));
        let in_the_library = plan(&snapshot(request.clone()), &set, &mut Workspace::default());
        assert_eq!(digits(&on_the_wire), digits(&in_the_library), "{name}");
        let usual = planned(&snapshot(request));
        assert_ne!(usual.predicted, on_the_wire.predicted, "{name}");
    }
}

#[test]
fn default_tuning_and_none_give_identical_answers() {
    let usual = Parameters::default();
    let defaults = Tuning {
        position_weight_per_m2: Some(usual.weights.position),
        energy_weight_per_j: Some(0.0),
        scp_iterations: Some(usual.scp_iterations),
        steps_s: Some(usual.steps.clone()),
        ..Tuning::default()
    };
    for (name, _) in EXAMPLES {
        let request = example(name);
        let without = snapshot(request.clone());
        let json = serde_json::to_value(PlanRequest::clone(&without)).expect("is JSON");
        assert_eq!(json.get("tuning"), None, "{name}: the digest would be another");
        for tuning in [Tuning::default(), defaults.clone()] {
            let answer = planned(&with(tuning, &request));
            assert_eq!(digits(&planned(&without)), digits(&answer), "{name}");
        }
    }
}

#[test]
fn a_horizon_of_another_length_continues_the_previous_plan_in_one_workspace() {
    let (mut workspace, mut request) = (Workspace::default(), example("intermittent"));
    let mut before = planned(&snapshot(request.clone()));
    let lengths: [&[f64]; 4] = [&[2.0; 40], &[4.0; 5], &[1.0; 120], &[10.0; 60]];
    for steps in lengths {
        // A second later, on the previous plan's trajectory.
        let now = before.trajectory[0].t_s + 1.0;
        let (from, to) = (&before.trajectory[0], &before.trajectory[1]);
        let place = from.position().lerp(&to.position(), 1.0 / (to.t_s - from.t_s));
        (request.t_s, request.asc.north_m, request.asc.east_m) = (now, place.x, place.y);
        request.previous_plan = Some(PreviousPlan::from(&before));
        let snapshot = with(horizon(steps), &request);
        let answer = plan(&snapshot, &Parameters::default(), &mut workspace);
        assert_eq!(answer.degraded, None);
        assert_eq!(answer.trajectory.len(), steps.len() + 1);
        let last = answer.trajectory[steps.len()].t_s;
        assert!((last - now - steps.iter().sum::<f64>()).abs() < 1e-9);
        let (anew, shared) = (digits(&planned(&snapshot)), digits(&answer));
        assert_eq!(anew, shared, "the workspace shows");
        // The reference turns from the previous one no faster than the craft.
        let turned = answer.reference.heading.radians() - before.reference.heading.radians();
        assert!(turned.abs() < 0.2, "{} steps: {turned}", steps.len());
        before = answer;
    }
}

/// Without iterations: more than a few may end with motion rows violated late in the horizon.
#[test]
fn every_weight_at_the_ends_of_its_range_keeps_the_limits_and_solves() {
    let levers = ranges_by_shape().filter(|(shape, _)| *shape == "Tuning");
    let weights = levers.filter(|(_, (lever, _))| *lever != "scp_iterations");
    for (_, (lever, range)) in weights {
        for end in [*range.start(), *range.end()] {
            let tuning: Tuning = serde_json::from_value(json!({ lever: end })).expect("is a lever");
            for (name, _) in EXAMPLES {
                let request = example(name);
                let usual = planned(&snapshot(request.clone()));
                let answer = planned(&with(tuning.clone(), &request));
                assert_eq!(answer.degraded, None, "{name}, {lever} = {end}");
                let broken = |plan: &Plan| plan.violations.iter().map(|one| one.amount).fold(0.0, f64::max);
                assert!(
                    broken(&answer) <= broken(&usual) + 0.01,
                    "{name}, {lever} = {end}: {:?}",
                    answer.violations
                );
            }
        }
    }
}

/// The first program of `snapshot`, and its solution.
fn first_program(snapshot: &Snapshot) -> (Program, Solution) {
    let (mut solvers, mut first) = (Solvers::default(), None);
    let answer = plan_with(
        snapshot,
        &Parameters::default(),
        &mut Programs::default(),
        &mut |program| {
            let solution = solvers.solve(program);
            first.get_or_insert_with(|| (program.clone(), solution.clone()));
            solution
        },
    );
    assert_eq!(answer.degraded, None::<Degraded>);
    first.expect("a program was solved")
}

/// The terms that the weights reduce, of the velocities through the water and the deviations at the
/// stages of a solution. Columns as in docs/program.md: deviation in tens of metres and velocity.
fn terms(program: &Program, solution: &Solution, snapshot: &Snapshot) -> [f64; 3] {
    let parameters = Parameters::default();
    let steps = &parameters.of(snapshot).steps;
    let ([ahead, _], _) = program.first_velocity();
    let start = snapshot.velocity_now(0.0);
    let stage = |k: usize| {
        let column = ahead + 4 * (k - 1);
        let pair = |at: usize| Vector2::new(solution.primal[at], solution.primal[at + 1]);
        (pair(column - 2) * 10.0, pair(column))
    };
    let (mut error, mut energy, mut acceleration, mut before) = (0.0, 0.0, 0.0, start);
    for k in 1..=steps.len() {
        let (deviation, velocity) = stage(k);
        let duration = 0.5 * (steps[k - 1] + steps.get(k).unwrap_or(&0.0));
        error += duration * deviation.norm_squared();
        let power = snapshot.craft_model().power;
        let speed = velocity.norm();
        energy += duration * (power.linear_w_per_mps * speed + power.cubic_w_per_mps3 * speed.powi(3));
        acceleration += (velocity - before).norm_squared() / steps[k - 1];
        before = velocity;
    }
    [error, energy, acceleration]
}

/// If x minimises f + w g and x' minimises f + w' g with w < w', g(x') ≤ g(x): add both.
#[test]
fn a_larger_weight_makes_its_term_smaller_at_the_convex_optimum() {
    let sweeps: [(&str, usize, &[f64]); 3] = [
        ("position_weight_per_m2", 0, &[0.01, 0.1, 1.0, 3.0, 10.0]),
        ("energy_weight_per_j", 1, &[0.001, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0]),
        (
            "acceleration_weight_per_m2ps4",
            2,
            &[0.0, 10.0, 100.0, 1000.0, 10_000.0],
        ),
    ];
    for (lever, term, weights) in sweeps {
        for name in ["about-face", "cross-current", "crowded", "intermittent", "track"] {
            // At rest on its heading: the previous acceleration is zero.
            let mut request = example(name);
            request.asc.yaw_rate_radps = 0.0;
            let values: Vec<f64> = weights
                .iter()
                .map(|weight| {
                    let tuning = serde_json::from_value(json!({ lever: weight })).expect("is a lever");
                    let snapshot = with(tuning, &request);
                    let (program, solution) = first_program(&snapshot);
                    terms(&program, &solution, &snapshot)[term]
                })
                .collect();
            let tolerance = FLATNESS * values[0].max(1e-3);
            assert!(
                values.is_sorted_by(|before, after| *after <= before + tolerance),
                "{name}, {lever}: {values:?}"
            );
            assert!(
                values[values.len() - 1] < 0.99 * values[0],
                "{name}, {lever} moves nothing: {values:?}"
            );
        }
    }
}

/// Without cubic power the energy's bounds must not diverge.
#[test]
fn a_price_of_energy_is_solved_for_any_declared_power() {
    let tuning = |weight| Tuning {
        energy_weight_per_j: Some(weight),
        ..Tuning::default()
    };
    for power in [
        json!({}),
        json!({ "linear_w_per_mps": 50.0 }),
        json!({ "cubic_w_per_mps3": 1e-9 }),
    ] {
        let mut request = example("intermittent");
        request.craft = Some(serde_json::from_value(json!({ "power": power })).expect("is a craft"));
        for weight in [0.01, 1.0, 10.0] {
            let answer = planned(&with(tuning(weight), &request));
            assert_eq!(answer.degraded, None, "{power} at {weight}/J");
        }
        // Without coefficients, energy costs nothing and changes nothing.
        if power == json!({}) {
            let (free, priced) = (snapshot(request.clone()), with(tuning(1.0), &request));
            assert_eq!(planned(&free).reference, planned(&priced).reference);
        }
    }
}
