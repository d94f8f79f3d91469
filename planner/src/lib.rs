//! Pure receding-horizon formation planner: facts in, plan out.
//!
//! A surface craft (ASC) accompanies underwater vehicles (AUVs). From present knowledge,
//! [`plan::plan`] computes a speed and a heading for the craft's inner loops with a second-order
//! cone program, and always also the answer of the saturated line-of-sight law.
//!
//! **Frame.** All public quantities are in one local north-east-down frame: positions and
//! velocities are (north, east), depth is positive down, angles are 0 at north and positive
//! clockwise. Heading is the direction of the bow, course that of motion over ground; each speed is
//! stated as through the water or over ground. SI units and radians throughout.
//!
//! **Folders** in the order of the data flow; each imports only folders above it:
//!
//! | folder | contents |
//! |---|---|
//! | `tuned/` | numbers that were chosen by flights, in tables that campaigns can vary |
//! | `facts/` | angles, paths, vehicles, goals and limits, with their accepted ranges |
//! | `craft/` | the surface craft as data, its response model, and the learning of that model |
//! | `estimate/` | each AUV's state at its last report, filtered from its reports |
//! | `snapshot/` | all facts of one moment, checked, with the estimates from them |
//! | `predict/` | forecasts of the AUVs and the goal, with uncertainty |
//! | `visit/` | schedules of visits: the order and the times |
//! | `localise/` | figures on which measurements from the craft fix AUVs |
//! | `los/` | line-of-sight laws: baseline, first initial guess and fallback |
//! | `avoid/` | other vessels: encounters, and manoeuvres that keep clear of them |
//! | `problem/` | the sampled problem in the craft's frame; [`parameters`] has the tuned numbers |
//! | `program/` | one convex subproblem as a second-order cone program in standard form |
//! | `solve/` | Clarabel, the certificate that checks it, and the stop signal |
//! | `scp/` | sequential convex programming: initial guesses, iterations, predicted cost |
//! | `choose/` | the fallback levels, the selected answer, and the entry point [`plan::plan`] |
//! | `fleet/` | several craft: who serves whom, and the slots of the acoustic network |
//!
//! A plan for an AUV straight ahead:
//!
//! ```
//! use pilotfish_planner::{
//!     Asc, Auv, AuvState, Goal, PlanRequest, Parameters, Snapshot, Workspace,
//!     angle::{Course, Heading},
//!     nalgebra::Vector2,
//!     plan,
//! };
//!
//! let craft = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.5);
//! let auv = AuvState::new(Vector2::new(40.0, 0.0), 9.0, Course::new(0.0), 0.2);
//! let goal = Goal::Track { auv: "auv-1".into() };
//! let mut request = PlanRequest::new(0.0, craft, vec![Auv::new("auv-1", auv)], goal);
//! let (parameters, mut workspace) = (Parameters::default(), Workspace::default());
//!
//! let snapshot = Snapshot::try_from(request.clone())?;
//! let ahead = plan(&snapshot, &parameters, &mut workspace);
//! // The craft closes the distance and has no reason to turn.
//! assert!(0.2 < ahead.reference.speed && ahead.reference.heading.radians().abs() < 0.01);
//!
//! // Memory is an input: the next request returns the answer.
//! request.t_s = 1.0;
//! request.asc.north_m = 0.5;
//! request.previous_plan = Some((&ahead).into());
//! let later = plan(&Snapshot::try_from(request)?, &parameters, &mut workspace);
//! assert!(later.predicted.cost < ahead.baseline.predicted.cost);
//! # Ok::<(), pilotfish_planner::snapshot::InvalidRequest>(())
//! ```
//!
//! **Deliberately absent:** input and output, clocks, randomness, logging, threads, hidden memory.
//! The [`plan::Workspace`] saves time and changes no answer.

mod avoid;
mod choose;
mod coast;
pub mod craft;
pub mod estimate;
mod facts;
pub mod fleet;
mod localise;
pub mod los;
mod predict;
mod problem;
pub mod program;
mod scp;
pub mod snapshot;
pub mod solve;
#[cfg(test)]
mod tests;
pub mod tuned;
mod visit;

pub use choose::explain;
pub use choose::plan::{self, Plan, Workspace, plan};
pub use facts::{angle, path};
pub use localise::candidates::FixedFigure;
pub use nalgebra;
pub use predict::{forecast, goal, smallest_circle, vessel};
pub use problem::parameters::{self, Parameters};
pub use program::sparse;
pub use snapshot::{Asc, Auv, AuvState, Goal, Limits, PlanRequest, PreviousPlan, Snapshot, VehicleId};
pub use solve::certificate;
pub use solve::stop::{self, Stop};
pub use visit::fleet::SchedulingParameters;
pub use visit::hearing::{Heard, Hearing};
