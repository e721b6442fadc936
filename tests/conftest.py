"""Settings for the whole suite."""

from __future__ import annotations

import os
import tempfile

from hypothesis import settings

collect_ignore = ["mutation"]  # a program, not tests

# An example may have to compile a kernel, or wait for the other worker: no deadline for one.  The same examples every
# time, so that two runs of one state agree; `--hypothesis-profile=fresh` draws new ones.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("fresh", deadline=None, print_blob=True)
settings.load_profile("fixed")

# Programs that tests start find the byte code of the first one, even where none may be written beside the sources.
_bytecode = tempfile.TemporaryDirectory(prefix="bytecode-")
os.environ["PYTHONPYCACHEPREFIX"] = _bytecode.name
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
