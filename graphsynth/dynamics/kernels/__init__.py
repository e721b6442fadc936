"""Compiled kernels of planar dynamics; coordinates are those of the centres of mass, see :mod:`..tables`."""

from graphsynth.dynamics.kernels.augmented import augmented_stages as augmented_stages, project_state as project_state
from graphsynth.dynamics.kernels.one_coordinate import one_coordinate_stages as one_coordinate_stages
from graphsynth.dynamics.kernels.partitioned import (
    accelerate_partitioned as accelerate_partitioned,
    partitioned_stages as partitioned_stages,
    place_partitioned as place_partitioned,
)
from graphsynth.dynamics.kernels.rubbing import friction_loads as friction_loads, friction_unit as friction_unit
from graphsynth.dynamics.kernels.solving import accelerate as accelerate
from graphsynth.dynamics.kernels.systems import (
    constraint_system as constraint_system,
    finish as finish,
    load_vector as load_vector,
    state_rows as state_rows,
)
