"""The mechanism graph: links as vertices, joints as edges, joint mobilities as edge colours, one link as frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from operator import index
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.core.shown import work
from graphsynth.structure.connectivity import bits, breadth_first, component_of, components_of
from graphsynth.structure.text import (
    LINKS_MAX,
    decode_graph6,
    decode_text,
    encode_graph6,
    encode_text,
    from_networkx,
    integer,
    packed_joints,
)

if TYPE_CHECKING:
    from pathlib import Path

    import graphsynth as gs
    from graphsynth.structure.canonical import Labelling, Roles
    from graphsynth.structure.rigidity import GenericMobility, RigidSubchain

_T = TypeVar("_T")


class Joint(NamedTuple):
    """A joint between links ``a < b`` with ``mobility`` relative freedoms (its sub-edges)."""

    a: int
    b: int
    mobility: int = 1


class MechanismGraph:
    """A kinematic chain, or a mechanism when a frame is chosen, as a simple graph with coloured edges.

    Immutable and hashable; two graphs are equal when they have the same labelled joints, frame and space, and
    isomorphic when their :attr:`key` is the same.  Everything derived is computed on first use and kept.

    Parameters
    ----------
    links : int
        Number of links N, the frame included, 1 to 255; they are numbered from 0.
    joints : iterable of (a, b) or (a, b, mobility)
        Joints in any order; the mobility is 1 unless given and lies in 1..space-1.
    frame : int, optional
        The fixed link; a chain has none.
    space : int, optional
        Mobility Pi of a free link: 3 in the plane (default) or on the sphere, 6 in space, 2 to 6.

    Raises
    ------
    FormatError
        A link that does not exist, a joint of a link with itself, a pair joined twice, a mobility or space out of
        its bounds; ``place`` names the joint.

    Examples
    --------
    >>> four_bar = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> four_bar.mobility, four_bar.loops, four_bar.levels
    (1, 1, ((0,), (1, 3), (2,)))
    >>> four_bar.to_text()
    'Cl f0'
    """

    __slots__ = ("_cache", "frame", "links", "packed", "space")

    links: int
    packed: bytes
    frame: int | None
    space: int
    _cache: dict[str, Any]

    def __init__(
        self,
        links: int,
        joints: Iterable[tuple[int, int] | tuple[int, int, int]],
        *,
        frame: int | None = None,
        space: int = 3,
    ) -> None:
        links = integer(links, "links", 1, LINKS_MAX, "number of links")
        space = integer(space, "space", 2, 6, "mobility of a free link")
        if frame is not None:
            frame = integer(frame, "frame", 0, links - 1, "frame")
        _set_links(self, links)
        _set_packed(self, packed_joints(links, joints, space))
        _set_frame(self, frame)
        _set_space(self, space)

    @classmethod
    def _unchecked(cls, links: int, packed: bytes, frame: int | None = None, space: int = 3) -> MechanismGraph:
        """Make a graph from joints already valid: three bytes ``a, b, mobility`` each, sorted, ``a < b``."""
        self = _new(cls)
        _set_links(self, links)
        _set_packed(self, packed)
        _set_frame(self, frame)
        _set_space(self, space)
        return self

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a MechanismGraph does not change; make a new one instead of setting {name!r}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a MechanismGraph does not change; {name!r} cannot be deleted")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MechanismGraph):
            return NotImplemented
        return (
            self.packed == other.packed
            and self.links == other.links
            and self.frame == other.frame
            and self.space == other.space
        )

    def __hash__(self) -> int:
        return hash((self.links, self.packed, self.frame, self.space))

    def __repr__(self) -> str:
        return f"MechanismGraph.from_text({self.to_text()!r})"

    def __reduce__(self) -> tuple[Callable[..., MechanismGraph], tuple[Any, ...]]:
        # Only data travels between worker processes; the cache stays behind.
        return MechanismGraph._unchecked, (self.links, self.packed, self.frame, self.space)

    def __copy__(self) -> MechanismGraph:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> MechanismGraph:
        return self

    def _lazy(self, name: str, compute: Callable[[MechanismGraph], _T]) -> _T:
        """Return ``compute(self)``, computed once."""
        try:
            cache = self._cache
        except AttributeError:
            cache = {}
            _set_cache(self, cache)
        try:
            value: _T = cache[name]
        except KeyError:
            value = cache[name] = compute(self)
        return value

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints, sorted by ``(a, b)`` with ``a < b``."""
        return self._lazy("joints", _joints)

    @property
    def neighbours(self) -> tuple[int, ...]:
        """For each link the bit mask of the links jointed to it."""
        return self._lazy("neighbours", _neighbours)

    @property
    def degrees(self) -> tuple[int, ...]:
        """Number of joints of each link."""
        return self._lazy("degrees", lambda g: tuple(mask.bit_count() for mask in g.neighbours))

    @property
    def sub_edges(self) -> int:
        """Total mobility of the joints, G."""
        return sum(self.packed[2::3])

    @property
    def mobility(self) -> int:
        """Mobility by the structural formula, W = Pi (N - 1) - sum over joints of (Pi - f) (exact count).

        It equals G - v Pi for a connected graph.  :meth:`rigid_subchain` says whether the count holds in every
        part; :meth:`generic_mobility` is the cross-check by rank.
        """
        joints = len(self.packed) // 3
        return self.space * (self.links - 1 - joints) + self.sub_edges

    @property
    def loops(self) -> int:
        """Number of independent loops v = p - N + c, with c the number of connected parts (1 for a chain)."""
        return len(self.packed) // 3 - self.links + len(self.components)

    @property
    def assortment(self) -> dict[int, int]:
        """How many links have a joints, ``{a: n_a}`` ascending in a: moving links if there is a frame, else all."""
        degrees = [d for link, d in enumerate(self.degrees) if link != self.frame]
        return dict(sorted(Counter(degrees).items()))

    @property
    def components(self) -> tuple[tuple[int, ...], ...]:
        """The connected parts, each as its links in ascending order."""
        return self._lazy("components", _components)

    @property
    def is_connected(self) -> bool:
        """Whether every link can be reached from every other."""
        return component_of(self.neighbours, 0) == (1 << self.links) - 1

    @property
    def levels(self) -> tuple[tuple[int, ...], ...]:
        """Adjacency levels: the frame, the links jointed to it, the links jointed to those, and so on.

        `GraphError` if no frame is chosen, or some link cannot be reached from it.
        """
        return self._lazy("levels", _levels)

    @property
    def labelling(self) -> Labelling:
        """Canonical labelling, generators of the automorphism group, its order and orbits (one search)."""
        from graphsynth.structure.canonical import label

        return self._lazy("labelling", label)

    @property
    def key(self) -> str:
        """Canonical key: equal for two graphs exactly when they are isomorphic, joint mobilities and frame included.

        Short printable ASCII, the same on every platform; the first character is the version.  See
        ``docs/explanation/mechanism-graph.md``.
        """
        from graphsynth.structure.canonical import key

        return self._lazy("key", key)

    @classmethod
    def from_key(cls, key: str) -> MechanismGraph:
        """Read a canonical key back into the canonical graph; anything else is a :class:`FormatError`."""
        from graphsynth.structure.canonical import decode_key

        links, joints, frame, space = decode_key(key)
        graph = cls(links, joints, frame=frame, space=space)
        if graph.key != key:
            raise FormatError("not the key of the graph it describes; keys are not written by hand", "key")
        return graph

    @property
    def automorphism_order(self) -> int:
        """Order of the automorphism group (exact)."""
        return self.labelling.order

    @property
    def orbits(self) -> tuple[tuple[int, ...], ...]:
        """Orbits of links under the automorphism group, in the order of their smallest link."""
        return self._lazy("orbits", lambda g: _classes(g.labelling.orbits))

    @property
    def joint_orbits(self) -> tuple[tuple[Joint, ...], ...]:
        """Orbits of joints under the automorphism group, in the order of their smallest joint."""
        from graphsynth.structure.canonical import joint_orbits

        return self._lazy("joint_orbits", joint_orbits)

    def roles(self, drivers: int = 1, outputs: int = 1) -> tuple[Roles, ...]:
        """Return the choices of driven links on the frame and of output links, one from each orbit (exact).

        See :func:`graphsynth.structure.canonical.roles`.
        """
        from graphsynth.structure.canonical import roles

        return roles(self, drivers, outputs)

    def canonical(self) -> MechanismGraph:
        """Return the canonical representative of the isomorphism class; the frame, if any, becomes link 0.

        The links of a mechanism are listed level by level.
        """
        return self._lazy("canonical", lambda g: g.relabelled(g.labelling.permutation))

    def relabelled(self, permutation: Sequence[int]) -> MechanismGraph:
        """Return the graph in which link ``i`` is called ``permutation[i]``; `GraphError` if it is no permutation."""
        try:
            permutation = list(map(index, permutation))
        except Exception:  # no sequence, no integers
            permutation = []
        if sorted(permutation) != list(range(self.links)):
            raise GraphError(f"relabelling {self.links} links needs a permutation of 0..{self.links - 1}")
        packed = self.packed
        triples = []
        for place in range(0, len(packed), 3):
            a, b = permutation[packed[place]], permutation[packed[place + 1]]
            triples.append(bytes((a, b, packed[place + 2]) if a < b else (b, a, packed[place + 2])))
        triples.sort()
        frame = None if self.frame is None else int(permutation[self.frame])
        return MechanismGraph._unchecked(self.links, b"".join(triples), frame, self.space)

    def with_frame(self, link: int) -> MechanismGraph:
        """Return the mechanism with ``link`` as frame, moved to the front; the other links keep their order.

        >>> MechanismGraph(3, [(0, 1), (1, 2)]).with_frame(1).joints
        (Joint(a=0, b=1, mobility=1), Joint(a=0, b=2, mobility=1))
        """
        link = integer(link, "link", 0, self.links - 1, "frame")
        permutation = [0 if i == link else i + 1 if i < link else i for i in range(self.links)]
        moved = self.relabelled(permutation)
        return MechanismGraph._unchecked(moved.links, moved.packed, 0, moved.space)

    def without_frame(self) -> MechanismGraph:
        """Return the kinematic chain: the same links and joints, no frame."""
        return MechanismGraph._unchecked(self.links, self.packed, None, self.space)

    def inversions(self) -> list[MechanismGraph]:
        """Return the kinematic inversions: one mechanism for each orbit of links, in canonical order.

        The frame, if one is chosen, is forgotten first.
        """
        chain = self if self.frame is None else self.without_frame()
        position = chain.labelling.permutation
        frames = sorted((min(orbit, key=position.__getitem__) for orbit in chain.orbits), key=position.__getitem__)
        return [chain.with_frame(link) for link in frames]

    @property
    def cut_links(self) -> tuple[int, ...]:
        """Links whose removal disconnects the others."""
        from graphsynth.structure.connectivity import cut_links

        return self._lazy("cut_links", cut_links)

    @property
    def cut_joints(self) -> tuple[Joint, ...]:
        """Joints whose removal disconnects the graph."""
        from graphsynth.structure.connectivity import cut_joints

        return self._lazy("cut_joints", cut_joints)

    @property
    def is_fractionated(self) -> bool:
        """Whether a cut link or a cut joint splits the chain; :class:`GraphError` if it is not connected."""
        if not self.is_connected:
            raise GraphError("fractionation is a property of a connected chain; this graph is in several parts")
        return bool(self.cut_links or self.cut_joints)

    @property
    def is_planar(self) -> bool:
        """Whether the graph can be drawn without crossings (planarity test of networkx)."""
        from graphsynth.structure.connectivity import is_planar

        return self._lazy("is_planar", is_planar)

    @property
    def girth(self) -> int | None:
        """Number of joints of the shortest loop, or None for a graph without loops."""
        from graphsynth.structure.connectivity import girth

        return self._lazy("girth", girth)

    @property
    def mobility_type(self) -> str:
        """How the mobility is shared out, ``"total"``, ``"partial"`` or ``"fractionated"`` (exact).

        See :func:`graphsynth.structure.rigidity.mobility_type`; `GraphError` for a chain that does not move in all its
        parts.
        """
        from graphsynth.structure.rigidity import mobility_type

        return self._lazy("mobility_type", mobility_type)

    def rigid_subchain(self) -> RigidSubchain | None:
        """Return a report on a rigid or over-constrained sub-chain, or None if there is none (exact)."""
        from graphsynth.structure.rigidity import find_rigid_subchain

        return self._lazy("rigid_subchain", find_rigid_subchain)

    def generic_mobility(self, seed: int = 0) -> GenericMobility:
        """Return the mobility at random geometry, W = G - rank of the loop matrix.

        See :func:`graphsynth.structure.rigidity.generic_mobility`.
        """
        from graphsynth.structure.rigidity import generic_mobility

        return generic_mobility(self, seed)

    def graph6(self) -> str:
        """Return the graph6 text of an uncoloured chain.

        `GraphError` if a frame is chosen or a joint has a mobility other than 1: use :meth:`to_text`.
        """
        if self.frame is not None or any(m != 1 for m in self.packed[2::3]) or self.space != 3:
            raise GraphError("graph6 has no place for a frame, joint mobilities or a space; use to_text()")
        return encode_graph6(self.links, self.packed)

    @classmethod
    def from_graph6(cls, text: str | bytes) -> MechanismGraph:
        """Read graph6; anything else is a :class:`FormatError` with the byte.

        >>> MechanismGraph.from_graph6("Cl").mobility
        1
        """
        return cls._unchecked(*decode_graph6(text))

    def to_text(self) -> str:
        """Return the one-line form: graph6, then the frame, joint mobilities and space where needed."""
        return encode_text(self.links, self.packed, self.frame, self.space)

    @classmethod
    def from_text(cls, text: str | bytes) -> MechanismGraph:
        """Read the one-line form of :meth:`to_text`; anything else is a :class:`FormatError` with the field."""
        links, joints, frame, space = decode_text(text)
        return cls(links, joints, frame=frame, space=space)

    def draw(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Draw its kinematic diagram, and write it to a file (.svg, .png, .pdf, .tikz, .dxf) if a path is given.

        ``driver``, ``width``, ``height``, ``numbers`` and ``title`` are those of
        :func:`graphsynth.drawing.graphs.graph_sketch`.
        """
        found: gs.Drawing = work("draw graph")(self, path, **options)
        return found

    def _repr_svg_(self) -> str:
        picture: str = work("graph picture")(self)
        return picture

    def to_networkx(self) -> Any:
        """Return a ``networkx.Graph``: edge attribute ``mobility``, graph attributes ``frame`` and ``space``.

        >>> sorted(MechanismGraph(3, [(0, 1), (1, 2, 2)]).to_networkx().edges(data="mobility"))
        [(0, 1, 1), (1, 2, 2)]
        """
        import networkx

        view = networkx.Graph(space=self.space)
        if self.frame is not None:
            view.graph["frame"] = self.frame
        view.add_nodes_from(range(self.links))
        view.add_edges_from((a, b, {"mobility": mobility}) for a, b, mobility in self.joints)
        return view

    @classmethod
    def from_networkx(cls, graph: Any) -> MechanismGraph:
        """Read a ``networkx.Graph`` made by :meth:`to_networkx` or by hand.

        Nodes that are the integers 0..N-1 keep their number; others are numbered in their order.  Edge attribute
        ``mobility`` (default 1), graph attributes ``frame`` (a node) and ``space`` (default 3) are read; anything else
        is a :class:`FormatError`, with the node or edge.
        """
        links, joints, frame, space = from_networkx(graph)
        return cls(links, joints, frame=frame, space=space)


# A slot descriptor writes past __setattr__; bound once, because the enumerator makes graphs by the million.
_new = object.__new__
_set_links, _set_packed, _set_frame, _set_space, _set_cache = (
    MechanismGraph.__dict__[name].__set__ for name in ("links", "packed", "frame", "space", "_cache")
)


def _joints(graph: MechanismGraph) -> tuple[Joint, ...]:
    values = iter(graph.packed)
    return tuple(map(Joint, values, values, values))


def _neighbours(graph: MechanismGraph) -> tuple[int, ...]:
    masks = [0] * graph.links
    for a, b, _ in graph.joints:
        masks[a] |= 1 << b
        masks[b] |= 1 << a
    return tuple(masks)


def _components(graph: MechanismGraph) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(bits(part)) for part in components_of(graph.neighbours, (1 << graph.links) - 1))


def _levels(graph: MechanismGraph) -> tuple[tuple[int, ...], ...]:
    if graph.frame is None:
        raise GraphError("adjacency levels start at the frame, and this chain has none; choose one with with_frame()")
    levels = tuple(tuple(bits(level)) for level in breadth_first(graph.neighbours, graph.frame))
    reached = {link for level in levels for link in level}
    if len(reached) < graph.links:
        missing = next(link for link in range(graph.links) if link not in reached)
        raise GraphError(f"link {missing} cannot be reached from the frame, so it is on no adjacency level")
    return levels


def _classes(representative: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    """Group links by their representative."""
    groups: dict[int, list[int]] = {}
    for link, root in enumerate(representative):
        groups.setdefault(root, []).append(link)
    return tuple(tuple(group) for group in groups.values())
