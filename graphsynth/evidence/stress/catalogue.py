"""The list of stress cases: name, what it is, which specification row it answers, where its code is.

A name is the page of the specification and the number of the row in its section of extreme cases: ``lambda-12.6`` is
row 6 of section 12 of the lambda linkage, ``platform-12.5`` row 5 of section 12 of the parallel platform,
``instruments-9.13`` row 13 of section 9 of instruments and dynamics.  Other numbers give the section from which a case
is taken (the structural page has no section of extreme cases); ``beyond`` holds what no page asks for.  Nothing of a
case is imported here.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    from collections.abc import Callable

    from graphsynth.evidence.stress.checks import Checks

__all__ = ["PAGES", "Case", "stress_cases"]

#: First word of a name -> title of the page.
PAGES = {
    "lambda": "Lambda linkage and bearing jamming",
    "platform": "Parallel platform",
    "instruments": "Instruments and dynamics",
    "structure": "Structural synthesis",
    "beyond": "Beyond the specification",
}


@dataclass(frozen=True)
class Case:
    """A stress case.

    Attributes
    ----------
    name : str
        Page and number, for example ``platform-12.5``.
    title : str
        The situation in a few words.
    place : str
        ``module:function`` within ``graphsynth.evidence.stress.cases``.
    slow : bool
        Takes more than about two seconds on one core.
    """

    name: str
    title: str
    place: str
    slow: bool = False

    @property
    def page(self) -> str:
        """First word of the name."""
        return self.name.partition("-")[0]

    def load(self) -> Callable[[Checks], None]:
        """Import the function of the case."""
        module, _, function = self.place.partition(":")
        found: Any = getattr(import_module(f"graphsynth.evidence.stress.cases.{module}"), function)
        return found  # type: ignore[no-any-return]


def _rows(page: str, text: str) -> tuple[Case, ...]:
    """Read lines ``number | module:function | title``; a star after the number marks a slow case."""
    found = []
    for line in text.strip().splitlines():
        number, place, title = (part.strip() for part in line.split("|"))
        found.append(Case(f"{page}-{number.rstrip('*')}", title, place, number.endswith("*")))
    return tuple(found)


_LAMBDA = _rows(
    "lambda",
    """
    11.1  | scales:interval_ends       | intervals: overflow, subnormal numbers, division by zero
    12.1  | tilts:no_tilt              | no tilt: alpha = 0, or the axis along z
    12.2  | tilts:tiny_tilt            | alpha = 1e-8
    12.3  | tilts:steep_tilt           | alpha = pi/2, or R sin t above h cos t
    12.4  | tilts:not_assembled        | pin above the rod, or D outside of its range
    12.5  | tilts:bad_input            | n = 0, NaN, infinite numbers, lengths that are not positive
    12.6  | bearings:no_clearance      | c = 0
    12.7  | bearings:press_fit         | c < 0, an interference fit
    12.8  | bearings:never_critical    | h^2 < c (2R + c)
    12.9  | bearings:disc              | h = 0, a disc
    12.10 | bearings:steep_lid         | b <= 0, a steep tilt in condition B
    12.11 | crossings:coincident       | a = b = R1 without tolerance
    12.12 | crossings:circles          | a = b unequal to R1 without tolerance
    12.13 | crossings:tangent          | R1 = a or R1 = b
    12.14 | crossings:near_circular    | a - b about 1e-9 and 1e-12 of the radius
    12.15 | crossings:clipped          | tolerance so large that the solutions reach an axis
    12.16 | crossings:wide_tolerances  | e2 >= 1 or e1 >= R1^2
    12.17 | turns:touching             | largest tilt equal to the critical tilt
    12.18 | turns:crank_intervals      | crank interval across 360 degrees, longer than a turn, reversed
    12.19 | turns:change_points        | change point, dead point, D = 0
    12.20 | turns:long_crank           | crank longer than the frame
    12.21 | turns:reversed_axis        | axis reversed, alpha negative
    12.22 | turns:units                | change of unit by 1e-9 and 1e9
    12.23 | coupled:collinear          | shared misalignment with collinear and coincident joints
    12.24 | coupled:unlimited          | shared misalignment with a joint without limit
    14.4  | tilts:printed_extremes     | printed values of section 14.4: bearings, pins, crescents
    14.5  | crossings:printed_hulls    | printed hulls of section 14.5, tolerances 0 to 1e-2
    """,
)
_PLATFORM = _rows(
    "platform",
    """
    12.1  | legs:out_of_reach          | pose out of reach of some legs
    12.2  | legs:boundary              | pose on the boundary of the reach
    12.3  | legs:free                  | vertex on the pivot, l1 = l2
    12.4  | legs:zero_lengths          | l1 = 0 or l2 = 0
    12.5  | legs:length_ratios         | length ratios of 1e6 and more
    12.6  | legs:half_turn             | theta = pi, alpha = pi
    12.7  | legs:bad_lengths           | negative and NaN lengths
    12.8  | modes:none                 | no assembly mode exists
    12.9  | modes:type_two             | type-II singularity, near and exact
    12.10 | modes:delta_zero           | Delta = 0 at a real mode
    12.11 | modes:coincident           | coincident vertices or anchors
    12.12 | modes:collinear            | collinear platform and anchors
    12.13 | modes:self_motion          | congruent triangles with equal legs
    12.14 | modes:home                 | symmetric home position
    12.15 | modes:parity               | odd number of modes without a flag: searched for
    12.16 | drives:limited             | crank that cannot turn fully
    12.17 | drives:change_point        | Grashof's condition with equality
    12.18 | drives:zero_cranks         | crank length zero in one, two, all legs
    12.19 | drives:singular_turn       | platform singular during a turn
    12.20 | drives:open_path           | a path that does not close after one turn: period and permutation
    12.21 | design:too_large           | inverse design with too large an amplitude
    12.22 | design:equal_distances     | two-pose design with d+ = d- in a leg
    12.23 | design:identical_poses     | two-pose design with equal poses
    12.24 | motor:no_inertia           | J_0 = 0
    12.25 | motor:reversal             | stall and reversal in model S
    12.26 | motor:tiny_inductance      | L_a from 1e-6 to 1e-12 H
    12.27 | motor:no_inductance        | L_a = 0
    12.28 | motor:no_resistance        | r_a = 0, alone and together with L_a = 0
    12.29 | motor:no_platform          | m = 0, the linear motor equation
    12.30 | motor:long_run             | very long simulation
    12.31 | legs:units                 | huge and tiny units
    14.2  | legs:printed_legs          | the fifteen legs of section 14.2, both branches
    14.8  | motor:small_inertia        | printed values with J_0 down to 1e-8
    """,
)
_INSTRUMENTS = _rows(
    "instruments",
    """
    2.11  | scales:rest_trap           | start of 1e-41, where a difference quotient vanishes
    3.8   | dry_friction:tribometer    | tribometer as a general model
    5.1   | dry_friction:rest          | block beside its friction angle by 1e-9
    5.2   | dry_friction:jamming       | dry friction that jams, or needs an open reaction
    9.1   | antenna:singular_chart     | singular parametrisation
    9.2   | antenna:false_roots        | false orientation roots
    9.3   | antenna:all_modes          | all assembly modes
    9.4   | antenna:fold               | fold of a sweep
    9.5   | antenna:approach           | approach to the folds of a leg
    9.6   | antenna:dead_points        | input singularity: crank and rod in line
    9.7   | antenna:tolerance_at_fold  | tolerance box that touches a fold
    9.8   | four_bars:change_point     | change point of a four-bar
    9.9   | four_bars:limited          | input that cannot turn
    9.10  | stick_slip:exact_events    | stick-slip, exact
    9.11  | stick_slip:refusal         | two-coefficient law asked of the regularised form
    9.12* | stick_slip:regularisation  | regularisation from 1e-2 to 1e-8, four solvers
    9.13  | stick_slip:stiff_spring    | stiff spring with scaled damping
    9.14  | stick_slip:storm           | Zeno behaviour
    9.15  | stick_slip:belt_limits     | belt from 1e-6 to 10 m/s
    9.16  | braider:inductance         | singular perturbation: inductance to zero
    9.17  | braider:fast_reactions     | inertia-dominated reactions
    9.18  | bodies:starts              | redundant, violated and contradictory starts
    9.19  | bodies:singular_passage    | passing a singular pose in motion
    9.20  | bodies:massless            | nearly massless link
    9.21  | bodies:train_ratio         | train ratio of 1000
    9.22* | bodies:long_run            | 1000 s without damping
    9.23  | bodies:pulse               | torque pulse of a microsecond
    9.24  | bodies:rotor               | rotor with implicit solvers
    """,
)
_STRUCTURE = _rows(
    "structure",
    """
    2.1   | graphs:under_determined    | a question with five answers
    2.2   | graphs:contradiction       | equations that contradict each other
    2.3   | graphs:unequal_spaces      | loops in spaces of different mobility
    3.1   | graphs:rigid_parts         | a chain of the right mobility with a rigid part
    3.2   | graphs:fractionated        | chains with and without fractionation
    4.1   | graphs:key_separates       | graphs that cheap hashes confuse
    5.1   | graphs:small_ends          | the smallest questions: one, none, and none at all
    5.2*  | graphs:large_counts        | counts of millions: 16 links, the worked example
    """,
)
_BEYOND = _rows(
    "beyond",
    """
    1.1   | scales:planar              | four-bars of 1e-60 to 1e60, and refused ones
    1.2   | scales:ratios              | links of 1e16 beside a crank of 1
    1.3   | scales:subnormal_platform  | platforms of 1e-59 and 1e59, legs of subnormal length
    1.4   | scales:jamming             | bearings of 1e-57 and 1e57, boxes of 1e-300 and 1e300
    1.5   | scales:crossings           | circle and ellipse that differ by 1e-60
    1.6   | sizes:refused              | linkages, bearings, platforms, drives beyond 1e60: refused
    1.7   | sizes:linkages             | linkages and drives of 1e-57 and 1e57
    1.8   | sizes:tiny_tilts           | tilts of 5e-324 rad without clearance
    2.1   | shapes:zero_links          | links of length zero
    2.2   | shapes:all_in_one_point    | all joints at one place, a rhombus folded flat
    2.3   | shapes:against_the_count   | mechanism that moves against the count
    3.1   | borderline:gap_zero        | gap of a bearing exactly zero, and beside it by 1e-30
    3.2   | borderline:grashof         | four-bars beside a change point by 1e-400
    3.3   | borderline:near_fold       | poses 1e-14 before a fold, in doubles and as proofs
    4.1   | loads:wheels               | torques of 1e18 N m, inertias of 1e200, times of 1e9 s
    4.2   | loads:stiff_motor          | motor with an electrical time of 1e-15 s over 1000 s
    4.3   | loads:broken_laws          | torque that becomes NaN or infinite
    4.4   | loads:budget               | budget of steps used up
    4.5   | sizes:huge_angles          | angles of 1e20 to 1e150 rad
    4.6   | sizes:many_turns           | 50 turns forward and back
    5.1   | limits:large_graphs        | strongly regular graphs, 255 links, 60! automorphisms
    5.2   | limits:too_large           | questions beyond reach
    5.3   | limits:budgets             | proofs with a budget of one box
    """,
)
CASES = (*_LAMBDA, *_PLATFORM, *_INSTRUMENTS, *_STRUCTURE, *_BEYOND)


def stress_cases(names: Iterable[str] = (), *, slow: bool = True) -> tuple[Case, ...]:
    """Return the cases whose names are given, or that lie under a given page or section, in the order of the list.

    Parameters
    ----------
    names : iterable of str
        Full names or beginnings that end at a dash or a point: ``platform``, ``platform-12``, ``platform-12.5``.
        None: all.
    slow : bool
        With False, slow cases are left out unless one is named in full.

    Returns
    -------
    tuple of Case

    Raises
    ------
    SpecError
        A name that fits no case.

    Examples
    --------
    >>> [case.name for case in stress_cases(["structure-2"])]
    ['structure-2.1', 'structure-2.2', 'structure-2.3']
    """
    wanted = list(names)
    for name in wanted:
        if not any(_under(case.name, name) for case in CASES):
            near = get_close_matches(name, [*PAGES, *(case.name for case in CASES)], n=2)
            advice = f"did you mean {' or '.join(near)}?" if near else f"pages are {', '.join(PAGES)}"
            raise SpecError(f"no stress case is called {name!r}; {advice} (`graphsynth stress --list` shows all)")
    return tuple(
        case
        for case in CASES
        if (not wanted or any(_under(case.name, name) for name in wanted))
        and (slow or not case.slow or case.name in wanted)
    )


def _under(full: str, name: str) -> bool:
    return full == name or (full.startswith(name) and full[len(name)] in "-.")
