//! `pilotfish completions` and `pilotfish man`: files that packages install with the program.

use std::{fs, io, path::PathBuf};

use clap::{Args, Command};
use clap_complete::Shell;

use crate::cli::{failure::Failure, out_file::print};

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    shell: Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManualPages {
    /// Directory for the pages, one for each command; created if missing.
    directory: PathBuf,
}

pub(crate) fn completions(arguments: &Completions, mut command: Command) -> Result<(), Failure> {
    let mut file = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "pilotfish", &mut file);
    print(&String::from_utf8_lossy(&file))
}

pub(crate) fn manual_pages(arguments: &ManualPages, command: Command) -> io::Result<()> {
    fs::create_dir_all(&arguments.directory)?;
    clap_mangen::generate_to(command, &arguments.directory)
}
