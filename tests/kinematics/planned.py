"""Programs that the planning kernels make."""

from __future__ import annotations

import numpy as np

from graphsynth.kinematics.engine import codes, outlines
from graphsynth.kinematics.engine.kernels.planning import fill, joint_rows, outline as planned
from graphsynth.mechanism.joints import Cam, Gear
from graphsynth.mechanism.model import Mechanism


def drawn(mechanism: Mechanism, sizes: np.ndarray) -> outlines.Drawn:
    """What the kernels read of a mechanism with dimension sets (sets, joints, 10)."""
    number = {joint.pair: k for k, joint in enumerate(mechanism.joints)}
    joints = np.array([(outlines.JOINTS.index(j.kind), j.a, j.b) for j in mechanism.joints], dtype=np.int64)
    own = [joint.harmonics if isinstance(joint, Cam) else () for joint in mechanism.joints]
    waves = np.zeros((len(own), 2 * max(map(len, own), default=0)))
    for k, harmonics in enumerate(own):
        waves[k, : 2 * len(harmonics)] = np.ravel(harmonics)
    drivers = np.array([(number[d.pair], d.base) for d in mechanism.drivers], dtype=np.int64).reshape(-1, 2)
    return outlines.Drawn(joints, np.ascontiguousarray(sizes), waves, drivers)


def program(mechanism: Mechanism, sizes: np.ndarray) -> tuple[int, int, codes.Tables | None, np.ndarray]:
    """Fault, the link that it names, tables and rows of gear pairs."""
    links, joints, drivers = mechanism.graph.links, len(mechanism.joints), len(mechanism.drivers)
    rows = 2 * joints + drivers + links
    shapes = [(links + drivers, 10), (2 * joints + 1,), (rows, 5), (rows, 4), (links + 1,), (links, 4), (links, 2)]
    shapes += [(drivers, 4), (joints,), (links, 3), (8,)]
    found = outlines.Outline(*(np.zeros(shape, dtype=np.int64) for shape in shapes))
    given = drawn(mechanism, sizes)
    fault = planned(given, mechanism.frame, found)
    used = found.counts
    gears = found.gears[: used[outlines.GEARS]]
    if fault:
        return fault, int(used[outlines.AT]), None, gears
    own = found.rows[: used[outlines.ROWS]]
    width = codes.ROW_WIDTH + (given.waves.shape[1] if (own[:, 0] == codes.CAM).any() else 0)
    counts = (len(own), width), (used[outlines.GONE], codes.ELIM_WIDTH), (used[outlines.DRIVES], codes.DRIVE_WIDTH)
    row_table, eliminated_table, drive_table = (np.zeros((len(sizes), *shape)) for shape in counts)
    fill(given, found, row_table, eliminated_table, drive_table)
    need = np.zeros(links, dtype=np.bool_)
    for joint in mechanism.joints:
        if isinstance(joint, Gear):
            need[[joint.a, joint.b]] = True
    touched, core = found.touched[: max(1, used[outlines.TOUCHED])], found.core[: max(1, used[outlines.CORE])]
    eliminated, drives = found.eliminated[: used[outlines.GONE]], found.drives[: used[outlines.DRIVES]]
    steps = found.steps[: used[outlines.STEPS]]
    tables = codes.Tables(steps, touched, own, row_table, core, eliminated, eliminated_table, drives, drive_table, need)
    return fault, -1, tables, gears


def equations(mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray]:
    """All equations of the joints: rows (rows, 6) and their numbers (1, rows, width)."""
    given = drawn(mechanism, mechanism.dimensions[None])._replace(drivers=np.zeros((0, 2), dtype=np.int64))
    count = sum(3 - joint.mobility for joint in mechanism.joints)
    rows = np.zeros((count, 6), dtype=np.int64)
    table = np.zeros((1, count, codes.ROW_WIDTH + given.waves.shape[1]))
    joint_rows(given, rows, table)
    return rows, table
