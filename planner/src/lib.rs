//! Pure receding-horizon formation planner: facts in, plan out.

pub mod angle;
pub mod forecast;
pub mod goal;
pub mod los;
pub mod plan;
pub mod policy;
pub mod snapshot;
