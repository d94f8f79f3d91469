//! The program as its users start it. Only a package's own tests know where its binary is, so these are not in `tests/`.

mod access;
mod campaign;
mod cli;
mod command;
mod crowd;
mod demo;
mod docs;
mod examples;
mod figures;
mod markdown;
mod mistakes;
mod readme;
mod routes;

/// Left out by `just test-fast`, like every other module of this name.
mod slow {
    mod bridge;
    mod faults;
    mod kill;
    mod shared;
}
