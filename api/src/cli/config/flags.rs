//! Flags of the settings, for clap.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches, parser::ValueSource};
use figment::value::Dict;

use super::setting::{COMMON, Kind, SERVE, Setting};

/// What flags that every subcommand has were given.
#[derive(Clone, Debug, Default)]
pub(crate) struct CommonFlags(pub(crate) Dict);

/// What flags of the service were given.
#[derive(Clone, Debug, Default)]
pub(crate) struct ServeFlags(pub(crate) Dict);

impl ServeFlags {
    /// The first flag that was given.
    pub(crate) fn first(&self) -> Option<String> {
        let name = self.0.keys().next()?;
        Some(format!("--{}", name.replace('_', "-")))
    }
}

/// What clap calls it: subcommands have arguments of the same names.
fn id(setting: &Setting) -> String {
    format!("setting {}", setting.name)
}

fn flag(setting: &'static Setting) -> Arg {
    let Setting { kind, .. } = *setting;
    let default = setting.default.filter(|default| !default.is_empty());
    let default = default.map_or_else(String::new, |default| format!(" [default: {default}]"));
    let flag = Arg::new(id(setting))
        .long(setting.flag())
        .value_name(setting.value_name)
        .help(format!("{} [env: {}]{default}", setting.help, setting.variable()))
        .value_parser(move |text: &str| kind.read(text).map(|_| text.to_owned()));
    match kind {
        Kind::Switch => flag
            .num_args(0..=1)
            .require_equals(true)
            .default_missing_value("true"),
        Kind::List => flag.action(ArgAction::Append),
        _ => flag,
    }
}

/// The values that were given on the command line, by setting.
fn given(settings: &[Setting], matches: &ArgMatches) -> Dict {
    let mut given = Dict::new();
    for setting in settings {
        let id = id(setting);
        if matches.value_source(&id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let texts = matches.get_many::<String>(&id).into_iter().flatten();
        let text = texts.map(String::as_str).collect::<Vec<_>>().join(",");
        let value = setting.kind.read(&text).expect("clap has read it");
        given.insert(setting.name.to_owned(), value);
    }
    given
}

impl FromArgMatches for CommonFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        Ok(Self(given(COMMON, matches)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        self.0.extend(given(COMMON, matches));
        Ok(())
    }
}

impl Args for CommonFlags {
    fn augment_args(command: Command) -> Command {
        command.args(COMMON.iter().map(|setting| flag(setting).global(true)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ServeFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        Ok(Self(given(SERVE, matches)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        self.0.extend(given(SERVE, matches));
        Ok(())
    }
}

impl Args for ServeFlags {
    fn augment_args(command: Command) -> Command {
        command.args(SERVE.iter().map(flag))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}
