//! The program as a command, and what it says.

use std::{
    env,
    io::{Read as _, Write as _},
    net::TcpStream,
    process::{Command, Output},
    time::Duration,
};

use serde_json::Value;
use tempfile::TempDir;
use tests::server::Server;

/// The program with no setting of the machine's.
pub(crate) fn pilotfish() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_pilotfish"));
    for (variable, _) in env::vars_os() {
        if variable.to_string_lossy().starts_with("PILOTFISH_") {
            program.env_remove(variable);
        }
    }
    program.env_remove("RUST_LOG");
    program
}

pub(crate) fn run(arguments: &[&str]) -> Output {
    pilotfish().args(arguments).output().expect("the program starts")
}

/// A command with no space in its arguments.
pub(crate) fn line(command: &str) -> Output {
    run(&command.split(' ').collect::<Vec<_>>())
}

/// What a run that must succeed printed.
pub(crate) fn printed(output: &Output) -> String {
    assert!(output.status.success(), "{}", said(output));
    stdout(output).to_owned()
}

pub(crate) fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("is JSON")
}

pub(crate) fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("is text")
}

pub(crate) fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).expect("is text")
}

/// Both.
pub(crate) fn said(output: &Output) -> String {
    stdout(output).to_owned() + stderr(output)
}

/// The path of a file in a folder.
pub(crate) fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// The answer of a running program to one request on a connection of its own, as it comes.
pub(crate) fn ask(server: &Server, method: &str, path: &str, body: &str) -> String {
    let mut socket = TcpStream::connect(&server.address).expect("listens");
    socket
        .set_read_timeout(Some(Duration::from_mins(1)))
        .expect("is a socket");
    let request = format!(
        "{method} {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: application/json\r\n\
         content-length: {}\r\n\r\n{body}",
        body.len()
    );
    socket.write_all(request.as_bytes()).expect("takes a request");
    let mut answer = String::new();
    socket.read_to_string(&mut answer).expect("answers and closes");
    answer
}
