//! Configuration: a flag, else an environment variable, else a key of the file, else the default.

use std::{
    env, fs, io,
    path::{Path, PathBuf},
    time::Duration,
};

use figment::{
    Figment, Metadata, Profile, Provider, Source,
    value::{Dict, Map, Value},
};
use rustix::fs::statvfs;
use serde::Deserialize;
use service::{access::TOKEN_PREFIX, missions::retention::Retention, store::FILE_NAME};

mod flags;
mod setting;

pub(crate) use flags::{CommonFlags, ServeFlags};
use setting::{COMMON, PREFIX, SERVE, Setting, all};

use super::out_file::{NotPrinted, print};

/// Variable of the configuration file's path.
const FILE_VARIABLE: &str = "PILOTFISH_CONFIG";

/// Names of the layers, the lowest one first; between the first and the second is the file.
const DEFAULTS: &str = "default";
const ENVIRONMENT: &str = "environment";
const FLAGS: &str = "flag";

/// Bytes.
const GIB: f64 = 1024.0 * 1024.0 * 1024.0;

/// Every setting, after all layers.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Config {
    pub(crate) data: PathBuf,
    tokens: Option<PathBuf>,
    pub(crate) log: String,
    pub(crate) log_format: String,
    pub(crate) host: String,
    pub(crate) port: u16,
    pub(crate) allow_host: Vec<String>,
    pub(crate) tls_certificate: Option<PathBuf>,
    pub(crate) tls_key: Option<PathBuf>,
    pub(crate) insecure: bool,
    pub(crate) deadline_ms: f64,
    pub(crate) keep_days: f64,
    pub(crate) abandoned_hours: f64,
    client_gib: f64,
    pub(crate) shutdown_delay_s: f64,
}

impl Config {
    /// The same for a service that this program alone calls: on any port of the loopback address, without TLS.
    pub(crate) fn on_any_loopback_port(&self) -> Self {
        Self {
            host: "127.0.0.1".to_owned(),
            port: 0,
            tls_certificate: None,
            tls_key: None,
            ..self.clone()
        }
    }

    /// The file of tokens.
    pub(crate) fn tokens(&self) -> PathBuf {
        let beside_missions = || self.data.join("tokens.json");
        self.tokens.clone().unwrap_or_else(beside_missions)
    }

    /// Most that the missions of one client take of the disk, bytes.
    pub(crate) fn disk_share(&self) -> u64 {
        if 0.0 < self.client_gib {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "is in the setting's range"
            )]
            return (self.client_gib * GIB) as u64;
        }
        // The directory may still have to be made.
        let mut places = self
            .data
            .ancestors()
            .filter(|place| !place.as_os_str().is_empty());
        let disk = places
            .find_map(|place| statvfs(place).ok())
            .or_else(|| statvfs(".").ok());
        let log = fs::metadata(self.data.join(FILE_NAME)).map_or(0, |log| log.len());
        let room = disk.map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize).saturating_add(log));
        room.map_or(u64::MAX, |room| room / 2)
    }

    /// How long missions are kept.
    pub(crate) fn retention(&self) -> Retention {
        let after = |hours: f64| (0.0 < hours).then(|| Duration::from_secs_f64(3600.0 * hours));
        Retention {
            over: after(24.0 * self.keep_days),
            abandoned: after(self.abandoned_hours),
        }
    }
}

/// Why there is no configuration.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ConfigError {
    #[error("the configuration file {} cannot be read", .0.display())]
    File(PathBuf, #[source] io::Error),
    #[error("the configuration file {} is not TOML", .0.display())]
    Syntax(PathBuf, #[source] Box<toml::de::Error>),
    #[error("{file}: there is no setting {key:?}; the settings are {}", names())]
    UnknownKey { file: String, key: String },
    #[error("{variable} is not UTF-8")]
    NotText { variable: String },
    #[error("{source_name}: {value} {wanted}")]
    Value {
        /// The flag, the variable, or the file and its key.
        source_name: String,
        value: String,
        wanted: String,
    },
    #[error(transparent)]
    Figment(#[from] Box<figment::Error>),
}

fn names() -> String {
    all().map(|setting| setting.name).collect::<Vec<_>>().join(", ")
}

/// The layers of the configuration, which know where each value is from.
#[derive(Debug)]
pub(crate) struct Layers(Figment);

/// One layer.
struct Layer {
    metadata: Metadata,
    values: Dict,
}

impl Layer {
    fn named(name: &'static str, values: Dict) -> Self {
        Self {
            metadata: Metadata::named(name),
            values,
        }
    }
}

impl Provider for Layer {
    fn metadata(&self) -> Metadata {
        self.metadata.clone()
    }

    fn data(&self) -> Result<Map<Profile, Dict>, figment::Error> {
        Ok([(Profile::Default, self.values.clone())].into())
    }
}

impl Layers {
    /// The layers of this process, with the file at `path` or the one that the environment names. Subcommands that do not
    /// concern the service have no flags of it, and do not care for its variables.
    pub(crate) fn read(
        path: Option<&Path>,
        common: &CommonFlags,
        serve: &[&ServeFlags],
    ) -> Result<Self, ConfigError> {
        let path = path
            .map(Path::to_owned)
            .or_else(|| env::var_os(FILE_VARIABLE).map(PathBuf::from));
        let mut layers = Figment::from(Layer::named(DEFAULTS, defaults()));
        if let Some(path) = path {
            layers = layers.merge(file(&path)?);
        }
        layers = layers
            .merge(Layer::named(ENVIRONMENT, environment(!serve.is_empty())?))
            .merge(Layer::named(FLAGS, common.0.clone()));
        for flags in serve {
            layers = layers.merge(Layer::named(FLAGS, flags.0.clone()));
        }
        Ok(Self(layers))
    }

    pub(crate) fn config(&self) -> Result<Config, ConfigError> {
        Ok(self.0.extract().map_err(Box::new)?)
    }

    /// Where the value of `setting` is from.
    fn source(&self, setting: &Setting) -> String {
        let Some(metadata) = self.0.find_metadata(setting.name) else {
            return DEFAULTS.to_owned();
        };
        match (&metadata.source, &*metadata.name) {
            (Some(Source::File(path)), _) => path.display().to_string(),
            (_, FLAGS) => format!("--{}", setting.flag()),
            (_, ENVIRONMENT) => setting.variable(),
            _ => DEFAULTS.to_owned(),
        }
    }
}

/// `pilotfish config`: prints the configuration as a file would have it, and where each value is from.
pub(crate) fn show(layers: &Layers) -> Result<(), NotPrinted> {
    let lines: Vec<(String, String)> = all()
        .map(|setting| {
            let value = layers.0.find_value(setting.name).ok();
            let line = value.map_or_else(
                || format!("# {} =", setting.name),
                |value| format!("{} = {}", setting.name, shown(&value)),
            );
            (line, layers.source(setting))
        })
        .collect();
    let width = lines.iter().map(|(line, _)| line.chars().count()).max();
    let width = width.unwrap_or_default();
    let text = lines
        .iter()
        .map(|(line, source)| format!("{line:width$}  # {source}"))
        .collect::<Vec<_>>()
        .join("\n");
    print(&format!("{text}\n"))
}

/// A value as TOML, but for what may be a secret.
fn shown(value: &Value) -> String {
    let text = toml::Value::try_from(value).map_or_else(|_| "?".to_owned(), |value| value.to_string());
    if text.contains(TOKEN_PREFIX) {
        return "\"(a token, which is not shown)\"".to_owned();
    }
    text
}

fn defaults() -> Dict {
    all()
        .filter_map(|setting| {
            let value = setting.kind.read(setting.default?).expect("defaults are valid");
            Some((setting.name.to_owned(), value))
        })
        .collect()
}

fn file(path: &Path) -> Result<Layer, ConfigError> {
    let text = fs::read_to_string(path).map_err(|error| ConfigError::File(path.to_owned(), error))?;
    let table: toml::Table = text
        .parse()
        .map_err(|error| ConfigError::Syntax(path.to_owned(), Box::new(error)))?;
    let mut values = Dict::new();
    for (key, value) in table {
        let file = path.display().to_string();
        let Some(setting) = all().find(|setting| setting.name == key) else {
            return Err(ConfigError::UnknownKey { file, key });
        };
        let value = Value::serialize(value).map_err(Box::new)?;
        let checked = setting.kind.check(value.clone());
        let checked = checked.map_err(|wanted| ConfigError::Value {
            source_name: format!("{file}: {key}"),
            value: shown(&value),
            wanted,
        })?;
        values.insert(key, checked);
    }
    Ok(Layer {
        metadata: Metadata::from("file", path),
        values,
    })
}

/// The variables of this process. Others that begin alike may be of something else, such as a container's orchestrator, which
/// names its services so: the service warns of them.
fn environment(of_service: bool) -> Result<Dict, ConfigError> {
    let mut values = Dict::new();
    for (variable, text) in env::vars_os() {
        let Some(variable) = variable.to_str().filter(|variable| variable.starts_with(PREFIX)) else {
            continue;
        };
        if variable == FILE_VARIABLE {
            continue;
        }
        let mut known = COMMON.iter().chain(SERVE.iter().filter(|_| of_service));
        let Some(setting) = known.find(|setting| setting.variable() == variable) else {
            if of_service {
                eprintln!("pilotfish: {variable} is no setting, and is ignored");
            }
            continue;
        };
        let text = text.to_str().ok_or_else(|| ConfigError::NotText {
            variable: variable.to_owned(),
        })?;
        let value = setting.kind.read(text).map_err(|wanted| ConfigError::Value {
            source_name: variable.to_owned(),
            value: shown(&Value::from(text)),
            wanted,
        })?;
        values.insert(setting.name.to_owned(), value);
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(text: &str, flags: &[(&str, &str)]) -> Result<Layers, ConfigError> {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("pilotfish.toml");
        fs::write(&path, text).expect("is written");
        let given = flags.iter().map(|&(name, text)| {
            let setting = all().find(|setting| setting.name == name).expect("is one");
            (name.to_owned(), setting.kind.read(text).expect("is valid"))
        });
        Layers::read(
            Some(&path),
            &CommonFlags::default(),
            &[&ServeFlags(given.collect())],
        )
    }

    #[test]
    fn a_flag_goes_before_the_file_and_the_file_before_the_default() {
        let layers = layers(
            "port = 1\ndeadline_ms = 20\nallow_host = [\"a\"]\n",
            &[("port", "2")],
        )
        .expect("is valid");
        let config = layers.config().expect("is whole");
        assert_eq!((config.port, config.deadline_ms), (2, 20.0));
        assert_eq!(config.allow_host, ["a"]);
        assert_eq!(config.host, "127.0.0.1");
        let source = |name| {
            let setting = all().find(|setting| setting.name == name).expect("is one");
            layers.source(setting)
        };
        assert_eq!(source("port"), "--port");
        assert!(source("deadline_ms").ends_with("pilotfish.toml"));
        assert_eq!(source("host"), "default");
    }

    #[test]
    fn a_wrong_file_is_blamed_by_file_key_and_value() {
        for (text, says) in [
            ("prot = 1", "there is no setting \"prot\""),
            (
                "port = 65536",
                "port: 65536 should be a whole number from 0 to 65535",
            ),
            ("port = \"8080\"", "port: \"8080\" should be a whole number"),
            (
                "deadline_ms = 0",
                "deadline_ms: 0 should be a number from 0.05 to 60000",
            ),
            ("insecure = 1", "insecure: 1 should be true or false"),
            ("log_format = \"xml\"", "should be text or json"),
            ("[serve]\nport = 1", "there is no setting \"serve\""),
            ("port = ", "is not TOML"),
        ] {
            let error = layers(text, &[]).expect_err(text).to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    #[test]
    fn a_token_in_the_wrong_place_is_not_shown() {
        let secret = format!("tokens = \"{TOKEN_PREFIX}0123\"");
        let layers = layers(&secret, &[]).expect("is a path");
        assert!(!shown(&layers.0.find_value("tokens").expect("is there")).contains("0123"));
    }
}
