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
from importlib import import_module
from pathlib import Path
from types import FrameType

from graphsynth.cli.console import note, settle
from graphsynth.cli.options import USAGE_ERROR, command_line
from graphsynth.core.compilation import announce
from graphsynth.core.errors import GraphsynthError
from graphsynth.core.wording import plain


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return the exit status.

    0: done; 2: bad input or a place that cannot be written, told in one sentence on standard error; 130: interrupted;
    143: told to end (SIGTERM), which does the same.
    """
    if arguments is None:  # a stream that was closed (``>&-``): no file of data may get its number
        for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
            if getattr(sys, name) is None:
                setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115
    with _interrupts(at_exit=arguments is None) as received:
        options = argparse.Namespace()
        try:
            try:
                options = command_line().parse_args(arguments)
            finally:
                sys.stdout.flush()  # the program ends here after help and the version
            announce(lambda: note("compiling kernels (first use only, some seconds) ..."), note)
            # each verb lives in a module of its own, imported when it is used
            status: int = import_module(f"graphsynth.cli.{options.module}").run(options)
            sys.stdout.flush()
        except (Exception, KeyboardInterrupt) as error:
            # an interruption inside the compiler of the kernels comes out as an exception of its own
            if not received and not isinstance(error, KeyboardInterrupt):
                return _failed(error, options)
            note("graphsynth: interrupted")
            status = 128 + (received[0] if received else signal.SIGINT)
            if arguments is None:  # at once: after some interruptions of imports Python itself would end by SIGINT
                with suppress(OSError):
                    sys.stdout.flush()
                if used := sys.modules.get("multiprocessing.util"):  # names of semaphores outlive the process
                    used._run_finalizers(0)
                os._exit(status)
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
        from graphsynth.core.journal import FULL

        # an error while writing carries no name, it is of the output
        text = f"{error.filename or 'input/output'}: {error.strerror}"
        if error.errno in FULL:
            output = getattr(options, "output", None) or getattr(options, "out", None)
            text = f"{error.filename or output or 'standard output'}: {error.strerror}: free some space or name another"
            text += " place, then give the same command"
    else:
        raise error
    note(f"graphsynth: {plain(' '.join(text.split()))}")
    return USAGE_ERROR


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
