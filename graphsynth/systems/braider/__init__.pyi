from .linkage import FourBar as FourBar
from .model import Braider as Braider, Thread as Thread
