"""Random and mutated inputs: a reader returns graphs or raises FormatError, within a second, whatever the bytes.

Three kinds: noise; valid files with bytes changed; valid files with a field replaced by another one, so that most of
what is read is well formed and the faults lie in the meaning.
"""

from __future__ import annotations

import json
import random
import re
import time
from collections.abc import Callable
from itertools import islice
from typing import Any

import pytest

from graphsynth import formats
from graphsynth.core.errors import FormatError
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
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


FIELD = re.compile(rb'"(?:[^"\\]|\\.)*"|<[^<>]*>|[A-Za-z_]+|-?[0-9.]+(?:e-?[0-9]+)?|[^\sA-Za-z0-9]|\s+')
FIELDS: list[bytes] = [
    b"", b"0", b"1", b"-1", b"2", b"3", b"5", b"6", b"254", b"255", b"256", b"1e9", b"1e308", b"-0.0", b"5e-324",
    b"1e999",
    b"9" * 400, b"9" * 5000, b"true", b"null", b'""', b'"\\ud800"', b'"R"', b'"cam"', b'"gear"', b'"pin-slot"',
    b'"table"',
    b'"polynomial"', b"[]", b"{}", b"[[]]", b"[0, 0]", b"[1e308, 1e308]", b"[" * 300 + b"]" * 300, b'{"a": 0}',
    b"nan", b"inf", b"f0", b"pi2", b"1979-05-27", b"0x10", b"\xe2\x88\x9a", b"\xd9\xa1", b"a" * 3000, b"\r",
]  # fmt: skip
VALUES: list[Any] = [
    0, 1, -1, 2, 255, 256, 10**9, 10**400, 1.5, -0.0, 1e308, -1e308, 5e-324, True, None, "", "R", "P", "cam", "gear",
    "pin-slot", "linear", "harmonic", "table", "polynomial", "\ud800", "x" * 3000, [], {}, [[]], [0, 0], [1e308, 1e308],
    [[1, 1]] * 40, [0.0] * 40, {"kind": "R", "a": 0, "b": 1}, {"kind": "table", "inputs": [0, 1], "values": [0, 1]},
    {"link": 0, "at": [0, 0]}, "Bw f0", "Cl f0 2:0-3",
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
    """Random bytes, a valid text with bytes changed, or with fields replaced."""
    style = source.random()
    if style < 0.05:
        return source.randbytes(source.randrange(60))
    if style < 0.1:
        return b"".join(source.choices(WORDS, k=source.randrange(1, 30)))
    data = source.choice(valid)
    if style < 0.4:
        return bytes_changed(source, data, valid)
    if style < 0.6 and data[:1] in b"{[":
        try:
            return json.dumps(value_replaced(source, json.loads(data))).encode()
        except ValueError:  # JSON lines
            pass
    return fields_replaced(source, data, valid)


def fields_replaced(source: random.Random, data: bytes, valid: list[bytes]) -> bytes:
    """Replace, repeat, take out or exchange one to three fields: words, numbers, quotations, tags, marks."""
    fields = FIELD.findall(data)
    for _ in range(source.choice((1, 1, 2, 3))):
        if not fields:
            break
        at = source.randrange(len(fields))
        match source.randrange(8):
            case 0 | 1 | 2:
                fields[at] = source.choice(FIELDS)
            case 3:
                fields[at] = source.choice(FIELD.findall(source.choice(valid)) or FIELDS)
            case 4:
                end = at + source.randrange(1, 30)
                fields[at:at] = fields[at:end] * source.choice((1, 1, 30))
            case 5:
                del fields[at : at + source.choice((1, 1, 2, 12))]
            case 6:
                other = source.randrange(len(fields))
                fields[at], fields[other] = fields[other], fields[at]
            case _:
                if fields[at][:1] == b'"' and len(fields[at]) > 2:  # JSON within XML and DOT
                    fields[at] = b'"' + source.choice(FIELDS).replace(b'"', b'\\"') + b'"'
                else:
                    fields[at] = fields[at] + fields[at]
    return b"".join(fields)


def value_replaced(source: random.Random, data: Any) -> Any:
    """Replace, remove, rename or repeat a value of a JSON document."""
    for _ in range(source.choice((1, 1, 2))):
        inner = data
        while isinstance(inner, dict | list) and inner:
            places = list(inner) if isinstance(inner, dict) else range(len(inner))
            place = source.choice(places)
            if isinstance(inner[place], dict | list) and inner[place] and source.random() < 0.7:
                inner = inner[place]
                continue
            match source.randrange(6):
                case 0:
                    del inner[place]
                case 1 if isinstance(inner, dict):
                    inner[source.choice(["kind", "a", "at_a", "harmonics", "law", "x", "frame"])] = inner.pop(place)
                case 2 if isinstance(inner, list):
                    inner[place:place] = [inner[place]] * source.choice((1, 300))
                case _:
                    inner[place] = source.choice(VALUES)
            break
    return data


def bytes_changed(source: random.Random, valid_one: bytes, valid: list[bytes]) -> bytes:
    """Change, cut out, double or put in some bytes."""
    data = bytearray(valid_one)
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
            assert 0 < len(str(error)) < 420
        except Exception as error:
            raise AssertionError(f"{type(error).__name__}: {error} from {data!r}") from error
        longest = max(longest, time.thread_time() - begin)
    return accepted, longest


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_mutations_are_read_or_refused(name: str) -> None:
    accepted, longest = fuzz(lambda data: formats.read_text(data, name), samples(name), 7, 1000)
    assert 0 < accepted < 1000  # the fuzzer reaches both sides
    assert longest < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_hundred_thousand_mutations(name: str) -> None:
    accepted, longest = fuzz(lambda data: formats.read_text(data, name), samples(name), 11, 100_000)
    print(f"{name}: {accepted} of 100000 read, longest {longest:.3f} s")
    assert longest < 1.0


def direct(kind: str) -> tuple[Callable[[bytes], object], list[bytes]]:
    """Readers of mechanisms and graphs that are called without a format, and valid texts."""
    mechanism = crank_and_cam()
    if kind == "keys":
        keys = [g.key for chain in islice(enumerate_chains(8), 9) for g in (chain, chain.with_frame(0))]
        return lambda data: MechanismGraph.from_key(data.decode("latin-1")), [key.encode() for key in keys]
    text = mechanism.to_json() if kind == "json" else mechanism.to_toml()
    return Mechanism.from_json if kind == "json" else Mechanism.from_toml, [text.encode()]


@pytest.mark.parametrize("kind", ["json", "toml", "keys"])
def test_mutations_given_to_a_class(kind: str) -> None:
    accepted, longest = fuzz(*direct(kind), 5, 500)
    assert 0 < accepted < 500 and longest < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["json", "toml", "keys"])
def test_a_hundred_thousand_mutations_given_to_a_class(kind: str) -> None:
    accepted, longest = fuzz(*direct(kind), 13, 100_000)
    print(f"{kind}: {accepted} of 100000 read, longest {longest:.3f} s")
    assert longest < 1.0


@pytest.mark.long
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
