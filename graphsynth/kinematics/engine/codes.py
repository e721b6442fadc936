"""Numbers shared by the compiler (`program`) and the compiled kernels."""

from __future__ import annotations

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

#: NEWTON: any core; PLATFORM: one core link held by three distances, by Newton with explicit 3 x 3 solves.
ITERATIVE = (NEWTON, PLATFORM)
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
