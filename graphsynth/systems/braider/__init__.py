"""The braiding mechanism: four-bar linkage with switch and thread, driven by a synchronous motor through a train."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
