"""Circle and ellipse with tolerances: the interval problem of the source, solved exactly and by Krawczyk's method.

Names are resolved on first use.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
