//! Configuration: a flag, else an environment variable, else a key of the file, else the default.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{env, fs};

use rustix::fs::statvfs;
use service::{access::TOKEN_PREFIX, missions::retention::Retention};
use store::FILE_NAME;
use toml::{Table, Value};

mod flags;
mod setting;

pub(crate) use flags::{CommonFlags, ServeFlags, hidden_places};
pub(crate) use setting::Config;
use setting::{COMMON, ConfigSetting, PREFIX, SERVE, all};

use super::failure::{Failure, because_of};
use super::out_file::print;

/// Variable of the configuration file's path.
const FILE_VARIABLE: &str = "PILOTFISH_CONFIG";

/// Name of the token file in a data directory.
pub(crate) const TOKENS: &str = "tokens.json";

const GIB: f64 = 1024.0 * 1024.0 * 1024.0;

impl Config {
    /// The same for a service in this program: a free loopback port, no TLS, its own missions.
    pub(crate) fn on_any_loopback_port(&self) -> Self {
        Self {
            host: "127.0.0.1".to_owned(),
            port: 0,
            tls_certificate: None,
            tls_key: None,
            store: None,
            ..self.clone()
        }
    }

    pub(crate) fn tokens(&self) -> PathBuf {
        self.tokens.clone().unwrap_or_else(|| self.data.join(TOKENS))
    }

    /// Disk space for the missions of one client, bytes.
    pub(crate) fn disk_share(&self) -> u64 {
        if 0.0 < self.client_gib {
            #[expect(clippy::cast_possible_truncation, reason = "is in the setting's range")]
            return (self.client_gib * GIB) as u64;
        }
        if self.store.is_some() {
            // The database has its own disk.
            return u64::MAX;
        }
        // The directory may not exist yet.
        let mut places = self.data.ancestors().filter(|place| !place.as_os_str().is_empty());
        let disk = places.find_map(|place| statvfs(place).ok()).or_else(|| statvfs(".").ok());
        let log = fs::metadata(self.data.join(FILE_NAME)).map_or(0, |log| log.len());
        let room = disk.map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize).saturating_add(log));
        room.map_or(u64::MAX, |room| room / 2)
    }

    pub(crate) fn retention(&self) -> Retention {
        let after = |hours: f64| (0.0 < hours).then(|| Duration::from_secs_f64(3600.0 * hours));
        Retention { over: after(24.0 * self.keep_days), abandoned: after(self.abandoned_hours) }
    }
}

/// The value of each setting after all layers, and its source.
#[derive(Debug, Default)]
pub(crate) struct Layers {
    values: Table,
    sources: BTreeMap<String, String>,
}

impl Layers {
    /// The layers of this process, with the file at `path` or the one that the environment names.
    /// Without `serve`, the service's variables are ignored.
    pub(crate) fn read(
        path: Option<&Path>,
        common: &CommonFlags,
        serve: &[&ServeFlags],
    ) -> Result<Self, Box<dyn Error>> {
        let mut layers = Self::default();
        for setting in all() {
            if let Some(default) = setting.default {
                let value = setting.kind.read(default).expect("defaults are valid");
                layers.set(setting, value, "default".to_owned());
            }
        }
        let stated = env::var_os(FILE_VARIABLE).map(PathBuf::from);
        if let Some(path) = path.or(stated.as_deref()) {
            layers.add_file(path)?;
        }
        layers.add_environment(!serve.is_empty())?;
        let flags = [&common.0].into_iter().chain(serve.iter().map(|flags| &flags.0));
        for (setting, value) in flags.flatten() {
            layers.set(setting, value.clone(), format!("--{}", setting.flag()));
        }
        Ok(layers)
    }

    pub(crate) fn config(&self) -> Config {
        self.values.clone().try_into().expect("each value was checked")
    }

    /// `true` if the value of this setting is from its flag.
    pub(crate) fn has_flag(&self, name: &str) -> bool {
        self.sources.get(name).is_some_and(|source| source.starts_with("--"))
    }

    fn set(&mut self, setting: &ConfigSetting, value: Value, source: String) {
        self.values.insert(setting.name.to_owned(), value);
        self.sources.insert(setting.name.to_owned(), source);
    }

    fn add_file(&mut self, path: &Path) -> Result<(), Box<dyn Error>> {
        let file = path.display();
        let text = fs::read_to_string(path);
        let text = text.map_err(because_of(format!("cannot read the configuration file {file}")))?;
        let table = text.parse::<Table>();
        let table = table.map_err(because_of(format!("the configuration file {file} is not TOML")))?;
        for (key, value) in table {
            let Some(setting) = all().find(|setting| setting.name == key) else {
                let names: Vec<_> = all().map(|setting| setting.name).collect();
                let names = names.join(", ");
                return Err(format!("{file}: unknown setting {key:?}; the settings are {names}").into());
            };
            let wrong = |wanted: String| format!("{file}: {key}: {} {wanted}", shown(&value));
            setting.kind.check(&value).map_err(wrong)?;
            self.set(setting, value, file.to_string());
        }
        Ok(())
    }

    /// Warns in the service of unknown variables with the prefix; orchestrators may set some.
    fn add_environment(&mut self, of_service: bool) -> Result<(), Box<dyn Error>> {
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
                    eprintln!("pilotfish: unknown setting {variable} is ignored");
                }
                continue;
            };
            let text = text.to_str().ok_or_else(|| format!("{variable} is not UTF-8"))?;
            let wrong = |wanted: String| format!("{variable}: {} {wanted}", shown(&Value::from(text)));
            let value = setting.kind.read(text).map_err(wrong)?;
            self.set(setting, value, variable.to_owned());
        }
        Ok(())
    }
}

/// `pilotfish config`: prints the configuration as a file, and the source of each value.
pub(crate) fn show(layers: &Layers) -> Result<(), Failure> {
    let lines = all().map(|ConfigSetting { name, .. }| match layers.values.get(*name) {
        Some(value) => (format!("{name} = {}", shown(value)), &*layers.sources[*name]),
        None => (format!("# {name} ="), "default"),
    });
    let lines: Vec<_> = lines.collect();
    let width = lines.iter().map(|(line, _)| line.chars().count()).max().unwrap_or_default();
    let line = |(line, source): &(String, &str)| format!("{line:width$}  # {source}\n");
    print(&lines.iter().map(line).collect::<String>())
}

/// A value as TOML, unless it may be a secret.
fn shown(value: &Value) -> String {
    let text = value.to_string();
    if text.contains(TOKEN_PREFIX) {
        return "\"(hidden token)\"".to_owned();
    }
    if text.contains("password=") {
        return "\"(hidden password)\"".to_owned();
    }
    let Some((scheme, (login, address))) =
        text.split_once("://").and_then(|(scheme, rest)| Some((scheme, rest.rsplit_once('@')?)))
    else {
        return text;
    };
    let user = login.split(':').next().unwrap_or_default();
    format!("{scheme}://{user}@{address}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(text: &str, flags: &[(&str, &str)]) -> Result<Layers, Box<dyn Error>> {
        let directory = tempfile::tempdir().expect("there is room");
        let path = directory.path().join("pilotfish.toml");
        fs::write(&path, text).expect("is written");
        let given = flags.iter().map(|&(name, text)| {
            let setting = all().find(|setting| setting.name == name).expect("is one");
            (setting, setting.kind.read(text).expect("is valid"))
        });
        let flags = flags::Flags(given.collect());
        Layers::read(Some(&path), &CommonFlags::default(), &[&flags])
    }

    #[test]
    fn a_flag_overrides_the_file_and_the_file_overrides_the_default() {
        let layers =
            layers("port = 1\ndeadline_ms = 20\nallow_host = [\"a\"]\n", &[("port", "2")]).expect("is valid");
        let config = layers.config();
        assert_eq!((config.port, config.deadline_ms), (2, 20.0));
        assert_eq!(config.allow_host, ["a"]);
        assert_eq!(config.host, "127.0.0.1");
        let source = |name| &*layers.sources[name];
        assert_eq!(source("port"), "--port");
        assert!(source("deadline_ms").ends_with("pilotfish.toml"));
        assert_eq!(source("host"), "default");
    }

    #[test]
    fn an_error_names_file_key_and_value() {
        for (text, says) in [
            ("prot = 1", "unknown setting \"prot\""),
            ("port = 65536", "port: 65536 must be a whole number from 0 to 65535"),
            ("port = \"8080\"", "port: \"8080\" must be a whole number"),
            ("deadline_ms = 0", "deadline_ms: 0 must be a number from 0.05 to 60000"),
            ("insecure = 1", "insecure: 1 must be true or false"),
            ("log_format = \"xml\"", "must be text or json"),
            ("[serve]\nport = 1", "unknown setting \"serve\""),
            ("port = ", "is not TOML"),
        ] {
            let error = layers(text, &[]).expect_err(text).to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    #[test]
    fn a_token_in_the_wrong_place_is_hidden_and_a_password_in_any() {
        let secret = format!("tokens = \"{TOKEN_PREFIX}0123\"");
        let layers = layers(&secret, &[]).expect("is a path");
        assert!(!shown(&layers.values["tokens"]).contains("0123"));
        for (url, seen) in [
            ("postgres://me:secret@one,two/missions", "\"postgres://me@one,two/missions\""),
            ("postgres://me@one/missions", "\"postgres://me@one/missions\""),
            ("postgres://one/missions?password=secret", "\"(hidden password)\""),
        ] {
            assert_eq!(shown(&url.into()), seen);
        }
    }
}
