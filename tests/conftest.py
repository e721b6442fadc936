"""Settings for the whole suite."""

from __future__ import annotations

from hypothesis import settings

collect_ignore = ["mutation"]  # a program, not tests

# An example may have to compile a kernel, or wait for the other worker: no deadline for one.  The same examples every
# time, so that two runs of one state agree; `--hypothesis-profile=fresh` draws new ones.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("fresh", deadline=None, print_blob=True)
settings.load_profile("fixed")
