"""Compiled kernels of planar dynamics; coordinates are those of the centres of mass, see :mod:`..tables`."""

from graphsynth.core.compilation import named

_HERE = "graphsynth.dynamics.kernels"
augmented_stages, project_state = named(f"{_HERE}.augmented", "augmented_stages", "project_state")
(one_coordinate_stages,) = named(f"{_HERE}.one_coordinate", "one_coordinate_stages")
accelerate_partitioned, partitioned_stages, place_partitioned = named(
    f"{_HERE}.partitioned", "accelerate_partitioned", "partitioned_stages", "place_partitioned"
)
friction_loads, friction_unit = named(f"{_HERE}.rubbing", "friction_loads", "friction_unit")
(accelerate,) = named(f"{_HERE}.solving", "accelerate")
constraint_system, finish, load_vector, state_rows = named(
    f"{_HERE}.systems", "constraint_system", "finish", "load_vector", "state_rows"
)
