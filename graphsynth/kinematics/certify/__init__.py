"""Certificates: statements on poses, motions and turns that are proved in ball arithmetic.

This file loads nothing: every name is resolved on first use.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
