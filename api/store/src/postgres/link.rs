//! Connections to the database, and the waits for its answers.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt as _;
use parking_lot::{Condvar, Mutex, MutexGuard};
use rusqlite::types::ValueRef::{self, Blob, Integer, Null, Real, Text};
use tokio::runtime;
use tokio::task::{AbortHandle, JoinSet};
use tokio_postgres::config::Host;
use tokio_postgres::error::SqlState;
use tokio_postgres::types::{ToSql, Type};
use tokio_postgres::{Client, Config, Error, Statement};

use super::super::error::StoreError;
use super::super::ownership::Trouble;
use super::super::rows::{Param, Rows, SqlRow};
use super::super::sql::without_nul;
use super::tls::Tls;
use super::wait::{wait_for, wait_while};

/// Longest wait for an answer of the database: a commit may wait for a standby.
pub(crate) const PATIENCE: Duration = Duration::from_secs(3);

/// Longest time to connect to any of the hosts.
const CONNECT_TIME: Duration = Duration::from_secs(2);

/// Session settings. A service that stops in a transaction must not keep its locks: others take its
/// missions. Acknowledged commits are synced, also on a synchronous standby, whatever the defaults.
const SESSION: &str = "SET idle_in_transaction_session_timeout = '1s'; SET lock_timeout = '2s'; \
    SET default_transaction_isolation = 'read committed'; SELECT set_config('synchronous_commit', 'on', false) \
    WHERE current_setting('synchronous_commit') IN ('off', 'local')";

/// Most connections for queries, beside those of the writer and the keeper. Further queries wait.
const QUERIES_MAX: usize = 48;

/// Connections among these for questions about ownership.
const OWNING: usize = 8;

/// The trouble, and the number of statements since it began.
type Troubled = Arc<Mutex<Option<(Trouble, u32)>>>;

/// A database, reached through any of its writable hosts. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Database(Arc<Pool>);

struct Pool {
    hosts: Vec<Config>,
    tls: Tls,
    /// Hosts and name, without user and password.
    name: String,
    spare: Mutex<Spare>,
    /// Notified when a connection comes back.
    returned: Condvar,
    troubled: Troubled,
    /// Runs the connections; none once it is dropped.
    runtime: Option<runtime::Runtime>,
}

#[derive(Default)]
struct Spare {
    links: Vec<Link>,
    n_used: usize,
}

impl fmt::Debug for Pool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.spare.lock().links.clear();
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

impl Database {
    pub(super) fn new(hosts: Vec<Config>, tls: Tls, name: String) -> Result<Self, StoreError> {
        let runtime = runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("postgres")
            .enable_all()
            .build()
            .map_err(|error| StoreError::open(name.as_ref(), &error))?;
        Ok(Self(Arc::new(Pool {
            hosts,
            tls,
            name,
            spare: Mutex::default(),
            returned: Condvar::new(),
            troubled: Troubled::default(),
            runtime: Some(runtime),
        })))
    }

    pub(crate) fn name(&self) -> &str {
        &self.0.name
    }

    /// Disturbs all connections from now on.
    pub(crate) fn trouble(&self, trouble: Option<Trouble>) {
        *self.0.troubled.lock() = trouble.map(|trouble| (trouble, 0));
    }

    /// A new connection to a writable host.
    pub(crate) fn connect(&self) -> Result<Link, StoreError> {
        self.connect_for(PATIENCE)
    }

    /// A new connection whose answers may take at most `patience`.
    pub(crate) fn connect_for(&self, patience: Duration) -> Result<Link, StoreError> {
        let pool = &*self.0;
        if matches!(*pool.troubled.lock(), Some((Trouble::Cut, _))) {
            return Err(StoreError::silent());
        }
        let runtime = pool.runtime.as_ref().ok_or(StoreError::Closed)?;
        let connecting = runtime.spawn(first_of(pool.hosts.clone(), pool.tls.clone()));
        let abort = connecting.abort_handle();
        let Some(connected) = wait_for(connecting, patience.min(CONNECT_TIME)) else {
            abort.abort();
            return Err(StoreError::silent());
        };
        let (client, task) = connected.map_err(|_| StoreError::Closed)??;
        Ok(Link {
            client,
            statements: RefCell::default(),
            task,
            patience,
            troubled: Arc::clone(&pool.troubled),
        })
    }

    /// A connection for reads.
    pub(crate) fn reading(&self) -> Result<Pooled, StoreError> {
        self.one_of(QUERIES_MAX - OWNING)
    }

    /// A connection for a question about ownership, which reads must not delay.
    pub(super) fn owning(&self) -> Result<Pooled, StoreError> {
        self.one_of(QUERIES_MAX)
    }

    fn one_of(&self, most: usize) -> Result<Pooled, StoreError> {
        let all_used = |spare: &mut Spare| most <= spare.n_used;
        let waited = wait_while(&self.0.returned, self.spare(), PATIENCE, all_used);
        let mut spare = waited.ok_or(StoreError::Busy)?;
        spare.n_used += 1;
        let link = spare.links.pop();
        drop(spare);
        // From here on, dropping `pooled` gives the place back.
        let mut pooled = Pooled { database: self.clone(), link, broken: RefCell::new(false) };
        if pooled.link.is_none() {
            pooled.link = Some(self.connect()?);
        }
        Ok(pooled)
    }

    fn spare(&self) -> MutexGuard<'_, Spare> {
        self.0.spare.lock()
    }
}

/// Connects to the first writable host. All are tried at the same time: one of them may be silent.
async fn first_of(hosts: Vec<Config>, tls: Tls) -> Result<(Client, AbortHandle), StoreError> {
    let mut tries = JoinSet::new();
    for config in hosts {
        let tls = tls.clone();
        tries.spawn(async move {
            let connected = async {
                let (client, connection) = config.connect(tls).await?;
                let task = tokio::spawn(connection);
                client.batch_execute(SESSION).await?;
                Ok::<_, Error>((client, task.abort_handle()))
            };
            connected.await.map_err(|error| format!("{}: {}", place_of(&config), with_causes(&error)))
        });
    }
    let mut faults = vec![];
    while let Some(tried) = tries.join_next().await {
        match tried {
            Ok(Ok(connected)) => return Ok(connected),
            Ok(Err(fault)) => faults.push(fault),
            // The attempt was aborted or panicked.
            Err(_) => {}
        }
    }
    Err(StoreError::Unavailable(faults.join("; ")))
}

/// The host of a connection, for people.
fn place_of(config: &Config) -> String {
    match (config.get_hosts().first(), config.get_ports().first()) {
        (Some(Host::Tcp(name)), Some(port)) => format!("{name}:{port}"),
        (Some(Host::Tcp(name)), None) => name.clone(),
        (Some(Host::Unix(folder)), _) => folder.display().to_string(),
        (None, _) => "no host".to_owned(),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Lost {
    Statement,
    Answer,
}

pub(crate) struct Link {
    pub(super) client: Client,
    statements: RefCell<HashMap<String, Statement>>,
    task: AbortHandle,
    patience: Duration,
    troubled: Troubled,
}

impl fmt::Debug for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a connection")
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Link {
    pub(super) fn wait<T>(&self, work: impl Future<Output = Result<T, Error>>) -> Result<T, StoreError> {
        let lost = self.lost();
        let is_sent = lost != Some(Lost::Statement);
        let result = is_sent.then(|| wait_for(work, self.patience)).flatten();
        if lost.is_some() {
            return Err(self.end(StoreError::silent()));
        }
        Ok(result.ok_or_else(StoreError::silent)??)
    }

    /// The part of the next statement that the trouble takes.
    fn lost(&self) -> Option<Lost> {
        let mut troubled = self.troubled.lock();
        let (trouble, number) = troubled.as_mut()?;
        *number += 1;
        match *trouble {
            Trouble::Cut => Some(Lost::Statement),
            Trouble::Gone(each) => number.is_multiple_of(each).then_some(Lost::Statement),
            Trouble::Unanswered(each) => number.is_multiple_of(each).then_some(Lost::Answer),
            Trouble::Full | Trouble::NoBeat => None,
        }
    }

    /// Ends the transaction at once. Otherwise the server does so when it notices the loss.
    fn end(&self, error: StoreError) -> StoreError {
        let _ = wait_for(self.client.batch_execute("ROLLBACK"), self.patience);
        error
    }

    pub(super) fn prepared(&self, query: &str) -> Result<Statement, StoreError> {
        if let Some(statement) = self.statements.borrow().get(query) {
            return Ok(statement.clone());
        }
        let text = query.replace('?', "$");
        let statement = self.wait(self.client.prepare(&text))?;
        let mut statements = self.statements.borrow_mut();
        Ok(statements.entry(query.to_owned()).or_insert(statement).clone())
    }

    /// Executes a statement. Returns the number of changed rows.
    pub(crate) fn execute(&self, query: &str, params: &[&(dyn ToSql + Sync)]) -> Result<u64, StoreError> {
        let trouble = *self.troubled.lock();
        match trouble {
            Some((Trouble::Full, _)) if query.starts_with("INSERT") => return Err(self.end(StoreError::Full)),
            Some((Trouble::NoBeat, _)) if query.starts_with("UPDATE services") => {
                return Err(StoreError::silent());
            }
            _ => {}
        }
        let statement = self.prepared(query)?;
        self.wait(self.client.execute(&statement, params))
    }

    pub(super) fn rows(&self) -> &dyn Rows {
        self
    }

    pub(crate) fn query(
        &self,
        query: &str,
        params: &[&(dyn ToSql + Sync)],
    ) -> Result<Vec<tokio_postgres::Row>, StoreError> {
        let statement = self.prepared(query)?;
        self.wait(self.client.query(&statement, params))
    }

    /// Executes statements without parameters.
    pub(crate) fn batch(&self, statements: &str) -> Result<(), StoreError> {
        self.wait(self.client.batch_execute(statements))
    }
}

/// A connection that returns to its database.
#[derive(Debug)]
pub(crate) struct Pooled {
    database: Database,
    /// None once it is dropped.
    link: Option<Link>,
    broken: RefCell<bool>,
}

impl Drop for Pooled {
    fn drop(&mut self) {
        let link = self.link.take().filter(|link| !link.client.is_closed());
        let mut spare = self.database.spare();
        spare.n_used -= 1;
        spare.links.extend(link.filter(|_| !*self.broken.borrow()));
        drop(spare);
        self.database.0.returned.notify_all();
    }
}

impl Pooled {
    /// Lets the connection do `work`. After an error it is not used again.
    pub(crate) fn with<T>(&self, work: impl FnOnce(&Link) -> Result<T, StoreError>) -> Result<T, StoreError> {
        let link = self.link.as_ref().ok_or(StoreError::Closed)?;
        let done = work(link);
        if let Err(error) = &done {
            *self.broken.borrow_mut() = true;
            if matches!(error, StoreError::Unavailable(_)) {
                // The other connections would fail as this one did.
                self.database.spare().links.clear();
            }
        }
        done
    }
}

impl Rows for Pooled {
    fn text<'a>(&self, text: &'a str) -> Cow<'a, str> {
        without_nul(text)
    }

    fn each(
        &self,
        query: &str,
        params: &[&dyn Param],
        take: &mut dyn FnMut(&dyn SqlRow) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError> {
        self.with(|link| {
            let statement = link.prepared(query)?;
            let rows = link.wait(link.client.query_raw(&statement, of_postgres(params)))?;
            let mut rows = pin!(rows);
            while let Some(row) = link.wait(rows.try_next())? {
                if !take(&row)? {
                    break;
                }
            }
            Ok(())
        })
    }

    fn change(&self, statement: &str, params: &[&dyn Param]) -> Result<u64, StoreError> {
        self.with(|link| link.change(statement, params))
    }
}

impl Rows for Link {
    fn text<'a>(&self, text: &'a str) -> Cow<'a, str> {
        without_nul(text)
    }

    fn each(
        &self,
        query: &str,
        params: &[&dyn Param],
        take: &mut dyn FnMut(&dyn SqlRow) -> Result<bool, StoreError>,
    ) -> Result<(), StoreError> {
        for row in self.query(query, &of_postgres(params))? {
            if !take(&row)? {
                break;
            }
        }
        Ok(())
    }

    fn change(&self, statement: &str, params: &[&dyn Param]) -> Result<u64, StoreError> {
        self.execute(statement, &of_postgres(params))
    }
}

impl SqlRow for tokio_postgres::Row {
    fn value(&self, column: usize) -> Result<ValueRef<'_>, StoreError> {
        let value = match *self.columns()[column].type_() {
            Type::INT8 => self.try_get::<_, Option<_>>(column)?.map(Integer),
            Type::FLOAT8 => self.try_get::<_, Option<_>>(column)?.map(Real),
            Type::BYTEA => self.try_get::<_, Option<_>>(column)?.map(Blob),
            _ => self.try_get::<_, Option<_>>(column)?.map(str::as_bytes).map(Text),
        };
        Ok(value.unwrap_or(Null))
    }
}

fn of_postgres<'p>(params: &[&'p dyn Param]) -> Vec<&'p (dyn ToSql + Sync)> {
    params.iter().map(|param| *param as &(dyn ToSql + Sync)).collect()
}

impl StoreError {
    /// The database does not answer.
    fn silent() -> Self {
        Self::Unavailable("it does not answer".to_owned())
    }
}

impl From<Error> for StoreError {
    fn from(error: Error) -> Self {
        let Some(refusal) = error.as_db_error() else {
            return Self::Unavailable(with_causes(&error));
        };
        let text = refusal.message().to_owned();
        let code = refusal.code();
        let busy = [
            SqlState::T_R_DEADLOCK_DETECTED,
            SqlState::LOCK_NOT_AVAILABLE,
            SqlState::T_R_SERIALIZATION_FAILURE,
        ];
        if *code == SqlState::DISK_FULL {
            Self::Full
        } else if busy.contains(code) {
            Self::Busy
        } else if ["08", "25", "28", "3D", "53", "57"].contains(&&code.code()[..2]) {
            Self::Unavailable(text)
        } else {
            Self::Refused(text)
        }
    }
}

fn with_causes(error: &Error) -> String {
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    text
}
