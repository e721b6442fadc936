"""Numbers and named tuples of arrays shared by the compiler (`program`) and the compiled kernels."""

from __future__ import annotations

from collections import namedtuple

# Rows: one equation each, between links a and b.  P, Q: points of a and b; t, n: direction of a's line and its normal.
RX, RY = 0, 1  #: Q - P = 0
DIST = 2  #: |Q - P| = h
LINE = 3  #: n . (Q - P) = h
ANGLE = 4  #: theta_b - theta_a = h
GEAR = 5  #: radius_a (theta_a - phi) + sign radius_b (theta_b - phi - h) = 0
DRIVE_ANGLE = 6  #: theta_b - theta_a = sign q
DRIVE_SLIDE = 7  #: t . (Q - P) = sign q
CAM = 8  #: |Q - P| = pitch radius in the direction of Q - P, seen from link a

# Links eliminated from a group: placed after it, from the two links they join.
E_RR, E_RP, E_PP = 0, 1, 2

# Steps of a program.
DRIVE_R, DRIVE_P = 0, 1
R_DIST, R_LINE_PIN, R_LINE_SLOT, R_ANGLE, R_GEAR, P_DIST, P_LINE, NEWTON, PLATFORM = 2, 3, 4, 5, 6, 7, 8, 9, 10

#: From here on iterative: any core; PLATFORM: one core link held by three distances, with explicit 3 x 3 solves.
ITERATIVE_FROM = NEWTON
#: Steps with two assembly modes.
TWO_MODES = (R_DIST, R_LINE_PIN, R_LINE_SLOT, P_DIST)

# Row parameters (columns of a float table).
PAX, PAY, PBX, PBY, TX, TY, H, RA, RB, SIGN, SLOT, INVERSE = range(12)
ROW_WIDTH = 12
#: Of a CAM row: mean radius in H, direction in RA; then its harmonics, two columns each.
CAM_WIDTH = ROW_WIDTH
#: Parameters of an eliminated link: a's point, e's point there, b's point, e's point there, directions, angle.
ELIM_WIDTH = 13
#: Parameters of a driver step: known point, direction in the known link, placed link's point, sign, angle.
DRIVE_WIDTH = 8

#: Sine of the angle between two guides at and below which they are parallel: the products of sines and cosines that
#: carry a direction through the links before have an error of a few 1e-16 each, and nothing is left of a place beyond.
PARALLEL = 1e-14

# Why a run stopped.
DONE, UNREACHABLE, STEP_TOO_LONG, NO_CONVERGENCE, SINGULAR, BAD_INPUT = 0, 1, 2, 3, 4, 5


#: A program in tables; those of numbers have the dimension sets as first axis.  A row of ``steps``: code, first row,
#: rows, first core link, core links, first eliminated link, eliminated links, first touched link, touched links, group.
#: A row of ``rows``: kind, links a and b, their places in the core or -1.
Tables = namedtuple(
    "Tables", "steps touched rows row_table core eliminated eliminated_table drives drive_table need_angle"
)

#: State of every link over n samples, the sample as last axis.  X (links, 4, n) holds x, y, cos and sin; TH (links, n)
#: angles where gears need them; V and W (links, 3, n) first and second derivatives by the input; PHI (gears, n)
#: directions of lines of centres; M (steps, n) margins.
State = namedtuple("State", "X TH V W PHI M")

#: What a run keeps of every dimension set: of which links and steps, and where it goes.  It starts from ``poses``
#: (sets, links, 3) and ``centres`` (sets, gears), the directions of lines of centres; without them from sample 0 as it
#: is.
Delivery = namedtuple("Delivery", "poses centres links steps frames velocities accelerations margins")

#: A group to be placed: its rows ``r0 .. r0 + nr`` with their numbers, its core links ``c0 .. c0 + nc``.
Group = namedtuple("Group", "rows rp r0 nr core c0 nc")

#: Workspace of one run.  J (n, n), f (n,), pivots (n,): a linear system; g (6,) and G (n, 6): gradients of a row and of
#: all rows; ``out``: see `newton`, and expected velocities; P, Q: see `anchors` and `platform_rows`; x (links, 11): one
#: sample; T (12, n): rows of the loops; phi, m, ql: lines of centres, margins and driver coordinates at one sample;
#: blur (n,): how far rounding moved the links of the groups before.
Room = namedtuple("Room", "J f g G pivots out P Q x T phi m ql blur")

#: One sample: its number, the step from the one before (if ``warm``) and the margin there, the mode.
At = namedtuple("At", "i h before warm sign derivs")
