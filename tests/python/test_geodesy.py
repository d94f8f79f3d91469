"""Latitudes, longitudes and true bearings against PROJ: 10,000 positions through the program, in and out.

PILOTFISH is the path of the program.
"""

import json
import subprocess
import tempfile
import urllib.request

import numpy as np
import pyproj
import pytest

from program import program

AUVS = 16  # most in a request
N_POINTS = 10_000
NEAR_M, FAR_M = 20e3, 200e3
#: Of the projection, either way, m. Within 20 km the project promises 1 cm.
TOLERANCE_M = 1e-6
#: Farthest origin of the bearings, m, and what they may be off by.
ORIGIN_FAR_M = 600e3
TOLERANCE_DEG = 0.01
BATCH = 50


def answer_on_earth(folder, origin, places):
    """The estimates in the answer to AUVs at `places`, (longitude, latitude) in degrees."""
    state = {"depth_m": 1.0, "course_rad": 0.0, "speed_mps": 0.0}
    auvs = [
        {"id": f"auv-{i}", "state": state | {"lat_deg": lat, "lon_deg": lon}}
        for i, (lon, lat) in enumerate(places)
    ]
    asc = {"north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.2}
    snapshot = {
        "schema_version": "1.0",
        "t_s": 0.0,
        "origin": {"lat_deg": origin[1], "lon_deg": origin[0]},
        "asc": asc,
        "auvs": auvs,
        "goal": {"kind": "track", "auv": "auv-0"},
    }
    file = folder / "snapshot.json"
    file.write_text(json.dumps(snapshot))
    printed = subprocess.run([program(), "plan", file], check=True, capture_output=True, text=True)
    return [target["estimate"] for target in json.loads(printed.stdout)["targets"]]


@pytest.mark.parametrize(("most", "seed"), [(NEAR_M, 1), (FAR_M, 2)])
def test_positions_are_those_of_proj(tmp_path, most, seed):
    random = np.random.default_rng(seed)
    worst = worst_distance = 0.0
    special = [(0.0, 90.0), (0.0, -90.0), (180.0, 0.0), (-180.0, 60.0), (179.9999, -17.0)]
    for turn in range(N_POINTS // AUVS // 2):
        if turn < len(special):
            origin = special[turn]
        else:
            origin = (random.uniform(-180, 180), np.degrees(np.arcsin(random.uniform(-1, 1))))
        local = pyproj.Proj(proj="aeqd", lat_0=origin[1], lon_0=origin[0], ellps="WGS84")
        distance, bearing = random.uniform(0, most, AUVS), random.uniform(0, 2 * np.pi, AUVS)
        east, north = distance * np.sin(bearing), distance * np.cos(bearing)
        lon, lat = local(east, north, inverse=True)
        found = answer_on_earth(tmp_path, origin, zip(lon, lat, strict=True))
        got = np.array([[place["north_m"], place["east_m"]] for place in found])
        worst = max(worst, np.abs(got - np.column_stack([north, east])).max())
        geodesic = pyproj.Geod(ellps="WGS84")
        degrees = np.array([[place["lon_deg"], place["lat_deg"]] for place in found])
        back = geodesic.inv(lon, lat, degrees[:, 0], degrees[:, 1])[2]
        worst = max(worst, np.abs(back).max())
        # What no plane has: the distance between any two.
        apart = geodesic.inv(lon[:-1], lat[:-1], lon[1:], lat[1:])[2]
        flat = np.linalg.norm(np.diff(got, axis=0), axis=1)
        worst_distance = max(worst_distance, (flat - apart).max())
    print(f"up to {most / 1e3:.0f} km: {worst:.1e} m from PROJ; distances across {worst_distance:.3f} m too long")
    assert worst < TOLERANCE_M
    # As docs/coordinates.md has it: by s²/(6R²) of themselves at most, and two are up to twice `most` apart.
    assert 0 < worst_distance < 1.05 * most**2 / (6 * 6.371e6**2) * 2 * most


def chase(origin, craft, bearing, ahead):
    """A snapshot with the origin and the craft at (longitude, latitude), and an AUV ahead of it; all go along `bearing`, degrees."""
    course = np.radians(bearing)
    position = lambda place: {"lat_deg": place[1], "lon_deg": place[0]}  # noqa: E731
    auv = position(ahead) | {"depth_m": 5.0, "course_rad": course, "speed_mps": 0.5}
    return {
        "schema_version": "1.0",
        "t_s": 0.0,
        "origin": position(origin),
        "asc": position(craft) | {"heading_rad": course, "speed_mps": 0.5},
        "craft": {"preset": "medusa"},
        "auvs": [{"id": "a", "state": auv}],
        "goal": {"kind": "track", "auv": "a"},
        "current": {"north_mps": 0.0, "east_mps": 0.0},
    }


def off(bearing, expected):
    """How far a bearing is from the expected one, degrees."""
    return abs((bearing - expected + 180) % 360 - 180)


def test_bearings_are_true_at_the_craft_wherever_the_origin_is():
    random, geodesic = np.random.default_rng(3), pyproj.Geod(ellps="WGS84")
    command = [program(), "serve", "--port", "0", "--log", "warn"]
    worst = {"reference": 0.0, "line of sight": 0.0, "trajectory": 0.0}
    with tempfile.TemporaryDirectory() as data:
        server = subprocess.Popen([*command, "--data", data], stdout=subprocess.PIPE, text=True)
        try:
            url = "http://" + server.stdout.readline().strip().rpartition("http://")[2]
            for _ in range(N_POINTS // BATCH):
                bearings, snapshots = random.uniform(0, 360, BATCH), []
                for bearing in bearings:
                    craft = (random.uniform(-180, 180), np.degrees(np.arcsin(random.uniform(-0.98, 0.98))))
                    far = ORIGIN_FAR_M * np.sqrt(random.uniform())
                    origin = geodesic.fwd(*craft, random.uniform(0, 360), far)[:2]
                    ahead = geodesic.fwd(*craft, bearing, random.uniform(20, 1000))[:2]
                    snapshots.append(chase(origin, craft, bearing, ahead))
                body = json.dumps({"requests": snapshots}).encode()
                request = urllib.request.Request(f"{url}/v1/plan/batch", body, {"content-type": "application/json"})
                with urllib.request.urlopen(request) as answer:
                    answers = json.load(answer)["answers"]
                for bearing, item in zip(bearings, answers, strict=True):
                    plan = item["plan"]
                    first, last = plan["trajectory"][0], plan["trajectory"][-1]
                    places = [end[name] for end in (first, last) for name in ("lon_deg", "lat_deg")]
                    for name, found in [
                        ("reference", plan["reference"]["heading_deg"]),
                        ("line of sight", np.degrees(plan["baseline"]["heading_rad"])),
                        ("trajectory", geodesic.inv(*places)[0]),
                    ]:
                        worst[name] = max(worst[name], off(found, bearing))
        finally:
            server.terminate()
            server.wait()
    print(", ".join(f"{name} {degrees:.4f}°" for name, degrees in worst.items()))
    assert max(worst.values()) < TOLERANCE_DEG, worst
