"""Services under test, of the program that PILOTFISH names."""

import os
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from pilotfish import Client


def program() -> str:
    """Path of the program; skips the test where none is named."""
    path = os.environ.get("PILOTFISH")
    if path is None:
        pytest.skip("PILOTFISH does not say where the program is")
    return path


class Service:
    """A service of its own data and port, that can be killed and started again."""

    def __init__(self, data: Path) -> None:
        self.data = data
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        self.process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        command = [program(), "serve", "--data", str(self.data), "--port", str(self.port), "--log", "warn"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        # Its greeting: it listens.
        assert self.url in self.process.stdout.readline()

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()
            self.process = None


@pytest.fixture
def own_service(tmp_path: Path) -> Iterator[Service]:
    """A service of this test alone."""
    service = Service(tmp_path / "data")
    service.start()
    yield service
    service.kill()


@pytest.fixture(scope="session")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Where a service is that all tests share."""
    service = Service(tmp_path_factory.mktemp("service") / "data")
    service.start()
    yield service.url
    service.kill()


@pytest.fixture
def client(url: str) -> Iterator[Client]:
    with Client(url) as client:
        yield client
