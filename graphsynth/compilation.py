"""Keeping the cache of compiled kernels honest.

numba keeps a compiled function as long as its own source file is unchanged, but the function also contains constants
and functions of other kernel modules.  After an update of one of those, a kept function would be silently wrong.  So
every kernel module calls ``drop_stale_kernels`` before its functions are loaded: when any kernel source of the package
has changed since the cache was made, the cache is dropped, and the kernels are compiled anew on first use.
"""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path

__all__ = ["drop_stale_kernels"]

_STAMP = "kernels.sha256"


def _kernel_sources(package: Path) -> list[Path]:
    return sorted({*package.rglob("kernels.py"), *package.rglob("kernels/*.py")})


@cache
def drop_stale_kernels(package: Path | None = None) -> bool:
    """Drop the compiled kernels of the package if any kernel source has changed; return whether it had.

    A cache that cannot be written is left alone: then numba keeps another one, by modification time, for each user.
    """
    package = Path(__file__).parent if package is None else package
    digest = sha256()
    for source in _kernel_sources(package):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes())
    stamp = package / "__pycache__" / _STAMP
    try:
        if stamp.is_file() and stamp.read_text() == digest.hexdigest():
            return False
        for pattern in ("*.nbi", "*.nbc"):
            for kept in package.rglob(pattern):
                kept.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(digest.hexdigest())
    except OSError:
        return False
    return True
