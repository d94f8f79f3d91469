//! The command line as `ros2 run` and a launch file make it: `--ros-args` up to `--`.

use std::io;

use super::{
    error::Ros2Error,
    parameters::{Parameters, read_file, read_value},
};

/// A command line, with what is for ROS taken out of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arguments {
    /// What is not for ROS, in its order.
    pub others: Vec<String>,
    /// Name of the node, where one is given (`-r __node:=NAME`).
    pub(super) node: Option<String>,
    /// Namespace of the node, where one is given (`-r __ns:=/NAMESPACE`).
    pub(super) namespace: Option<String>,
    /// Topics to take for other ones (`-r FROM:=TO`), in their order.
    pub(super) remaps: Vec<(String, String)>,
    assignments: Vec<Assignment>,
}

/// Where parameters come from.
#[derive(Clone, Debug, PartialEq)]
enum Assignment {
    /// `--params-file PATH`
    File(String),
    /// `-p NAME:=VALUE`
    One(String, String),
}

impl Arguments {
    /// Takes `arguments` apart (without the program's own name).
    pub fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Self, Ros2Error> {
        let mut parsed = Self::default();
        let mut arguments = arguments.into_iter();
        while let Some(argument) = arguments.next() {
            if argument == "--ros-args" {
                parsed.parse_ros(&mut arguments)?;
            } else {
                parsed.others.push(argument);
            }
        }
        Ok(parsed)
    }

    fn parse_ros(&mut self, arguments: &mut impl Iterator<Item = String>) -> Result<(), Ros2Error> {
        while let Some(flag) = arguments.next() {
            match flag.as_str() {
                "--" => return Ok(()),
                "-r" | "--remap" => {
                    let (from, to) = assignment(&flag, arguments.next())?;
                    match from.as_str() {
                        "__node" | "__name" => self.node = Some(to),
                        "__ns" => self.namespace = Some(to),
                        _ => self.remaps.push((from, to)),
                    }
                }
                "-p" | "--param" => {
                    let (name, value) = assignment(&flag, arguments.next())?;
                    self.assignments.push(Assignment::One(name, value));
                }
                "--params-file" => {
                    let path = arguments.next().ok_or_else(|| no_argument(&flag, "a file"))?;
                    self.assignments.push(Assignment::File(path));
                }
                // How rcl is to log, and a directory of keys: a launch file may say so to all of its nodes.
                "-e" | "--enclave" | "--log-level" | "--log-config-file" | "--log-file-name" => {
                    arguments.next();
                }
                flag if flag.starts_with("--enable-") || flag.starts_with("--disable-") => {}
                _ => return Err(no_argument(&flag, "-r, -p or --params-file")),
            }
        }
        Ok(())
    }

    /// The parameters of the node `node` (`/namespace/name`), the later before the earlier. `read` reads a file.
    pub(super) fn parameters(
        &self,
        node: &str,
        read: impl Fn(&str) -> io::Result<String>,
    ) -> Result<Parameters, Ros2Error> {
        let mut parameters = Parameters::new();
        for assignment in &self.assignments {
            match assignment {
                Assignment::File(path) => {
                    let no_yaml = |source| Ros2Error::Yaml {
                        text: path.clone(),
                        source,
                    };
                    let text = read(path).map_err(|source| Ros2Error::ParametersFile {
                        path: path.clone(),
                        source,
                    })?;
                    read_file(&text, node, &mut parameters).map_err(no_yaml)?;
                }
                Assignment::One(name, text) => {
                    let value = read_value(text).map_err(|source| Ros2Error::Yaml {
                        text: text.clone(),
                        source,
                    })?;
                    let value = value.ok_or_else(|| Ros2Error::Parameter {
                        name: name.clone(),
                        value: text.clone(),
                        expected: "a text, a number, true, false or a list of texts",
                    })?;
                    parameters.insert(name.clone(), value);
                }
            }
        }
        Ok(parameters)
    }
}

/// The two sides of `:=`.
fn assignment(flag: &str, argument: Option<String>) -> Result<(String, String), Ros2Error> {
    const EXPECTED: &str = "NAME:=VALUE";
    let argument = argument.ok_or_else(|| no_argument(flag, EXPECTED))?;
    let sides = argument.split_once(":=");
    let (name, value) = sides.ok_or_else(|| no_argument(&argument, EXPECTED))?;
    Ok((name.to_owned(), value.to_owned()))
}

fn no_argument(argument: &str, expected: &'static str) -> Ros2Error {
    Ros2Error::Argument {
        argument: argument.to_owned(),
        expected,
    }
}

#[cfg(test)]
mod tests {
    use ros2_client::ParameterValue;

    use super::*;

    fn parsed(line: &str) -> Result<Arguments, Ros2Error> {
        Arguments::parse(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn what_is_not_for_ros_is_left_in_its_order() {
        let arguments =
            parsed("bridge --ros-args -r __node:=b -r __ns:=/f -r a:=/b --log-level debug -- --mission x")
                .expect("is a command line");
        assert_eq!(arguments.others, ["bridge", "--mission", "x"]);
        assert_eq!(arguments.node.as_deref(), Some("b"));
        assert_eq!(arguments.namespace.as_deref(), Some("/f"));
        assert_eq!(arguments.remaps, [("a".to_owned(), "/b".to_owned())]);
    }

    #[test]
    fn the_later_assignment_counts() {
        let arguments = parsed("--ros-args -p craft:=a --params-file f -p auvs:=[]").expect("is one");
        let read = |_: &str| Ok("/**:\n  ros__parameters: {craft: b, auvs: [c]}".to_owned());
        let parameters = arguments.parameters("/x", read).expect("are parameters");
        assert_eq!(parameters["craft"], ParameterValue::String("b".to_owned()));
        assert_eq!(parameters["auvs"], ParameterValue::StringArray(Vec::new()));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let named = |line: &str| parsed(line).expect_err("is wrong").to_string();
        assert!(named("--ros-args -p craft=a").contains("craft=a"));
        assert!(named("--ros-args -p").contains("-p"));
        assert!(named("--ros-args craft:=a").contains("craft:=a"));
        let arguments = parsed("--ros-args --params-file gone.yaml").expect("is one");
        let gone = |_: &str| Err(io::Error::from(io::ErrorKind::NotFound));
        let error = arguments.parameters("/x", gone).expect_err("is not there");
        assert!(error.to_string().contains("gone.yaml"));
    }
}
