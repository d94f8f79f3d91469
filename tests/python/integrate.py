"""From a derivative to the state one step later: a fixed-step method and an adaptive one."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

Vector = npt.NDArray[np.float64]
Derivative = Callable[[Vector], Vector]
Integrator = Callable[[Derivative, Vector, float], Vector]


def rk4(derivative: Derivative, state: Vector, step: float) -> Vector:
    """The state after `step` s by one step of the classical Runge-Kutta method of fourth order."""
    k_1 = derivative(state)
    k_2 = derivative(state + 0.5 * step * k_1)
    k_3 = derivative(state + 0.5 * step * k_2)
    k_4 = derivative(state + step * k_3)
    return state + step / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4)


def adaptive(derivative: Derivative, state: Vector, duration: float) -> Vector:
    """The state after `duration` s by SciPy's eighth-order Dormand-Prince method, exact for our purposes."""
    solution = solve_ivp(
        lambda _, x: derivative(x), (0.0, duration), state, method="DOP853", rtol=1e-12, atol=1e-13
    )
    if not solution.success:
        raise ArithmeticError(solution.message)
    return solution.y[:, -1]
