//! The token file. It holds digests; a token itself is shown once, when it is created.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _, fchown};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use clock::Clock;
use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use subtle::ConstantTimeEq as _;

use store::{EventStore, StoreError, TrustedClock};

use crate::edge::role::{Role, TokenLimit};
use wire::mission::Mission;

/// Prefix of tokens, by which people and secret scanners recognise them.
pub const PREFIX: &str = "pf_";

/// Random bytes of a token. No attacker can guess as many, so a fast hash is enough.
const RANDOM_BYTES: usize = 32;

const NAME_BYTES_MAX: usize = 64;

/// Time between two checks of the file for changes.
const CHECK: Duration = Duration::from_millis(500);

/// The stored tokens.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TokenFile {
    /// All tokens, in the order of creation.
    pub tokens: Vec<StoredToken>,
}

/// A stored token.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredToken {
    /// Name of the client, as in logs.
    pub name: String,
    /// Permissions of the client.
    pub role: Role,
    /// Missions and craft to which the client is limited; all if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<TokenLimit>,
    /// SHA-256 of the token, hexadecimal.
    pub sha256: Digest,
    /// Time of creation, Unix time, s.
    pub made_s: u64,
    /// Time of expiry, Unix time, s; without one, the token never expires.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_s: Option<u64>,
}

/// SHA-256 of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Digest([u8; 32]);

impl Digest {
    fn of(token: &str) -> Self {
        Self(Sha256::digest(token).into())
    }
}

impl From<Digest> for String {
    fn from(Digest(bytes): Digest) -> Self {
        hex::encode(bytes)
    }
}

impl TryFrom<String> for Digest {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let mut bytes = [0; 32];
        hex::decode_to_slice(text, &mut bytes).map_err(|_| "a SHA-256 has 64 hexadecimal digits")?;
        Ok(Self(bytes))
    }
}

/// A token to create.
#[derive(Clone, Debug)]
pub struct NewToken {
    /// Name of the client.
    pub name: String,
    /// Permissions of the client.
    pub role: Role,
    /// Missions and craft to which the client is limited; all if none.
    pub limit: Option<TokenLimit>,
    /// Time of validity; unlimited without one.
    pub valid: Option<Duration>,
}

/// An error of the token file.
#[expect(missing_docs, reason = "the messages say it")]
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    #[error("cannot read or write the token file {}", .0.display())]
    File(PathBuf, #[source] io::Error),
    #[error("{} is not a token file; `pilotfish token add` creates one", .0.display())]
    NoTokens(PathBuf, #[source] serde_json::Error),
    #[error(
        "the name of a token has 1 to {NAME_BYTES_MAX} letters, digits and . _ -, such as bridge-1, not {0:?}"
    )]
    Name(String),
    #[error("a token named {0} exists; revoke it first, or choose another name")]
    NameTaken(String),
    #[error("there is no token named {0}; `pilotfish token list` lists all")]
    Unknown(String),
    #[error("no random numbers from the system: {0}")]
    Random(getrandom::Error),
}

impl TokenFile {
    /// Reads the file at `path`; `None` if there is no such file.
    pub fn read(path: &Path) -> Result<Option<Self>, TokenError> {
        let text = match fs::read(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            read => read.map_err(|error| TokenError::File(path.to_owned(), error))?,
        };
        // An editor may have added a byte-order mark.
        let read = serde_json::from_slice(text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&text));
        read.map(Some).map_err(|error| TokenError::NoTokens(path.to_owned(), error))
    }

    /// Creates a token, stores its digest in the file at `path`, and returns it.
    pub fn add(path: &Path, new: NewToken, clock: &Clock) -> Result<String, TokenError> {
        let (name, valid) = (new.name, new.valid);
        let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        if !(1..=NAME_BYTES_MAX).contains(&name.len()) || !name.bytes().all(plain) {
            return Err(TokenError::Name(name));
        }
        let mut random = [0; RANDOM_BYTES];
        getrandom::fill(&mut random).map_err(TokenError::Random)?;
        let token = format!("{PREFIX}{}", hex::encode(random));
        let now = whole(clock.unix_s());
        // The service makes its data directory just as private.
        if let Some(directory) = path.parent() {
            let made = DirBuilder::new().recursive(true).mode(0o700).create(directory);
            made.map_err(|error| TokenError::File(directory.to_owned(), error))?;
        }
        Self::change(path, |known| {
            if known.tokens.iter().any(|token| token.name == name) {
                return Err(TokenError::NameTaken(name));
            }
            known.tokens.push(StoredToken {
                name,
                role: new.role,
                limit: new.limit,
                sha256: Digest::of(&token),
                made_s: now,
                expires_s: valid.map(|valid| now.saturating_add(valid.as_secs())),
            });
            Ok(())
        })?;
        Ok(token)
    }

    /// Revokes the token named `name`.
    pub fn revoke(path: &Path, name: &str) -> Result<(), TokenError> {
        Self::change(path, |known| {
            let before = known.tokens.len();
            known.tokens.retain(|token| token.name != name);
            if known.tokens.len() == before {
                return Err(TokenError::Unknown(name.to_owned()));
            }
            Ok(())
        })
    }

    /// Copies the file at `path` to `to`, which must not exist. `false` if there is no file.
    pub fn back_up(path: &Path, to: &Path) -> Result<bool, TokenError> {
        let refused = |error| TokenError::File(to.to_owned(), error);
        let Some(known) = Self::read(path)? else {
            return Ok(false);
        };
        if to.try_exists().map_err(refused)? {
            return Err(refused(io::ErrorKind::AlreadyExists.into()));
        }
        known.write(to).map_err(refused)?;
        Ok(true)
    }

    /// Replaces the file; a lock keeps other programs out.
    fn change(
        path: &Path,
        change: impl FnOnce(&mut Self) -> Result<(), TokenError>,
    ) -> Result<(), TokenError> {
        let refused = |error| TokenError::File(path.to_owned(), error);
        let lock = File::create(path.with_extension("lock")).map_err(refused)?;
        lock.lock().map_err(refused)?;
        let mut known = Self::read(path)?.unwrap_or_default();
        change(&mut known)?;
        known.write(path).map_err(refused)
    }

    fn write(&self, path: &Path) -> io::Result<()> {
        let text = serde_json::to_vec_pretty(self).expect("names and numbers only");
        write_whole(path, &text)
    }

    /// The stored token that matches and has not expired. All wrong tokens take the same time.
    pub(super) fn find(&self, token: &str, now: u64) -> Option<&StoredToken> {
        let given = Digest::of(token);
        let mut found = None;
        for stored in &self.tokens {
            if bool::from(stored.sha256.0.ct_eq(&given.0)) {
                found = Some(stored);
            }
        }
        found.filter(|stored| stored.expires_s.is_none_or(|expires| now < expires))
    }
}

/// Replaces the file at `path` atomically.
fn write_whole(path: &Path, text: &[u8]) -> io::Result<()> {
    let new = path.with_extension("new");
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let directory = File::open(directory.unwrap_or(Path::new(".")))?;
    let owner = directory.metadata()?;
    let mut file = OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&new)?;
    file.write_all(text)?;
    // The directory's owner, the service, must be able to read a file that root creates.
    let _ = fchown(&file, Some(owner.uid()), Some(owner.gid()));
    file.sync_all()?;
    fs::rename(&new, path)?;
    // Without this, a power cut may bring a revoked token back.
    directory.sync_all()
}

/// The tokens of a file, reloaded when it changes. Clones share them.
#[derive(Clone, Debug)]
pub struct Tokens(Arc<Mutex<TokenCache>>);

#[derive(Debug)]
struct TokenCache {
    path: PathBuf,
    /// `None` until there is a file.
    known: Option<Arc<TokenFile>>,
    version: Option<FileVersion>,
    checked: Instant,
    clock: Clock,
    /// Decides which tokens have expired. Until it is bound, the machine's clock decides.
    trusted: Option<TrustedClock>,
}

/// A value that changes with the file, its owner and its mode: inode, length, and both times.
type FileVersion = (u64, u64, SystemTime, (i64, i64));

fn version(path: &Path) -> Option<FileVersion> {
    let file = fs::metadata(path).ok()?;
    Some((file.ino(), file.len(), file.modified().ok()?, (file.ctime(), file.ctime_nsec())))
}

impl Tokens {
    /// The tokens of the file at `path`, which may be created later.
    pub fn open(path: &Path, clock: &Clock) -> Result<Self, TokenError> {
        let version = version(path);
        let cache = TokenCache {
            path: path.to_owned(),
            known: TokenFile::read(path)?.map(Arc::new),
            version,
            checked: clock.now(),
            clock: clock.clone(),
            trusted: None,
        };
        Ok(Self(Arc::new(Mutex::new(cache))))
    }

    /// `true` if any token exists: then every client needs one.
    pub fn are_made(&self) -> bool {
        self.known().is_some_and(|known| !known.tokens.is_empty())
    }

    /// Binds them to the store's trusted time. Fails if it had tokens and there are none.
    pub(crate) async fn bind(&self, store: &EventStore) -> Result<(), StoreError> {
        self.0.lock().trusted = Some(store.clock().clone());
        if self.are_made() {
            return store.protect().await;
        }
        if store.reader()?.is_protected()? {
            return Err(StoreError::Unprotected(self.0.lock().path.clone()));
        }
        let (tokens, store, clock) = (self.clone(), store.clone(), self.0.lock().clock.clone());
        tokio::spawn(async move {
            while !tokens.are_made() {
                clock.sleep(CHECK).await;
            }
            if let Err(error) = store.protect().await {
                tracing::error!(%error, "cannot record in the mission log that the service has tokens");
            }
        });
        Ok(())
    }

    /// The time by which tokens expire, Unix time, s.
    pub(super) fn now(&self) -> u64 {
        let cache = self.0.lock();
        let trusted = cache.trusted.as_ref().map(TrustedClock::now_s);
        whole(trusted.unwrap_or_else(|| cache.clock.unix_s()))
    }

    /// `true` if each limited token permits both of the missions, or none.
    pub(crate) fn permit_alike(&self, missions: [&Mission; 2]) -> bool {
        let known = self.known();
        // A file that cannot be read permits nothing to anybody.
        if known.as_ref().is_some_and(|known| known.tokens.is_empty()) {
            return false;
        }
        let mut limits =
            known.iter().flat_map(|known| &known.tokens).filter_map(|token| token.limit.as_ref());
        limits.all(|limit| {
            let [one, other] = missions.map(|mission| limit.sees(mission));
            one == other
        })
    }

    pub(super) fn known(&self) -> Option<Arc<TokenFile>> {
        let mut cache = self.0.lock();
        if CHECK <= cache.clock.since(cache.checked) {
            cache.reload();
        }
        cache.known.clone()
    }
}

impl TokenCache {
    /// Reloads a changed file. Without a readable file no token is valid.
    fn reload(&mut self) {
        self.checked = self.clock.now();
        let version = version(&self.path);
        if version == self.version {
            return;
        }
        self.version = version;
        let read = TokenFile::read(&self.path);
        match &read {
            Ok(Some(known)) => tracing::info!(tokens = known.tokens.len(), "reloaded the token file"),
            Ok(None) => {
                tracing::error!(path = %self.path.display(), "the token file is gone; all calls are refused");
            }
            Err(error) => tracing::error!(%error, "the token file is broken; all calls are refused"),
        }
        self.known = Some(Arc::new(read.ok().flatten().unwrap_or_default()));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "seconds since 1970")]
fn whole(unix_s: f64) -> u64 {
    unix_s as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock() -> Clock {
        Clock::simulated(1.8e9)
    }

    fn new(name: &str, role: Role, valid: Option<Duration>) -> NewToken {
        NewToken { name: name.to_owned(), role, limit: None, valid }
    }

    fn valid(tokens: &Tokens, token: &str) -> Option<StoredToken> {
        tokens.known().expect("there was a file").find(token, tokens.now()).cloned()
    }

    #[tokio::test(start_paused = true)]
    async fn a_token_is_valid_until_it_is_revoked_and_only_its_digest_is_stored() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("not-yet/there/tokens.json");
        let token = TokenFile::add(&path, new("bridge", Role::Operator, None), &clock()).expect("is made");
        let other = TokenFile::add(&path, new("page", Role::ReadOnly, None), &clock()).expect("is made");

        assert_eq!(token.len(), PREFIX.len() + 2 * RANDOM_BYTES);
        let stored = fs::read_to_string(&path).expect("is there");
        assert!(!stored.contains(&token[PREFIX.len()..]) && !stored.contains(&other));
        assert_eq!(fs::metadata(&path).expect("is there").mode() & 0o777, 0o600);

        let tokens = Tokens::open(&path, &clock()).expect("is read");
        let bridge = valid(&tokens, &token).expect("is valid");
        assert_eq!((bridge.name.as_str(), bridge.role), ("bridge", Role::Operator));
        for wrong in [&token[1..], &token.to_uppercase(), "", &format!("{token} ")] {
            assert_eq!(valid(&tokens, wrong), None);
        }

        TokenFile::revoke(&path, "bridge").expect("is there");
        tokens.0.lock().reload();
        assert_eq!(valid(&tokens, &token), None);
        assert!(valid(&tokens, &other).is_some());
        assert!(matches!(TokenFile::revoke(&path, "bridge"), Err(TokenError::Unknown(_))));
    }

    #[tokio::test(start_paused = true)]
    async fn tokens_of_an_earlier_version_have_no_limit() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        let sha256 = String::from(Digest::of("pf_a"));
        let text =
            format!(r#"{{"tokens":[{{"name":"a","role":"operator","sha256":"{sha256}","made_s":1}}]}}"#);
        fs::write(&path, text).expect("is written");
        let tokens = Tokens::open(&path, &clock()).expect("is read");
        assert_eq!(valid(&tokens, "pf_a").expect("is valid").limit, None);
    }

    #[tokio::test(start_paused = true)]
    async fn an_expired_token_is_not_valid() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        let day = Duration::from_hours(24);
        let token = TokenFile::add(&path, new("visitor", Role::Admin, Some(day)), &clock()).expect("is made");
        let known = TokenFile::read(&path).expect("is read").expect("is there");
        let made = known.tokens[0].made_s;
        assert!(known.find(&token, made + 86_399).is_some());
        assert!(known.find(&token, made + 86_400).is_none());
    }

    #[tokio::test(start_paused = true)]
    async fn a_later_file_is_read_and_a_missing_or_broken_file_has_no_valid_token() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        let tokens = Tokens::open(&path, &clock()).expect("is read");
        assert!(tokens.known().is_none() && !tokens.are_made());
        let token = TokenFile::add(&path, new("bridge", Role::Operator, None), &clock()).expect("is made");
        tokens.0.lock().reload();
        assert!(valid(&tokens, &token).is_some() && tokens.are_made());
        for broken in [Some("{"), None] {
            match broken {
                Some(text) => fs::write(&path, text).expect("is written"),
                None => fs::remove_file(&path).expect("is there"),
            }
            tokens.0.lock().reload();
            assert_eq!(valid(&tokens, &token), None, "{broken:?}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn names_are_plain_and_unique() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        for wrong in ["", "a b", "a\n", &"x".repeat(65)] {
            let refused = TokenFile::add(&path, new(wrong, Role::Admin, None), &clock());
            assert!(matches!(refused, Err(TokenError::Name(_))), "{wrong:?}");
        }
        TokenFile::add(&path, new("a", Role::Admin, None), &clock()).expect("is made");
        let again = TokenFile::add(&path, new("a", Role::Admin, None), &clock());
        assert!(matches!(again, Err(TokenError::NameTaken(_))));
    }
}
