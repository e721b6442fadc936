"""Analysis and design of the parallel platform: workspace, singularities, maps, statics, inverse design, rank check.

This file loads none of its modules: import the one you need, for instance `graphsynth.systems.platform.workspace`.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
