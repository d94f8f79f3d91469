//! Why the adapter does not start.

use std::io;

use geodesy::NotOnEarth;
use ros2_client::{CreateError, NodeCreateError, names::NameError};
use saphyr::ScanError;

/// Why there is no adapter.
#[derive(Debug, thiserror::Error)]
pub enum Ros2Error {
    /// Part of the command line means nothing.
    #[error("{argument}: {expected} is expected after --ros-args")]
    Argument {
        /// The part.
        argument: String,
        /// What would have meant something.
        expected: &'static str,
    },
    /// A file with parameters cannot be read.
    #[error("{path}: {source}")]
    ParametersFile {
        /// The file.
        path: String,
        /// Why not.
        source: io::Error,
    },
    /// A file or a value is not written in YAML.
    #[error("{text}: {source}")]
    Yaml {
        /// The file's name, or the value.
        text: String,
        /// Where and why.
        source: ScanError,
    },
    /// A parameter has a value that it cannot have.
    #[error("parameter {name} is {value}: {expected} is expected")]
    Parameter {
        /// Its name.
        name: String,
        /// Its value.
        value: String,
        /// What it could be.
        expected: &'static str,
    },
    /// A parameter is missing that has no default.
    #[error("parameter {name} is missing: {expected}, as in --ros-args -p {name}:={example}")]
    Missing {
        /// Its name.
        name: &'static str,
        /// What it is.
        expected: &'static str,
        /// A value.
        example: &'static str,
    },
    /// There is no parameter of that name.
    #[error("there is no parameter {name}")]
    Unknown {
        /// The name.
        name: String,
    },
    /// A name that ROS does not allow.
    #[error("{name}: {source}")]
    Name {
        /// The name.
        name: String,
        /// Why not.
        source: NameError,
    },
    /// The origin of the map is not on Earth.
    #[error(transparent)]
    Origin(#[from] NotOnEarth),
    /// DDS does not start: no socket, mostly.
    #[error("DDS does not start: {0}")]
    Dds(#[from] CreateError),
    /// The node does not start.
    #[error("the node does not start: {0}")]
    Node(#[from] NodeCreateError),
    /// The node's thread does not start.
    #[error("the node's thread does not start: {0}")]
    Thread(io::Error),
}
