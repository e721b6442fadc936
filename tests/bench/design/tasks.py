"""The tasks: points as the literature has them, the task for the search, and how an answer is measured.

Bounds are those of the literature, which asks for a full turn and the order of the points and no more.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.design import DesignTask, DwellTarget, FunctionTarget, PathTarget, PosesTarget, SwingTarget
from tests.bench.design import measure
from tests.bench.design.four_bars import of_lengths
from tests.bench.design.letters import LETTERS, outline

Complex = NDArray[np.complex128]
#: Bounds of the literature: none on the transmission angle, and almost none on lengths.
_FREE: dict[str, Any] = {"transmission": 0.0, "length_ratio": 300.0}
#: The crank of the literature begins at 30 degrees from the frame and turns counter-clockwise.
_CRANK: dict[str, Any] = {"crank_start": "30 deg", "crank_from": "frame", "turning": "counter-clockwise"}
#: Positions of a function that are asked; it is measured at more.
_ASKED = 91
_HERE = Path(__file__).parent
PUBLISHED: dict[str, list[dict[str, Any]]] = tomllib.loads((_HERE / "published.toml").read_text("utf-8"))


@dataclass(frozen=True)
class Trial:
    """A task of the benchmark.

    ``kind`` names the measure: "timed", "path", "curve", "function", "poses", "dwell", "stroke", "foot", "cylinder".
    ``unit`` is that of the error, ``source`` that of the points, ``tolerance`` what the search begins with.
    """

    name: str
    title: str
    kind: str
    unit: str
    source: str
    task: Callable[[float], DesignTask]
    tolerance: float
    goals: Complex | None = None
    inputs: Any = None
    wanted: Any = None
    bounds: float = 60.0

    @property
    def published(self) -> tuple[float, str]:
        """Return the best published error and its source; infinite if none was found."""
        rows = [(self.recomputed(row), str(row["source"])) for row in PUBLISHED.get(self.name, ())]
        return min(rows, default=(float("inf"), "none found"))

    def recomputed(self, row: dict[str, Any]) -> float:
        """Error of published dimensions, at the published crank angles."""
        if "error" in row:
            return float(row["error"])
        assert self.goals is not None
        if "start" in row:
            angles = row["start"] + np.radians(row["step_deg"]) * np.arange(len(self.goals))
        else:
            angles = np.array(row["angles"] if "angles" in row else np.radians(row["angles_deg"]))
        return measure.timed(of_lengths(row["dimensions"]).curve(angles), self.goals)


def _path(name: str, title: str, source: str, points: Any, inputs_deg: Any = None, **more: Any) -> Trial:
    goals = np.array([complex(*p) for p in points])
    bounds = more.pop("bounds", 60.0)
    size = float(np.abs(goals - goals.mean()).max())
    lengths = (min(0.005 * size, 0.01 * bounds), bounds)
    inputs = None if inputs_deg is None else np.radians(inputs_deg)

    def task(tolerance: float) -> DesignTask:
        timing = {} if inputs is None else {"inputs": inputs.tolist()}
        target = PathTarget(points=[tuple(p) for p in points], tolerance=tolerance, mean=True, **timing)
        return DesignTask(targets=[target], links=[4], lengths=lengths, **_FREE, **more)

    kind = "path" if inputs is None else "timed"
    return Trial(name, title, kind, "sum of squares", source, task, 0.01, goals, inputs, bounds=bounds)


_FIVE = [(3, 3), (2.759, 3.363), (2.372, 3.663), (1.89, 3.862), (1.355, 3.943)]
_EIGHTEEN = [
    (0.5, 1.1), (0.4, 1.1), (0.3, 1.1), (0.2, 1.0), (0.1, 0.9), (0.05, 0.75), (0.02, 0.6), (0.0, 0.5), (0.0, 0.4),
    (0.03, 0.3), (0.1, 0.25), (0.15, 0.2), (0.2, 0.3), (0.3, 0.4), (0.4, 0.5), (0.5, 0.7), (0.6, 0.9), (0.6, 1.0),
]  # fmt: skip
_ELLIPSE = [
    (20, 10), (17.66, 15.142), (11.736, 17.878), (5, 16.928), (0.60307, 12.736), (0.60307, 7.2638), (5, 3.0718),
    (11.736, 2.1215), (17.66, 4.8577), (20, 10),
]  # fmt: skip
_SEMICIRCLE = [(0, 0), (1.9098, 5.8779), (6.9098, 9.5106), (13.09, 9.5106), (18.09, 5.8779), (20, 0)]
#: Of a body on the coupler of a four-bar (ground 3, crank 1, coupler 2.6, follower 2), rounded; angles in degrees.
_POSES = [(0.89, 2.12, 39.6), (0.97, 2.47, 29.8), (0.73, 2.68, 22.7), (0.31, 2.65, 19.4), (-0.19, 2.33, 19.4)]
_MANDAL = "[Acharyya & Mandal 2009]"

PATHS = [
    _path("vertical", "six points on a vertical line", "[Cabrera et al. 2002]",
          [(20, y) for y in range(20, 50, 5)]),
    _path("five_timed", "five timed points", "[Kunjur & Krishnamurty 1997]", _FIVE, [0, 15, 30, 45, 60],
          bounds=50.0, pivots=[(0, 0)], pivot_region=(-1e-3, -1e-3, 50.0, 1e-3), **_CRANK),
    _path("eighteen_timed", "18 timed points", "[Kunjur & Krishnamurty 1997]", _EIGHTEEN, 20.0 * np.arange(18),
          bounds=50.0),
    _path("ellipse", "ten points on an ellipse", _MANDAL, _ELLIPSE, bounds=80.0),
    _path("semicircle", "six timed points of a semicircle", _MANDAL, _SEMICIRCLE, [0, 30, 60, 90, 120, 150],
          bounds=50.0, **_CRANK),
]  # fmt: skip


def _function(name: str, title: str, source: str, of: Any, between: Any, spans: tuple[str, str]) -> Trial:
    span, reach = (float(text.split()[0]) for text in spans)

    def task(tolerance: float) -> DesignTask:
        target = FunctionTarget.of(
            of, between, input_range=spans[0], output_range=spans[1], count=_ASKED, tolerance=tolerance
        )
        return DesignTask(targets=[target], drive="rocking", span=spans[0], links=[4], **_FREE)

    x = np.linspace(*between, 181)
    wanted = np.radians(reach) * (of(x) - of(x[0])) / (of(x[-1]) - of(x[0]))
    inputs = np.linspace(0.0, np.radians(span), 181)
    return Trial(name, title, "function", "deg", source, task, 0.002, None, inputs, wanted)


FUNCTIONS = [
    _function("log", "log x, 1 to 2, over 60° and 90°", "[Freudenstein 1955]", np.log10, (1, 2),
              ("60 deg", "90 deg")),
    _function("square", "x², 0 to 1, over 90° and 90°", "own ranges", np.square, (0, 1), ("90 deg", "90 deg")),
    _function("sine", "sin x, 0 to 90°, over 90° and 90°", "own ranges", np.sin, (0, 0.5 * np.pi),
              ("90 deg", "90 deg")),
]  # fmt: skip


def _poses(count: int) -> Trial:
    chosen = {3: (0, 2, 4), 4: (0, 1, 3, 4), 5: range(5)}[count]
    poses = [(x, y, float(np.radians(a))) for x, y, a in (_POSES[k] for k in chosen)]

    def task(tolerance: float) -> DesignTask:
        return DesignTask(targets=[PosesTarget(poses=poses, tolerance=tolerance)], links=[4], **_FREE)

    title = f"{ {3: 'three', 4: 'four', 5: 'five'}[count] } poses"
    return Trial(f"poses_{count}", title, "poses", "of the size", "own: see `tasks.py`", task, 0.01, None, None, poses)


def _dwell(tolerance: float) -> DesignTask:
    swing = SwingTarget(least="30 deg", most="120 deg", tolerance=10.0 * tolerance)
    return DesignTask(targets=[DwellTarget(span="60 deg", tolerance=tolerance), swing], links=[6])


def _wiper(tolerance: float) -> DesignTask:
    swing = SwingTarget(
        least="107.5 deg", most="107.5 deg", time_ratio=1.0, link="blade", pivot=(320, 60), tolerance=tolerance
    )
    return DesignTask(targets=[swing], links=[4], drive_pivot=(0, 0), box=(-150, -200, 450, 350), transmission="28 deg")


def _quick(tolerance: float) -> DesignTask:
    swing = SwingTarget(least="60 deg", most="60 deg", time_ratio=1.5, tolerance=tolerance)
    return DesignTask(targets=[swing], links=[4])


def _leg(tolerance: float) -> DesignTask:
    ground = PathTarget.segment((20, 0), (-20, 0), inputs=[0, "170 deg"], count=25, point="foot", tolerance=tolerance)
    air = PathTarget(points=[(-12, 4), (0, 6), (12, 4)], point="foot", tolerance=0.2, weight=0.5)
    return DesignTask(targets=[ground, air], links=[4, 6], pivot_region=(-40, 25, 40, 80), box=(-90, -2, 90, 110))


def _bucket(tolerance: float) -> DesignTask:
    target = FunctionTarget(
        inputs=[0, 0.25, 0.5, 0.75, 1], outputs=np.radians([0, 41.25, 82.5, 123.75, 165]).tolist(), link="bucket",
        pivot=(0, 0), tolerance=tolerance,
    )  # fmt: skip
    return DesignTask(
        targets=[target], drive="cylinder", links=[6], drive_pivot=(1.7, 0.35), pivots=[(0.4, 0.06)],
        box=(-0.9, -0.9, 2, 1.2), stroke=(0.5, 1.1), lengths=(0.2, 1.9),
    )  # fmt: skip


MACHINES = [
    Trial("dwell", "a dwell of 60°, a stroke of 30° or more", "dwell", "deg", "own task", _dwell, 0.002,
          wanted=(1.0 / 6.0, 30.0)),
    Trial("wiper", "a windscreen wiper, 107.5°, no quick return", "stroke", "deg", "scene windscreen_wiper", _wiper,
          0.005, wanted=(107.5, 107.5, 1.0)),
    Trial("quick_return", "a quick return, 60°, time ratio 1.5", "stroke", "deg", "docs", _quick, 0.005,
          wanted=(60.0, 60.0, 1.5)),
    Trial("leg", "the foot of a walking leg", "foot", "cm", "scene walking_leg", _leg, 0.05,
          np.linspace(20.0, -20.0, 25) + 0j, np.radians(np.linspace(0.0, 170.0, 25))),
    Trial("bucket", "a bucket turned by a cylinder", "cylinder", "deg", "scene excavator_bucket", _bucket,
          np.radians(4.0), None, np.linspace(0.0, 1.0, 5), np.radians([0, 41.25, 82.5, 123.75, 165])),
]  # fmt: skip


def _letter(letter: str) -> Trial:
    goals = outline(letter)
    points = [(p.real, p.imag) for p in goals]

    def task(tolerance: float) -> DesignTask:
        return DesignTask(
            targets=[PathTarget(points=points, closed=True, tolerance=tolerance)], links=[4, 6, 8],
            transmission="5 deg", length_ratio=30.0,
        )  # fmt: skip

    return Trial(f"letter_{letter}", f"letter {letter}", "curve", "Chamfer, of the size", "DejaVu Sans", task, 0.01,
                 goals)  # fmt: skip


CLASSICAL = [*PATHS, *FUNCTIONS, *(_poses(n) for n in (3, 4, 5)), *MACHINES]
EVERY = [*CLASSICAL, *(_letter(letter) for letter in LETTERS)]
