//! A PostgreSQL server for the tests of one program, with a database for each test.

use std::io::{self, BufRead as _, BufReader, Write as _};
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{self, Child, Command, Stdio};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::{env, fs};

use tempfile::TempDir;

use crate::server::certificate;

/// Debian's directory of the server's programs.
const DEBIAN: &str = "/usr/lib/postgresql";

/// Runs the server until its input ends, at the latest with the test's program, then deletes its
/// directory. Prints a line on start or failure. Root and a key open to others are refused.
const SCRIPT: &str = r#"
cd "$1"
: >log
if [ "$(id -u)" = 0 ]; then as="setpriv --reuid nobody --regid nogroup --clear-groups"; chown -R nobody "$1"; fi
chmod 600 key.pem
$as "$2/initdb" --pgdata=data --username=postgres --auth=trust --no-sync --encoding=UTF8 --locale=C >log 2>&1
$as "$2/pg_ctl" start --wait --pgdata=data --log=log --options="-k $1 -p $3 -c listen_addresses=127.0.0.1 -c fsync=off \
    -c max_connections=200 -c ssl=on -c ssl_cert_file=../certificate.pem -c ssl_key_file=../key.pem" >>log 2>&1 && echo ready || echo failed
cat >/dev/null
$as "$2/pg_ctl" stop --wait --mode=fast --pgdata=data >>log 2>&1
rm -rf "$1"
"#;

struct Server {
    port: u16,
    /// Its certificate, which signs itself.
    certificate: String,
    /// Its input ends with this program.
    _process: Child,
}

static SERVER: LazyLock<Option<Server>> = LazyLock::new(start);

/// The certificate of the server, if there is one.
pub fn authority() -> Option<&'static str> {
    SERVER.as_ref().map(|server| &*server.certificate)
}

/// The URL of a new database. None without PostgreSQL: then the test is skipped, and says so.
pub fn database() -> Option<String> {
    static MADE: AtomicU32 = AtomicU32::new(0);
    let Some(server) = &*SERVER else {
        // Not by `eprintln!`: its output is hidden for passed tests.
        let text = b"SKIPPED: PostgreSQL is not installed (apt-get install postgresql)\n";
        let _ = io::stderr().write_all(text);
        return None;
    };
    let name = format!("missions_{}", MADE.fetch_add(1, Ordering::Relaxed));
    let server = format!("postgres://postgres@127.0.0.1:{}", server.port);
    let _ = psql(&format!("{server}/postgres"), &format!("CREATE DATABASE {name}"));
    Some(format!("{server}/{name}"))
}

/// Removes a database made by [`database`], despite its connections.
pub fn drop(url: &str) {
    let (server, name) = url.rsplit_once('/').expect("is a URL");
    let drop = format!("DROP DATABASE {name} WITH (FORCE)");
    let _ = psql(&format!("{server}/postgres"), &drop);
}

/// Executes statements by `psql` in the database of a URL, and returns the output.
pub fn psql(url: &str, statements: &str) -> String {
    let programs = programs().expect("there is a server");
    let flags = "--no-psqlrc --tuples-only --no-align --set=ON_ERROR_STOP=1";
    let asked = Command::new(programs.join("psql"))
        .args(flags.split(' '))
        .args([url, "-c", statements])
        .output()
        .expect("psql starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    assert!(asked.status.success(), "{}", text(&asked.stderr));
    text(&asked.stdout)
}

/// The folder of `initdb`, which no path has on Debian.
fn programs() -> Option<PathBuf> {
    let paths = env::var_os("PATH").unwrap_or_default();
    let versions = fs::read_dir(DEBIAN).into_iter().flatten().flatten();
    let of_debian = versions.map(|version| version.path().join("bin"));
    let mut folders = env::split_paths(&paths).chain(of_debian);
    let programs = ["initdb", "pg_ctl", "postgres", "psql"];
    folders.find(|folder| programs.iter().all(|program| folder.join(program).is_file()))
}

fn start() -> Option<Server> {
    let programs = programs()?;
    // Below the ports of connections, which could take a free one before the server.
    let first = u16::try_from(process::id() % 10_000).expect("is small");
    let mut ports = (0..10_000).map(|k| 20_000 + (first + k) % 10_000);
    let port = ports.find(|port| TcpListener::bind((Ipv4Addr::LOCALHOST, *port)).is_ok());
    let port = port.expect("a port is free");
    let folder = tempfile::tempdir().map(TempDir::keep).expect("there is room");
    let (certificate, _) = certificate(&folder);
    let mut process = Command::new("sh")
        .args(["-c", SCRIPT, "sh"])
        .args([folder.as_path(), programs.as_path(), Path::new(&port.to_string())])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("there is a shell");
    let mut said = String::new();
    let printed = BufReader::new(process.stdout.as_mut().expect("is piped")).read_line(&mut said);
    let log = || fs::read_to_string(folder.join("log")).unwrap_or_default();
    let is_ready = printed.is_ok() && said == "ready\n";
    assert!(is_ready, "the server does not start: {}", log());
    Some(Server { port, certificate, _process: process })
}
