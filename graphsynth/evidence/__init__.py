"""Error against run time of every numerical method, and the stress cases.

A problem is one question and all methods that answer it; its rows hold error, time, reference and status.  Which
problems a scene has is given by strings (`graphsynth.evidence.rows`), imported when they are measured.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
