"""Loops of the interval operations and elementary functions over flat arrays; bounds in, bounds out."""

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import arithmetic, exponential, inverse, trigonometry


@kernel
def add(al, ah, bl, bh, lo, hi):
    """Add flat arrays."""
    for i in range(lo.size):
        lo[i], hi[i] = arithmetic.add(al[i], ah[i], bl[i], bh[i])


@kernel
def subtract(al, ah, bl, bh, lo, hi):
    """Differences of flat arrays."""
    for i in range(lo.size):
        lo[i], hi[i] = arithmetic.subtract(al[i], ah[i], bl[i], bh[i])


@kernel
def multiply(al, ah, bl, bh, lo, hi):
    """Products of flat arrays."""
    rare = 0
    for i in range(lo.size):
        low, high = arithmetic.multiply_plain(al[i], ah[i], bl[i], bh[i])
        lo[i], hi[i] = low, high
        rare += 1 if low != low else 0
    # the others afterwards, so that the loop above uses vector instructions
    if 16 * rare > lo.size:
        for i in range(lo.size):
            lo[i], hi[i] = arithmetic.multiply_any(al[i], ah[i], bl[i], bh[i])
    elif rare > 0:
        for i in range(lo.size):
            if lo[i] != lo[i]:
                lo[i], hi[i] = arithmetic.multiply_any(al[i], ah[i], bl[i], bh[i])


@kernel
def divide(al, ah, bl, bh, lo, hi):
    """Quotients of flat arrays."""
    for i in range(lo.size):
        lo[i], hi[i] = arithmetic.divide_plain(al[i], ah[i], bl[i], bh[i])
    for i in range(lo.size):  # the rare cases afterwards, so that the loop above uses vector instructions
        if lo[i] != lo[i]:
            lo[i], hi[i] = arithmetic.divide_any(al[i], ah[i], bl[i], bh[i])


@kernel
def square(al, ah, lo, hi):
    """Squares of a flat array."""
    for i in range(lo.size):
        lo[i], hi[i] = arithmetic.square(al[i], ah[i])


@kernel
def root(al, ah, lo, hi):
    """Square roots of a flat array."""
    for i in range(lo.size):
        lo[i], hi[i] = arithmetic.root(al[i], ah[i])


@kernel
def power(al, ah, n, lo, hi):
    """Integer powers of a flat array."""
    for i in range(lo.size):
        lo[i], hi[i] = arithmetic.power(al[i], ah[i], n)


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
