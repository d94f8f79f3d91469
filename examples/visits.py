"""One surface craft serves five AUVs at rest. Kill the server on the way, and start it again: visits.py [URL [SECONDS]]"""

import math
import sys
import time

import pilotfish

places = {"auv-1": (60, 0), "auv-2": (0, 70), "auv-3": (-80, 20), "auv-4": (-30, -90), "auv-5": (90, 90)}  # m
url = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080"
duration_s = float(sys.argv[2]) if len(sys.argv) > 2 else 300.0
live = {"auvs": [{"id": auv} for auv in places], "goal": {"kind": "visit", "auvs": list(places)}}

with pilotfish.Client(url, patience_s=60.0) as client, client.create_mission(live=live, title="five AUVs") as mission:
    mission.run()
    began, north, east, speed, heading = time.time(), 0.0, 0.0, 0.0, 0.0
    while time.time() < began + duration_s:
        now = time.time()
        fixes = {auv: [{"t_s": now, "north_m": n, "east_m": e, "sigma_m": 1.0}] for auv, (n, e) in places.items()}
        state = {"north_m": north, "east_m": east, "heading_rad": heading, "speed_mps": speed}
        word = {"t_s": now, "state": "steering"}  # for the page: nobody else knows it
        accepted = mission.report(auvs=fixes, asc=[{"t_s": now, "state": state}], steering=[word])
        plan = mission.reference(wait_s=2.0, after=accepted["sequence"])["plan"]
        print(f"{now - began:5.0f} s: {plan['schedule']['sentence']}", flush=True)
        time.sleep(max(0.0, now + 1.0 - time.time()))
        # The craft follows the reference exactly.
        speed, heading = plan["reference"]["speed_mps"], plan["reference"]["heading_rad"]
        north += speed * math.cos(heading) * (time.time() - now)
        east += speed * math.sin(heading) * (time.time() - now)
