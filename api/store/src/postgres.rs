//! The store in PostgreSQL, which several services share.
//!
//! ```text
//! actors ── Append ──► a writer thread: BEGIN; lock; check epochs; append; COMMIT ──► replies
//! keeper ── a thread that renews this service's lease, and ends those of services that are gone
//! readers ── connections of a pool
//! ```
//! A reply says if its commit may have failed; then the client sends again with the same key.

use std::env;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use clock::Clock;
use tokio_postgres::{
    Config,
    config::{Host, SslMode, TargetSessionAttrs},
};

use super::command::LogWriter as _;
use super::error::StoreError;
use super::metrics::StoreMetrics;
use super::ownership::{Member, Trouble};
use super::reader::EventReader;
use super::roots::verified_by;
use super::trusted_time::{TrustedClock, TrustedTime};
use super::{Backend, EventStore};

pub(super) mod batch;
mod columns;
mod keeper;
mod lease;
mod link;
mod schema;
mod tls;
mod wait;
mod writer;

pub use lease::Lease;
use link::{Database, PATIENCE};
use tls::Tls;
use writer::PostgresWriter;

/// Time for a connection to one host: the next host may answer.
const CONNECT_TIME: Duration = Duration::from_secs(1);

const SCHEMES: [&str; 2] = ["postgres://", "postgresql://"];

/// The database of a URL, migrated to the newest tables.
pub(super) fn open(url: &str) -> Result<Database, StoreError> {
    let database = database(url)?;
    schema::migrate(&database.connect()?, database.name())?;
    Ok(database)
}

impl EventReader {
    /// Reads the store in the database of a URL; services may be writing to it.
    pub fn of_database(url: &str) -> Result<Self, StoreError> {
        let database = database(url)?;
        let pooled = database.reading()?;
        pooled.with(|link| schema::require_newest(link, database.name()))?;
        Ok(Self::in_database(pooled))
    }
}

impl Backend for Database {
    fn reader(&self) -> Result<EventReader, StoreError> {
        Ok(EventReader::in_database(self.reading()?))
    }

    fn trouble(&self, trouble: Option<Trouble>) {
        Self::trouble(self, trouble);
    }
}

impl EventStore {
    /// `true` if the database of a URL may be on another machine, whose services may share it. A
    /// wrong URL is refused later.
    pub fn is_elsewhere(url: &str) -> bool {
        without_tls(url).parse::<Config>().is_ok_and(|config| !is_on_this_machine(&config))
    }

    /// Opens the store in the database of a URL, for a service that takes part as `member`, or for
    /// a program that appends nothing. The missions of one client may take at most `share` bytes.
    pub fn open_database(
        url: &str,
        member: Option<Member>,
        share: u64,
        machine: &Clock,
    ) -> Result<Self, StoreError> {
        let database = open(url)?;
        let mut time = TrustedTime::read(&database.connect()?)?;
        time.adopt(machine);
        let clock = TrustedClock::new(time, machine);
        let join = |member| Lease::join(database.clone(), member, machine);
        let lease = member.map(join).transpose()?;
        let metrics = StoreMetrics::default();
        let mut writer = PostgresWriter::new((&database, &lease), share, clock.clone(), metrics.clone())?;
        writer.keep_time(time)?;
        let name = database.name().to_owned();
        Self::run(database, lease, clock, metrics, writer)
            .map_err(|error| StoreError::open(name.as_ref(), &error))
    }
}

fn database(url: &str) -> Result<Database, StoreError> {
    let address = without_tls(url);
    let read = |address: &str| {
        let config = address.parse::<Config>();
        // The library's reason may repeat the password.
        config.map_err(|_| invalid("is not postgres://user@host:port,host:port/database"))
    };
    let config = read(&address)?;
    if !SCHEMES.iter().any(|scheme| url.starts_with(scheme)) || config.get_hosts().is_empty() {
        return Err(invalid("begins with postgres:// and names a host"));
    }
    let name = name(&config);
    let refused = |reason: &str| StoreError::open(name.as_ref(), &reason);
    let unencrypted = || is_on_this_machine(&config).then(|| "disable".to_owned());
    let (ssl_mode, roots) = match parameter(url, "sslmode").or_else(unencrypted).as_deref() {
        Some("disable") => (SslMode::Disable, None),
        Some("require" | "verify-full") => {
            let file = parameter(url, "sslrootcert").ok_or_else(|| {
                refused("sslmode needs sslrootcert=FILE, by which the server's certificate is verified")
            })?;
            (SslMode::Require, Some(PathBuf::from(file)))
        }
        _ => {
            let advice = "add sslmode=verify-full&sslrootcert=FILE, or sslmode=disable in a trusted network";
            return Err(refused(advice));
        }
    };
    let mut hosts = vec![];
    for address in of_each_host(&address) {
        let mut host = read(&address)?;
        if host.get_password().is_none()
            && let Ok(password) = env::var("PGPASSWORD")
        {
            host.password(password);
        }
        host.ssl_mode(ssl_mode)
            .application_name("pilotfish")
            .target_session_attrs(TargetSessionAttrs::ReadWrite)
            .connect_timeout(CONNECT_TIME)
            .tcp_user_timeout(PATIENCE)
            .keepalives_idle(PATIENCE)
            .keepalives_interval(CONNECT_TIME)
            .keepalives_retries(2);
        hosts.push(host);
    }
    let client = verified_by(roots.as_deref()).map_err(|reason| refused(&reason))?;
    Database::new(hosts, Tls(Arc::new(client)), name)
}

fn invalid(why: &str) -> StoreError {
    StoreError::open(Path::new("of --store"), &format!("the URL {why}"))
}

/// A parameter of TLS. Certificates are verified as by PostgreSQL's `verify-full`.
fn parameter(url: &str, key: &str) -> Option<String> {
    let (_, query) = url.split_once('?')?;
    let mut pairs = form_urlencoded::parse(query.as_bytes());
    let (_, value) = pairs.find(|(name, _)| name == key)?;
    Some(value.into_owned())
}

fn without_tls(url: &str) -> String {
    let Some((address, query)) = url.split_once('?') else {
        return url.to_owned();
    };
    let is_other = |pair: &&str| !pair.starts_with("sslmode=") && !pair.starts_with("sslrootcert=");
    let others: Vec<_> = query.split('&').filter(is_other).collect();
    format!("{address}?{}", others.join("&"))
}

/// One address for each host of `address`.
fn of_each_host(address: &str) -> Vec<String> {
    let parts = address.split_once("://").and_then(|(scheme, rest)| {
        let end = rest.find(['/', '?']).unwrap_or(rest.len());
        let (authority, rest) = rest.split_at(end);
        let (login, hosts) = authority.rsplit_once('@').unwrap_or(("", authority));
        let at = if login.is_empty() { "" } else { "@" };
        (!hosts.is_empty()).then(|| {
            let one = |host| format!("{scheme}://{login}{at}{host}{rest}");
            hosts.split(',').map(one).collect()
        })
    });
    // Hosts may also be parameters.
    parts.unwrap_or_else(|| vec![address.to_owned()])
}

fn is_on_this_machine(config: &Config) -> bool {
    config.get_hosts().iter().all(is_this_machine) && config.get_hostaddrs().iter().all(IpAddr::is_loopback)
}

fn is_this_machine(host: &Host) -> bool {
    match host {
        Host::Tcp(name) => {
            name == "localhost" || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
        }
        Host::Unix(_) => true,
    }
}

/// Hosts and database, for messages.
fn name(config: &Config) -> String {
    let hosts = config.get_hosts().iter().map(|host| match host {
        Host::Tcp(name) => name.clone(),
        Host::Unix(path) => path.display().to_string(),
    });
    let hosts: Vec<String> = hosts.collect();
    let database = config.get_dbname().unwrap_or_default();
    format!("postgres://{}/{database}", hosts.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_error_repeats_the_password() {
        for url in [
            "postgres://one:secret@database.example/missions",
            "postgres://one:secret@database.example/missions?sslmode=verify-full",
            "postgres://one:secret@:x/missions",
            "http://one:secret@127.0.0.1/missions",
        ] {
            let refused = database(url).expect_err("is refused").to_string();
            assert!(!refused.contains("secret"), "{refused}");
        }
        assert_eq!(
            of_each_host("postgres://a:b@[::1]:5,two/c?d=e"),
            ["postgres://a:b@[::1]:5/c?d=e", "postgres://a:b@two/c?d=e"]
        );
        assert_eq!(of_each_host("postgres:///c?host=/d"), ["postgres:///c?host=/d"]);
        let database = database("postgres://one:secret@127.0.0.1:1,localhost:2/missions").expect("is one");
        assert_eq!(database.name(), "postgres://127.0.0.1,localhost/missions");
        assert!(!format!("{database:?}").contains("secret"));
    }
}
