//! The PostgreSQL database that two services share in a voyage.
//!
//! The server is another process, yet a voyage replays to the byte: all services wait for its
//! answers on one thread, so transactions follow each other and no simulated time passes.

use std::thread;

use tokio::runtime::{Builder, Runtime};
use tokio_postgres::{Client, NoTls, SimpleQueryMessage};

use crate::postgres;

/// Notes events from another service than the owner, except the first, which makes the mission.
const WATCH: &str = "
CREATE TABLE IF NOT EXISTS strangers (what TEXT NOT NULL);
CREATE OR REPLACE FUNCTION watch_owner() RETURNS TRIGGER LANGUAGE plpgsql AS $$ DECLARE owner TEXT; BEGIN
    SELECT url INTO owner FROM missions JOIN services ON services.id = owner_service WHERE number = NEW.mission;
    IF 1 < NEW.sequence AND owner IS DISTINCT FROM current_setting('voyage.service') THEN
        INSERT INTO strangers VALUES (format('event %s of %s, but %s is the owner', NEW.sequence, current_setting('voyage.service'), owner));
    END IF;
    RETURN NULL;
END $$;
CREATE OR REPLACE TRIGGER watch_owner AFTER INSERT ON events FOR EACH ROW EXECUTE FUNCTION watch_owner();
";

/// The URL of a service.
pub(super) fn name(service: usize) -> String {
    format!("http://host-{service}")
}

pub(super) struct Database {
    url: String,
    client: Client,
    /// None once it is dropped.
    runtime: Option<Runtime>,
}

impl Database {
    /// A new one; none without PostgreSQL.
    pub(super) fn new() -> Option<Self> {
        let url = postgres::database()?;
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.expect("a runtime starts");
        let connected = blocking(|| {
            runtime.block_on(async {
                let (client, connection) = tokio_postgres::connect(&url, NoTls).await?;
                tokio::spawn(connection);
                Ok::<_, tokio_postgres::Error>(client)
            })
        });
        Some(Self { client: connected.expect("the server answers"), url, runtime: Some(runtime) })
    }

    /// The URL by which a service opens it, and by which [`WATCH`] knows the service.
    pub(super) fn url_for(&self, service: usize) -> String {
        let name = name(service);
        format!("{}?options=-c%20voyage.service%3D{name}", self.url)
    }

    /// The URL for readers.
    pub(super) fn url(&self) -> &str {
        &self.url
    }

    /// Watches the sources of events, once there are tables.
    pub(super) fn watch(&self) {
        self.first(WATCH);
    }

    /// The URL of the owner of the mission.
    pub(super) fn owner(&self) -> Option<String> {
        self.first("SELECT url FROM missions JOIN services ON services.id = owner_service")
    }

    /// An event from another service than the owner.
    pub(super) fn stranger(&self) -> Option<String> {
        self.first("SELECT what FROM strangers LIMIT 1")
    }

    /// The first value of the first row.
    fn first(&self, statements: &str) -> Option<String> {
        let runtime = self.runtime.as_ref().expect("is there");
        let answers = blocking(|| runtime.block_on(self.client.simple_query(statements)));
        let answers = answers.expect("the server answers");
        answers.iter().find_map(|answer| match answer {
            SimpleQueryMessage::Row(row) => row.get(0).map(str::to_owned),
            _ => None,
        })
    }
}

/// Does `work` on a thread of its own, because a runtime may not block in another one.
fn blocking<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    thread::scope(|scope| scope.spawn(work).join()).expect("asks")
}

impl Drop for Database {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
        postgres::drop(&self.url);
    }
}
