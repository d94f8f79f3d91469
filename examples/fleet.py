"""Two surface craft share four AUVs through `POST /v1/plan`; one craft leaves after ten minutes."""

import math

from pilotfish import Client

SPEED_MPS = 1.5
AUVS = {"auv-1": (300.0, 0.0), "auv-2": (250.0, 120.0), "auv-3": (-300.0, 40.0), "auv-4": (-200.0, -150.0)}
craft = {"asc-1": [0.0, 60.0, 0.0], "asc-2": [0.0, -60.0, 0.0]}
client, answer, served = Client(), None, ""
for now in range(1200):
    if now == 600:
        del craft["asc-2"]
    auvs = [
        {"id": name, "state": {"north_m": n + 0.3 * now, "east_m": e, "depth_m": 10, "course_rad": 0, "speed_mps": 0.3}}
        for name, (n, e) in AUVS.items()
    ]
    fleet = [
        {
            "id": name,
            "asc": {"north_m": north, "east_m": east, "heading_rad": heading, "speed_mps": SPEED_MPS},
            "limits": {"speed_max_mps": SPEED_MPS},
        }
        for name, (north, east, heading) in craft.items()
    ]
    goal = {"kind": "visit", "auvs": list(AUVS)}
    request = {"schema_version": "1.0", "t_s": now, "surface_craft": fleet, "auvs": auvs, "goal": goal}
    answer = client.plan_fleet(request, answer)
    for one in answer["surface_craft"]:
        reference = one["plan"]["reference"]
        speed, heading = reference["speed_mps"], reference["heading_rad"]
        north, east, _ = craft[one["id"]]
        craft[one["id"]] = [north + speed * math.cos(heading), east + speed * math.sin(heading), heading]
    before, served = served, "; ".join(f"{one['id']}: {', '.join(one['auvs'])}" for one in answer["assignment"]["craft"])
    if served != before:
        print(f"{now:5} s  {served}")
