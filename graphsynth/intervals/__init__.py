"""Rigorous intervals: arithmetic with outward rounding, proofs of roots, certified pavings.

Names are resolved on first use.  Importing the package checks that the processor rounds to nearest and keeps
subnormal numbers, every public solve checks it again; single operations give the same bits in any mode.
"""

import lazy_loader as _lazy

from graphsynth.intervals.guard import check_rounding

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)

check_rounding()
