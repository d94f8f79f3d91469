//! Pure receding-horizon formation planner: facts in, plan out.
//!
//! A surface craft (ASC) accompanies underwater vehicles (AUVs). Given what is known now, [`plan::plan`]
//! answers with a speed and a heading for the craft's inner loops, from a second-order cone program,
//! and always beside what the saturated line-of-sight law would do.
//!
//! **Frame.** Everything public is in one local north-east-down frame: positions and velocities are
//! (north, east), depth is positive down, angles are 0 at north and positive clockwise. Heading is
//! where the bow points, course where the craft goes; speed is through the water or over ground, and
//! says which. SI units and radians throughout.
//!
//! **Pipeline**, and the order to read the modules in: [`snapshot`] (facts, checked once) and [`path`] →
//! [`estimate`] (where each AUV was when it was last heard of) → [`forecast`] and [`goal`] (where the AUVs and the
//! goal will be; [`smallest_circle`] for a goal between them) → [`los`] and [`response`] (the
//! analytic law, rolled out) → [`program`] (the promises, in standard form) → [`solve`] (Clarabel) →
//! [`certificate`] (checked again) → [`plan`] (the answer, from the rung of the ladder that is predicted to do
//! best). [`policy`] is the sole home of tuned numbers. Beside the pipeline, [`clairvoyant`] says afterwards
//! how near to the goal anybody could have stayed.
//!
//! **Absent on purpose:** input and output, clocks, randomness, logging, threads, hidden memory. The
//! [`plan::Workspace`] saves time and changes no answer.

pub mod angle;
mod answer;
pub mod certificate;
pub mod clairvoyant;
mod common_point;
pub mod craft;
pub mod estimate;
mod follower;
pub mod forecast;
pub mod goal;
mod horizon;
mod invalid_field;
mod ladder;
pub mod los;
mod merit;
mod optimum;
mod passes;
pub mod path;
pub mod plan;
pub mod policy;
pub mod program;
mod refilled;
pub mod response;
mod seeds;
pub mod smallest_circle;
pub mod snapshot;
pub mod solve;
pub mod sparse;
pub mod stop;
mod surroundings;
mod ways;
