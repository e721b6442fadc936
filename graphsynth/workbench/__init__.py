"""The workbench: a page on which mechanisms are drawn, dragged and kept, written as files that open from a disk."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
