"""Parsing the command line, and turning errors into one sentence and an exit status."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import NoReturn

import graphsynth
from graphsynth.cli.catalog_options import add_catalog
from graphsynth.cli.console import note, settle
from graphsynth.cli.question import add_question, shard, workers
from graphsynth.cli.stress import add_stress
from graphsynth.core.compilation import announce
from graphsynth.core.errors import GraphsynthError
from graphsynth.core.wording import plain

USAGE_ERROR = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return the exit status.

    0: done; 2: bad input or a place that cannot be written, told in one sentence on standard error; 130: interrupted;
    143: told to end (SIGTERM), which does the same.
    """
    if arguments is None:
        _open_streams()
    with _interrupts(at_exit=arguments is None) as received:
        options = argparse.Namespace()
        try:
            try:
                options = _parser().parse_args(arguments)
            finally:
                sys.stdout.flush()  # the program ends here after help and the version
            announce(lambda: note("compiling kernels (first use only, some seconds) ..."), note)
            # each verb lives in a module of its own, imported when it is used
            status: int = import_module(f"graphsynth.cli.{options.module}").run(options)
            sys.stdout.flush()
        except KeyboardInterrupt:
            return _interrupted(received, at_exit=arguments is None)
        except Exception as error:
            # an interruption inside the compiler of the kernels comes out as an exception of its own
            if received:
                return _interrupted(received, at_exit=arguments is None)
            return _failed(error, options)
        finally:
            settle(sys.stderr)
        return status


def _failed(error: Exception, options: argparse.Namespace) -> int:
    """Say in one sentence what a user can mend; anything else is a fault of the program and is raised."""
    settle(sys.stdout)
    if isinstance(error, BrokenPipeError):  # the reader (head, a pager) has seen enough
        return 0
    if isinstance(error, GraphsynthError):
        text = str(error)
    elif isinstance(error, MemoryError):
        text = "the memory does not suffice: ask for less, use fewer workers, or free some memory"
    elif isinstance(error, OSError):
        text = _of_the_system(error, options)
    else:
        raise error
    note(f"graphsynth: {plain(' '.join(text.split()))}")
    return USAGE_ERROR


def _of_the_system(error: OSError, options: argparse.Namespace) -> str:
    """Name the file and what can be done; an error while writing carries no name, it is of the output."""
    from graphsynth.core.journal import FULL

    full = error.errno in FULL
    name = error.filename or (getattr(options, "output", None) or getattr(options, "out", None) if full else None)
    if full and name is None:
        name = "standard output"
    remedy = ": free some space or name another place, then give the same command" if full else ""
    return f"{name or 'input/output'}: {error.strerror}{remedy}"


def _interrupted(received: list[int], *, at_exit: bool) -> int:
    note("graphsynth: interrupted")
    status = 128 + (received[0] if received else signal.SIGINT)
    if at_exit:  # at once: Python itself would end by SIGINT, whatever the status, after some interruptions of imports
        with suppress(OSError):
            sys.stdout.flush()
        os._exit(status)
    return status


@contextmanager
def _interrupts(*, at_exit: bool) -> Iterator[list[int]]:
    """Raise KeyboardInterrupt when Ctrl-C is pressed or the process is told to end; give the signals that came.

    A second signal ends the process at once; so does one that comes after the block, if the program ends with it.
    An exception that is raised while a library calls back (the compiler does) goes nowhere: it is raised once more.
    """
    received: list[int] = []
    lost: list[int] = []
    over = False

    def handler(number: int, frame: FrameType | None) -> None:
        if lost:
            lost.pop()
            raise KeyboardInterrupt
        received.append(number)
        if len(received) > 1 or (over and at_exit):
            os._exit(128 + number)
        if not over:
            raise KeyboardInterrupt

    def ignored(what: sys.UnraisableHookArgs) -> None:
        if not (received and isinstance(what.exc_value, KeyboardInterrupt)):
            told(what)
        else:
            threading.Timer(0.01, again).start()

    def again() -> None:
        if over:
            return
        lost.append(received[0])
        if hasattr(signal, "pthread_kill"):  # what waits is woken
            signal.pthread_kill(threading.main_thread().ident or 0, received[0])
        else:
            interrupt_main()

    if threading.current_thread() is not threading.main_thread():
        yield received
        return
    told, sys.unraisablehook = sys.unraisablehook, ignored
    before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        over = True
        sys.unraisablehook = told
        for number, old in before.items():
            signal.signal(number, signal.SIG_DFL if at_exit else old)


def _open_streams() -> None:
    """Open the null device for a stream that was closed (``>&-``): no file of data may get its number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        note(f"{self.format_usage()}{self.prog}: error: {message}")  # nobody may be there to read it
        sys.exit(USAGE_ERROR)


def _parser() -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = _Parser(
        prog="graphsynth", description="Structural synthesis and analysis of mechanisms.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"graphsynth {graphsynth.__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    add_question(_verb(verbs, "solve", "solve", "Print all integer solutions of the structural system."))
    _add_count(verbs)
    _add_enumerate(verbs)
    _add_show(verbs)
    _add_convert(verbs)
    _add_animate(verbs)
    _add_run(verbs)
    _add_accuracy(verbs)
    _verb(verbs, "schema", "doctor", "Print the JSON Schema of scene files, for editors.")
    _verb(verbs, "doctor", "doctor", "Say where the machine code of the kernels comes from, and why.")
    add_stress(partial(_verb, verbs))
    add_catalog(verbs)
    return parser


def _verb(
    verbs: argparse._SubParsersAction[argparse.ArgumentParser], name: str, module: str, summary: str
) -> argparse.ArgumentParser:
    parser = verbs.add_parser(name, help=summary, description=summary, allow_abbrev=False)
    parser.set_defaults(module=module)
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    return parser


def _add_work(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--frame", action="store_true", help="choose a frame: mechanisms instead of chains")
    parser.add_argument("--assur", type=int, metavar="N", help="Assur groups with N moving links instead of chains")
    parser.add_argument("--truss", type=int, metavar="N", help="Baranov trusses with N links instead of chains")
    parser.add_argument("--symmetry", type=int, metavar="P", help="require an automorphism of prime order P")
    parser.add_argument("--shard", type=shard, metavar="I/M", help="do only shard I of M (1 <= I <= M)")
    parser.add_argument(
        "--workers", type=workers, metavar="K", help="worker processes (default: one; all for big work)"
    )


def _add_count(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _verb(verbs, "count", "count", "Count chains or mechanisms without listing them.")
    add_question(parser)
    _add_work(parser)
    parser.add_argument(
        "--checkpoint", type=Path, metavar="FILE", help="remember what is counted, and go on from there"
    )


def _add_enumerate(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _verb(verbs, "enumerate", "enumerate_", "List every chain or mechanism, each once.")
    add_question(parser)
    _add_work(parser)
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help=".g6 or .txt: text form; .jsonl: JSON lines")
    parser.add_argument("--resume", action="store_true", help="go on with an interrupted FILE")
    parser.add_argument("--force", action="store_true", help="replace FILE; list even what may not fit the disk")


def _add_show(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _verb(verbs, "show", "show", "Describe one chain or mechanism.")
    parser.add_argument(
        "graph", metavar="KEY|TEXT|FILE", help="canonical key, text form (graph6 ...), or a file of them"
    )
    parser.add_argument("--line", type=int, default=1, metavar="N", help="line of FILE (default 1)")
    parser.add_argument("--driver", type=int, metavar="LINK", help="driven link: give the Assur groups for it only")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="draw it: FILE.svg, .png or .pdf")
    parser.add_argument(
        "--view", choices=("diagram", "levels", "both"), help="kinematic diagram (default), graph by levels, or both"
    )


def _add_convert(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _verb(verbs, "convert", "convert", "Write the graphs and mechanisms of a file in another format.")
    parser.add_argument("source", metavar="FILE|-", help="file of any format; - is standard input")
    parser.add_argument("-o", "--output", required=True, metavar="FILE|-", help="file to write; - is standard output")
    parser.add_argument("--from", dest="source_format", metavar="FORMAT", help="format of the input, if not by suffix")
    parser.add_argument("--to", dest="target_format", metavar="FORMAT", help="format of the output, if not by suffix")
    parser.add_argument("--graphs", action="store_true", help="of mechanisms, write the graphs only")
    parser.add_argument("--force", action="store_true", help="replace FILE")


def _add_animate(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _verb(verbs, "animate", "animate", "Give a candidate dimensions and make a moving picture of it.")
    parser.add_argument(
        "mechanism",
        metavar="KEY|TEXT|MECHANISM.toml",
        help="canonical key, text form, or a file of them; or a dimensioned mechanism (.toml, .json)",
    )
    parser.add_argument("--line", type=int, default=1, metavar="N", help="line of a file of graphs (default 1)")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("mechanism.html"),
        metavar="FILE",
        help="FILE.html (default mechanism.html), .gif or .svg",
    )
    parser.add_argument(
        "--driver", type=int, action="append", metavar="LINK", help="driven link on the frame (once for each driver)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the search for dimensions (default 0)")
    parser.add_argument("--frames", type=int, metavar="N", help="pictures of one pass (default 120, GIF 60)")
    parser.add_argument(
        "--range", type=float, nargs=2, metavar=("A", "B"), help="inputs of MECHANISM.toml, radians or lengths"
    )
    parser.add_argument("--save", type=Path, metavar="FILE", help="keep the mechanism found: FILE.toml or .json")


def _add_run(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _verb(verbs, "run", "run", "Run a scene: from the question to a report.")
    parser.add_argument("scene", metavar="SCENE", help="name of a shipped scene, or a TOML file")
    parser.add_argument("--out", type=Path, metavar="DIR", help="report folder (default graphsynth-out/SCENE)")
    parser.add_argument("--workers", type=workers, metavar="K", help="processes (default: all cores for a stream)")
    parser.add_argument("--fresh", action="store_true", help="start anew, do not go on with an interrupted run in DIR")
    parser.add_argument(
        "--explain", action="store_true", help="print what ran and why, what did not, imports, time and memory"
    )


def _add_accuracy(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _verb(verbs, "accuracy", "accuracy", "Measure error against run time of the methods in a scene.")
    parser.add_argument("scene", metavar="SCENE", help="name of a shipped scene, or a TOML file")
    parser.add_argument("--out", type=Path, metavar="DIR", help="report folder (default graphsynth-out/SCENE-accuracy)")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="timed runs of each row (default 3)")
    parser.add_argument("--quick", action="store_true", help="fewer and easier settings, to try the command")
