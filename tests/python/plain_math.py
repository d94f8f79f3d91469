"""The same vehicles without NumPy: scalars, tuples and `math`, for the comparison of speed alone.

Arrays of eight numbers cost NumPy more than they save; this is what Python can do without it. The equations
are those of `vehicles` and `path_following`, and a test holds the one to the other.
"""

from collections.abc import Callable
from math import atan2, cos, cosh, pi, sin, tanh

from path_following import Leg, Path
from vehicles import INERTIA, MASS_SURGE, MASS_SWAY, PERIOD, RESTORING_MOMENT, SurfaceCraft, UnderwaterVehicle

State = tuple[float, ...]


def rk4(derivative: Callable[[State], State], state: State, step: float) -> State:
    """One step of the classical Runge-Kutta method."""

    def moved(by: float, slope: State) -> State:
        return tuple([x + by * k for x, k in zip(state, slope)])

    k_1 = derivative(state)
    k_2 = derivative(moved(0.5 * step, k_1))
    k_3 = derivative(moved(0.5 * step, k_2))
    k_4 = derivative(moved(step, k_3))
    slopes = zip(state, k_1, k_2, k_3, k_4)
    return tuple([x + step / 6.0 * (a + 2.0 * (b + c) + d) for x, a, b, c, d in slopes])


def clamp(value: float, most: float) -> float:
    """Nearest value within ± most."""
    return min(max(value, -most), most)


def wrap(angle: float) -> float:
    """The same angle within ± π."""
    return atan2(sin(angle), cos(angle))


def surge_drag(u: float) -> float:
    """Drag ahead, N."""
    return 27.5 * abs(u) * u


def turn_drag(rate: float) -> float:
    """Drag in yaw and in pitch, N m."""
    return (4.14 + 6.23 * abs(rate)) * rate


class PlainSurfaceCraft:
    """`vehicles.SurfaceCraft` with the default thrusters and drag feed-forward."""

    def __init__(self, craft: SurfaceCraft):
        self.state: State = tuple(craft.state.tolist())
        self.integral = float(craft.surge.integral)

    def step(self, speed: float, heading: float) -> None:
        """One period towards a speed, m/s, and a heading, rad."""
        _, _, psi, u, _, r, _, _ = self.state
        error = clamp(speed - u, 0.2)
        force = 26.0 * error + self.integral + surge_drag(u)
        moment = INERTIA * 2.56 * wrap(heading - psi) - (2.56 * INERTIA - 4.14) * r
        differential = clamp(moment / 0.3, 36.0)
        given = 2.0 * clamp(0.5 * force, 36.0 - abs(differential))
        if (force - given) * error <= 0.0:
            self.integral += 3.0 * error * PERIOD
        port, starboard = 0.5 * given + differential, 0.5 * given - differential
        port = 0.0 if abs(port) < 0.2 else port
        starboard = 0.0 if abs(starboard) < 0.2 else starboard

        def derivative(state: State) -> State:
            _, _, psi, u, v, r, t_port, t_starboard = state
            c, s = cos(psi), sin(psi)
            return (
                c * u - s * v,
                s * u + c * v,
                r,
                (t_port + t_starboard + MASS_SWAY * v * r - surge_drag(u)) / MASS_SURGE,
                (-MASS_SURGE * u * r - (55.1 + 101.0 * abs(v)) * v) / MASS_SWAY,
                (0.15 * (t_port - t_starboard) + (MASS_SURGE - MASS_SWAY) * u * v - turn_drag(r)) / INERTIA,
                (port - t_port) / 0.1,
                (starboard - t_starboard) / 0.1,
            )

        self.state = rk4(derivative, self.state, PERIOD)


class PlainUnderwaterVehicle:
    """`vehicles.UnderwaterVehicle` with the default gains and sawtooth, in still water."""

    def __init__(self, vehicle: UnderwaterVehicle):
        self.state: State = tuple(vehicle.state.tolist())
        self.integral = float(vehicle.surge.integral)
        self.leg = vehicle.leg
        self.gamma = vehicle.gamma
        self.path = PlainPath(vehicle.path)
        self.speed = vehicle.speed

    def guidance(self) -> tuple[float, float]:
        """Speed of the point on the path, m/s, and heading rate, rad/s."""
        north, east, tangent, kappa = self.path.at(self.gamma)
        c, s = cos(tangent), sin(tangent)
        d_n, d_e = self.state[0] - north, self.state[1] - east
        s_1, y_1 = c * d_n + s * d_e, c * d_e - s * d_n
        psi_e = wrap(self.state[4] - tangent)
        u_h = self.state[5] * cos(self.state[3])
        delta, slope = -0.8 * tanh(y_1), -0.8 / cosh(y_1) ** 2
        u_p = u_h * cos(psi_e) + 0.3 * s_1
        half = 0.5 * (psi_e - delta)
        quotient = cos(0.5 * (psi_e + delta)) * (sin(half) / half if half else 1.0)
        delta_rate = slope * (u_h * sin(psi_e) - kappa * u_p * s_1)
        return u_p, kappa * u_p + delta_rate - (psi_e - delta) - 0.3 * y_1 * u_h * quotient

    def step(self) -> None:
        """One period along the path."""
        _, _, depth, theta, _, u, q, r = self.state
        if depth >= 23.0:
            self.leg = Leg.UP
        elif depth <= 1.0:
            self.leg = Leg.DOWN
        pitch = self.leg.value * 50.0 * pi / 180.0
        u_p, psi_rate = self.guidance()
        yaw_rate = psi_rate * cos(theta)
        error = clamp(self.speed - u, 0.2)
        wanted = 26.0 * error + self.integral
        force = clamp(wanted, 72.0)
        if (wanted - force) * error <= 0.0:
            self.integral += 3.0 * error * PERIOD
        damping = 1.92 * INERTIA - 4.14
        nose_up = clamp(INERTIA * 1.44 * (pitch - theta) - damping * q + RESTORING_MOMENT * sin(theta), 10.8)
        starboard = clamp(INERTIA * 3.0 * (yaw_rate - r) + turn_drag(yaw_rate), 10.8)

        def derivative(state: State) -> State:
            _, _, _, theta, psi, u, q, r = state
            c, s = cos(theta), sin(theta)
            return (
                u * c * cos(psi),
                u * c * sin(psi),
                -u * s,
                q,
                r / c,
                (force - surge_drag(u)) / MASS_SURGE,
                (nose_up - turn_drag(q) - RESTORING_MOMENT * s) / INERTIA,
                (starboard - turn_drag(r)) / INERTIA,
            )

        self.state = rk4(derivative, self.state, PERIOD)
        self.gamma += u_p * PERIOD


class PlainPath:
    """`path_following.Path` as plain numbers."""

    def __init__(self, path: Path):
        self.pieces = [
            (
                float(begin),
                segment.length,
                float(segment.start.position[0]),
                float(segment.start.position[1]),
                float(segment.start.tangent),
                segment.start.curvature,
            )
            for begin, segment in zip(path.begins, path.segments)
        ]

    def at(self, gamma: float) -> tuple[float, float, float, float]:
        """North and east, m, tangent angle, rad, and curvature, 1/m."""
        piece = self.pieces[-1]
        for candidate in self.pieces:
            if gamma <= candidate[0] + candidate[1]:
                piece = candidate
                break
        begin, _, north, east, tangent, kappa = piece
        along = gamma - begin
        half = 0.5 * kappa * along
        chord = along * (sin(half) / half if half else 1.0)
        return (
            north + chord * cos(tangent + half),
            east + chord * sin(tangent + half),
            tangent + 2.0 * half,
            kappa,
        )
