"""Stiff and extreme cases: what is right, what the library gives, how far apart they are.

Importing loads nothing; a case is imported when it runs.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
