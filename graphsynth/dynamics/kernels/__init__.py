"""Compiled kernels of planar dynamics; coordinates are those of the centres of mass, see :mod:`..tables`."""

from graphsynth.dynamics.kernels.constrained import constrained_rates, constrained_stages, project_state
from graphsynth.dynamics.kernels.minimal import engine_state, minimal_rates, minimal_stages
from graphsynth.dynamics.kernels.solving import accelerate, factor_rows, friction_loads, least_step, solve_rows
from graphsynth.dynamics.kernels.systems import constraint_system, load_vector, state_rows

__all__ = [
    "accelerate", "constrained_rates", "constrained_stages", "constraint_system", "engine_state", "factor_rows",
    "friction_loads", "least_step", "load_vector", "minimal_rates", "minimal_stages", "project_state", "solve_rows",
    "state_rows",
]  # fmt: skip
