"""The library of kernels that were compiled ahead of time: it is that of the sources, and does what numba does."""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
import threading
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.cli.main import main
from graphsynth.core.native import library
from graphsynth.core.native.record import united
from graphsynth.core.native.signatures import Signature, parse, read_list, text_of, write_list

from .kernel_bits import (
    LEAST,
    SPECIAL,
    Compared,
    agree_on,
    calls_of,
    interval_numbers,
    kernel_of,
    same_bits,
    same_results,
    table,
)

needs_library = pytest.mark.skipif(not library.contents(), reason=library.reason)
ROOT = Path(__file__).parents[1]


def python(code: str, **environment: str) -> str:
    """Run a program in a process of its own; what it prints."""
    command = [sys.executable, "-P", "-c", code]
    environment = {"PYTHONPATH": str(ROOT)} | environment
    return subprocess.run(command, capture_output=True, text=True, env=os.environ | environment, check=True).stdout


# -- of these sources ------------------------------------------------------------------------------------------------


@needs_library
def test_the_library_is_of_these_sources_and_this_list() -> None:
    held = {Signature(name, types) for name, _, overloads in library.contents() for types, _ in overloads}
    assert held == set(read_list())
    changed = {name for name, digest, _ in library.contents() if kernel_of(name).digest != digest}
    assert not changed, "build the library anew: python -m graphsynth.core.native.build"


@pytest.mark.slow
@needs_library
@pytest.mark.skipif(find_spec("ziglang") is None, reason="ziglang is not installed")
def test_the_same_sources_give_the_same_bytes(tmp_path: Path) -> None:
    made = tmp_path / "made.so"
    command = [sys.executable, "-m", "graphsynth.core.native.build", "--output", str(made)]
    subprocess.run(command, check=True, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert made.read_bytes() == library.path().read_bytes()


def test_the_list_is_sorted_and_written_as_it_is_read(tmp_path: Path) -> None:
    signatures = read_list()
    write_list(set(signatures), tmp_path / "list.txt")
    assert read_list(tmp_path / "list.txt") == signatures == sorted(signatures)
    assert {Signature(*signature) for signature in signatures} == united(set(signatures))
    for signature in signatures:
        assert ", ".join(map(text_of, parse(signature.types))) == signature.types


def test_calls_that_differ_in_what_may_be_written_are_one() -> None:
    calls = {Signature("f", types) for types in ("f8[1Cr], f8[1C], i8", "f8[1C], f8[1Cr], i8", "f8[2C], f8[1C], i8")}
    assert united(calls) == {Signature("f", "f8[1Cr], f8[1Cr], i8"), Signature("f", "f8[2C], f8[1C], i8")}


# -- used, or not ----------------------------------------------------------------------------------------------------

GEARS = """
import sys
from graphsynth.kinematics.dimensional import embody
from graphsynth.structure.graph import MechanismGraph
found = embody(MechanismGraph.from_text("ExSW f0 2:1-2,4-5"), tries=1, effort=0.02)
print(found.motion.completed, "numba" in sys.modules)
"""
ADD = """
import sys, numpy as np
from graphsynth.intervals.kernels import loops
lower, upper = np.empty(1), np.empty(1)
loops.add(*(np.full(1, value) for value in (-1.0, 1.0, -2.0, 3.0)), lower, upper)
print(lower[0], upper[0], 'numba' in sys.modules)
"""
COUNT = "import sys, graphsynth as gs; print(gs.count_chains(12), 'numba' in sys.modules)"


@pytest.mark.long
@needs_library
def test_counting_does_not_load_numba() -> None:
    assert python(COUNT).split() == ["6856", "False"]
    assert python(ADD, GRAPHSYNTH_NATIVE="0").split() == ["-3.0", "4.0", "True"]


@pytest.mark.long
@needs_library
def test_dimensions_of_gear_trains_do_not_load_numba() -> None:
    """Arrays come to the kernels in the order of memory for which they are compiled, with two gear pairs too."""
    assert python(GEARS).split() == ["True", "False"]


@pytest.mark.slow  # numba compiles the kernels of counting
@needs_library
def test_counting_without_the_library_is_the_same() -> None:
    assert python(COUNT, GRAPHSYNTH_NATIVE="0").split() == ["6856", "True"]


@pytest.mark.long
@needs_library
def test_a_changed_source_falls_back_and_says_so(tmp_path: Path) -> None:
    package = tmp_path / "graphsynth"
    ignored = shutil.ignore_patterns("*.nbc", "__pycache__")
    shutil.copytree(ROOT / "graphsynth", package, ignore=ignored)
    changed = package / "intervals" / "kernels" / "loops.py"
    environment = {"PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    doctor = "from graphsynth.cli.main import main; main(['doctor', '--json'])"

    def reasons() -> dict[str, str]:
        kernels = json.loads(python(doctor, **environment))["kernels"]
        return {kernel["kernel"].removeprefix("graphsynth.intervals."): kernel["why"] for kernel in kernels}

    first = reasons()
    changed.write_text(changed.read_text() + "\n# a comment\n")
    assert reasons() == first and not first["kernels.loops.add"]
    assert python(ADD, **environment).split() == ["-3.0", "4.0", "False"]
    changed.write_text(changed.read_text() + "\nCHANGED = 1\n")
    then = {name: why for name, why in reasons().items() if why != first[name]}
    assert then["kernels.loops.add"] == "their sources have changed since the library was made"
    assert {name.rpartition(".")[0] for name in then} <= {"kernels.loops"}  # no other kernel calls them
    assert python(ADD, **environment).split() == ["-3.0", "4.0", "True"]


@needs_library
def test_the_doctor_counts_calls_and_names_what_is_compiled(capsys: pytest.CaptureFixture[str]) -> None:
    from graphsynth.intervals.kernels import arithmetic, loops

    arrays = [np.ones(3) for _ in range(6)]
    loops.add(*arrays)
    arithmetic.multiply(1.0, 2.0, 3.0, 4.0)
    assert main(["doctor", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    found = {kernel["kernel"].removeprefix("graphsynth.intervals.kernels."): kernel for kernel in said["kernels"]}
    assert said["loaded"] and said["library"] == str(library.path())
    assert found["loops.add"]["place"] == "in the library" and found["loops.add"]["calls"] > 0
    assert found["arithmetic.multiply"]["place"] in ("compiled here and kept on disk", "compiled in memory")
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert library.reason in said and "graphsynth.intervals.kernels.arithmetic.multiply" in said


def test_another_machine_or_a_damaged_file_is_not_loaded(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(library, "FOLDER", tmp_path)
    monkeypatch.delenv("GRAPHSYNTH_NATIVE", raising=False)
    assert library._load() == (None, f"there is none for {library.target()}")
    library.path().write_bytes(b"\x7fELF of another machine")
    assert "cannot be loaded" in library._load()[1]
    monkeypatch.setenv("GRAPHSYNTH_NATIVE", "0")
    assert "GRAPHSYNTH_NATIVE" in library._load()[1]


@pytest.mark.long
@needs_library
def test_a_numpy_with_other_arrays_is_noticed() -> None:
    code = """
import numpy as np
from graphsynth.core.native import library
from graphsynth.intervals.kernels import loops
library._seen = lambda array: (0,)
out = [np.empty(1), np.empty(1)]
loops.add(np.ones(1), np.ones(1), np.ones(1), np.ones(1), *out)
print(out[0][0], library.reason)
"""
    assert python(code).split(maxsplit=1) == ["2.0", "arrays of this numpy are laid out in another way\n"]


# -- as numba calls --------------------------------------------------------------------------------------------------


@pytest.mark.long
@needs_library
@pytest.mark.parametrize(
    ("change", "taken"),
    [
        (lambda a: a, True),
        (lambda a: np.frombuffer(a.tobytes()), True),  # read only
        (lambda a: a[:0], True),
        (lambda a: np.ascontiguousarray(a).astype(np.float32), False),
        (lambda a: np.repeat(a, 2)[::2], False),
        (lambda a: a.astype(">f8"), None),
        (lambda a: np.frombuffer(b"\0" + a.tobytes(), dtype=np.uint8)[1:].view(np.float64), False),
        (lambda a: a.view(type("Derived", (np.ndarray,), {})), False),
        (lambda a: list(a), None),
    ],
    ids=["plain", "read only", "empty", "single", "strided", "swapped", "unaligned", "derived", "list"],
)
def test_arguments_are_told_apart_as_numba_does(change: Any, taken: bool | None) -> None:
    from graphsynth.intervals.kernels import loops

    given = [change(np.array([1.0, 2.0, 4.0])) for _ in range(4)]
    size = len(given[0])
    out, numbas = ([np.zeros(size), np.zeros(size)] for _ in range(2))
    before = calls_of(loops.add)
    try:
        loops.add(*given, *out)
    except Exception as error:
        assert taken is None
        with pytest.raises(type(error)):
            loops.add.dispatcher(*given, *numbas)
    else:
        loops.add.dispatcher(*given, *numbas)
    assert calls_of(loops.add) - before == (1 if taken else 0)
    assert np.array_equal(out, numbas)


@pytest.mark.long
@needs_library
def test_wrong_calls_say_what_numba_says() -> None:
    from graphsynth.intervals.kernels import loops
    from graphsynth.structure.kernels import canon_workspace

    for kernel, args in ((loops.add, ()), (loops.add, (1, 2, 3, 4, 5, 6, 7)), (canon_workspace, ("3", 1))):
        with pytest.raises(Exception) as ours:
            kernel(*args)
        with pytest.raises(Exception) as numbas:
            kernel.dispatcher(*args)
        assert ours.type is numbas.type and str(ours.value) == str(numbas.value)


@pytest.mark.long
@needs_library
def test_numbers_of_python_and_numpy_are_alike() -> None:
    from numba.core.errors import TypingError

    from graphsynth.structure.kernels import canon_workspace

    before = calls_of(canon_workspace)
    for n in (3, np.int64(3)):
        assert canon_workspace(n, 1)[0].shape == (3,)
    assert calls_of(canon_workspace) == before + 2
    with pytest.raises(ValueError, match="negative dimensions"):
        canon_workspace(-1, 1)
    assert calls_of(canon_workspace) == before + 3
    for n in (np.int32(3), np.uint8(3)):  # other types: numba's affair
        assert canon_workspace(n, 1)[0].shape == (int(n),)
    with pytest.raises(TypingError):
        canon_workspace(None, 1)
    assert calls_of(canon_workspace) == before + 3


@needs_library
def test_arrays_that_are_returned_own_their_memory() -> None:
    from graphsynth.structure.kernels import canon_workspace

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) if Path("/proc/self/statm").exists() else 0

    found = [canon_workspace(200, 1) for _ in range(20)]
    parts = [arrays[5][7:9] for arrays in found]
    for number, part in enumerate(parts):
        part[:] = number
    del found
    before = resident()
    for _ in range(2000):  # 2 MB each
        canon_workspace(400, 1)
    assert resident() - before < 20_000  # pages: nothing is lost
    assert all((part == number).all() for number, part in enumerate(parts))


@needs_library
def test_many_threads_call_at_once() -> None:
    from graphsynth.intervals.kernels import loops

    wrong = []

    def work(seed: int) -> None:
        values = np.random.default_rng(seed).normal(size=(4, 500))
        expected = np.empty((2, 500))
        loops.add(*values, *expected)
        for _ in range(300):
            found = np.empty((2, 500))
            loops.add(*values, *found)
            if not np.array_equal(found, expected):
                wrong.append(seed)

    workers = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not wrong


# -- the same bits as numba --------------------------------------------------------------------------------------------

#: Kernels of one operation after another on flat arrays: any number may come.
FLAT = ("graphsynth.intervals.kernels.loops.",)


@pytest.fixture(scope="session")
def real_calls(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[Signature, list[Any]]:
    """Arguments of calls that the examples of the documentation make; GRAPHSYNTH_BITS_CALLS names earlier ones."""
    if earlier := os.environ.get("GRAPHSYNTH_BITS_CALLS"):
        return pickle.loads(Path(earlier).read_bytes())
    path = tmp_path_factory.mktemp("calls") / "calls.pickle"
    command = [sys.executable, str(Path(__file__).with_name("kernel_calls.py")), str(path)]
    if "slow" in request.config.getoption("-m") and "not slow" not in request.config.getoption("-m"):
        command.append("slow")
    environment = os.environ | {"GRAPHSYNTH_NATIVE": "0", "PYTHONPATH": str(ROOT)}
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    return pickle.loads(path.read_bytes())


def loop(signature: Signature) -> Any:
    """One loop over intervals as a case; most are for the slow run, since numba compiles each for a second or two."""
    name = signature.kernel.removeprefix(FLAT[0])
    return pytest.param(signature, id=name, marks=() if name in ("add", "sin") else pytest.mark.long)


@pytest.mark.long
@needs_library
@pytest.mark.parametrize("signature", [loop(s) for s in read_list() if s.kernel.startswith(FLAT)])
def test_interval_loops_give_the_bits_of_numba_for_any_numbers(signature: Signature, each: int = 2000) -> None:
    assert agree_on(kernel_of(signature.kernel), interval_numbers(signature, each, np.random.default_rng(5)))


@pytest.mark.long
@needs_library
def test_code_without_fused_operations_forms_them_exactly(each: int = 20_000) -> None:
    """The library's own ``a b + c``, for its plainest version, beside fractions: cancelling, tiny, huge, special."""
    rng = np.random.default_rng(12)

    def draw(least: int, most: int) -> np.ndarray:
        return np.ldexp(rng.uniform(-1.0, 1.0, each), rng.integers(least, most, each))

    a, b, c = draw(-60, 60), draw(-60, 60), draw(-120, 120)
    wide = rng.random((3, each)) < 0.3
    a, b, c = (np.where(w, draw(-1074, 1024), v) for w, v in zip(wide, (a, b, c), strict=True))
    with np.errstate(all="ignore"):
        c = np.where(rng.random(each) < 0.4, -a * b, c)  # cancels, but for the rounding error
        c = np.where(rng.random(each) < 0.2, np.nextafter(c, 0.0), c)
    a, b, c = (np.where(rng.random(each) < 0.03, rng.choice(SPECIAL, each), v) for v in (a, b, c))
    for x, y, z in zip(a.tolist(), b.tolist(), c.tolist(), strict=True):
        found = library._library.fma(x, y, z)
        with np.errstate(all="ignore"):
            plain = float(np.float64(x) * np.float64(y) + np.float64(z))
        if not np.isfinite([x, y, z]).all():
            wanted = z if np.isfinite([x, y]).all() else plain
        elif (exact := Fraction(x) * Fraction(y) + Fraction(z)) == 0:
            wanted = plain if x == 0.0 or y == 0.0 else 0.0
        else:
            try:
                wanted = float(exact)
            except OverflowError:
                wanted = np.inf if exact > 0 else -np.inf
            wanted = np.copysign(wanted, 1.0 if exact > 0 else -1.0)
        assert same_bits(np.array([found]), np.array([wanted])), (x, y, z)


@needs_library
@pytest.mark.parametrize("wrong", [0, 1])
def test_one_wrong_bit_in_one_changed_call_is_found(monkeypatch: pytest.MonkeyPatch, wrong: int) -> None:
    from graphsynth.intervals.kernels import loops

    met = []

    def other(*args: np.ndarray) -> None:
        loops.add(*args)
        met.append(args[0].copy())
        if len(met) == 20:
            args[4].view(np.int64)[1] ^= wrong

    monkeypatch.setattr(loops.add, "dispatcher", other)
    values = np.random.default_rng(1).normal(size=(4, 3))
    values[:, 0] = np.nan
    kept = [(*values, np.zeros(3), np.zeros(3))]
    compared = Compared(Signature("graphsynth.intervals.kernels.loops.add", ""), kept, np.random.default_rng(2))
    compared.run(0.2, most=100)
    assert compared.calls == len(met) >= LEAST
    assert len({values.tobytes() for values in met}) > 0.5 * len(met)
    assert len(compared.wrong) == wrong


def test_bits_that_differ_are_told_apart() -> None:
    a = np.array([0.0, np.nan, 1.0])
    assert same_bits(a, np.array([0.0, -np.nan, 1.0])) and same_bits(a[:0], a[:0])
    assert not same_bits(a, np.array([-0.0, np.nan, 1.0])) and not same_bits(a, a.astype(np.float32))
    assert same_results([(1.0, a)], [(1.0, a)]) and not same_results([(1.0, a)], [(1, a)])
    assert not same_results([1.0, ValueError], [1.0, TypeError]) and not same_results([a], [a[:2]])


@pytest.mark.slow  # numba compiles every kernel of the library: minutes; then GRAPHSYNTH_BITS_SECONDS for each
@needs_library
def test_the_library_gives_the_bits_of_numba(real_calls: dict[Signature, list[Any]]) -> None:
    listed = set(read_list())
    assert united(set(real_calls) | listed) == united(listed)
    flat = {signature for signature in listed if signature.kernel.startswith(FLAT)}
    assert {kind.kernel for kind in listed - flat} <= {kind.kernel for kind in real_calls}
    for signature in flat:
        test_interval_loops_give_the_bits_of_numba_for_any_numbers(signature, 1_000_000)
    seconds, rng = float(os.environ.get("GRAPHSYNTH_BITS_SECONDS", "20")), np.random.default_rng(20)
    found, wrong = {}, []
    for kind, kept in sorted(real_calls.items()):
        compared = Compared(kind, kept, rng)
        compared.run(seconds)
        found[kind] = compared.calls
        wrong += compared.wrong
        print(f"{compared.calls:>9}  {kind.kernel}", flush=True)
    print(table(found))
    assert not wrong
    assert min(found.values()) >= LEAST
