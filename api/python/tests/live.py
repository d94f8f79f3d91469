"""A live mission that follows one AUV, and what is heard in it."""

import time

from pilotfish import types

LIVE: types.Live = {"auvs": [{"id": "auv-1"}], "goal": {"kind": "track", "auv": "auv-1"}}


def heard(north_m: float = 10.0) -> dict:
    """A fix of the AUV and a state of the surface craft, as of now."""
    now = time.time()
    state: types.Asc = {"north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.5}
    return {
        "auvs": {"auv-1": [{"t_s": now, "north_m": north_m, "east_m": 0.0, "sigma_m": 1.0}]},
        "asc": [{"t_s": now, "state": state}],
    }
