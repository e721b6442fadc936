"""Random and mutated inputs: a reader returns graphs or raises FormatError, within a second, whatever the bytes."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from itertools import islice

import pytest

from graphsynth import formats
from graphsynth.errors import FormatError
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Linear
from graphsynth.mechanism.model import Driver, Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains

NAMES = sorted(formats.FORMATS)
WORDS = [
    b"\x00", b"\xff", b"\xef\xbb\xbf", b"\n", b"\r\n", b'"', b"'", b"\\", b"{", b"}", b"[", b"]", b"<", b">", b"&",
    b"&lol;", b"<!DOCTYPE a>", b"<![CDATA[", b"--", b"->", b"-1", b"0", b"255", b"256", b"99999999999999999999",
    b"1e400", b"NaN", b"null", b"true", b"f0", b"pi6", b"2:", b"# links 0\n", b"# frame 300\n", b"mobility",
    b"frame", b"joint", b"graph", b"graph {", b"subgraph", b"</graph>", b"<edge", b"<data key='joint'>", b"links",
    b"joints", b"text", b"key", b"=", b";", b",", b"/*", b"//", b"\xc3\xa9", b"\xed\xa0\x80", b"kind", b"at_a",
    b"harmonics", b"inf", b"1.5", b"a.",
]  # fmt: skip


def crank_and_cam() -> Mechanism:
    graph = MechanismGraph(5, [(0, 1), (0, 2, 2), (1, 2, 2), (0, 3), (3, 4), (2, 4, 2)], frame=0)
    joints = [
        Revolute(0, 1), Cam(0, 2, radius=3.0, harmonics=((0.1, 0.2),)), PinSlot(1, 2, (1, 0), (0.5, 2), 0.3),
        Prismatic(0, 3), Revolute(3, 4, (1.0, 2.0)), Gear(2, 4, (0.5, 0), (1, 1), 2.0, 3.0),
    ]  # fmt: skip
    pose = [(0.0, 0.0, 0.0), *((0.1, 0.2, 0.3),) * 4]
    return Mechanism(graph, joints, [Driver(0, 1, Linear(2.0))], {"P": (2, (1.0, 2.0))}, pose)


def samples(name: str) -> list[bytes]:
    """Valid texts of a format."""
    entry = formats.FORMATS[name]
    chains = [g for chain in islice(enumerate_chains(8), 4) for g in (chain, chain.with_frame(1))]
    coloured = MechanismGraph(5, [(0, 1), (1, 2, 2), (2, 3), (3, 4), (0, 4, 2)], frame=2)
    items: list[object] = [*chains, coloured, MechanismGraph(70, [(k, k + 1, 5) for k in range(69)], space=6)]
    if name == "graph6":
        items = chains[::2]
    if entry.mechanisms:
        items = [crank_and_cam()] if name == "toml" else [*items, crank_and_cam()]
    found = [formats.write_text(item, name).encode() for item in items]
    if entry.many and name != "graph6":
        found += [formats.write_text(chains, name).encode()]
    if name in ("text", "csv"):
        keys = "\n".join(chain.key for chain in chains)
        found.append((keys if name == "text" else "key\n" + keys).encode())
    return found


def mutated(source: random.Random, valid: list[bytes]) -> bytes:
    """Random bytes, or a valid text with some bytes changed, cut out, doubled or put in."""
    style = source.random()
    if style < 0.1:
        return source.randbytes(source.randrange(60))
    if style < 0.2:
        return b"".join(source.choices(WORDS, k=source.randrange(1, 30)))
    data = bytearray(source.choice(valid))
    for _ in range(source.choice((1, 1, 1, 2, 3, 8))):
        at = source.randrange(len(data) + 1)
        match source.randrange(6):
            case 0:
                data[at : at + 1] = source.randbytes(1)
            case 1:
                del data[at : at + source.choice((1, 1, 4, 30))]
            case 2:
                data[at:at] = source.choice(WORDS)
            case 3:
                part = data[at : at + source.randrange(1, 60)]
                data[at:at] = part * source.choice((1, 2, 40))
            case 4:
                other = source.choice(valid)
                data[at:] = other[source.randrange(len(other) + 1) :]
            case _:
                digit = [k for k, byte in enumerate(data) if chr(byte).isdigit()]
                if digit:
                    data[source.choice(digit)] = source.choice(b"0123456789-.e")
    return bytes(data)


def fuzz(read: Callable[[bytes], object], valid: list[bytes], seed: int, count: int) -> tuple[int, float]:
    """Number of inputs that were read, and the longest time of one."""
    source = random.Random(seed)
    accepted, longest = 0, 0.0
    for _ in range(count):
        data = mutated(source, valid)
        begin = time.thread_time()
        try:
            read(data)
            accepted += 1
        except FormatError as error:
            assert str(error)
        except Exception as error:
            raise AssertionError(f"{type(error).__name__}: {error} from {data!r}") from error
        longest = max(longest, time.thread_time() - begin)
    return accepted, longest


@pytest.mark.parametrize("name", NAMES)
def test_mutations_are_read_or_refused(name: str) -> None:
    accepted, longest = fuzz(lambda data: formats.read_text(data, name), samples(name), 7, 2000)
    assert 0 < accepted < 2000  # the fuzzer reaches both sides
    assert longest < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_hundred_thousand_mutations(name: str) -> None:
    _, longest = fuzz(lambda data: formats.read_text(data, name), samples(name), 11, 100_000)
    assert longest < 1.0


@pytest.mark.parametrize("name", NAMES)
def test_what_is_read_can_be_written_and_read_again(name: str) -> None:
    source, valid = random.Random(3), samples(name)
    for _ in range(300):
        try:
            items = formats.read_text(mutated(source, valid), name)
        except FormatError:
            continue
        entry = formats.FORMATS[name]
        for group in [items] if entry.many and name != "json" else [[item] for item in items]:
            assert formats.read_text(formats.write_text(group, name), name) == group


HOSTILE = {
    "billion laughs": ("graphml", '<!DOCTYPE a [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]><graphml>&b;</graphml>'),
    "an external entity": ("graphml", '<!DOCTYPE a [<!ENTITY a SYSTEM "file:///etc/hostname">]><graphml>&a;</graphml>'),
    "depth of XML": ("graphml", "<graphml>" + "<a>" * 500_000),
    "wide XML": ("graphml", "<graphml>" + "<a/>" * 1_000_000),
    "depth of JSON": ("json", "[" * 1_000_000),
    "a long number": ("json", '{"links": ' + "1" * 1_000_000 + "}"),
    "depth of TOML": ("toml", "a = " + "[" * 400_000),
    "a key of many parts": ("toml", "a." * 400_000 + "a = 1"),
    "a quoted key of many parts": ("toml", '"a" . ' * 100_000 + "a = 1"),
    "a table of many parts": ("toml", "[" + "a." * 400_000 + "a]"),
    "an inline key of many parts": ("toml", "x = {" + "a." * 400_000 + "a=1}"),
    "many vertices": ("dot", "graph {" + "".join(f"{k};" for k in range(200_000))),
    "many edges": ("dot", "graph {" + "a--b;" * 400_000),
    "an open comment": ("dot", "graph {" + "/*" * 1_000_000),
    "an open quotation": ("dot", 'graph { "' + "\\" * 2_000_001),
    "a long sum": ("dot", "graph {a=" + '"a"+' * 250_000 + '"a"}'),
    "many rows": ("edges", "0 1\n" * 1_000_000),
    "a wide matrix": ("adjacency", "0 " * 2_000_000),
    "a high matrix": ("adjacency", "0\n" * 2_000_000),
    "too long": ("dot", " " * 4_000_001),
    "a long line": ("text", "~" * 2_000_000),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_inputs_take_no_time(what: str) -> None:
    name, text = HOSTILE[what]
    spent = []
    for _ in range(3):  # the best of three: the first may import, and the machine may be busy
        begin = time.thread_time()
        with pytest.raises(FormatError) as caught:
            formats.read_text(text, name)
        spent.append(time.thread_time() - begin)
        assert len(str(caught.value)) < 300
        if spent[-1] < 2.0:
            return
    raise AssertionError(f"{what}: {min(spent):.1f} s of processor time")
