//! The program as its users start it. Only a package's own tests know where its binary is, so these are not in `tests/`.

mod access;
mod campaign;
mod cli;
mod command;
mod crowd;
mod demo;
mod deployment;
mod docs;
mod examples;
mod figures;
mod markdown;
mod mistakes;
mod readme;
mod routes;
