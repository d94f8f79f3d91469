"""The boat of examples/boat.py, which a first try of the bridge needs, is steered by it."""

import re
import socket
import subprocess
import sys
from pathlib import Path as File

import pytest

from program import program

BOAT = File(__file__).resolve().parents[2] / "examples" / "boat.py"
SETTLED = 20  # s: the origin is known after 4, and the boat is up to speed after 8 more


@pytest.mark.soak
def test_a_boat_that_the_bridge_steers_approaches_the_auv(tmp_path):
    with socket.socket(type=socket.SOCK_DGRAM) as wire:
        wire.bind(("127.0.0.1", 0))
        port = str(wire.getsockname()[1])
    craft = [
        "--connect",
        f"udp:127.0.0.1:{port}",
        "--auv",
        "2=auv-1",
        "--name",
        "rehearsal",
        "--data",
        tmp_path / "data",
    ]
    bridge = subprocess.Popen(
        [program(), "bridge", "mavlink", *craft], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        boat = [sys.executable, BOAT, "--port", port, "--duration", str(SETTLED + 1)]
        printed = subprocess.run(boat, capture_output=True, text=True, check=True).stdout
    finally:
        bridge.terminate()
        bridge.wait()
    speeds, distances = zip(*re.findall(r"([\d.]+) m/s.* ([\d.]+) m from", printed), strict=True)
    assert float(speeds[-1]) > 0.8, printed
    # It closes at more than half a metre per second from 10 s on.
    assert float(distances[-1]) < float(distances[2]) - 0.5 * (SETTLED - 10), printed
