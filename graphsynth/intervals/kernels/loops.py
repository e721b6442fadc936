"""Loops of the interval operations and elementary functions over flat arrays; bounds in, bounds out."""

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import arithmetic, exponential, inverse, quick, trigonometry


def _loop_of_one(name, operation):
    """Return the kernel that applies an operation of one interval to flat arrays, known by its name."""

    def loop(al, ah, lo, hi):
        for i in range(lo.size):
            lo[i], hi[i] = operation(al[i], ah[i])

    loop.__name__ = loop.__qualname__ = name
    return kernel(loop)


def _loop_of_quick(name, first, operation):
    """Return the kernel that applies ``first`` to all, in vector instructions, ``operation`` to what that leaves."""

    def loop(al, ah, lo, hi):
        for i in range(lo.size):
            lo[i], hi[i] = first(al[i], ah[i])
        for i in range(lo.size):
            if lo[i] != lo[i]:
                lo[i], hi[i] = operation(al[i], ah[i])

    loop.__name__ = loop.__qualname__ = name
    return kernel(loop)


def _loop_of_two(name, operation):
    """Return the kernel that applies an operation of two intervals to flat arrays, known by its name."""

    def loop(al, ah, bl, bh, lo, hi):
        for i in range(lo.size):
            lo[i], hi[i] = operation(al[i], ah[i], bl[i], bh[i])

    loop.__name__ = loop.__qualname__ = name
    return kernel(loop)


add = _loop_of_two("add", arithmetic.add)
subtract = _loop_of_two("subtract", arithmetic.subtract)
square = _loop_of_one("square", arithmetic.square)
root = _loop_of_one("root", arithmetic.root)
sin = _loop_of_quick("sin", quick.sin, trigonometry.sin)
cos = _loop_of_quick("cos", quick.cos, trigonometry.cos)
tan = _loop_of_one("tan", trigonometry.tan)
atan = _loop_of_quick("atan", quick.atan, inverse.atan)
asin = _loop_of_one("asin", inverse.asin)
acos = _loop_of_one("acos", inverse.acos)
exp = _loop_of_quick("exp", quick.exp, exponential.exp)
log = _loop_of_quick("log", quick.log, exponential.log)
atan2 = _loop_of_two("atan2", inverse.atan2)
hypot = _loop_of_two("hypot", exponential.hypot)


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
def power(al, ah, n, lo, hi):
    """Integer powers of a flat array."""
    for i in range(lo.size):
        lo[i], hi[i] = arithmetic.power(al[i], ah[i], n)
