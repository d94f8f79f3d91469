//! The program for its users. Only its own package knows its binary, so this is not in `tests/`.

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
