"""The simulator's vehicles a second time: written from the equations in NumPy, without its code.

Where both agree, neither has a slip of its own; and this is what the same simulation costs in plain NumPy.
Metres, seconds, radians, newtons; north, east, depth positive down; heading clockwise from north, pitch
positive nose-up. Hulls, loops and gains are those of the MEDUSA class of IST Lisbon unless noted.
"""

from dataclasses import dataclass, field

import numpy as np

from integrate import Integrator, Vector, rk4
from path_following import Gains, Leg, Path, Sawtooth, follow_path, rotation, wrap

PERIOD = 0.1  # s, of the inner loops: inputs are held for that long
STILL_WATER = np.zeros(2)  # current (north, east), m/s


@dataclass(frozen=True)
class Drag:
    """Resistance (d + d₂ |v|) v to one motion, N or N m."""

    linear: float
    quadratic: float

    def resistance(self, velocity: float) -> float:
        """Force or moment that the motion has to overcome; it has the motion's sign."""
        return (self.linear + self.quadratic * np.abs(velocity)) * velocity


DRAG_SURGE = Drag(0.0, 27.5)
DRAG_SWAY = Drag(55.1, 101.0)
DRAG_YAW = Drag(4.14, 6.23)
DRAG_PITCH = DRAG_YAW  # assumption: no public value
MASS_SURGE = 50.0  # kg, with added mass
MASS_SWAY = 60.0  # kg, with added mass
INERTIA = 4.64  # kg m², in yaw and, an assumption, in pitch
RESTORING_MOMENT = 30.0 * 9.81 * 0.02  # N m, W·BG; assumption: no public value for the 0.02 m


@dataclass
class SurgeLoop:
    """PI from speed error to force, with a clamped error and, on demand, the drag fed forward."""

    integral: float  # N
    feed_forward: bool = False
    proportional_gain: float = 26.0  # N/(m/s)
    integral_gain: float = 3.0  # N/m
    error_max: float = 0.2  # m/s

    @classmethod
    def settled_at(cls, speed: float, feed_forward: bool = False) -> "SurgeLoop":
        """A loop that holds that speed already."""
        return cls(0.0 if feed_forward else DRAG_SURGE.resistance(speed), feed_forward)

    def error(self, reference: float, speed: float) -> float:
        """Speed error, clamped, m/s."""
        return np.clip(reference - speed, -self.error_max, self.error_max)

    def force(self, reference: float, speed: float) -> float:
        """Force wanted, N."""
        drag = DRAG_SURGE.resistance(speed) if self.feed_forward else 0.0
        return self.proportional_gain * self.error(reference, speed) + self.integral + drag

    def integrate(self, reference: float, speed: float, missing: float) -> None:
        """Integrates the error over a period, unless force that it asks for is `missing` (wanted − given)."""
        error = self.error(reference, speed)
        if missing * error <= 0.0:
            self.integral += self.integral_gain * error * PERIOD


@dataclass(frozen=True)
class Thrusters:
    """Two stern thrusters, side by side."""

    thrust_max: float = 36.0  # N each, ahead or astern
    arm: float = 0.15  # m from the centre line
    lag: float = 0.1  # s, of first order; 0: none
    dead_zone: float = 0.2  # N: a smaller command gives no thrust

    def allocate(self, force: float, moment: float) -> tuple[Vector, float]:
        """Thrusts (port, starboard) to command within the limits, and the force that they make, N.

        The moment comes first, the force gets the rest. The force is not left to a sum of the thrusts: its
        rounding would look like saturation to the surge loop.
        """
        differential = np.clip(0.5 * moment / self.arm, -self.thrust_max, self.thrust_max)
        rest = self.thrust_max - np.abs(differential)
        common = np.clip(0.5 * force, -rest, rest)
        return np.array([common + differential, common - differential]), 2.0 * common

    def steady(self, commands: Vector) -> Vector:
        """Thrust that commands settle at, N: none in the dead zone."""
        return np.where(np.abs(commands) < self.dead_zone, 0.0, commands)


IDEAL_THRUSTERS = Thrusters(lag=0.0, dead_zone=0.0)


@dataclass
class SurfaceCraft:
    """Surge, sway and yaw with closed loops. State: north, east, ψ, u, v, r, thrust port and starboard.

    u and v are through the water, along and across the body.
    """

    state: Vector
    surge: SurgeLoop
    thrusters: Thrusters = IDEAL_THRUSTERS
    yaw_frequency: float = 1.6  # rad/s
    yaw_damping: float = 0.8

    @classmethod
    def under_way(
        cls,
        speed: float,
        feed_forward: bool = False,
        thrusters: Thrusters = IDEAL_THRUSTERS,
        position: tuple[float, float] = (0.0, 0.0),
        heading: float = 0.0,
    ) -> "SurfaceCraft":
        """A craft that has held its speed for long and goes straight."""
        thrust = 0.5 * DRAG_SURGE.resistance(speed)
        state = np.array([*position, heading, speed, 0.0, 0.0, thrust, thrust])
        return cls(state, SurgeLoop.settled_at(speed, feed_forward), thrusters)

    def derivative(self, state: Vector, steady: Vector, current: Vector) -> Vector:
        """Rates of change while the thrusts (port, starboard) tend to `steady`, N, in a current, m/s.

        m_u u̇ = τ_u + m_v v r − D_u      m_v v̇ = −m_u u r − D_v      m_r ṙ = τ_r + (m_u − m_v) u v − D_r
        """
        psi, (u, v, r), thrust = state[2], state[3:6], state[6:8]
        force, moment = thrust.sum(), self.thrusters.arm * (thrust[0] - thrust[1])
        over_ground = rotation(psi) @ state[3:5] + current
        acceleration = np.array(
            [
                (force + MASS_SWAY * v * r - DRAG_SURGE.resistance(u)) / MASS_SURGE,
                (-MASS_SURGE * u * r - DRAG_SWAY.resistance(v)) / MASS_SWAY,
                (moment + (MASS_SURGE - MASS_SWAY) * u * v - DRAG_YAW.resistance(r)) / INERTIA,
            ]
        )
        lag = self.thrusters.lag
        thrust_rate = (steady - thrust) / lag if lag > 0.0 else np.zeros(2)
        return np.concatenate((over_ground, [r], acceleration, thrust_rate))

    def step(
        self, speed: float, heading: float, current: Vector = STILL_WATER, integrator: Integrator = rk4
    ) -> None:
        """One period towards a speed, m/s, and a heading, rad."""
        psi, u, r = self.state[2], self.state[3], self.state[5]
        stiffness = INERTIA * self.yaw_frequency**2
        # The hull's linear drag is part of the damping that the loop shall have.
        damping = 2.0 * self.yaw_damping * self.yaw_frequency * INERTIA - DRAG_YAW.linear
        force = self.surge.force(speed, u)
        commands, given = self.thrusters.allocate(force, stiffness * wrap(heading - psi) - damping * r)
        # What the dead zone withholds counts as given: integrating is what leads out of it.
        self.surge.integrate(speed, u, force - given)
        steady = self.thrusters.steady(commands)
        if self.thrusters.lag == 0.0:
            self.state[6:8] = steady
        self.state = integrator(lambda x: self.derivative(x, steady, current), self.state, PERIOD)


@dataclass
class UnderwaterVehicle:
    """Surge, pitch and yaw with closed loops, on a path, in a sawtooth.

    State: north, east, depth, θ, ψ, u, q, r; u is along the body, through the water. Without a sawtooth it
    stays level.
    """

    state: Vector
    surge: SurgeLoop
    path: Path
    speed: float = 0.3  # m/s along the body; Fig. 6 of the paper
    sawtooth: Sawtooth | None = field(default_factory=Sawtooth)
    leg: Leg = Leg.DOWN
    gamma: float = 0.0  # m, arc length of the point followed
    gains: Gains = Gains()
    knows_current: bool = False
    pitch_frequency: float = 1.2  # rad/s
    pitch_damping: float = 0.8
    yaw_rate_bandwidth: float = 3.0  # rad/s
    force_max: float = 72.0  # N
    moment_max: float = 10.8  # N m, in yaw and, an assumption, in pitch

    @classmethod
    def under_way(
        cls,
        path: Path,
        position: tuple[float, float],
        depth: float,
        heading: float,
        speed: float = 0.3,
        pitch: float = 0.0,
        sawtooth: Sawtooth | None = Sawtooth(),
    ) -> "UnderwaterVehicle":
        """A vehicle that has held its speed for long and does not turn."""
        state = np.array([*position, depth, pitch, heading, speed, 0.0, 0.0])
        return cls(state, SurgeLoop.settled_at(speed), path, speed, sawtooth)

    def derivative(self, state: Vector, inputs: Vector, current: Vector) -> Vector:
        """Rates of change under force ahead, N, and moments nose-up and to starboard, N m.

        [ẋ, ẏ] = u cosθ [cosψ, sinψ] + v_c     ż = −u sinθ     θ̇ = q     ψ̇ = r / cosθ
        m_u u̇ = τ_u − D_u      m_q q̇ = τ_q − D_q − W·BG sinθ      m_r ṙ = τ_r − D_r
        """
        theta, psi, u, q, r = state[3:]
        over_ground = u * np.cos(theta) * np.array([np.cos(psi), np.sin(psi)]) + current
        resistance = np.array(
            [
                DRAG_SURGE.resistance(u),
                DRAG_PITCH.resistance(q) + RESTORING_MOMENT * np.sin(theta),
                DRAG_YAW.resistance(r),
            ]
        )
        acceleration = (inputs - resistance) / np.array([MASS_SURGE, INERTIA, INERTIA])
        return np.concatenate((over_ground, [-u * np.sin(theta), q, r / np.cos(theta)], acceleration))

    def path_error(self) -> tuple[float, float, float]:
        """Errors along and across the path, m, and heading less tangent angle, rad."""
        point = self.path.at(self.gamma)
        s_1, y_1 = rotation(point.tangent).T @ (self.state[:2] - point.position)
        return s_1, y_1, wrap(self.state[4] - point.tangent)

    def guidance(self, current: Vector) -> tuple[float, float]:
        """Speed of the point on the path, m/s, and heading rate, rad/s."""
        point = self.path.at(self.gamma)
        across = (rotation(point.tangent).T @ current)[1] if self.knows_current else 0.0
        u_h = self.state[5] * np.cos(self.state[3])
        return follow_path(*self.path_error(), point.curvature, u_h, self.gains, across)

    def inputs(self, pitch: float, yaw_rate: float) -> Vector:
        """Force, N, and moments in pitch and yaw, N m, within their limits; steps the surge loop.

        Pitch: PD with the restoring moment made up for. Yaw rate: P with the drag at the reference fed
        forward.
        """
        theta, _, u, q, r = self.state[3:]
        damping = 2.0 * self.pitch_damping * self.pitch_frequency * INERTIA - DRAG_PITCH.linear
        wanted = np.array(
            [
                self.surge.force(self.speed, u),
                INERTIA * self.pitch_frequency**2 * (pitch - theta)
                - damping * q
                + RESTORING_MOMENT * np.sin(theta),
                INERTIA * self.yaw_rate_bandwidth * (yaw_rate - r) + DRAG_YAW.resistance(yaw_rate),
            ]
        )
        most = np.array([self.force_max, self.moment_max, self.moment_max])
        given = np.clip(wanted, -most, most)
        self.surge.integrate(self.speed, u, wanted[0] - given[0])
        return given

    def step(self, current: Vector = STILL_WATER, integrator: Integrator = rk4) -> None:
        """One period along the path."""
        pitch = 0.0
        if self.sawtooth is not None:
            self.leg = self.sawtooth.next(self.leg, self.state[2])
            pitch = self.leg.value * self.sawtooth.pitch
        u_p, psi_rate = self.guidance(current)
        # The law's rate is that of the heading, the loop's that of the body.
        inputs = self.inputs(pitch, psi_rate * np.cos(self.state[3]))
        self.state = integrator(lambda x: self.derivative(x, inputs, current), self.state, PERIOD)
        self.gamma += u_p * PERIOD
