//! The command line.

use std::error::Error;

use clap::{Parser, Subcommand};

mod backup;
mod crafts;
mod declared_craft;
mod identify;
mod missions;
mod out_file;
mod plan;
mod replay;
mod scenarios;
mod serve;
mod trial;

use self::{
    backup::{Backup, back_up},
    crafts::{Crafts, crafts},
    identify::{Identify, identify},
    missions::{Bench, Compare, Figures, Simulate, bench, compare, figures, simulate},
    plan::{Plan, plan},
    replay::{Replay, replay},
    scenarios::{Scenarios, scenarios},
    serve::{Serve, serve},
};

/// Formation planner for a surface craft that accompanies underwater vehicles.
#[derive(Debug, Parser)]
#[command(name = "pilotfish", version, args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    serve: Serve,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Answer HTTP requests (the default).
    Serve(Serve),
    /// Plan for one snapshot without a server.
    Plan(Plan),
    /// Run one mission with one controller.
    Simulate(Simulate),
    /// Run one mission with the planner and with the tuned line-of-sight law.
    Compare(Compare),
    /// List what there is to simulate; print a scenario's file, or the JSON Schema of scenario files.
    Scenarios(Scenarios),
    /// Learn how a craft answers its references from a log of a sea trial.
    Identify(Identify),
    /// List the craft that are known by name.
    Crafts(Crafts),
    /// Draw the source paper's figures from missions flown here.
    Figures(Figures),
    /// Make every plan of a stored mission again and compare.
    Replay(Replay),
    /// Copy the log of missions, while the service runs.
    Backup(Backup),
    /// Score every controller in every scenario over many seeds.
    Bench(Bench),
}

impl Arguments {
    pub(crate) fn run(self) -> Result<(), Box<dyn Error>> {
        match self.command.unwrap_or(Command::Serve(self.serve)) {
            Command::Serve(arguments) => serve(&arguments)?,
            Command::Plan(arguments) => plan(&arguments)?,
            Command::Simulate(arguments) => simulate(&arguments)?,
            Command::Compare(arguments) => compare(&arguments)?,
            Command::Scenarios(arguments) => scenarios(&arguments)?,
            Command::Identify(arguments) => identify(&arguments)?,
            Command::Crafts(arguments) => crafts(&arguments)?,
            Command::Figures(arguments) => figures(&arguments)?,
            Command::Replay(arguments) => replay(&arguments)?,
            Command::Backup(arguments) => back_up(&arguments)?,
            Command::Bench(arguments) => bench(&arguments)?,
        }
        Ok(())
    }
}
