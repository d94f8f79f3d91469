//! One test for every equation of the paper that the project corrects: the printed form is written out
//! here, seen to misbehave, and the project's own function seen to behave. `docs/corrections.md` is
//! the table that these tests back.

#[path = "paper_corrections/path_following.rs"]
mod path_following;
#[path = "paper_corrections/tracking.rs"]
mod tracking;
#[path = "paper_corrections/vehicles.rs"]
mod vehicles;
