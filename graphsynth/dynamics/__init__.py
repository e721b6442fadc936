"""Dynamics: masses, loads, motion and reactions of any planar mechanism; friction, motors and the named systems.

Every public name is resolved on first use, so that ``import graphsynth.dynamics`` is free.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
