"""Angular velocities, ratios and efficiency of planetary gear trains, exact, with numbers of teeth or symbols.

Every gear pair gives one equation of Willis, (w_a - w_c) z_a + (w_b - w_c) z_b = 0, c being its carrier; teeth of an
internal gear count negative.  Losses are those of the teeth: of the power that a gear gives to a mesh, in the frame of
the carrier, the other gear gets the share eta.  Sources: [Buchsbaum & Freudenstein 1970], and for the efficiency
[Pennestri & Freudenstein 1993].
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

from graphsynth.core.errors import GraphError, SpecError
from graphsynth.core.wording import shown

if TYPE_CHECKING:
    import graphsynth as gs

Teeth = Mapping[tuple[int, int], tuple[Any, Any]]
"""Numbers of teeth of the gear pairs, ``{(a, b): (z_a, z_b)}``; those of internal gears are negative."""


class GearPair(NamedTuple):
    """Links a < b that are in mesh, and the link that carries the axes of both."""

    a: int
    b: int
    carrier: int


class Arrangement(NamedTuple):
    """Which link is driven, which one drives, and which one is fixed."""

    input: int
    output: int
    fixed: int


@dataclass(frozen=True)
class TrainEfficiency:
    """How much of the power that goes into a gear train comes out, and on which way (exact for the model).

    Attributes
    ----------
    efficiency : sympy.Rational
        Power out over power in; 0 for a train that is self-locking, driven so.
    torques : dict of int to sympy.Rational
        External torques on input, output and fixed link for the torque 1 at the input; empty if self-locking.
    powers : dict of (int, int) to sympy.Rational
        Power that gear a gives to its mesh with b in the frame of their carrier (negative: gets from it), over the
        power in.  More than 1 is power that circulates.
    """

    efficiency: Any
    torques: dict[int, Any]
    powers: dict[tuple[int, int], Any]


def speeds(train: gs.PlanetaryGearTrain, given: Mapping[int, Any], teeth: Teeth | None = None) -> dict[int, Any]:
    """Solve the equations of Willis for the angular velocities of all links (exact).

    Parameters
    ----------
    train : PlanetaryGearTrain
        The train.
    given : mapping
        Angular velocities of some links, numbers or symbols; 0 for a fixed one.  One more than the mobility.
    teeth : mapping, optional
        ``{(a, b): (z_a, z_b)}`` for each gear pair, whole numbers or expressions of sympy; an internal gear has
        negative ones.  Default: the symbols ``z<a>_<b>``, teeth on link a in mesh with link b.

    Returns
    -------
    dict of int to sympy.Expr

    Raises
    ------
    GraphError
        Velocities that contradict each other, or leave that of some link open.
    SpecError
        Teeth of no gear pair, missing, or 0.

    Examples
    --------
    >>> from graphsynth import PlanetaryGearTrain
    >>> train = PlanetaryGearTrain.from_axes(4, [(0, 1, 2), (2, 3)], [(0, 3), (1, 3)])
    >>> train.speeds({1: 0, 0: 1}, teeth={(0, 3): (20, 20), (1, 3): (-60, 20)})
    {0: 1, 1: 0, 2: 1/4, 3: -1/2}
    """
    import sympy

    counted = teeth_of(train, teeth)
    if not isinstance(given, Mapping):
        raise SpecError(f"given = {shown(given)} must be a mapping such as {{0: 1, 1: 0}}")
    own = {link: _exact(value, f"given[{link}]") for link, value in given.items()}
    if unknown := set(own) - set(range(train.links)):
        raise GraphError(f"the train has no link {min(unknown)}: its links are 0 to {train.links - 1}")
    free = {link: sympy.Dummy(f"w{link}") for link in range(train.links) if link not in own}
    w = own | free
    rows = [(w[a] - w[c]) * counted[a, b][0] + (w[b] - w[c]) * counted[a, b][1] for a, b, c in train.gears]
    found = _solved(rows, list(free.values()), "the given angular velocities contradict each other")
    own |= dict(zip(free, found))
    open_links = [link for link in range(train.links) if own[link].atoms(sympy.Dummy)]
    if open_links:
        raise GraphError(
            f"the angular velocities of links {', '.join(map(str, open_links))} are left open: give more of them "
            f"({train.mobility + 1} for this train)"
        )
    return {link: sympy.factor(own[link]) for link in range(train.links)}


def ratio(train: gs.PlanetaryGearTrain, arrangement: Arrangement, teeth: Teeth | None = None) -> Any:
    """Return the transmission ratio, angular velocity of the input over that of the output (exact).

    Raises `GraphError` where the output stands still or is not determined, else as `speeds`.
    """
    import sympy

    driven, driving, fixed = arrangement
    if unknown := [link for link in arrangement if link not in range(train.links)]:
        raise GraphError(f"the train has no link {shown(unknown[0])}: its links are 0 to {train.links - 1}")
    if len({driven, driving, fixed}) < 3:
        raise GraphError(f"input, output and fixed link must be different links, not {driven}, {driving}, {fixed}")
    out = speeds(train, {fixed: 0, driven: 1}, teeth)[driving]
    if out == 0:
        raise GraphError(f"link {driving} stands still when link {driven} turns and link {fixed} is fixed")
    return sympy.factor(1 / out)


def efficiency(train: gs.PlanetaryGearTrain, arrangement: Arrangement, teeth: Teeth, mesh: Any) -> TrainEfficiency:
    """Return the efficiency of a train of mobility 1 with losses in its teeth (exact for the model).

    Bearings, churning and inertia are left out; the efficiency of a mesh is that of the same gears with a carrier at
    rest.  The flows of power are those without losses, or, where losses turn some of them round, the first that
    contradict nothing.

    Parameters
    ----------
    train, arrangement : PlanetaryGearTrain, Arrangement
        The train, and its input, output and fixed link.
    teeth : mapping
        As for `speeds`, numbers.
    mesh : number, text or mapping
        Efficiency of each mesh, above 0 and at most 1; or one for each gear pair, ``{(a, b): eta}``.  Decimals are
        taken as they are written.

    Returns
    -------
    TrainEfficiency

    Raises
    ------
    GraphError, SpecError
        As for `ratio`; teeth or efficiencies that are no numbers, or out of their bounds.
    """
    import sympy

    counted = teeth_of(train, teeth)
    if any(not z.is_number for pair in counted.values() for z in pair):
        raise SpecError("an efficiency needs numbers of teeth, not symbols: say which power flows where")
    if train.mobility != 1:
        raise GraphError(f"the train has mobility {train.mobility}; the efficiency is told of those with mobility 1")
    etas = {pair: _eta(mesh, pair) for pair in counted}
    ratio(train, arrangement, teeth)
    w = speeds(train, {arrangement.fixed: 0, arrangement.input: 1}, teeth)
    plain = _balance(train, arrangement, counted, w, dict.fromkeys(etas, 1))
    signs = {pair: int(sympy.sign(power)) for pair, power in plain.powers.items()}
    for directions in _directions(signs):
        found = _balance(train, arrangement, counted, w, {p: etas[p] ** directions[p] for p in etas})
        agree = all(found.powers[pair] * sign > 0 or not sign for pair, sign in directions.items())
        if agree and found.efficiency > 0:
            return found
    return TrainEfficiency(plain.efficiency * 0, {}, {})


def _directions(signs: dict[tuple[int, int], int]) -> Iterable[dict[tuple[int, int], int]]:
    """Yield which gear of each mesh drives: first as without losses, then every other way."""
    yield signs
    flowing = [pair for pair, sign in signs.items() if sign]
    for turned in product((1, -1), repeat=len(flowing)):
        directions = signs | {pair: sign * signs[pair] for pair, sign in zip(flowing, turned)}
        if directions != signs:
            yield directions


def _balance(
    train: gs.PlanetaryGearTrain,
    arrangement: Arrangement,
    teeth: dict[tuple[int, int], tuple[Any, Any]],
    w: dict[int, Any],
    shares: dict[tuple[int, int], Any],
) -> TrainEfficiency:
    """Solve the equilibrium of all links; teeth and shares divide a torque in a mesh, the carrier takes the rest."""
    import sympy

    meshes = {pair: sympy.Dummy("m") for pair in teeth}
    out, held = sympy.Dummy("out"), sympy.Dummy("held")
    sums = [sympy.Integer(0)] * train.links
    sums[arrangement.input] += 1
    sums[arrangement.output] += out
    sums[arrangement.fixed] += held
    for a, b, carrier in train.gears:
        torque = meshes[a, b]
        other = torque * shares[a, b] * teeth[a, b][1] / teeth[a, b][0]
        sums[a] += torque
        sums[b] += other
        sums[carrier] -= torque + other
    found = _solved(sums, [*meshes.values(), out, held], "some links cannot be held in equilibrium")
    if any(value.free_symbols for value in found):
        raise GraphError("the torques are not determined: some links are locked among themselves")
    torques = {arrangement.input: sympy.Integer(1), arrangement.output: found[-2], arrangement.fixed: found[-1]}
    powers = {(a, b): -torque * (w[a] - w[c]) for (a, b, c), torque in zip(train.gears, found)}
    return TrainEfficiency(-found[-2] * w[arrangement.output], torques, powers)


def _solved(rows: Sequence[Any], unknowns: Sequence[Any], what: str) -> tuple[Any, ...]:
    """Solve linear equations; what is left open stays in the answers.  Raises `GraphError` if there is none."""
    import sympy

    rows = [row for row in map(sympy.sympify, rows) if row != 0]
    if not unknowns:
        if any(sympy.simplify(row) != 0 for row in rows):
            raise GraphError(what)
        return ()
    solutions = sympy.linsolve(rows, *unknowns) if rows else [tuple(unknowns)]
    for solution in solutions:
        return tuple(solution)
    raise GraphError(what)


def teeth_of(train: gs.PlanetaryGearTrain, teeth: Teeth | None) -> dict[tuple[int, int], tuple[Any, Any]]:
    """Return the teeth of each gear pair, in its order; `SpecError` for others, missing ones or 0."""
    import sympy

    pairs: list[GearPair] = list(train.gears)
    if teeth is None:
        return {(a, b): (sympy.Symbol(f"z{a}_{b}"), sympy.Symbol(f"z{b}_{a}")) for a, b, _ in pairs}
    if not isinstance(teeth, Mapping):
        raise SpecError(f"teeth = {shown(teeth)} must be a mapping such as {{(0, 3): (20, 30)}}")
    found: dict[tuple[int, int], tuple[Any, Any]] = {}
    known = {(a, b) for a, b, _ in pairs}
    for ends, numbers in teeth.items():
        try:
            (a, b), (of_a, of_b) = ends, numbers
        except (TypeError, ValueError):
            raise SpecError(f"teeth[{shown(ends)}] = {shown(numbers)} must be two numbers for two links") from None
        pair = (a, b) if (a, b) in known else (b, a)
        if pair not in known:
            raise SpecError(f"links {a} and {b} are no gear pair: the pairs are {sorted(known)}")
        own = _exact(of_a, f"teeth[{a}, {b}]"), _exact(of_b, f"teeth[{a}, {b}]")
        if any(z == 0 for z in own):
            raise SpecError(f"teeth[{a}, {b}] = {shown(numbers)} must not be 0")
        found[pair] = own if pair == (a, b) else own[::-1]
    if missing := known - set(found):
        raise SpecError(f"the teeth of gear pair {min(missing)} are missing")
    return {pair: found[pair] for pair in sorted(known)}


def _eta(mesh: Any, pair: tuple[int, int]) -> Any:
    if isinstance(mesh, Mapping):
        if pair not in mesh and pair[::-1] not in mesh:
            raise SpecError(f"the efficiency of gear pair {pair} is missing")
        mesh = mesh[pair] if pair in mesh else mesh[pair[::-1]]
    eta = _exact(mesh, "mesh")
    if not eta.is_number or not 0 < eta <= 1:
        raise SpecError(f"mesh = {shown(mesh)} must be above 0 and at most 1")
    return eta


def _exact(value: Any, name: str) -> Any:
    """Return a number or an expression of sympy; decimals as they are written."""
    import sympy

    if isinstance(value, sympy.Expr):
        return value
    try:
        return sympy.Rational(str(value))
    except (TypeError, ValueError):
        raise SpecError(f"{name} = {shown(value)} must be a number or an expression of sympy") from None
