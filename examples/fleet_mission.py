"""Three craft share six AUVs in one mission, for as long as this runs; started again, it continues the same mission.

cargo run --release -- serve --data /tmp/missions    # in a terminal of its own; pip install ./api/python in this one
python3 examples/fleet_mission.py [DURATION [ADDRESS [TOKEN]]]    # 60 s, http://127.0.0.1:8080, without a token
"""

import cmath
import math
import sys
import time

from pilotfish import Client

CRAFT = {f"asc-{i}": (complex(70 * i, 0), 0.0, 0.0) for i in range(3)}  # place (north, east), m; heading, rad; speed, m/s
AUVS, RATE = [f"auv-{i}" for i in range(6)], 10
END = time.time() + float(sys.argv[1] if len(sys.argv) > 1 else 60)

with Client(*sys.argv[2:]) as client:
    going = [mission for mission in client.missions() if mission["title"] == "fleet" and mission["status"] == "running"]
    craft = [{"id": name, "limits": {"speed_max_mps": 1.5}} for name in CRAFT]
    live = {"auvs": [{"id": auv} for auv in AUVS], "surface_craft": craft, "goal": {"kind": "visit", "auvs": AUVS}, "clock_rate": RATE}
    mission = client.mission(going[0]["id"]) if going else client.create_mission(title="fleet", live=live, finish_at_exit=False)
    created, served = mission.run()["created_s"], None
    while time.time() < END:
        now = created + RATE * (time.time() - created)
        lanes = {auv: (60.0 * i - 150, 80 * math.sin(now / 150 + i)) for i, auv in enumerate(AUVS)}
        mission.report(auvs={auv: [{"t_s": now, "north_m": n, "east_m": e, "sigma_m": 1}] for auv, (n, e) in lanes.items()})
        for name, (place, heading, speed) in CRAFT.items():
            if answer := mission.reference(craft=name):
                if served is None:  # where the craft is to be by the last plan before this began
                    place = complex(answer["plan"]["trajectory"][0]["north_m"], answer["plan"]["trajectory"][0]["east_m"])
                speed, heading = (answer["plan"]["reference"][of] for of in ("speed_mps", "heading_rad"))
            CRAFT[name] = (place + speed * cmath.exp(1j * heading) * RATE * 0.1, heading, speed)
            state = {"north_m": CRAFT[name][0].real, "east_m": CRAFT[name][0].imag, "heading_rad": heading, "speed_mps": speed}
            mission.report(craft=name, asc=[{"t_s": now, "state": state}])
        before, served = served, {one["id"]: one["auvs"] for one in mission.look()["surface_craft"]}
        if served != before:
            print(f"{now - created:6.0f} s  {served}", flush=True)
        time.sleep(max(0.0, 0.1 - time.time() % 0.1))
