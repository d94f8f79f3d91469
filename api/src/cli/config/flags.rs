//! The flags of the settings, for clap.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches, parser::ValueSource};
use toml::Value;

use super::setting::{COMMON, ConfigSetting, SERVE, SettingKind};

/// The given flags of one table of settings, [`SERVE`] or [`COMMON`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Flags<const OF_SERVICE: bool>(pub(crate) Vec<(&'static ConfigSetting, Value)>);

/// Flags that every subcommand has.
pub(crate) type CommonFlags = Flags<false>;

/// Flags of the service.
pub(crate) type ServeFlags = Flags<true>;

impl<const OF_SERVICE: bool> Flags<OF_SERVICE> {
    const SETTINGS: &'static [ConfigSetting] = if OF_SERVICE { SERVE } else { COMMON };

    /// The name of the first given flag.
    pub(crate) fn first(&self) -> Option<String> {
        let (setting, _) = self.0.first()?;
        Some(format!("--{}", setting.flag()))
    }
}

/// Name of the argument in clap. Subcommands have arguments with the settings' names.
fn id(setting: &ConfigSetting) -> String {
    format!("setting {}", setting.name)
}

fn flag(setting: &'static ConfigSetting) -> Arg {
    let ConfigSetting { kind, .. } = *setting;
    let default = setting.default.filter(|default| !default.is_empty());
    let default = default.map_or_else(String::new, |default| format!(" [default: {default}]"));
    let flag = Arg::new(id(setting))
        .long(setting.flag())
        .value_name(setting.value_name)
        .help(format!("{} [env: {}]{default}", setting.help, setting.variable()))
        .value_parser(move |text: &str| kind.read(text).map(|_| text.to_owned()));
    match kind {
        SettingKind::Switch => flag.num_args(0..=1).require_equals(true).default_missing_value("true"),
        SettingKind::List => flag.action(ArgAction::Append),
        _ => flag,
    }
}

/// The hidden flags of missions and tokens, for commands without either.
pub(crate) fn hidden_places() -> impl Iterator<Item = Arg> {
    let is_place = |setting: &&ConfigSetting| ["data", "store", "tokens"].contains(&setting.name);
    COMMON.iter().filter(is_place).map(|setting| flag(setting).global(true).hide(true))
}

impl<const OF_SERVICE: bool> FromArgMatches for Flags<OF_SERVICE> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut flags = Self::default();
        flags.update_from_arg_matches(matches)?;
        Ok(flags)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        for setting in Self::SETTINGS {
            let id = id(setting);
            if matches.value_source(&id) != Some(ValueSource::CommandLine) {
                continue;
            }
            let texts = matches.get_many::<String>(&id).into_iter().flatten();
            let text = texts.map(String::as_str).collect::<Vec<_>>().join(",");
            let value = setting.kind.read(&text).expect("clap has read it");
            self.0.push((setting, value));
        }
        Ok(())
    }
}

impl<const OF_SERVICE: bool> Args for Flags<OF_SERVICE> {
    fn augment_args(command: Command) -> Command {
        let flags = Self::SETTINGS.iter();
        command.args(flags.map(|setting| flag(setting).global(!OF_SERVICE)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}
