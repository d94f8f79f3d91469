//! Access to the service and its configuration: tokens, roles, TLS and the sources of settings.

use tempfile::tempdir;
use tests::server::Server;

use crate::command::{
    ask, ask_as, has_all, line, path, pilotfish, printed, refusal, run, said, serving, written,
};

/// Makes a token in `file`, limited by these flags.
fn add(file: &str, name: &str, role: &str, limits: &[&str]) -> String {
    let arguments = ["token", "add", name, "--role", role, "--tokens", file];
    printed(&run(&[&arguments, limits].concat())).trim().to_owned()
}

#[test]
fn each_role_has_its_permissions() {
    let directory = tempdir().expect("there is room");
    let file = path(&directory, "tokens.json");
    let [reader, operator, admin] =
        ["read-only", "operator", "admin"].map(|role| add(&file, &format!("the-{role}"), role, &[]));
    let server = serving(&["--tokens", &file]);
    let call = |method, path, token| ask_as(&server, token, method, path, "").status;
    for public in ["/", "/livez", "/readyz", "/openapi.json"] {
        assert_eq!(call("GET", public, None), 200, "{public}");
    }
    for token in [None, Some("pf_wrong"), Some(&reader[1..])] {
        assert_eq!(call("GET", "/v1/missions", token), 401);
        assert_eq!(call("DELETE", "/v1/missions/m-1", token), 401);
    }
    // 404 and 415 answer callers that may make the call.
    for (token, list, run, delete) in
        [(&reader, 200, 403, 403), (&operator, 200, 404, 403), (&admin, 200, 404, 404)]
    {
        let token = Some(token.as_str());
        assert_eq!(call("GET", "/v1/missions", token), list);
        assert_eq!(call("POST", "/v1/missions/m-1/run", token), run);
        assert_eq!(call("DELETE", "/v1/missions/m-1", token), delete);
        assert_eq!(call("POST", "/v1/plan", token), 415);
    }
    let listed = said(&run(&["token", "list", "--tokens", &file]));
    has_all(&listed, &["the-operator"]);
    assert!(!listed.contains(&operator[3..]), "a token is shown once");
}

#[test]
fn a_token_limited_to_craft_or_missions_sees_and_changes_only_those() {
    let directory = tempdir().expect("there is room");
    let file = path(&directory, "tokens.json");
    let data = path(&directory, "data");
    let admin = add(&file, "admin", "admin", &[]);
    let bridge = add(&file, "bridge-1", "operator", &["--craft", "craft-1"]);
    let create = |server: &Server, token: &str, craft: &str| {
        let mission = format!(
            r#"{{"schema_version":"1.0","metadata":{{"bridge":"{craft}"}},
                "live":{{"auvs":[{{"id":"a"}}],"goal":{{"kind":"track","auv":"a"}}}}}}"#
        );
        let answer = ask_as(server, Some(token), "POST", "/v1/missions", &mission);
        let id = answer.json()["id"].as_str().unwrap_or_default().to_owned();
        (answer.status.as_u16(), id)
    };
    let start = || serving(&["--tokens", &file, "--data", &data]);
    let first = start();
    let (created, own) = create(&first, &bridge, "craft-1");
    assert_eq!(created, 201);
    assert_eq!(create(&first, &bridge, "craft-2").0, 403);
    let (_, other) = create(&first, &admin, "craft-2");
    drop(first);
    // Limited by the mission's ID, and an admin of that mission only.
    let one = add(&file, "one", "admin", &["--mission", &other]);
    let server = start();
    let ask = |token: &str, method: &str, path: &str, body: &str| {
        let answer = ask_as(&server, Some(token), method, path, body);
        (answer.status.as_u16(), answer.text)
    };

    for (token, theirs, not_theirs) in [(&bridge, &own, &other), (&one, &other, &own)] {
        let (_, listed) = ask(token, "GET", "/v1/missions", "");
        assert!(listed.contains(theirs.as_str()) && !listed.contains(not_theirs.as_str()));
        for (method, call, body, allowed) in [
            ("GET", "", "", 200),
            ("GET", "/scene", "", 200),
            ("GET", "/record?format=csv", "", 200),
            ("PATCH", "", r#"{"keep_outs":null}"#, 200),
            ("POST", "/run", "", 200),
            ("POST", "/reports", r#"{"notes":[]}"#, 422),
            ("GET", "/reference", "", 409),
            ("POST", "/pause", "", 200),
            ("POST", "/finish", "", 200),
            ("GET", "/events", "", 204),
        ] {
            let (status, answer) = ask(token, method, &format!("/v1/missions/{theirs}{call}"), body);
            assert_eq!(status, allowed, "{method} {call}: {answer}");
            let (status, answer) = ask(token, method, &format!("/v1/missions/{not_theirs}{call}"), body);
            assert_eq!(status, 403, "{method} {call}: {answer}");
            has_all(&answer, &["\"mission_forbidden\""]);
        }
    }
    let (_, answer) = ask(&bridge, "GET", &format!("/v1/missions/{other}"), "");
    has_all(&answer, &["limited to craft craft-1"]);
    assert_eq!(ask(&bridge, "GET", "/v1/missions/m-1", "").0, 404);
    let (_, access) = ask(&bridge, "GET", "/v1/access", "");
    has_all(&access, &[r#""limit":{"craft":["craft-1"]}"#]);
    // The audit names other missions, and a new mission is another one.
    assert_eq!(ask(&one, "GET", "/v1/audit", "").0, 403);
    assert_eq!(create(&server, &one, "craft-2").0, 403);
    assert_eq!(ask(&one, "DELETE", &format!("/v1/missions/{own}"), "").0, 403);
    assert_eq!(ask(&one, "DELETE", &format!("/v1/missions/{other}"), "").0, 204);
    assert_eq!(ask(&admin, "GET", &format!("/v1/missions/{own}"), "").0, 200);
    let listed = said(&run(&["token", "list", "--tokens", &file]));
    has_all(&listed, &[&format!("missions {other}")]);
}

#[test]
fn a_service_on_a_network_needs_tokens_and_tls() {
    let directory = tempdir().expect("there is room");
    let file = path(&directory, "tokens.json");
    let data = path(&directory, "data");
    let away = format!("--host 0.0.0.0 --port 0 --tokens {file} --data {data}");
    let refused = line(&away);
    assert_eq!(refused.status.code(), Some(1));
    has_all(refusal(&refused), &["neither tokens"]);
    add(&file, "bridge", "operator", &[]);
    has_all(refusal(&line(&away)), &["no TLS"]);
}

#[test]
fn half_a_certificate_is_refused() {
    let half = "--port 0 --tls-certificate /nowhere.pem";
    has_all(refusal(&line(half)), &["both --tls-certificate and --tls-key"]);
    let both = line(&format!("{half} --tls-key /nowhere.key"));
    has_all(refusal(&both), &["/nowhere.pem"]);
}

#[test]
fn every_setting_is_a_flag_a_variable_and_a_key_and_shows_its_source() {
    let directory = tempdir().expect("there is room");
    let text = "port = 9001\ndeadline_ms = 50\nallow_host = [\"ship.example\"]\n";
    let file = written(&directory, "pilotfish.toml", text);
    let output = pilotfish()
        .args(["--config", &file, "config"])
        .args(["--port", "9003", "--log-format", "json"])
        .env("PILOTFISH_PORT", "9002")
        .env("PILOTFISH_INSECURE", "yes")
        .env("PILOTFISH_ALLOW_HOST", "a.example, b.example")
        .output()
        .expect("starts");
    let printed = printed(&output);
    for (line, source) in [
        ("port = 9003", "--port"),
        ("deadline_ms = 50", file.as_str()),
        ("insecure = true", "PILOTFISH_INSECURE"),
        ("allow_host = [\"a.example\", \"b.example\"]", "PILOTFISH_ALLOW_HOST"),
        ("log_format = \"json\"", "--log-format"),
        ("host = \"127.0.0.1\"", "default"),
    ] {
        let found = printed.lines().find(|printed| printed.starts_with(line));
        let found = found.unwrap_or_else(|| panic!("{line} is not in\n{printed}"));
        assert!(found.ends_with(&format!("# {source}")), "{found}");
    }

    // The printed text is a file with the same meaning.
    let again = written(&directory, "again.toml", &printed);
    let output = run(&["config", "--config", &again]);
    let value = |line: &str| line.split("  # ").next().unwrap_or("").trim().to_owned();
    let values = |text: &str| text.lines().map(value).collect::<Vec<_>>();
    assert_eq!(values(&said(&output)), values(&printed));
}

#[test]
fn an_error_of_a_setting_names_its_flag_variable_or_key() {
    let config = |variable: &str, value: &str| {
        let mut config = pilotfish();
        config.arg("config").env(variable, value);
        config.output().expect("starts")
    };
    let refused = config("PILOTFISH_PORT", "a lot");
    assert_eq!(refused.status.code(), Some(2));
    has_all(refusal(&refused), &["PILOTFISH_PORT: \"a lot\" must be"]);
    let refused = line("serve --deadline-ms 0");
    assert_eq!(refused.status.code(), Some(2));
    has_all(refusal(&refused), &["--deadline-ms"]);
    let refused = line("--port 1 scenarios");
    has_all(refusal(&refused), &["--port is an option of serve"]);
    let ignored = config("PILOTFISH_PROT", "1");
    has_all(&said(&ignored), &["unknown setting PILOTFISH_PROT"]);
}

#[test]
fn flags_of_the_service_may_precede_or_follow_the_subcommand() {
    for arguments in
        [&["--deadline-ms", "7", "serve"][..], &["serve", "--deadline-ms", "7"], &["--deadline-ms", "7"]]
    {
        assert!(ask(&serving(arguments), "GET", "/livez", "").status == 200);
    }
    let data = tempdir().expect("there is room");
    let data = data.path().to_string_lossy();
    for command in [format!("--data {data} backup /nowhere"), format!("backup /nowhere --data {data}")] {
        has_all(refusal(&line(&command)), &[&data]);
    }
}
