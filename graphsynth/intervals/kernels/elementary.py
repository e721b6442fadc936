"""Loops of the elementary functions over flat arrays; bounds in, bounds out."""

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import exponential, inverse, trigonometry


@kernel
def sin(al, ah, lo, hi):
    """Apply sin."""
    for i in range(lo.size):
        lo[i], hi[i] = trigonometry.sin(al[i], ah[i])


@kernel
def cos(al, ah, lo, hi):
    """Apply cos."""
    for i in range(lo.size):
        lo[i], hi[i] = trigonometry.cos(al[i], ah[i])


@kernel
def tan(al, ah, lo, hi):
    """Apply tan."""
    for i in range(lo.size):
        lo[i], hi[i] = trigonometry.tan(al[i], ah[i])


@kernel
def atan(al, ah, lo, hi):
    """Apply atan."""
    for i in range(lo.size):
        lo[i], hi[i] = inverse.atan(al[i], ah[i])


@kernel
def asin(al, ah, lo, hi):
    """Apply asin."""
    for i in range(lo.size):
        lo[i], hi[i] = inverse.asin(al[i], ah[i])


@kernel
def acos(al, ah, lo, hi):
    """Apply acos."""
    for i in range(lo.size):
        lo[i], hi[i] = inverse.acos(al[i], ah[i])


@kernel
def exp(al, ah, lo, hi):
    """Apply exp."""
    for i in range(lo.size):
        lo[i], hi[i] = exponential.exp(al[i], ah[i])


@kernel
def log(al, ah, lo, hi):
    """Apply log."""
    for i in range(lo.size):
        lo[i], hi[i] = exponential.log(al[i], ah[i])


@kernel
def atan2(al, ah, bl, bh, lo, hi):
    """Apply atan2."""
    for i in range(lo.size):
        lo[i], hi[i] = inverse.atan2(al[i], ah[i], bl[i], bh[i])


@kernel
def hypot(al, ah, bl, bh, lo, hi):
    """Apply hypot."""
    for i in range(lo.size):
        lo[i], hi[i] = exponential.hypot(al[i], ah[i], bl[i], bh[i])
