//! `pilotfish token`: the tokens of clients.

use std::{error::Error, path::Path, time::Duration};

use clap::builder::{NonEmptyStringValueParser, PossibleValuesParser};
use clap::{Args, Subcommand};
use clock::Clock;
use service::access::{NewToken, Role, TokenFile, TokenLimit};

use crate::cli::out_file::print;

const DAY: Duration = Duration::from_hours(24);

#[derive(Debug, Args)]
pub(crate) struct Token {
    #[command(subcommand)]
    command: TokenCommand,
}

#[derive(Debug, Subcommand)]
enum TokenCommand {
    /// Create a token and print it, once. After the first token, every client needs one.
    Add {
        /// Name of the client, as in logs and in the audit.
        name: String,
        /// Permissions: read-only plans and reads; operator also creates, runs and reports to
        /// missions; admin also deletes missions and reads the audit.
        #[arg(long, value_parser = PossibleValuesParser::new(Role::ALL.map(Role::name)))]
        role: String,
        /// Limit the token to this mission; may be repeated. Without --mission and --craft it is
        /// valid for all missions.
        #[arg(long, value_name = "ID", value_parser = NonEmptyStringValueParser::new())]
        mission: Vec<String>,
        /// Limit the token to missions of this craft: the --name of its bridge; may be repeated.
        #[arg(long, value_name = "NAME", value_parser = NonEmptyStringValueParser::new())]
        craft: Vec<String>,
        /// Days of validity; unlimited by default.
        #[arg(long, value_name = "DAYS")]
        days: Option<u16>,
    },
    /// List the tokens.
    List,
    /// Revoke a token.
    Revoke {
        /// Name of the token.
        name: String,
    },
}

/// Changes or shows the token file at `path`. A running service reads the change within a second.
pub(crate) fn token(arguments: &Token, path: &Path) -> Result<(), Box<dyn Error>> {
    match &arguments.command {
        TokenCommand::Add { name, role, mission, craft, days } => {
            let limit = TokenLimit { missions: mission.clone(), craft: craft.clone() };
            let role = Role::ALL.into_iter().find(|known| known.name() == role);
            let token = NewToken {
                name: name.clone(),
                role: role.expect("clap takes no other"),
                limit: Some(limit).filter(|limit| *limit != TokenLimit::default()),
                valid: days.map(|days| DAY * u32::from(days)),
            };
            print(&format!("{}\n", TokenFile::add(path, token, &Clock::machine())?))?;
        }
        TokenCommand::List => {
            for token in TokenFile::read(path)?.unwrap_or_default().tokens {
                let expires = token.expires_s.map(|at| format!("  expires at Unix time {at} s"));
                let limit = token.limit.map(|limit| format!("  {limit}"));
                let (limit, expires) = (limit.unwrap_or_default(), expires.unwrap_or_default());
                let (name, role) = (token.name, token.role.name());
                print(&format!("{name:24} {role:9}{limit}{expires}\n"))?;
            }
        }
        TokenCommand::Revoke { name } => TokenFile::revoke(path, name)?,
    }
    Ok(())
}
