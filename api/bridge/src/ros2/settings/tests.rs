use super::*;

const ORIGIN: &str = "-p origin.lat_deg:=38.41 -p origin.lon_deg:=-9.12";

fn settings_in(environment: &[(&str, &str)], line: &str) -> Result<Settings, Ros2Error> {
    let arguments = Arguments::parse(line.split_whitespace().map(str::to_owned))?;
    let variable = |name: &str| {
        let found = environment.iter().find(|(is, _)| *is == name);
        found.map(|(_, value)| (*value).to_owned())
    };
    Settings::new(&arguments, variable, |_| Err(io::ErrorKind::NotFound.into()))
}

fn settings(line: &str) -> Result<Settings, Ros2Error> {
    settings_in(&[], line)
}

#[test]
fn a_craft_and_an_origin_are_enough() {
    let settings = settings(&format!("--ros-args -p craft:=medusa {ORIGIN}")).expect("are settings");
    assert_eq!((settings.namespace.as_str(), settings.node.as_str()), ("/", NODE));
    assert_eq!((settings.domain_id, settings.localhost_only), (0, false));
    assert_eq!(
        settings.origin,
        Geographic::new(38.41, -9.12).expect("is on Earth")
    );
    assert_eq!(settings.heading_loop, HeadingLoop::default());
    assert_eq!(settings.map_frame, "map");
    assert_eq!(settings.topics.craft_odometry, "/medusa/odom");
    assert_eq!(settings.topics.twist, "/medusa/cmd_vel");
    assert_eq!(settings.topics.path, "/medusa/plan");
    assert!(settings.auvs.is_empty() && settings.topics.auv_odometry.is_empty());
}

#[test]
fn topics_follow_namespace_and_remaps() {
    let line = format!(
        "--ros-args -r __ns:=/fleet -r __node:=bridge -p craft:=medusa -p auvs:=[red,black] {ORIGIN} \
         -r red/odom:=/red/filtered -r /fleet/medusa/cmd_vel:=~/twist"
    );
    let topics = settings(&line).expect("are settings").topics;
    assert_eq!(topics.craft_odometry, "/fleet/medusa/odom");
    assert_eq!(topics.auv_odometry, ["/red/filtered", "/fleet/black/odom"]);
    assert_eq!(topics.twist, "/fleet/bridge/twist");
}

#[test]
fn the_environment_says_what_no_parameter_says() {
    let line = format!("--ros-args -p craft:=medusa {ORIGIN}");
    let environment = [
        ("ROS_DOMAIN_ID", "42"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
    ];
    let by_environment = settings_in(&environment, &line).expect("are settings");
    assert_eq!(
        (by_environment.domain_id, by_environment.localhost_only),
        (42, true)
    );
    let line = format!("{line} -p domain_id:=7 -p localhost_only:=false");
    let by_parameter = settings_in(&environment, &line).expect("are settings");
    assert_eq!((by_parameter.domain_id, by_parameter.localhost_only), (7, false));
    let line = format!("--ros-args -p craft:=medusa {ORIGIN}");
    for domain in ["-1", "233", "many"] {
        let error = settings_in(&[("ROS_DOMAIN_ID", domain)], &line).expect_err("is no domain");
        assert!(error.to_string().contains("ROS_DOMAIN_ID"));
    }
}

#[test]
fn what_is_missing_or_wrong_is_named_with_what_to_say() {
    for (line, said) in [
        (ORIGIN, "-p craft:=medusa"),
        ("-p craft:=medusa", "-p origin.lat_deg:=38.41"),
        (
            "-p craft:=medusa -p origin.lat_deg:=38",
            "-p origin.lon_deg:=-9.12",
        ),
        (
            "-p craft:=medusa -p origin.lat_deg:=91 -p origin.lon_deg:=0",
            "origin.lat_deg",
        ),
        (
            "-p craft:=medusa -p origin.lat_deg:=.nan -p origin.lon_deg:=0",
            "origin.lat_deg",
        ),
        ("-p craft:=7", "craft"),
        ("-p craft:=a -p auvs:=red", "auvs"),
    ] {
        let error = settings(&format!("--ros-args {line}")).expect_err("is not enough");
        assert!(error.to_string().contains(said), "{line}: {error}");
    }
    for (line, said) in [
        ("-p map_frame:=map_ned", "map_frame"),
        (
            "-p heading_loop.time_constant_s:=0",
            "heading_loop.time_constant_s",
        ),
        (
            "-p heading_loop.rate_max_radps:=-1",
            "heading_loop.rate_max_radps",
        ),
        ("-p domain_id:=233", "domain_id"),
        ("-p localhost_only:=1", "localhost_only"),
        ("-p use_sim_time:=true", "use_sim_time"),
        ("-p crafts:=medusa", "there is no parameter crafts"),
        ("-p auvs:=[red,red]", "auvs"),
    ] {
        let error = settings(&format!("--ros-args -p craft:=medusa {ORIGIN} {line}")).expect_err("is wrong");
        assert!(error.to_string().contains(said), "{line}: {error}");
    }
    let harmless = format!("--ros-args -p craft:=medusa -p use_sim_time:=false {ORIGIN}");
    assert!(settings(&harmless).is_ok());
}
