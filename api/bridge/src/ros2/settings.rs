//! What the adapter has to be told, by a launch file or on the command line.

use std::{collections::BTreeSet, io};

use ros2_client::ParameterValue;

use super::{arguments::Arguments, conversion::HeadingLoop, error::Ros2Error, parameters::Parameters};
use crate::Geographic;

/// Everything the adapter has to be told.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Namespace of the node, such as `/` or `/fleet`.
    pub namespace: String,
    /// Name of the node.
    pub node: String,
    /// DDS domain, in 0 … 232.
    pub domain_id: u16,
    /// Whether to speak to this machine alone.
    pub localhost_only: bool,
    /// The surface craft, as it is called in topics.
    pub craft: String,
    /// The AUVs, as they are called in topics and in measurements.
    pub auvs: Vec<String>,
    /// Where the origin of the map is on Earth.
    pub origin: Geographic,
    /// Name of the map's frame (ENU).
    pub map_frame: String,
    /// Name of the craft's own frame (FLU).
    pub base_frame: String,
    /// How a heading reference becomes a turn rate.
    pub heading_loop: HeadingLoop,
    /// Topics with their whole names.
    pub topics: Topics,
}

/// Names of topics, each from `/` on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// `nav_msgs/Odometry` of the craft: `CRAFT/odom`.
    pub craft_odometry: String,
    /// `nav_msgs/Odometry` of each AUV, in the order of the AUVs: `AUV/odom`.
    pub auv_odometry: Vec<String>,
    /// `geometry_msgs/TwistStamped` to the craft: `CRAFT/cmd_vel`.
    pub twist: String,
    /// `nav_msgs/Path` of the plan: `CRAFT/plan`.
    pub path: String,
}

/// Ports are 7400 + 250 · domain and above. Source: OMG DDSI-RTPS 2.5, 9.6.2.3.
const DOMAIN_MAX: i64 = 232;

const NODE: &str = "pilotfish_bridge";

impl Settings {
    /// The settings of a command line, with what `environment` says of the domain and of how far to speak. `read` reads a
    /// file.
    pub fn new(
        arguments: &Arguments,
        environment: impl Fn(&str) -> Option<String>,
        read: impl Fn(&str) -> io::Result<String>,
    ) -> Result<Self, Ros2Error> {
        let namespace = arguments.namespace.clone().unwrap_or_else(|| "/".to_owned());
        let node = arguments.node.clone().unwrap_or_else(|| NODE.to_owned());
        let own_name = joined(&namespace, &node);
        let mut known = Known(arguments.parameters(&own_name, read)?);

        let craft = known.text("craft")?.ok_or(Ros2Error::Missing {
            name: "craft",
            expected: "what the craft is called in topics",
            example: "medusa",
        })?;
        let auvs = known.names("auvs")?;
        let topic = |name: String| arguments.topic(&namespace, &own_name, &name);
        let topics = Topics {
            craft_odometry: topic(format!("{craft}/odom")),
            auv_odometry: auvs.iter().map(|auv| topic(format!("{auv}/odom"))).collect(),
            twist: topic(format!("{craft}/cmd_vel")),
            path: topic(format!("{craft}/plan")),
        };
        let settings = Self {
            domain_id: known.domain_id(&environment)?,
            localhost_only: known.localhost_only(&environment)?,
            origin: known.origin()?,
            map_frame: known.map_frame()?,
            base_frame: known
                .text("base_frame")?
                .unwrap_or_else(|| "base_link".to_owned()),
            heading_loop: known.heading_loop()?,
            namespace,
            node,
            craft,
            auvs,
            topics,
        };
        known.no_simulated_time()?;
        known.nothing_else()?;
        Ok(settings)
    }

    /// The settings as parameters of the node.
    pub(super) fn parameters(&self) -> Vec<(&'static str, ParameterValue)> {
        vec![
            ("craft", ParameterValue::String(self.craft.clone())),
            ("auvs", ParameterValue::StringArray(self.auvs.clone())),
            ("origin.lat_deg", ParameterValue::Double(self.origin.lat_deg)),
            ("origin.lon_deg", ParameterValue::Double(self.origin.lon_deg)),
            ("map_frame", ParameterValue::String(self.map_frame.clone())),
            ("base_frame", ParameterValue::String(self.base_frame.clone())),
            (
                TIME_CONSTANT,
                ParameterValue::Double(self.heading_loop.time_constant_s),
            ),
            (RATE_MAX, ParameterValue::Double(self.heading_loop.rate_max_radps)),
            ("domain_id", ParameterValue::Integer(self.domain_id.into())),
            ("localhost_only", ParameterValue::Boolean(self.localhost_only)),
        ]
    }
}

const TIME_CONSTANT: &str = "heading_loop.time_constant_s";
const RATE_MAX: &str = "heading_loop.rate_max_radps";

impl Arguments {
    /// The whole name of the topic `name`, after the remaps; the last one counts.
    fn topic(&self, namespace: &str, node: &str, name: &str) -> String {
        let whole = |name: &str| match name.strip_prefix("~/") {
            Some(own) => joined(node, own),
            None if name.starts_with('/') => name.to_owned(),
            None => joined(namespace, name),
        };
        let name = whole(name);
        let remap = self.remaps.iter().rfind(|(from, _)| whole(from) == name);
        remap.map_or(name, |(_, to)| whole(to))
    }
}

fn joined(namespace: &str, name: &str) -> String {
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

/// Parameters that have not been asked for yet.
struct Known(Parameters);

impl Known {
    fn text(&mut self, name: &str) -> Result<Option<String>, Ros2Error> {
        match self.0.remove(name) {
            None => Ok(None),
            Some(ParameterValue::String(value)) if !value.is_empty() => Ok(Some(value)),
            Some(value) => Err(unexpected(name, &value, "a text")),
        }
    }

    /// A list of texts, no two alike.
    fn names(&mut self, name: &str) -> Result<Vec<String>, Ros2Error> {
        match self.0.remove(name) {
            None => Ok(Vec::new()),
            Some(ParameterValue::StringArray(names)) if all_different(&names) => Ok(names),
            Some(value) => Err(unexpected(name, &value, "a list of names, each of them once")),
        }
    }

    /// A number within `bounds`, whole or not.
    fn number(&mut self, name: &str, (min, max): (f64, f64)) -> Result<Option<f64>, Ros2Error> {
        let Some(value) = self.0.remove(name) else {
            return Ok(None);
        };
        let number = match value {
            ParameterValue::Double(number) => number,
            #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
            ParameterValue::Integer(number) => number as f64,
            _ => f64::NAN,
        };
        if min <= number && number <= max {
            return Ok(Some(number));
        }
        Err(unexpected(
            name,
            &value,
            "a number within its bounds (docs/ros2.md)",
        ))
    }

    fn flag(&mut self, name: &str) -> Result<Option<bool>, Ros2Error> {
        match self.0.remove(name) {
            None => Ok(None),
            Some(ParameterValue::Boolean(value)) => Ok(Some(value)),
            Some(value) => Err(unexpected(name, &value, "true or false")),
        }
    }

    fn origin(&mut self) -> Result<Geographic, Ros2Error> {
        let missing = |name, example| Ros2Error::Missing {
            name,
            expected: "where the origin of the map frame is on Earth (WGS 84, degrees)",
            example,
        };
        let latitude = self.number("origin.lat_deg", (-90.0, 90.0))?;
        let longitude = self.number("origin.lon_deg", (-180.0, 180.0))?;
        Ok(Geographic {
            lat_deg: latitude.ok_or(missing("origin.lat_deg", "38.41"))?,
            lon_deg: longitude.ok_or(missing("origin.lon_deg", "-9.12"))?,
        })
    }

    fn map_frame(&mut self) -> Result<String, Ros2Error> {
        const NAME: &str = "map_frame";
        let frame = self.text(NAME)?.unwrap_or_else(|| "map".to_owned());
        // REP 103 has this suffix for frames whose z points down.
        if frame.ends_with("_ned") {
            let value = ParameterValue::String(frame);
            return Err(unexpected(NAME, &value, "a frame of east, north and up"));
        }
        Ok(frame.trim_start_matches('/').to_owned())
    }

    fn heading_loop(&mut self) -> Result<HeadingLoop, Ros2Error> {
        // Faster than any craft's loop, slower than any, and the same of its turn rate.
        const TIME_CONSTANTS_S: (f64, f64) = (0.05, 60.0);
        const RATES_RADPS: (f64, f64) = (0.001, 3.0);
        let HeadingLoop {
            time_constant_s,
            rate_max_radps,
        } = HeadingLoop::default();
        Ok(HeadingLoop {
            time_constant_s: self
                .number(TIME_CONSTANT, TIME_CONSTANTS_S)?
                .unwrap_or(time_constant_s),
            rate_max_radps: self.number(RATE_MAX, RATES_RADPS)?.unwrap_or(rate_max_radps),
        })
    }

    /// The parameter, or else `ROS_DOMAIN_ID`, or else 0, which is every ROS program's.
    fn domain_id(&mut self, environment: &impl Fn(&str) -> Option<String>) -> Result<u16, Ros2Error> {
        const VARIABLE: &str = "ROS_DOMAIN_ID";
        let (name, value) = match (self.0.remove("domain_id"), environment(VARIABLE)) {
            (Some(value), _) => ("domain_id", value),
            (None, Some(text)) if !text.is_empty() => (
                VARIABLE,
                text.parse()
                    .map_or(ParameterValue::String(text), ParameterValue::Integer),
            ),
            (None, _) => return Ok(0),
        };
        if let ParameterValue::Integer(domain @ 0..=DOMAIN_MAX) = value {
            return Ok(u16::try_from(domain).expect("is at most 232"));
        }
        Err(unexpected(name, &value, "a whole number from 0 to 232"))
    }

    /// The parameter, or else what ROS itself goes by.
    fn localhost_only(&mut self, environment: &impl Fn(&str) -> Option<String>) -> Result<bool, Ros2Error> {
        let says = |name: &str, value: &str| environment(name).is_some_and(|is| is == value);
        let by_environment =
            says("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST") || says("ROS_LOCALHOST_ONLY", "1");
        Ok(self.flag("localhost_only")?.unwrap_or(by_environment))
    }

    /// Stamps are compared with the clock of the machine, and a mission runs by it.
    fn no_simulated_time(&mut self) -> Result<(), Ros2Error> {
        const NAME: &str = "use_sim_time";
        match self.flag(NAME)? {
            Some(true) => {
                let value = ParameterValue::Boolean(true);
                Err(unexpected(NAME, &value, "false, since missions run by the clock"))
            }
            Some(false) | None => Ok(()),
        }
    }

    fn nothing_else(self) -> Result<(), Ros2Error> {
        match self.0.into_keys().next() {
            Some(name) => Err(Ros2Error::Unknown { name }),
            None => Ok(()),
        }
    }
}

fn all_different(names: &[String]) -> bool {
    let mut before = BTreeSet::new();
    names.iter().all(|name| before.insert(name))
}

fn unexpected(name: &str, value: &ParameterValue, expected: &'static str) -> Ros2Error {
    Ros2Error::Parameter {
        name: name.to_owned(),
        value: format!("{value:?}"),
        expected,
    }
}

#[cfg(test)]
mod tests;
