"""graphsynth: from an integer equation to a proved verdict.

``import graphsynth`` loads nothing but this file: every public name is resolved on first use (PEP 562), so that a
script pays only for what it asks.
"""

import lazy_loader as _lazy

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
