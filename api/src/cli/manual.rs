//! `pilotfish completions` and `pilotfish man`: what packages install beside the program.

use std::{fs, io, path::PathBuf};

use clap::{Args, CommandFactory as _};
use clap_complete::Shell;

use crate::cli::{
    Arguments,
    out_file::{NotPrinted, print},
};

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    shell: Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManualPages {
    /// Directory for the pages, one for each command, made if it is not there.
    directory: PathBuf,
}

/// Prints the file that completes commands in a shell.
pub(crate) fn completions(arguments: &Completions) -> Result<(), NotPrinted> {
    let mut file = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "pilotfish", &mut file);
    print(&String::from_utf8_lossy(&file))
}

/// Writes the manual pages.
pub(crate) fn manual_pages(arguments: &ManualPages) -> io::Result<()> {
    fs::create_dir_all(&arguments.directory)?;
    clap_mangen::generate_to(Arguments::command(), &arguments.directory)
}
