"""From a task to mechanisms that do it: solutions in closed form, searches, parts to make.

Names are resolved on first use.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
