//! What a plan says: the reference, what stands behind it, and what stands beside it.

use nalgebra::Vector2;

use crate::{
    angle::{Course, Heading},
    certificate::Residuals,
    craft::CraftEstimate,
    estimate::Estimate,
    forecast::{AuvForecast, Motion},
    los::{LosLaw, Reference},
    refilled::refill,
    snapshot::{Auv, ForecastModel, PreviousPlan, PreviousTarget, Snapshot, TrajectoryPoint, VehicleId},
    solve::SolverStatus,
};

/// The answer to a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The rung of the ladder that answered.
    pub method: Method,
    /// Why the answer is degraded; `None` when a program was solved, whichever rung then answered.
    pub degraded: Option<Degraded>,
    /// Speed and heading for the inner loops, now: what they hold, through water or over ground, heading or course.
    pub reference: Reference,
    /// The same as speed through the water and heading; hand it back in the next request.
    pub reference_through_water: Reference,
    /// What is known of the craft; hand it back in the next request.
    pub craft: CraftEstimate,
    /// Until when the reference and the trajectory may be followed without a newer plan, s.
    pub valid_until: f64,
    /// The planned trajectory, from now on.
    pub trajectory: Vec<TrajectoryPoint>,
    /// The goal at the times of the trajectory.
    pub goal: Vec<Motion>,
    /// The course of what the goal follows, its offset apart, when that last moved; hand it back in the next request.
    pub goal_course: Course,
    /// How each AUV was forecast, in the snapshot's order.
    pub targets: Vec<TargetForecast>,
    /// What the line-of-sight law would do.
    pub baseline: Baseline,
    /// What the solver did.
    pub solver: SolverReport,
    /// What the current (north, east) was taken for, m/s, where anything told it; hand it back in the next request.
    pub current: Option<Vector2<f64>>,
    /// What the answer is predicted to lead to.
    pub predicted: Predicted,
    /// Soft limits that the plan does not keep.
    pub violations: Vec<Violation>,
    /// The AUVs whose acoustic range cannot be kept now, by their place in the snapshot, ascending: of those that the goal
    /// names, the ones out of range where it is met, if no place is in range of all; of the others, taken from the nearest
    /// to the goal on, each that has no place in range of all kept so far. For these others the craft does nothing then;
    /// that their limit is broken is told.
    pub range_unattainable: Vec<usize>,
}

impl Plan {
    /// What a first plan is made in place of: it says nothing and holds no memory.
    pub(crate) fn empty() -> Self {
        let reference = Reference {
            speed: 0.0,
            heading: Heading::new(0.0),
        };
        let predicted = Predicted {
            merit: 0.0,
            rms_error: 0.0,
            energy: 0.0,
        };
        Self {
            method: Method::Hold,
            degraded: None,
            reference,
            reference_through_water: reference,
            craft: CraftEstimate::nothing(),
            valid_until: 0.0,
            trajectory: Vec::new(),
            goal: Vec::new(),
            goal_course: Course::new(0.0),
            targets: Vec::new(),
            baseline: Baseline {
                reference,
                trajectory: Vec::new(),
                predicted,
                violations: Vec::new(),
            },
            solver: SolverReport::nothing_done(),
            current: None,
            predicted,
            violations: Vec::new(),
            range_unattainable: Vec::new(),
        }
    }
}

impl From<&Plan> for PreviousPlan {
    /// What the next request has to say of this answer.
    fn from(plan: &Plan) -> Self {
        Self {
            trajectory: plan.trajectory.clone(),
            goal_course: Some(plan.goal_course),
            reference: Some(plan.reference_through_water),
            told: Some(plan.reference),
            craft: Some(plan.craft),
            current: plan.current,
            targets: plan.targets.iter().map(PreviousTarget::from).collect(),
        }
    }
}

/// Who answered: a rung of the decision ladder, or a law that is no rung and is only compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The convex program, solved.
    Mpc,
    /// The previous plan, followed further.
    PreviousPlan,
    /// The saturated line-of-sight law.
    SaturatedLos,
    /// Slow turn or stop.
    Hold,
    /// Line of sight in the tracker's frame; no rung.
    SaturatedLosTrackerFrame,
    /// Integral line of sight; no rung.
    IntegralLos,
    /// Way-points round a box; no rung.
    WaypointBox,
    /// Line of sight as printed; no rung.
    PrintedLos,
}

impl From<LosLaw> for Method {
    fn from(law: LosLaw) -> Self {
        match law {
            LosLaw::SaturatedLos => Self::SaturatedLos,
            LosLaw::TrackerFrame => Self::SaturatedLosTrackerFrame,
            LosLaw::Integral => Self::IntegralLos,
            LosLaw::WaypointBox => Self::WaypointBox,
            LosLaw::Printed => Self::PrintedLos,
        }
    }
}

/// Why an answer is degraded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degraded {
    /// The solver ended in a status that proves nothing.
    Solver(SolverStatus),
    /// The solver was satisfied or almost, the certificate was not.
    Certificate,
    /// The goal rests on a report too old to be forecast.
    StaleReport,
    /// The deadline came before any program was solved, whatever failed before it.
    Deadline,
}

/// Where one AUV is expected at the times of the trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetForecast {
    /// The AUV.
    pub id: VehicleId,
    /// Where it was when it was last heard of, from which the forecast starts.
    pub estimate: Estimate,
    /// The model used.
    pub model: ForecastModel,
    /// Velocity over ground (north, east) beyond what the model and the report explain, m/s; hand it back in the next
    /// request.
    pub drift: Vector2<f64>,
    /// Positions (north, east) at the times of the trajectory, m.
    pub positions: Vec<Vector2<f64>>,
    /// Depths at the times of the trajectory, m, positive down.
    pub depths: Vec<f64>,
    /// Doubt of the positions, m: root mean square of the distance from where the AUV will be.
    pub position_sigmas: Vec<f64>,
}

impl TargetForecast {
    /// All AUVs at `times` after the snapshot, s, in the memory of earlier ones.
    pub(crate) fn of_all(
        snapshot: &Snapshot,
        times: &[f64],
        forecasts: &[AuvForecast],
        mut memory: Vec<Self>,
    ) -> Vec<Self> {
        memory.truncate(snapshot.auvs.len());
        let known = snapshot.auvs.iter().zip(snapshot.estimates()).zip(forecasts);
        for (i, ((auv, estimate), forecast)) in known.enumerate() {
            if memory.len() == i {
                memory.push(Self::without_times(auv, estimate));
            }
            memory[i].update(auv, estimate, forecast, times);
        }
        memory
    }

    fn without_times(auv: &Auv, estimate: &Estimate) -> Self {
        Self {
            id: auv.id.clone(),
            estimate: estimate.clone(),
            model: ForecastModel::Hold,
            drift: Vector2::zeros(),
            positions: Vec::new(),
            depths: Vec::new(),
            position_sigmas: Vec::new(),
        }
    }

    fn update(&mut self, auv: &Auv, estimate: &Estimate, forecast: &AuvForecast, times: &[f64]) {
        self.id.0.clone_from(&auv.id.0);
        self.estimate.state.clone_from(&estimate.state);
        self.estimate.rejected.clone_from(&estimate.rejected);
        self.model = forecast.model;
        self.drift = forecast.drift();
        let position = |time: &f64| forecast.at(*time).position;
        refill(&mut self.positions, times.iter().map(position));
        let depth = |time: &f64| forecast.depth_at(*time);
        refill(&mut self.depths, times.iter().map(depth));
        let sigma = |time: &f64| forecast.position_variance(*time).sqrt();
        refill(&mut self.position_sigmas, times.iter().map(sigma));
    }
}

impl From<&TargetForecast> for PreviousTarget {
    /// What the next request has to say of it.
    fn from(target: &TargetForecast) -> Self {
        let state = &target.estimate.state;
        Self {
            id: target.id.clone(),
            model: target.model,
            report_age: state.age,
            position: state.position,
            depth: state.depth,
            velocity: state.velocity(),
            turn_rate: state.turn_rate,
            drift: target.drift,
        }
    }
}

/// A line-of-sight law on the same snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    /// Its reference.
    pub reference: Reference,
    /// Where it leads, rolled out over the horizon.
    pub trajectory: Vec<TrajectoryPoint>,
    /// What it is predicted to lead to.
    pub predicted: Predicted,
    /// Limits of position that it breaks on the way.
    pub violations: Vec<Violation>,
}

/// What a trajectory costs, computed from the trajectory alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Tracking, velocity and acceleration terms of the program's cost.
    pub merit: f64,
    /// Root mean square distance to the goal over the horizon, m.
    pub rms_error: f64,
    /// Propulsion energy over the horizon, J.
    pub energy: f64,
}

/// What the solver did, over all passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverReport {
    /// Status of the last pass that led to an answer, else of the one that failed.
    pub status: SolverStatus,
    /// Programs tried, the failed one included.
    pub passes: usize,
    /// Interior-point iterations, all passes together.
    pub iterations: u32,
    /// Residuals of the answer, recomputed outside the solver.
    pub residuals: Option<Residuals>,
    /// Whether the solver was told to stop before it was done: passes that were finished may still have answered.
    pub deadline_hit: bool,
}

impl SolverReport {
    /// No program was tried.
    pub(crate) fn nothing_done() -> Self {
        Self {
            status: SolverStatus::Unsolved,
            passes: 0,
            iterations: 0,
            residuals: None,
            deadline_hit: false,
        }
    }
}

/// A soft limit that a plan does not keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Violation {
    /// Which.
    pub limit: SoftLimit,
    /// What breaks it worst; `None` for the limits of motion and for the area, of which there is one.
    pub about: Option<Subject>,
    /// Time of the worst, s on the snapshot's clock.
    pub time: f64,
    /// By how much at worst, in the limit's own unit (m; m/s; m/s² for the turn rate's row).
    pub amount: f64,
}

/// What in a snapshot a limit is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// A disc to keep out of, by its place in [`keep_outs`](crate::snapshot::Observation::keep_outs).
    KeepOut(usize),
    /// An AUV, by its place in [`auvs`](crate::snapshot::Observation::auvs).
    Auv(usize),
}

/// Limits that may be broken at a price.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoftLimit {
    /// Least forward speed, m/s.
    ForwardSpeed,
    /// Turn rate, as lateral acceleration beyond speed × rate, m/s².
    TurnRate,
    /// Acoustic range, less depth and doubt, m.
    AcousticRange,
    /// Area to stay in, m.
    Area,
    /// Disc to keep out of, m.
    KeepOut,
    /// Distance to keep from an AUV at the surface, m; its price is a disc's.
    SurfacingSeparation,
}
