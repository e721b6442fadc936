"""Mistakes in the options of a command: one sentence, exit 2."""

import pytest

from graphsynth.cli.main import main


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["catalog"], "ACTION"),
        (["catalog", "query"], "FILE"),
        (["count", "--links"], "expected one argument"),
        (["count", "--links", "8", "--wrong"], "unrecognized arguments: --wrong"),
        (["frobnicate"], "'frobnicate'"),
    ],
)
def test_a_mistake_is_one_sentence_without_the_list_of_options(words, said, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    told = capsys.readouterr().err
    assert ended.value.code == 2
    assert said in told and len(told.splitlines()) == 1 and told.rstrip().endswith("--help)") and "usage:" not in told
