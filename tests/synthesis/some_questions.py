"""Questions that between them run all of the enumerator, with their numbers of answers by trying everything."""

from __future__ import annotations

from typing import Any

from coloured import FIVE_BAR, FORK, FOUR_BAR, STAR_FRAME, Question

from graphsynth import (
    MechanismGraph,
    StructuralSpec,
    Wishes,
    count_chains,
    count_mechanisms,
    count_multiple_joint_chains,
    count_slider_chains,
    enumerate_chains,
    enumerate_mechanisms,
    enumerate_multiple_joint_chains,
    enumerate_slider_chains,
)

SOFT = MechanismGraph(2, [(0, 1, 2)])  # a joint of mobility 2
GROUND = MechanismGraph(2, [(0, 1, 2)], frame=0)


def _asked(kind: str, links: int, mobility: int, higher: int = 0, number: int = 0, **more: Any) -> tuple[Question, int]:
    wishes = {name: more.pop(name) for name in list(more) if name in Wishes.__dataclass_fields__}
    return Question(kind, links, mobility, more.pop("framed", False), higher, wishes=Wishes(**wishes), **more), number


ASKED = [
    _asked("plain", 6, 1, 2, 7, girth=4),
    _asked("plain", 3, 1, 1, 0, girth=4),
    _asked("plain", 6, 1, 2, 29, girth=4, planar=True, framed=True),
    _asked("plain", 6, 1, 2, 14, contains=[SOFT], jointed=[(2, 2)]),
    _asked("plain", 6, 1, 2, 112, without=[GROUND], framed=True),
    _asked("plain", 6, 1, 4, 5, planar=False),
    _asked("plain", 6, 1, 4, 346, planar=True),
    _asked("plain", 6, 1, 0, 4, framed=True, jointed=[("frame", 3)]),
    _asked("plain", 6, 1, 0, 1, framed=True, apart=[("frame", 3)]),
    _asked("plain", 8, 1, 0, 9, apart=[(1, 3), (2, 4)]),
    _asked("plain", 8, 1, 0, 9, jointed=[(3, 2)], apart=[(2, 4)]),
    _asked("plain", 8, 1, 0, 1, without=[FOUR_BAR]),
    _asked("plain", 8, 1, 0, 0, contains=[FIVE_BAR], without=[FORK]),
    _asked("plain", 8, 1, 0, 33, contains=[STAR_FRAME], framed=True),
    _asked("plain", 7, 2, 0, 1, mobility_type="total"),
    _asked("plain", 7, 2, 0, 1, mobility_type="fractionated", fractionated=True),
    _asked("plain", 7, 2, 0, 14, fractionated=True, framed=True),
    _asked("plain", 9, 2, 0, 40, fractionated=True),
    _asked("plain", 9, 2, 0, 33, fractionated=True, symmetry=2),
    _asked("plain", 9, 2, 0, 1, fractionated=True, symmetry=3),
    _asked("plain", 9, 2, 0, 6, fractionated=True, girth=5),
    _asked("plain", 8, 3, 0, 26, fractionated=True, framed=True),
    _asked("plain", 5, 2, 0, 1, fractionated=True),
    _asked("plain", 4, 1, 4, 4, framed=True),
    _asked("plain", 5, 1, 3, 104, framed=True),
    _asked("plain", 6, 2, 3, 170, fractionated=True),
    _asked("plain", 6, 2, 1, 44, fractionated=True, framed=True),
    _asked("plain", 6, 3, 2, 158, fractionated=True, framed=True),
    _asked("plain", 7, 3, 1, 19, fractionated=True),
    _asked("plain", 7, 4, 2, 73, fractionated=True),
    _asked("multiple", 8, 1, 2, 95, girth=4, framed=True),
    _asked("multiple", 8, 1, 1, 0, girth=5),
    _asked("multiple", 8, 1, 2, 0, girth=5),
    _asked("multiple", 7, 2, 1, 1, girth=5),
    _asked("multiple", 8, 3, 2, 1, girth=5),
    _asked("multiple", 9, 2, 2, 3, girth=5),
    _asked("multiple", 6, 1, 1, 0, girth=8),
    _asked("multiple", 8, 3, 1, 0, girth=7),
    _asked("multiple", 8, 3, 2, 3),
    _asked("multiple", 8, 1, 1, 104, contains=[FIVE_BAR], jointed=[("frame", 3)], framed=True),
    _asked("multiple", 6, 1, 1, 3, without=[STAR_FRAME], framed=True),
    _asked("sliders", 4, 1, 1, 2, framed=True, girth=4),
    _asked("sliders", 4, 1, 2, 0, framed=True, jointed=[("frame", "frame")]),
    _asked("sliders", 4, 1, 2, 4, framed=True, rules=(True, True, False)),
    _asked("sliders", 4, 1, 3, 0, rules=(True, False, False)),
    _asked("sliders", 4, 1, 3, 1, rules=(True, True, False)),
    _asked("sliders", 4, 1, 4, 1, rules=(True, True, False)),
    _asked("sliders", 4, 1, 2, 1, framed=True, rules=(False, True, False)),
    _asked("sliders", 5, 2, 1, 3, framed=True, rules=(False, False, True)),
    _asked("sliders", 5, 2, 2, 3, framed=True, rules=(False, False, True)),
    _asked("sliders", 6, 1, 1, 0, girth=5, framed=True),
]


def asked(question: Question) -> tuple[list[Any], int]:
    """Return the list of answers and their number, as graphsynth finds them."""
    numbers = question.links, question.mobility
    more: dict[str, Any]
    if question.kind == "multiple":
        more = {"multiple": question.higher, "framed": question.framed, "wishes": question.wishes}
        return list(enumerate_multiple_joint_chains(*numbers, **more)), count_multiple_joint_chains(*numbers, **more)
    if question.kind == "sliders":
        more = dict(zip(("sliding_links", "sliding_loops", "cylinders"), question.rules))
        given = question.links, question.higher, question.mobility
        more |= {"framed": question.framed, "wishes": question.wishes}
        return list(enumerate_slider_chains(*given, **more)), count_slider_chains(*given, **more)
    wanted = {"symmetry": question.symmetry, "wishes": question.wishes}
    if question.framed:
        spec = StructuralSpec(
            W=question.mobility, links=question.links, p2=question.higher, fractionated=question.fractionated
        )
        return list(enumerate_mechanisms(spec, **wanted)), count_mechanisms(spec, **wanted)
    more = {"joints_by_mobility": {2: question.higher}, "fractionated": question.fractionated, **wanted}
    return list(enumerate_chains(*numbers, **more)), count_chains(*numbers, **more)
