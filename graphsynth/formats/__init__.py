"""Files of graphs and mechanisms: graph6, JSON, GraphML, DOT, CSV, edge lists, matrices; models for other engines.

Every public name is resolved on first use, so that ``import graphsynth.formats`` is free.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
