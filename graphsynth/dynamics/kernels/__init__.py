"""Compiled kernels of planar dynamics; coordinates are those of the centres of mass, see :mod:`..tables`."""

from graphsynth.dynamics.kernels.rates import constrained_rates, engine_state, minimal_rates, position_step, velocity_step
from graphsynth.dynamics.kernels.solving import accelerate, friction_loads, solve_rows
from graphsynth.dynamics.kernels.systems import constraint_system, load_vector, state_rows

__all__ = [
    "accelerate", "constrained_rates", "constraint_system", "engine_state", "friction_loads", "load_vector", "minimal_rates",
    "position_step", "solve_rows", "state_rows", "velocity_step",
]  # fmt: skip
