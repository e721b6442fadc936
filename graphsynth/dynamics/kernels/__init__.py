"""Compiled kernels of planar dynamics; coordinates are those of the centres of mass, see :mod:`..tables`."""

from graphsynth.dynamics.kernels.augmented import augmented_stages, project_state
from graphsynth.dynamics.kernels.one_coordinate import one_coordinate_stages
from graphsynth.dynamics.kernels.partitioned import accelerate_partitioned, partitioned_stages, place_partitioned
from graphsynth.dynamics.kernels.rubbing import friction_loads, friction_unit
from graphsynth.dynamics.kernels.solving import accelerate, factor_rows, least_step, solve_rows
from graphsynth.dynamics.kernels.systems import constraint_system, load_vector, state_rows

__all__ = [
    "accelerate",
    "accelerate_partitioned",
    "augmented_stages",
    "constraint_system",
    "factor_rows",
    "friction_loads",
    "friction_unit",
    "least_step",
    "load_vector",
    "one_coordinate_stages",
    "partitioned_stages",
    "place_partitioned",
    "project_state",
    "solve_rows",
    "state_rows",
]  # fmt: skip
