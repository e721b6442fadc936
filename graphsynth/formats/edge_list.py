"""Edge lists: one joint ``a b`` or ``a b mobility`` on a line, the frame and the space in the head."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from graphsynth.core.errors import FormatError
from graphsynth.formats.lines import head_of, read_rows
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import LINKS_MAX

_MOST = LINKS_MAX * (LINKS_MAX - 1) // 2
_DICTIONARY = re.compile(r"\{(?:'mobility': ([0-9]))?\}", re.ASCII)  # what networkx.write_edgelist puts behind an edge


def compose(graphs: Iterable[MechanismGraph]) -> Iterator[str]:
    """Write one graph."""
    for graph in graphs:
        rows = (f"{a} {b}\n" if mobility == 1 else f"{a} {b} {mobility}\n" for a, b, mobility in graph.joints)
        yield head_of(graph) + "".join(rows)


def parse(text: str) -> list[MechanismGraph]:
    r"""Read one graph; without ``# links`` it has one link more than its highest number.

    Raises
    ------
    FormatError
        For anything else, with the line.

    Examples
    --------
    >>> parse("0 1\n1 2\n0 2 2\n")[0].to_text()
    'Bw 2:0-2'
    """
    head, rows = read_rows(_DICTIONARY.sub(lambda match: match[1] or "", text), _MOST)
    for row in rows:
        if len(row.numbers) not in (2, 3):
            raise FormatError(f"a joint is 'a b' or 'a b mobility', not {len(row.numbers)} numbers", row.place)
    highest = max((max(row.numbers[:2]) for row in rows), default=-1)
    links = head.get("links", highest + 1)
    if links < 1:
        raise FormatError("no joint and no '# links N'; a graph has at least one link", "end")
    joints = [(row.numbers[0], row.numbers[1], row.numbers[2] if len(row.numbers) > 2 else 1) for row in rows]
    return [MechanismGraph(links, joints, frame=head.get("frame"), space=head.get("space", 3))]
