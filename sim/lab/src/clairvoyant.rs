//! A lower bound on any craft's distance to its goal, with the future known.
//!
//! The best trajectory p_0 … p_N under limits that no craft of its kind can break:
//!
//! ```text
//! minimise  Σ ‖p_k − r_k‖²   over p_1 … p_N,   w_k = (p_{k+1} − p_k) / Δt − m_k
//!
//! ‖w_k‖           ≤ S + δ_k                          k = 0 … N − 1    speed
//! ‖w_k − w_{k−1}‖ ≤ Δt a_max + δ_k + δ_{k−1}         k = 1 … N − 1    acceleration
//! ‖w_0 − v_0‖     ≤ ½ Δt a_max + δ_0                                  acceleration from the start
//! ```
//! r_k is the goal, v_0 the velocity through the water at the start, S the larger of the top speed
//! and ‖v_0‖, m_k = ½ (c_k + c_{k+1}) and δ_k = ‖c_{k+1} − c_k‖ for the current c_k at tick k.
//!
//! **No possible motion is excluded.** Let v(t) be a velocity through the water with ‖v‖ ≤ S and
//! ‖dv/dt‖ ≤ a_max, v̄_k its mean over tick k and c̄_k the mean current along its way. Then
//! (p_{k+1} − p_k) / Δt = v̄_k + c̄_k and w_k = v̄_k + (c̄_k − m_k), without integration error, and
//!
//! ```text
//! ‖v̄_k‖           ≤ S                                                           mean of ‖v‖ ≤ S
//! ‖v̄_k − v̄_{k−1}‖ = ‖∫ v(t + Δt) − v(t) dt‖ / Δt ≤ Δt a_max                     t in tick k − 1
//! ‖v̄_0 − v_0‖     = ‖∫ v(t) − v(0) dt‖ / Δt ≤ ∫ a_max t dt / Δt = ½ Δt a_max    t in [0, Δt]
//! ‖c̄_k − m_k‖     ≤ δ_k                                                         assumed
//! ```
//! The last line has a factor of two to spare if the current goes straight from c_k to c_{k+1}, and
//! is otherwise an assumption about the current between ticks. The currents are those of the
//! recorded craft: where they vary in space, the bound is for craft in these same currents.
//!
//! **No tolerance makes the bound false.** In deviations x = (p − r) / L from the goal the program
//! is ½ xᵀ x subject to A x + s = b, s ∈ K, and every z in the dual cone K* = K bounds it below:
//!
//! ```text
//! ½ xᵀ x ≥ −½ ‖Aᵀ z‖² − bᵀ z,    over the multiples of z at best   ½ max(0, −bᵀ z)² / ‖Aᵀ z‖²
//! ```
//! The bound is this value at the solver's z, moved into the cone: an error of z only lowers it.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver as _, SolverStatus, SupportedConeT};
use nalgebra::Vector2;

/// Tolerance of the solver: the bound is within 1e-6 of the least mean square (tested).
const TOLERANCE: f64 = 1e-8;
/// Most interior-point iterations.
const ITERATIONS_MAX: u32 = 100;

/// Unit of length, m: fewest iterations and tightest bound (`docs/rationale.md#solver`).
const LENGTH_UNIT: f64 = 100.0;

/// Largest distance in units of length: from 100 km on, the unit grows with the distance.
const UNITS_MAX: f64 = 1000.0;

/// Numbers in a cone: its radius, then a vector (north, east).
const CONE: usize = 3;

/// A craft and its known goal over N + 1 ticks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pursuit {
    /// Position at tick 0 (north, east), m.
    pub(crate) start: Vector2<f64>,
    /// Velocity through the water at tick 0 (north, east), m/s.
    pub(crate) start_velocity: Vector2<f64>,
    /// Goal r_0 … r_N (north, east), m: at least r_0.
    pub(crate) goal: Vec<Vector2<f64>>,
    /// Current c_0 … c_N (north, east), m/s; as many as there are goals.
    pub(crate) current: Vec<Vector2<f64>>,
    /// Time from one tick to the next Δt, s, positive.
    pub(crate) interval: f64,
    /// Top speed through the water, m/s, positive.
    pub(crate) speed_max: f64,
    /// Largest acceleration through the water a_max, in any direction, m/s², positive.
    pub(crate) acceleration_max: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clairvoyant {
    /// Best trajectory p_0 … p_N (north, east), m, within the solver's tolerance.
    pub(crate) positions: Vec<Vector2<f64>>,
    /// Lower bound on the mean of ‖p_k − r_k‖² over k = 0 … N, m²; never above the true least mean.
    pub(crate) mean_square: f64,
}

/// The best trajectory after the goal and the bound that goes with it.
///
/// `None` without a solution. Time and memory are proportional to N (`docs/rationale.md#solver`).
pub(crate) fn clairvoyant(pursuit: &Pursuit) -> Option<Clairvoyant> {
    let first = pursuit.start - pursuit.goal[0];
    let later_goals = &pursuit.goal[1..];
    let (mut positions, mut sum) = (vec![pursuit.start], first.norm_squared());
    if !later_goals.is_empty() {
        let unit = pursuit.length_unit();
        let chase = Chase::new(&pursuit.discs(), first, later_goals.len(), unit);
        let (deviations, dual) = chase.solve()?;
        let both = later_goals.iter().zip(deviations.chunks_exact(2));
        positions.extend(both.map(|(goal, x)| goal + Vector2::new(x[0], x[1]) * unit));
        sum += 2.0 * unit * unit * chase.bound(dual);
    }
    Some(Clairvoyant { mean_square: sum / positions.len() as f64, positions })
}

/// ‖Σ coefficient · d_k + offset‖ ≤ radius over (k, coefficient), d_k the deviation at tick k, m.
#[derive(Clone, Debug)]
struct DeviationDisc {
    terms: Vec<(usize, f64)>,
    offset: Vector2<f64>,
    radius: f64,
}

impl Pursuit {
    /// Unit of length inside the program, m.
    fn length_unit(&self) -> f64 {
        let distances = self.goal.iter().map(|goal| (goal - self.start).norm());
        distances.fold(0.0, f64::max).max(LENGTH_UNIT * UNITS_MAX) / UNITS_MAX
    }

    /// The limits of speed and acceleration, tick by tick.
    fn discs(&self) -> Vec<DeviationDisc> {
        (1..self.goal.len()).flat_map(|k| [self.speed(k), self.acceleration(k)]).collect()
    }

    /// Δt w_{k−1} less d_k − d_{k−1}, m.
    fn relative_way(&self, k: usize) -> Vector2<f64> {
        let mean_current = (self.current[k - 1] + self.current[k]) * 0.5;
        self.goal[k] - self.goal[k - 1] - mean_current * self.interval
    }

    /// Δt δ_{k−1}, m.
    fn current_change(&self, k: usize) -> f64 {
        self.interval * (self.current[k] - self.current[k - 1]).norm()
    }

    /// The speed limit of the tick that ends at k.
    fn speed(&self, k: usize) -> DeviationDisc {
        let fastest = self.speed_max.max(self.start_velocity.norm());
        DeviationDisc {
            terms: vec![(k, 1.0), (k - 1, -1.0)],
            offset: self.relative_way(k),
            radius: self.interval * fastest + self.current_change(k),
        }
    }

    /// The acceleration limit between the tick that ends at k and the previous tick, or the start.
    fn acceleration(&self, k: usize) -> DeviationDisc {
        let change = self.interval * self.interval * self.acceleration_max;
        if k == 1 {
            return DeviationDisc {
                terms: vec![(1, 1.0), (0, -1.0)],
                offset: self.relative_way(1) - self.start_velocity * self.interval,
                radius: 0.5 * change + self.current_change(1),
            };
        }
        DeviationDisc {
            terms: vec![(k, 1.0), (k - 1, -2.0), (k - 2, 1.0)],
            offset: self.relative_way(k) - self.relative_way(k - 1),
            radius: change + self.current_change(k) + self.current_change(k - 1),
        }
    }
}

/// ½ xᵀ x subject to A x + s = b, s ∈ K: x are deviations from tick 1 on in units of length. Each
/// disc is a cone in units of its radius: in a far chase, speed then counts like distance.
struct Chase {
    constraints: CscMatrix<f64>,
    bounds: Vec<f64>,
}

impl Chase {
    /// `first` is d_0, which is data.
    fn new(discs: &[DeviationDisc], first: Vector2<f64>, n_ticks: usize, unit: f64) -> Self {
        let (mut rows, mut columns, mut values) = (vec![], vec![], vec![]);
        let mut bounds = Vec::with_capacity(CONE * discs.len());
        for disc in discs {
            let row = bounds.len();
            let mut offset = disc.offset;
            for &(k, coefficient) in &disc.terms {
                if k == 0 {
                    offset += first * coefficient;
                    continue;
                }
                for axis in 0..2 {
                    rows.push(row + 1 + axis);
                    columns.push(2 * (k - 1) + axis);
                    values.push(-coefficient * unit / disc.radius);
                }
            }
            bounds.extend([1.0, offset.x / disc.radius, offset.y / disc.radius]);
        }
        Self {
            constraints: CscMatrix::new_from_triplets(bounds.len(), 2 * n_ticks, rows, columns, values),
            bounds,
        }
    }

    fn solve(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = self.constraints.n;
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .max_iter(ITERATIONS_MAX)
            .tol_gap_abs(TOLERANCE)
            .tol_gap_rel(TOLERANCE)
            .tol_feas(TOLERANCE)
            // The program has a solution: what looks like a proof of the contrary is rounding.
            .tol_infeas_rel(0.0)
            .reduced_tol_infeas_rel(0.0)
            .max_threads(1)
            .presolve_enable(false)
            .input_sparse_dropzeros(false)
            .build()
            .expect("the settings are constants");
        let cones = vec![SupportedConeT::SecondOrderConeT(CONE); self.bounds.len() / CONE];
        let (identity, zeros) = (CscMatrix::identity(n), vec![0.0; n]);
        let (constraints, bounds) = (&self.constraints, &self.bounds);
        let solver = DefaultSolver::new(&identity, &zeros, constraints, bounds, &cones, settings);
        let mut solver = solver.ok()?;
        solver.solve();
        let solution = solver.solution;
        let is_solved = matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        is_solved.then_some((solution.x, solution.z))
    }

    /// Lower bound on ½ xᵀ x that `dual` gives once it is in its cone.
    fn bound(&self, mut dual: Vec<f64>) -> f64 {
        for z in dual.chunks_exact_mut(CONE) {
            z[0] = z[0].max(z[1].hypot(z[2]));
        }
        let gain: f64 = self.bounds.iter().zip(&dual).map(|(b, z)| -b * z).sum();
        let matrix = &self.constraints;
        let square = |column: &[usize]| {
            let entries = (column[0]..column[1]).map(|i| matrix.nzval[i] * dual[matrix.rowval[i]]);
            entries.sum::<f64>().powi(2)
        };
        let squares: f64 = matrix.colptr.windows(2).map(square).sum();
        if gain <= 0.0 || squares == 0.0 {
            return 0.0;
        }
        0.5 * gain * gain / squares
    }
}

#[cfg(test)]
mod tests;
