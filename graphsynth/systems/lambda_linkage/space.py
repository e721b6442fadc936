"""The lambda linkage with every loop closed in space, at its worst crank angles, beside the small-tilt model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from graphsynth.pipeline.products import Finding, Table
from graphsynth.systems.lambda_linkage.system import LambdaTable

if TYPE_CHECKING:
    from graphsynth.jamming.joints.limits import Limits
    from graphsynth.jamming.space.model import SpaceModel
    from graphsynth.mechanism.four_bar import TiltedFourBar

_TITLE = "Every loop closed in space, beside small tilts"
_PLACES = 180  # crank angles of the small-tilt model over a rotation
_STATES = {1: "free there (certified)", -1: "binds there (certified)", 0: "undecided"}


class _Row(NamedTuple):
    """Who takes the tilt, the worst crank angle, both factors on the critical tilt, and what is proved."""

    who: str
    angle: float
    exact: float
    small: float
    state: int


def beside_small_tilts(table: LambdaTable, linkage: TiltedFourBar) -> tuple[Table, tuple[Finding, ...]]:
    """Compare both models where they say that most is needed; a table and what is said first.

    Factors are multiples of the critical tilt: estimated; whether it binds at that crank angle is certified.
    """
    from graphsynth.core.errors import GeometryError

    columns = ("the tilt is taken by", "worst crank angle", "exact closure", "small tilts", "difference", "proved")
    if table.tilt.axis[2] != 0.0 or not 0.0 < abs(linkage.alpha) <= 0.5:
        why = "Only for an axis of the tilt that lies in the plane, and tilts up to 0.5 rad."
        return Table(_TITLE, columns, (), why), ()
    try:
        found = [_row(linkage, who, limits) for who, limits in _shared(table).items()]
    except GeometryError as error:
        return Table(_TITLE, columns, (), f"Not compared: {error}"), ()
    rows = tuple(_texts(row) for row in found)
    note = (
        "Least factor on the critical tilt with which the pose closes, above 1 it binds; estimated. Dimensions without "
        'tolerances, as doubles. Arcs over the rotation: graphsynth.jamming.certified_arcs(..., model="exact").'
    )
    if not found:
        return Table(_TITLE, columns, (), "A bearing of these dimensions never binds."), ()
    return Table(_TITLE, columns, rows, note), (_said(found),)


def _texts(row: _Row) -> tuple[str, ...]:
    """Write a row of the table."""
    angle = f"{math.degrees(row.angle):.4g}°"
    return row.who, angle, f"{row.exact:.7g}", f"{row.small:.7g}", _off(row), _STATES[row.state]


def _shared(table: LambdaTable) -> dict[str, dict[tuple[int, int], Limits]]:
    """Limits of the joints if the bearing at B takes the tilt alone, and if equal ones at A, B and C share it."""
    from graphsynth.jamming.bearing.bearing import Bearing
    from graphsynth.jamming.joints.limits import RIGID, SPHERICAL, bearing_limits

    own = table.bearing
    limit = bearing_limits(Bearing(own.radius_mm, own.height_mm, own.clearance_mm), own.condition)
    if not 0.0 < limit.tilt < math.inf:
        return {}
    return {
        "B alone": {(1, 2): SPHERICAL, (2, 3): limit, (0, 3): RIGID},
        "equal bearings at A, B, C": dict.fromkeys(((1, 2), (2, 3), (0, 3)), limit),
    }


def _row(linkage: TiltedFourBar, who: str, limits: dict[tuple[int, int], Limits]) -> _Row:
    """Find the worst crank angle with small tilts, and compare there."""
    from graphsynth.jamming.joints.limits import Misalignment
    from graphsynth.jamming.joints.program import problem
    from graphsynth.jamming.space.pose import prove_pose
    from graphsynth.mechanism.model import Mechanism

    bar = Mechanism.four_bar(linkage.l1, linkage.l2, linkage.l3, linkage.l4)
    tilt = Misalignment(0, 1, linkage.alpha, math.atan2(linkage.axis[1], linkage.axis[0]))
    f = np.linspace(0.0, math.tau, _PLACES + 1)[:-1]
    places = _planar(linkage, f)
    keep = np.isfinite(places).all(axis=(1, 2))
    small = np.full(len(f), -math.inf)
    small[keep] = problem(bar, limits, tilt).solve(_poses(f[keep], places[keep]), "scale").lower
    worst = int(np.argmax(small))
    model = _model(linkage, places[worst], limits)
    proof = prove_pose(model, np.zeros(model.width))
    return _Row(who, float(f[worst]), proof.scale, float(small[worst]), proof.state)


def _planar(linkage: TiltedFourBar, f: np.ndarray) -> np.ndarray:
    """Places of O, A, B, C without the tilt, (N, 4, 2)."""
    from dataclasses import replace

    at = replace(linkage, alpha=0.0).positions(f)
    fixed = np.broadcast_to([[0.0, 0.0], [linkage.l1, 0.0]], (len(f), 2, 2))
    return np.stack([fixed[:, 0], at.A[:, :2], at.B[:, :2], fixed[:, 1]], axis=1)


def _poses(f: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Poses of the links of `Mechanism.four_bar`, (N, 4, 3)."""
    O, A, B, C = (places[:, k, 0] + 1j * places[:, k, 1] for k in range(4))
    links = ((O, 0.0 * f), (O, f), (A, np.angle(B - A)), (C, np.angle(B - C)))
    return np.stack([np.stack([z.real, z.imag, angle], axis=-1) for z, angle in links], axis=1)


def _model(linkage: TiltedFourBar, places: np.ndarray, limits: dict[tuple[int, int], Limits]) -> SpaceModel:
    """Put the linkage into space where it stands; the seat of the crank on the frame is turned by the tilt."""
    from graphsynth.jamming.joints.limits import RIGID
    from graphsynth.jamming.space.model import Seat, SpaceJoint, SpaceModel

    O, A, B, C = (Seat((float(x), float(y), 0.0)) for x, y in places)
    size = linkage.alpha / math.hypot(*linkage.axis)
    turned = Seat(O.point, (size * linkage.axis[0], size * linkage.axis[1], 0.0))
    joints = [SpaceJoint(0, 1, turned, O, RIGID, driven=True)]
    joints += [SpaceJoint(a, b, at, at, limits[a, b]) for a, b, at in ((1, 2, A), (2, 3, B), (0, 3, C))]
    return SpaceModel(tuple(joints), 4)


def _off(row: _Row) -> str:
    return f"{100.0 * (row.small / row.exact - 1.0):+.2g} %" if 0.0 < row.exact < math.inf else "none"


def _said(found: list[_Row]) -> Finding:
    """Say how much both models ask of the bearing."""
    alone, shared = found
    angle, other = (f"{math.degrees(row.angle):.4g}°" for row in found)
    words = {1: "it closes (certified)", -1: "it binds (certified)", 0: "undecided"}
    return Finding(
        f"With every loop closed in space the bearing at B alone needs {alone.exact:.5g} times its critical tilt at "
        f"crank {angle}: {words[alone.state]}; small tilts say {alone.small:.5g} ({_off(alone)}). Equal bearings at "
        f"A, B and C together need {shared.exact:.5g} times theirs at {other}: {words[shared.state]}."
    )
