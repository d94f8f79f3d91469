"""The planner again as a Python programmer would write it: snapshot in, cone programs solved, references out.

It states the same cone program as the planner, number for number (`tests/python/throughput.py --check` compares them),
and solves it from two guesses, twice each at most, as the planner does. It does less than the planner beside that:
AUVs are states and not reports, paths are one line, the craft is a `medusa`, no previous plan is carried on; its guesses are
made on the stages and not by a response model; no trajectory is rolled out on such a model, there is no line-of-sight
baseline, and no solution is certified. What it does not know it refuses.

    minimise  1/2 x'Px + q'x   subject to   A x + s = b,  s in K
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import clarabel
import cvxpy as cp
import numpy as np
from scipy import sparse

Array = np.ndarray

STEPS = np.repeat([1.0, 2.0, 4.0], [6, 12, 12])
TIMES = np.concatenate([[0.0], np.cumsum(STEPS)])
N = len(STEPS)
LENGTH_UNIT, SLACK_UNIT, COST_UNIT = 10.0, 0.01, 300.0
GOAL_REACH = 1.5
SPEED_SHARE, HEADING_RATE_MAX, KEEP_OUT_MARGIN, RANGE_BACK_OFF = 0.98, 0.17, 0.5, 1.73
SCP_ITERATIONS, CONVERGED_COSINE = 2, 0.94
SPEED_WITHOUT_DIRECTION = 0.02
VALIDITY = 10.0

# The craft, `medusa`.
TURN_RATE_MAX, ACCELERATION_MAX, INTEGRAL_TIME = 0.3, 0.09, 26.0 / 3.0
HEADING_LAG, SURGE_LAG, SWAY_PER_YAW_RATE = 1.0, 2.5, 50.0 / 55.1
COURSE_LAG, HALF_HOLD, DRIFT_SHARE = HEADING_LAG + SWAY_PER_YAW_RATE, 0.5, 0.8
DISTURBANCE_MAX = 1.5 * ACCELERATION_MAX
#: Intervals, and what part of an acceleration the speed loop's integrator gathers in each.
GATHERED = STEPS.tolist(), (1.0 - np.exp(-STEPS / INTEGRAL_TIME)).tolist()

# Weights of the cost; durations are what a stage stands for, s.
DURATION = 0.5 * (STEPS + np.append(STEPS[1:], 0.0))
LAST = np.arange(N) == N - 1
POSITION_WEIGHT = (DURATION + 10.0 * LAST) * LENGTH_UNIT**2
VELOCITY_WEIGHT = 15.0 * DURATION + 150.0 * LAST
ACCELERATION_WEIGHT = 100.0 / STEPS
#: Linear and quadratic price of a slack.
PRICES = {
    "motion": (1e5, 1e3),
    "range": (1e4, 1e2),
    "other_range": (5e3, 0.0),
    "area": (3e4, 1e2),
    "keep_out": (1e5, 1e2),
}

SOLVER_SETTINGS = {
    # Those of the planner.
    "verbose": False,
    "max_iter": 100,
    "max_threads": 1,
    "tol_gap_abs": 1e-7,
    "tol_gap_rel": 1e-7,
    "tol_feas": 1e-6,
    "iterative_refinement_enable": False,
    "equilibrate_enable": False,
    "presolve_enable": False,
    "direct_solve_method": "qdldl",
}


class NotKnown(ValueError):
    """The snapshot has what this planner cannot plan with."""


@dataclass(frozen=True)
class Shape:
    """What the pattern of a program depends on."""

    n_named_ranges: int = 0
    n_other_ranges: int = 0
    n_discs: int = 0
    n_edges: int = 0

    @property
    def n_ranges(self) -> int:
        return self.n_named_ranges + self.n_other_ranges

    @property
    def slacks(self) -> list[str]:
        """The slacks of a stage, in the order of their columns."""
        there = [True, self.n_named_ranges, self.n_other_ranges, self.n_edges, self.n_discs]
        return [name for name, has in zip(PRICES, there, strict=True) if has]


@dataclass
class Horizon:
    """The facts of a snapshot at the stages, in the craft's frame: origin where it is, first axis ahead."""

    origin: Array
    axes: Array  # columns: ahead and starboard in (north, east)
    heading: float
    now: float
    speed_min: float
    speed_max: float
    speed_allowed: float
    velocity: Array
    acceleration: Array
    current: Array
    goal: Array  # r_0 ... r_N
    goal_velocity: Array  # through the water
    scale: float
    shape: Shape
    range_centres: Array  # (AUV, stage, axis)
    range_radii: Array
    disc_centres: Array
    disc_radii: Array
    edge_normals: Array
    edge_offsets: Array


@dataclass
class Linearisation:
    """What a subproblem is linearised about."""

    directions: Array  # c_0 ... c_N
    mean: Array  # of both ends of an interval
    disturbance: Array
    speeds_max: Array
    disc_normals: Array  # (disc, interval, axis)


@dataclass
class Solved:
    positions: Array
    velocities: Array
    objective: float
    iterations: int
    status: str


class Solver(Protocol):
    """A way to state and solve a subproblem."""

    seconds: float

    def solve(self, horizon: Horizon, about: Linearisation) -> Solved: ...


# ---- from a snapshot to the horizon


def unit(angle: Array | float) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def starboard(direction: Array) -> Array:
    return np.stack([-direction[..., 1], direction[..., 0]], axis=-1)


def forecast(auv: Any, current: Array) -> tuple[Array, Array, Array]:
    """Positions and velocities (north, east) of an AUV at the stages, and the variance of the positions, m²."""
    state = auv.state
    if state is None or auv.dive is not None or state.covariance is not None:
        raise NotKnown("AUVs are known by states without covariance, and dive nowhere")
    elapsed = (state.age_s + TIMES)[:, None]
    position = np.array([state.north_m, state.east_m])
    variance = np.full(N + 1, 2 * 1.5**2)
    if auv.path is not None and state.speed_mps >= 0.05:
        segment = auv.path.segments[0]
        if len(auv.path.segments) > 1 or segment.kind != "line" or auv.path.closed:
            raise NotKnown("a path is one line")
        begin, along = np.array(segment.from_), np.subtract(segment.to, segment.from_)
        along = along / np.hypot(*along)
        across, off = starboard(along), position - begin
        offset = off @ across
        if abs(offset) <= 15.0:
            speed = auv.path.speed_mps
            rate = along @ current + math.sqrt(max(speed**2 - (across @ current) ** 2, 0.0))
            approach, fall = 2.0 * (unit(state.course_rad) @ across), state.speed_mps / 2.0
            left = np.exp(-fall * elapsed)
            gamma, beside = off @ along + rate * elapsed, offset + approach * (1.0 - left)
            variance = variance + (0.1 * speed * elapsed[:, 0]) ** 2 + 0.7**2 * (1.0 - left[:, 0] ** 2)
            return begin + gamma * along + beside * across, rate * along + approach * fall * left * across, variance
    if state.speed_mps < 0.05:
        return np.tile(position, (N + 1, 1)), np.zeros((N + 1, 2)), variance
    t, speed = elapsed[:, 0], state.speed_mps
    cubic = 6e-5 * t**3 / 3.0
    unforeseen = np.minimum(cubic * max(speed / 0.193, 1.0) ** 3, np.maximum(cubic, (speed * t) ** 2))
    variance = variance + 2 * (0.05 * t) ** 2 + 2 * unforeseen
    turn_rate = state.turn_rate_radps if abs(state.turn_rate_radps) >= 0.002 else 0.0
    half = 0.5 * turn_rate * elapsed
    # Chord of an arc; numpy's sinc counts in half turns.
    chord = speed * elapsed * np.sinc(half / np.pi)
    position = position + chord * unit(state.course_rad + half[:, 0])
    return position, speed * unit(state.course_rad + 2 * half[:, 0]), variance


def goal_motion(snapshot: Any, forecasts: dict[str, tuple[Array, Array, Array]]) -> tuple[Array, Array]:
    """Positions and velocities (north, east) of the goal at the stages."""
    goal = snapshot.goal
    if goal.offset is not None or goal.kind == "range":
        raise NotKnown("goals are AUVs in turn or means of them")
    if goal.kind == "intermittent":
        turns = np.floor((snapshot.t_s - goal.epoch_s + TIMES) / goal.dwell_s).astype(int) % len(goal.auvs)
        stages = np.arange(N + 1)
        motions = [np.stack([forecasts[name][i] for name in goal.auvs])[turns, stages] for i in range(2)]
        return motions[0], motions[1]
    weights = goal.weights or dict.fromkeys(goal.auvs or [goal.auv], 1.0)
    total = sum(weights.values())
    motions = [sum(forecasts[name][i] * (w / total) for name, w in weights.items()) for i in range(2)]
    return motions[0], motions[1]


def capped(vectors: Array, most: float) -> Array:
    return vectors * np.minimum(1.0, most / np.maximum(np.hypot(*vectors.T), 1e-300))[:, None]


def in_order(points: Array) -> Array:
    return np.lexsort((points[:, 1], points[:, 0]))


def horizon_of(snapshot: Any) -> Horizon:
    """The facts of a checked snapshot."""
    if snapshot.previous_plan is not None or snapshot.surfacing_separation_m is not None:
        raise NotKnown("neither a previous plan nor a separation from surfaced AUVs")
    if snapshot.craft is None or snapshot.craft.preset != "medusa" or snapshot.forecast != "auto":
        raise NotKnown("a craft is a medusa and a forecast automatic")
    asc, limits = snapshot.asc, snapshot.limits
    origin, axes = np.array([asc.north_m, asc.east_m]), unit(asc.heading_rad)
    axes = np.stack([axes, starboard(axes)], axis=1)
    ned_current = np.array([snapshot.current.north_mps, snapshot.current.east_mps])
    forecasts = {auv.id: forecast(auv, ned_current) for auv in snapshot.auvs}
    position, over_ground = goal_motion(snapshot, forecasts)
    goal, current = (position - origin) @ axes, ned_current @ axes
    reach = GOAL_REACH * limits.speed_max_mps * TIMES[-1]
    goal = capped(goal, reach)
    yaw_rate = min(max(asc.yaw_rate_radps, -TURN_RATE_MAX), TURN_RATE_MAX)
    drift = -SWAY_PER_YAW_RATE * asc.speed_mps * yaw_rate
    velocity = np.array([asc.speed_mps, asc.sway_mps + DRIFT_SHARE * (drift - asc.sway_mps)])
    horizon = Horizon(
        origin=origin,
        axes=axes,
        heading=asc.heading_rad,
        now=snapshot.t_s,
        speed_min=limits.speed_min_mps,
        speed_max=max(SPEED_SHARE * limits.speed_max_mps, min(limits.speed_max_mps, limits.speed_min_mps + 0.05)),
        speed_allowed=limits.speed_max_mps,
        velocity=velocity,
        acceleration=np.array([-velocity[1], velocity[0]]) * yaw_rate,
        current=current,
        goal=goal,
        goal_velocity=capped(over_ground @ axes - current, GOAL_REACH * limits.speed_max_mps),
        scale=1.0 / (1.0 + np.sqrt((goal * goal).sum(axis=1).max()) / LENGTH_UNIT),
        shape=Shape(),
        range_centres=np.empty((0, N + 1, 2)),
        range_radii=np.empty((0, N + 1)),
        disc_centres=np.empty((0, 2)),
        disc_radii=np.empty(0),
        edge_normals=np.empty((0, 2)),
        edge_offsets=np.empty(0),
    )
    if snapshot.acoustics or snapshot.keep_outs or snapshot.area:
        add_bounds(horizon, snapshot, forecasts)
    return horizon


def add_bounds(horizon: Horizon, snapshot: Any, forecasts: dict[str, tuple[Array, Array, Array]]) -> None:
    """Acoustic ranges, keep-outs and area, in an order that does not depend on who was named first."""
    origin, axes, goal = horizon.origin, horizon.axes, snapshot.goal
    n_named = n_ranges = 0
    if snapshot.acoustics is not None:
        centres = np.stack([(forecasts[auv.id][0] - origin) @ axes for auv in snapshot.auvs])
        order = in_order(centres[:, 0])
        names = set(goal.weights or goal.auvs or [goal.auv])
        named = np.array([snapshot.auvs[i].id in names for i in order])
        order = np.concatenate([order[named], order[~named]])
        n_named, n_ranges = int(named.sum()), len(order)
        depths = np.array([auv.state.depth_m for auv in snapshot.auvs])[order]
        across = np.sqrt(np.maximum(snapshot.acoustics.range_max_m**2 - depths**2, 0.0))
        sigma = np.sqrt(np.stack([forecasts[snapshot.auvs[i].id][2] for i in order]))
        horizon.range_centres = centres[order]
        horizon.range_radii = np.maximum(across[:, None] - RANGE_BACK_OFF * sigma, 0.0)
    if snapshot.keep_outs:
        discs = np.array([[disc.north_m, disc.east_m, disc.radius_m] for disc in snapshot.keep_outs])
        centres = (discs[:, :2] - origin) @ axes
        order = in_order(centres)
        horizon.disc_centres, horizon.disc_radii = centres[order], discs[order, 2] + KEEP_OUT_MARGIN
    if snapshot.area:
        corners = np.array(snapshot.area)
        following = np.roll(corners, -1, axis=0)
        if (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum() < 0.0:
            # Clockwise, and the first corner stays the first.
            corners = np.roll(corners[::-1], 1, axis=0)
            following = np.roll(corners, -1, axis=0)
        along = following - corners
        normals = -starboard(along / np.hypot(*along.T)[:, None]) @ axes
        horizon.edge_normals = normals
        horizon.edge_offsets = (normals * ((corners - origin) @ axes)).sum(axis=1)
    horizon.shape = Shape(n_named, n_ranges - n_named, len(horizon.disc_radii), len(horizon.edge_offsets))


# ---- guesses and linearisation


def guesses(horizon: Horizon) -> list[tuple[Array, Array]]:
    """Positions and velocities at the stages: chasing the goal as the craft can, and straight to the goal's end.

    Where a disc is on the straight way, there are two ways round it in place of that.
    """
    straight = (horizon.goal[-1] / TIMES[-1]) - horizon.current
    speed = math.hypot(*straight)
    if speed > 1e-9:
        straight = straight * (min(max(speed, horizon.speed_min), horizon.speed_max) / speed)
    velocities = np.vstack([horizon.velocity, np.tile(straight, (N, 1))])
    positions = TIMES[:, None] * (straight + horizon.current)
    for centre, radius in zip(horizon.disc_centres, horizon.disc_radii, strict=True):
        if ((positions - centre) ** 2).sum(axis=1).min() < radius**2:
            return [chase(horizon), *(round_disc(horizon, positions[-1], centre, side * radius) for side in (1, -1))]
    return [chase(horizon), (positions, velocities)]


def round_disc(horizon: Horizon, end: Array, centre: Array, beside: float) -> tuple[Array, Array]:
    """By way of a point abeam of a disc, at a constant speed."""
    abeam = centre + starboard(end / math.hypot(*end)) * (1.2 * beside)
    lengths = np.array([math.hypot(*abeam), math.hypot(*(end - abeam))])
    gamma = TIMES * (lengths.sum() / TIMES[-1])
    corners = np.vstack([np.zeros(2), abeam, end])
    marks = np.concatenate([[0.0], np.cumsum(lengths)])
    positions = np.stack([np.interp(gamma, marks, corners[:, i]) for i in range(2)], axis=1)
    velocities = np.diff(positions, axis=0) / STEPS[:, None] - horizon.current
    return positions, np.vstack([horizon.velocity, velocities])


def chase(horizon: Horizon) -> tuple[Array, Array]:
    """A craft that steers for its goal, and near it as the goal goes, a stage at a time."""
    (cn, ce), psi = horizon.current.tolist(), 0.0
    x = y = 0.0
    speed = float(horizon.velocity[0])
    velocities, positions = [horizon.velocity.tolist()], [[0.0, 0.0]]
    goal, moves = horizon.goal.tolist(), horizon.goal_velocity.tolist()
    for k, dt in enumerate(STEPS.tolist()):
        wx, wy = moves[k][0] + 0.15 * (goal[k][0] - x), moves[k][1] + 0.15 * (goal[k][1] - y)
        wanted = min(max(math.hypot(wx, wy), horizon.speed_min), horizon.speed_max)
        turn = math.remainder(math.atan2(wy, wx) - psi, math.tau)
        psi += min(max(turn, -TURN_RATE_MAX * dt), TURN_RATE_MAX * dt)
        speed += min(max(wanted - speed, -ACCELERATION_MAX * dt), ACCELERATION_MAX * dt)
        vx, vy = speed * math.cos(psi), speed * math.sin(psi)
        x, y = x + dt * (vx + cn), y + dt * (vy + ce)
        velocities.append([vx, vy])
        positions.append([x, y])
    return np.array(positions), np.array(velocities)


def directions_of(velocities: Array) -> Array:
    """Unit vectors; that of the bow first, and of what is too slow to have one, the one before."""
    speeds = np.sqrt((velocities * velocities).sum(axis=1))
    directions = velocities / np.maximum(speeds, 1e-300)[:, None]
    directions[0] = (1.0, 0.0)
    for k in np.flatnonzero(speeds[1:] <= SPEED_WITHOUT_DIRECTION) + 1:
        directions[k] = directions[k - 1]
    return directions


def linearised(horizon: Horizon, positions: Array, velocities: Array) -> Linearisation:
    speeds = np.sqrt((velocities * velocities).sum(axis=1))
    bias, slowed = 0.0, math.hypot(*horizon.velocity)
    disturbance, speeds_max = [], []
    most = ACCELERATION_MAX
    for acceleration, dt, share in zip((np.diff(speeds) / STEPS).tolist(), *GATHERED, strict=True):
        disturbance.append(bias)
        slowed -= (most - abs(bias)) * dt
        slowed = slowed if slowed > 0.0 else 0.0
        speeds_max.append(slowed if slowed > horizon.speed_max else horizon.speed_max)
        asked = acceleration - bias
        bias += share * (-most if asked < -most else most if asked > most else asked)
        bias = min(max(bias, -DISTURBANCE_MAX), DISTURBANCE_MAX)
    return linearised_about(horizon, directions_of(velocities), np.array(disturbance), np.array(speeds_max), positions)


def linearised_about(
    horizon: Horizon, directions: Array, disturbance: Array, speeds_max: Array, positions: Array
) -> Linearisation:
    sums = directions[1:] + directions[:-1]
    lengths = np.sqrt((sums * sums).sum(axis=1))
    mean = np.where((lengths > 1e-3)[:, None], sums / np.maximum(lengths, 1e-300)[:, None], directions[1:])
    normals = np.empty((0, N, 2))
    if horizon.shape.n_discs:
        begin, chord = positions[:-1], np.diff(positions, axis=0)
        to_centre = horizon.disc_centres[:, None, :] - begin
        share = (to_centre * chord).sum(axis=2) / np.maximum((chord * chord).sum(axis=1), 1e-300)
        away = np.clip(share, 0.0, 1.0)[..., None] * chord - to_centre
        far = np.sqrt((away * away).sum(axis=2))[..., None]
        normals = np.where(far > 1e-6, away / np.maximum(far, 1e-300), starboard(directions[1:]))
    return Linearisation(directions, mean, disturbance, speeds_max, normals)


def sag(horizon: Horizon) -> Array:
    """Farthest that the trajectory of an interval is from its chord, m."""
    return STEPS**2 * math.hypot(ACCELERATION_MAX, HEADING_RATE_MAX * horizon.speed_max) / 8.0


# ---- by hand


class Pattern:
    """Where each number of a program of a shape stands: worked out once, then only the numbers are written.

    Entries are written block after block and sorted into columns by one permutation.
    """

    def __init__(self, shape: Shape) -> None:
        self.shape, self.slacks = shape, shape.slacks
        ns, nd, ne, nr = len(self.slacks), shape.n_discs, shape.n_edges, shape.n_ranges
        k, two = np.arange(N)[:, None], np.arange(2)[None, :]
        d, v = 4 * k + two, 4 * k + 2 + two
        slack = {name: 4 * N + ns * k + j for j, name in enumerate(self.slacks)}
        self.n, self.v, self.motion = (4 + ns) * N, v, slack["motion"]
        area_rows, disc_rows = (7 + ns) * N, (7 + ns + ne) * N
        start_rows = disc_rows + nd * N
        cones = start_rows + nd * (N - 1)
        ranges = cones + 3 * N
        self.n_equations, self.n_inequalities, self.n_cones = 2 * N, cones - 2 * N, N * (1 + nr)
        self.m = ranges + 3 * N * nr
        self.rows_area, self.rows_disc, self.rows_start = area_rows, disc_rows, start_rows
        self.rows_speed, self.rows_range = cones, ranges
        turn = 5 * N + 2 * k[:, :, None] + np.arange(2)[None, :, None]
        accelerate = 2 * N + 2 * k[:, :, None] + np.arange(2)[None, :, None]
        discs, edges, auvs = np.arange(nd)[:, None, None], np.arange(ne)[None, :, None], np.arange(nr)[None, :, None]
        # Rows and columns of each block; `entries` writes its numbers in the same order.
        at_end, at_start = disc_rows + nd * k[None] + discs, start_rows + nd * k[None, :-1] + discs
        blocks = [
            (accelerate, v[:, None, :]),
            (accelerate[1:], v[:-1, None, :]),
            (4 * N + k, v),
            (turn, v[:, None, :]),
            (turn[1:], v[:-1, None, :]),
            (turn[2:], v[:-2, None, :]),
            (area_rows + ne * k[:, :, None] + edges, d[:, None, :]),
            (at_end, d[None]),
            (at_start, d[None, :-1]),
        ]
        constant: list[tuple[Array, Array, Any]] = [
            (2 * k + two, d, 1.0),
            (2 * k + two, v, -0.5 * STEPS[:, None] / LENGTH_UNIT),
            (2 * k[1:] + two, d[:-1], -1.0),
            (2 * k[1:] + two, v[:-1], -0.5 * STEPS[1:, None] / LENGTH_UNIT),
            (4 * N + k, slack["motion"], -SLACK_UNIT),
            (turn[:, :, 0], slack["motion"], -SLACK_UNIT),
            (cones + 3 * k + 1 + two, v, -1.0),
        ]
        for j, name in enumerate(self.slacks):
            constant.append((7 * N + ns * k + j, slack[name], -1.0))
        if ne:
            constant.append((area_rows + ne * k + edges[0].T, slack["area"], -SLACK_UNIT / LENGTH_UNIT))
        if nd:
            constant.append((at_end, slack["keep_out"][None], -SLACK_UNIT / LENGTH_UNIT))
            constant.append((at_start, slack["keep_out"][None, 1:], -SLACK_UNIT / LENGTH_UNIT))
        if nr:
            rows = ranges + 3 * (nr * k[:, :, None] + auvs)
            constant.append((rows + 1 + two[None], d[:, None, :], -1.0))
            for name, part in [
                ("range", slice(shape.n_named_ranges)),
                ("other_range", slice(shape.n_named_ranges, nr)),
            ]:
                if name in slack:
                    constant.append((rows[:, part, 0], slack[name], -SLACK_UNIT / LENGTH_UNIT))
        places = [np.broadcast_arrays(rows, columns) for rows, columns, *_ in [*blocks, *constant]]
        rows = np.concatenate([place[0].ravel() for place in places])
        columns = np.concatenate([place[1].ravel() for place in places])
        self.constant = np.concatenate(
            [np.broadcast_to(c[2], np.broadcast_shapes(c[0].shape, c[1].shape)).ravel() for c in constant]
        )
        self.order = np.lexsort((rows, columns))
        indptr = np.searchsorted(columns[self.order], np.arange(self.n + 1))
        self.constraints = sparse.csc_matrix((np.zeros(len(rows)), rows[self.order], indptr), shape=(self.m, self.n))
        self.quadratic, self.q_cost, self.q_slack = self.cost()
        self.cones = [clarabel.ZeroConeT(self.n_equations), clarabel.NonnegativeConeT(self.n_inequalities)]
        self.cones += [clarabel.SecondOrderConeT(3)] * self.n_cones

    def cost(self) -> tuple[sparse.csc_matrix, Array, Array]:
        """The cost's pattern, and of its numbers the parts that are scaled and those that are not."""
        following = np.append(ACCELERATION_WEIGHT[1:], 0.0)
        diagonal, slacks = np.zeros(self.n), np.zeros(self.n)
        stages = diagonal[: 4 * N].reshape(N, 4)
        stages[:, :2] = 2.0 * POSITION_WEIGHT[:, None]
        stages[:, 2:] = 2.0 * (VELOCITY_WEIGHT + ACCELERATION_WEIGHT + following)[:, None]
        prices = np.array([PRICES[name] for name in self.slacks])
        slacks[4 * N :] = np.tile(2.0 * prices[:, 1] * SLACK_UNIT**2, N)
        off = np.repeat(-2.0 * ACCELERATION_WEIGHT[1:], 2)
        rows = np.concatenate([np.arange(self.n), self.v[:-1].ravel()])
        columns = np.concatenate([np.arange(self.n), self.v[1:].ravel()])
        order = np.lexsort((rows, columns))
        indptr = np.searchsorted(columns[order], np.arange(self.n + 1))
        scaled = np.concatenate([diagonal, off])[order] / COST_UNIT
        fixed = np.concatenate([slacks, np.zeros(len(off))])[order] / COST_UNIT
        pattern = sparse.csc_matrix((scaled + fixed, rows[order], indptr), shape=(self.n, self.n))
        return pattern, scaled, fixed

    def numbers(self, horizon: Horizon, about: Linearisation) -> tuple[Array, Array, Array, Array]:
        """Values of P and A in the order of their columns, q and b."""
        dt, mean, signs = STEPS[:, None], about.mean, np.array([1.0, -1.0])[None, :, None]
        gap = np.concatenate([[STEPS[0]], STEPS[:-1]])
        lead = COURSE_LAG / (0.5 * (STEPS + gap))
        along = signs * (mean / dt)[:, None, :]
        side = starboard(mean)
        ahead = (mean * (0.5 * HEADING_RATE_MAX))[:, None, :]
        newest = signs * (side * ((1.0 + lead) / STEPS)[:, None])[:, None, :]
        before = signs * (side * (lead / gap)[:, None])[:, None, :]
        last = -newest - before - ahead
        normals = about.disc_normals
        entries = np.concatenate(
            [
                along.ravel(),
                -along[1:].ravel(),
                -about.directions[1:].ravel(),
                (newest - ahead).ravel(),
                last[1:].ravel(),
                before[2:].ravel(),
                np.tile(horizon.edge_normals.ravel(), N),
                -normals.ravel(),
                -normals[:, 1:].ravel(),
                self.constant,
            ]
        )
        velocity, goal = horizon.velocity, horizon.goal
        # Linear cost.
        q = np.zeros(self.n)
        stages = q[: 4 * N].reshape(N, 4)
        stages[:, 2:] = (-2.0 * horizon.scale / COST_UNIT) * VELOCITY_WEIGHT[:, None] * horizon.goal_velocity[1:]
        stages[0, 2:] -= (2.0 * horizon.scale / COST_UNIT) * ACCELERATION_WEIGHT[0] * velocity
        q[4 * N :] = np.tile([PRICES[name][0] * SLACK_UNIT / COST_UNIT for name in self.slacks], N)
        # Right-hand side.
        b = np.zeros(self.m)
        moved = b[: 2 * N].reshape(N, 2)
        moved[:] = (horizon.current * dt - np.diff(goal, axis=0)) / LENGTH_UNIT
        moved[0] += (0.5 * STEPS[0] * velocity - goal[0]) / LENGTH_UNIT
        limit = b[2 * N : 4 * N].reshape(N, 2)
        limit[:] = ACCELERATION_MAX + signs[0, :, 0] * about.disturbance[:, None]
        limit[0] += along[0] @ velocity
        b[4 * N : 5 * N] = -horizon.speed_min
        turn = b[5 * N : 7 * N].reshape(N, 2)
        turn[0] = (newest[0] + ahead[0]) @ velocity + lead[0] * (signs[0] * side[0]) @ horizon.acceleration
        turn[1] = -before[1] @ velocity
        b[self.rows_speed : self.rows_range : 3] = about.speeds_max
        if self.shape.n_edges:
            room = horizon.edge_offsets - goal[1:] @ horizon.edge_normals.T
            b[self.rows_area : self.rows_disc] = room.ravel() / LENGTH_UNIT
        if self.shape.n_discs:
            reach = horizon.disc_radii[:, None] + sag(horizon)
            centres = horizon.disc_centres[:, None, :]
            end = (normals * (goal[1:] - centres)).sum(axis=2) - reach
            start = (normals * (goal[:-1] - centres)).sum(axis=2) - reach
            b[self.rows_disc : self.rows_start] = end.T.ravel() / LENGTH_UNIT
            b[self.rows_start : self.rows_speed] = start[:, 1:].T.ravel() / LENGTH_UNIT
        if self.shape.n_ranges:
            cones = b[self.rows_range :].reshape(N, self.shape.n_ranges, 3)
            cones[:, :, 0] = horizon.range_radii[:, 1:].T / LENGTH_UNIT
            cones[:, :, 1:] = (goal[1:, None, :] - horizon.range_centres[:, 1:].transpose(1, 0, 2)) / LENGTH_UNIT
        return horizon.scale * self.q_cost + self.q_slack, entries[self.order], q, b


class ByHand:
    """Writes the numbers of the program itself, and keeps a Clarabel solver for each shape."""

    def __init__(self) -> None:
        self.kept: dict[Shape, tuple[Pattern, Any]] = {}
        self.seconds = 0.0
        self.settings = clarabel.DefaultSettings()
        for name, value in SOLVER_SETTINGS.items():
            setattr(self.settings, name, value)

    def solve(self, horizon: Horizon, about: Linearisation) -> Solved:
        kept = self.kept.get(horizon.shape)
        pattern = kept[0] if kept else Pattern(horizon.shape)
        quadratic, entries, q, b = pattern.numbers(horizon, about)
        start = time.thread_time()
        if kept:
            solver = kept[1]
            solver.update(P=quadratic, q=q, A=entries, b=b)
        else:
            pattern.quadratic.data[:] = quadratic
            pattern.constraints.data[:] = entries
            solver = clarabel.DefaultSolver(pattern.quadratic, q, pattern.constraints, b, pattern.cones, self.settings)
            self.kept[horizon.shape] = pattern, solver
        found = solver.solve()
        x = np.array(found.x)
        self.seconds += time.thread_time() - start
        stages = x[: 4 * N].reshape(N, 4)
        positions = np.vstack([np.zeros(2), horizon.goal[1:] + LENGTH_UNIT * stages[:, :2]])
        velocities = np.vstack([horizon.velocity, stages[:, 2:]])
        return Solved(positions, velocities, found.obj_val, found.iterations, str(found.status))


# ---- with CVXPY


class Stated:
    """The problem of a shape in CVXPY's words, its data parameters: stated and compiled once."""

    def __init__(self, shape: Shape) -> None:
        self.shape, self.seconds = shape, 0.0
        self.d, self.v = cp.Variable((N + 1, 2)), cp.Variable((N + 1, 2))
        slacks = {name: cp.Variable(N, nonneg=True) for name in shape.slacks}
        xi = {name: SLACK_UNIT * slack for name, slack in slacks.items()}
        self.before = cp.Variable(2)  # acceleration until now
        self.start, self.velocity = cp.Parameter(2), cp.Parameter(2)
        self.acceleration, self.drift = cp.Parameter(2), cp.Parameter((N, 2))
        self.scale, self.wanted = cp.Parameter(nonneg=True), cp.Parameter((N, 2))
        self.direction, self.mean, self.side = (cp.Parameter((N, 2)) for _ in range(3))
        self.most, self.least = cp.Parameter(N), cp.Parameter(N)
        self.speed_min, self.speed_max = cp.Parameter(), cp.Parameter(N)
        dt, gap = STEPS[:, None], np.concatenate([[STEPS[0]], STEPS[:-1]])[:, None]
        d, v = self.d, self.v
        a = cp.multiply(1.0 / dt, v[1:] - v[:-1])
        change = a - cp.vstack([cp.reshape(self.before, (1, 2), order="C"), a[:-1]])
        asked = a + cp.multiply(COURSE_LAG / (0.5 * (dt + gap)), change)

        def along(parameter: cp.Parameter, vectors: cp.Expression) -> cp.Expression:
            return cp.sum(cp.multiply(parameter, vectors), axis=1)

        rate = HEADING_RATE_MAX * along(self.mean, 0.5 * (v[1:] + v[:-1])) + xi["motion"]
        constraints = [
            d[0] == self.start,
            v[0] == self.velocity,
            self.before == self.acceleration,
            d[1:] - d[:-1] - cp.multiply(0.5 * dt / LENGTH_UNIT, v[1:] + v[:-1]) == self.drift,
            along(self.mean, a) <= self.most,
            -along(self.mean, a) <= self.least,
            along(self.direction, v[1:]) >= self.speed_min - xi["motion"],
            along(self.side, asked) <= rate,
            -along(self.side, asked) <= rate,
            cp.SOC(self.speed_max, v[1:], axis=1),
        ]
        self.ranges = [(cp.Parameter(N), cp.Parameter((N, 2))) for _ in range(shape.n_ranges)]
        for i, (radius, away) in enumerate(self.ranges):
            slack = xi["range" if i < shape.n_named_ranges else "other_range"]
            constraints.append(cp.SOC(radius + slack / LENGTH_UNIT, d[1:] + away, axis=1))
        self.edges = [(cp.Parameter(2), cp.Parameter(N)) for _ in range(shape.n_edges)]
        for normal, room in self.edges:
            constraints.append(d[1:] @ normal <= room + xi["area"] / LENGTH_UNIT)
        self.discs = [(cp.Parameter((N, 2)), cp.Parameter(N), cp.Parameter(N - 1)) for _ in range(shape.n_discs)]
        for normal, end, start in self.discs:
            out = xi["keep_out"] / LENGTH_UNIT
            constraints.append(-along(normal, d[1:]) <= end + out)
            constraints.append(-along(normal[1:], d[1:-1]) <= start + out[1:])
        square = cp.sum_squares(cp.multiply(np.sqrt(POSITION_WEIGHT)[:, None], d[1:]))
        square += cp.sum_squares(cp.multiply(np.sqrt(VELOCITY_WEIGHT)[:, None], v[1:]))
        square += cp.sum_squares(cp.multiply(np.sqrt(ACCELERATION_WEIGHT)[:, None], v[1:] - v[:-1]))
        cost = self.scale * square - cp.sum(cp.multiply(self.wanted, v[1:]))
        for name, slack in xi.items():
            linear, quadratic = PRICES[name]
            cost += linear * cp.sum(slack) + quadratic * cp.sum_squares(slack)
        self.problem = cp.Problem(cp.Minimize(cost / COST_UNIT), constraints)

    def solve(self, horizon: Horizon, about: Linearisation) -> None:
        goal = horizon.goal
        self.start.value, self.velocity.value = -goal[0] / LENGTH_UNIT, horizon.velocity
        self.acceleration.value = horizon.acceleration
        self.drift.value = (horizon.current * STEPS[:, None] - np.diff(goal, axis=0)) / LENGTH_UNIT
        self.scale.value = horizon.scale
        self.wanted.value = 2.0 * horizon.scale * VELOCITY_WEIGHT[:, None] * horizon.goal_velocity[1:]
        self.direction.value, self.mean.value = about.directions[1:], about.mean
        self.side.value = starboard(about.mean)
        self.most.value, self.least.value = ACCELERATION_MAX + about.disturbance, ACCELERATION_MAX - about.disturbance
        self.speed_min.value, self.speed_max.value = horizon.speed_min, about.speeds_max
        for i, (radius, away) in enumerate(self.ranges):
            radius.value = horizon.range_radii[i, 1:] / LENGTH_UNIT
            away.value = (goal[1:] - horizon.range_centres[i, 1:]) / LENGTH_UNIT
        for i, (normal, room) in enumerate(self.edges):
            normal.value = horizon.edge_normals[i]
            room.value = (horizon.edge_offsets[i] - goal[1:] @ horizon.edge_normals[i]) / LENGTH_UNIT
        for i, (normals, end, start) in enumerate(self.discs):
            reach = horizon.disc_radii[i] + sag(horizon)
            normals.value = about.disc_normals[i]
            off = goal - horizon.disc_centres[i]
            end.value = ((normals.value * off[1:]).sum(axis=1) - reach) / LENGTH_UNIT
            start.value = (((normals.value * off[:-1]).sum(axis=1) - reach) / LENGTH_UNIT)[1:]
        self.problem.solve(solver=cp.CLARABEL, enforce_dpp=True, **SOLVER_SETTINGS)


class WithCvxpy:
    """States the problem in CVXPY once for each shape, and sets its parameters anew."""

    def __init__(self) -> None:
        self.kept: dict[Shape, Stated] = {}
        self.seconds = 0.0

    def solve(self, horizon: Horizon, about: Linearisation) -> Solved:
        stated = self.kept.get(horizon.shape)
        if stated is None:
            stated = self.kept[horizon.shape] = Stated(horizon.shape)
        stated.solve(horizon, about)
        stats = stated.problem.solver_stats
        # A solver that CVXPY keeps adds up its time.
        self.seconds += stats.solve_time - (stated.seconds if stated.seconds < stats.solve_time else 0.0)
        stated.seconds = stats.solve_time
        positions = np.vstack([np.zeros(2), horizon.goal[1:] + LENGTH_UNIT * stated.d.value[1:]])
        velocities = np.vstack([horizon.velocity, stated.v.value[1:]])
        return Solved(positions, velocities, stated.problem.value, stats.num_iters, stated.problem.status)


SOLVERS: dict[str, Callable[[], Solver]] = {"hand": ByHand, "cvxpy": WithCvxpy}


# ---- the plan


def plan(snapshot: Any, solver: Solver) -> dict:
    """The answer: the best of what sequential convex programming makes of the guesses."""
    horizon = horizon_of(snapshot)
    best, solves, iterations = None, 0, 0
    for positions, velocities in guesses(horizon):
        latest = None
        for _ in range(SCP_ITERATIONS):
            about = linearised(horizon, positions, velocities)
            found = solver.solve(horizon, about)
            solves, iterations = solves + 1, iterations + found.iterations
            if found.status not in ("Solved", "AlmostSolved", "optimal", "optimal_inaccurate"):
                break
            latest = found
            positions, velocities = found.positions, found.velocities
            turned = (directions_of(velocities) * about.directions).sum(axis=1).min()
            if turned > CONVERGED_COSINE:
                break
        if latest is not None and (best is None or latest.objective < best.objective):
            best = latest
    if best is None:
        raise ArithmeticError("no program was solved")
    return answer(horizon, best, solves, iterations)


def answer(horizon: Horizon, best: Solved, solves: int, iterations: int) -> dict:
    """References that the craft's loops make the plan of, and the trajectory in (north, east)."""
    velocities = best.velocities
    at_lag = [np.interp(COURSE_LAG + HALF_HOLD, TIMES, velocities[:, i]) for i in range(2)]
    heading = math.remainder(horizon.heading + math.atan2(at_lag[1], at_lag[0]), math.tau)
    ahead = math.hypot(*(np.interp(SURGE_LAG, TIMES, velocities[:, i]) for i in range(2)))
    surge = float(horizon.velocity[0])
    speed = surge + (SURGE_LAG + HALF_HOLD) * (ahead - surge) / SURGE_LAG
    speed = min(max(speed, horizon.speed_min), horizon.speed_max)
    positions = horizon.origin + best.positions @ horizon.axes.T
    speeds = np.sqrt((velocities * velocities).sum(axis=1))
    headings = np.arctan2(*(directions_of(velocities) @ horizon.axes.T).T[::-1])
    off = ((best.positions - horizon.goal) ** 2).sum(axis=1)
    columns = [horizon.now + TIMES, positions[:, 0], positions[:, 1], speeds, headings]
    names = ("t_s", "north_m", "east_m", "speed_mps", "heading_rad")
    points = np.stack(columns, axis=1).tolist()
    return {
        "schema_version": "1.0",
        "outcome": "ok",
        "method": "mpc",
        "reference": {
            "speed_mps": speed,
            "heading_rad": heading,
            "heading_deg": math.degrees(heading) % 360.0,
            "valid_until_s": horizon.now + VALIDITY,
        },
        "predicted": {"rms_error_m": math.sqrt(np.trapezoid(off, TIMES) / TIMES[-1])},
        "solver": {"status": best.status.lower(), "scp_iterations": solves, "iterations": iterations},
        "trajectory": [dict(zip(names, point, strict=True)) for point in points],
    }
