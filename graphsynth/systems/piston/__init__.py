"""Rotation to reciprocation with two structural groups, in spaces of mobility 3 and 2: the floating piston.

Every public name is resolved on first use, so that importing the package is free.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
