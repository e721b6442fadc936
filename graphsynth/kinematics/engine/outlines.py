"""Numbers and named tuples of arrays of the kernels that plan, follow and pull a drawn mechanism, beside `codes`."""

from __future__ import annotations

from collections import namedtuple

from graphsynth.kinematics.engine.codes import ANGLE as _ANGLE, CAM, GEAR, LINE, P_LINE, RX, RY, TWO_MODES

# Kinds of joints; the first two have mobility 1, the others 2.
REVOLUTE, PRISMATIC, PIN_SLOT, GEARED, CAMMED = 0, 1, 2, 3, 4
#: Their names, and the rows of each kind.
JOINTS = ("R", "P", "pin-slot", "gear", "cam")
EQUATIONS = ((RX, RY), (LINE, _ANGLE), (LINE, LINE), (GEAR, GEAR), (CAM, CAM))

# Used lengths of the arrays of an outline, and the link that a fault names.
STEPS, TOUCHED, ROWS, CORE, GONE, DRIVES, GEARS, AT = range(8)
# Why there is no program: nothing; no structural groups with these drivers; a link of length 0; two parallel guides of
# a link; a link whose direction is fixed twice by prismatic joints.
SOLVABLE, NO_GROUPS, NO_LENGTH, PARALLEL_GUIDES, TURNED_TWICE = 0, 1, 2, 3, 4

#: Steps whose margin may dip to zero between samples.
DIPPING = (*TWO_MODES, P_LINE)
# Why a way of the drivers ended, beside the codes of a run: two modes of a group meet, a link turns suddenly.
MEETING, FLIPPED = 6, 7
# Why a pull ended: the target is reached; the point can come no nearer; the joints are not closed.
REACHED, NEAREST, NOT_CLOSED = 0, 8, 9

#: A drawn mechanism: ``joints`` (joints, 3): kind, links a and b; ``sizes`` (sets, joints, 10): their numbers, in the
#: order of `graphsynth.mechanism.joints.COLUMNS`; ``waves`` (joints, 2 k): harmonics of cams; ``drivers`` (drivers, 2):
#: joint and base.
Drawn = namedtuple("Drawn", "joints sizes waves drivers")

#: A program without its numbers: tables as in `codes.Tables`, and where numbers come from.  A row of ``source``: part,
#: joint, second joint, eliminated link or driver; ``pins`` (eliminated, 2): joints of an eliminated link; ``gears``:
#: rows of gear pairs; ``structure`` (links, 3): body, group from 1 on (0: driven), marks of a fault; ``counts``: used
#: lengths.
Outline = namedtuple("Outline", "steps touched rows source core eliminated pins drives gears structure counts")

#: What a sweep over n samples gives, see `advancing.sweep`.
Samples = namedtuple("Samples", "poses velocities accelerations margins reversals")

#: Workspace of a pull: transposed constraint matrix A (n, rows), factored, the diagonal d of its R, residuals f; g (6,)
#: gradient of a row; y (n,) an unknown; N (n, freedoms) a basis of the tangent space; S, pivots; ``none`` for drivers.
Bench = namedtuple("Bench", "A d f g y N S pivots none")

#: Where a pull stands, see `dragging.attempt`.
Stand = namedtuple("Stand", "x phi N here")
