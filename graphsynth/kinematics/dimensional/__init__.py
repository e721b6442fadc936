"""Embodiment: dimensions for a mechanism graph, from an automatic sketch and a search.

`embody` and its result are in :mod:`.api`, goals in :mod:`.goals`, the automatic sketch in :mod:`.sketch`.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
