"""Launches the node and, unless serve:=false, a Pilotfish service that keeps the mission.

ros2 launch pilotfish_ros2 pilotfish.launch.py params_file:=my.yaml namespace:=fleet
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    default_params = PathJoinSubstitution([FindPackageShare("pilotfish_ros2"), "config", "pilotfish.yaml"])
    return LaunchDescription(
        [
            DeclareLaunchArgument("params_file", default_value=default_params, description="parameters of the node"),
            DeclareLaunchArgument("namespace", default_value="", description="namespace of node and topics"),
            DeclareLaunchArgument("serve", default_value="true", description="whether to start pilotfish serve"),
            DeclareLaunchArgument("data", default_value="pilotfish-data", description="directory of that service"),
            ExecuteProcess(
                cmd=["pilotfish", "serve", "--data", LaunchConfiguration("data")],
                condition=IfCondition(LaunchConfiguration("serve")),
                output="screen",
            ),
            Node(
                package="pilotfish_ros2",
                executable="node",
                name="pilotfish",
                namespace=LaunchConfiguration("namespace"),
                parameters=[LaunchConfiguration("params_file")],
                # Example: odometry of robot_localization, and a driver with another name for its reference.
                # remappings=[("medusa/odom", "/medusa/odometry/filtered"), ("medusa/cmd_vel", "/medusa/cmd")],
                output="screen",
            ),
        ]
    )
