//! Tuning in a request: the library's parameters, each with its documented effect.

use pilotfish_planner::nalgebra::Vector2;
use pilotfish_planner::parameters::{Parameters, Weights};
use pilotfish_planner::plan::{Degraded, Plan, Programs, Workspace, plan, plan_with};
use pilotfish_planner::program::Program;
use pilotfish_planner::snapshot::{PlanRequest, PreviousPlan, Snapshot, Tuning, ranges_by_shape};
use pilotfish_planner::solve::{Solution, Solvers};
use serde_json::json;

/// All examples except the visits, whose schedule has its own horizon.
const EXAMPLES: [&str; 8] =
    ["about-face", "cross-current", "crowded", "intermittent", "midpoint", "offset", "range", "track"];

/// Relative distance of a partial term from its optimum by the solver's tolerance.
const FLATNESS: f64 = 1e-3;

#[expect(clippy::disallowed_methods, reason = "a test reads its examples")]
fn example(name: &str) -> PlanRequest {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/snapshots");
    let text = std::fs::read_to_string(format!("{folder}/{name}.json")).expect("is there");
    serde_json::from_str(&text).expect("is a request")
}

fn snapshot(request: PlanRequest) -> Snapshot {
    Snapshot::try_from(request).expect("is valid")
}

fn with(tuning: Tuning, request: &PlanRequest) -> Snapshot {
    let mut request = request.clone();
    request.tuning = Some(tuning);
    snapshot(request)
}

/// The lever `name` alone.
fn lever(name: &str, value: f64) -> Tuning {
    serde_json::from_value(json!({ name: value })).expect("is a lever")
}

fn planned(snapshot: &Snapshot) -> Plan {
    plan(snapshot, &Parameters::default(), &mut Workspace::default())
}

/// All digits of a plan.
fn digits(plan: &Plan) -> String {
    format!("{plan:?}")
}

#[test]
fn tuning_in_json_is_the_library_s_parameters_to_the_digit() {
    let steps = vec![1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 8.0, 8.0];
    let tuning: Tuning = serde_json::from_value(json!({
        "position_weight_per_m2": 0.5,
        "velocity_weight_per_m2ps2": 20.0,
        "acceleration_weight_per_m2ps4": 300.0,
        "terminal_position_weight_per_m2": 5.0,
        "terminal_velocity_weight_per_m2ps2": 60.0,
        "energy_weight_per_j": 0.3,
        "scp_iterations": 3,
        "steps_s": steps,
    }))
    .expect("has every member");
    let set = Parameters {
        steps,
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
    for name in EXAMPLES {
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
    for name in EXAMPLES {
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
    for (n, step) in [(40_u8, 2.0), (5, 4.0), (120, 1.0), (60, 10.0)] {
        // A second later, on the previous plan's trajectory.
        let now = before.trajectory[0].t_s + 1.0;
        let (from, to) = (&before.trajectory[0], &before.trajectory[1]);
        let place = from.position().lerp(&to.position(), 1.0 / (to.t_s - from.t_s));
        (request.t_s, request.asc.north_m, request.asc.east_m) = (now, place.x, place.y);
        request.previous_plan = Some(PreviousPlan::from(&before));
        let tuning = Tuning { steps_s: Some(vec![step; n.into()]), ..Tuning::default() };
        let snapshot = with(tuning, &request);
        let answer = plan(&snapshot, &Parameters::default(), &mut workspace);
        assert_eq!(answer.degraded, None);
        assert_eq!(answer.trajectory.len(), usize::from(n) + 1);
        let last = answer.trajectory[usize::from(n)].t_s;
        assert!((last - now - step * f64::from(n)).abs() < 1e-9);
        assert_eq!(digits(&planned(&snapshot)), digits(&answer), "the workspace shows");
        // The reference turns from the previous one no faster than the craft.
        let turned = answer.reference.heading.radians() - before.reference.heading.radians();
        assert!(turned.abs() < 0.2, "{n} steps: {turned}");
        before = answer;
    }
}

/// Without iterations: more than a few may end with motion rows violated late in the horizon.
#[test]
fn every_weight_at_the_ends_of_its_range_keeps_the_limits_and_solves() {
    let broken = |plan: &Plan| plan.violations.iter().map(|one| one.amount).fold(0.0, f64::max);
    for name in EXAMPLES {
        let request = example(name);
        let usual = broken(&planned(&snapshot(request.clone())));
        let levers = ranges_by_shape().filter(|(shape, _)| *shape == "Tuning");
        let weights = levers.filter(|(_, (lever, _))| *lever != "scp_iterations");
        for (_, (weight, range)) in weights {
            for end in [*range.start(), *range.end()] {
                let answer = planned(&with(lever(weight, end), &request));
                assert_eq!(answer.degraded, None, "{name}, {weight} = {end}");
                assert!(broken(&answer) <= usual + 0.01, "{name}, {weight} = {end}");
            }
        }
    }
}

/// The first program of `snapshot`, and its solution.
fn first_program(snapshot: &Snapshot) -> (Program, Solution) {
    let (mut solvers, mut first) = (Solvers::default(), None);
    let (parameters, mut programs) = (Parameters::default(), Programs::default());
    let answer = plan_with(snapshot, &parameters, &mut programs, &mut |program| {
        let solution = solvers.solve(program);
        first.get_or_insert_with(|| (program.clone(), solution.clone()));
        solution
    });
    assert_eq!(answer.degraded, None::<Degraded>);
    first.expect("a program was solved")
}

/// The terms that the weights reduce, of the velocities through the water and the deviations at the
/// stages of a solution. Columns as in docs/program.md: deviation in tens of metres and velocity.
fn terms(program: &Program, solution: &Solution, snapshot: &Snapshot) -> [f64; 3] {
    let parameters = Parameters::default();
    let steps = &parameters.of(snapshot).steps;
    let ([ahead, _], _) = program.first_velocity();
    let power = snapshot.craft_model().power;
    let (mut error, mut energy, mut acceleration) = (0.0, 0.0, 0.0);
    let mut before = snapshot.velocity_now(0.0);
    for k in 1..=steps.len() {
        let column = ahead + 4 * (k - 1);
        let pair = |at: usize| Vector2::new(solution.primal[at], solution.primal[at + 1]);
        let (deviation, velocity) = (pair(column - 2) * 10.0, pair(column));
        let duration = 0.5 * (steps[k - 1] + steps.get(k).unwrap_or(&0.0));
        error += duration * deviation.norm_squared();
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
    let sweeps: [(&str, &[f64]); 3] = [
        ("position_weight_per_m2", &[0.01, 0.1, 1.0, 3.0, 10.0]),
        ("energy_weight_per_j", &[0.001, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0]),
        ("acceleration_weight_per_m2ps4", &[0.0, 10.0, 100.0, 1000.0, 1e4]),
    ];
    for (term, (weight, values)) in sweeps.into_iter().enumerate() {
        for name in ["about-face", "cross-current", "crowded", "intermittent", "track"] {
            // At rest on its heading: the previous acceleration is zero.
            let mut request = example(name);
            request.asc.yaw_rate_radps = 0.0;
            let value = |value: &f64| {
                let snapshot = with(lever(weight, *value), &request);
                let (program, solution) = first_program(&snapshot);
                terms(&program, &solution, &snapshot)[term]
            };
            let terms: Vec<f64> = values.iter().map(value).collect();
            let tolerance = FLATNESS * terms[0].max(1e-3);
            let falls = terms.is_sorted_by(|before, after| *after <= before + tolerance);
            assert!(falls && terms[terms.len() - 1] < 0.99 * terms[0], "{name}, {weight}: {terms:?}");
        }
    }
}

/// Without cubic power the energy's bounds must not diverge.
#[test]
fn a_price_of_energy_is_solved_for_any_declared_power() {
    let none = json!({});
    for power in [&none, &json!({ "linear_w_per_mps": 50.0 }), &json!({ "cubic_w_per_mps3": 1e-9 })] {
        let mut request = example("intermittent");
        request.craft = Some(serde_json::from_value(json!({ "power": power })).expect("is a craft"));
        for weight in [0.01, 1.0, 10.0] {
            let answer = planned(&with(lever("energy_weight_per_j", weight), &request));
            assert_eq!(answer.degraded, None, "{power} at {weight}/J");
            // Without coefficients, energy costs nothing and changes nothing.
            if *power == none {
                assert_eq!(answer.reference, planned(&snapshot(request.clone())).reference);
            }
        }
    }
}
