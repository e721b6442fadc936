"""What binding costs: elastic energy, contact forces and drive torque beyond the limits of the joints.

Names are resolved on first use.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
