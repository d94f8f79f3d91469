//! One test for every corrected equation of the paper: the printed form fails, the project's own
//! function works. The table is `docs/rationale.md#corrections-of-the-source-paper`.

mod path_following;
mod tracking;
mod vehicles;
