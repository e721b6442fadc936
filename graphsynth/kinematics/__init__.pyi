from .simulation import (
    Motion as Motion,
)
from .simulation import (
    simulate as simulate,
)
from .simulation import (
    simulate_batch as simulate_batch,
)
