"""Build description for `colcon build` (ament_python)."""

from setuptools import setup

PACKAGE = "pilotfish_ros2"

setup(
    name=PACKAGE,
    version="0.2.0",
    description="Follows a live mission of Pilotfish: odometry in, velocity reference and path out.",
    license="MIT OR Apache-2.0",
    # A link in this folder leads to the Python client, which is not on rosdep.
    packages=[PACKAGE, f"{PACKAGE}.pilotfish"],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", ["launch/pilotfish.launch.py"]),
        (f"share/{PACKAGE}/config", ["config/pilotfish.yaml"]),
    ],
    install_requires=["setuptools", "httpx", "numpy"],
    zip_safe=True,
    entry_points={"console_scripts": [f"node = {PACKAGE}.node:main"]},
)
