"""Wishes besides the numbers of links and joints: what a chain as a whole is to be like.

The length of the shortest loop, and links that share a joint or not, are needs of the search and of counts.  The others
are asked of each chain as it is listed: no list is kept, but a count makes every chain.  So are all wishes but
the girth for chains with multiple joints, and all for those with prismatic joints unless each is a cylinder's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Literal

from graphsynth.core.errors import SpecError
from graphsynth.core.wording import shown, whole
from graphsynth.structure.graph import Joint, MechanismGraph
from graphsynth.structure.multiple_joints import MultipleJointChain
from graphsynth.structure.slider_chains import SliderChain
from graphsynth.synthesis.kernels.layout import GIRTH, LONGEST, PAIR, PAIRS

if TYPE_CHECKING:
    from networkx import Graph

_TYPES = ("total", "partial", "fractionated")
_MOST_PAIRS = 6  # that the rules of the search have room for
_ANY_LINK = ("link", "frame")  # a link of a part may be the frame

Role = int | Literal["frame"]
Pair = tuple[Role, Role]


@dataclass(frozen=True)
class Wishes:
    """What chains, or mechanisms, are to be like as a whole.

    Parameters
    ----------
    girth : int
        Fewest joints of a loop, 3 to 15.
    jointed, apart : iterable of pairs
        Links that share a joint, at least one such pair; links of which no two do.  A link is named by its number of
        joints, or ``"frame"``.
    contains, without : iterable of MechanismGraph
        Sub-graphs that are prescribed, forbidden: links and joints with their mobilities, other joints may be between
        the links; a frame has to be the frame.  Each joint stands for another one of the chain.
    planar : bool, optional
        Whether the graph is to be planar.
    mobility_type : str, optional
        ``"total"``, ``"partial"`` or ``"fractionated"``.

    Raises
    ------
    SpecError
        For a value that is none of these.

    Examples
    --------
    >>> from graphsynth import count_chains
    >>> count_chains(8, wishes=Wishes(girth=5)), count_chains(10, wishes=Wishes(jointed=[(4, 4)]))
    (1, 23)
    """

    girth: int = 3
    jointed: tuple[Pair, ...] = ()
    apart: tuple[Pair, ...] = ()
    contains: tuple[MechanismGraph, ...] = ()
    without: tuple[MechanismGraph, ...] = ()
    planar: bool | None = None
    mobility_type: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "girth", whole(self.girth, "girth", 3, LONGEST))
        for name in ("jointed", "apart"):
            object.__setattr__(self, name, _pairs(getattr(self, name), name))
        for name in ("contains", "without"):
            given = getattr(self, name)
            graphs = tuple(given) if isinstance(given, Iterable) else (given,)
            if any(not isinstance(graph, MechanismGraph) for graph in graphs):
                raise SpecError(f"{name} = {shown(given)} must be a list of MechanismGraph")
            object.__setattr__(self, name, graphs)
        if self.planar not in (None, True, False):
            raise SpecError(f"planar = {shown(self.planar)} must be True, False or None")
        if self.mobility_type not in (None, *_TYPES):
            raise SpecError(f"mobility_type = {shown(self.mobility_type)} must be one of {', '.join(_TYPES)}")

    def __str__(self) -> str:
        said = [f"girth={self.girth}"] if self.girth > 3 else []
        for name in ("jointed", "apart"):
            said += [f"{name}={one}-{other}" for one, other in getattr(self, name)]
        for name in ("contains", "without"):
            said += [f"{name}={graph.to_text()}" for graph in getattr(self, name)]
        said += [
            f"{name}={value}" for name in ("planar", "mobility_type") if (value := getattr(self, name)) is not None
        ]
        return " ".join(said)

    @property
    def rules(self) -> int:
        """What the search takes over, as rules of a family: the girth, and pairs of links of three joints or more."""
        rules = (self.girth if self.girth > 3 else 0) << GIRTH
        for place, (one, other, apart) in enumerate(self._searched):
            rules |= (one | other << 4 | apart << 8) << (PAIRS + PAIR * place)
        return rules

    @property
    def rules_of_pins(self) -> int:
        """The same for chains with multiple joints: the girth, up to 7, in halves of a joint."""
        return 2 * self.girth << GIRTH if 3 < self.girth <= LONGEST // 2 else 0

    @property
    def _searched(self) -> list[tuple[int, int, bool]]:
        pairs = [(one, other, False) for one, other in self.jointed] + [(one, other, True) for one, other in self.apart]
        return [
            (one, other, apart)
            for one, other, apart in pairs
            if isinstance(one, int) and isinstance(other, int) and 3 <= min(one, other) <= max(one, other) <= LONGEST
        ][:_MOST_PAIRS]

    @property
    def is_searched(self) -> bool:
        """Whether the search takes over all of the wishes, so that chains need not be made to be counted."""
        others = self.contains or self.without or self.planar is not None or self.mobility_type
        return not others and len(self._searched) == len(self.jointed) + len(self.apart)

    def fit(self, chain: MechanismGraph | SliderChain | MultipleJointChain) -> bool:
        """Tell whether a chain is as wished (exact); where joints slide, the graph of all joints."""
        graph = chain.graph if isinstance(chain, SliderChain) else chain
        return (
            (self.girth == 3 or (graph.girth or self.girth) >= self.girth)
            and all(_share_a_joint(graph, pair) for pair in self.jointed)
            and not any(_share_a_joint(graph, pair) for pair in self.apart)
            and (self.mobility_type is None or graph.mobility_type == self.mobility_type)
            and (self.planar is None or graph.is_planar == self.planar)
            and all(_holds(graph, part) for part in self.contains)
            and not any(_holds(graph, part) for part in self.without)
        )


def _pairs(given: object, name: str) -> tuple[Pair, ...]:
    try:
        pairs = [tuple(pair) for pair in given]  # type: ignore[attr-defined]
    except TypeError:
        pairs = [()]
    if any(len(pair) != 2 for pair in pairs):
        raise SpecError(f"{name} = {shown(given)} must be pairs of links, as in [(3, 4), ('frame', 3)]")
    found = []
    for pair in pairs:
        roles = [role if role == "frame" else whole(role, f"{name}: joints of a link", 1) for role in pair]
        found.append((roles[0], roles[1]))
    return tuple(found)


def _share_a_joint(graph: MechanismGraph | MultipleJointChain, pair: Pair) -> bool:
    def playing(role: Role) -> list[int]:
        return [
            link for link in range(graph.links) if role in (graph.degrees[link], *["frame"] * (link == graph.frame))
        ]

    return any(graph.neighbours[a] >> b & 1 for a, b in product(*map(playing, pair)))


def _holds(graph: MechanismGraph | MultipleJointChain, part: MechanismGraph) -> bool:
    from networkx.algorithms.isomorphism import GraphMatcher

    pins = isinstance(graph, MultipleJointChain)
    matcher = GraphMatcher(
        _view(graph, pins),
        _view(part, pins),
        node_match=lambda mine, wanted: wanted["role"] == mine["role"] or (wanted["role"], mine["role"]) == _ANY_LINK,
        edge_match=lambda mine, wanted: mine["mobility"] == wanted["mobility"],
    )
    return bool(matcher.subgraph_is_monomorphic())


def _view(graph: MechanismGraph | MultipleJointChain, pins: bool) -> Graph:
    """Return links as vertices and joints as edges; with multiple joints, both as vertices."""
    from networkx import Graph

    view = Graph()
    view.add_nodes_from((link, {"role": "frame" if link == graph.frame else "link"}) for link in range(graph.links))
    for number, joint in enumerate(graph.joints, graph.links):
        ends, mobility = (joint[:2], joint.mobility) if isinstance(joint, Joint) else (joint, 1)
        if pins:
            view.add_node(number, role="joint")
        view.add_edges_from([(link, number) for link in ends] if pins else [ends], mobility=mobility)
    return view
