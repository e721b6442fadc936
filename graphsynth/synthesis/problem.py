"""A problem: everything one call enumerates or counts, cut into work items that can be done anywhere in any order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from hashlib import sha256
from itertools import chain
from operator import methodcaller
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GraphsynthError, InfeasibleSpecError, SpecError, TooLargeError
from graphsynth.core.ordered import in_order, processes as processes_of
from graphsynth.core.wording import shown, whole
from graphsynth.synthesis.chunks import Chunk, cut
from graphsynth.synthesis.contracted import FOLDER_VARIABLE, SHIPPED_LOOPS, has_contracted_graphs
from graphsynth.synthesis.edge_labels import CYLINDERS, SLIDER
from graphsynth.synthesis.families import (
    MOST_LINKS,
    Family,
    Levels,
    chain_families,
    chain_joints,
    chain_numbers,
    mechanism_families,
    multiple_joint_families,
    slider_families,
)
from graphsynth.synthesis.fractionated import OneByOne
from graphsynth.synthesis.geared_trees import COAXIAL, DRIVE, FRAME, MOST_LINKS as MOST_GEARED, NO_ROLES, geared_trees
from graphsynth.synthesis.kernels.layout import NO_SLIDING_LINK, NO_SLIDING_LOOP
from graphsynth.synthesis.made import Made
from graphsynth.synthesis.totals import Total, is_counted_together, totals_of
from graphsynth.synthesis.wishes import Wishes

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.system.assortment import LinkAssortment
    from graphsynth.structure.system.spec import StructuralSpec

_PRIMES = (2, 3, 5, 7, 11, 13)
_LISTED_PER_SECOND = 1e6  # order of magnitude, one core
_MOST_LOOPS = 10  # what the kernels are laid out for
_MOST_PINNED = 7  # contracted graphs with vertices of two kinds are kept in memory
_COUNTED_LOOPS = 6  # counts of so many loops take a moment
# 1-DOF planar chains with 2, 3, ..., 8 loops (published and recomputed): where there is nothing smaller to count
_KNOWN = (2, 16, 230, 6856, 318162, 19819281, 1535380884)

WorkItem = Chunk | Made


@dataclass(frozen=True)
class EnumerationProblem:
    """What to enumerate or to count."""

    title: str  # one line for people
    families: tuple[Family, ...]  # what the search kernels generate
    one_by_one: tuple[Made, ...] = ()  # what is made one by one; listed first
    symmetry: int = 0  # 0, or the prime order of a required automorphism
    #: why there is nothing, where the structural formula says so already
    reason: str = field(default="", repr=False, compare=False)
    wishes: Wishes | None = field(default=None, repr=False)  # those that the search does not take over

    @property
    def signature(self) -> str:
        """A short text that differs between problems; catalogues and journals keep it, so its form stays as it was."""
        text = repr(self).replace("EnumerationProblem(", "Problem(").replace("one_by_one=", "handfuls=")
        return sha256(text.replace("OneByOne(", "Handful(").encode()).hexdigest()[:16]

    def work_items(self, *, listing: bool) -> list[WorkItem]:
        """Cut the problem; the cut depends on the problem alone."""
        listing = listing or bool(self.symmetry or self.wishes) or any(family.levels for family in self.families)
        return list(_work_items(self, listing))

    def parts(self) -> Sequence[WorkItem | Total]:
        """Cut the problem to count it as a whole; where chains are many, the counts of the parts are fractions."""
        totals = None if self.symmetry or self.wishes else totals_of(self.families)
        return self.work_items(listing=False) if totals is None else [*self.one_by_one, *totals]

    def wishing(self, wishes: Wishes | None) -> EnumerationProblem:
        """Return the problem of those that are as wished.

        Raises `SpecError` for what are no wishes, or chains that can have none.
        """
        if wishes is None:
            return self
        if not isinstance(wishes, Wishes):
            raise SpecError(f"wishes = {shown(wishes)} must be Wishes")
        if not all(isinstance(item, OneByOne) for item in self.one_by_one):
            raise SpecError(
                f"{self.title}: wishes speak of loops and of links by their joints, which the axes of a gear train do "
                "not have: list the trains, and choose"
            )
        rules, searched = wishes.rules, wishes.is_searched
        if any(family.pins for family in self.families):
            rules = wishes.rules_of_pins
            searched = rules > 0 and wishes == Wishes(wishes.girth)
        if any(family.rules & (NO_SLIDING_LINK | NO_SLIDING_LOOP) for family in self.families):
            rules, searched = 0, False  # the search has no room for needs of two kinds
        return replace(
            self,
            title=f"{self.title} {wishes}".strip(),
            families=tuple(replace(family, rules=family.rules | rules) for family in self.families),
            one_by_one=tuple(replace(item, wishes=wishes) for item in self.one_by_one if isinstance(item, OneByOne)),
            wishes=None if searched else wishes,
        )

    @classmethod
    def chains(
        cls,
        links: int,
        mobility: int,
        space: int,
        joints_by_mobility: Mapping[int, int] | None,
        fractionated: bool,
        symmetry: int | None,
        *,
        framed: bool = False,
        counted: bool = False,
    ) -> EnumerationProblem:
        """State the enumeration of chains (of mechanisms with every frame, if ``framed``; to count them, ``counted``).

        Raises `SpecError` for a value out of its bounds, `TooLargeError` for more loops than there are contracted
        graphs.
        """
        links, mobility, space, higher = chain_numbers(links, mobility, space, joints_by_mobility)
        fractionated, order = _truth(fractionated, "fractionated"), check_symmetry(symmetry)
        joints = chain_joints(links, mobility, space, higher)
        placed = tuple(sorted((i, count) for i, count in higher.items() if i > 1 and count))
        title = f"W={mobility} N={links} Pi={space}" + "".join(f" p{i}={count}" for i, count in placed)
        title += (" framed" if framed else "") + (" fractionated" if fractionated else "")
        loops = -1 if joints is None else joints + sum(count for _, count in placed) - links + 1
        if loops < (links > 2):
            return cls(title, (), reason=_reason(links, mobility, space, higher))
        together = counted and not framed and not order
        if not (together and is_counted_together(mobility, loops, placed)):
            check_loops(loops, links, mobility, space, higher, framed=framed)
        common = (links, mobility, space, placed, framed)
        one_by_one: list[Made] = [OneByOne("rings", *common, symmetry=order)]
        if fractionated and mobility > 1:
            one_by_one.append(OneByOne("fractionated", *common, symmetry=order))
        families = chain_families(links, mobility, space, higher, framed)
        return cls(title + (f" symmetry={order}" if order else ""), tuple(families), tuple(one_by_one), order)

    @classmethod
    def multiple_joints(
        cls, links: int, mobility: int, multiple: int | None, *, framed: bool = False
    ) -> EnumerationProblem:
        """State the enumeration of non-fractionated planar chains with so many multiple joints; None: one or more.

        Raises `SpecError` for a value out of its bounds, `TooLargeError` for too many loops.
        """
        links, mobility, _, _ = chain_numbers(links, mobility, 3, None)
        wanted = None if multiple is None else whole(multiple, "multiple joints", 1, MOST_LINKS)
        title = f"W={mobility} N={links} multiple joints={'any' if wanted is None else wanted}"
        title += " framed" if _truth(framed, "framed") else ""
        loops, odd = divmod(links - 1 - mobility, 2)
        if odd or loops < 2:
            return cls(title, (), reason=_reason(links, mobility, 3, {}) if odd else f"{title}: ask for more links")
        if loops > _MOST_PINNED:
            raise TooLargeError(
                f"{links} links make {loops} independent loops, more than the bound of {_MOST_PINNED} for chains with "
                f"multiple joints: ask for {2 * _MOST_PINNED + mobility + 1} links at most"
            )
        numbers = range(1, 2 * loops - 1) if wanted is None else [wanted]
        families = [family for pins in numbers for family in multiple_joint_families(links, mobility, pins, framed)]
        return cls(title, tuple(families))

    @classmethod
    def sliders(
        cls, links: int, number: int, mobility: int, links_slide: bool, loops_slide: bool, cylinders: bool, framed: bool
    ) -> EnumerationProblem:
        """State the enumeration of planar chains with prismatic joints; see `enumerate_slider_chains`.

        Raises `SpecError` for a value out of its bounds, `TooLargeError` for too many loops.
        """
        links, mobility, _, _ = chain_numbers(links, mobility, 3, None)
        number = whole(number, "sliders", 1, 100)
        allowed = {"sliding links": _truth(links_slide, "sliding_links")}
        allowed["sliding loops"] = _truth(loops_slide, "sliding_loops")
        rules = NO_SLIDING_LINK * (not links_slide) + NO_SLIDING_LOOP * (not loops_slide)
        if _truth(cylinders, "cylinders"):
            rules = CYLINDERS  # a revolute joint at either end of every path: both rules are kept
        title = f"W={mobility} N={links} sliders={number}" + "".join(f" {name}" for name, yes in allowed.items() if yes)
        title += (" cylinders" if cylinders else "") + (" framed" if _truth(framed, "framed") else "")
        joints = chain_joints(links, mobility, 3, {})
        loops = -1 if joints is None else joints - links + 1
        if joints is None or loops < 1 or number > joints:
            reason = f"{title}: there are {joints} joints" if loops >= 1 else _reason(links, mobility, 3, {})
            return cls(title, (), reason=reason)
        check_loops(loops, links, mobility, 3, {}, framed=framed)
        ring = OneByOne("rings", links, mobility, 3, ((SLIDER, number),), framed, rules=rules)
        return cls(title, tuple(slider_families(links, mobility, number, rules, framed)), (ring,))

    @classmethod
    def gear_trains(
        cls, links: int, mobility: int = 1, *, rotation: bool = False, framed: bool = False, drive: str | None = None
    ) -> EnumerationProblem:
        """State the enumeration of planetary gear trains, or of their rotation graphs; see the function.

        Raises `SpecError` for a value out of its bounds, `TooLargeError` for too many links.
        """
        links, mobility = whole(links, "links", 3), whole(mobility, "mobility", 1, 50)
        title = f"planetary gear trains W={mobility} N={links}"
        title += " rotation graphs" if _truth(rotation, "rotation") else ""
        roles = FRAME if _truth(framed, "framed") else NO_ROLES
        if drive is not None:
            if drive not in ("any", "coaxial"):
                raise SpecError(f"drive = {shown(drive)} must be 'any', 'coaxial' or None")
            if rotation or mobility > 1:
                raise SpecError(
                    "input and output are chosen in trains of mobility 1 whose axes are known: leave out "
                    f"{'rotation' if rotation else 'mobility'}, or drive"
                )
            roles = DRIVE if drive == "any" else COAXIAL
        title += ("", " framed", " driven", " driven on one axis")[roles]
        if links > MOST_GEARED:
            raise TooLargeError(
                f"planetary gear trains of {links} links are more than the bound of {MOST_GEARED}, of which there are "
                f"12402182: ask for {MOST_GEARED} links at most"
            )
        if mobility > 1 and links < 2 * mobility + 2:
            return cls(title, (), reason=f"{title}: a train that does not fall apart takes {2 * mobility + 2} links")
        return cls(title, (), geared_trees(links, bool(rotation), mobility, roles))

    @classmethod
    def mechanisms(cls, question: StructuralSpec | LinkAssortment, symmetry: int | None) -> EnumerationProblem:
        """State the enumeration of the mechanisms that answer a structural question.

        Raises `SpecError` for what is none, `InfeasibleSpecError` for one without an answer, `TooLargeError` for more
        loops than there are contracted graphs.
        """
        from graphsynth.structure.system.assortment import LinkAssortment
        from graphsynth.structure.system.spec import StructuralSpec

        order = check_symmetry(symmetry)
        levels: Levels = ()
        fractionated = False
        if isinstance(question, LinkAssortment):
            question.check()
            assortments = [question]
            fractionated = question.frame_parts > 1
        elif isinstance(question, StructuralSpec):
            assortments = question.solve()
            fractionated = question.fractionated
            levels = tuple((at, low or 0, 255 if high is None else high) for at, (low, high) in question.levels.items())
        else:
            raise SpecError(
                f"{shown(question)} is not a structural question: give a StructuralSpec or a LinkAssortment"
            )
        families: list[Family] = []
        one_by_one: list[Made] = []
        for assortment in assortments:
            if assortment.mobility < 1:
                raise InfeasibleSpecError(
                    f"W = {assortment.mobility} must be at least 1 for a mechanism: fix W, or ask for Assur groups"
                )
            higher = tuple((i, count) for i, count in enumerate(assortment.p_i, 1) if i > 1 and count)
            numbers = assortment.loops, assortment.links, assortment.mobility, assortment.space
            check_loops(*numbers, dict(higher), framed=True)
            families += mechanism_families(assortment, levels)
            common = (assortment.moving_links + 1, assortment.mobility, assortment.space, higher, True)
            if assortment.loops == 1:
                one_by_one.append(OneByOne("rings", *common, assortment, levels, order))
            if fractionated and assortment.mobility > 1:
                one_by_one.append(OneByOne("fractionated", *common, assortment, levels, order))
        title = question.describe() if isinstance(question, StructuralSpec) else str(question)
        title = " ".join(title.split()) + (f" symmetry={order}" if order else "")
        return cls(title, tuple(families), tuple(one_by_one), order)

    @classmethod
    def groups(cls, moving: int, space: int) -> EnumerationProblem:
        """State the enumeration of Assur groups with a number of moving links; see `trusses`."""
        return cls.trusses(whole(moving, "moving links", 1, MOST_LINKS - 1) + 1, space, True)

    @classmethod
    def trusses(cls, links: int, space: int, framed: bool) -> EnumerationProblem:
        """State the enumeration of Baranov trusses (of Assur groups, if ``framed``).

        Raises `SpecError` for a number of links out of its bounds, `TooLargeError` for more loops than there are
        contracted graphs.
        """
        links, _, space, _ = chain_numbers(links, 0, space, None, least=0)
        joints = chain_joints(links, 0, space, {})
        title = f"{'Assur groups, n=' + str(links - 1) if framed else 'Baranov trusses, N=' + str(links)} Pi={space}"
        if joints is None:
            return cls(title, (), reason=_reason(links, 0, space, {}))
        check_loops(joints - links + 1, links, 0, space, {}, framed=framed)
        ring = OneByOne("rings", links, 0, space, (), framed)
        return cls(title, tuple(chain_families(links, 0, space, {}, framed)), (ring,))


@lru_cache(maxsize=4)
def _work_items(problem: EnumerationProblem, listing: bool) -> tuple[WorkItem, ...]:
    chunks = cut(problem.families, listing=listing, symmetry=problem.symmetry)
    if problem.wishes:
        chunks = [replace(chunk, wishes=problem.wishes) for chunk in chunks]
    return (*problem.one_by_one, *chunks)


def check_loops(loops: int, links: int, mobility: int, space: int, higher: Mapping[int, int], *, framed: bool) -> None:
    """Refuse what has more loops than there are contracted graphs for: `TooLargeError` with an estimate of the work."""
    if has_contracted_graphs(loops, links):
        return
    count = extrapolated(loops, links, mobility, space, higher, framed=framed)
    what = "mechanisms" if framed and mobility else "groups" if framed else "chains" if mobility else "trusses"
    estimate = f"about {count:.0e} {what} answer it, by those with fewer loops; listing them would take "
    estimate += _duration(count / _LISTED_PER_SECOND) + " on one core"
    if loops <= _MOST_LOOPS:
        takes = "five minutes and 1.5 GB" if loops == 9 else "hours and tens of GB"
        remedy = (
            f"make their contracted graphs once with 'python -m graphsynth.synthesis.contracted {loops} FOLDER' "
            f"({takes}), set {FOLDER_VARIABLE}=FOLDER, and share the work out with --shard i/m over m machines"
        )
    else:
        remedy = (
            f"contracted graphs with more than {_MOST_LOOPS} loops cannot be made: ask for fewer links, or fix more of "
            "the question"
        )
    raise TooLargeError(
        f"{links} links make {loops} independent loops, more than the bound of {SHIPPED_LOOPS}: {estimate}; {remedy}",
        count,
    )


def _duration(seconds: float) -> str:
    for size, name in ((3.15e7, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {name}" if seconds < 1e4 * size else f"{seconds / size:.0e} {name}"
    return "a minute or two" if seconds > 20 else "seconds"


def extrapolated(
    loops: int, links: int, mobility: int, space: int, higher: Mapping[int, int], *, framed: bool = False
) -> float:
    """Estimate a number of non-fractionated chains (trusses, for mobility 0; with every frame, if ``framed``).

    A question with one loop less has Pi - 1 links less, and the same mobility, space and higher pairs.  Such smaller
    questions are counted, and the ratio of one number to the next, which grows by about as much each time, is
    continued.

    >>> 1e11 < extrapolated(9, 20, 1, 3, {}) < 2e11
    True
    """
    known = []
    for fewer in (loops - _COUNTED_LOOPS + 2, loops - _COUNTED_LOOPS + 1, loops - _COUNTED_LOOPS):
        left = links - (space - 1) * fewer
        families = chain_families(left, mobility, space, higher, framed) if left > 2 else []
        known.append(sum(chunk.count() for chunk in cut(families, listing=False)))
    if not all(known):
        factor = links if framed else 1
        known, at = [factor * n for n in _KNOWN[-3:]], SHIPPED_LOOPS
    else:
        at = _COUNTED_LOOPS
    ratio, growth = known[2] / known[1], known[2] / known[1] - known[1] / known[0]
    count = float(known[2])
    for _ in range(at, loops):
        ratio += max(growth, 0.0)
        count = min(count * ratio, 1e300)
    return count


def check_symmetry(symmetry: int | None) -> int:
    """Return the required order, 0 for none.

    Raises `SpecError` for an order that is not a small prime.
    """
    if symmetry is None:
        return 0
    try:
        if (order := whole(symmetry, "symmetry", 2)) in _PRIMES:
            return order
    except SpecError:
        pass
    raise SpecError(
        f"symmetry = {shown(symmetry)} must be a prime {_PRIMES}; for a composite order take its prime factors and "
        "look at automorphism_order"
    )


def _truth(value: object, name: str) -> bool:
    if type(value).__name__ in ("bool", "bool_"):  # of numpy too
        return bool(value)
    raise SpecError(f"{name} = {shown(value)} must be True or False")


def _reason(links: int, mobility: int, space: int, higher: Mapping[int, int]) -> str:
    """Say why the structural formula leaves no chain, in one sentence."""
    rest = Fraction(space * (links - 1) - mobility - sum(n * (space - i) for i, n in higher.items() if i > 1))
    lower = rest / (space - 1)
    joints = f"{float(lower):.6g} joints of mobility 1" + (" besides the others" if sum(higher.values()) else "")
    asked = f"W = {mobility} with {links} links in a space of mobility {space} takes {joints}"
    if lower < 0:
        return f"{asked}: there are too many others"
    if lower.denominator > 1:
        near = [n for n in range(max(3, links - space), links + space + 1) if chain_joints(n, mobility, space, higher)]
        below, above = max((n for n in near if n < links), default=0), min((n for n in near if n > links), default=0)
        others = " or ".join(str(n) for n in (below, above) if n)
        return f"{asked}, no whole number" + (f": ask for {others} links" if others else "")
    if higher.get(1, lower) != lower:
        return f"{asked}, not {higher[1]}: leave p1 out"
    return f"{asked}, too few for a loop: ask for more links or a smaller mobility"


def _text(item: WorkItem) -> tuple[bytes, int]:
    blocks = list(item.texts())
    return b"".join(block for block, _ in blocks), sum(lines for _, lines in blocks)


def _graphs(item: WorkItem) -> list[MechanismGraph]:
    return list(item.graphs())


def counts(items: Iterable[WorkItem | Total], executor: Executor | None) -> Iterator[int | Fraction]:
    """Yield the number of graphs of each work item, or the share of each part."""
    return in_order(executor, methodcaller("count"), items)


def counted(problem: EnumerationProblem, executor: Executor | None) -> int:
    """Count what a problem enumerates (exact)."""
    return whole_sum(sum(counts(problem.parts(), executor), Fraction(0)))


def whole_sum(total: int | Fraction) -> int:
    """Return the sum of all parts, which is a whole number.

    Raises `GraphsynthError` if it is none: then parts are missing.
    """
    if total.denominator != 1:
        raise GraphsynthError(f"the parts of a count add up to {total}, no whole number: count anew")
    return int(total)


def texts(items: Iterable[WorkItem], executor: Executor | None) -> Iterator[tuple[bytes, int]]:
    """Yield each work item as (lines of the text form, number of lines)."""
    return in_order(executor, _text, items)


def graphs(items: Iterable[WorkItem], executor: Executor | None) -> Iterator[MechanismGraph]:
    """Yield the graphs of all work items, in order."""
    return chain.from_iterable(_made(items, executor))


def listed(problem: EnumerationProblem, executor: Executor | None) -> Iterator[Any]:
    """Yield what the graphs of a problem stand for, in order: chains with other joints, gear trains."""
    items = problem.work_items(listing=True)
    return chain.from_iterable(map(item.chain, made) for item, made in zip(items, _made(items, executor)))


def _made(items: Iterable[WorkItem], executor: Executor | None) -> Iterable[Iterable[MechanismGraph]]:
    return map(methodcaller("graphs"), items) if executor is None else in_order(executor, _graphs, items)


def processes(workers: int) -> AbstractContextManager[Executor | None]:
    """Give a pool of worker processes, or None for one worker (then everything is done in this process).

    Kernels are compiled here first, so that workers find them in the cache.  An exception (Ctrl-C) stops the workers.
    """
    return processes_of(workers, _compile_kernels)


def _compile_kernels() -> None:
    smallest = EnumerationProblem.chains(6, 1, 3, None, False, None)
    for item in smallest.work_items(listing=False):
        item.count()
    for item in smallest.work_items(listing=True):
        _text(item)
