from .engine.batch import simulate_batch as simulate_batch
from .engine.result import Motion as Motion
from .simulation import simulate as simulate
