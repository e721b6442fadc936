"""Settings for the whole suite."""

from __future__ import annotations

import os

from hypothesis import settings

# In CI the same examples every time, so that a change is judged by what it changed; everywhere else fresh ones.
settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")
