"""A law of your own (docs/own-law.md): pursuit of the AUV that the goal tracks, led by its velocity. Standard library only."""

import json
import math
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


def law(snapshot, gain_per_s=0.15):
    asc, water = snapshot["asc"], snapshot.get("current", {"north_mps": 0.0, "east_mps": 0.0})
    auv = next(auv["state"] for auv in snapshot["auvs"] if auv["id"] == snapshot["goal"]["auv"])
    north = gain_per_s * (auv["north_m"] - asc["north_m"]) + auv["speed_mps"] * math.cos(auv["course_rad"])
    east = gain_per_s * (auv["east_m"] - asc["east_m"]) + auv["speed_mps"] * math.sin(auv["course_rad"])
    north, east = north - water["north_mps"], east - water["east_mps"]  # through the water
    return {"speed_mps": math.hypot(north, east), "heading_rad": math.atan2(east, north)}


class Law(BaseHTTPRequestHandler):
    protocol_version, wbufsize = "HTTP/1.1", -1  # keeps connections, and sends each answer at once

    def do_POST(self):
        answer = json.dumps(law(json.loads(self.rfile.read(int(self.headers["content-length"]))))).encode()
        self.send_response(200)
        self.send_header("content-length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

    log_request = lambda *_: None  # noqa: E731


ThreadingHTTPServer(("127.0.0.1", 8000), Law).serve_forever()
