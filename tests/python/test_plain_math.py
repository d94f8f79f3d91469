"""The scalar vehicles that speed is measured with are the NumPy vehicles."""

import numpy as np

from plain_math import PlainSurfaceCraft, PlainUnderwaterVehicle
from speed import HEADING, SPEED, simulated_auv, surface_craft

# The same equations in another order of operations: rounding, which the loops keep from growing.
ROUNDING = 1e-9


def test_the_scalar_surface_craft_is_the_numpy_one() -> None:
    craft = surface_craft()
    plain = PlainSurfaceCraft(craft)
    for _ in range(600):
        craft.step(SPEED, HEADING)
        plain.step(SPEED, HEADING)
    assert np.abs(craft.state - plain.state).max() < ROUNDING


def test_the_scalar_auv_is_the_numpy_one() -> None:
    vehicle = simulated_auv()
    plain = PlainUnderwaterVehicle(vehicle)
    # Past the first lane's end, and through five pitch reversals.
    for _ in range(5600):
        vehicle.step()
        plain.step()
    assert vehicle.state[1] > 2.0
    assert np.abs(vehicle.state - plain.state).max() < ROUNDING
