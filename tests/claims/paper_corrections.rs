//! One test for every equation of the paper that the project corrects: the printed form is written out
//! here, seen to misbehave, and the project's own function seen to behave. `docs/rationale.md#corrections-of-the-source-paper` is
//! the table that these tests back.

mod path_following;
mod tracking;
mod vehicles;
