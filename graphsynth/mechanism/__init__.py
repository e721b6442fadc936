"""Dimensioned mechanisms: a graph, the geometry of its joints on the links, drivers and their motion laws.

The gallery of classic mechanisms is loaded on first use; everything else is imported from the modules.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
