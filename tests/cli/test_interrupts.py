"""A signal that comes when a command is over changes nothing of what it gave."""

import os
import signal

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
