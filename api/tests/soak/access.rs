//! Tokens and certificates that change while the service runs, and TLS with curl.

use std::{fs, process::Command};

use rustix::process::Signal;
use tempfile::tempdir;
use tests::server::certificate;

use crate::command::{path, printed, run, serving, signal};
use crate::until;

fn add(file: &str, name: &str, role: &str) -> String {
    let made = run(&["token", "add", name, "--role", role, "--tokens", file]);
    printed(&made).trim().to_owned()
}

/// The status that curl gets, and the answer's body.
pub(crate) fn curl(arguments: &[&str]) -> (u16, String) {
    let output = Command::new("curl")
        .args(["-s", "--max-time", "20", "-w", "\n%{http_code}"])
        .args(arguments)
        .output()
        .expect("curl is installed");
    let text = String::from_utf8(output.stdout).expect("is text");
    let (body, status) = text.rsplit_once('\n').expect("has a status");
    (status.parse().expect("is a number"), body.to_owned())
}

#[test]
fn curl_trusts_the_certificate_of_a_service_and_a_renewed_one_needs_no_restart() {
    let directory = tempdir().expect("there is room");
    let file = path(&directory, "tokens.json");
    let token = add(&file, "bridge", "operator");
    let (certificate, key) = certificate(directory.path());
    let tls = ["--tls-certificate", &certificate, "--tls-key", &key];
    let server = serving(&[&["--host", "0.0.0.0", "--tokens", &file][..], &tls].concat());
    let url = format!("https://localhost:{}/v1/missions", server.port());
    let bearer = format!("authorization: Bearer {token}");
    let trusted = ["--cacert", &certificate, "-H", &bearer, &url];
    assert_eq!(curl(&trusted).0, 200);
    assert_eq!(curl(&["--cacert", &certificate, &url]).0, 401);
    // Curl does not trust a certificate of our own by itself.
    assert_eq!(curl(&["-H", &bearer, &url]).0, 0);
    let in_the_clear = url.replace("https", "http");
    assert_eq!(curl(&["-H", &bearer, &in_the_clear]).0, 0);

    // A renewed certificate is loaded without a restart.
    let before = fs::read(&certificate).expect("is there");
    let (renewed, _) = tests::server::certificate(directory.path());
    assert_ne!(fs::read(&renewed).expect("is there"), before);
    assert_eq!(curl(&trusted).0, 0, "the service still shows the old certificate");
    signal(&server.process, Signal::HUP);
    until("the new certificate is loaded", || curl(&trusted).0 == 200);
}
