"""Loops of the interval operations over flat arrays; bounds in, bounds out."""

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import arithmetic


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
