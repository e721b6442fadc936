"""Branch and prune for the intersection of a circle and an ellipse in the first quadrant, compiled.

Data of the problem: ``data = (ql, qh, el, eh, al, ah, bl, bh)`` with ``x^2 + y^2`` in [ql, qh] and
``alpha x^2 + beta y^2`` in [el, eh], alpha in [al, ah], beta in [bl, bh].
A box is ``(xl, xh, yl, yh)`` with bounds of at least 0; a queue holds boxes, first in, first out.

Bounds are stepped outward after every operation [Rump et al. 2009], exact or not: a box costs half as much as with
the tightest bounds, and the search needs speed, not the last digit.  What overflows becomes NaN or an infinite bound on
the safe side; every test is written so that NaN proves nothing.
"""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.rounding import ETA, PHI

EMPTY, UNIQUE, EXISTS, UNDECIDED, INNER = 0, 1, 2, 3, 4
HEAD, TAIL, TESTED, PROVED, KEPT = 0, 1, 2, 3, 4
GAIN, ROUNDS, INFLATIONS, POLISH = 0.9, 8, 6, 8


@kernel(forceinline=True)
def below(x):
    """Lower bound of a result rounded to nearest."""
    return x - (PHI * abs(x) + ETA)


@kernel(forceinline=True)
def above(x):
    """Upper bound of a result rounded to nearest."""
    return x + (PHI * abs(x) + ETA)


@kernel(forceinline=True)
def put(box, place):
    """Write a box into a place (a slice assignment compiles to far more)."""
    for k in range(4):
        place[k] = box[k]


@kernel
def levels(xl, xh, yl, yh, data):
    """Bounds of both left-hand sides over a box: circle lo, hi, ellipse lo, hi."""
    sl, sh, tl, th = below(xl * xl), above(xh * xh), below(yl * yl), above(yh * yh)
    sl, tl = max(sl, 0.0), max(tl, 0.0)
    ul, uh = below(sl * data[4]), above(sh * data[5])
    vl, vh = below(tl * data[6]), above(th * data[7])
    return below(sl + tl), above(sh + th), below(ul + vl), above(uh + vh)


@kernel
def classify(xl, xh, yl, yh, data):
    """EMPTY if an equation cannot hold in the box, INNER if both hold in all of it, else UNDECIDED."""
    cl, ch, ll, lh = levels(xl, xh, yl, yh, data)
    if cl > data[1] or ch < data[0] or ll > data[3] or lh < data[2]:
        return EMPTY
    if cl >= data[0] and ch <= data[1] and ll >= data[2] and lh <= data[3]:
        return INNER
    return UNDECIDED


@kernel
def image(xl, xh, yl, yh, data, out):
    """Krawczyk's image of a box into ``out``; returns the largest row sum of ``|I - Y L|``, infinite if Y fails."""
    zx, zy = 0.5 * (xl + xh), 0.5 * (yl + yh)
    am, bm = 0.5 * (data[4] + data[5]), 0.5 * (data[6] + data[7])
    scale = 0.5 / (zx * zy * (bm - am))
    p, q, r, s = bm * zy * scale, -zy * scale, -am * zx * scale, zx * scale
    size = abs(p) + abs(q) + abs(r) + abs(s)
    if not size < 1e300:
        return np.inf
    cl, ch, ll, lh = levels(zx, zx, zy, zy, data)
    cl, ch, ll, lh = below(cl - data[1]), above(ch - data[0]), below(ll - data[3]), above(lh - data[2])
    x2l, x2h, y2l, y2h = 2.0 * xl, 2.0 * xh, 2.0 * yl, 2.0 * yh
    axl, axh = below(x2l * data[4]), above(x2h * data[5])
    byl, byh = below(y2l * data[6]), above(y2h * data[7])
    dx = max(above(xh - zx), above(zx - xl))
    dy = max(above(yh - zy), above(zy - yl))
    # rows of I - Y L: only their magnitude counts, as X - z is taken symmetric
    m, n = _largest(p, x2l, x2h, q, axl, axh, 1.0), _largest(p, y2l, y2h, q, byl, byh, 0.0)
    fl, fh = _entry(p, cl, ch, q, ll, lh)
    reach = above(above(m * dx) + above(n * dy))
    out[0], out[1] = below(below(zx - fh) - reach), above(above(zx - fl) + reach)
    k, g = _largest(r, x2l, x2h, s, axl, axh, 0.0), _largest(r, y2l, y2h, s, byl, byh, 1.0)
    fl, fh = _entry(r, cl, ch, s, ll, lh)
    reach = above(above(k * dx) + above(g * dy))
    out[2], out[3] = below(below(zy - fh) - reach), above(above(zy - fl) + reach)
    known = out[0] <= out[1] and out[2] <= out[3]  # not so if one of them is NaN
    return max(m + n, k + g) if known else np.inf


@kernel(forceinline=True)
def _largest(c1, al, ah, c2, bl, bh, diagonal):
    """Upper bound of ``|diagonal - c1 [a] - c2 [b]|``."""
    lo, hi = _entry(c1, al, ah, c2, bl, bh)
    return max(above(diagonal - lo), above(hi - diagonal))


@kernel(forceinline=True)
def _entry(c1, al, ah, c2, bl, bh):
    """Enclose ``c1 [a] + c2 [b]``."""
    a, b = (al, ah) if c1 >= 0.0 else (ah, al)
    c, d = (bl, bh) if c2 >= 0.0 else (bh, bl)
    return below(below(c1 * a) + below(c2 * c)), above(above(c1 * b) + above(c2 * d))


@kernel
def contract(box, data, out):
    """Repeat Krawczyk's test while it gains; shrinks ``box``, returns status and the last norm."""
    norm = np.inf
    for _ in range(ROUNDS):
        xl, xh, yl, yh = box[0], box[1], box[2], box[3]
        kind = classify(xl, xh, yl, yh, data)
        if kind != UNDECIDED:
            return kind, norm
        norm = image(xl, xh, yl, yh, data, out)
        if not norm < np.inf:
            return UNDECIDED, norm
        if out[0] > xh or out[1] < xl or out[2] > yh or out[3] < yl:
            return EMPTY, norm
        if out[0] > xl and out[1] < xh and out[2] > yl and out[3] < yh:
            return UNIQUE, norm
        box[0], box[1] = max(xl, out[0]), min(xh, out[1])
        box[2], box[3] = max(yl, out[2]), min(yh, out[3])
        if box[1] - box[0] > GAIN * (xh - xl) and box[3] - box[2] > GAIN * (yh - yl):
            break
    return UNDECIDED, norm


@kernel
def inflate(domain, data, out, factor):
    """Prove the intersection near a box: test boxes around the image, grown by ``factor``; ``domain`` is the last."""
    for _ in range(INFLATIONS):
        norm = image(domain[0], domain[1], domain[2], domain[3], data, out)
        if not norm < 1.0:
            return False
        if out[0] > domain[0] and out[1] < domain[1] and out[2] > domain[2] and out[3] < domain[3]:
            return True
        for k in range(0, 4, 2):
            middle, radius = 0.5 * (out[k] + out[k + 1]), 0.5 * (out[k + 1] - out[k])
            radius = factor * radius + 4e-16 * abs(middle)
            domain[k], domain[k + 1] = middle - radius, middle + radius
        if not (domain[0] > 0.0 and domain[2] > 0.0):
            return False
    return False


@kernel
def polish(domain, data, out, row):
    """Shrink the enclosure of the intersection that is proved in ``domain``; domain and enclosure go into ``row``."""
    put(domain, row)
    lo0, hi0, lo1, hi1 = max(domain[0], out[0]), min(domain[1], out[1]), max(domain[2], out[2]), min(domain[3], out[3])
    for _ in range(POLISH):
        if not image(lo0, hi0, lo1, hi1, data, out) < np.inf:
            break
        width = hi0 - lo0 + (hi1 - lo1)
        lo0, hi0, lo1, hi1 = max(lo0, out[0]), min(hi0, out[1]), max(lo1, out[2]), min(hi1, out[3])
        if not hi0 - lo0 + (hi1 - lo1) < 0.99 * width:
            break
    row[4], row[5], row[6], row[7] = lo0, hi0, lo1, hi1


@kernel
def known(box, proved, count):
    """Whether a box lies in a domain in which the only intersection has been found."""
    for k in range(count):
        row = proved[k]
        if row[0] <= box[0] and box[1] <= row[1] and row[2] <= box[2] and box[3] <= row[3]:
            return True
    return False


@kernel
def search(queue, state, kept, inner, proved, data, tolerance, limit):
    """Treat boxes of the queue until it is empty or ``limit`` boxes have been tested in all."""
    box, out, domain = np.empty(4), np.empty(4), np.empty(4)
    while state[HEAD] < state[TAIL] and state[TESTED] < limit:
        row = queue[state[HEAD]]
        put(row, box)
        put(row, domain)
        state[HEAD] += 1
        state[TESTED] += 1
        if known(box, proved, state[PROVED]):
            continue
        # shrink by Krawczyk's test while that gains
        kind, norm = contract(box, data, out)
        if kind == EMPTY:
            continue
        # a contracting map whose image does not lie inside may prove one intersection in a box around it
        found = kind == UNIQUE
        if not found and kind == UNDECIDED and norm < 1.0:
            for factor in (2.0, 1.2):
                put(box, domain)
                if inflate(domain, data, out, factor):
                    found = True
                    break
        elif found:
            put(box, domain)
        # a new intersection is kept once, with the domain in which it is the only one
        if found and state[PROVED] < proved.shape[0]:
            if not known(out, proved, state[PROVED]):
                polish(domain, data, out, proved[state[PROVED]])
                state[PROVED] += 1
            if known(box, proved, state[PROVED]):
                continue
        # what is solved throughout, small enough or too narrow for doubles is kept; the rest is halved
        wide, high = box[1] - box[0], box[3] - box[2]
        middle = 0.5 * (box[0] + box[1]) if wide >= high else 0.5 * (box[2] + box[3])
        side = 0 if wide >= high else 2
        if kind == INNER or max(wide, high) <= tolerance or not box[side] < middle < box[side + 1]:
            put(box, kept[state[KEPT]])
            inner[state[KEPT]] = kind == INNER
            state[KEPT] += 1
            continue
        for half in range(2):
            row = queue[state[TAIL]]
            put(box, row)
            row[side + 1 - half] = middle
            state[TAIL] += 1
