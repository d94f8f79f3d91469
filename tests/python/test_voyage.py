"""The voyage without a craft: what compose.yaml starts, and the same parts without containers (packaging/voyage).

PILOTFISH is the path of the program. No container engine is needed: the files are read, and the script is run.
"""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
import yaml

from program import program

ROOT = Path(__file__).resolve().parents[2]
COMPOSE = yaml.safe_load((ROOT / "compose.yaml").read_text(encoding="utf-8"))
CONTAINERFILE = (ROOT / "packaging" / "Containerfile").read_text(encoding="utf-8")
VOYAGE = ROOT / "packaging" / "voyage"
STAGES = re.findall(r"^FROM \S+ AS (\w+)$", CONTAINERFILE, re.M)
# Of the issue: a followed AUV on the page within a minute.
WITHIN_S = 60


def test_every_part_of_the_voyage_has_a_container() -> None:
    parts = re.findall(r"^(\w+)\)$", VOYAGE.read_text(encoding="utf-8"), re.M)
    assert parts == [*COMPOSE["services"], "all"]
    for name, service in COMPOSE["services"].items():
        assert service["entrypoint"] == ["/usr/share/pilotfish/packaging/voyage", name]
        assert {key for key in service["environment"]} == {"VOYAGE_LISTEN", "VOYAGE_SERVICE", "VOYAGE_BOAT", "VOYAGE_BRIDGE"}
        # Names of machines are names of containers.
        assert {service["environment"][f"VOYAGE_{part.upper()}"] for part in COMPOSE["services"]} == set(COMPOSE["services"])
        assert set(service.get("depends_on", [])) <= set(COMPOSE["services"])
        # The service has no tokens: nothing of it is published to a network.
        assert all(port.startswith("127.0.0.1:") for port in service.get("ports", []))
        for volume in service.get("volumes", []):
            name, place = volume.split(":")
            assert name in COMPOSE["volumes"] and f"VOLUME {place}" in CONTAINERFILE


def test_images_are_built_from_stages_and_files_that_exist() -> None:
    built = {service["image"] for service in COMPOSE["services"].values() if "build" in service}
    assert built == {service["image"] for service in COMPOSE["services"].values()}
    for service in COMPOSE["services"].values():
        if "build" in service:
            assert (ROOT / service["build"]["dockerfile"]).exists() and service["build"]["target"] in STAGES
    sent = (ROOT / "packaging" / "Containerfile.dockerignore").read_text(encoding="utf-8").split()
    copied = [word for line in re.findall(r"^COPY (?!--from)(.*)$", CONTAINERFILE, re.M) for word in line.split()[:-1]]
    for name in copied:
        assert (ROOT / name).exists(), name
        assert name == "." or any(Path(f"/{name}").match(f"{rule[1:]}") or f"/{name}".startswith(f"{rule[1:]}/") for rule in sent if rule != "*"), name
    # The last stage is what a build without a target makes.
    assert STAGES[-1] == "program"


def test_labels_are_what_registries_and_blueos_read() -> None:
    labels = dict(re.findall(r"""([\w.]+)=(?:"|')(.*?)(?:"|')(?: \\)?$""", CONTAINERFILE[CONTAINERFILE.index("LABEL") :], re.M))
    version = re.search(r"ARG VERSION=(\S+)", CONTAINERFILE)[1]
    assert f'version = "{version}"' in (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    assert labels["org.opencontainers.image.licenses"] == "MIT OR Apache-2.0"
    permissions = json.loads(labels["permissions"])
    [port] = permissions["ExposedPorts"]
    assert f"EXPOSE {port.split('/')[0]}" in CONTAINERFILE and port in permissions["HostConfig"]["PortBindings"]
    [bind] = permissions["HostConfig"]["Binds"]
    assert f"VOLUME {bind.split(':')[1]}" in CONTAINERFILE
    assert json.loads(labels["authors"]) and json.loads(labels["company"])["name"]


def free_port(kind: int = socket.SOCK_STREAM) -> str:
    with socket.socket(type=kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


def answer(url: str) -> dict:
    with urllib.request.urlopen(url, timeout=5) as body:
        return json.load(body)


@pytest.mark.soak
def test_a_followed_auv_is_on_the_page_within_a_minute(tmp_path: Path) -> None:
    (tmp_path / "pilotfish").symlink_to(program())
    port = free_port()
    env = {name: value for name, value in os.environ.items() if not name.startswith("PILOTFISH")}
    env |= {"PATH": f"{tmp_path}:{Path(sys.executable).parent}:{env['PATH']}", "PILOTFISH_DATA": str(tmp_path / "data")}
    env |= {"VOYAGE_PORT": port, "VOYAGE_MAVLINK": free_port(socket.SOCK_DGRAM), "VOYAGE_MODEM": free_port()}
    begun = time.monotonic()
    with (tmp_path / "said").open("w") as said:
        voyage = subprocess.Popen([VOYAGE, "all"], env=env, stdout=said, stderr=said, start_new_session=True)
    try:
        state, heard = "", {}
        while not (state == "steering" and {"auv-1", "auv-2"} <= set(heard)):
            assert time.monotonic() - begun < WITHIN_S, (state, heard, (tmp_path / "said").read_text()[-3000:])
            time.sleep(1)
            try:
                missions = answer(f"http://127.0.0.1:{port}/v1/missions")["missions"]
            except OSError:
                continue
            if missions and "plan" in missions[0]:
                state, heard = missions[0].get("steering", {}).get("state", ""), missions[0]["plan"]["heard_s"]
        print(f"steering after {time.monotonic() - begun:.0f} s")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5) as page:
            assert b"Pilotfish" in page.read()
    finally:
        voyage.send_signal(signal.SIGTERM)
        voyage.wait(timeout=30)
    # The boat, the bridge and the service ended with it.
    with pytest.raises(ProcessLookupError):
        for _ in range(50):
            os.killpg(voyage.pid, 0)
            time.sleep(0.2)
