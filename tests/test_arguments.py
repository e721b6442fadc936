"""Arguments of another kind: intervals, jamming and mechanisms answer with a sentence, never with another exception.

What Python's own protocols ask for stays: an index out of range is an IndexError, a missing argument a TypeError.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from graphsynth import intervals, jamming
from graphsynth.core.arguments import checker
from graphsynth.core.errors import GeometryError, GraphsynthError, IntervalError
from graphsynth.intervals import Dual, Interval, Search
from graphsynth.jamming import Bearing, Fit, ToleranceBox
from graphsynth.jamming.bearing import areas as circle_areas
from graphsynth.jamming.bearing.parameters import Range
from graphsynth.jamming.bearing.sweep import PieceInterference
from graphsynth.jamming.intersection.boxes import krawczyk_boxes
from graphsynth.jamming.intersection.hull import circle_ellipse, surrogate_problem
from graphsynth.jamming.intersection.readings import Reading, reading_ellipse
from graphsynth.jamming.joints import bearing_limits
from graphsynth.mechanism import constraints, files, joints, laws
from graphsynth.mechanism.constraints import mobility_report
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

BAD = {
    "None": None, "text": "x", "ragged": [[1], [2, 3]], "nan": math.nan, "inf": math.inf, "shape": np.zeros((2, 5)),
    "empty": [], "object": object(), "too large for a float": 10**400, "complex": 1j, "mapping": {"a": 1},
    "negative": -1, "half": 2.5,
}  # fmt: skip

THREE, LINE = Interval(["[1, 2]", "[3, 4]", "[-1, 5]"]), ["[1, 2]"]
DUAL = intervals.variables(THREE)[0]
DECK, BEARING = TiltedFourBar(alpha=1 / 30), Bearing()
FIT = Fit.read("H7/g6", 35)
ARM = Mechanism(
    MechanismGraph(2, [(0, 1)], frame=0), [joints.Revolute(0, 1)], [Driver(0, 1)], pose=[(0, 0, 0), (0, 0, 0)]
)
UNIT = Range.read("unit", 1)


@cache
def box() -> ToleranceBox:
    return ToleranceBox(alpha="1/30")


def square(x: Any, p: Any) -> list[Any]:
    return [x[0] ** 2 - p[0]]


def always(f: Interval) -> PieceInterference:
    return PieceInterference(intervals.sin(f) - 0.5, np.ones(len(f), bool), np.zeros(len(f), bool))


PAVED = {"f": square, "box": LINE, "parameters": [2], "tolerance": 1e-3, "max_boxes": 100, "max_seconds": 1.0}
BUDGETS = {"max_boxes": 50, "max_seconds": 1.0}
CALLS: dict[str, Callable[[], tuple[Callable[..., Any], dict[str, Any]]]] = {
    "interval": lambda: (Interval, {"value": 1, "upper": 2}),
    "empty": lambda: (Interval.empty, {"shape": 2}),
    "entire": lambda: (Interval.entire, {"shape": 2}),
    "zeros": lambda: (Interval.zeros, {"shape": 2}),
    "reshape": lambda: (lambda shape: THREE.reshape(shape), {"shape": (3, 1)}),
    "sum": lambda: (THREE.sum, {"axis": 0}),
    "inflate": lambda: (THREE.inflate, {"relative": 0.1, "absolute": 0.0}),
    "contains": lambda: (THREE.contains, {"point": 1.0}),
    "power": lambda: (lambda n: THREE**n, {"n": 2}),
    "power of a dual": lambda: (lambda n: DUAL**n, {"n": 2}),
    "product of a dual": lambda: (lambda other: DUAL * other, {"other": 2}),
    "jacobian": lambda: (intervals.jacobian, {"f": square, "box": LINE, "parameters": [1]}),
    "image": lambda: (intervals.image, {"f": square, "boxes": [LINE], "parameters": [1]}),
    "krawczyk": lambda: (intervals.krawczyk, {"f": square, "box": LINE, "parameters": [2], "rounds": 3}),
    "pave": lambda: (intervals.pave, PAVED | {"inner": None, "batch": 32}),
    "cells": lambda: (intervals.pave_cells, PAVED | {"smallest": 0.3, "cell_boxes": 10}),
    "load": lambda: (Search(square, LINE, [2]).load, {"path": "no file"}),
    "gauss_seidel": lambda: (intervals.gauss_seidel, {
        "matrix": [[2, 1], [1, 3]], "right": [3, 4], "box": ["[-9, 9]"] * 2, "rounds": 3,
    }),
    "arc": lambda: (jamming.JamArc, {"start": 0.0, "length": 1.0}),
    "inside an arc": lambda: (jamming.JamArc(0.0, 1.0).contains, {"f": 0.1}),
    "gap": lambda: (BEARING.interference, {"sine": 0.1, "cosine": 0.99, "condition": "A"}),
    "fit": lambda: (Fit, {"name": "H7/g6", "nominal": Fraction(35), "hole": UNIT, "shaft": UNIT}),
    "pair": lambda: (FIT.pair, {"loosest": True}),
    "range": lambda: (Range, {"lower": Fraction(1), "upper": Fraction(2), "exact": True}),
    "diagram": lambda: (jamming.InsertionDiagram, {"friction": UNIT, "depth_ratio": UNIT}),
    "part of a turn": lambda: (jamming.certify_jamming(box()).over, {"start": 0.1, "stop": 0.2}),
    "another box": lambda: (box().replace, {"l1": 2, "axis": (1, 0, 0), "clearance": 0.03}),
    "parameter of a box": lambda: (box().outer, {"name": "l1"}),
    "fits": lambda: (jamming.tightest_free_fit, {"box": box(), "fits": ("H7/g6",), "diameter": 35}),
    "assessment": lambda: (jamming.assess_jamming, {
        "subject": DECK, "bearing": BEARING, "condition": "A", "samples": 8, "certify": False,
    }),
    "largest interference": lambda: (jamming.largest_interference, {
        "box": box(), "tolerance": 1e-3, "decide_sign": True, **BUDGETS,
    }),
    "maximise": lambda: (jamming.maximise, {
        "function": lambda x: x[0] * x[1], "box": Interval(["[0, 1]"] * 2), "tolerance": 0.1, "tried": None, **BUDGETS,
    }),
    "sweep": lambda: (jamming.sweep_turn, {
        "interference": always, "resolution": 0.1, "first": 16, "max_pieces": 300, "max_seconds": 1.0,
    }),
    "samples": lambda: (jamming.sample_interference, {"box": box(), "condition": "A", "count": 50, "seed": 0}),
    "limit": lambda: (jamming.largest_height, {"linkage": DECK, "bearing": BEARING, "condition": "A"}),
    "limits of a bearing": lambda: (bearing_limits, {
        "bearing": BEARING, "axial_clearance": 0.0, "radius_tolerance": 0.0, "clearance_tolerance": 0.0,
        "radial_offset": 0.0,
    }),
    "boxes of a crossing": lambda: (krawczyk_boxes, {"problem": circle_ellipse(5, 6, 4), "tolerance": 0.01, **BUDGETS}),
    "ellipse": lambda: (reading_ellipse, {
        "bearing": BEARING, "sine": 0.01, "cosine": 1.0, "reading": Reading.LID, "lid": 1,
    }),
    "surrogate": lambda: (surrogate_problem, {"bearing": BEARING, "sine": "0.0133", "e1": 0, "bits": 64}),
    "crescents": lambda: (circle_areas.ellipse_circle, {"R1": 5.0, "a": 6.0, "b": 4.0}),
    "stable crescents": lambda: (circle_areas.ellipse_circle_stable, {"R1": 5.0, "pa": 1.0, "qb": 1.0}),
    "lid": lambda: (circle_areas.lid_area, {"bearing": BEARING, "sine": 0.01, "cosine": 1.0}),
    "pitch curve": lambda: (joints.Cam(0, 1, harmonics=((0.1, 0.1),)).pitch_radius, {"psi": 0.0}),
    **{f"law {law.kind}": lambda law=law: (law, {"u": 0.5}) for law in (
        laws.Linear(), laws.Harmonic(), laws.Polynomial(), laws.Table((0.0, 1.0, 2.0), (0.0, 1.0, 2.0)),
    )},
    "constraints": lambda: (constraints.residual, {"joints": ARM.joints, "poses": np.zeros((2, 3))}),
    "derivatives": lambda: (constraints.jacobian, {"joints": ARM.joints, "poses": np.zeros((2, 3))}),
    "json": lambda: (files.from_json, {"text": files.to_json(ARM)}),
    "toml": lambda: (files.from_toml, {"text": files.to_toml(ARM)}),
    "written": lambda: (files.to_json, {"mechanism": ARM}),
    "mobility": lambda: (mobility_report, {"mechanism": ARM, "pose": np.zeros((2, 3))}),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_bad_arguments_are_told_in_a_sentence(name: str) -> None:
    function, arguments = CALLS[name]()
    if name != "load":
        function(**arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # NaN in, NaN out
        for argument in arguments:
            for what, bad in BAD.items():
                try:
                    function(**arguments | {argument: bad})
                except GraphsynthError as error:
                    assert len(str(error)) > 15, (argument, what)
                except Exception as error:
                    pytest.fail(f"{argument} = {what}: {type(error).__name__}: {error}")


def test_functions_of_users_that_return_something_else_are_named() -> None:
    for wrong in (lambda x: None, lambda x: x[5], lambda x: 1 / 0):
        with pytest.raises(GeometryError, match="the function"):
            jamming.maximise(wrong, THREE)
        with pytest.raises(IntervalError, match="the system"):
            intervals.jacobian(wrong, THREE)
    with pytest.raises(IntervalError, match="the system cannot be evaluated with intervals"):
        intervals.pave(square, LINE, [])  # there is no p[0]


def test_protocols_of_python_stay() -> None:
    for key in (7, "x", 2.5):
        with pytest.raises(IndexError):
            THREE[key]
    with pytest.raises(TypeError):
        jamming.certify_jamming()
    with pytest.raises(TypeError):
        jamming.largest_interference(box(), colour=1)
    assert len(list(THREE)) == 3


def test_every_kind_of_annotation_is_kept() -> None:
    checked = checker(GeometryError, {"Condition": "str"})

    @checked
    def call(
        length: float = 1.0, count: Count = 1, tolerance: Positive = 1.0, seconds: Budget = 1.0,  # noqa: F821
        real: Real = 0.0, whole: int = 0, truth: bool = True, text: str = "", point: complex = 0j,  # noqa: F821
        names: tuple[str, ...] = (), sizes: Sequence[float] | None = None, rows: Mapping[str, list[int]] = {},  # noqa: B006, F821
        what: Interval | Dual | None = None, condition: Condition = "A", law: Callable[[float], float] = abs,  # noqa: F821
        left: Anything | float = 1.0,  # noqa: F821
    ) -> str:  # fmt: skip
        return "kept"

    good = {
        "length": [1, -2.5, np.float32(1)], "count": [1, np.int64(5)], "tolerance": [1e-300], "seconds": [math.inf, 1],
        "real": [math.nan, -math.inf], "whole": [-3, np.uint8(3)], "truth": [np.True_, 0], "text": ["x"],
        "point": [1, 1j], "names": [["a"], ("a", "b")], "sizes": [None, [1.0], np.ones(2)],
        "rows": [{"a": [1, 2]}, {}], "what": [None, THREE, DUAL], "condition": ["B"], "law": [math.sin], "left": ["x"],
    }  # fmt: skip
    bad = {
        "length": [None, "1", True, math.inf, 1j, 10**400], "count": [0, 1.0, True, 2**70], "tolerance": [0, math.inf],
        "seconds": [0, math.nan, "1"], "real": [None, "x"], "whole": [0.5, 2**63], "truth": [2, None, "yes"],
        "text": [b"x", 1], "point": ["1", math.nan], "names": ["ab", [1], 3], "sizes": [[1.0, math.nan], 3.0],
        "rows": [[], {"a": [0.5]}, {"a": 3}], "what": [1.0, "Interval"], "condition": [1], "law": ["sin"],
    }  # fmt: skip
    for name, values in good.items():
        assert all(call(**{name: value}) == "kept" for value in values), name
    for name, values in bad.items():
        for value in values:
            with pytest.raises(GeometryError, match=f"^{name}") as caught:
                call(**{name: value})
            assert len(str(caught.value)) < 200
    assert isinstance(DUAL, Dual)
