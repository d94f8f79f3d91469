"""The lawn-mower, the path-following law and the sawtooth of an underwater vehicle.

Metres, seconds, radians; north, east, depth positive down; headings clockwise from north.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from integrate import Vector


def wrap(angle: float) -> float:
    """The same angle in [−π, π)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def rotation(angle: float) -> Vector:
    """Matrix that turns body axes (ahead, to starboard) into (north, east) for that heading."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@dataclass(frozen=True)
class PathPoint:
    """Position (north, east), m; tangent angle, rad; curvature, 1/m, positive to starboard."""

    position: Vector
    tangent: float
    curvature: float


@dataclass(frozen=True)
class Segment:
    """A straight line or, with a curvature, an arc."""

    start: PathPoint
    length: float

    def at(self, along: float) -> PathPoint:
        """The point `along` m from the start; an arc's chord has length 2/κ sin(κ s/2) and half the turn."""
        kappa = self.start.curvature
        turned = kappa * along
        chord = along * np.sinc(0.5 * turned / np.pi)
        middle = self.start.tangent + 0.5 * turned
        position = self.start.position + chord * np.array([np.cos(middle), np.sin(middle)])
        return PathPoint(position, self.start.tangent + turned, kappa)


class Path:
    """Segments joined end to end, parametrised by arc length and continued straight at both ends."""

    def __init__(self, segments: list[Segment]):
        self.segments = segments
        self.begins = np.cumsum([0.0] + [segment.length for segment in segments[:-1]])

    def at(self, gamma: float) -> PathPoint:
        """The point at arc length `gamma`, m, from the beginning."""
        i = max(0, int(np.searchsorted(self.begins, gamma)) - 1)
        return self.segments[i].at(gamma - self.begins[i])

    @classmethod
    def line(cls, start: Vector, tangent: float) -> "Path":
        """A straight line without end."""
        return cls([Segment(PathPoint(start, tangent, 0.0), np.inf)])

    @classmethod
    def lawn_mower(
        cls, start: Vector, length: float = 100.0, spacing: float = 20.0, lanes: int = 4
    ) -> "Path":
        """Lanes to the north and back, joined by half circles, the first of them to starboard.

        The defaults are the lanes of the simulator's paper-* scenarios.
        """
        segments = [Segment(PathPoint(start, 0.0, 0.0), length)]
        for turn in range(lanes - 1):
            curvature = (1.0 if turn % 2 == 0 else -1.0) / (0.5 * spacing)
            end = segments[-1].at(length)
            segments.append(Segment(PathPoint(end.position, end.tangent, curvature), 0.5 * np.pi * spacing))
            end = segments[-1].at(segments[-1].length)
            segments.append(Segment(PathPoint(end.position, end.tangent, 0.0), length))
        return cls(segments)


@dataclass(frozen=True)
class Gains:
    """Gains of the law. Defaults: the public ones of IST Lisbon's laboratory."""

    k_1: float = 1.0  # heading, 1/s
    k_2: float = 0.3  # cross-track error against heading error, 1/m²
    k_3: float = 0.3  # the point's speed on the path, 1/s
    theta_a: float = 0.8  # largest approach angle, rad
    k_delta: float = 1.0  # how soon it is reached, 1/m


def sine_quotient(a: float, b: float) -> float:
    """(sin a − sin b)/(a − b), continued to a = b."""
    return np.cos(0.5 * (a + b)) * np.sinc(0.5 * (a - b) / np.pi)


def follow_path(
    s_1: float, y_1: float, psi_e: float, kappa: float, u_h: float, gains: Gains, current_across: float = 0.0
) -> tuple[float, float]:
    """Speed of the point on the path, m/s, and heading rate, rad/s, that the law asks for.

        δ  = −θ_a tanh(k_δ y₁)        ψ̃ = ψ_e − δ        u_P = u_h cosψ_e + k₃ s₁
        ψ̇ = κ u_P + δ̇ − k₁ ψ̃ − k₂ y₁ u_h (sinψ_e − sinδ)/ψ̃
        δ̇  = δ′(y₁) (−κ u_P s₁ + u_h sinψ_e + v_c⊥)

    after Lapierre, Soetanto and Pascoal (CDC 2003). s₁ and y₁ are the errors along and across the path, m,
    positive ahead and to starboard; u_h is the horizontal speed through the water, m/s. `current_across`
    v_c⊥ is 0 for a vehicle that does not know the current.
    """
    delta = -gains.theta_a * np.tanh(gains.k_delta * y_1)
    delta_slope = -gains.theta_a * gains.k_delta / np.cosh(gains.k_delta * y_1) ** 2
    u_p = u_h * np.cos(psi_e) + gains.k_3 * s_1
    y_1_rate = -kappa * u_p * s_1 + u_h * np.sin(psi_e) + current_across
    psi_rate = (
        kappa * u_p
        + delta_slope * y_1_rate
        - gains.k_1 * (psi_e - delta)
        - gains.k_2 * y_1 * u_h * sine_quotient(psi_e, delta)
    )
    return u_p, psi_rate


class Leg(Enum):
    """Leg of the sawtooth; the value is the sign of its pitch."""

    DOWN = -1
    UP = 1


@dataclass(frozen=True)
class Sawtooth:
    """Down to one depth, up to the other, m, at ± one pitch, rad. Defaults: Figs. 4 and 6 of the paper."""

    depth_min: float = 1.0
    depth_max: float = 23.0
    pitch: float = np.radians(50.0)

    def next(self, leg: Leg, depth: float) -> Leg:
        """A latch: between the two depths the leg stays what it was."""
        if depth >= self.depth_max:
            return Leg.UP
        if depth <= self.depth_min:
            return Leg.DOWN
        return leg
