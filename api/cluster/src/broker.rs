//! The connection to the broker, and the names of what is kept there.

use std::{
    error::Error as _,
    io::{Cursor, ErrorKind},
    path::PathBuf,
    time::Duration,
};

use async_nats::{
    ConnectError, ConnectErrorKind, ConnectOptions,
    jetstream::{
        self, Context, ErrorCode,
        context::{GetStreamError, GetStreamErrorKind, ObjectStoreError},
        object_store::{self, ObjectStore},
        stream,
    },
};
use futures_util::StreamExt as _;
use lab::campaign::{Campaign, CampaignError, DirectoryError, Manifest, WorkError, rows::SCHEMA_VERSION};
use percent_encoding::percent_decode_str;
use serde::{Deserialize, Serialize};
use tokio::{
    io::AsyncReadExt as _,
    time::{sleep, timeout},
};

use super::worker::WorkerEvent;

/// The stream of all work.
pub(crate) const STREAM: &str = "PILOTFISH_WORK";
/// Subjects of work begin so; then come versions and the campaign.
const SUBJECT: &str = "pilotfish.work";
/// Buckets of campaigns begin so.
const BUCKET: &str = "pilotfish-";
/// Two sendings of one piece of work within this are one: longer than any worker takes from storing gains to sending chunks.
const DUPLICATE_WINDOW: Duration = Duration::from_mins(10);
/// A request that has no answer by then failed.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);
/// Nothing that is read takes so long: it was overwritten meanwhile, or its broker died, and it has to be asked for again.
const READ_TIMEOUT: Duration = Duration::from_secs(30);
/// Copies that are not there after so many pauses are not waited for.
const SPREAD_LOOKS: usize = 30;
/// Between two attempts to speak to a broker that does not answer.
pub(crate) const PAUSE: Duration = Duration::from_secs(1);
/// Letters of a digest that name a campaign.
const DIGEST_LETTERS: usize = 12;

/// The manifest's object.
pub(crate) const MANIFEST: &str = "manifest";
/// Objects about work that was given up begin so.
pub(crate) const PARKED: &str = "parked/";

/// How to reach a broker, and who one is.
#[derive(Clone, Debug, Default)]
pub struct Access {
    /// Addresses, with commas between them: `nats://host:4222`, `tls://user:password@host`.
    pub url: String,
    /// Credentials file (`.creds`), if the broker wants one.
    pub credentials: Option<PathBuf>,
    /// Certificates of the authority that signed the broker's, PEM; the system's if left out.
    pub authority: Option<PathBuf>,
    /// Certificate and key of this client, PEM, if the broker wants them.
    pub certificate: Option<(PathBuf, PathBuf)>,
}

/// Why something could not be done on a cluster.
#[derive(Debug, thiserror::Error)]
pub enum ClusterError {
    /// There is no connection to the broker.
    #[error("cannot connect to {url}: {advice}")]
    NoConnection {
        /// The addresses, without passwords.
        url: String,
        /// What may help.
        advice: &'static str,
        /// What happened.
        source: ConnectError,
    },
    /// The broker cannot be reached any more, or refuses.
    #[error("cannot {0}")]
    Broker(String, #[source] async_nats::Error),
    /// A file of the access cannot be read.
    #[error("cannot read {0}")]
    File(String, #[source] std::io::Error),
    /// There is no such campaign.
    #[error("there is no campaign {0:?} on this broker")]
    NoCampaign(String),
    /// Another program's campaign.
    #[error(
        "campaign {id} is of program {theirs} (rows {their_rows}), and this is {ours} (rows {our_rows}): use that version"
    )]
    OtherVersion {
        /// The campaign.
        id: String,
        /// The version that it was submitted with.
        theirs: String,
        /// Version of the rows there.
        their_rows: String,
        /// This version.
        ours: String,
        /// Version of the rows here.
        our_rows: String,
    },
    /// The same version number, and another program.
    #[error("campaign {0} is of another build of this version: its scenarios give other worlds here")]
    OtherBuild(String),
    /// The campaign's file is wrong.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The campaign's directory is of no use.
    #[error(transparent)]
    Directory(#[from] DirectoryError),
    /// A piece of work cannot be done.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// Work was given up.
    #[error("{} pieces of work were given up: {}", .0.len(), .0.join("; "))]
    Parked(Vec<String>),
    /// Not all is done.
    #[error("{done} of {of} chunks are done: wait for the workers (campaign watch)")]
    Unfinished {
        /// Chunks that are done.
        done: usize,
        /// All chunks.
        of: usize,
    },
}

/// A broker with JetStream.
#[derive(Clone, Debug)]
pub struct Broker {
    pub(crate) jetstream: Context,
}

/// What stands in a message of work.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Order {
    /// The campaign.
    pub(crate) campaign: String,
    /// What is to be done.
    pub(crate) work: lab::campaign::Work,
}

pub(crate) fn failed<E: Into<async_nats::Error>>(what: impl Into<String>) -> impl FnOnce(E) -> ClusterError {
    let what = what.into();
    move |error| ClusterError::Broker(what, error.into())
}

/// What a campaign is called on a broker.
#[must_use]
pub fn id_of(manifest: &Manifest) -> String {
    format!(
        "{}-{}",
        manifest.name,
        &manifest.digest[..DIGEST_LETTERS.min(manifest.digest.len())]
    )
}

/// A version as a part of a subject, in which a dot means something.
pub(crate) fn as_token(program: &str, rows: &str) -> String {
    format!("{}_{rows}", program.replace('.', "-"))
}

/// The subject of a piece of work for programs of that version.
pub(crate) fn subject(version: &str, campaign: &str, name: &str) -> String {
    format!("{SUBJECT}.{version}.{campaign}.{}", name.replace('/', "."))
}

/// All subjects of that version.
pub(crate) fn subjects_of(version: &str) -> String {
    format!("{SUBJECT}.{version}.>")
}

/// The version in a subject of work.
pub(crate) fn version_in(subject: &str) -> Option<&str> {
    subject
        .strip_prefix(SUBJECT)?
        .strip_prefix('.')?
        .split('.')
        .next()
}

impl Broker {
    /// Connects. A connection that breaks later is made again by itself, for as long as it takes.
    pub async fn connect(access: &Access, name: &str) -> Result<Self, ClusterError> {
        let mut options = ConnectOptions::new()
            .name(name)
            .request_timeout(Some(REQUEST_TIMEOUT));
        if let Some(file) = &access.credentials {
            let unreadable = |error| ClusterError::File(file.display().to_string(), error);
            options = options.credentials_file(file).await.map_err(unreadable)?;
        }
        let (certificate, key) = access.certificate.clone().unzip();
        for file in [&access.authority, &certificate, &key].into_iter().flatten() {
            // The client says that a file is not there, and not which.
            let unreadable = |error| ClusterError::File(file.display().to_string(), error);
            tokio::fs::read(file).await.map_err(unreadable)?;
        }
        if let Some(file) = &access.authority {
            options = options.add_root_certificates(file.clone());
        }
        if let Some((certificate, key)) = &access.certificate {
            options = options.add_client_certificate(certificate.clone(), key.clone());
        }
        // The client takes no user from an address by itself.
        options = match user_in(&access.url) {
            Some((user, Some(password))) => options.user_and_password(user, password),
            Some((token, None)) => options.token(token),
            None => options,
        };
        let url = without_secrets(&access.url);
        let addresses: Vec<&str> = url.split(',').collect();
        let client = options.connect(addresses).await;
        let client = client.map_err(|source| ClusterError::NoConnection {
            advice: advice(&source),
            url: url.clone(),
            source,
        })?;
        Ok(Self {
            jetstream: jetstream::ContextBuilder::new()
                .timeout(REQUEST_TIMEOUT)
                .build(client),
        })
    }

    /// Connects as soon as there is a broker, and says meanwhile why it does not. What waiting does not mend, such as a wrong password,
    /// ends it.
    pub async fn awaited(
        access: &Access,
        name: &str,
        tell: &(dyn Fn(WorkerEvent) + Sync),
    ) -> Result<Self, ClusterError> {
        loop {
            match Self::connect(access, name).await {
                Err(
                    error @ ClusterError::NoConnection {
                        advice: IS_IT_THERE | HUNG_UP,
                        ..
                    },
                ) => {
                    tell(WorkerEvent::Trouble(error.to_string()));
                    sleep(PAUSE).await;
                }
                outcome => return outcome,
            }
        }
    }

    /// The stream of work; made if it is not there, on so many servers, and spread to so many if it is on fewer.
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
        let stream = self
            .jetstream
            .get_or_create_stream(config)
            .await
            .map_err(failed("make the stream of work"))?;
        self.spread(stream.cached_info(), replicas).await?;
        Ok(stream)
    }

    /// Copies a stream to so many servers if it is on fewer: a worker may have made it before anything was submitted.
    async fn spread(&self, info: &stream::Info, replicas: usize) -> Result<(), ClusterError> {
        if replicas <= info.config.num_replicas {
            return Ok(());
        }
        let name = &info.config.name;
        let what = format!("copy {name} to {replicas} servers");
        let config = stream::Config {
            num_replicas: replicas,
            ..info.config.clone()
        };
        let spread = self.jetstream.update_stream(config).await;
        spread.map_err(failed(what.clone()))?;
        // Until the servers agree on a leader, nothing that is sent is kept.
        for _ in 0..SPREAD_LOOKS {
            sleep(PAUSE).await;
            let stream = self.jetstream.get_stream(name).await;
            let cluster = stream
                .ok()
                .and_then(|stream| stream.cached_info().cluster.clone());
            if cluster.is_some_and(|cluster| {
                let current = cluster.replicas.iter().filter(|replica| replica.current);
                cluster.leader.is_some() && replicas <= 1 + current.count()
            }) {
                return Ok(());
            }
        }
        let late = std::io::Error::other("the copies are not there yet: submit again");
        Err(failed(what)(late))
    }

    /// The bucket of a campaign; made if it is not there, and spread to so many servers if it is on fewer.
    pub(crate) async fn new_bucket(
        &self,
        campaign: &str,
        replicas: usize,
    ) -> Result<ObjectStore, ClusterError> {
        match self.bucket(campaign).await {
            Ok(bucket) => {
                let stream = self.jetstream.get_stream(format!("OBJ_{BUCKET}{campaign}")).await;
                let stream = stream.map_err(failed("look for the campaign"))?;
                self.spread(stream.cached_info(), replicas).await?;
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
        self.jetstream
            .create_object_store(config)
            .await
            .map_err(failed("make the campaign's bucket"))
    }

    /// The bucket of a campaign.
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

    /// A campaign, as it was submitted.
    pub async fn campaign(&self, id: &str) -> Result<(Manifest, Campaign), ClusterError> {
        let bucket = self.bucket(id).await?;
        let bytes = fetch(&bucket, MANIFEST)
            .await?
            .ok_or_else(|| ClusterError::NoCampaign(id.to_owned()))?;
        let manifest: Manifest =
            serde_json::from_slice(&bytes).map_err(|_| ClusterError::NoCampaign(id.to_owned()))?;
        let (ours, our_rows) = (env!("CARGO_PKG_VERSION"), SCHEMA_VERSION);
        if (ours, our_rows) != (&manifest.program, &manifest.schema_version) {
            return Err(ClusterError::OtherVersion {
                id: id.to_owned(),
                theirs: manifest.program,
                their_rows: manifest.schema_version,
                ours: ours.to_owned(),
                our_rows: our_rows.to_owned(),
            });
        }
        let campaign = manifest.campaign(id)?;
        if Manifest::of(&campaign, manifest.shard).digest != manifest.digest {
            return Err(ClusterError::OtherBuild(id.to_owned()));
        }
        Ok((manifest, campaign))
    }
}

/// Whether the broker said that there is no such bucket, rather than nothing.
fn is_missing(error: &ObjectStoreError) -> bool {
    let cause = error
        .source()
        .and_then(|cause| cause.downcast_ref::<GetStreamError>());
    cause.is_some_and(|cause| {
        matches!(cause.kind(), GetStreamErrorKind::JetStream(answer) if answer.error_code() == ErrorCode::STREAM_NOT_FOUND)
    })
}

/// An object's bytes; none where it is not there.
pub(crate) async fn fetch(bucket: &ObjectStore, name: &str) -> Result<Option<Vec<u8>>, ClusterError> {
    let what = format!("fetch {name}");
    timeout(READ_TIMEOUT, fetch_unhurried(bucket, name))
        .await
        .map_err(failed(what))?
}

async fn fetch_unhurried(bucket: &ObjectStore, name: &str) -> Result<Option<Vec<u8>>, ClusterError> {
    let mut object = match bucket.get(name).await {
        Ok(object) => object,
        Err(error) if error.kind() == object_store::GetErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(format!("fetch {name}"))(error)),
    };
    let mut bytes = vec![];
    object
        .read_to_end(&mut bytes)
        .await
        .map_err(failed(format!("fetch {name}")))?;
    Ok(Some(bytes))
}

/// Stores an object. It is on the broker's disk, or on those of most of its servers, when this comes back.
pub(crate) async fn store(bucket: &ObjectStore, name: &str, bytes: &[u8]) -> Result<(), ClusterError> {
    bucket
        .put(name, &mut Cursor::new(bytes))
        .await
        .map_err(failed(format!("store {name}")))?;
    Ok(())
}

/// Names of the objects of a bucket. One of the broker's servers answers, which may be behind the others: all that was stored before
/// any of them is among them, and what was stored after may not be.
pub(crate) async fn names(bucket: &ObjectStore) -> Result<Vec<String>, ClusterError> {
    timeout(READ_TIMEOUT, names_unhurried(bucket))
        .await
        .map_err(failed("list what is done"))?
}

async fn names_unhurried(bucket: &ObjectStore) -> Result<Vec<String>, ClusterError> {
    let mut list = bucket.list().await.map_err(failed("list what is done"))?;
    let mut names = vec![];
    while let Some(info) = list.next().await {
        names.push(info.map_err(failed("list what is done"))?.name);
    }
    Ok(names)
}

/// Advice about a broker that does not answer, and may do so later.
const IS_IT_THERE: &str = "is a nats-server there, and the address right?";

/// Advice about a broker that ends the conversation, as one does that is just being ended.
const HUNG_UP: &str =
    "it hung up: does it want TLS (tls://), or a certificate of this client (--nats-cert, --nats-key)?";

/// What to do about a connection that did not come about.
fn advice(error: &ConnectError) -> &'static str {
    // The client has no kinds for these.
    let words = error.to_string();
    let by_words = [
        (
            "UnknownIssuer",
            "name the authority that signed its certificate (--nats-ca)",
        ),
        // An authority of the same name, and another key.
        (
            "BadSignature",
            "name the authority that signed its certificate (--nats-ca)",
        ),
        (
            "Expired",
            "its certificate has expired, or the clock of this machine is wrong",
        ),
        (
            "CertificateRequired",
            "it wants a certificate of this client (--nats-cert, --nats-key)",
        ),
        (
            "NotValidForName",
            "its certificate is for another name: use that one in the address",
        ),
        (
            "InvalidContentType",
            "it speaks no TLS: nats:// instead of tls://",
        ),
    ];
    if let Some((_, advice)) = by_words.iter().find(|(word, _)| words.contains(word)) {
        return advice;
    }
    match error.kind() {
        ConnectErrorKind::Authentication | ConnectErrorKind::AuthorizationViolation => {
            "it does not know who this is: nats://user:password@host, with % before what is special (%40 is @), or --nats-creds, \
             or it was withdrawn"
        }
        ConnectErrorKind::ServerParse => "addresses are such as nats://host:4222, with commas between them",
        ConnectErrorKind::Tls => {
            "look at the files of --nats-ca, --nats-cert and --nats-key: certificates and a key, PEM"
        }
        ConnectErrorKind::Dns | ConnectErrorKind::TimedOut | ConnectErrorKind::MaxReconnects => IS_IT_THERE,
        ConnectErrorKind::Io => {
            let cause = error
                .source()
                .and_then(|cause| cause.downcast_ref::<std::io::Error>());
            match cause.map(std::io::Error::kind) {
                Some(
                    ErrorKind::ConnectionRefused | ErrorKind::HostUnreachable | ErrorKind::NetworkUnreachable,
                ) => IS_IT_THERE,
                // Its reason may be lost on the way.
                _ => HUNG_UP,
            }
        }
    }
}

/// Who an address says that this is: a user and a password, or a token. One for all addresses, the first.
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

/// An address as it may be shown.
fn without_secrets(url: &str) -> String {
    let shown = |address: &str| match (address.split_once("://"), address.rsplit_once('@')) {
        (Some((scheme, _)), Some((_, host))) => format!("{scheme}://{host}"),
        (None, Some((_, host))) => host.to_owned(),
        (_, None) => address.to_owned(),
    };
    url.split(',')
        .map(str::trim)
        .map(shown)
        .collect::<Vec<_>>()
        .join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subject_names_version_campaign_and_work_and_its_version_is_found_again() {
        let version = as_token("0.2.0", "1");
        let made = subject(&version, "small-0123456789ab", "gains/3-1");
        assert_eq!(made, "pilotfish.work.0-2-0_1.small-0123456789ab.gains.3-1");
        assert_eq!(version_in(&made), Some("0-2-0_1"));
        assert_eq!(version_in("other.work.x"), None);
    }

    #[test]
    fn an_address_says_who_this_is() {
        let user = |user: &str, password: &str| Some((user.to_owned(), Some(password.to_owned())));
        assert_eq!(user_in("nats://host:4222"), None);
        assert_eq!(
            user_in("nats://one:4222, tls://me:s%40cret@two"),
            user("me", "s@cret")
        );
        assert_eq!(user_in("me:s@cret@host"), user("me", "s@cret"));
        assert_eq!(user_in("nats://token@host"), Some(("token".to_owned(), None)));
    }

    #[test]
    fn no_password_is_in_a_message() {
        assert_eq!(
            without_secrets("nats://me:secret@host:4222,tls://other"),
            "nats://host:4222,tls://other"
        );
        assert_eq!(without_secrets("me:secret@host"), "host");
    }
}
