//! The program against an independent statement of its promises.

mod names;

use std::collections::HashSet;

use nalgebra::Vector2;

use super::*;
use crate::{
    craft::closed_loop::Craft,
    facts::{angle::starboard_of, asc::Limits},
    problem::{limits::Shore, parameters::Parameters},
    program::{
        cost::cost_scale,
        layout::Slack,
        sparse::{Sparse, Triplet},
    },
    tests::near,
};

#[test]
fn every_variable_and_row_has_one_index() {
    for (n_ranges, n_other_ranges, n_discs, n_edges, n_minimax, energy) in
        [(0, 0, 0, 0, 0, false), (2, 1, 3, 4, 2, true), (1, 0, 0, 5, 0, true), (3, 3, 1, 0, 3, false)]
    {
        let layout = Layout { n_stages: 7, n_ranges, n_other_ranges, n_discs, n_edges, n_minimax, energy };
        let (mut columns, mut rows) = (HashSet::new(), HashSet::new());
        let place = |set: &mut HashSet<usize>, first: usize, n: usize| {
            let are_new = (first..first + n).all(|place| set.insert(place));
            assert!(are_new, "{layout:?}: {first}");
        };
        for k in 1..=layout.n_stages {
            place(&mut columns, layout.deviation(k), 2);
            place(&mut columns, layout.velocity(k), 2);
            for row in [layout.dynamics(k), layout.acceleration(k), layout.turn_rate(k)] {
                place(&mut rows, row, 2);
            }
            place(&mut rows, layout.forward_speed(k), 1);
            place(&mut rows, layout.speed_cone(k), 3);
            for slack in layout.slacks() {
                place(&mut columns, layout.slack(k, slack), 1);
                place(&mut rows, layout.slack_sign(k, slack), 1);
            }
            (0..n_ranges).for_each(|i| place(&mut rows, layout.range_cone(k, i), 3));
            (0..n_edges).for_each(|i| place(&mut rows, layout.area(k, i), 1));
            (0..n_minimax).for_each(|i| place(&mut rows, layout.minimax_cone(k, i), 4));
            for i in 0..n_discs {
                place(&mut rows, layout.disc_at_end(k, i), 1);
                if k > 1 {
                    place(&mut rows, layout.disc_at_start(k, i), 1);
                }
            }
            if n_minimax > 0 {
                place(&mut columns, layout.minimax(k), 1);
            }
            if energy {
                place(&mut columns, layout.energy(k), 3);
                place(&mut rows, layout.top_speed(k), 1);
                place(&mut rows, layout.energy_cones(k), 6);
            }
        }
        assert_eq!(columns, (0..layout.n_variables()).collect());
        assert_eq!(rows, (0..layout.n_rows()).collect());
    }
}

/// A scene without alignments or zeros, on four stages of three lengths.
struct Scene {
    steps: Vec<f64>,
    goal: Vec<Vector2<f64>>,
    goal_velocity: Vec<Vector2<f64>>,
    directions: Vec<Vector2<f64>>,
    ranges: Vec<AcousticRange>,
    discs: Vec<Disc>,
    shores: Vec<Shore>,
    edges: Vec<Edge>,
    minimax: Vec<MinimaxRange>,
    parameters: Parameters,
}

impl Scene {
    fn new() -> Self {
        let at = |k: i32, a: f64, b: f64| Vector2::new(a + 0.3 * f64::from(k), b * f64::from(k * k));
        Self {
            steps: vec![1.0, 2.0, 2.0, 4.0],
            goal: (0..5).map(|k| at(k, 4.0, -0.7)).collect(),
            goal_velocity: (0..5).map(|k| at(k, -0.2, 0.05)).collect(),
            directions: (0..5).map(|k| at(k, 1.0, 0.1).normalize()).collect(),
            ranges: Vec::new(),
            discs: Vec::new(),
            shores: Vec::new(),
            edges: Vec::new(),
            minimax: Vec::new(),
            parameters: Parameters::default(),
        }
    }

    /// With bounds of every kind, a minimax range and a price of energy.
    fn bounded() -> Self {
        let at = |k: i32, a: f64, b: f64| Vector2::new(a + 0.4 * f64::from(k), b - 0.2 * f64::from(k));
        let way = |a, b| (0..5).map(|k| at(k, a, b)).collect::<Vec<_>>();
        let numbers = |a: f64| (0..5).map(|k| a + 0.1 * f64::from(k)).collect::<Vec<_>>();
        let member = |a, b, depth| MinimaxRange { positions: way(a, b), depths: numbers(depth) };
        let mut scene = Self::new();
        scene.parameters.weights.energy = 0.7;
        let range = |a, b, radius, named| AcousticRange { centres: way(a, b), radii: numbers(radius), named };
        scene.ranges = vec![range(9.0, 3.0, 12.0, true), range(-3.0, 7.0, 8.0, false)];

        scene.discs = vec![Disc {
            centres: way(5.0, -2.0),
            radii: numbers(1.5),
            normals: way(0.3, 1.0).into_iter().map(|n| n.normalize()).collect(),
        }];
        scene.shores = vec![Shore {
            points: way(-6.0, 4.0),
            normals: way(1.0, -0.2).into_iter().map(|n| n.normalize()).collect(),
            margin: 0.5,
        }];
        scene.edges = [(0.6, 0.8), (-0.8, 0.6), (0.28, -0.96)]
            .map(|(north, east)| Edge { normal: Vector2::new(north, east), offset: 17.0 })
            .to_vec();
        scene.minimax = vec![member(4.0, -9.0, 5.0), member(6.0, 8.0, 11.0)];
        scene
    }

    fn subproblem(&self) -> Subproblem<'_> {
        Subproblem {
            steps: &self.steps,
            velocity: Vector2::new(0.4, -0.05),
            acceleration: Vector2::new(-0.02, 0.04),
            course_lag: 1.9,
            current: Vector2::new(0.03, -0.08),
            goal: &self.goal,
            goal_velocity: &self.goal_velocity,
            directions: &self.directions,
            limits: &Limits::MEDUSA,
            surge_disturbance: &[0.02, -0.01, 0.03, 0.04],
            ranges: &self.ranges,
            discs: &self.discs,
            shores: &self.shores,
            edges: &self.edges,
            minimax: &self.minimax,
            weights: &self.parameters.weights,
            power: Craft::MEDUSA.power,
        }
    }
}

/// Velocities, and their deviations by the equations of motion, independent of the program's rows.
fn variables(subproblem: &Subproblem<'_>, wiggle: f64) -> (Vec<f64>, Vec<Vector2<f64>>, Vec<Vector2<f64>>) {
    let layout = subproblem.layout();
    let mut x = vec![0.0; layout.n_variables()];
    let (mut positions, mut velocities) = (vec![Vector2::zeros()], vec![subproblem.velocity]);
    for k in 1..=layout.n_stages {
        let (dt, before) = (subproblem.steps[k - 1], velocities[k - 1]);
        let phase = wiggle * k as f64;
        let velocity = Vector2::new(0.5 + 0.2 * phase.sin(), 0.1 * phase.cos());
        let acceleration = (velocity - before) / dt;
        let position = positions[k - 1] + (before + subproblem.current) * dt + acceleration * (0.5 * dt * dt);
        for axis in 0..2 {
            x[layout.deviation(k) + axis] = (position - subproblem.goal[k])[axis] / LENGTH_UNIT;
            x[layout.velocity(k) + axis] = velocity[axis];
        }
        positions.push(position);
        velocities.push(velocity);
    }
    (x, positions, velocities)
}

fn entries(matrix: &Sparse) -> impl Iterator<Item = Triplet> + '_ {
    (0..matrix.n_cols).flat_map(move |column| {
        (matrix.column_starts[column]..matrix.column_starts[column + 1])
            .map(move |i| (matrix.row_indices[i], column, matrix.values[i]))
    })
}

fn objective(program: &Program, x: &[f64]) -> f64 {
    let term = |(i, j, value): Triplet| value * x[i] * x[j] * if i == j { 0.5 } else { 1.0 };
    let linear = program.linear.iter().zip(x).map(|(q, x)| q * x);
    entries(&program.quadratic).map(term).sum::<f64>() + linear.sum::<f64>()
}

/// The cost with the weights of the parameters, summed over the trajectory.
fn cost_in_words(of: &Subproblem<'_>, positions: &[Vector2<f64>], velocities: &[Vector2<f64>]) -> f64 {
    let (w, n) = (of.weights, of.steps.len());
    let position = |k: usize| (positions[k] - of.goal[k]).norm_squared();
    let velocity = |k: usize| (velocities[k] - of.goal_velocity[k]).norm_squared();
    let miss = |k: usize| w.position * position(k) + w.velocity * velocity(k);
    let stage = |k: usize| {
        let acceleration = (velocities[k + 1] - velocities[k]) / of.steps[k];
        let both = 0.5 * (miss(k) + miss(k + 1));
        of.steps[k] * (both + w.acceleration * acceleration.norm_squared())
    };
    let terminal = w.terminal_position * position(n) + w.terminal_velocity * velocity(n);
    (0..n).map(stage).sum::<f64>() + terminal
}

#[test]
fn the_objective_is_the_cost_in_words_up_to_scale_and_a_constant() {
    let scene = Scene::new();
    let subproblem = scene.subproblem();
    let program = Program::new(&subproblem);
    let [(x, p, v), (y, q, w)] = [0.7, 2.9].map(|wiggle| variables(&subproblem, wiggle));
    let unit = cost_scale(&subproblem) / COST_UNIT;
    let words = cost_in_words(&subproblem, &p, &v) - cost_in_words(&subproblem, &q, &w);
    let found = (objective(&program, &x) - objective(&program, &y)) / unit;
    near(found, words, 1e-9 * words.abs());
}

/// b − A x.
fn row_slacks(program: &Program, x: &[f64]) -> Vec<f64> {
    let mut s = program.bounds.clone();
    entries(&program.constraints).for_each(|(row, column, value)| s[row] -= value * x[column]);
    s
}

#[test]
fn every_row_states_its_promise() {
    let scene = Scene::new();
    let subproblem = scene.subproblem();
    let program = Program::new(&subproblem);
    let (mut x, _, v) = variables(&subproblem, 1.3);
    let layout = program.layout;
    for k in 1..=layout.n_stages {
        x[layout.slack(k, Slack::Motion)] = 0.01 * k as f64;
    }
    let s = row_slacks(&program, &x);
    let close = |row: usize, expected: f64| near(s[row], expected, 1e-12);
    for k in 1..=layout.n_stages {
        let xi = x[layout.slack(k, Slack::Motion)] * SLACK_UNIT;
        let (c, limits) = (subproblem.directions[k], subproblem.limits);
        let c_mean = (subproblem.directions[k - 1] + c).normalize();
        let n_mean = starboard_of(c_mean);
        let a = (v[k] - v[k - 1]) / subproblem.steps[k - 1];
        let bias = subproblem.surge_disturbance[k - 1];
        close(layout.dynamics(k), 0.0);
        close(layout.dynamics(k) + 1, 0.0);
        close(layout.acceleration(k), limits.acceleration_max + bias - c_mean.dot(&a));
        close(layout.acceleration(k) + 1, limits.deceleration_max - bias + c_mean.dot(&a));
        close(layout.forward_speed(k), c.dot(&v[k]) - limits.speed_min + xi);
        let rate = limits.turn_rate_max * c_mean.dot(&(v[k] + v[k - 1])) / 2.0 + xi;
        // Rate of the leading reference: a + T ȧ, between the middles of both intervals.
        let (a_before, between) = if k == 1 {
            (subproblem.acceleration, subproblem.steps[0])
        } else {
            let (before, now) = (subproblem.steps[k - 2], subproblem.steps[k - 1]);
            ((v[k - 1] - v[k - 2]) / before, f64::midpoint(before, now))
        };
        let asked = a + (a - a_before) * (subproblem.course_lag / between);
        close(layout.turn_rate(k), rate - n_mean.dot(&asked));
        close(layout.turn_rate(k) + 1, rate + n_mean.dot(&asked));
        close(layout.speed_cone(k), limits.speed_max);
        close(layout.speed_cone(k) + 1, v[k].x);
        close(layout.speed_cone(k) + 2, v[k].y);
    }
}

#[test]
fn a_craft_without_lag_may_turn_at_its_limit_from_any_turn() {
    let scene = Scene::new();
    let prompt = Subproblem { course_lag: 0.0, ..scene.subproblem() };
    let turning = Subproblem { acceleration: Vector2::new(3.0, -5.0), ..prompt };
    assert_eq!(Program::new(&prompt), Program::new(&turning));
    let program = Program::new(&prompt);
    let (x, _, v) = variables(&prompt, 1.3);
    let s = row_slacks(&program, &x);
    for k in 1..=program.layout.n_stages {
        let mean = (prompt.directions[k - 1] + prompt.directions[k]).normalize();
        let across = starboard_of(mean).dot(&(v[k] - v[k - 1])) / prompt.steps[k - 1];
        let most = prompt.limits.turn_rate_max * mean.dot(&(v[k] + v[k - 1])) / 2.0;
        let row = program.layout.turn_rate(k);
        near(s[row], most - across, 1e-12);
        near(s[row + 1], most + across, 1e-12);
    }
}

#[test]
fn every_bound_states_its_promise() {
    let scene = Scene::bounded();
    let subproblem = scene.subproblem();
    let program = Program::new(&subproblem);
    let (mut x, p, v) = variables(&subproblem, 1.3);
    let layout = program.layout;
    for k in 1..=layout.n_stages {
        for (i, slack) in layout.slacks().enumerate() {
            x[layout.slack(k, slack)] = 0.3 * (i + k) as f64;
        }
        x[layout.minimax(k)] = 0.2;
        let sigma = layout.energy(k);
        (x[sigma], x[sigma + 1], x[sigma + 2]) = (0.9, 0.85, 0.8);
    }
    let s = row_slacks(&program, &x);
    let close = |given: f64, expected: f64| near(given, expected, 1e-12);
    let norm = |row: usize, n: usize| s[row + 1..row + n].iter().map(|s| s * s).sum::<f64>().sqrt();
    for k in 1..=layout.n_stages {
        let xi = |slack| x[layout.slack(k, slack)] * SLACK_UNIT;
        for (i, range) in subproblem.ranges.iter().enumerate() {
            let row = layout.range_cone(k, i);
            let slack = xi([Slack::OtherRange, Slack::AcousticRange][usize::from(range.named)]);
            close(s[row] * LENGTH_UNIT, range.radii[k] + slack);
            close(norm(row, 3) * LENGTH_UNIT, (p[k] - range.centres[k]).norm());
        }
        for (g, edge) in subproblem.edges.iter().enumerate() {
            let inside = edge.offset - edge.normal.dot(&p[k]) + xi(Slack::Area);
            close(s[layout.area(k, g)] * LENGTH_UNIT, inside);
        }
        for (i, member) in subproblem.minimax.iter().enumerate() {
            let row = layout.minimax_cone(k, i);
            let range = |p: Vector2<f64>, m: &MinimaxRange| (p - m.positions[k]).norm().hypot(m.depths[k]);
            let of_goal = subproblem.minimax.iter().map(|m| range(subproblem.goal[k], m));
            close(s[row] * LENGTH_UNIT, of_goal.fold(0.0, f64::max) + 0.2 * LENGTH_UNIT);
            close(norm(row, 4) * LENGTH_UNIT, range(p[k], member));
        }
        let (disc, dt, limits) = (&subproblem.discs[0], subproblem.steps[k - 1], subproblem.limits);
        let hardest = limits.acceleration_max.hypot(limits.turn_rate_max * limits.speed_max);
        let outside = |row: usize, at: usize| {
            let clear = disc.normals[k].dot(&(p[at] - disc.centres[at])) - disc.radii[at];
            close(s[row] * LENGTH_UNIT, clear - dt * dt * hardest / 8.0 + xi(Slack::KeepOut));
        };
        outside(layout.disc_at_end(k, 0), k);
        if k > 1 {
            outside(layout.disc_at_start(k, 0), k - 1);
        }
        let (speed, top, energy) = (layout.speed_cone(k), layout.top_speed(k), layout.energy_cones(k));
        close(s[speed], 0.9);
        close(s[speed + 1], v[k].x);
        close(s[top], limits.speed_max - 0.9);
        // A rotated cone a² ≤ b c is b c − a² = s₀² − s₁² − s₂²: square and cube of the bound.
        let product = |row: usize| s[row] * s[row] - s[row + 1] * s[row + 1] - s[row + 2] * s[row + 2];
        close(product(energy), 0.85 - 0.9 * 0.9);
        close(product(energy + 3), 0.8 * 0.9 - 0.85 * 0.85);
    }
}

#[test]
fn an_inactive_disc_binds_nothing_and_keeps_the_pattern() {
    let mut scene = Scene::bounded();
    let there = Program::new(&scene.subproblem());
    // Inactive at stages 1 to 3, active at the last.
    scene.discs[0].radii[1..4].fill(-1.0);
    let program = Program::new(&scene.subproblem());
    assert_eq!(program.constraints.row_indices, there.constraints.row_indices);
    let (x, ..) = variables(&scene.subproblem(), 1.3);
    let far: Vec<_> = x.iter().map(|x| 1e3 * x).collect();
    let [here, there] = [&x, &far].map(|x| row_slacks(&program, x));
    let layout = program.layout;
    for k in [2, 3] {
        for row in [layout.disc_at_start(k, 0), layout.disc_at_end(k, 0)] {
            // Without any slack, the row holds everywhere by the same amount.
            assert!(here[row] > 0.0);
            near(here[row], there[row], 1e-12);
        }
    }
    let row = layout.disc_at_end(4, 0);
    assert!((here[row] - there[row]).abs() > 1.0);
}

#[test]
fn restating_equals_a_new_program() {
    let scene = Scene::bounded();
    let mut other = Scene::bounded();
    other.goal.iter_mut().for_each(|r| *r *= -3.0);
    other.directions.reverse();
    let mut program = Program::new(&other.subproblem());
    program.restate(&scene.subproblem());
    assert_eq!(program, Program::new(&scene.subproblem()));
}

/// Slowed down within the limits of the disturbance, and pushed beyond them.
#[test]
fn the_hard_rows_have_a_common_point_for_any_disturbance() {
    for beyond in [0.0, 0.07, 0.14, -0.13] {
        let scene = Scene::new();
        let biases = scene.subproblem().surge_disturbance.iter().map(|bias| bias + beyond);
        let biases: Vec<f64> = biases.collect();
        let subproblem = Subproblem {
            velocity: Vector2::new(-2.0, 1.5),
            surge_disturbance: &biases,
            ..scene.subproblem()
        };
        let program = Program::new(&subproblem);
        let limits = subproblem.limits;
        let weaker = limits.acceleration_max.min(limits.deceleration_max);
        let mut x = vec![0.0; program.layout.n_variables()];
        let mut velocity = subproblem.velocity;
        for k in program.stages() {
            let (bias, dt) = (biases[k - 1], subproblem.steps[k - 1]);
            let room = (weaker - bias.abs()) * dt;
            velocity = if room >= 0.0 {
                velocity * (1.0 - room / velocity.norm())
            } else {
                let mean = (subproblem.directions[k - 1] + subproblem.directions[k]).normalize();
                velocity - mean * (room * bias.signum())
            };
            let column = program.layout.velocity(k);
            (x[column], x[column + 1]) = (velocity.x, velocity.y);
        }
        let s = row_slacks(&program, &x);
        for k in program.stages() {
            let (acceleration, cone) = (program.layout.acceleration(k), program.layout.speed_cone(k));
            assert!(s[acceleration].min(s[acceleration + 1]) >= -1e-12, "{beyond}");
            assert!(s[cone + 1].hypot(s[cone + 2]) <= s[cone] + 1e-12, "{beyond}");
        }
    }
}
