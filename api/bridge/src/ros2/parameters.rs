//! Parameters of ROS as they are written: YAML on the command line and in a launch file's parameters.

use std::collections::BTreeMap;

use ros2_client::ParameterValue;
use saphyr::{LoadableYamlNode as _, Scalar, ScanError, Yaml};

/// Values by their names, levels joined by dots.
pub(super) type Parameters = BTreeMap<String, ParameterValue>;

/// Under this key a file has the parameters of the nodes that are named above it.
const PARAMETERS_KEY: &str = "ros__parameters";

/// Adds what `text` says of the node `node` (`/namespace/name`) to `parameters`; what was there before is replaced.
///
/// ```text
/// /namespace/name | /**/name | /**:
///   ros__parameters:
///     origin: {lat_deg: 38.41, lon_deg: -9.12}
/// ```
pub(super) fn read_file(text: &str, node: &str, parameters: &mut Parameters) -> Result<(), ScanError> {
    for document in &Yaml::load_from_str(text)? {
        of_node(document, "", node, parameters);
    }
    Ok(())
}

/// The value that is written as `text`; none for what is no value of a parameter, such as a list of unlike things.
pub(super) fn read_value(text: &str) -> Result<Option<ParameterValue>, ScanError> {
    let documents = Yaml::load_from_str(text)?;
    Ok(documents.first().map(value).unwrap_or_default())
}

fn of_node(yaml: &Yaml<'_>, selector: &str, node: &str, parameters: &mut Parameters) {
    for (key, below) in yaml.as_mapping().into_iter().flatten() {
        match key.as_str() {
            Some(PARAMETERS_KEY) if selects(selector, node) => flatten(below, "", parameters),
            Some(PARAMETERS_KEY) | None => {}
            Some(key) => {
                let key = key.trim_matches('/');
                of_node(below, &format!("{selector}/{key}"), node, parameters);
            }
        }
    }
}

/// Whether `selector` names `node`: as it is, by its last name wherever it is, or with all others.
fn selects(selector: &str, node: &str) -> bool {
    let anywhere = selector.strip_prefix("/**");
    selector == node || anywhere.is_some_and(|name| name.is_empty() || node.ends_with(name))
}

fn flatten(yaml: &Yaml<'_>, name: &str, parameters: &mut Parameters) {
    if let Some(mapping) = yaml.as_mapping() {
        for (key, below) in mapping {
            let key = key.as_str().unwrap_or_default();
            let dot = if name.is_empty() { "" } else { "." };
            flatten(below, &format!("{name}{dot}{key}"), parameters);
        }
    } else {
        // What is no value is kept as "not set", so that the settings refuse it by its name.
        let value = value(yaml).unwrap_or(ParameterValue::NotSet);
        parameters.insert(name.to_owned(), value);
    }
}

fn value(yaml: &Yaml<'_>) -> Option<ParameterValue> {
    match yaml {
        Yaml::Value(Scalar::Boolean(value)) => Some(ParameterValue::Boolean(*value)),
        Yaml::Value(Scalar::Integer(value)) => Some(ParameterValue::Integer(*value)),
        Yaml::Value(Scalar::FloatingPoint(value)) => Some(ParameterValue::Double(value.0)),
        Yaml::Value(Scalar::String(value)) => Some(ParameterValue::String(value.to_string())),
        // The one list among the settings is one of names.
        Yaml::Sequence(values) => {
            let texts = values.iter().map(|value| value.as_str().map(str::to_owned));
            texts.collect::<Option<_>>().map(ParameterValue::StringArray)
        }
        Yaml::Value(Scalar::Null)
        | Yaml::Mapping(_)
        | Yaml::Representation(..)
        | Yaml::Tagged(..)
        | Yaml::Alias(_)
        | Yaml::BadValue => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters_of(node: &str, text: &str) -> Parameters {
        let mut parameters = Parameters::new();
        read_file(text, node, &mut parameters).expect("is YAML");
        parameters
    }

    #[test]
    fn a_file_as_launch_ros_writes_it_is_read() {
        let text = "/fleet/bridge:\n  ros__parameters:\n    auvs:\n    - red\n    - black\n    craft: medusa\n    \
                    origin.lat_deg: 38.41\n    localhost_only: true\n    domain_id: 7\n";
        let parameters = parameters_of("/fleet/bridge", text);
        let auvs = ParameterValue::StringArray(vec!["red".to_owned(), "black".to_owned()]);
        assert_eq!(parameters["auvs"], auvs);
        assert_eq!(parameters["craft"], ParameterValue::String("medusa".to_owned()));
        assert_eq!(parameters["origin.lat_deg"], ParameterValue::Double(38.41));
        assert_eq!(parameters["localhost_only"], ParameterValue::Boolean(true));
        assert_eq!(parameters["domain_id"], ParameterValue::Integer(7));
        assert!(parameters_of("/bridge", text).is_empty());
    }

    #[test]
    fn levels_and_patterns_of_a_file_mean_what_they_mean_in_ros() {
        let nested = "fleet:\n  bridge:\n    ros__parameters:\n      origin: {lat_deg: 1.5}\n";
        assert_eq!(
            parameters_of("/fleet/bridge", nested)["origin.lat_deg"],
            ParameterValue::Double(1.5)
        );
        for (selector, node, is_read) in [
            ("/**", "/a/b/bridge", true),
            ("/**/bridge", "/a/b/bridge", true),
            ("/**/bridge", "/a/b/drawbridge", false),
            ("bridge", "/bridge", true),
            ("bridge", "/fleet/bridge", false),
        ] {
            let text = format!("{selector}:\n  ros__parameters:\n    craft: medusa\n");
            assert_eq!(
                !parameters_of(node, &text).is_empty(),
                is_read,
                "{selector} {node}"
            );
        }
    }

    #[test]
    fn quoted_numbers_are_texts_and_mixed_lists_are_nothing() {
        assert_eq!(
            read_value("'12'"),
            Ok(Some(ParameterValue::String("12".to_owned())))
        );
        assert_eq!(read_value("12"), Ok(Some(ParameterValue::Integer(12))));
        assert_eq!(
            read_value("[]"),
            Ok(Some(ParameterValue::StringArray(Vec::new())))
        );
        assert_eq!(read_value("[red, 1]"), Ok(None));
        assert_eq!(read_value("{a: 1}"), Ok(None));
        assert_eq!(read_value(""), Ok(None));
        assert!(read_value("[red").is_err());
    }
}
