"""Latitudes and longitudes against PROJ: 10,000 positions through the program, in and out.

PILOTFISH is the path of the program.
"""

import json
import subprocess

import numpy as np
import pyproj
import pytest

from program import program

AUVS = 16  # most in a request
N_POINTS = 10_000
NEAR_M, FAR_M = 20e3, 200e3
#: Of the projection, either way, m. Within 20 km the project promises 1 cm.
TOLERANCE_M = 1e-6


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
