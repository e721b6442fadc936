"""The structural question: :class:`StructuralSpec`, any subset of the variables of the structural system."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from graphsynth.core.errors import FormatError, SpecError, TooLargeError
from graphsynth.core.textfiles import read_bytes, text_of, toml_tables
from graphsynth.core.wording import shown, whole
from graphsynth.structure.system import variables
from graphsynth.structure.system.assortment import LinkAssortment
from graphsynth.structure.system.equations import IntegerProblem, explain
from graphsynth.structure.system.solving import number_of_solutions, solutions
from graphsynth.structure.system.variables import ALIASES, FAMILIES, SPACES, Range, show_range

#: Kinds of moving links in a question of the source's form: its system reads n = n_2 + n_3 + n_4.
SOURCE_LINK_JOINTS = 4


@dataclass(init=False, repr=False, slots=True, unsafe_hash=True)
class StructuralSpec:
    """A structural question: any of the variables fixed, bounded or free.

    Every variable is a keyword, by symbol or by name; its value is an integer, a pair ``(lowest, highest)`` with
    either side None, or None for free.  The same variable may be given twice only with the same value.

    Parameters
    ----------
    W, mobility : int or pair
        Mobility.  May be negative (an over-constrained chain by the formula).
    Pi, space : int or pair
        Mobility of the space, 2..6; 3 (the plane) unless given.
    n, moving_links : int or pair
        Moving links; or ``N``, ``links``: with the frame, N = n + 1.
    p, joints : int or pair
        Joints.
    p1, p2, p3, p4, p5 : int or pair
        Joints of mobility i; all of them as a mapping: ``joints_by_mobility``.
    t0, frame_joints : int or pair
        Joints on the frame.
    n2, n3 : int or pair
        Moving links with so many joints, and so on; all of them as a mapping: ``links_by_joints``.
    v, loops, v_ct, frame_loops, v_P, moving_loops : int or pair
        Independent loops (v); of them those through the frame (v_ct), and those among moving links (v_P).
    G, sub_edges : int or pair
        Sub-edges, a joint of mobility i counts i.
    fractionated : bool
        Include mechanisms that fall into c > 1 parts without the frame: the sixth equation becomes t0 = v_ct + c with
        c <= W.  Default False.
    simple_joints : bool
        Always true: a joint connects exactly two links.  A pin that joins k links is k - 1 simple joints.
    max_joint_mobility : int, optional
        Largest i with p_i > 0.  Default: joint mobilities that are not mentioned do not occur, except mobility 1; if
        no i >= 2 is mentioned, but p or G is given and lower pairs alone have no solution, the least sufficient i.
    max_link_joints : int or "all", optional
        Largest number of joints on a moving link.  Default: the natural bound v + 1 (``"all"``), *except* for a
        question in the source's form, which states its size (two of n, p, v), its higher pairs (some p_i > 0, i >= 2)
        and its frame (t0 or v_ct): there 4, as in the source's ``n = n_2 + n_3 + n_4``, or the largest kind
        mentioned, or the least number that has a solution.  See the notes.
    levels : mapping, optional
        Sizes of adjacency levels, ``{level: int or pair}``; negative levels count from the last (-1).  Kept for the
        enumerator, the integer system does not use it.

    Raises
    ------
    SpecError
        For an unknown variable, a value that is not an integer, is out of its natural range, or is given twice.

    Notes
    -----
    The exception of ``max_link_joints`` restricts; the natural bound does not.  The worked example of the source has
    5 solutions with n_a = 0 for a >= 5, and 28 with ``max_link_joints="all"``; the other 23 are not excluded by any
    equation (mechanisms with a five-joint link exist among them).  :meth:`describe` says which limit is in force.

    Examples
    --------
    >>> spec = StructuralSpec(W=1, Pi=3, v_ct=6, p=22, p2=3, n=14, t0=7)
    >>> for solution in spec.solve():
    ...     print(solution)
    n2=5 n3=9 | p1=19 p2=3 | t0=7
    n2=6 n3=7 n4=1 | p1=19 p2=3 | t0=7
    n2=7 n3=5 n4=2 | p1=19 p2=3 | t0=7
    n2=8 n3=3 n4=3 | p1=19 p2=3 | t0=7
    n2=9 n3=1 n4=4 | p1=19 p2=3 | t0=7
    >>> len(spec.replace(n4=1).solve()), len(spec.replace(max_link_joints="all").solve())
    (1, 28)
    """

    _ranges: tuple[tuple[str, Range], ...]
    _options: tuple[tuple[str, Any], ...]
    _levels: tuple[tuple[int, Range], ...]

    def __init__(self, **question: Any) -> None:
        ranges, options, levels = variables.read_question(question)
        object.__setattr__(
            self, "_ranges", tuple(sorted(ranges.items(), key=lambda item: variables.order_key(item[0])))
        )
        object.__setattr__(self, "_options", tuple(sorted(options.items())))
        object.__setattr__(self, "_levels", tuple(sorted(levels.items())))

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any], place: str = "") -> StructuralSpec:
        """Read plain data, as a TOML or JSON reader gives it.

        Ranges are written ``[0, 2]`` or ``"0..2"``, with an open side ``"2.."``; anything wrong is a `FormatError` with
        ``place`` and the key.
        """
        return cls(**variables.plain_question(mapping, place, cls))

    @classmethod
    def from_toml(cls, path: str | Path) -> StructuralSpec:
        """Read a TOML file; see ``docs/reference/structural-spec.md``.

        `FormatError` if the file cannot be read, is not TOML, or has an unknown key or a bad value.
        """
        if not isinstance(path, str | PathLike):
            raise FormatError(f"{shown(path)} is not the path of a file", "path")
        place = str(path)
        text = text_of(read_bytes(Path(path), what="a structural question"), place)
        return cls.from_mapping(toml_tables(text, place), place)

    @classmethod
    def from_assignments(cls, assignments: Iterable[str]) -> StructuralSpec:
        """Read ``["W=1", "n4=0..2", "fractionated=true", "levels.-1=3"]``, the form of the command line.

        `SpecError` for an assignment that is not ``name=value``, and whatever the constructor refuses.
        """
        return cls(**variables.assigned_question(assignments))

    def replace(self, **changes: Any) -> StructuralSpec:
        """Return a new question with some variables or options replaced; None frees one."""
        kept = self.as_dict()
        for name in changes:
            symbol = ALIASES.get(name, name)
            if symbol in FAMILIES:
                letter = FAMILIES[symbol]
                kept = {key: own for key, own in kept.items() if not (key[0] == letter and key[1:].isdigit())}
            else:
                kept.pop("n" if symbol == "N" else symbol, None)
        return StructuralSpec(**{**kept, **changes})

    def bounds(self, name: str) -> Range:
        """Return (lowest, highest) of a variable as the question states it, None where it says nothing.

        Examples
        --------
        >>> StructuralSpec(links=8, n4=(0, 2)).bounds("moving_links"), StructuralSpec(W=1).bounds("Pi")
        ((7, 7), (3, 3))
        """
        symbol = variables.symbol_of(name)
        lo, hi = dict(self._ranges).get("n" if symbol == "N" else symbol, (3, 3) if symbol == "Pi" else (None, None))
        if symbol == "N":
            return None if lo is None else lo + 1, None if hi is None else hi + 1
        return lo, hi

    def fixed(self, name: str) -> int | None:
        """Return the value of a variable that the question fixes, else None."""
        lo, hi = self.bounds(name)
        return lo if lo == hi else None

    @property
    def ranges(self) -> dict[str, Range]:
        """What is fixed or bounded, by symbol, in the documented order."""
        return dict(self._ranges)

    @property
    def fractionated(self) -> bool:
        """Whether fractionated mechanisms are included."""
        return bool(dict(self._options).get("fractionated", False))

    @property
    def max_joint_mobility(self) -> int | None:
        """The stated largest joint mobility, None if left to the default rule."""
        return dict(self._options).get("max_joint_mobility")

    @property
    def max_link_joints(self) -> int | str | None:
        """The stated largest number of joints on a moving link, ``"all"``, or None for the default rule."""
        return dict(self._options).get("max_link_joints")

    @property
    def levels(self) -> dict[int, Range]:
        """Bounds on the sizes of adjacency levels, negative levels counted from the last."""
        return dict(self._levels)

    @property
    def is_source_form(self) -> bool:
        """Whether the question is stated as in the source: size, higher pairs and frame all fixed."""
        size = sum(self.fixed(symbol) is not None for symbol in ("n", "p", "v"))
        higher = any((self.fixed(f"p{i}") or 0) > 0 for i in range(2, 6))
        frame = any(self.fixed(symbol) is not None for symbol in ("t0", "v_ct"))
        return size >= 2 and higher and frame

    def solve(self, *, limit: int = 1_000_000) -> list[LinkAssortment]:
        """Return all integer solutions (exact), lexicographically by (W, Pi, n, p, p_1.., t0, v_ct, n_2, n_3, ...).

        The natural bounds are: n_a >= 0 with 2 <= a <= v + 1 (v + W if fractionated), t0 >= 2 (every link of a closed
        chain has at least two joints), p_i >= 0 with 1 <= i <= Pi - 1, v_ct >= 0, v_P >= 0.

        Parameters
        ----------
        limit : int
            Refuse to list more solutions than this.

        Raises
        ------
        InfeasibleSpecError
            If there is no solution; names the equations and values that contradict each other.
        SpecError
            If the question bounds the size neither way (then there are infinitely many solutions, or none); names
            the variable to bound.
        TooLargeError
            If there are more than ``limit``.
        """
        limit = whole(limit, "limit", 0, 10**12)
        chosen, _ = self._first()
        number = 0 if chosen is None else number_of_solutions(chosen, limit)
        if number > limit:
            raise TooLargeError(
                f"the question has {number} integer solutions at least; more than {limit} are not listed: "
                "fix more variables, or use iter_solutions()",
                float(number),
            )
        return list(self.iter_solutions())

    def iter_solutions(self) -> Iterator[LinkAssortment]:
        """Yield the solutions of :meth:`solve` one by one; `InfeasibleSpecError` if there is none."""
        reading_of, first = self._first()
        if reading_of is None or first is None:
            default_space, default_mobilities = "Pi" not in self.ranges, self.max_joint_mobility is None
            raise explain(self._readings(widest=True)[0], default_space, default_mobilities)
        return solutions(reading_of)

    def reading(self) -> IntegerProblem:
        """Return the question with every default made explicit, as :meth:`solve` reads it."""
        chosen, _ = self._first()
        return self._readings(widest=True)[0] if chosen is None else chosen

    def _first(self) -> tuple[IntegerProblem | None, LinkAssortment | None]:
        """Return the first reading that has a solution, and that solution."""
        for problem in self._readings():
            for solution in solutions(problem):
                return problem, solution
        return None, None

    def _readings(self, *, widest: bool = False) -> list[IntegerProblem]:
        """Return the readings of the question by the default rules, narrowest first."""
        mobilities, link_limits = self._mobilities(), self._link_limits()
        if widest:  # a contradiction must not hang on a default of ours that solve() would have widened
            mobilities, link_limits = mobilities[-1:], link_limits[-1:]
        ranges = tuple(self._ranges if "Pi" in self.ranges else [("Pi", (3, 3)), *self._ranges])
        return [
            IntegerProblem(ranges, allowed, limit, self.fractionated) for allowed in mobilities for limit in link_limits
        ]

    def _mobilities(self) -> list[tuple[int, ...]]:
        if self.max_joint_mobility is not None:
            return [tuple(range(1, self.max_joint_mobility + 1))]
        mentioned = [i for i in range(2, 6) if f"p{i}" in self.ranges]
        if mentioned:
            return [(1, *mentioned)]
        most = (self.bounds("Pi")[1] or SPACES[-1]) - 1
        if {"p", "G"} & set(self.ranges):  # more sub-edges than joints: higher pairs are forced
            return [tuple(range(1, i + 1)) for i in range(1, max(1, most) + 1)]
        return [(1,)]

    def _link_limits(self) -> list[int | None]:
        stated = self.max_link_joints
        if isinstance(stated, int):
            return [stated]
        if stated is not None or not self.is_source_form:
            return [None]
        mentioned = [int(s[1:]) for s, (_, hi) in self._ranges if s[0] == "n" and s != "n" and hi != 0]
        n, p, v, mobility = map(self.fixed, ("n", "p", "v", "W"))
        loops = v if v is not None else (p or 0) - (n or 0)
        widest = max(2, loops + max(1, mobility or 1))  # a bound on v + W, two of n, p, v being fixed
        return [*range(max([SOURCE_LINK_JOINTS, *mentioned]), widest + 1), None]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data by symbol: integers, pairs, options; ``StructuralSpec(**spec.as_dict()) == spec``."""
        plain: dict[str, Any] = {symbol: _plain(own) for symbol, own in self._ranges} | dict(self._options)
        if self._levels:
            plain["levels"] = {level: _plain(own) for level, own in self._levels}
        return plain

    def to_toml(self) -> str:
        """Write the question as TOML text that :meth:`from_toml` reads back to an equal question."""
        lines = [f"{symbol} = {_toml_range(own)}" for symbol, own in self._ranges]
        for name, value in self._options:
            text = {True: "true", "all": '"all"'}.get(value) if isinstance(value, (bool, str)) else str(value)
            lines.append(f"{name} = {text}")
        if self._levels:
            lines += ["", "[levels]", *(f'"{level}" = {_toml_range(own)}' for level, own in self._levels)]
        return "\n".join(lines) + "\n" if lines else ""

    def describe(self) -> str:
        """Say in one line per point what is asked, with the defaults that apply.

        Examples
        --------
        >>> print(StructuralSpec(W=1, links=12).describe())
        W = 1, n = 11 (Pi = 3 by default)
        joints of mobility 1
        moving links with up to v + 1 joints
        """
        asked = ", ".join(f"{symbol} = {show_range(own)}" for symbol, own in self._ranges)
        lines = [asked + ("" if "Pi" in self.ranges else f"{' ' if asked else ''}(Pi = 3 by default)")]
        try:
            problem = self.reading()
        except SpecError as error:
            return "\n".join([*lines, str(error)])
        lines.append("joints of mobility " + ", ".join(map(str, problem.mobilities)))
        if problem.link_limit is None:
            lines.append(f"moving links with up to {'v + W' if self.fractionated else 'v + 1'} joints")
        else:
            why = "" if self.max_link_joints else ' (as in the source; max_link_joints = "all" lifts it)'
            lines.append(f"moving links with up to {problem.link_limit} joints{why}")
        if self.fractionated:
            lines.append("fractionated mechanisms included")
        lines += [f"level {level}: {show_range(own)} links" for level, own in self._levels]
        return "\n".join(lines)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("StructuralSpec is frozen; use replace()")

    def __getattr__(self, name: str) -> int | tuple[int | None, int | None] | None:
        if name.startswith("_") or not variables.is_single(name):
            raise AttributeError(f"'StructuralSpec' object has no attribute {name!r}")
        own = self.bounds(name)
        return None if own == (None, None) else _plain(own)

    def __reduce__(self) -> tuple[Any, tuple[()]]:
        return partial(StructuralSpec, **self.as_dict()), ()

    def __repr__(self) -> str:
        return f"StructuralSpec({', '.join(f'{name}={value!r}' for name, value in self.as_dict().items())})"


def _plain(own: Range) -> int | Range:
    return own[0] if own[0] is not None and own[0] == own[1] else own


def _toml_range(own: Range) -> str:
    lo, hi = own
    if lo is None or hi is None:
        return f'"{show_range(own)}"'
    return str(lo) if lo == hi else f"[{lo}, {hi}]"
