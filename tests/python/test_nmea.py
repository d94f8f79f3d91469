"""The NMEA 0183 adapter of the bridge against pynmea2: 4,000 sentences in, and what an autopilot is sent.

Builds the example `nmea_for_tests` of the bridge, or takes the one that NMEA_ECHO names.
"""

import json
import math
import os
import subprocess
from collections import Counter, defaultdict
from datetime import UTC, datetime, timedelta
from pathlib import Path as File

import numpy as np
import pynmea2
import pytest

ROOT = File(__file__).resolve().parents[2]
PER_KIND = 500
N_REFERENCES = 1_000
#: A second after midnight, so that times of day lie on both days.
RECEIVED = datetime(2026, 3, 14, 0, 0, 1, tzinfo=UTC)
TALKERS = ["GP", "GN", "GL", "GA", "GB", "II", "IN", "HE", "HC", "TI", "VW", "VD", "VM", "EC", "AG"]
#: m/s of a knot and of a km/h, by definition.
KNOT, KILOMETRE_PER_HOUR = 1852.0 / 3600.0, 1.0 / 3.6
#: Of the same decimal numbers, turned into SI by two programs.
TOLERANCE = 1e-12
#: Of times, s: pynmea2 cuts them to microseconds, and Unix time has steps of 0.24 µs.
TIME_TOLERANCE = 2e-6


class THS(pynmea2.TalkerSentence):
    """pynmea2 1.19 does not know it, nor the two below: to be declared is enough."""

    fields = (("True heading", "heading", float), ("Mode", "mode"))


HEADING_CONTROL = (
    ("Override", "override"),
    ("Commanded rudder angle", "rudder"),
    ("Commanded rudder direction", "rudder_dir"),
    ("Selected steering mode", "steering_mode"),
    ("Turn mode", "turn_mode"),
    ("Commanded rudder limit", "rudder_limit"),
    ("Commanded off-heading limit", "off_heading_limit"),
    ("Commanded radius of turn", "radius"),
    ("Commanded rate of turn", "rate"),
    ("Commanded heading to steer", "heading_to_steer", float),
    ("Commanded off-track limit", "off_track_limit"),
    ("Commanded track", "track"),
    ("Heading reference in use", "reference"),
)


class HTC(pynmea2.TalkerSentence):
    fields = (*HEADING_CONTROL, ("Sentence status", "status"))


class HTD(pynmea2.TalkerSentence):
    fields = (
        *HEADING_CONTROL,
        ("Rudder status", "rudder_status"),
        ("Off-heading status", "off_heading_status"),
        ("Off-track status", "off_track_status"),
        ("Vessel heading", "vessel_heading"),
    )


@pytest.fixture(scope="module")
def nmea_echo():
    """Path of the example."""
    if named := os.environ.get("NMEA_ECHO"):
        return File(named)
    # With the features of the whole workspace, as `cargo test` leaves it: `-p` alone compiles its dependencies again.
    build = ["cargo", "build", "--quiet", "--workspace", "--example", "nmea_for_tests"]
    subprocess.run(build, cwd=ROOT, check=True)
    target = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
    return target / "debug" / "examples" / "nmea_for_tests"


def run(nmea_echo, arguments, text):
    printed = subprocess.run([nmea_echo, *arguments], input=text, check=True, capture_output=True)
    return printed.stdout.decode("ascii").splitlines()


class Sentences:
    """Sentences of random numbers, as pynmea2 writes them."""

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)

    def number(self, low, high):
        """One with up to 3 decimals, with and without leading zeros."""
        decimals = self.random.integers(0, 4)
        width = self.random.choice([0, 5, 7])
        return f"{self.random.uniform(low, high):0{width}.{decimals}f}"

    def choice(self, *choices):
        return str(self.random.choice(choices))

    def place(self):
        decimals = self.random.integers(2, 8)
        lat_min, lon_min = (f"{x:0{3 + decimals}.{decimals}f}" for x in self.random.uniform(0, 59.99, 2))
        lat, lon = self.random.integers(0, 90), self.random.integers(0, 180)
        return [f"{lat:02}{lat_min}", self.choice("N", "S"), f"{lon:03}{lon_min}", self.choice("E", "W")]

    def time(self):
        at = RECEIVED + timedelta(seconds=self.random.uniform(-0.45, 1.45))
        decimals = self.random.integers(0, 4)
        fraction = f"{at.microsecond / 1e6:.6f}"[1 : 2 + decimals] if decimals else ""
        return at.strftime("%H%M%S") + fraction

    def sentence(self, kind):
        """One of `kind`; a tenth is not valid by its own status."""
        valid = self.random.random() > 0.1
        status = "A" if valid else "V"
        mode = self.choice("A", "D", "E", "F", "P", "R") if valid else "N"
        knots, angle = self.number(0, 60), self.number(0, 360)
        match kind:
            case "GGA":
                quality = self.choice("1", "2", "3", "4", "5", "6") if valid else "0"
                fields = [self.time(), *self.place(), quality, "09", "0.9", "1.5", "M", "46.9", "M", "", ""]
            case "RMC":
                fields = [self.time(), status, *self.place(), knots, angle, "140326", "", ""]
                # NMEA 0183 to 2.2, 2.3 and 4.1.
                fields += self.random.choice(np.array([[], [mode], [mode, "V"]], dtype=object))
            case "VTG":
                kmph = f"{float(knots) * 1.852:.2f}"
                fields = [angle, "T", "", "M", *self.choice_of([knots, "N", kmph, "K"], ["", "N", kmph, "K"]), mode]
            case "HDT":
                fields = [angle, "T"]
            case "THS":
                fields = [angle, self.choice("A", "E") if valid else "V"]
            case "ROT":
                fields = [self.number(-720, 720), status]
            case "VHW":
                speed = self.choice_of([knots, "N", "", "K"], ["", "N", knots, "K"], ["", "N", "", "K"])
                fields = [*self.choice_of([angle, "T"], ["", "T"]), self.number(0, 360), "M", *speed]
            case "VBW":
                fields = [self.number(-20, 20), self.number(-5, 5), status, self.number(-20, 20), "0.1", "A"]
        kind_of_sentence = pynmea2.TalkerSentence.sentence_types[kind]
        return kind_of_sentence(self.choice(*TALKERS), kind, fields)

    def choice_of(self, *choices):
        return choices[self.random.integers(len(choices))]


def ground_velocity(speed, course_deg):
    course = math.radians(course_deg)
    return "ground_velocity_mps", [speed * math.cos(course), speed * math.sin(course)]


def heading(degrees):
    return "heading_rad", [math.radians(degrees)]


def either_speed(knots, kmph):
    """m/s of two fields; none if both are empty."""
    if knots is not None:
        return float(knots) * KNOT
    return None if kmph is None else float(kmph) * KILOMETRE_PER_HOUR


def position(message):
    return "position_deg", [message.latitude, message.longitude]


def meaning(message):
    """What a sentence measures, from the values that pynmea2 parses, or why it measures nothing."""
    match message.sentence_type:
        case "GGA":
            return [position(message)] if message.gps_qual > 0 else "no fix"
        case "RMC":
            if message.status != "A" or message.mode_indicator == "N":
                return "no fix"
            return [position(message), ground_velocity(message.spd_over_grnd * KNOT, message.true_course)]
        case "VTG":
            if message.faa_mode == "N":
                return "no fix"
            speed = either_speed(message.spd_over_grnd_kts, message.spd_over_grnd_kmph)
            return [ground_velocity(speed, message.true_track)]
        case "HDT":
            return [heading(message.heading)]
        case "THS":
            return [heading(message.heading)] if message.mode in "AE" else "not valid"
        case "ROT":
            rate = math.radians(float(message.rate_of_turn)) / 60.0
            return [("yaw_rate_radps", [rate])] if message.is_valid else "not valid"
        case "VHW":
            surge = either_speed(message.water_speed_knots, message.water_speed_km)
            measured = [] if message.heading_true is None else [heading(message.heading_true)]
            measured += [] if surge is None else [("water_velocity_mps", [surge, 0.0])]
            return measured or "VHW without true heading and speed"
        case "VBW":
            velocity = [float(message.lon_water_spd) * KNOT, float(message.trans_water_spd) * KNOT]
            valid = message.data_validity_water_spd == "A"
            return [("water_velocity_mps", velocity)] if valid else "not valid"


def measured_at(message):
    """Unix time, s: the day nearest to the arrival."""
    if message.sentence_type not in {"GGA", "RMC"}:
        return RECEIVED.timestamp()
    days = [datetime.combine(RECEIVED + timedelta(days=day), message.timestamp).timestamp() for day in (-1, 0, 1)]
    return min(days, key=lambda at: abs(at - RECEIVED.timestamp()))


def assert_same(found, kind, values, line):
    assert found["kind"] == kind, line
    difference = np.subtract(found["values"], values)
    if kind == "heading_rad":
        difference = (difference + math.pi) % math.tau - math.pi
    assert np.abs(difference).max() < TOLERANCE, f"{line}: {found['values']} is not {values}"


def test_every_sentence_of_pynmea2_means_the_same_to_the_bridge(nmea_echo):
    sentences = Sentences(seed=1)
    kinds = ["GGA", "RMC", "VTG", "HDT", "THS", "ROT", "VHW", "VBW"] * PER_KIND
    lines = [str(sentences.sentence(kind)) for kind in kinds]
    text = "".join(f"{line}\r\n" for line in lines).encode("ascii")
    *measurements, last = map(json.loads, run(nmea_echo, ["read", str(RECEIVED.timestamp())], text))
    found = defaultdict(list)
    for measurement in measurements:
        found[measurement["line"]].append(measurement)
    refused, measured = Counter(), Counter()
    for number, line in enumerate(lines):
        message = pynmea2.parse(line, check=True)
        expected = meaning(message)
        if isinstance(expected, str):
            refused[expected] += 1
            expected = []
        assert len(found[number]) == len(expected), line
        for measurement, (kind, values) in zip(found[number], expected, strict=True):
            assert_same(measurement, kind, values, line)
            assert abs(measurement["t_s"] - measured_at(message)) < TIME_TOLERANCE, line
            measured[message.sentence_type] += 1
    assert last["refused"] == refused
    assert min(measured.values()) > PER_KIND // 2, measured
    assert set(refused) == {"no fix", "not valid", "VHW without true heading and speed"}
    print(f"{len(lines)} sentences, {sum(measured.values())} measurements, {refused.total()} refused")


def test_pynmea2_reads_what_an_autopilot_is_sent(nmea_echo):
    random = np.random.default_rng(2)
    headings = [0.0, -0.0, math.pi, -math.pi, -1e-9, *random.uniform(-math.pi, math.pi, N_REFERENCES)]
    speeds = random.uniform(0.0, 5.0, len(headings))
    text = "".join(f"{psi!r} {speed!r}\n" for psi, speed in zip(map(float, headings), map(float, speeds), strict=True))
    lines = run(nmea_echo, ["write"], text.encode("ascii"))
    assert len(lines) == 4 * len(headings)
    # 82 with the line end is the most that NMEA 0183 allows.
    assert max(map(len, lines)) <= 80
    for sent, psi, speed in zip(zip(*[iter(lines)] * 4, strict=True), headings, speeds, strict=True):
        htc, htd, apb, own = (pynmea2.parse(line, check=True) for line in sent)
        assert (htc.sentence_type, htd.sentence_type, apb.sentence_type) == ("HTC", "HTD", "APB")
        for control in (htc, htd):
            assert (control.override, control.steering_mode, control.turn_mode) == ("V", "H", "N")
            assert control.reference == "T"
        assert htc.status == "C"
        assert len(htd.data) == len(HTD.fields)
        assert (apb.status_gen, apb.status_cycle_lock) == ("A", "A")
        assert (float(apb.cross_track_err_mag), apb.cross_track_unit) == (0.0, "N")
        assert (apb.arr_circle_entered, apb.perp_passed) == ("V", "V")
        assert apb.bearing_type == apb.bearing_pres_dest_type == apb.heading_to_dest_type == "T"
        assert (own.manufacturer, own.data[0], own.data[2], own.data[4]) == ("PLT", "F", "T", "M")
        bearings = [apb.bearing_to_dest, apb.bearing_pres_dest, apb.heading_to_dest, own.data[1]]
        for degrees in [htc.heading_to_steer, htd.heading_to_steer, *map(float, bearings)]:
            assert 0.0 <= degrees < 360.0
            # Half of the last digit, 0.1°.
            assert abs((degrees - math.degrees(psi) + 180.0) % 360.0 - 180.0) <= 0.05 + 1e-9
        assert abs(float(own.data[3]) - speed) <= 0.005 + 1e-9


def test_what_an_autopilot_is_sent_is_no_measurement(nmea_echo):
    sent = "\n".join(run(nmea_echo, ["write"], b"1.0 0.5\n"))
    (last,) = run(nmea_echo, ["read", "0.0"], sent.encode("ascii"))
    assert json.loads(last) == {"refused": {"unused sentence": 4}}
