#!/usr/bin/env python3
"""How late answers are, by deadline: posts an example again and again and takes the time of each answer.

    PILOTFISH=target/release/pilotfish python3 tests/python/deadline.py [--example NAME] [--count N] [--clients N]

Lateness is what the client sees: from before the request is sent to after the answer is read, less the deadline.
"""

import argparse
import json
import os
import re
import socket
import subprocess
import threading
import time
from dataclasses import dataclass
from pathlib import Path as File

SNAPSHOTS = File(__file__).resolve().parents[2] / "examples" / "snapshots"
DEADLINES_MS = [0.05, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 50.0]


@dataclass(frozen=True)
class Answer:
    late_ms: float
    method: str
    deadline_hit: bool


def ask(address: tuple[str, int], snapshot: dict, deadline_ms: float, count: int, answers: list[Answer]) -> None:
    """Posts `snapshot` over one connection, each request after the answer to the one before it."""
    body = json.dumps(snapshot | {"deadline_ms": deadline_ms}).encode()
    head = f"POST /v1/plan HTTP/1.1\r\nhost: x\r\ncontent-type: application/json\r\ncontent-length: {len(body)}\r\n\r\n"
    request = head.encode() + body
    with socket.create_connection(address) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for _ in range(count):
            start = time.perf_counter()
            connection.sendall(request)
            answer = read(connection)
            late = 1e3 * (time.perf_counter() - start) - deadline_ms
            plan = json.loads(answer)
            answers.append(Answer(late, plan["method"], plan["solver"]["deadline_hit"]))


def read(connection: socket.socket) -> bytes:
    """The body of one answer."""
    received = b""
    while b"\r\n\r\n" not in received:
        received += connection.recv(1 << 20)
    head, body = received.split(b"\r\n\r\n", 1)
    length = int(re.search(rb"content-length: (\d+)", head, re.IGNORECASE)[1])
    while len(body) < length:
        body += connection.recv(1 << 20)
    return body


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--example", default="intermittent")
    parser.add_argument("--snapshot", type=File, help="a request of one's own, instead of an example")
    parser.add_argument("--count", type=int, default=1000, help="requests of each client for each deadline")
    parser.add_argument("--clients", type=int, default=1)
    arguments = parser.parse_args()
    file = arguments.snapshot or SNAPSHOTS / f"{arguments.example}.json"
    snapshot = json.loads(file.read_text())

    server = subprocess.Popen([os.environ["PILOTFISH"], "--port", "0"], stdout=subprocess.PIPE, text=True)
    try:
        host, port = re.search(r"http://([\d.]+):(\d+)", server.stdout.readline()).groups()
        address = (host, int(port))
        ask(address, snapshot, 1000.0, 100, [])  # the first plans set up their memory
        print("deadline ms  late ms: p50    p99    max   planned  cut short")
        for deadline in DEADLINES_MS:
            answers: list[Answer] = []
            of_all = (address, snapshot, deadline, arguments.count, answers)
            clients = [threading.Thread(target=ask, args=of_all) for _ in range(arguments.clients)]
            for client in clients:
                client.start()
            for client in clients:
                client.join()
            late = sorted(answer.late_ms for answer in answers)
            p50, p99 = late[len(late) // 2], late[len(late) * 99 // 100]
            planned = sum(answer.method == "mpc" for answer in answers) / len(answers)
            cut = sum(answer.deadline_hit for answer in answers) / len(answers)
            print(f"{deadline:11}  {p50:+12.2f} {p99:+6.2f} {late[-1]:+6.2f}   {planned:6.1%}     {cut:6.1%}")
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    main()
