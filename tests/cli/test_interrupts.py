"""Signals that come when a command is over, or where Python drops what they raise."""

import os
import signal
import subprocess
import sys
import time

import pytest

from graphsynth.cli import main


def test_a_signal_while_the_handlers_are_put_back(monkeypatch, capsys):
    usual, sent = signal.signal, []
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)

    def late(number, handler):
        if handler in before and not sent:  # the first one that is put back
            sent.append(number)
            os.kill(os.getpid(), signal.SIGTERM)
        return usual(number, handler)

    monkeypatch.setattr(signal, "signal", late)
    assert main(["count", "--links", "6"]) == 0
    assert sent and capsys.readouterr().out.splitlines()[-1] == "2"
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


CALLED_BACK = """
import ctypes, os, signal, sys, time
from types import SimpleNamespace
import graphsynth.cli.main
program = sys.modules["graphsynth.cli.main"]

def run(options):
    @ctypes.CFUNCTYPE(None)
    def back():
        os.kill(os.getpid(), {signal})
        time.sleep(0.2)
    back()
    time.sleep(20.0)
    return 0

program.import_module = lambda name: SimpleNamespace(run=run)
sys.argv = ["graphsynth", "schema"]
sys.exit(program.main())
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_while_a_library_calls_back_is_not_lost(number):
    """The compiler of the kernels calls back; Python drops what is raised there, with a traceback."""
    code = CALLED_BACK.format(signal=int(number))
    begin = time.monotonic()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (128 + number, "graphsynth: interrupted\n")
    assert time.monotonic() - begin < 15.0
