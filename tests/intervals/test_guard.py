"""The guard, and that compiled code does exactly what is written: no contraction, no reassociation."""

import json
import os
import platform
import subprocess
import sys
import textwrap

import pytest

from graphsynth.core.errors import GraphsynthError
from graphsynth.intervals import check_rounding

ON_GLIBC = platform.libc_ver()[0] == "glibc" and platform.machine() == "x86_64"
needs_control_word = pytest.mark.skipif(not ON_GLIBC, reason="sets the control word of x86-64 through glibc")


def run(code, timeout=120, **environment):
    command, environment = [sys.executable, "-c", textwrap.dedent(code)], os.environ | environment
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_all_is_well_here():
    check_rounding()


UPWARD = "ctypes.CDLL('libm.so.6').fesetround(0x800)"
# the environment of x86-64 holds the SSE control word at byte 28; bit 15 flushes results, bit 6 flushes operands
FLUSH = """
    library = ctypes.CDLL('libm.so.6')
    state = (ctypes.c_uint32 * 8)()
    library.fegetenv(state)
    state[7] |= {bits}
    library.fesetenv(state)
"""


@pytest.mark.long
@needs_control_word
@pytest.mark.parametrize(
    ("change", "word"),
    [
        (UPWARD, "nearest"),
        (UPWARD.replace("0x800", "0x400"), "nearest"),
        (UPWARD.replace("0x800", "0xc00"), "nearest"),
        (FLUSH.format(bits="0x8040"), "subnormal"),
        (FLUSH.format(bits="0x8000"), "subnormal"),
        (FLUSH.format(bits="0x40"), "subnormal"),
    ],
    ids=["upward", "downward", "to-zero", "both", "results", "operands"],
)
def test_a_changed_mode_is_refused_at_import_and_at_each_solve(change, word):
    change = textwrap.dedent(change).strip()
    code = f"""
import ctypes, sys
import numpy as np
from graphsynth.core.errors import GraphsynthError
from graphsynth.intervals import (
    Interval, Search, gauss_seidel, image, jacobian, krawczyk, pave, pave_cells, pave_compiled, solve_linear,
)
box = Interval([1], [2])
A = Interval([[2]])
search = Search(lambda x: [x[0] * x[0] - 2], box)
{change}
f = lambda x: [x[0] * x[0] - 2]
calls = [
    lambda: krawczyk(f, box), lambda: pave(f, box), lambda: solve_linear(A, box), lambda: gauss_seidel(A, box, box),
    lambda: next(iter(search)), lambda: image(f, box.reshape(1, 1)), lambda: jacobian(f, box),
    lambda: pave_cells(lambda x, p: [x[0] - p[0]], box, box), lambda: pave_compiled(f, box),
]
for call in calls:
    try:
        call()
    except GraphsynthError as error:
        assert {word!r} in str(error), error
    else:
        raise SystemExit("not refused")
for name in [n for n in sys.modules if n.startswith("graphsynth.intervals")]:
    del sys.modules[name]
try:
    import graphsynth.intervals
except GraphsynthError as error:
    print("refused")
"""
    assert run(code).strip().endswith("refused")


@pytest.mark.long
@needs_control_word
def test_every_operation_gives_the_same_bits_in_every_mode():
    """One interval, some in numpy, many compiled; with tiny numbers, which a flushing processor takes for zero."""
    changes = [UPWARD, UPWARD.replace("0x800", "0x400"), UPWARD.replace("0x800", "0xc00")]
    changes += [textwrap.dedent(FLUSH.format(bits=bits)).strip() for bits in ("0x8040", "0x8000", "0x40")]
    code = f"""
import ctypes
import numpy as np
import graphsynth.intervals as gi
from graphsynth.intervals import Interval
many = np.linspace(1.0, 2.0, 6000)
tiny = 5e-324
singles = [Interval("0.1"), Interval(0, tiny), Interval(tiny, tiny), Interval(-tiny, 0), Interval(-tiny, tiny),
           Interval(-tiny, 1), Interval(tiny, 1), Interval(-1, -tiny), Interval("0.1", "0.9"), Interval(-3, 2)]
some = Interval.from_bounds([float(x.lo) for x in singles], [float(x.hi) for x in singles])
pairs = [(x, y) for x in singles for y in singles] + [(some, some), (some, some.bisect()[0]), (some, singles[2])]
pairs.append((Interval.from_bounds(many, many + 1.0), Interval.from_bounds(many - 1.5, many * many)))
dual = gi.variables(Interval(["0.1", "0.3"]))[0]
operations = [
    lambda x, y: x + y, lambda x, y: x - 1, lambda x, y: 1 - x, lambda x, y: x * y, lambda x, y: 3 * x,
    lambda x, y: x / y, lambda x, y: x / 3, lambda x, y: 1 / x, lambda x, y: x**3, lambda x, y: x**-2,
    lambda x, y: -x, lambda x, y: abs(x), lambda x, y: x.sqr(), lambda x, y: x.sqrt(), lambda x, y: x.sum(),
    lambda x, y: x.reshape(-1).dot(x.reshape(-1)), lambda x, y: x.inflate(), lambda x, y: x.width,
    lambda x, y: x.mid, lambda x, y: x.rad, lambda x, y: x.mag, lambda x, y: x.mig, lambda x, y: x.bisect()[0],
    lambda x, y: x.hull(y), lambda x, y: x.intersect(y), lambda x, y: x.subset(y), lambda x, y: x.interior(y),
    lambda x, y: x.equal(y), lambda x, y: x.disjoint(y), lambda x, y: x.certainly_less(y),
    lambda x, y: x.certainly_less_equal(y), lambda x, y: x.possibly_less(y), lambda x, y: x.possibly_equal(y),
    lambda x, y: np.asarray(x.contains(5e-324)), lambda x, y: np.asarray(x.contains(0)),
    lambda x, y: gi.sin(x), lambda x, y: gi.cos(x), lambda x, y: gi.tan(x), lambda x, y: gi.atan(x),
    lambda x, y: gi.exp(x), lambda x, y: gi.log(x), lambda x, y: gi.sqrt(x), lambda x, y: gi.sqr(x),
    lambda x, y: gi.asin(x), lambda x, y: gi.acos(x), lambda x, y: gi.atan2(x, y), lambda x, y: gi.hypot(x, y),
    lambda x, y: gi.minimum(x, y), lambda x, y: gi.maximum(x, y), lambda x, y: gi.divide_extended(x, y)[0],
    lambda x, y: gi.divide_extended(x, y)[1], lambda x, y: Interval("0.1"), lambda x, y: Interval(["1/3", 2]),
    lambda x, y: Interval.midrad("0.1", "0.2"), lambda x, y: Interval("0.1", "0.2"),
    lambda x, y: (dual * dual / gi.sin(dual)).grad,
]
def bits(result):
    if isinstance(result, Interval):
        return result.lo.tobytes(), result.hi.tobytes(), np.asarray(result.flags).tobytes()
    return np.asarray(result).tobytes()
def all_bits():
    return [[bits(operation(x, y)) for x, y in pairs] for operation in operations]
expected = all_bits()
library = ctypes.CDLL("libm.so.6")
plain = (ctypes.c_uint32 * 8)()
library.fegetenv(plain)
for change in {changes!r}:
    exec(change)
    changed, now = (ctypes.c_uint32 * 8)(), (ctypes.c_uint32 * 8)()
    library.fegetenv(changed)
    found = all_bits()
    library.fegetenv(now)
    library.fesetenv(plain)
    assert now[7] >> 6 == changed[7] >> 6 != plain[7] >> 6, "the mode was not left as it was"
    wrong = [(k, n) for k in range(len(operations)) for n in range(len(pairs)) if found[k][n] != expected[k][n]]
    assert not wrong, (change, wrong[:20])
print("same bits")
"""
    assert run(code).strip().endswith("same bits")


def test_the_message_names_the_remedy(monkeypatch):
    from graphsynth.intervals import guard

    monkeypatch.setattr(guard, "_RIGHT", -guard._RIGHT)
    with pytest.raises(GraphsynthError, match="process of its own"):
        guard.check_rounding()


CASES = """
    import json, random, struct, sys
    import numpy as np
    sys.path.insert(0, {folder!r})
    from interval_samples import bounds
    {patch}
    from graphsynth.intervals.kernels import arithmetic, trigonometry, inverse, exponential
    np.seterr(all="ignore")
    rng = np.random.default_rng(8)
    count = 150
    a, b = np.array(bounds(rng, count)), np.array(bounds(rng, count))
    near = np.array([rng.uniform(-40, 40, 60), np.zeros(60)])
    near[1] = near[0] + rng.uniform(0, 3, 60)
    unit = np.sort(rng.uniform(-1, 1, (2, 60)), axis=0)
    out = []
    def note(pair):
        out.append([struct.pack("<d", float(x) + 0.0).hex() for x in pair])
    for i in range(count):
        four = [float(v) for v in (a[0, i], a[1, i], b[0, i], b[1, i])]
        for f in (arithmetic.add, arithmetic.subtract, arithmetic.multiply, arithmetic.divide, exponential.hypot,
                  inverse.atan2):
            note(f(*four))
        for f in (arithmetic.square, arithmetic.root, trigonometry.sin, trigonometry.cos, trigonometry.tan,
                  inverse.atan, exponential.exp, exponential.log):
            note(f(*four[:2]))
        note(arithmetic.power(*four[:2], 5))
        note(arithmetic.scale(four[1] if np.isfinite(four[1]) else 2.0, *four[2:]))
    for i in range(60):
        for f in (trigonometry.sin, trigonometry.cos, trigonometry.tan, exponential.exp, inverse.atan):
            note(f(float(near[0, i]), float(near[1, i])))
        for f in (inverse.asin, inverse.acos):
            note(f(float(unit[0, i]), float(unit[1, i])))
    print(json.dumps(out))
"""
PATCH = """
    import os
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    from fractions import Fraction
    from math import isfinite
    import graphsynth.core.intrinsics as intrinsics
    def fma(a, b, c):
        if not (isfinite(a) and isfinite(b) and isfinite(c)):
            return float(np.float64(a) * np.float64(b) + np.float64(c))
        exact = Fraction(a) * Fraction(b) + Fraction(c)
        try:
            return float(exact)
        except OverflowError:
            return float("inf") if exact > 0 else -float("inf")
    intrinsics.fma = fma
"""


@pytest.mark.long
def test_compiled_code_equals_the_uncompiled_source_to_the_bit():
    """The interpreter neither contracts nor reorders; so neither has the compiler, on any path of any kernel."""
    from pathlib import Path

    folder = str(Path(__file__).parent)
    interpreted = json.loads(run(textwrap.dedent(CASES).format(folder=folder, patch=textwrap.dedent(PATCH).strip())))
    compiled = json.loads(run(textwrap.dedent(CASES).format(folder=folder, patch="")))
    assert len(compiled) > 2500
    assert interpreted == compiled


@pytest.mark.slow  # every kernel is compiled twice
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names a processor of x86-64")
def test_processors_without_fused_operations_give_the_same_bits(tmp_path):
    """Without FMA the compiler calls the C library's; what it makes of every kernel is the same to the bit."""
    from pathlib import Path

    code = textwrap.dedent(CASES).format(folder=str(Path(__file__).parent), patch="") + textwrap.dedent("""
    print(json.dumps(sum("vfmadd" in asm or "vfnmadd" in asm or "vfmsub" in asm
                         for asm in arithmetic.multiply.dispatcher.inspect_asm().values())))
    """)
    here, plain = (
        run(code, timeout=1200, GRAPHSYNTH_NATIVE="0", NUMBA_CACHE_DIR=str(tmp_path / name), **environment)
        for name, environment in (
            ("here", {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": "+fma,+avx2"}),
            ("plain", {"NUMBA_CPU_NAME": "x86-64-v2", "NUMBA_CPU_FEATURES": "-fma,-avx,-avx2"}),
        )
    )
    (here, fused), (plain, none) = ([json.loads(line) for line in text.splitlines()] for text in (here, plain))
    assert fused and not none
    assert len(here) > 2500
    assert here == plain
