//! The page in a real browser: it draws both tracks, complains of nothing, and asks nobody else.

use std::{
    env,
    ffi::OsString,
    fs,
    io::{BufRead, BufReader},
    path::PathBuf,
    process::{Child, Command, Output, Stdio},
};

/// Chromium's log of a console message holds this.
const CONSOLE: &str = "CONSOLE";

struct Server {
    process: Child,
    url: String,
}

impl Server {
    fn start() -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_pilotfish"))
            .args(["--port", "0"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut line = String::new();
        let printed = process.stdout.take().expect("is piped");
        BufReader::new(printed)
            .read_line(&mut line)
            .expect("prints its URL");
        let at = line.find("http://").expect("prints its URL");
        Self {
            process,
            url: line[at..].trim().to_owned(),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The browser that `PILOTFISH_CHROMIUM` names, which must then work, or one on the path, if there is any.
fn chromium() -> Option<OsString> {
    env::var_os("PILOTFISH_CHROMIUM").or_else(|| {
        let found = |name: &&str| {
            Command::new(name)
                .arg("--version")
                .output()
                .is_ok_and(|out| out.status.success())
        };
        ["chromium", "chromium-browser", "google-chrome"]
            .iter()
            .find(|name| found(name))
            .map(OsString::from)
    })
}

struct Visit {
    dom: String,
    log: String,
    requests: Vec<String>,
}

fn visit(chromium: &OsString, url: &str, name: &str) -> Visit {
    let profile = env::temp_dir().join(format!("pilotfish-page-{name}-{}", std::process::id()));
    fs::create_dir_all(&profile).expect("can be made");
    let net_log = profile.join("net.json");
    let Output { stdout, stderr, .. } = Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
        ])
        .args([
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
        ])
        .args([
            "--enable-logging=stderr",
            "--virtual-time-budget=5000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("--log-net-log={}", net_log.display()))
        .arg(url)
        .output()
        .expect("the browser starts");
    let visit = Visit {
        dom: String::from_utf8_lossy(&stdout).into_owned(),
        log: String::from_utf8_lossy(&stderr).into_owned(),
        requests: requests_of_pages(&net_log),
    };
    // Left behind if the browser still writes there: the system clears it.
    let _ = fs::remove_dir_all(&profile);
    visit
}

/// Every URL that a page asked for, and not the browser for itself.
fn requests_of_pages(net_log: &PathBuf) -> Vec<String> {
    let text = fs::read_to_string(net_log).expect("the browser logs its requests");
    let mut urls = Vec::new();
    for event in text.lines().filter(|line| line.contains("\"initiator\":\"http")) {
        if let Some(rest) = event.split("\"url\":\"").nth(1) {
            urls.extend(rest.split('"').next().map(str::to_owned));
        }
    }
    urls
}

#[test]
fn the_page_draws_both_tracks_of_every_example_without_complaint_or_foreign_request() {
    let Some(chromium) = chromium() else {
        eprintln!("no Chromium here: the page was not looked at");
        return;
    };
    let server = Server::start();
    for example in api::examples::EXAMPLES {
        let url = format!("{}/?example={}", server.url, example.name);
        let Visit { dom, log, requests } = visit(&chromium, &url, example.name);
        assert!(dom.contains("data-state=\"ready\""), "{url}: {dom}\n{log}");
        for id in [
            "track-mpc",
            "track-los",
            "track-goal",
            "asc",
            "reference-mpc",
            "reference-los",
        ] {
            let at = dom
                .find(&format!("<path id=\"{id}\""))
                .or_else(|| dom.find(&format!("id=\"{id}\"")));
            let drawn = at.and_then(|at| dom[at..].split('>').next()).unwrap_or_default();
            assert!(drawn.contains(" d=\"M"), "{url}: {id} is {drawn:?}");
        }
        assert!(!dom.contains("NaN"), "{url}");
        assert!(!log.contains(CONSOLE), "{url}: {log}");
        assert!(
            requests
                .iter()
                .any(|request| request.ends_with("/v1/plan/compare")),
            "{requests:?}"
        );
        assert!(
            requests.iter().all(|request| request.starts_with(&server.url)),
            "{requests:?}"
        );
    }
}
