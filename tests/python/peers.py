"""Solvers other than the planner's, made to solve the planner's cone programs over and over.

PIQP and OSQP know no cones of second order. Each becomes an octagon within it, so that the programs have more rows,
what they allow is a little less, and the first velocity is another. HPIPM is missing: a wheel (comma-deps-acados) has
its library, but no Python interface.
"""

import json
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path as File

import clarabel
import cvxpy as cp
import numpy as np
import osqp
import piqp
import qoco
from scipy import sparse

from oracle import matrix

TOLERANCE = 1e-6  # that of the planner for feasibility; for optimality its is tighter
FIRST_ORDER_TOLERANCE = 1e-4
FIRST_ORDER_ITERATIONS = 20_000
N_STATES = 4  # columns of a stage ahead of its slacks
#: Half-planes s_0 cos(pi/8) >= s_1 cos a + s_2 sin a: an octagon within the circle of radius s_0.
OCTAGON = np.array(
    [[np.cos(np.pi / 8), -np.cos(a), -np.sin(a)] for a in np.arange(8) * np.pi / 4 + np.pi / 8]
)


@dataclass(frozen=True)
class ConeProgram:
    """minimise 1/2 x'Px + q'x subject to Ax + s = b: first equations, then s >= 0, then cones of three."""

    upper: sparse.csc_matrix
    linear: np.ndarray
    rows: sparse.csc_matrix
    bounds: np.ndarray
    n_equations: int
    n_inequalities: int
    n_cones: int
    velocity_columns: list[int]
    solution: np.ndarray

    @staticmethod
    def read(file: File) -> "ConeProgram":
        dump = json.loads(file.read_text())
        (zero, n_equations), (nonnegative, n_inequalities), *cones = [
            (cone["type"], cone["dim"]) for cone in dump["cones"]
        ]
        if (zero, nonnegative) != ("zero", "nonneg") or any(cone != ("soc", 3) for cone in cones):
            raise ValueError(f"{file} has other cones")
        return ConeProgram(
            upper=matrix(dump["P"]),
            linear=np.array(dump["q"]),
            rows=matrix(dump["A"]),
            bounds=np.array(dump["b"]),
            n_equations=n_equations,
            n_inequalities=n_inequalities,
            n_cones=len(cones),
            velocity_columns=dump["v1"]["columns"],
            solution=np.array(dump["solution"]["x"]),
        )

    def flat(self) -> sparse.csr_matrix:
        """What turns the slacks of the rows into those of the program with octagons for cones."""
        identity = sparse.identity(self.n_equations + self.n_inequalities)
        return sparse.block_diag([identity, sparse.kron(sparse.identity(self.n_cones), OCTAGON)], "csr")


@dataclass(frozen=True)
class Answer:
    """What a solver found, how long by its own clock, s, and whether it is sure."""

    x: np.ndarray
    own_seconds: float
    sure: bool


Solve = Callable[[], Answer]


def on_one_pattern(matrices: Iterable[sparse.spmatrix]) -> list[sparse.csc_matrix]:
    """The matrices with places for all that is not zero in any of them."""
    matrices = [matrix.tocsc() for matrix in matrices]
    union = sum(abs(matrix) for matrix in matrices).tocsc()
    union.sort_indices()
    places = union.tocoo()
    values = [np.asarray(matrix[places.row, places.col]).ravel() for matrix in matrices]
    return [sparse.csc_matrix((value, union.indices, union.indptr), shape=union.shape) for value in values]


def with_clarabel(programs: list[ConeProgram]) -> list[Solve]:
    first = programs[0]
    cones = [clarabel.ZeroConeT(first.n_equations), clarabel.NonnegativeConeT(first.n_inequalities)]
    cones += [clarabel.SecondOrderConeT(3)] * first.n_cones
    settings = clarabel.DefaultSettings()
    settings.verbose = False

    def solve(program: ConeProgram) -> Answer:
        solver = clarabel.DefaultSolver(
            program.upper, program.linear, program.rows, program.bounds, cones, settings
        )
        found = solver.solve()
        return Answer(np.array(found.x), found.solve_time, found.status == clarabel.SolverStatus.Solved)

    return [lambda program=program: solve(program) for program in programs]


def with_qoco(programs: list[ConeProgram], **settings: float) -> list[Solve]:
    first, n = programs[0], programs[0].n_equations
    uppers = on_one_pattern(program.upper for program in programs)
    equations = on_one_pattern(program.rows[:n] for program in programs)
    cones = on_one_pattern(program.rows[n:] for program in programs)
    solver = qoco.QOCO()
    solver.setup(
        *(len(first.linear), len(first.bounds) - n, n),
        *(uppers[0], first.linear, equations[0], first.bounds[:n], cones[0], first.bounds[n:]),
        *(first.n_inequalities, first.n_cones, np.full(first.n_cones, 3)),
        **settings,
    )

    def solve(i: int) -> Answer:
        solver.update_matrix_data(P=uppers[i].data, A=equations[i].data, G=cones[i].data)
        bounds = programs[i].bounds
        solver.update_vector_data(c=programs[i].linear, b=bounds[:n], h=bounds[n:])
        found = solver.solve()
        return Answer(np.array(found.x), found.solve_time_sec, found.status == "QOCO_SOLVED")

    return [lambda i=i: solve(i) for i in range(len(programs))]


def with_piqp(programs: list[ConeProgram], kkt_solver: piqp.KKTSolver) -> list[Solve]:
    first, n = programs[0], programs[0].n_equations
    order = stage_by_stage(first)
    # The multistage backend looks for blocks among neighbours.
    wholes = on_one_pattern(
        (program.upper + sparse.triu(program.upper, 1).T)[order][:, order] for program in programs
    )
    rows = on_one_pattern((first.flat() @ program.rows)[:, order] for program in programs)
    bounds = [first.flat() @ program.bounds for program in programs]
    # Rows of one variable are limits of it.
    simple = np.flatnonzero((np.diff(rows[0].tocsr().indptr) == 1) & (np.arange(len(bounds[0])) >= n))
    others = np.setdiff1d(np.arange(n, len(bounds[0])), simple)
    data = []
    for program, whole, row, bound in zip(programs, wholes, rows, bounds, strict=True):
        limits = {"x_l": np.full(len(order), -np.inf), "x_u": np.full(len(order), np.inf)}
        single = row[simple].tocoo()
        for i, column, coefficient in zip(single.row, single.col, single.data, strict=True):
            limit, closer = (limits["x_u"], min) if coefficient > 0 else (limits["x_l"], max)
            limit[column] = closer(limit[column], bound[simple][i] / coefficient)
        equations = {"A": row[:n].tocsc(), "b": bound[:n]}
        inequalities = {"G": row[others].tocsc(), "h_u": bound[others]}
        data.append({"P": whole, "c": program.linear[order], **equations, **inequalities, **limits})
    solver = piqp.SparseSolver()
    solver.settings.compute_timings = True
    solver.settings.kkt_solver = kkt_solver
    for name in ["eps_abs", "eps_rel", "eps_duality_gap_abs", "eps_duality_gap_rel"]:
        setattr(solver.settings, name, TOLERANCE)
    solver.setup(**data[0])
    back = np.argsort(order)

    def solve(numbers: dict) -> Answer:
        solver.update(**numbers)
        status = solver.solve()
        info = solver.result.info
        own = info.update_time + info.solve_time
        return Answer(np.array(solver.result.x)[back], own, status == piqp.PIQP_SOLVED)

    return [lambda numbers=numbers: solve(numbers) for numbers in data]


def stage_by_stage(program: ConeProgram) -> np.ndarray:
    """Columns in the order of the stages; in a program the slacks of all stages are last."""
    n_stages = program.n_equations // 2
    states, slacks = np.split(np.arange(len(program.linear)), [N_STATES * n_stages])
    return np.hstack([states.reshape(n_stages, -1), slacks.reshape(n_stages, -1)]).ravel()


def with_osqp(programs: list[ConeProgram]) -> list[Solve]:
    first, n = programs[0], programs[0].n_equations
    uppers = on_one_pattern(program.upper for program in programs)
    rows = on_one_pattern(first.flat() @ program.rows for program in programs)
    above = [first.flat() @ program.bounds for program in programs]
    below = [np.concatenate([bound[:n], np.full(len(bound) - n, -np.inf)]) for bound in above]
    solver = osqp.OSQP()
    solver.setup(
        *(uppers[0], first.linear, rows[0], below[0], above[0]),
        eps_abs=FIRST_ORDER_TOLERANCE,
        eps_rel=FIRST_ORDER_TOLERANCE,
        max_iter=FIRST_ORDER_ITERATIONS,
        verbose=False,
    )

    def solve(i: int) -> Answer:
        solver.update(Px=uppers[i].data, Ax=rows[i].data, q=programs[i].linear, l=below[i], u=above[i])
        found = solver.solve(raise_error=False)
        own = found.info.update_time + found.info.solve_time
        return Answer(np.array(found.x), own, found.info.status_val == osqp.SolverStatus.OSQP_SOLVED)

    return [lambda i=i: solve(i) for i in range(len(programs))]


def with_fresh_cvxpy(programs: list[ConeProgram]) -> list[Solve]:
    def solve(program: ConeProgram) -> Answer:
        x = cp.Variable(len(program.linear))
        whole = program.upper + sparse.triu(program.upper, 1).T
        cost = 0.5 * cp.quad_form(x, cp.psd_wrap(whole)) + program.linear @ x
        problem = cp.Problem(cp.Minimize(cost), constraints(program, program.bounds - program.rows @ x))
        return solved(problem, x)

    return [lambda program=program: solve(program) for program in programs]


def with_parametrised_cvxpy(programs: list[ConeProgram]) -> list[Solve]:
    first = programs[0]
    # A cost that depends on parameters is to be the square of what is linear in them.
    factors = on_one_pattern(
        sparse.csc_matrix(np.linalg.cholesky((program.upper + sparse.triu(program.upper, 1).T).toarray()).T)
        for program in programs
    )
    rows = on_one_pattern(program.rows for program in programs)
    x = cp.Variable(len(first.linear))
    factor, row = (cp.Parameter(m.shape, sparsity=m.tocoo().coords) for m in (factors[0], rows[0]))
    linear, bounds = cp.Parameter(len(first.linear)), cp.Parameter(len(first.bounds))
    cost = 0.5 * cp.sum_squares(factor @ x) + linear @ x
    problem = cp.Problem(cp.Minimize(cost), constraints(first, bounds - row @ x))

    def solve(i: int) -> Answer:
        factor.value_sparse, row.value_sparse = coo[i]
        linear.value, bounds.value = programs[i].linear, programs[i].bounds
        return solved(problem, x)

    coo = [(sparse.coo_array(f), sparse.coo_array(r)) for f, r in zip(factors, rows, strict=True)]
    return [lambda i=i: solve(i) for i in range(len(programs))]


def solved(problem: cp.Problem, x: cp.Variable) -> Answer:
    with warnings.catch_warnings():
        # That it is not sure shows in its status, too.
        warnings.simplefilter("ignore")
        problem.solve(solver=cp.CLARABEL)
    return Answer(x.value, problem.solver_stats.solve_time, problem.status == cp.OPTIMAL)


def constraints(program: ConeProgram, slack: cp.Expression) -> list[cp.Constraint]:
    equations, inequalities = program.n_equations, program.n_equations + program.n_inequalities
    balls = cp.reshape(slack[inequalities:], (3, program.n_cones), order="F")
    return [
        slack[:equations] == 0,
        slack[equations:inequalities] >= 0,
        cp.SOC(balls[0], balls[1:]),
    ]


@dataclass(frozen=True)
class Peer:
    """A solver: how it is set up, which is not timed, and what is to be known of what is timed then."""

    name: str
    set_up: Callable[[list[ConeProgram]], list[Solve]]
    note: str


PEERS = [
    Peer("Clarabel as it comes, from Python", with_clarabel, "set-up included: another build of the same"),
    Peer(
        f"QOCO, {TOLERANCE:.0e}",
        lambda programs: with_qoco(programs, abstol=TOLERANCE, reltol=TOLERANCE),
        "updated",
    ),
    Peer("QOCO as it comes", with_qoco, "updated"),
    Peer(
        f"PIQP, {TOLERANCE:.0e}, sparse",
        lambda programs: with_piqp(programs, piqp.sparse_ldlt),
        "updated; octagons",
    ),
    Peer(
        f"PIQP, {TOLERANCE:.0e}, multistage",
        lambda programs: with_piqp(programs, piqp.sparse_multistage),
        "updated; octagons",
    ),
    Peer(
        f"OSQP, {FIRST_ORDER_TOLERANCE:.0e}",
        with_osqp,
        "updated, from the solution before; octagons",
    ),
    Peer("CVXPY with parameters, Clarabel", with_parametrised_cvxpy, "stated once; parameters set anew"),
    Peer("CVXPY, Clarabel", with_fresh_cvxpy, "stated anew"),
]
