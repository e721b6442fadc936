from .linkage import FourBar as FourBar
from .model import (
    Braider as Braider,
)
from .model import (
    Thread as Thread,
)
