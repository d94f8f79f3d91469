//! The command line.

use std::{error::Error, path::PathBuf};

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

mod backup;
mod bridge;
#[cfg(feature = "laboratory")]
mod campaign;
mod config;
#[cfg(feature = "postgres")]
mod copy_store;
mod crafts;
mod declared_areas;
mod declared_craft;
mod declared_routes;
mod demo;
mod failure;
#[cfg(feature = "laboratory")]
mod identify;
mod manual;
#[cfg(feature = "laboratory")]
mod missions;
mod out_file;
mod plan;
mod progress;
mod replay;
mod route;
mod scenarios;
mod serve;
mod token;
#[cfg(feature = "laboratory")]
mod trial;
mod upkeep;

use self::config::{CommonFlags, Layers, ServeFlags, hidden_places, show};
pub(crate) use self::{config::Config, out_file::visible};

/// Formation planner for a surface craft that accompanies underwater vehicles.
#[derive(Debug, Parser)]
#[command(name = "pilotfish", version)]
pub(crate) struct Arguments {
    /// Configuration file, TOML; its keys are the flag names with _ for - [env: PILOTFISH_CONFIG]
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
    /// Run the HTTP service (the default).
    Serve(ServeFlags),
    /// Run a simulated mission, and show it in the browser (--data DIRECTORY keeps it).
    Demo(demo::Demo),
    /// Print the configuration and the source of each value.
    Config(ServeFlags),
    /// Create, list and revoke the tokens of clients.
    Token(token::Token),
    /// Plan for one snapshot without a server.
    Plan(plan::Plan),
    /// Print and draw the route of a planning tool's file; lay lanes over an area.
    Route(route::Route),
    /// Simulate one mission with one controller.
    #[cfg(feature = "laboratory")]
    Simulate(missions::Simulate),
    /// Simulate one mission with the planner and with each tuned line-of-sight law.
    #[cfg(feature = "laboratory")]
    Compare(missions::Compare),
    /// List the built-in scenarios; print a scenario file, or the JSON Schema of scenario files.
    Scenarios(scenarios::Scenarios),
    /// Identify the parameters of a craft from the log of a sea trial.
    #[cfg(feature = "laboratory")]
    Identify(identify::Identify),
    /// List the built-in craft; print a craft file.
    Crafts(crafts::Crafts),
    /// Connect a craft's autopilot to a live mission.
    #[command(subcommand)]
    Bridge(Box<bridge::Bridge>),
    /// Check everything that a bridge needs before departure: clocks, fixes, heading, current,
    /// parameters.
    Preflight(Box<bridge::Preflight>),
    /// Recompute every plan of a stored mission and compare.
    Replay(replay::Replay),
    /// Copy the mission log and the tokens; the service may be running.
    Backup(backup::Backup),
    /// Copy all missions from a data directory to a database, or back (stop the services first).
    #[cfg(feature = "postgres")]
    CopyStore(copy_store::CopyStore),
    /// Delete old finished missions (stop the service first; a running service has --keep-days).
    Retention(upkeep::Retain),
    /// Return the disk space of deleted missions (stop the service first).
    Vacuum,
    /// Simulate many missions with several controllers, and report the statistics.
    #[cfg(feature = "laboratory")]
    #[command(subcommand)]
    Campaign(campaign::CampaignCommand),
    /// Run the campaigns of a broker until no work is left.
    #[cfg(feature = "nats")]
    Worker(campaign::WorkerFlags),
    /// Print the completion script of a shell.
    Completions(manual::Completions),
    /// Write the manual pages.
    #[command(name = "man")]
    ManualPages(manual::ManualPages),
}

/// The command line of clap. Commands without missions and tokens hide `--data` and `--tokens`.
fn command_line() -> clap::Command {
    Arguments::command().mut_subcommands(|command| match command.get_name() {
        "serve" | "config" | "token" | "bridge" | "preflight" | "replay" | "backup" | "retention"
        | "vacuum" => command,
        _ => command.args(hidden_places()),
    })
}

/// The feature that brings a command that this program lacks.
fn brought_by(command: &str) -> Option<String> {
    let feature = match command {
        "simulate" | "compare" | "campaign" | "identify" if !cfg!(feature = "laboratory") => "laboratory",
        "copy-store" if !cfg!(feature = "postgres") => "postgres",
        "worker" | "submit" | "watch" | "collect" if !cfg!(feature = "nats") => "nats",
        "ros2" => {
            let launch = "the ROS 2 package brings it: ros2 launch pilotfish_ros2 pilotfish.launch.py";
            return Some(launch.to_owned());
        }
        _ => return None,
    };
    Some(format!("the feature `{feature}` brings it: cargo build --release --features {feature}"))
}

impl Arguments {
    /// The arguments of this process. Exits if they are wrong.
    pub(crate) fn of_process() -> Self {
        let given = command_line().try_get_matches();
        let given = given.and_then(|matches| Self::from_arg_matches(&matches));
        given.unwrap_or_else(|mut wrong| {
            let unknown = match wrong.get(ContextKind::InvalidSubcommand) {
                Some(ContextValue::String(command)) => brought_by(command),
                _ => None,
            };
            if let Some(tip) = unknown {
                wrong.remove(ContextKind::SuggestedSubcommand);
                wrong.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
            }
            wrong.exit()
        })
    }

    pub(crate) fn layers(&self) -> Result<Layers, Box<dyn Error>> {
        let flags = match &self.command {
            None => vec![&self.serve],
            Some(Command::Serve(flags) | Command::Config(flags)) => vec![&self.serve, flags],
            Some(_) => match self.serve.first() {
                Some(flag) => return Err(format!("{flag} is an option of serve and config only").into()),
                None => vec![],
            },
        };
        Layers::read(self.config.as_deref(), &self.common, &flags)
    }

    /// The log filter. By default, a bridge's or a demo's own service logs warnings only.
    pub(crate) fn log_directives(&self, config: &Config) -> String {
        match &self.command {
            Some(Command::Bridge(_) | Command::Preflight(_) | Command::Demo(_)) => {
                format!("pilotfish_service=warn,{}", config.log)
            }
            _ => config.log.clone(),
        }
    }

    pub(crate) fn run(self, layers: &Layers, config: &Config) -> Result<(), Box<dyn Error>> {
        if config.store.is_some() && matches!(self.command, Some(Command::Backup(_) | Command::Vacuum)) {
            let advice =
                "the missions are in a database (--store), which has backups and a vacuum of its own";
            return Err(advice.into());
        }
        match self.command {
            None | Some(Command::Serve(_)) => serve::serve(config)?,
            Some(Command::Demo(arguments)) => demo::demo(&arguments, layers, config)?,
            Some(Command::Config(_)) => show(layers)?,
            Some(Command::Token(arguments)) => token::token(&arguments, &config.tokens())?,
            Some(Command::Plan(arguments)) => plan::plan(&arguments)?,
            Some(Command::Route(arguments)) => route::route(&arguments)?,
            #[cfg(feature = "laboratory")]
            Some(Command::Simulate(arguments)) => missions::simulate(&arguments)?,
            #[cfg(feature = "laboratory")]
            Some(Command::Compare(arguments)) => missions::compare(&arguments)?,
            Some(Command::Scenarios(arguments)) => scenarios::scenarios(&arguments)?,
            #[cfg(feature = "laboratory")]
            Some(Command::Identify(arguments)) => identify::identify(&arguments)?,
            Some(Command::Crafts(arguments)) => crafts::crafts(&arguments)?,
            Some(Command::Bridge(arguments)) => bridge::bridge(*arguments, config)?,
            Some(Command::Preflight(arguments)) => bridge::preflight(&arguments, config)?,
            Some(Command::Replay(arguments)) => replay::replay(&arguments, config)?,
            Some(Command::Backup(arguments)) => backup::back_up(&arguments, &config.data, &config.tokens())?,
            #[cfg(feature = "postgres")]
            Some(Command::CopyStore(arguments)) => copy_store::copy_store(&arguments)?,
            Some(Command::Retention(arguments)) => upkeep::retain(&arguments, config)?,
            Some(Command::Vacuum) => upkeep::vacuum(&config.data)?,
            #[cfg(feature = "laboratory")]
            Some(Command::Campaign(command)) => campaign::campaign(&command)?,
            #[cfg(feature = "nats")]
            Some(Command::Worker(arguments)) => campaign::work(&arguments)?,
            Some(Command::Completions(arguments)) => manual::completions(&arguments, command_line())?,
            Some(Command::ManualPages(arguments)) => manual::manual_pages(&arguments, command_line())?,
        }
        Ok(())
    }
}
