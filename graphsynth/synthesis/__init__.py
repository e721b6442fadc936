"""The enumerator: contracted graphs, placement of links and joints, orbits, counting, shards."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
