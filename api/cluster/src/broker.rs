//! The connection to the broker, and the names of stored objects.

use std::error::Error as _;
use std::io::{Cursor, ErrorKind};
use std::path::PathBuf;
use std::time::Duration;

use async_nats::jetstream::context::{GetStreamError, GetStreamErrorKind, ObjectStoreError};
use async_nats::jetstream::object_store::{self, ObjectStore};
use async_nats::jetstream::{self, Context, ErrorCode, stream};
use async_nats::{ConnectError, ConnectErrorKind, ConnectOptions};
use clock::Clock;
use futures_util::StreamExt as _;
use lab::campaign::{Campaign, CampaignError, DirectoryError, Manifest, WorkError, rows::SCHEMA_VERSION};
use percent_encoding::percent_decode_str;
use serde::{Deserialize, Serialize};
use tokio::io::AsyncReadExt as _;

pub(crate) const STREAM: &str = "PILOTFISH_WORK";
/// Prefix of the subjects of work; version and campaign follow.
const SUBJECT: &str = "pilotfish.work";
/// Prefix of the campaigns' buckets.
const BUCKET: &str = "pilotfish-";
/// The broker drops duplicates of work for this long: longer than from gains to their chunks.
const DUPLICATE_WINDOW: Duration = Duration::from_mins(10);
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);
/// Timeout of a read. It must be repeated if the object is overwritten or its broker dies.
const READ_TIMEOUT: Duration = Duration::from_secs(30);
/// Most pauses to wait for copies.
const SPREAD_LOOKS: usize = 30;
/// Time between two attempts to reach a broker.
pub(crate) const PAUSE: Duration = Duration::from_secs(1);
/// Letters of the digest in a campaign's id.
const DIGEST_LETTERS: usize = 12;

pub(crate) const MANIFEST: &str = "manifest";
/// Prefix of objects about work that was given up.
pub(crate) const PARKED: &str = "parked/";

/// Address and credentials of a broker.
#[derive(Clone, Debug, Default)]
pub struct Access {
    /// Addresses, separated by commas: `nats://host:4222`, `tls://user:password@host`.
    pub url: String,
    /// Credentials file (`.creds`), if the broker needs one.
    pub credentials: Option<PathBuf>,
    /// Certificates of the broker's authority, PEM; the system's if left out.
    pub authority: Option<PathBuf>,
    /// Certificate and key of this client, PEM, if the broker needs them.
    pub certificate: Option<(PathBuf, PathBuf)>,
}

/// The fault of an operation on the cluster.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum ClusterError {
    #[error("cannot connect to {0}: {1}")]
    NoConnection(String, &'static str, #[source] ConnectError),
    #[error("cannot {0}")]
    Broker(String, #[source] async_nats::Error),
    #[error("cannot read {0}")]
    File(String, #[source] std::io::Error),
    #[error("there is no campaign {0:?} on this broker")]
    NoCampaign(String),
    #[error("{0}")]
    OtherVersion(String),
    #[error("campaign {0} comes from another build of this version, with other scenarios")]
    OtherBuild(String),
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    #[error(transparent)]
    Directory(#[from] DirectoryError),
    #[error(transparent)]
    Work(#[from] WorkError),
    #[error("{} chunks of work failed too often: {}", .0.len(), .0.join("; "))]
    Parked(Vec<String>),
    #[error("{0} of {1} chunks are done: wait for the workers (campaign watch)")]
    Unfinished(usize, usize),
}

/// A broker with JetStream.
#[derive(Clone, Debug)]
pub struct Broker {
    pub(crate) clock: Clock,
    pub(crate) jetstream: Context,
}

/// An event of a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorkerEvent {
    /// A piece of work is done: its campaign and name.
    Done(String, String),
    /// A piece of work was given up: its campaign, its name and the reason.
    Parked(String, String, String),
    /// Work for another version, which this worker may not do.
    Refused(String),
    /// The broker does not answer, or refuses; the worker keeps trying.
    Trouble(String),
}

/// A message with a piece of work.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct WorkMessage {
    pub(crate) campaign: String,
    pub(crate) work: lab::campaign::Work,
}

pub(crate) fn failed<E: Into<async_nats::Error>>(what: impl Into<String>) -> impl FnOnce(E) -> ClusterError {
    let what = what.into();
    move |error| ClusterError::Broker(what, error.into())
}

/// The id of a campaign on a broker.
pub fn id_of(manifest: &Manifest) -> String {
    let digest = &manifest.digest[..DIGEST_LETTERS.min(manifest.digest.len())];
    format!("{}-{digest}", manifest.name)
}

/// A version as a token of a subject, which has no dots.
pub(crate) fn as_token(program: &str, rows: &str) -> String {
    format!("{}_{rows}", program.replace('.', "-"))
}

/// The subject of a piece of work for programs of `version`.
pub(crate) fn subject(version: &str, campaign: &str, name: &str) -> String {
    format!("{SUBJECT}.{version}.{campaign}.{}", name.replace('/', "."))
}

pub(crate) fn subjects_of(version: &str) -> String {
    format!("{SUBJECT}.{version}.>")
}

/// The version in a subject of work.
pub(crate) fn version_in(subject: &str) -> Option<&str> {
    let version = subject.strip_prefix(SUBJECT)?.strip_prefix('.')?;
    version.split('.').next()
}

impl Broker {
    /// Connects. A connection that breaks later is restored automatically.
    pub async fn connect(access: &Access, name: &str, clock: &Clock) -> Result<Self, ClusterError> {
        let mut options = ConnectOptions::new().name(name).request_timeout(Some(REQUEST_TIMEOUT));
        if let Some(file) = &access.credentials {
            let unreadable = |error| ClusterError::File(file.display().to_string(), error);
            options = options.credentials_file(file).await.map_err(unreadable)?;
        }
        let (certificate, key) = access.certificate.clone().unzip();
        for file in [&access.authority, &certificate, &key].into_iter().flatten() {
            // The client's error does not name the missing file.
            let unreadable = |error| ClusterError::File(file.display().to_string(), error);
            tokio::fs::read(file).await.map_err(unreadable)?;
        }
        if let Some(file) = &access.authority {
            options = options.add_root_certificates(file.clone());
        }
        if let Some((certificate, key)) = &access.certificate {
            options = options.add_client_certificate(certificate.clone(), key.clone());
        }
        // The client does not read the user from an address.
        options = match user_in(&access.url) {
            Some((user, Some(password))) => options.user_and_password(user, password),
            Some((token, None)) => options.token(token),
            None => options,
        };
        let url = without_secrets(&access.url);
        let addresses: Vec<&str> = url.split(',').collect();
        let client = options.connect(addresses).await;
        let no_connection = |error| ClusterError::NoConnection(url.clone(), advice(&error), error);
        let client = client.map_err(no_connection)?;
        let context = jetstream::ContextBuilder::new().timeout(REQUEST_TIMEOUT);
        Ok(Self { clock: clock.clone(), jetstream: context.build(client) })
    }

    /// Connects as soon as the broker answers. Returns errors that waiting does not mend.
    pub async fn connect_when_ready(
        access: &Access,
        name: &str,
        clock: &Clock,
        notify: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<Self, ClusterError> {
        loop {
            match Self::connect(access, name, clock).await {
                Err(error @ ClusterError::NoConnection(_, IS_IT_THERE | HUNG_UP, _)) => {
                    notify(WorkerEvent::Trouble(error.to_string()));
                    clock.sleep(PAUSE).await;
                }
                outcome => return outcome,
            }
        }
    }

    /// The stream of work on `replicas` servers: created if missing, copied if on fewer.
    pub(crate) async fn stream(&self, replicas: usize) -> Result<stream::Stream, ClusterError> {
        let config = stream::Config {
            name: STREAM.to_owned(),
            subjects: vec![format!("{SUBJECT}.>")],
            retention: stream::RetentionPolicy::WorkQueue,
            storage: stream::StorageType::File,
            num_replicas: replicas,
            duplicate_window: DUPLICATE_WINDOW,
            ..stream::Config::default()
        };
        let stream = self.jetstream.get_or_create_stream(config).await;
        let stream = stream.map_err(failed("make the stream of work"))?;
        self.replicate(stream.cached_info(), replicas).await?;
        Ok(stream)
    }

    /// Copies a stream on fewer servers to `replicas`; a worker may have created it first.
    async fn replicate(&self, info: &stream::Info, replicas: usize) -> Result<(), ClusterError> {
        if replicas <= info.config.num_replicas {
            return Ok(());
        }
        let name = &info.config.name;
        let what = format!("copy {name} to {replicas} servers");
        let config = stream::Config { num_replicas: replicas, ..info.config.clone() };
        let spread = self.jetstream.update_stream(config).await;
        spread.map_err(failed(what.clone()))?;
        // Messages are lost until the servers agree on a leader.
        for _ in 0..SPREAD_LOOKS {
            self.clock.sleep(PAUSE).await;
            let stream = self.jetstream.get_stream(name).await;
            if let Some(cluster) = stream.ok().and_then(|stream| stream.cached_info().cluster.clone()) {
                let current = cluster.replicas.iter().filter(|replica| replica.current);
                if cluster.leader.is_some() && replicas <= 1 + current.count() {
                    return Ok(());
                }
            }
        }
        let late = std::io::Error::other("the copies are not complete yet: submit again");
        Err(failed(what)(late))
    }

    /// The bucket of a campaign on `replicas` servers: created if missing, copied if on fewer.
    pub(crate) async fn new_bucket(
        &self,
        campaign: &str,
        replicas: usize,
    ) -> Result<ObjectStore, ClusterError> {
        match self.bucket(campaign).await {
            Ok(bucket) => {
                let stream = self.jetstream.get_stream(format!("OBJ_{BUCKET}{campaign}")).await;
                let stream = stream.map_err(failed("look for the campaign"))?;
                self.replicate(stream.cached_info(), replicas).await?;
                return Ok(bucket);
            }
            Err(ClusterError::NoCampaign(_)) => {}
            Err(error) => return Err(error),
        }
        let config = object_store::Config {
            bucket: format!("{BUCKET}{campaign}"),
            storage: stream::StorageType::File,
            num_replicas: replicas,
            ..object_store::Config::default()
        };
        let bucket = self.jetstream.create_object_store(config).await;
        bucket.map_err(failed("make the campaign's bucket"))
    }

    pub(crate) async fn bucket(&self, campaign: &str) -> Result<ObjectStore, ClusterError> {
        let name = format!("{BUCKET}{campaign}");
        self.jetstream.get_object_store(&name).await.map_err(|error| {
            if is_missing(&error) {
                ClusterError::NoCampaign(campaign.to_owned())
            } else {
                failed("look for the campaign")(error)
            }
        })
    }

    /// A submitted campaign.
    pub async fn campaign(&self, id: &str) -> Result<(Manifest, Campaign), ClusterError> {
        let bucket = self.bucket(id).await?;
        let none = || ClusterError::NoCampaign(id.to_owned());
        let bytes = fetch(&bucket, MANIFEST, &self.clock).await?.ok_or_else(none)?;
        let manifest: Manifest = serde_json::from_slice(&bytes).map_err(|_| none())?;
        let (ours, our_rows) = (env!("CARGO_PKG_VERSION"), SCHEMA_VERSION);
        if (ours, our_rows) != (&manifest.program, &manifest.schema_version) {
            let (theirs, their_rows) = (manifest.program, manifest.schema_version);
            return Err(ClusterError::OtherVersion(format!(
                "campaign {id} is of version {theirs} (rows {their_rows}), \
                 this program is version {ours} (rows {our_rows}): use that version"
            )));
        }
        let campaign = manifest.campaign(id)?;
        if Manifest::of(&campaign, manifest.shard).digest != manifest.digest {
            return Err(ClusterError::OtherBuild(id.to_owned()));
        }
        Ok((manifest, campaign))
    }
}

/// `true` if the broker answered that there is no such bucket.
fn is_missing(error: &ObjectStoreError) -> bool {
    let cause = error.source();
    let cause = cause.and_then(|cause| cause.downcast_ref::<GetStreamError>());
    cause.is_some_and(|cause| {
        matches!(cause.kind(), GetStreamErrorKind::JetStream(answer) if answer.error_code() == ErrorCode::STREAM_NOT_FOUND)
    })
}

/// The bytes of an object; none if it does not exist.
pub(crate) async fn fetch(
    bucket: &ObjectStore,
    name: &str,
    clock: &Clock,
) -> Result<Option<Vec<u8>>, ClusterError> {
    let what = format!("fetch {name}");
    let bytes = async {
        let mut object = match bucket.get(name).await {
            Ok(object) => object,
            Err(error) if error.kind() == object_store::GetErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(failed(&*what)(error)),
        };
        let mut bytes = vec![];
        object.read_to_end(&mut bytes).await.map_err(failed(&*what))?;
        Ok::<_, ClusterError>(Some(bytes))
    };
    clock.timeout(READ_TIMEOUT, bytes).await.map_err(failed(&*what))?
}

/// Stores an object: it is then on the broker's disk, or on a majority of its servers.
pub(crate) async fn store(bucket: &ObjectStore, name: &str, bytes: &[u8]) -> Result<(), ClusterError> {
    let stored = bucket.put(name, &mut Cursor::new(bytes)).await;
    stored.map(drop).map_err(failed(format!("store {name}")))
}

/// Names of the objects of a bucket. The answering server may lag: later ones may be missing.
pub(crate) async fn names(bucket: &ObjectStore, clock: &Clock) -> Result<Vec<String>, ClusterError> {
    const WHAT: &str = "list what is done";
    let names = async {
        let mut list = bucket.list().await.map_err(failed(WHAT))?;
        let mut names = vec![];
        while let Some(info) = list.next().await {
            names.push(info.map_err(failed(WHAT))?.name);
        }
        Ok::<_, ClusterError>(names)
    };
    clock.timeout(READ_TIMEOUT, names).await.map_err(failed(WHAT))?
}

/// Advice about a broker that does not answer yet.
const IS_IT_THERE: &str = "is a nats-server running, and is the address right?";

/// Advice about a broker that closes the connection; it also does so when it stops.
const HUNG_UP: &str = "the broker closed the connection: does it need TLS (tls://), or a client certificate (--nats-cert, --nats-key)?";

fn advice(error: &ConnectError) -> &'static str {
    // The client has no error kinds for these.
    let words = error.to_string();
    let authority = "give the authority that signed its certificate (--nats-ca)";
    let expired = "its certificate has expired, or the clock of this machine is wrong";
    let named = "its certificate is for another name: use that name in the address";
    let needs_one = "it needs a client certificate (--nats-cert, --nats-key)";
    let by_words = [
        ("UnknownIssuer", authority),
        // An authority of the same name with another key.
        ("BadSignature", authority),
        ("Expired", expired),
        ("CertificateRequired", needs_one),
        ("NotValidForName", named),
        ("InvalidContentType", "it has no TLS: use nats:// instead of tls://"),
    ];
    if let Some((_, advice)) = by_words.iter().find(|(word, _)| words.contains(word)) {
        return advice;
    }
    match error.kind() {
        ConnectErrorKind::Authentication | ConnectErrorKind::AuthorizationViolation => {
            "it rejects the login: give nats://user:password@host, with special characters as %40 for @, or --nats-creds; \
             or the login was revoked"
        }
        ConnectErrorKind::ServerParse => "write addresses as nats://host:4222, separated by commas",
        ConnectErrorKind::Tls => {
            "check the files of --nats-ca, --nats-cert and --nats-key: certificates and a key, PEM"
        }
        ConnectErrorKind::Dns | ConnectErrorKind::TimedOut | ConnectErrorKind::MaxReconnects => IS_IT_THERE,
        ConnectErrorKind::Io => {
            let cause = error.source();
            let cause = cause.and_then(|cause| cause.downcast_ref::<std::io::Error>());
            match cause.map(std::io::Error::kind) {
                Some(
                    ErrorKind::ConnectionRefused | ErrorKind::HostUnreachable | ErrorKind::NetworkUnreachable,
                ) => IS_IT_THERE,
                // The broker's reason may be lost.
                _ => HUNG_UP,
            }
        }
    }
}

/// The login in an address: a user and a password, or a token. The first one serves for all.
fn user_in(url: &str) -> Option<(String, Option<String>)> {
    let words = |text: &str| percent_decode_str(text).decode_utf8_lossy().into_owned();
    url.split(',').find_map(|address| {
        let address = address.split_once("://").map_or(address, |(_, rest)| rest);
        let (who, _) = address.trim().rsplit_once('@')?;
        Some(match who.split_once(':') {
            Some((user, password)) => (words(user), Some(words(password))),
            None => (words(who), None),
        })
    })
}

/// An address without user and password.
fn without_secrets(url: &str) -> String {
    let shown = |address: &str| match (address.split_once("://"), address.rsplit_once('@')) {
        (Some((scheme, _)), Some((_, host))) => format!("{scheme}://{host}"),
        (None, Some((_, host))) => host.to_owned(),
        (_, None) => address.to_owned(),
    };
    let addresses: Vec<_> = url.split(',').map(str::trim).map(shown).collect();
    addresses.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subject_names_version_campaign_and_work_and_its_version_can_be_read() {
        let version = as_token("0.2.0", "1");
        let made = subject(&version, "small-0123456789ab", "gains/3-1");
        assert_eq!(made, "pilotfish.work.0-2-0_1.small-0123456789ab.gains.3-1");
        assert_eq!(version_in(&made), Some("0-2-0_1"));
        assert_eq!(version_in("other.work.x"), None);
    }

    #[test]
    fn the_login_is_read_from_an_address() {
        let user = |user: &str, password: &str| Some((user.to_owned(), Some(password.to_owned())));
        assert_eq!(user_in("nats://host:4222"), None);
        assert_eq!(user_in("nats://one:4222, tls://me:s%40cret@two"), user("me", "s@cret"));
        assert_eq!(user_in("me:s@cret@host"), user("me", "s@cret"));
        assert_eq!(user_in("nats://token@host"), Some(("token".to_owned(), None)));
    }

    #[test]
    fn no_password_is_in_a_message() {
        assert_eq!(without_secrets("nats://me:secret@host:4222,tls://other"), "nats://host:4222,tls://other");
        assert_eq!(without_secrets("me:secret@host"), "host");
    }
}
