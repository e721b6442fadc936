from .engine.batch import simulate_batch as simulate_batch
from .engine.gradients import (
    PoseGradients as PoseGradients,
    pose_gradients as pose_gradients,
    rate_gradients as rate_gradients,
)
from .engine.result import Motion as Motion
from .simulation import simulate as simulate
