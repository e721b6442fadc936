"""Mechanisms that are their own mirror image at the input 0: which chains can be, what that ties, whether it was kept.

With the driver turned backwards such a mechanism moves as the mirror image.  Of moving links only the driven one is its
own image: docs/explanation/embodiment.md, "Many targets at once", Mirrors.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.dimensional.design import Design

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
Image = tuple[int, ...]
#: How far a place may be from the image of its partner, over the size.
_SAME = 1e-6


def mirrors(design: Design) -> Iterator[Image]:
    """Yield images of all links under automorphisms that exchange them in pairs, all but the frame and the driven one.

    There are none for other drivers than one that turns on the frame.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> watt = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (1, 4), (4, 5), (0, 5)], frame=0)
    >>> list(mirrors(Design(watt, ((0, 1),), ("R",) * 7)))
    [(0, 1, 4, 5, 2, 3)]
    """
    kinds = {frozenset(joint[:2]): kind for joint, kind in zip(design.graph.joints, design.kinds, strict=True)}
    still = {*design.drivers[0]}
    if len(design.drivers) > 1 or design.graph.frame not in still or kinds[frozenset(still)] != "R":
        return

    def paired(left: tuple[int, ...], image: dict[int, int]) -> Iterator[dict[int, int]]:
        if not left:
            yield image
        for other in left[1:]:
            rest = tuple(link for link in left[1:] if link != other)
            yield from paired(rest, {**image, left[0]: other, other: left[0]})

    moving = tuple(link for link in range(design.graph.links) if link not in still)
    for image in paired(moving, {link: link for link in still}):
        if {frozenset(image[link] for link in pair): kind for pair, kind in kinds.items()} == kinds:
            yield tuple(image[link] for link in range(design.graph.links))


def images(design: Design, mirror: Image) -> list[int]:
    """Return the image of every joint; those on the axis are their own."""
    pairs = [frozenset(joint[:2]) for joint in design.graph.joints]
    return [pairs.index(frozenset(mirror[link] for link in pair)) for pair in pairs]


def axis_joints(design: Design, mirror: Image) -> tuple[int, int, int]:
    """Return three joints of the driven link that tell the axis: its pivot, another joint, and the image of that."""
    (pivot,), own = design.driver_joints, images(design, mirror)
    pin = next(k for k in design.joints_of(design.drivers[0][1]) if k != pivot)
    return pivot, pin, own[pin]


def reflected(place: Any, pivot: Any, pin: Any, image: Any) -> Any:
    """Reflect places (sets, 2), real or complex numbers, about the line through the pivot that halves the other two."""
    (a, b), (c, d), v = np.moveaxis(pin - pivot, -1, 0), np.moveaxis(image - pivot, -1, 0), place - pivot
    turn = np.stack([a * c - b * d, a * d + b * c], axis=-1)
    turn = turn / np.sqrt((turn * turn).sum(axis=-1, keepdims=True) + 1e-300)
    across = np.stack([-turn[..., 1], turn[..., 0]], axis=-1)
    flipped = v * np.array([1.0, -1.0])  # turned by twice the direction of the axis
    return pivot + flipped[..., :1] * turn + flipped[..., 1:] * across


def kept(design: Design, places: Array, numbers: Array) -> tuple[Array, Array]:
    """Return places (sets, joints, 2) and numbers with the symmetry of a design, if it has any.

    Of two mirror images one is kept, and joints on the axis lie there.  `GeometryError` for kinds without an image: of
    mobility 2, or a slide on the axis.
    """
    if not design.mirrored:
        return design.symmetric(places, numbers)
    at = [places[:, k] for k in axis_joints(design, design.symmetry)]
    (a, b, c), places, numbers = (z @ [1.0, 1.0j] for z in at), places.copy(), numbers.copy()
    twice = np.angle((b - a) * (c - a))  # direction of the axis
    for orbit in design.orbits:
        k, image = orbit[0], orbit[-1]
        if design.kinds[k] not in ("R", "P") or (k == image and design.kinds[k] == "P"):
            raise GeometryError(f"joint {design.graph.joints[k][:2]} has no mirror image of its kind; let it be R")
        other = reflected(places[:, k], *at)
        places[:, image] = other if image != k else 0.5 * (other + places[:, k])
        if design.kinds[k] == "P":
            own, its = (design.numbers.index((joint, "angle")) for joint in (k, image))
            numbers[:, its] = twice - numbers[:, own]
    return places, numbers


def is_mirrored(motion: Motion, places: Array, design: Design, mirror: Image) -> bool:
    """Whether the places of all joints at u and at -u are mirror images, for every input u of a turn."""
    own, joints = images(design, mirror), places[:, : len(design.kinds)]
    turn = motion.inputs[-1] - motion.inputs[0]
    if np.abs(motion.inputs + motion.inputs[::-1] - turn).max() > 1e-9 * turn:
        return False  # samples are no mirror images
    at = [np.broadcast_to(joints[0, k], (*joints.shape[:1], 2)) for k in axis_joints(design, mirror)]
    size = float(np.ptp(joints.reshape(-1, 2), axis=0).max())
    gaps = [joints[::-1, own[k]] - reflected(joints[:, k], *at) for k in range(len(own))]
    return bool(np.nanmax(np.abs(gaps)) <= _SAME * size)
