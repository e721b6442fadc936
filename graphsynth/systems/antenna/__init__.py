"""The antenna pointing mechanism: a reflector on a gimbal, tilted about two axes by two cranks.

`PointingMechanism` is the entry; the modules behind its methods are loaded when a method needs them.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
