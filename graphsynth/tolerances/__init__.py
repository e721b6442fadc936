"""Tolerances as on a drawing: ISO 286 limits and fits, and tolerances of parts with the box of parameters they make.

Names are resolved on first use.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
