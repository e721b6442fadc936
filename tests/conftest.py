"""Settings for the whole suite."""

from __future__ import annotations

import os

from hypothesis import settings

# An example may have to compile a kernel, or wait for the other worker: no deadline for one.
settings.register_profile("default", deadline=None)
# In CI the same examples every time, so that a change is judged by what it changed; everywhere else fresh ones.
settings.register_profile("ci", derandomize=True, deadline=None)
settings.load_profile("ci" if os.environ.get("CI") else "default")
