"""Hostile inputs at the bounds of each reader: refused within a second and a bounded memory; files of any length."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest

from graphsynth import formats
from graphsynth.core.errors import FormatError
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains

A_BAR = '{"format": "graphsynth mechanism", "version": 1, "graph": "A_ f0", "joints": ['


def complete(count: int) -> str:
    nodes = "".join(f"<node id='{k}'/>" for k in range(count))
    edges = pairs(count, "<edge source='{}' target='{}'/>")
    return f"<graph>{nodes}{edges}</graph>"


def pairs(count: int, form: str) -> str:
    return "".join(form.format(a, b) for b in range(count) for a in range(b))


K255 = MechanismGraph(255, [(a, b, 2) for b in range(255) for a in range(b)], frame=9).to_text()
DEFAULT = "<graphml><key id='j' for='edge' attr.name='joint'><default>" + "[" * 900 + "1" * 900_000 + "</default></key>"
HOSTILE: dict[str, tuple[str, Callable[[], str | bytes]]] = {
    "billion laughs": ("graphml", lambda: '<!DOCTYPE a [<!ENTITY a "a"><!ENTITY b "&a;&a;">]><graphml>&b;</graphml>'),
    "an external entity": ("graphml", lambda: '<!DOCTYPE a [<!ENTITY a SYSTEM "/etc/hosts">]><graphml>&a;</graphml>'),
    "an unknown entity": ("graphml", lambda: "<graphml>&lol;</graphml>"),
    "depth of XML": ("graphml", lambda: "<graphml>" + "<a>" * 500_000),
    "wide XML": ("graphml", lambda: "<graphml>" + "<a/>" * 740_000 + "</graphml>"),
    "attributes of XML": ("graphml", lambda: "<graphml " + " ".join(f"a{k}=''" for k in range(200_000)) + "/>"),
    "namespaces of XML": ("graphml", lambda: "<graphml " + "".join(f" xmlns:a{k}='u'" for k in range(160_000)) + "/>"),
    "one long name in XML": ("graphml", lambda: "<graphml><" + "a" * 2_900_000 + "/></graphml>"),
    "many keys": ("graphml", lambda: "<graphml>" + "".join(f"<key id='{k}'/>" for k in range(150_000))),
    "a long default for many edges": ("graphml", lambda: DEFAULT + complete(255) + "</graphml>"),
    "a long default for many graphs": (
        "graphml", lambda: "<graphml><key id='p' for='graph' attr.name='points'><default>"
        + '{"' + "p" * 1_000_000 + '": {"link": 0, "at": [0, 0]}}</default></key>'
        "<key id='f' for='graph' attr.name='frame'><default>0</default></key>"
        "<key id='j' for='edge' attr.name='joint'><default>" '{"kind": "R", "a": 0, "b": 1}</default></key>'
        + complete(2) * 15_000,
    ),
    "many tiny graphs": ("graphml", lambda: "<graphml>" + "<graph><node id='0'/></graph>" * 100_000),
    "depth of JSON": ("json", lambda: "[" * 1_000_000),
    "depth of JSON that can be read": ("json", lambda: "[" * 900 + "]" * 900),
    "depth within a mechanism": (
        "json", lambda: A_BAR + '{"kind": "R", "a": 0, "b": 1, "at_a": ' + "[" * 900 + "]" * 900 + "}]}",
    ),
    "width of JSON": ("json", lambda: "[" + "[]," * 990_000 + "[]]"),
    "many tiny records": ("json", lambda: "[" + '{"links":1,"joints":[]},' * 120_000 + "0]"),
    "many keys of JSON": ("json", lambda: "{" + ",".join(f'"{k}":0' for k in range(260_000)) + "}"),
    "one key many times": ("json", lambda: "{" + '"links":1,' * 290_000 + '"links":1}'),
    "joints of a mechanism": (
        "json", lambda: A_BAR
        + '{"kind":"R","a":0,"b":1},' * 110_000 + "0]}",
    ),
    "harmonics": (
        "json", lambda: A_BAR.replace("f0", "f0 2:0-1")
        + '{"kind": "cam", "a": 0, "b": 1, "harmonics": [' + "[0,0]," * 450_000 + "[0,0]]}]}",
    ),
    "a long table": (
        "json", lambda: A_BAR + '{"kind": "R", "a": 0, "b": 1}],'
        ' "drivers": [{"base": 0, "link": 1, "law": {"kind": "table", "values": [0,0], "inputs": ['
        + "0," * 1_000_000 + "0]}}]}",
    ),
    "a long number": ("json", lambda: '{"links": ' + "1" * 1_000_000 + "}"),
    "too long for JSON": ("json", lambda: " " * 3_000_001),
    "depth of TOML": ("toml", lambda: "a = " + "[" * 400_000),
    "a key of many parts": ("toml", lambda: "a." * 200_000 + "a = 1"),
    "a quoted key of many parts": ("toml", lambda: '"a" . ' * 80_000 + "a = 1"),
    "a table of many parts": ("toml", lambda: "[" + "a." * 200_000 + "a]"),
    "an inline key of many parts": ("toml", lambda: "x = {" + "a." * 200_000 + "a=1}"),
    "keys of TOML": ("toml", lambda: "\n".join(f"a{k}=1" for k in range(44_000))),
    "tables of TOML": ("toml", lambda: "[[a]]\n" * 66_000),
    "a wide array of TOML": ("toml", lambda: "a=[" + "0," * 199_000 + "]"),
    "numbers of TOML": ("toml", lambda: "\n".join(f"a{k}=0.{k}e9" for k in range(24_000))),
    "a long number of TOML": ("toml", lambda: "a = " + "9" * 390_000),
    "many vertices": ("dot", lambda: "graph {" + "".join(f"{k};" for k in range(150_000))),
    "many edges": ("dot", lambda: "graph {" + "a--b;" * 300_000),
    "an open comment": ("dot", lambda: "graph {" + "/* " * 600_000),
    "an open quotation": ("dot", lambda: 'graph { "' + "\\" * 1_900_001),
    "comments": ("dot", lambda: "graph {" + "//\n" * 600_000),
    "a long sum": ("dot", lambda: "graph {a=" + '"a"+' * 250_000 + '"a"}'),
    "a long default in DOT": (
        "dot", lambda: 'graph { edge [joint="' + "[" * 900_000 + '"];' + pairs(200, "{}--{};") + "}",
    ),
    "many defaults in DOT": (
        "dot", lambda: "graph { edge [" + "".join(f"a{k}=1," for k in range(50_000)) + "];" + "a--b;" * 30_000,
    ),
    "many rows": ("edges", lambda: "0 1\n" * 900_000),
    "empty lines": ("edges", lambda: "\n" * 4_000_000),
    "comments in a list": ("edges", lambda: "#\n" * 2_000_000),
    "spaces in a head": ("edges", lambda: "# links" + " " * 3_000_000 + "x"),
    "a wide matrix": ("adjacency", lambda: "0 " * 2_000_000),
    "a high matrix": ("adjacency", lambda: "0\n" * 2_000_000),
    "brackets": ("adjacency", lambda: "]" * 4_000_000),
    "a full incidence matrix": ("incidence", lambda: ("1 " * 7800 + "\n") * 255),
    "too long": ("dot", lambda: " " * 2_000_001),
    "a long line": ("text", lambda: "~" * 2_000_000),
    "a graph6 of 2^36 links": ("graph6", lambda: "~~" + "~" * 6),
    "a graph6 of 2^18 links": ("text", lambda: "~~~~" + "?" * 100_000),
    "many lines": ("text", lambda: "Bw\n" * 990_000),
    "many large lines": ("text", lambda: (K255.split()[0] + "\n") * 540),
    "many coloured lines": ("text", lambda: (K255 + "\n") * 12),
    "a field of many names": ("text", lambda: "Cl 2:" + "0-1," * 90_000),
    "many rows of a table": ("csv", lambda: "text\n" + "Bw\n" * 990_000),
    "many large rows": ("csv", lambda: "text\n" + (K255.split()[0] + "\n") * 540),
    "many keys of a table": ("csv", lambda: "key\n" + (MechanismGraph(24, []).key + "\n") * 55_000),
    "a row of many lines": ("csv", lambda: "text,a\n" + 'Bw,"' + "\n" * 2_900_000),
    "a row of many fields": ("csv", lambda: "text\n" + "," * 2_900_000),
    "an open quotation in a table": ("csv", lambda: 'text\n"' + "B" * 2_900_000),
    "UTF-16": ("csv", lambda: "text\nBw\n".encode("utf-16")),
    "UTF-16 as XML": ("graphml", lambda: "<?xml version='1.0' encoding='UTF-16'?><graphml/>".encode("utf-16")),
    "NUL": ("json", lambda: b"\x00" * 100_000),
    "half a character": ("json", lambda: '{"links": "\ud800"}'),
    "half a character in XML": ("graphml", lambda: "<graphml>\udfff</graphml>"),
}  # fmt: skip


#: Those that take more than a tenth of a second of processor time.
LONG = {
    "wide XML", "attributes of XML", "namespaces of XML", "one long name in XML", "a long default for many edges",
    "a long default for many graphs", "many tiny graphs", "width of JSON", "many tiny records", "many keys of JSON",
    "joints of a mechanism", "harmonics", "a long table", "keys of TOML", "tables of TOML", "a wide array of TOML",
    "numbers of TOML", "a long number of TOML", "many vertices", "many edges", "a long sum", "a long default in DOT",
    "many defaults in DOT", "a full incidence matrix", "many lines", "many large lines", "many coloured lines",
    "many rows of a table", "many large rows", "many keys of a table", "one key many times", "comments",
}  # fmt: skip
MARKED = [pytest.param(what, marks=pytest.mark.slow if what in LONG else ()) for what in HOSTILE]


@pytest.mark.parametrize("what", MARKED)
def test_hostile_inputs_take_no_time(what: str) -> None:
    name, make = HOSTILE[what]
    text, spent = make(), []
    for _ in range(3):  # the best of three: the first may import, and the machine may be busy
        begin = time.thread_time()
        with pytest.raises(FormatError) as caught:
            formats.read_text(text, name)
        spent.append(time.thread_time() - begin)
        assert len(str(caught.value)) < 420
        if spent[-1] < 1.0:
            return
    raise AssertionError(f"{what}: {min(spent):.1f} s of processor time")


@pytest.mark.slow
@pytest.mark.parametrize("what", sorted(LONG | {"many rows", "depth of JSON", "empty lines"}))
def test_hostile_inputs_take_little_memory(what: str) -> None:
    name, make = HOSTILE[what]
    text = make()
    tracemalloc.start()
    try:
        with pytest.raises(FormatError):
            formats.read_text(text, name)
        assert tracemalloc.get_traced_memory()[1] < 250e6
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_a_file_of_any_length_takes_the_memory_of_one_graph(tmp_path: Path) -> None:
    graph = next(iter(enumerate_chains(8)))
    count = formats.GRAPHS_MAX + 500
    for name, most in (("text", 2e6), ("csv", 2e6), ("graphml", 9e6)):
        file = tmp_path / f"x.{name}"
        formats.write((graph for _ in range(count)), file, name)
        tracemalloc.start()
        try:
            assert sum(item == graph for item in formats.read_all(file, name)) == count
            assert tracemalloc.get_traced_memory()[1] < most
        finally:
            tracemalloc.stop()
        with pytest.raises(FormatError, match="at once; split"):
            formats.read_text(file.read_bytes(), name)
