//! The table of settings: flags, environment variables, keys of the file, and documentation.

use std::{ops::RangeInclusive, path::PathBuf};

use serde::Deserialize;
use toml::Value;
use tracing_subscriber::filter::{LevelFilter, Targets};
use wire::DEADLINE_MS;

/// Prefix of the environment variables.
pub(crate) const PREFIX: &str = "PILOTFISH_";

/// One setting. Its flag is `--` and the name with hyphens, its variable [`PREFIX`] and the name in
/// capitals, its key in the file the name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConfigSetting {
    pub(crate) name: &'static str,
    pub(crate) kind: SettingKind,
    /// As written in the environment.
    pub(crate) default: Option<&'static str>,
    /// Name of the value in the help.
    pub(crate) value_name: &'static str,
    pub(crate) help: &'static str,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum SettingKind {
    Text,
    Number(fn() -> RangeInclusive<f64>),
    Whole(i64, i64),
    Switch,
    List,
    /// A filter of log lines.
    Filter,
    OneOf(&'static [&'static str]),
}

/// The settings, each defined once: the name and type of its value in [`Config`], its kind, its
/// default, the name of its value in the help, and the help.
macro_rules! settings {
    ($(#[doc = $doc:literal] $table:ident {
        $($name:ident: $type:ty = $kind:expr, $default:expr, $value_name:literal, $help:literal;)*
    })*) => {
        $(
            #[doc = $doc]
            pub(crate) const $table: &[ConfigSetting] = &[$(ConfigSetting {
                name: stringify!($name),
                kind: $kind,
                default: $default,
                value_name: $value_name,
                help: $help,
            }),*];
        )*

        /// Every setting, after all layers.
        #[derive(Clone, Debug, Deserialize)]
        pub(crate) struct Config {
            $($(pub(crate) $name: $type,)*)*
        }
    };
}

settings! {
    /// Settings of every subcommand.
    COMMON {
        data: PathBuf = SettingKind::Text, Some("pilotfish-data"), "DIRECTORY",
            "Data directory, created if missing";
        store: Option<String> = SettingKind::Text, None, "URL",
            "PostgreSQL database of the missions, postgres://USER@HOST:PORT,HOST:PORT/NAME, which several services share; by default the data directory has them";
        tokens: Option<PathBuf> = SettingKind::Text, None, "FILE",
            "Token file; by default tokens.json in the data directory";
        log: String = SettingKind::Filter, Some("warn,pilotfish=info"), "FILTER",
            "Log filter: a level, and levels by target, such as warn,pilotfish=debug; RUST_LOG overrides it";
        log_format: String = SettingKind::OneOf(&["text", "json"]), Some("text"), "FORMAT",
            "Log format: text or json";
    }
    /// Settings of the service.
    SERVE {
        host: String = SettingKind::Text, Some("127.0.0.1"), "HOST",
            "Address or host name to listen on";
        port: u16 = SettingKind::Whole(0, 65_535), Some("8080"), "PORT",
            "Port to listen on; 0 chooses a free one";
        allow_host: Vec<String> = SettingKind::List, Some(""), "NAME",
            "More host names under which clients reach the service, such as that of a proxy; separated by commas";
        framed_by: Vec<String> = SettingKind::List, Some(""), "ORIGIN",
            "Origins, http://HOST:PORT or https://HOST:PORT, whose pages may show this one in a frame; separated by commas";
        tls_certificate: Option<PathBuf> = SettingKind::Text, None, "FILE",
            "Certificate chain (PEM) for HTTPS";
        tls_key: Option<PathBuf> = SettingKind::Text, None, "FILE",
            "Private key of the certificate (PEM)";
        insecure: bool = SettingKind::Switch, Some("false"), "BOOL",
            "Let other machines connect without tokens or without TLS, although anyone on the network can then read or command";
        deadline_ms: f64 = SettingKind::Number(|| DEADLINE_MS), Some("1000"), "MS",
            "Deadline of an answer, ms, from 0.05 to 60000; a request may set an earlier one";
        keep_days: f64 = SettingKind::Number(|| 0.0..=36_500.0), Some("0"), "DAYS",
            "How long finished missions are kept, days; 0 keeps them forever";
        abandoned_hours: f64 = SettingKind::Number(|| 0.0..=87_600.0), Some("24"), "HOURS",
            "Time without a report after which a live mission is finished, hours; 0 means never";
        client_gib: f64 = SettingKind::Number(|| 0.0..=1e6), Some("0"), "GIB",
            "Disk space for the missions of one client, GiB; 0 allows half of the space that is free or used by the log at the start, and all of it with --store";
        advertise: Option<String> = SettingKind::Text, None, "URL",
            "With --store: where the other services reach this one, http://HOST:PORT or https://HOST:PORT; by default the address to listen on; required if that is a loopback address and the database is on another machine";
        advertise_ca: Option<PathBuf> = SettingKind::Text, None, "FILE",
            "With --store, if services call each other by HTTPS: certificate of the authority (PEM) that signed theirs";
        peers: Vec<String> = SettingKind::List, Some(""), "URL",
            "With --store: where the other services are, http://HOST:PORT or https://HOST:PORT, separated by commas: besides services certified by --advertise-ca, calls with a client's token are forwarded to these alone";
        lease_s: f64 = SettingKind::Number(|| 0.5..=60.0), Some("2"), "S",
            "With --store: how long this service keeps its missions while the database does not answer, s, from 0.5 to 60; then another one takes them";
        shutdown_delay_s: f64 = SettingKind::Number(|| 0.0..=30.0), Some("0"), "S",
            "How long to keep serving after a stop signal while /readyz fails, s, from 0 to 30: time for a proxy to notice";
    }
}

pub(crate) fn all() -> impl Iterator<Item = &'static ConfigSetting> {
    COMMON.iter().chain(SERVE)
}

impl ConfigSetting {
    pub(crate) fn flag(&self) -> String {
        self.name.replace('_', "-")
    }

    pub(crate) fn variable(&self) -> String {
        format!("{PREFIX}{}", self.name.to_uppercase())
    }
}

impl SettingKind {
    /// The value of a flag or variable. Fails with the expected form.
    pub(crate) fn read(self, text: &str) -> Result<Value, String> {
        let value = match self {
            Self::Text | Self::Filter | Self::OneOf(_) => Value::from(text),
            Self::Number(_) => text.parse::<f64>().map_err(|_| self.wanted())?.into(),
            Self::Whole(..) => text.parse::<i64>().map_err(|_| self.wanted())?.into(),
            Self::Switch => match text.to_ascii_lowercase().as_str() {
                "1" | "true" | "yes" | "on" => true.into(),
                "0" | "false" | "no" | "off" | "" => false.into(),
                _ => return Err(self.wanted()),
            },
            Self::List => {
                let items = text.split(',').map(str::trim).filter(|item| !item.is_empty());
                Value::Array(items.map(Value::from).collect())
            }
        };
        self.check(&value)?;
        Ok(value)
    }

    /// Fails with the expected form, unless the value has the right type and range.
    pub(crate) fn check(self, value: &Value) -> Result<(), String> {
        let fits = match self {
            Self::Text => value.as_str().is_some_and(|text| !text.is_empty()),
            Self::Number(range) => value
                .as_float()
                .or_else(|| value.as_integer().map(|whole| whole as f64))
                .is_some_and(|number| range().contains(&number)),
            Self::Whole(least, most) => {
                value.as_integer().is_some_and(|number| (least..=most).contains(&number))
            }
            Self::Switch => value.is_bool(),
            Self::List => value.as_array().is_some_and(|items| items.iter().all(Value::is_str)),
            Self::Filter => value.as_str().is_some_and(is_filter),
            Self::OneOf(names) => value.as_str().is_some_and(|text| names.contains(&text)),
        };
        if fits { Ok(()) } else { Err(self.wanted()) }
    }

    /// The expected form.
    fn wanted(self) -> String {
        match self {
            Self::Text => "must be a non-empty text".to_owned(),
            Self::Number(range) => {
                let (least, most) = range().into_inner();
                format!("must be a number from {least} to {most}")
            }
            Self::Whole(least, most) => format!("must be a whole number from {least} to {most}"),
            Self::Switch => "must be true or false".to_owned(),
            Self::List => "must be a list of texts".to_owned(),
            Self::Filter => {
                "must be a level (error, warn, info, debug, trace, off), and levels by target".to_owned()
            }
            Self::OneOf(names) => format!("must be {}", names.join(" or ")),
        }
    }
}

/// `true` if `text` is a filter of log lines. `Targets` reads an unknown level as a target.
fn is_filter(text: &str) -> bool {
    let mut directives = text.split(',').filter(|directive| !directive.is_empty());
    text.parse::<Targets>().is_ok()
        && directives.all(|directive| directive.contains('=') || directive.parse::<LevelFilter>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documentation_lists_every_setting() {
        let documentation = include_str!("../../../../docs/operation.md");
        for setting in all() {
            let default = setting
                .default
                .filter(|default| !default.is_empty())
                .map_or_else(String::new, |default| format!("`{default}`"));
            let row = format!(
                "| `--{}` | `{}` | `{}` | {default} | {} |",
                setting.flag(),
                setting.variable(),
                setting.name,
                setting.help
            );
            assert!(documentation.contains(&row), "docs/operation.md lacks\n{row}");
        }
    }

    #[test]
    fn a_word_that_is_no_level_is_no_log_filter() {
        for (filter, is_one) in [
            ("debug", true),
            ("WARN,pilotfish=trace", true),
            ("off,", true),
            ("loud", false),
            ("warn,pilotfish", false),
            ("pilotfish=loud", false),
        ] {
            assert_eq!(SettingKind::Filter.read(filter).is_ok(), is_one, "{filter}");
        }
    }

    #[test]
    fn every_default_is_valid() {
        for setting in all() {
            assert!(setting.default.is_none_or(|default| setting.kind.read(default).is_ok()), "{setting:?}");
        }
    }
}
