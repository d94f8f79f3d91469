"""What operators and their tools see and say: the state, `/diagnostics`, another goal, pause and run."""

from __future__ import annotations

import json
from collections.abc import Iterable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import Trigger

from .conversion import stamp
from .mission import MissionLink

# Subscribers that join later receive the last state.
STATE_QOS = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no number of JSON")


class Console:
    """Topics and services beside those of the vehicles. Orders go to the mission, whose answer is in the log."""

    def __init__(self, node: Node, link: MissionLink, craft: str) -> None:
        self._link, self._craft, self._log = link, craft, node.get_logger()
        self._state = node.create_publisher(String, "~/state", STATE_QOS)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        node.create_subscription(String, "~/goal", self._take_goal, 10)
        node.create_service(Trigger, "~/pause", lambda _, answer: self._order("pause", answer))
        node.create_service(Trigger, "~/run", lambda _, answer: self._order("run", answer))
        self._shown = ""

    def _take_goal(self, message: String) -> None:
        """A goal as the service has it, JSON, such as `{"kind": "visit", "auvs": ["red", "black"]}`."""
        try:
            goal = json.loads(message.data, parse_constant=_refuse)
        except (ValueError, RecursionError) as error:
            self._log.error(f"the goal is no JSON: {error}")
            return
        self._link.order(f"goal {message.data[:200]}", lambda mission: mission.change(goal=goal))

    def _order(self, name: str, answer: Trigger.Response) -> Trigger.Response:
        # The service is not waited for: references go on ten times a second meanwhile.
        self._link.order(name, lambda mission: getattr(mission, name)())
        answer.success, answer.message = True, f"{name} was passed on; ~/state and the log show what became of it"
        return answer

    def show(self, now_s: float, word: tuple[str, str], rows: Iterable[tuple[str, str]]) -> None:
        """Publishes the state and its reason if they have changed, and the diagnostics."""
        state, why = word
        text = f"{state}: {why}" if why else state
        if text != self._shown:
            self._shown = text
            self._state.publish(String(data=text))
        level = DiagnosticStatus.ERROR if state == "not_steering" else DiagnosticStatus.WARN
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if text == "steering" else level,
            name=f"pilotfish: {self._craft}",
            hardware_id=self._craft,
            message=text.replace("_", " "),
            values=[KeyValue(key=key, value=value) for key, value in rows],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = stamp(now_s)
        self._diagnostics.publish(array)
