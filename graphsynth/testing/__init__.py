"""Hypothesis strategies for property tests of mechanisms, for users' test suites and for our own.

::

    from hypothesis import given
    from graphsynth.testing import chains

    @given(chains())
    def test_something(chain): ...

Every strategy reaches the corners that break code: smallest sizes, changes of class, empty and unbounded intervals,
legs out of reach.  hypothesis is imported when the first strategy is asked for, and only here.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
