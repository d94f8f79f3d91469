//! `pilotfish token`: who may call the service.

use std::{error::Error, path::Path, time::Duration};

use clap::{Args, Subcommand, builder::PossibleValuesParser};
use service::access::{NewToken, Role, TokenFile};

use crate::cli::out_file::print;

const DAY: Duration = Duration::from_hours(24);

#[derive(Debug, Args)]
pub(crate) struct Token {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a token and print it, once. With the first one, the service asks every client for a token.
    Add {
        /// Whose it is, as logs and the audit show it.
        name: String,
        /// What its bearer may do: plan and look; also make missions, run them and report; also delete, and see who changed
        /// what.
        #[arg(long, value_parser = PossibleValuesParser::new(Role::ALL.map(Role::name)))]
        role: String,
        /// How long it is valid, days; for ever if not given.
        #[arg(long, value_name = "DAYS")]
        days: Option<u16>,
    },
    /// List the tokens by name.
    List,
    /// Make a token invalid.
    Revoke {
        /// Its name.
        name: String,
    },
}

/// Changes or shows the file of tokens at `path`. A service that runs takes the change up within a second.
pub(crate) fn token(arguments: &Token, path: &Path) -> Result<(), Box<dyn Error>> {
    match &arguments.command {
        Command::Add { name, role, days } => {
            let role = Role::ALL.into_iter().find(|known| known.name() == role);
            let token = TokenFile::add(
                path,
                NewToken {
                    name: name.clone(),
                    role: role.expect("clap takes no other"),
                    valid: days.map(|days| DAY * u32::from(days)),
                },
            )?;
            print(&format!("{token}\n"))?;
        }
        Command::List => {
            for token in TokenFile::read(path)?.unwrap_or_default().tokens {
                let expires = token
                    .expires_s
                    .map_or_else(String::new, |at| format!("  expires at Unix time {at} s"));
                print(&format!("{:24} {:9}{expires}\n", token.name, token.role.name()))?;
            }
        }
        Command::Revoke { name } => TokenFile::revoke(path, name)?,
    }
    Ok(())
}
