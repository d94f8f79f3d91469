//! Who may call the program, and how it is configured: tokens, roles, TLS, and settings from every place.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
    thread::sleep,
    time::{Duration, Instant},
};

use rcgen::{CertifiedKey, generate_simple_self_signed};
use tempfile::{TempDir, tempdir};
use tests::server::Server;

/// How long a changed file of tokens may go unnoticed, and then some.
const REREAD: Duration = Duration::from_secs(10);

fn pilotfish() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_pilotfish"));
    for (variable, _) in std::env::vars_os() {
        if variable.to_string_lossy().starts_with("PILOTFISH_") {
            program.env_remove(variable);
        }
    }
    program.env_remove("RUST_LOG");
    program
}

fn run(arguments: &[&str]) -> Output {
    pilotfish().args(arguments).output().expect("the program starts")
}

fn said(output: &Output) -> String {
    let (out, err) = (&output.stdout, &output.stderr);
    format!("{}{}", String::from_utf8_lossy(out), String::from_utf8_lossy(err))
}

/// Makes a token in `file`.
fn add(file: &str, name: &str, role: &str) -> String {
    let made = run(&["token", "add", name, "--role", role, "--tokens", file]);
    assert!(made.status.success(), "{}", said(&made));
    String::from_utf8(made.stdout).expect("is text").trim().to_owned()
}

/// The status that curl gets, and the answer's body.
fn curl(arguments: &[&str]) -> (u16, String) {
    let output = Command::new("curl")
        .args(["-s", "--max-time", "20", "-w", "\n%{http_code}"])
        .args(arguments)
        .output()
        .expect("curl is installed");
    let text = String::from_utf8(output.stdout).expect("is text");
    let (body, status) = text.rsplit_once('\n').expect("has a status");
    (status.parse().expect("is a number"), body.to_owned())
}

/// The status of a call with a token, if any.
fn call(server: &Server, method: &str, path: &str, token: Option<&str>) -> u16 {
    let authorization = token.map(|token| format!("authorization: Bearer {token}"));
    let url = format!("{}{path}", server.url());
    let mut arguments = vec!["-X", method, &url];
    if let Some(authorization) = &authorization {
        arguments.extend(["-H", authorization]);
    }
    curl(&arguments).0
}

fn path(directory: &TempDir, name: &str) -> String {
    directory.path().join(name).to_string_lossy().into_owned()
}

#[test]
fn each_role_may_do_what_it_is_for_and_a_revoked_token_nothing() {
    let directory = tempdir().expect("there is room");
    let file = path(&directory, "tokens.json");
    let mut program = pilotfish();
    program.args(["--tokens", &file]);
    let server = Server::start(program);
    assert_eq!(
        call(&server, "GET", "/v1/missions", None),
        200,
        "no token was made"
    );
    let [reader, operator, admin] =
        ["read-only", "operator", "admin"].map(|role| add(&file, &format!("the-{role}"), role));
    let end = Instant::now() + REREAD;
    while call(&server, "GET", "/v1/missions", None) == 200 {
        assert!(Instant::now() < end, "the first token is not taken up");
        sleep(Duration::from_millis(100));
    }

    for public in ["/", "/livez", "/readyz", "/openapi.json"] {
        assert_eq!(call(&server, "GET", public, None), 200, "{public}");
    }
    for token in [None, Some("pf_wrong"), Some(&reader[1..])] {
        assert_eq!(call(&server, "GET", "/v1/missions", token), 401);
        assert_eq!(call(&server, "DELETE", "/v1/missions/m-1", token), 401);
    }
    // 404 and 415 are answers to those who may ask.
    for (token, list, run, delete) in [
        (&reader, 200, 403, 403),
        (&operator, 200, 404, 403),
        (&admin, 200, 404, 404),
    ] {
        let token = Some(token.as_str());
        assert_eq!(call(&server, "GET", "/v1/missions", token), list);
        assert_eq!(call(&server, "POST", "/v1/missions/m-1/run", token), run);
        assert_eq!(call(&server, "DELETE", "/v1/missions/m-1", token), delete);
        assert_eq!(call(&server, "POST", "/v1/plan", token), 415);
    }

    let listed = run(&["token", "list", "--tokens", &file]);
    assert!(said(&listed).contains("the-operator"), "{}", said(&listed));
    assert!(!said(&listed).contains(&operator[3..]), "a token is shown once");
    assert!(
        run(&["token", "revoke", "the-operator", "--tokens", &file])
            .status
            .success()
    );
    let end = Instant::now() + REREAD;
    while call(&server, "GET", "/v1/missions", Some(&operator)) == 200 {
        assert!(Instant::now() < end, "the revoked token is still valid");
        sleep(Duration::from_millis(100));
    }
    assert_eq!(call(&server, "GET", "/v1/missions", Some(&admin)), 200);
}

#[test]
fn a_service_that_others_reach_wants_tokens_and_tls_or_to_be_told() {
    let directory = tempdir().expect("there is room");
    let file = path(&directory, "tokens.json");
    let data = path(&directory, "data");
    let away = [
        "--host", "0.0.0.0", "--port", "0", "--tokens", &file, "--data", &data,
    ];

    let refused = run(&away);
    assert_eq!(refused.status.code(), Some(1));
    assert!(said(&refused).contains("neither tokens"), "{}", said(&refused));
    let token = add(&file, "bridge", "operator");
    let refused = run(&away);
    assert!(said(&refused).contains("no TLS"), "{}", said(&refused));

    let (certificate, key) = certificate(directory.path());
    let mut program = pilotfish();
    program.args(["--host", "0.0.0.0", "--tokens", &file]).args([
        "--tls-certificate",
        &certificate,
        "--tls-key",
        &key,
    ]);
    let server = Server::start(program);
    let url = format!("https://localhost:{}/v1/missions", server.port());
    let bearer = format!("authorization: Bearer {token}");
    let trusted = ["--cacert", &certificate, "-H", &bearer, &url];
    assert_eq!(curl(&trusted).0, 200);
    assert_eq!(curl(&["--cacert", &certificate, &url]).0, 401);
    assert_eq!(
        curl(&["-H", &bearer, &url]).0,
        0,
        "the certificate is our own: curl does not trust it by itself"
    );
    let in_the_clear = url.replace("https", "http");
    assert_eq!(curl(&["-H", &bearer, &in_the_clear]).0, 0);

    // A renewed certificate is taken up without a restart.
    let before = fs::read(&certificate).expect("is there");
    let (renewed, _) = self::certificate(directory.path());
    assert_ne!(fs::read(&renewed).expect("is there"), before);
    assert_eq!(curl(&trusted).0, 0, "the service still shows the old certificate");
    let hang_up = Command::new("kill")
        .args(["-HUP", &server.process.id().to_string()])
        .status();
    assert!(hang_up.expect("kill is installed").success());
    let end = Instant::now() + REREAD;
    while curl(&trusted).0 != 200 {
        assert!(Instant::now() < end, "the new certificate is not taken up");
        sleep(Duration::from_millis(100));
    }
}

/// A certificate for this machine and its key, in files of `directory`.
fn certificate(directory: &Path) -> (String, String) {
    let CertifiedKey { cert, signing_key } =
        generate_simple_self_signed(["localhost".to_owned(), "127.0.0.1".to_owned()]).expect("are names");
    let files = [
        ("certificate.pem", cert.pem()),
        ("key.pem", signing_key.serialize_pem()),
    ];
    let [certificate, key] = files.map(|(name, text)| {
        let path = directory.join(name);
        fs::write(&path, text).expect("there is room");
        path.to_string_lossy().into_owned()
    });
    (certificate, key)
}

#[test]
fn half_a_certificate_is_refused() {
    let refused = run(&["--port", "0", "--tls-certificate", "/nowhere.pem"]);
    assert!(
        said(&refused).contains("both --tls-certificate and --tls-key"),
        "{}",
        said(&refused)
    );
    let refused = run(&[
        "--port",
        "0",
        "--tls-certificate",
        "/nowhere.pem",
        "--tls-key",
        "/nowhere.key",
    ]);
    assert!(said(&refused).contains("/nowhere.pem"), "{}", said(&refused));
}

#[test]
fn every_setting_is_a_flag_a_variable_and_a_key_and_says_where_it_is_from() {
    let directory = tempdir().expect("there is room");
    let file = path(&directory, "pilotfish.toml");
    fs::write(
        &file,
        "port = 9001\ndeadline_ms = 50\nallow_host = [\"ship.example\"]\n",
    )
    .expect("is written");
    let output = pilotfish()
        .args([
            "--config",
            &file,
            "config",
            "--port",
            "9003",
            "--log-format",
            "json",
        ])
        .env("PILOTFISH_PORT", "9002")
        .env("PILOTFISH_INSECURE", "yes")
        .env("PILOTFISH_ALLOW_HOST", "a.example, b.example")
        .output()
        .expect("starts");
    assert!(output.status.success(), "{}", said(&output));
    let printed = String::from_utf8(output.stdout).expect("is text");
    for (line, source) in [
        ("port = 9003", "--port"),
        ("deadline_ms = 50", file.as_str()),
        ("insecure = true", "PILOTFISH_INSECURE"),
        (
            "allow_host = [\"a.example\", \"b.example\"]",
            "PILOTFISH_ALLOW_HOST",
        ),
        ("log_format = \"json\"", "--log-format"),
        ("host = \"127.0.0.1\"", "default"),
    ] {
        let found = printed.lines().find(|printed| printed.starts_with(line));
        let found = found.unwrap_or_else(|| panic!("{line} is not in\n{printed}"));
        assert!(found.ends_with(&format!("# {source}")), "{found}");
    }

    // What is printed is a file that means the same.
    let again = path(&directory, "again.toml");
    fs::write(&again, &printed).expect("is written");
    let output = run(&["config", "--config", &again]);
    let values = |text: &str| -> Vec<String> {
        text.lines()
            .map(|line| line.split("  # ").next().unwrap_or("").trim().to_owned())
            .collect()
    };
    assert_eq!(values(&said(&output)), values(&printed));
}

#[test]
fn a_wrong_setting_is_blamed_by_the_name_under_which_it_was_given() {
    let refused = pilotfish()
        .args(["config"])
        .env("PILOTFISH_PORT", "a lot")
        .output()
        .expect("starts");
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        said(&refused).contains("PILOTFISH_PORT: \"a lot\" should be"),
        "{}",
        said(&refused)
    );
    let refused = run(&["serve", "--deadline-ms", "0"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("--deadline-ms"), "{}", said(&refused));
    let refused = run(&["--port", "1", "scenarios"]);
    assert!(
        said(&refused).contains("--port is for serve"),
        "{}",
        said(&refused)
    );
    let ignored = pilotfish()
        .args(["config"])
        .env("PILOTFISH_PROT", "1")
        .output()
        .expect("starts");
    assert!(
        said(&ignored).contains("PILOTFISH_PROT is no setting"),
        "{}",
        said(&ignored)
    );
}

#[test]
fn flags_of_the_service_stand_before_or_after_its_name() {
    for arguments in [
        &["--deadline-ms", "7", "serve"][..],
        &["serve", "--deadline-ms", "7"],
        &["--deadline-ms", "7"],
    ] {
        let mut program = pilotfish();
        program.args(arguments);
        let server = Server::start(program);
        assert_eq!(call(&server, "GET", "/livez", None), 200);
    }
    let data = tempdir().expect("there is room");
    let data = data.path().to_string_lossy().into_owned();
    for arguments in [
        ["--data", &data, "backup", "/nowhere"],
        ["backup", "/nowhere", "--data", &data],
    ] {
        let refused = run(&arguments);
        assert!(said(&refused).contains(&data), "{}", said(&refused));
    }
}
