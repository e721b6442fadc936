import shutil
import subprocess

import networkx as nx
import pytest

from graphsynth.core.errors import FormatError
from graphsynth.structure.graph import MechanismGraph


@pytest.mark.parametrize("links", [1, 2, 3, 12, 61, 62, 63, 64, 100, 255])
def test_graph6_agrees_with_networkx(links):
    graph = nx.gnp_random_graph(links, 0.3, seed=links)
    ours = MechanismGraph.from_networkx(graph)
    text = nx.to_graph6_bytes(graph, header=False)
    assert ours.graph6() == text.decode().strip()
    assert MechanismGraph.from_graph6(text) == ours
    assert MechanismGraph.from_graph6(b">>graph6<<" + text) == ours
    assert MechanismGraph.from_text(ours.to_text()) == ours


def test_example_of_the_format_description():
    # formats.txt of nauty: n = 5, edges 0-2, 0-4, 1-3, 3-4 is DQc.
    graph = MechanismGraph.from_graph6("DQc")
    assert [(a, b) for a, b, _ in graph.joints] == [(0, 2), (0, 4), (1, 3), (3, 4)]


@pytest.mark.skipif(shutil.which("nauty-geng") is None, reason="nauty is not installed")
def test_reads_the_output_of_geng():
    lines = subprocess.run(["nauty-geng", "-cq", "6"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(lines) == 112  # connected graphs on 6 vertices, OEIS A001349
    assert len({MechanismGraph.from_graph6(line).key for line in lines}) == 112


def test_coloured_text_form():
    graph = MechanismGraph(4, [(0, 1), (1, 2, 2), (2, 3, 4), (0, 3, 2)], frame=2, space=6)
    assert graph.to_text() == "Cl f2 2:0-3,1-2 4:2-3 pi6"
    assert MechanismGraph.from_text("  Cl  f2 2:2-1,3-0 4:2-3 pi6\n") == graph


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", "byte 0"),
        ("?", "byte 0"),
        ("Bw ", "byte 2"),
        ("B", "byte 1"),
        ("Bww", "byte 2"),
        ("B~", "byte 1"),
        ("B\x80", "byte 1"),
        ("B\n\n", "byte 1"),
        (":Bf", "byte 0"),
        ("&Bf", "byte 0"),
        ("~", "byte 1"),
        ("~?", "byte 2"),
        ("~?C?", "byte 0"),
        ("~~?????", "byte 7"),
        ("~~??????", "byte 0"),
        ("~}~~", "byte 0"),
        ("\N{GREEK SMALL LETTER PI}", "byte 0"),
        (b"B\xff", "byte 1"),
        (None, "input"),
        (12, "input"),
        ("A" * 500_000, "input"),
    ],
)
def test_malformed_graph6_names_the_byte(text, place):
    with pytest.raises(FormatError) as caught:
        MechanismGraph.from_graph6(text)
    assert caught.value.place == place


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "field 1"),
        ("Bw f3", "frame"),
        ("Bw f0 f0", "field 3"),
        ("Bw pi4 f0", "field 3"),
        ("Bw 3:0-1 2:1-2 pi6", "field 3"),
        ("Bw 2:0-1 2:1-2", "field 3"),
        ("Bw 2:0-1,0-1", "twice"),
        ("BW 2:0-1", "not a joint"),
        ("Bw 2:0-1,", "not a joint"),
        ("Bw 2:", "field 2"),
        ("Bw 3:0-1", "mobility"),
        ("Bw 6:0-1 pi6", "field 2"),
        ("Bw pi7", "field 2"),
        ("Bw pi\u0664", "ASCII"),
        ("Bw hello", "field 2"),
        ("Bw 2:0-1-2", "not a joint"),
        ("Bw 2:9999999999-1", "not a joint"),
    ],
)
def test_malformed_text_says_what_is_wrong(text, message):
    with pytest.raises(FormatError, match=message):
        MechanismGraph.from_text(text)
