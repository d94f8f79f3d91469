//! The command line.

use std::{error::Error, path::PathBuf};

use clap::{Parser, Subcommand};

mod backup;
mod bridge;
mod campaign;
mod config;
mod crafts;
mod declared_craft;
mod identify;
mod manual;
mod missions;
mod out_file;
mod plan;
mod replay;
mod scenarios;
mod serve;
mod token;
mod trial;
mod upkeep;

pub(crate) use self::config::Config;
use self::{
    backup::{Backup, back_up},
    bridge::{Bridge, Preflight, bridge, preflight},
    campaign::{CampaignCommand, campaign},
    config::{CommonFlags, ConfigError, Layers, ServeFlags, show},
    crafts::{Crafts, crafts},
    identify::{Identify, identify},
    manual::{Completions, ManualPages, completions, manual_pages},
    missions::{Compare, Figures, Simulate, compare, figures, simulate},
    plan::{Plan, plan},
    replay::{Replay, replay},
    scenarios::{Scenarios, scenarios},
    serve::serve,
    token::{Token, token},
    upkeep::{Retain, retain, vacuum},
};

/// Formation planner for a surface craft that accompanies underwater vehicles.
#[derive(Debug, Parser)]
#[command(name = "pilotfish", version)]
pub(crate) struct Arguments {
    /// File of settings, TOML; its keys are the flags with _ in place of - [env: PILOTFISH_CONFIG]
    #[arg(long, global = true, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    common: CommonFlags,
    #[command(flatten)]
    serve: ServeFlags,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Answer HTTP requests (the default).
    Serve(ServeFlags),
    /// Print the configuration, and where each value is from.
    Config(ServeFlags),
    /// Say who may call the service, and what each may do.
    Token(Token),
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
    /// Connect a craft's autopilot to a live mission.
    #[command(subcommand)]
    Bridge(Bridge),
    /// Look before departure at all that a bridge lives on: clocks, fixes, heading, current, parameters.
    Preflight(Preflight),
    /// Make every plan of a stored mission again and compare.
    Replay(Replay),
    /// Copy the log of missions, while the service runs.
    Backup(Backup),
    /// Delete missions that have been over for long, while no service runs: --keep-days is for one that does.
    Retention(Retain),
    /// Give the room of deleted missions back to the disk, while no service runs.
    Vacuum,
    /// Fly many missions of many controllers in worlds drawn from one seed, and report what they come to.
    #[command(subcommand)]
    Campaign(CampaignCommand),
    /// Fly what campaigns were sent to a broker, as long as there is work.
    #[cfg(feature = "nats")]
    Worker(campaign::WorkerFlags),
    /// Print the file that completes commands in a shell.
    #[command(hide = true)]
    Completions(Completions),
    /// Write the manual pages.
    #[command(hide = true, name = "man")]
    ManualPages(ManualPages),
}

/// Why the command line cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub(crate) enum UsageError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error("{0} is for serve and config, not for this subcommand")]
    NotOfService(String),
}

impl Arguments {
    /// The configuration that these arguments, the environment and the file give.
    pub(crate) fn layers(&self) -> Result<Layers, UsageError> {
        let flags = match &self.command {
            None => vec![&self.serve],
            Some(Command::Serve(flags) | Command::Config(flags)) => vec![&self.serve, flags],
            Some(_) => match self.serve.first() {
                Some(flag) => return Err(UsageError::NotOfService(flag)),
                None => vec![],
            },
        };
        Ok(Layers::read(self.config.as_deref(), &self.common, &flags)?)
    }

    /// What is logged: of a bridge's own service only what is wrong, unless it is asked for, or its calls would drown the bridge's lines.
    pub(crate) fn log_directives(&self, config: &Config) -> String {
        match &self.command {
            Some(Command::Bridge(_) | Command::Preflight(_)) => {
                format!("pilotfish_service=warn,{}", config.log)
            }
            _ => config.log.clone(),
        }
    }

    pub(crate) fn run(self, layers: &Layers, config: &Config) -> Result<(), Box<dyn Error>> {
        match self.command {
            None | Some(Command::Serve(_)) => serve(config)?,
            Some(Command::Config(_)) => show(layers)?,
            Some(Command::Token(arguments)) => token(&arguments, &config.tokens())?,
            Some(Command::Plan(arguments)) => plan(&arguments)?,
            Some(Command::Simulate(arguments)) => simulate(&arguments)?,
            Some(Command::Compare(arguments)) => compare(&arguments)?,
            Some(Command::Scenarios(arguments)) => scenarios(&arguments)?,
            Some(Command::Identify(arguments)) => identify(&arguments)?,
            Some(Command::Crafts(arguments)) => crafts(&arguments)?,
            Some(Command::Figures(arguments)) => figures(&arguments)?,
            Some(Command::Bridge(arguments)) => bridge(arguments, config)?,
            Some(Command::Preflight(arguments)) => preflight(&arguments, config)?,
            Some(Command::Replay(arguments)) => replay(&arguments, &config.data)?,
            Some(Command::Backup(arguments)) => back_up(&arguments, &config.data)?,
            Some(Command::Retention(arguments)) => retain(&arguments, &config.data)?,
            Some(Command::Vacuum) => vacuum(&config.data)?,
            Some(Command::Campaign(command)) => campaign(&command)?,
            #[cfg(feature = "nats")]
            Some(Command::Worker(arguments)) => campaign::work(&arguments)?,
            Some(Command::Completions(arguments)) => completions(&arguments)?,
            Some(Command::ManualPages(arguments)) => manual_pages(&arguments)?,
        }
        Ok(())
    }
}
