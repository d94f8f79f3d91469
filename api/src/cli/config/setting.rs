//! The table of settings. Flags, environment variables, keys of the file and the documentation's table are made of it.

use std::ops::RangeInclusive;

use figment::value::{Num, Value};
use tracing_subscriber::filter::Targets;
use wire::DEADLINE_MS;

/// What every environment variable of the program begins with.
pub(crate) const PREFIX: &str = "PILOTFISH_";

/// One setting. Its flag is `--` and the name with hyphens, its variable [`PREFIX`] and the name in capitals, its key in
/// the file the name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    /// As it would be written in the environment.
    pub(crate) default: Option<&'static str>,
    /// What its value is called in the help.
    pub(crate) value_name: &'static str,
    pub(crate) help: &'static str,
}

/// What a value may be.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Text,
    Number(fn() -> RangeInclusive<f64>),
    Whole(i64, i64),
    Switch,
    List,
    /// A filter of log lines.
    Filter,
    OneOf(&'static [&'static str]),
}

/// Settings of every subcommand.
pub(crate) const COMMON: &[Setting] = &[
    Setting {
        name: "data",
        kind: Kind::Text,
        default: Some("pilotfish-data"),
        value_name: "DIRECTORY",
        help: "Directory for the log of missions, made if it is not there",
    },
    Setting {
        name: "tokens",
        kind: Kind::Text,
        default: None,
        value_name: "FILE",
        help: "File of the tokens that clients need; tokens.json in the data directory if not given",
    },
    Setting {
        name: "log",
        kind: Kind::Filter,
        default: Some("warn,pilotfish=info"),
        value_name: "FILTER",
        help: "What is logged: a level, and levels by target, such as warn,pilotfish=debug",
    },
    Setting {
        name: "log_format",
        kind: Kind::OneOf(&["text", "json"]),
        default: Some("text"),
        value_name: "FORMAT",
        help: "Lines of the log: text for people, json for programs",
    },
];

/// Settings of the service.
pub(crate) const SERVE: &[Setting] = &[
    Setting {
        name: "host",
        kind: Kind::Text,
        default: Some("127.0.0.1"),
        value_name: "HOST",
        help: "Address to listen on, or a name that stands for one",
    },
    Setting {
        name: "port",
        kind: Kind::Whole(0, 65_535),
        default: Some("8080"),
        value_name: "PORT",
        help: "Port to listen on; 0 takes a free one",
    },
    Setting {
        name: "allow_host",
        kind: Kind::List,
        default: Some(""),
        value_name: "NAME",
        help: "Other names under which clients may call the service, as of a proxy before it, with commas between them",
    },
    Setting {
        name: "tls_certificate",
        kind: Kind::Text,
        default: None,
        value_name: "FILE",
        help: "Certificate chain, PEM: the service speaks HTTPS",
    },
    Setting {
        name: "tls_key",
        kind: Kind::Text,
        default: None,
        value_name: "FILE",
        help: "Private key of the certificate, PEM",
    },
    Setting {
        name: "insecure",
        kind: Kind::Switch,
        default: Some("false"),
        value_name: "BOOL",
        help: "Listen beyond this machine without tokens or without TLS, though anyone in between may then read, or command",
    },
    Setting {
        name: "deadline_ms",
        kind: Kind::Number(|| DEADLINE_MS),
        default: Some("1000"),
        value_name: "MS",
        help: "Longest time for an answer, ms, from 0.05 to 60000; a request may ask for a shorter one",
    },
    Setting {
        name: "keep_days",
        kind: Kind::Number(|| 0.0..=36_500.0),
        default: Some("0"),
        value_name: "DAYS",
        help: "How long a mission that is over is kept, days; 0 for ever",
    },
    Setting {
        name: "abandoned_hours",
        kind: Kind::Number(|| 0.0..=87_600.0),
        default: Some("24"),
        value_name: "HOURS",
        help: "A live mission without a report for so long is finished, hours; 0 never",
    },
    Setting {
        name: "client_gib",
        kind: Kind::Number(|| 0.0..=1e6),
        default: Some("0"),
        value_name: "GIB",
        help: "Most that the missions of one client take of the disk, GiB; 0 for half of what is free or the log has when the service starts",
    },
    Setting {
        name: "shutdown_delay_s",
        kind: Kind::Number(|| 0.0..=30.0),
        default: Some("0"),
        value_name: "S",
        help: "How long to answer on after the order to stop while /readyz says no, s, from 0 to 30: time for a proxy to notice",
    },
];

/// Every setting.
pub(crate) fn all() -> impl Iterator<Item = &'static Setting> {
    COMMON.iter().chain(SERVE)
}

impl Setting {
    pub(crate) fn flag(&self) -> String {
        self.name.replace('_', "-")
    }

    pub(crate) fn variable(&self) -> String {
        format!("{PREFIX}{}", self.name.to_uppercase())
    }
}

impl Kind {
    /// What `text` of a flag or variable means. Fails with what it should be.
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
            Self::List => text
                .split(',')
                .map(str::trim)
                .filter(|item| !item.is_empty())
                .map(Value::from)
                .collect::<Vec<_>>()
                .into(),
        };
        self.check(value)
    }

    /// The value, if it is one that the setting may have. Fails with what it should be.
    pub(crate) fn check(self, value: Value) -> Result<Value, String> {
        let fits = match self {
            Self::Text => value.as_str().is_some_and(|text| !text.is_empty()),
            Self::Number(range) => value.to_num().is_some_and(|number| {
                let number = number.to_f64().or_else(|| number.to_i128().map(whole_as_f64));
                number.is_some_and(|number| range().contains(&number))
            }),
            Self::Whole(least, most) => value
                .to_num()
                .and_then(Num::to_i128)
                .is_some_and(|number| (i128::from(least)..=i128::from(most)).contains(&number)),
            Self::Switch => value.to_bool().is_some(),
            Self::List => value
                .as_array()
                .is_some_and(|items| items.iter().all(|item| item.as_str().is_some())),
            Self::Filter => value.as_str().is_some_and(|text| text.parse::<Targets>().is_ok()),
            Self::OneOf(names) => value.as_str().is_some_and(|text| names.contains(&text)),
        };
        if fits { Ok(value) } else { Err(self.wanted()) }
    }

    /// What a value should be.
    fn wanted(self) -> String {
        match self {
            Self::Text => "should be a text, and not empty".to_owned(),
            Self::Number(range) => {
                let (least, most) = range().into_inner();
                format!("should be a number from {least} to {most}")
            }
            Self::Whole(least, most) => format!("should be a whole number from {least} to {most}"),
            Self::Switch => "should be true or false".to_owned(),
            Self::List => "should be a list of texts".to_owned(),
            Self::Filter => {
                "should be a level (error, warn, info, debug, trace, off), and levels by target".to_owned()
            }
            Self::OneOf(names) => format!("should be {}", names.join(" or ")),
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "settings are small")]
fn whole_as_f64(whole: i128) -> f64 {
    whole as f64
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
    fn every_default_is_a_value_that_its_setting_may_have() {
        for setting in all() {
            assert!(
                setting
                    .default
                    .is_none_or(|default| setting.kind.read(default).is_ok()),
                "{setting:?}"
            );
        }
    }
}
