//! The program itself, serving on a real socket.

use std::{
    io::{BufRead, BufReader},
    process::{Child, ChildStdout, Command, Stdio},
};

/// A running server, stopped when dropped.
#[derive(Debug)]
pub struct Server {
    /// The program.
    pub process: Child,
    /// What it prints after its first line, until somebody takes it.
    pub printed: Option<BufReader<ChildStdout>>,
    /// Host and port.
    pub address: String,
}

impl Server {
    /// Starts `program`, which must be `pilotfish` with or without `serve`, on a free port.
    ///
    /// # Panics
    /// Where it does not start or prints no URL: the test's finding.
    #[must_use]
    pub fn start(mut program: Command) -> Self {
        let mut process = program
            .args(["--port", "0"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut printed = BufReader::new(process.stdout.take().expect("is piped"));
        let mut line = String::new();
        printed.read_line(&mut line).expect("prints its URL");
        let address = line
            .trim()
            .rsplit_once("http://")
            .expect("prints its URL")
            .1
            .to_owned();
        Self {
            process,
            printed: Some(printed),
            address,
        }
    }

    /// Where it listens, such as `http://127.0.0.1:40123`.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Already gone in a test that stops it.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
