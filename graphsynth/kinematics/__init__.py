"""Kinematics: the general planar engine, the lambda linkage, the planar parallel platform, the single-motor platform.

This file loads none of them: the public functions are resolved on first use, so that each scene pays for its own only.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
