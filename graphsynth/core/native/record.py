"""Records with which types kernels are called: ``python -m graphsynth.core.native.record [COMMAND ...]``.

Runs the commands of the README, the shipped scenes and the examples of the documentation, or one command alone, and
adds every kind of call to the list of what is compiled ahead of time.  Needs a checkout of the project.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from graphsynth.core.native.library import FOLDER
from graphsynth.core.native.signatures import Signature, read_list, text_of, write_list

#: Environment variable that names the file where calls are noted.
VARIABLE = "GRAPHSYNTH_RECORD"
_ROOT = FOLDER.parents[2]
_ARRAY = re.compile(r"\[(\d[ACF])r?\]")


@cache
def _note(path: Path, line: str) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.write(f"{line}\n")


def noting(kernel: Any, path: Path) -> Callable[..., Any]:
    """Return the dispatcher of a kernel; types of arguments that are new in this process are appended to a file."""
    from numba import types
    from numba.core.typing.typeof import Purpose, typeof
    from numba.core.utils import pysignature

    dispatcher = kernel.dispatcher
    name = f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}"
    signature = pysignature(kernel.py_func)

    def call(*args: Any, **keywords: Any) -> Any:
        try:
            given = signature.bind(*args, **keywords).arguments
            kinds = [
                typeof(given[part], Purpose.argument) if part in given else types.Omitted(value.default)
                for part, value in signature.parameters.items()
            ]
            _note(path, f"{name}({', '.join(map(text_of, kinds))})")
        except (TypeError, ValueError) as error:
            _note(path, f"# {name}: {error}")
        return dispatcher(*args, **keywords)

    return call


def united(signatures: set[Signature]) -> set[Signature]:
    """Unite calls that differ in arrays that may be written: code that only reads takes both."""
    alike: dict[Signature, list[list[bool]]] = {}
    for kernel, types in signatures:
        reads = [found.group().endswith("r]") for found in _ARRAY.finditer(types)]
        alike.setdefault(Signature(kernel, _ARRAY.sub(r"[\1]", types)), []).append(reads)
    found = set()
    for (kernel, types), calls in alike.items():
        marks = iter(["r" if any(column) else "" for column in zip(*calls, strict=True)])
        found.add(Signature(kernel, _ARRAY.sub(lambda array: f"[{array[1]}{next(marks)}]", types)))  # noqa: B023
    return found


def main(arguments: list[str]) -> None:
    """Run the commands of the README, the shipped scenes and the documentation's tests, or one; write the list."""
    program, tests = [sys.executable, "-m", "graphsynth"], [sys.executable, "-m", "pytest", "-n", "0", "-q", "-m", ""]
    readme = re.findall(r"^\$ graphsynth (.*)$", (_ROOT / "README.md").read_text("utf-8"), re.MULTILINE)
    scenes = [f"run {path.stem}" for path in sorted((_ROOT / "catalog" / "scenes").glob("*.toml"))]
    pages = [str(_ROOT / "tests" / name) for name in ("test_docs.py", "test_doc_commands.py")]
    commands = [*([*program, *line.split()] for line in [*readme, *scenes]), [*tests, f"--rootdir={_ROOT}", *pages]]
    with TemporaryDirectory() as folder:
        calls = Path(folder) / "calls"
        calls.touch()
        environment = os.environ | {VARIABLE: str(calls), "GRAPHSYNTH_NATIVE": "0", "PYTHONPATH": str(_ROOT)}
        for command in [arguments] if arguments else commands:
            print(*command, file=sys.stderr)  # noqa: T201
            subprocess.run(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, check=True)
        lines = calls.read_text("utf-8").splitlines()
    known = set(read_list()) if arguments else set()
    known |= {Signature(*line[:-1].split("(", 1)) for line in lines if not line.startswith("#")}
    write_list(united(known))
    for line in sorted({line for line in lines if line.startswith("#")}):
        print(line)  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
