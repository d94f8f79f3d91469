//! The `pilotfish` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    pilotfish::run()
}
