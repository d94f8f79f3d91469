"""Services that share their missions through PostgreSQL with a synchronous standby, and proxies that cut them off."""

import asyncio
import contextlib
import os
import random
import shutil
import signal
import socket
import subprocess
import threading
import time
from pathlib import Path as File

SERVICES = 3
PASSWORD, DATABASE, HOST = "a-secret-of-the-checker", "pilotfish", "127.0.0.1"
FAKETIME = File("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1")
# A link that is cut says nothing: timeouts are seconds. Commit times show whether an append came after the next owner.
SETTINGS = """\
listen_addresses = '127.0.0.1'
port = {port}
unix_socket_directories = '{folder}'
max_connections = 200
shared_buffers = 64MB
synchronous_commit = on
synchronous_standby_names = '{standby}'
track_commit_timestamp = on
wal_keep_size = 256MB
wal_sender_timeout = 3s
wal_receiver_timeout = 3s
wal_retrieve_retry_interval = 200ms
log_min_messages = log
"""


def free_ports(count: int) -> list[int]:
    """Free ports that no connection takes by itself while a server is away."""
    found: list[int] = []
    while len(found) < count:
        port = random.randrange(20_000, 32_000)
        with contextlib.suppress(OSError), socket.create_server((HOST, port)):
            found.append(port)
    return found


def until(true: object, seconds: float, what: str) -> None:
    """Waits until `true()`; fails with `what` after so many seconds."""
    end = time.monotonic() + seconds
    while not true():
        if end < time.monotonic():
            raise TimeoutError(f"not within {seconds} s: {what}")
        time.sleep(0.05)


class Proxies:
    """TCP proxies in a thread of their own. One that is cut keeps connections and passes nothing on."""

    def __init__(self) -> None:
        self.loop, self.gates = asyncio.new_event_loop(), {}
        threading.Thread(target=self.loop.run_forever, daemon=True).start()

    def open(self, target: int) -> int:
        """A proxy before the port `target`; returns its own port."""

        async def start() -> int:
            gate = asyncio.Event()
            gate.set()

            async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                with contextlib.suppress(OSError):
                    await gate.wait()
                    far_reader, far_writer = await asyncio.open_connection(HOST, target)
                    await asyncio.gather(pump(reader, far_writer), pump(far_reader, writer))
                writer.transport.abort()

            async def pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                with contextlib.suppress(OSError):
                    while data := await reader.read(1 << 16):
                        await gate.wait()
                        writer.write(data)
                        await writer.drain()
                await gate.wait()
                writer.close()

            server = await asyncio.start_server(serve, HOST, 0)
            port = server.sockets[0].getsockname()[1]
            self.gates[port] = gate
            return port

        return asyncio.run_coroutine_threadsafe(start(), self.loop).result()

    def cut(self, *ports: int) -> None:
        for port in ports:
            self.loop.call_soon_threadsafe(self.gates[port].clear)

    def mend(self, *ports: int) -> None:
        for port in ports:
            self.loop.call_soon_threadsafe(self.gates[port].set)


class Node:
    """One PostgreSQL server."""

    user = "postgres" if os.geteuid() == 0 else None  # the server refuses to run as root

    def __init__(self, folder: File, port: int):
        self.folder, self.port, self.process = folder, port, None
        found = sorted(File("/usr/lib/postgresql").glob("*/bin/postgres"), key=lambda path: int(path.parts[4]))
        self.bin = found[-1].parent if found else File(shutil.which("postgres") or "/missing").parent

    def run(self, program: str, *arguments: object) -> str:
        done = subprocess.run(
            [self.bin / program, *map(str, arguments)],
            **self.options(stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True),
        )
        if done.returncode:
            raise RuntimeError(f"{program}: {done.stderr.strip()}")
        return done.stdout

    def options(self, **more: object) -> dict:
        """Arguments of a process of the server's user."""
        identity = {"user": self.user, "group": self.user, "extra_groups": []} if self.user else {}
        return {"env": os.environ | {"PGPASSWORD": PASSWORD}, "cwd": "/", **identity, **more}

    def configure(self, standby: str) -> None:
        text = SETTINGS.format(port=self.port, folder=self.folder.parent, standby=standby)
        (self.folder / "conf.d").mkdir(exist_ok=True)
        (self.folder / "conf.d/pair.conf").write_text(text)

    def make(self) -> None:
        password = self.folder.parent / "password"
        password.write_text(PASSWORD)
        self.run(
            "initdb", "-D", self.folder, "-U", "pilotfish", "-A", "scram-sha-256", "--pwfile", password, "-E", "UTF8"
        )
        with (self.folder / "postgresql.conf").open("a") as file:
            file.write("include_dir = 'conf.d'\n")
        self.configure("")
        self.start()
        self.sql(f"CREATE DATABASE {DATABASE}", "postgres")
        for number in range(SERVICES):  # by whose names the database tells services apart
            self.sql(f"CREATE ROLE s{number} SUPERUSER LOGIN PASSWORD '{PASSWORD}'", "postgres")

    def follow(self, primary: "Node") -> None:
        """A new standby of `primary`."""
        shutil.rmtree(self.folder, ignore_errors=True)
        source = f"host={HOST} port={primary.port} user=pilotfish dbname=postgres application_name=standby"
        self.run("pg_basebackup", "-d", source, "-D", self.folder, "-R", "-X", "stream", "-c", "fast")
        self.configure("")
        self.start()

    def start(self) -> None:
        log = (self.folder.parent / f"{self.folder.name}.log").open("ab")
        self.process = subprocess.Popen(
            [self.bin / "postgres", "-D", self.folder], **self.options(stdout=log, stderr=log, start_new_session=True)
        )
        until(self.answers, 60, f"PostgreSQL starts: {log.name}")

    def answers(self) -> bool:
        with contextlib.suppress(RuntimeError):
            return self.sql("SELECT 1", "postgres") == "1"
        return False

    def everyone(self) -> list[int]:
        """The server's processes: those of a killed one would run on until they notice."""
        children = File(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return [self.process.pid, *map(int, children.read_text().split())] if children.exists() else []

    def send(self, number: int) -> None:
        for process in self.everyone():
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, number)

    def kill(self) -> None:
        self.send(signal.SIGKILL)
        self.process.wait()

    def sql(self, text: str, database: str = DATABASE) -> str:
        flags = ["-X", "-A", "-t", "-q", "-v", "ON_ERROR_STOP=1"]
        where = f"host={HOST} port={self.port} user=pilotfish dbname={database} connect_timeout=3"
        return self.run("psql", *flags, "-d", where, "-c", text).strip()


class Pair:
    """A primary and its synchronous standby."""

    def __init__(self, folder: File):
        folder.mkdir()
        if Node.user:
            shutil.chown(folder, Node.user, Node.user)
        self.nodes = [Node(folder / name, port) for name, port in zip("ab", free_ports(2), strict=True)]
        self.primary, self.standby = self.nodes
        self.primary.make()
        self.add_standby()

    def add_standby(self) -> None:
        self.standby.follow(self.primary)
        until(lambda: self.standby_state() == "streaming", 60, "the standby streams")
        self.set_synchronous("standby")
        until(self.is_synchronous, 60, "the standby is synchronous")

    def set_synchronous(self, standby: str) -> None:
        self.primary.configure(standby)
        self.primary.sql("SELECT pg_reload_conf()", "postgres")

    def standby_state(self, column: str = "state") -> str:
        query = f"SELECT {column} FROM pg_stat_replication WHERE application_name = 'standby'"
        return self.primary.sql(query, "postgres")

    def is_synchronous(self) -> bool:
        return self.standby_state("sync_state") == "sync"

    def fail_over(self) -> None:
        """What a tool does that watches both: a dead primary's standby commits alone until there is a new standby."""
        self.primary, self.standby = self.standby, self.primary
        self.primary.sql("SELECT pg_promote(true, 30)", "postgres")

    def stop(self) -> None:
        for node in self.nodes:
            if node.process and node.process.poll() is None:
                node.send(signal.SIGCONT)
                node.kill()


class Service:
    """`pilotfish serve`, started and stopped as often as wanted, with a clock of its own."""

    def __init__(self, number: int, program: File, folder: File, proxies: Proxies, databases: list[int], lease: float):
        self.number, self.folder, self.process, self.starts = number, folder / f"service-{number}", None, 0
        self.folder.mkdir()
        self.port = free_ports(1)[0]
        self.clients, self.peers = proxies.open(self.port), proxies.open(self.port)
        self.databases = [proxies.open(port) for port in databases]
        self.command = [program, "serve", "--data", self.folder / "data", "--port", str(self.port)]
        if databases:
            hosts = ",".join(f"{HOST}:{port}" for port in self.databases)
            self.store = f"postgres://s{number}:{PASSWORD}@{hosts}/{DATABASE}"
            own = f"http://{HOST}:{self.peers}"
            self.command += ["--store", self.store, "--advertise", own, "--lease-s", str(lease)]
        self.log, self.clock = self.folder / "log", self.folder / "clock"
        self.set_clock(0.0)

    def set_clock(self, ahead: float) -> None:
        self.clock.write_text(f"{ahead:+.3f}s\n")

    def start(self) -> None:
        fake = {"LD_PRELOAD": str(FAKETIME), "FAKETIME_TIMESTAMP_FILE": str(self.clock)} if FAKETIME.exists() else {}
        fake |= {"FAKETIME_DONT_FAKE_MONOTONIC": "1", "FAKETIME_CACHE_DURATION": "1"}
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                self.command, stdout=subprocess.DEVNULL, stderr=log, env=os.environ | fake | {"NO_COLOR": "1"}
            )
        self.starts += 1

    def is_live(self) -> bool:
        with contextlib.suppress(OSError), socket.create_connection((HOST, self.port), timeout=1) as link:
            link.sendall(f"GET /livez HTTP/1.1\r\nhost: {HOST}\r\nconnection: close\r\n\r\n".encode())
            return link.recv(64).startswith(b"HTTP/1.1 200")
        return False

    def send(self, number: int) -> None:
        self.process.send_signal(number)

    def end(self, number: int = signal.SIGKILL) -> None:
        self.process.send_signal(signal.SIGCONT)
        self.process.send_signal(number)
        self.process.wait()

    def cpu_s(self) -> float:
        return cpu_s(self.process.pid)


def cpu_s(pid: int) -> float:
    """Processor time of a process so far, s."""
    with contextlib.suppress(OSError):
        fields = File(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0
