//! The program itself, serving on a real socket.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use rcgen::{CertifiedKey, generate_simple_self_signed};
use tempfile::TempDir;

/// A running server, stopped when dropped.
#[derive(Debug)]
pub struct Server {
    /// The program.
    pub process: Child,
    /// Its output after the first line, until a caller takes it.
    pub printed: Option<BufReader<ChildStdout>>,
    /// Host and port.
    pub address: String,
    /// Its missions, if it has its own directory.
    pub data: Option<TempDir>,
}

impl Server {
    /// Starts `program` (`pilotfish` with or without `serve`) on a free port, without missions.
    pub fn start(mut program: Command) -> Self {
        let data = tempfile::tempdir().expect("there is room");
        program.env("PILOTFISH_DATA", data.path());
        Self::start_in(Some(data), program, 0)
    }

    /// Starts `program` on `port`, for example an earlier server's, whose `--data` it may continue.
    pub fn start_on(program: Command, port: u16) -> Self {
        Self::start_in(None, program, port)
    }

    fn start_in(data: Option<TempDir>, mut program: Command, port: u16) -> Self {
        // Every call is logged at info: a test's output should show only errors.
        let mut said = program.get_envs();
        if !said.any(|(name, value)| name == "PILOTFISH_LOG" && value.is_some()) {
            program.env("PILOTFISH_LOG", "warn");
        }
        let mut process = program
            .args(["--port", &port.to_string()])
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut printed = BufReader::new(process.stdout.take().expect("is piped"));
        let mut line = String::new();
        printed.read_line(&mut line).expect("prints its URL");
        let (_, address) = line.trim().rsplit_once("://").expect("prints its URL");
        let address = address.split(',').next().unwrap_or_default().to_owned();
        Self { process, printed: Some(printed), address, data }
    }

    /// The port on which it listens.
    pub fn port(&self) -> u16 {
        let port = self.address.rsplit_once(':').map(|(_, port)| port.parse());
        port.expect("an address has a port").expect("a port is a number")
    }

    /// Its address, such as `http://127.0.0.1:40123`.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Some tests have already stopped it.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A certificate for this machine and its key, in files of `directory`.
pub fn certificate(directory: &Path) -> (String, String) {
    let CertifiedKey { cert, signing_key } =
        generate_simple_self_signed(["localhost".to_owned(), "127.0.0.1".to_owned()]).expect("are names");
    let files = [("certificate.pem", cert.pem()), ("key.pem", signing_key.serialize_pem())];
    let [certificate, key] = files.map(|(name, text)| {
        let path = directory.join(name);
        fs::write(&path, text).expect("there is room");
        path.to_string_lossy().into_owned()
    });
    (certificate, key)
}
