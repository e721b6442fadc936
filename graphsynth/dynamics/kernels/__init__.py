"""Compiled kernels of planar dynamics; coordinates are those of the centres of mass, see :mod:`..tables`."""

from graphsynth.dynamics.kernels.augmented import augmented_stages as augmented_stages
from graphsynth.dynamics.kernels.augmented import project_state as project_state
from graphsynth.dynamics.kernels.one_coordinate import one_coordinate_stages as one_coordinate_stages
from graphsynth.dynamics.kernels.partitioned import accelerate_partitioned as accelerate_partitioned
from graphsynth.dynamics.kernels.partitioned import partitioned_stages as partitioned_stages
from graphsynth.dynamics.kernels.partitioned import place_partitioned as place_partitioned
from graphsynth.dynamics.kernels.rubbing import friction_loads as friction_loads
from graphsynth.dynamics.kernels.rubbing import friction_unit as friction_unit
from graphsynth.dynamics.kernels.solving import accelerate as accelerate
from graphsynth.dynamics.kernels.solving import factor_rows as factor_rows
from graphsynth.dynamics.kernels.solving import least_step as least_step
from graphsynth.dynamics.kernels.solving import solve_rows as solve_rows
from graphsynth.dynamics.kernels.systems import constraint_system as constraint_system
from graphsynth.dynamics.kernels.systems import finish as finish
from graphsynth.dynamics.kernels.systems import load_vector as load_vector
from graphsynth.dynamics.kernels.systems import motor_torque as motor_torque
from graphsynth.dynamics.kernels.systems import state_rows as state_rows
