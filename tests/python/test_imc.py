"""The codec of IMC against imcpy: random messages each way, equal in every field.

Builds the example `imc_for_tests` of the bridge, or takes the one that IMC_ECHO names. imcpy has a wheel for CPython
3.11 (`pip install imcpy`); without it nothing is checked.
"""

import json
import os
import random
import struct
import subprocess
from pathlib import Path as File

import pytest

imcpy = pytest.importorskip("imcpy")

ROOT = File(__file__).resolve().parents[2]
N = int(os.environ.get("IMC_MESSAGES", "4000"))
SEED = 60
FOLLOW, SPEED, DEPTH, REFERENCE = "FollowReference", "DesiredSpeed", "DesiredZ", "Reference"
U8, U16, U32, I32, F32, F64, TEXT = ["u8", "u16", "u32", "i32", "f32", "f64", "text"]


def fields(text, kind):
    return dict.fromkeys(text.split(), kind)


#: Fields in any order: the order of bytes is what is compared.
MESSAGES = {
    "LogBookEntry": {"type": 4, "htime": F64, "context": TEXT, "text": TEXT},
    "Heartbeat": {},
    "Announce": {
        "sys_name": TEXT,
        "sys_type": 9,
        "owner": U16,
        "lat": F64,
        "lon": F64,
        "height": F32,
        "services": TEXT,
    },
    "LblRange": {"id": U8, "range": F32},
    "EstimatedState": fields("lat lon", F64) | fields("height x y z phi theta psi u v w vx vy vz p q r depth alt", F32),
    "NavigationUncertainty": fields("x y z phi theta psi p q r u v w bias_psi bias_r", F32),
    "DesiredHeading": {"value": F64},
    DEPTH: {"value": F32, "z_units": 4},
    SPEED: {"value": F64, "speed_units": 3},
    FOLLOW: {"control_src": U16, "control_ent": U8, "timeout": F32, "loiter_radius": F32, "altitude_interval": F32},
    REFERENCE: {"flags": U8, "speed": [SPEED], "z": [DEPTH], "lat": F64, "lon": F64, "radius": F32},
    "FollowRefState": {"control_src": U16, "control_ent": U8, "reference": [REFERENCE], "state": 6, "proximity": U8},
    "VehicleState": {
        "op_mode": 6,
        "error_count": U8,
        "error_ents": TEXT,
        "maneuver_type": U16,
        "maneuver_stime": F64,
        "maneuver_eta": U16,
        "control_loops": U32,
        "flags": U8,
        "last_error": TEXT,
        "last_error_time": F64,
    },
    "PlanControl": {
        "type": 4,
        "op": 4,
        "request_id": U16,
        "plan_id": TEXT,
        "flags": U16,
        "arg": [FOLLOW],
        "info": TEXT,
    },
    "PlanControlState": {
        "state": 4,
        "plan_id": TEXT,
        "plan_eta": I32,
        "plan_progress": F32,
        "man_id": TEXT,
        "man_type": U16,
        "man_eta": I32,
        "last_outcome": 3,
    },
    "RemoteSensorInfo": fields("id sensor_class data", TEXT) | fields("lat lon", F64) | fields("alt heading", F32),
    "UamRxRange": {"seq": U16, "sys": TEXT, "value": F32},
    "UsblPositionExtended": {"target": TEXT} | fields("x y z n e d phi theta psi accuracy", F32),
    "UsblFixExtended": {"target": TEXT, "lat": F64, "lon": F64, "z_units": 4, "z": F32, "accuracy": F32},
    "AisInfo": fields("msg_type sensor_class mmsi callsign name", TEXT)
    | {"nav_status": U8, "type_and_cargo": U8, "lat": F64, "lon": F64}
    | fields("course speed dist a b c d draught", F32),
}
HEADER = {
    "time_s": "timestamp",
    "source": "src",
    "source_entity": "src_ent",
    "destination": "dst",
    "destination_entity": "dst_ent",
}
INTEGERS = {U8: (0, 255), U16: (0, 65535), U32: (0, 2**32 - 1), I32: (-(2**31), 2**31 - 1)}


def single(value):
    """The nearest number of four bytes."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def draw(rng, kind):
    """A value of the kind: a number below it, a text, or a message or None."""
    if isinstance(kind, int):
        return rng.randrange(kind)
    if isinstance(kind, list):
        return None if rng.random() < 0.3 else drawn(rng, kind[0])
    if kind in INTEGERS:
        return rng.randint(*INTEGERS[kind])
    if kind == TEXT:
        return "".join(rng.choices("abcXYZ 019-_;:/äß€", k=rng.randrange(30)))
    value = rng.choice([0.0, rng.uniform(-1.0, 1.0), rng.gauss(0.0, 1e5), rng.uniform(-1e-30, 1e-30)])
    return single(value) if kind == F32 else value


def drawn(rng, name):
    return {field: draw(rng, kind) for field, kind in MESSAGES[name].items()}


def theirs(name, values):
    """imcpy's message of these values."""
    message = getattr(imcpy, name)()
    for field, value in values.items():
        kind = MESSAGES[name][field]
        if isinstance(kind, list):
            if value is not None:
                setattr(message, field, theirs(kind[0], value))
        else:
            setattr(message, field, type(getattr(message, field))(value) if isinstance(kind, int) else value)
    return message


def values_of(name, message):
    """The values of imcpy's message."""
    values = {}
    for field, kind in MESSAGES[name].items():
        if isinstance(kind, list):
            try:
                inner = getattr(message, field)
            except (RuntimeError, ValueError):
                inner = None
            values[field] = None if inner is None else values_of(kind[0], inner)
        else:
            value = getattr(message, field)
            values[field] = int(value) if isinstance(kind, int) else value
    return values


def ours(name, values):
    """The same as the example has it: `type` is a word of Rust."""
    own = {"kind" if field == "type" else field: value for field, value in values.items()}
    for field, kind in MESSAGES[name].items():
        if isinstance(kind, list) and values[field] is not None:
            own[field] = ours(kind[0], values[field])
    return own


@pytest.fixture(scope="module")
def cases():
    """Messages of all kinds in turn, with headers."""
    rng = random.Random(SEED)
    names = list(MESSAGES)
    return [
        (
            {
                "time_s": rng.uniform(0.0, 2e9),
                "source": rng.randrange(65536),
                "source_entity": rng.randrange(256),
                "destination": rng.randrange(65536),
                "destination_entity": rng.randrange(256),
            },
            names[index % len(names)],
            drawn(rng, names[index % len(names)]),
        )
        for index in range(N)
    ]


@pytest.fixture(scope="module")
def echo():
    """Path of the example."""
    if named := os.environ.get("IMC_ECHO"):
        return File(named)
    build = ["cargo", "build", "--quiet", "--workspace", "--example", "imc_for_tests"]
    subprocess.run(build, cwd=ROOT, check=True)
    return ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "debug" / "examples" / "imc_for_tests"


def run(echo, arguments, given):
    return subprocess.run([echo, *arguments], input=given, stdout=subprocess.PIPE, check=True).stdout


def test_messages_of_imcpy_are_read_equal_in_every_field(cases, echo):
    stream = bytearray()
    for header, name, values in cases:
        message = theirs(name, values)
        for own, their in HEADER.items():
            setattr(message, their, header[own])
        stream += message.serialize()
    *read, rejected = map(json.loads, run(echo, ["read"], bytes(stream)).splitlines())
    assert rejected == {"rejected": ""}
    assert len(read) == len(cases)
    for found, (header, name, values) in zip(read, cases, strict=True):
        assert rounded(found) == {"header": header, "message": {name: ours(name, values)}}


@pytest.mark.parametrize("order", ["little", "big"])
def test_messages_for_imcpy_are_read_equal_in_every_field(cases, echo, order):
    lines = "\n".join(json.dumps([header, {name: ours(name, values)}]) for header, name, values in cases)
    stream = run(echo, ["write", order], lines.encode())
    at = 0
    for header, name, values in cases:
        size = int.from_bytes(stream[at + 4 : at + 6], order) + 22
        message = imcpy.Packet.deserialize(stream[at : at + size])
        at += size
        assert type(message).__name__ == name
        assert {own: getattr(message, their) for own, their in HEADER.items()} == header
        assert values_of(name, message) == shown(values)
    assert at == len(stream)


def shown(values):
    """Values as imcpy shows those that it has read: other bytes than ASCII are replaced."""
    if isinstance(values, dict):
        return {field: shown(value) for field, value in values.items()}
    return values.encode().decode("ascii", "replace") if isinstance(values, str) else values


def rounded(found):
    """Numbers of four bytes as Python has them: JSON has their shortest decimals."""
    [(name, values)] = found["message"].items()

    def of(name, values):
        kinds = {"kind" if field == "type" else field: kind for field, kind in MESSAGES[name].items()}
        return {
            field: single(value)
            if kinds[field] == F32
            else of(kinds[field][0], value)
            if isinstance(kinds[field], list) and value is not None
            else value
            for field, value in values.items()
        }

    return {"header": found["header"], "message": {name: of(name, values)}}
