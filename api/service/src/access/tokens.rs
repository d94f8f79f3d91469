//! The file of tokens. It holds digests: a token itself is shown once, to the one who makes it.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, Write as _},
    os::unix::fs::{MetadataExt as _, OpenOptionsExt as _, fchown},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use subtle::ConstantTimeEq as _;

use super::{Caller, Role};
use crate::problem::Problem;

/// What a token begins with, so that people and scanners of leaked secrets know one when they see it.
pub const PREFIX: &str = "pf_";

/// Random bytes of a token. So many cannot be guessed, which is why a fast hash will do.
const RANDOM_BYTES: usize = 32;

/// Longest name of a token, bytes.
const NAME_BYTES_MAX: usize = 64;

/// How long a change of the file may go unnoticed.
const REREAD: Duration = Duration::from_secs(1);

/// What is known of every token.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TokenFile {
    /// Every token, in the order in which they were made.
    pub tokens: Vec<StoredToken>,
}

/// What is known of one token.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredToken {
    /// Whose it is, as logs show it.
    pub name: String,
    /// What its bearer may do.
    pub role: Role,
    /// SHA-256 of the token, hexadecimal.
    pub sha256: Digest,
    /// When it was made, Unix time, s.
    pub made_s: u64,
    /// When it ceases to be valid, Unix time, s; never if none.
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
        let read = hex::decode_to_slice(text, &mut bytes);
        read.map(|()| Self(bytes))
            .map_err(|_| "a SHA-256 has 64 hexadecimal digits")
    }
}

/// What a token is to be.
#[derive(Clone, Debug)]
pub struct NewToken {
    /// Whose it is.
    pub name: String,
    /// What its bearer may do.
    pub role: Role,
    /// How long it is valid; for ever if none.
    pub valid: Option<Duration>,
}

/// Why the tokens are not known, or not changed.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The file cannot be read or written.
    #[error("the tokens in {} cannot be read or written", .0.display())]
    File(PathBuf, #[source] io::Error),
    /// The file is not what was written.
    #[error("{} is no file of tokens; pilotfish token add makes one", .0.display())]
    NoTokens(PathBuf, #[source] serde_json::Error),
    /// The name cannot be one.
    #[error("a token's name is 1 to {NAME_BYTES_MAX} letters, digits and . _ -, such as bridge-1, not {0:?}")]
    Name(String),
    /// There is one of that name.
    #[error("there is a token called {0}; revoke it first, or choose another name")]
    NameTaken(String),
    /// There is none of that name.
    #[error("there is no token called {0}; pilotfish token list shows them")]
    Unknown(String),
    /// The system gives no random numbers.
    #[error("the system gives no random numbers: {0}")]
    Random(getrandom::Error),
}

impl TokenFile {
    /// What stands in the file at `path`; none if there is no such file.
    pub fn read(path: &Path) -> Result<Option<Self>, TokenError> {
        match fs::read(path) {
            Ok(text) => serde_json::from_slice(&text)
                .map(Some)
                .map_err(|error| TokenError::NoTokens(path.to_owned(), error)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(TokenError::File(path.to_owned(), error)),
        }
    }

    /// Makes a token, stores its digest in the file at `path`, and gives it back.
    pub fn add(path: &Path, new: NewToken) -> Result<String, TokenError> {
        let NewToken { name, role, valid } = new;
        let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        if !(1..=NAME_BYTES_MAX).contains(&name.len()) || !name.bytes().all(plain) {
            return Err(TokenError::Name(name));
        }
        let mut random = [0; RANDOM_BYTES];
        getrandom::fill(&mut random).map_err(TokenError::Random)?;
        let token = format!("{PREFIX}{}", hex::encode(random));
        let now = unix_now();
        Self::change(path, |known| {
            if known.tokens.iter().any(|token| token.name == name) {
                return Err(TokenError::NameTaken(name));
            }
            known.tokens.push(StoredToken {
                name,
                role,
                sha256: Digest::of(&token),
                made_s: now,
                expires_s: valid.map(|valid| now.saturating_add(valid.as_secs())),
            });
            Ok(())
        })?;
        Ok(token)
    }

    /// Makes the token called `name` invalid.
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

    /// Changes the file as a whole, one program at a time.
    fn change(
        path: &Path,
        change: impl FnOnce(&mut Self) -> Result<(), TokenError>,
    ) -> Result<(), TokenError> {
        let refused = |error| TokenError::File(path.to_owned(), error);
        let lock = File::create(path.with_extension("lock")).map_err(refused)?;
        lock.lock().map_err(refused)?;
        let mut known = Self::read(path)?.unwrap_or_default();
        change(&mut known)?;
        let text = serde_json::to_vec_pretty(&known).expect("names and numbers only");
        write_whole(path, &text).map_err(refused)
    }

    /// Who `token` belongs to.
    pub(super) fn caller(&self, token: &str) -> Result<Caller, Problem> {
        let found = self.find(token, unix_now()).ok_or(Problem::Unauthenticated)?;
        Ok(Caller {
            name: found.name.as_str().into(),
            role: found.role,
            has_token: true,
        })
    }

    /// The stored token that `token` is, if it is one and has not expired. Takes the same time for every wrong one.
    fn find(&self, token: &str, now: u64) -> Option<&StoredToken> {
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

/// Replaces the file at `path` at once, so that no reader sees half of it.
fn write_whole(path: &Path, text: &[u8]) -> io::Result<()> {
    let new = path.with_extension("new");
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let owner = fs::metadata(directory.unwrap_or(Path::new(".")))?;
    let mut file = OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(true)
        .mode(0o600)
        .open(&new)?;
    file.write_all(text)?;
    // Where an administrator makes it, the service's user is to read it. Only an administrator can, and needs to.
    let _ = fchown(&file, Some(owner.uid()), Some(owner.gid()));
    file.sync_all()?;
    fs::rename(&new, path)
}

/// The tokens of a file, read again when it changes. Clones share them.
#[derive(Clone, Debug)]
pub struct Tokens(Arc<Mutex<Reread>>);

#[derive(Debug)]
struct Reread {
    path: PathBuf,
    /// None as long as there was no file.
    known: Option<Arc<TokenFile>>,
    version: Option<Version>,
    looked: Instant,
}

/// What changes when a file does.
type Version = (u64, u64, SystemTime);

fn version(path: &Path) -> Option<Version> {
    let file = fs::metadata(path).ok()?;
    Some((file.ino(), file.len(), file.modified().ok()?))
}

impl Tokens {
    /// The tokens of the file at `path`, which may be made later.
    pub fn open(path: &Path) -> Result<Self, TokenError> {
        let version = version(path);
        let reread = Reread {
            path: path.to_owned(),
            known: TokenFile::read(path)?.map(Arc::new),
            version,
            looked: Instant::now(),
        };
        Ok(Self(Arc::new(Mutex::new(reread))))
    }

    /// Whether there is a token, so that every client needs one.
    #[must_use]
    pub fn are_made(&self) -> bool {
        self.known().is_some_and(|known| !known.tokens.is_empty())
    }

    /// What is known of every token; none as long as there was no file.
    pub(super) fn known(&self) -> Option<Arc<TokenFile>> {
        let mut reread = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if REREAD <= reread.looked.elapsed() {
            reread.look();
        }
        reread.known.clone()
    }
}

impl Reread {
    /// Reads the file again if it is another. One that is gone or broken leaves no token valid: it may have been changed to
    /// revoke one.
    fn look(&mut self) {
        self.looked = Instant::now();
        let version = version(&self.path);
        if version == self.version {
            return;
        }
        self.version = version;
        match TokenFile::read(&self.path) {
            Ok(Some(known)) => {
                tracing::info!(tokens = known.tokens.len(), "the tokens were read again");
                self.known = Some(Arc::new(known));
            }
            Ok(None) => {
                tracing::error!(path = %self.path.display(), "the file of tokens is gone; every call is refused");
                self.known = Some(Arc::default());
            }
            Err(error) => {
                tracing::error!(%error, "the file of tokens is broken; every call is refused");
                self.known = Some(Arc::default());
            }
        }
    }
}

fn unix_now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn new(name: &str, role: Role, valid: Option<Duration>) -> NewToken {
        NewToken {
            name: name.to_owned(),
            role,
            valid,
        }
    }

    fn caller(tokens: &Tokens, token: &str) -> Result<Caller, Problem> {
        tokens.known().expect("there was a file").caller(token)
    }

    #[test]
    fn a_token_is_known_until_it_is_revoked_and_only_its_digest_is_stored() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        let token = TokenFile::add(&path, new("bridge", Role::Operator, None)).expect("is made");
        let other = TokenFile::add(&path, new("page", Role::ReadOnly, None)).expect("is made");

        assert_eq!(token.len(), PREFIX.len() + 2 * RANDOM_BYTES);
        let stored = fs::read_to_string(&path).expect("is there");
        assert!(!stored.contains(&token[PREFIX.len()..]) && !stored.contains(&other));
        assert_eq!(fs::metadata(&path).expect("is there").mode() & 0o777, 0o600);

        let tokens = Tokens::open(&path).expect("is read");
        let bridge = caller(&tokens, &token).expect("is valid");
        assert_eq!((&*bridge.name, bridge.role), ("bridge", Role::Operator));
        for wrong in [&token[1..], &token.to_uppercase(), "", &format!("{token} ")] {
            assert_eq!(caller(&tokens, wrong), Err(Problem::Unauthenticated));
        }

        TokenFile::revoke(&path, "bridge").expect("is there");
        tokens.0.lock().expect("no thread panics").look();
        assert_eq!(caller(&tokens, &token), Err(Problem::Unauthenticated));
        assert!(caller(&tokens, &other).is_ok());
        assert!(matches!(
            TokenFile::revoke(&path, "bridge"),
            Err(TokenError::Unknown(_))
        ));
    }

    #[test]
    fn an_expired_token_is_no_longer_known() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        let day = Duration::from_hours(24);
        let token = TokenFile::add(&path, new("visitor", Role::Admin, Some(day))).expect("is made");
        let known = TokenFile::read(&path).expect("is read").expect("is there");
        let made = known.tokens[0].made_s;
        assert!(known.find(&token, made + 86_399).is_some());
        assert!(known.find(&token, made + 86_400).is_none());
    }

    #[test]
    fn a_file_that_is_made_later_counts_and_one_that_is_gone_or_broken_has_no_valid_token() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        let tokens = Tokens::open(&path).expect("is read");
        assert!(tokens.known().is_none() && !tokens.are_made());
        let token = TokenFile::add(&path, new("bridge", Role::Operator, None)).expect("is made");
        tokens.0.lock().expect("no thread panics").look();
        assert!(caller(&tokens, &token).is_ok() && tokens.are_made());
        for broken in [Some("{"), None] {
            match broken {
                Some(text) => fs::write(&path, text).expect("is written"),
                None => fs::remove_file(&path).expect("is there"),
            }
            tokens.0.lock().expect("no thread panics").look();
            assert_eq!(
                caller(&tokens, &token),
                Err(Problem::Unauthenticated),
                "{broken:?}"
            );
        }
    }

    #[test]
    fn names_are_plain_and_each_is_taken_once() {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("tokens.json");
        for wrong in ["", "a b", "a\n", &"x".repeat(65)] {
            let refused = TokenFile::add(&path, new(wrong, Role::Admin, None));
            assert!(matches!(refused, Err(TokenError::Name(_))), "{wrong:?}");
        }
        TokenFile::add(&path, new("a", Role::Admin, None)).expect("is made");
        let again = TokenFile::add(&path, new("a", Role::Admin, None));
        assert!(matches!(again, Err(TokenError::NameTaken(_))));
    }
}
