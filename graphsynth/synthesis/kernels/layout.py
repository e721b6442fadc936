"""What the search kernels read and write: tables of labels, and the workspace of one process.

Both are named tuples of a few integer arrays whose rows are named by constants (few arrays compile and pass fast).

A *class* is the set of all parallel paths between two vertices of the contracted graph; its *label* says which paths
they are.  An automorphism g of the contracted graph permutes the classes and may reverse them.  The labellings fixed
by g take one free label per cycle of classes: a *variable*.  A variable whose class returns to itself reversed admits
only labels that equal their own reversal.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import kernel

MAX_VERTICES = 18
MAX_CLASSES = 48
MAX_SETS = 1024
MAX_ENTRIES = 1 << 18
MAX_PAIRS = 64
# entries of the matrix of a contracted graph: 1 on the diagonal for a multiple joint; besides it the number of parallel
# paths, and what they connect, shifted: two links, a link and a multiple joint, two multiple joints (LOOSE: all of
# these paths add freedom)
COPIES_MASK, KIND_SHIFT = 15, 4
BETWEEN_LINKS, TO_PIN, BETWEEN_PINS, LOOSE = range(4)
HEADER = 3  # columns of a listed row before the labels: graph, frame mode, frame

# a byte for each critical set: the largest number, the top bits, the lowest bits
BYTE = 127
TOP = np.uint64(0x8080808080808080)
ONES = np.uint64(0x0101010101010101)

# rows of Tables.kinds and Tables.group_kinds: where the labels (groups) of a kind start and end
LABELS, LABELS_END = 0, 1
GROUPS, GROUPS_END = 0, 1
# rows of Tables.labels, Tables.groups and Work.entries
WEIGHT, INDEX, PACKED = 0, 1, 2
REVERSE, FOLD = 3, 4  # labels: the label read from the other end; largest number of equal paths
GAIN, COPIES = 0, 3  # entries and groups: weight given up (instead of WEIGHT); number of labels alike
COVER, LABEL_COVER = 4, 5  # of entries and groups, of labels: see ``graphsynth.synthesis.kernels.covers``
COVERS, SLIDING_COVERS = 64, 12  # numbers that a cover takes; with rules of prismatic joints
# Tables.rules: two bits; where the girth stands, and the pairs of links to be jointed or not, each of so many bits
NO_SLIDING_LINK, NO_SLIDING_LOOP = 1, 2
GIRTH, LONGEST, PAIRS, PAIR = 3, 15, 7, 9
JOINTED, APART = -2, -3  # Work.sets: instead of VERTEX (-1 for a cycle)
# rows of Tables.resources
DIGITS, FINAL = 0, 1
# rows of Work.classes
U, V, KIND, HEAVIEST, VAR, FLIP, LABEL = range(7)
# rows of Work.variables
REP, SIZE, OWN, ROW, ENTRY, AT, USED = range(7)
# rows of Work.sets, Work.rows, Work.tables, Work.states
MASK, NEED, LEFT, VERTEX, CYCLE = range(5)
SET, COEF = range(2)
WAYS, GAINS = range(2)
# rows of Work.pairs
PAIR_AT, ONE, OTHER, TURNED = range(4)
SUM, SLOT, STAMP = range(3)


def inner(function: Any) -> Any:
    """Compile a kernel that only other kernels call (without the wrappers for Python)."""
    return kernel(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def glue(function: Any) -> Any:
    """Compile a short kernel into the kernels that call it."""
    return kernel(function, inline="always")


class Tables(NamedTuple):
    """Labels of classes, by kind ``t = 2 * multiplicity + marked`` (made by ``graphsynth.synthesis.edge_labels``).

    Resources (binary links, higher pairs, ...) are counted both as a mixed-radix index and packed eight bits a digit.
    """

    kinds: NDArray[np.int64]  # (2, kinds) LABELS, LABELS_END
    labels: NDArray[np.int64]  # (6, labels) WEIGHT D in the sparsity conditions, INDEX, PACKED, REVERSE, FOLD, COVER
    group_kinds: NDArray[np.int64]  # (2, 2 * kinds) GROUPS, GROUPS_END of kind 2 t + own_reverse
    groups: NDArray[np.int64]  # (5, groups) labels alike for counting: WEIGHT, INDEX, PACKED, COPIES, COVER
    heaviest: NDArray[np.int64]  # (multiplicities,) largest weight of an unmarked label
    resources: NDArray[np.int64]  # (2, states) DIGITS packed; FINAL: 1 where nothing but slack is left
    space: np.int64
    target: np.int64  # resources to be used up, as an index
    guard: np.int64  # the top bit of every packed digit
    rules: np.int64  # of prismatic joints, or wishes
    sliders: np.int64  # number of prismatic joints; cycles of so many classes and one more have needs


class Work(NamedTuple):
    """Workspace of the searches; allocated once per process."""

    perms: NDArray[np.uint8]  # (group, MAX_VERTICES) automorphisms of the contracted graph
    members: NDArray[np.int64]  # (group,) those that fix the chosen frame
    class_of: NDArray[np.int64]  # (MAX_VERTICES, MAX_VERTICES) number of the class between two vertices
    classes: NDArray[np.int64]  # (7, MAX_CLASSES) ends U < V, KIND, HEAVIEST, VAR and FLIP, LABEL at a leaf
    subsets: NDArray[np.int16]  # (2, 2**MAX_VERTICES) needs of vertex sets
    sets: NDArray[np.int64]  # (5, MAX_SETS) MASK of classes inside, NEED, what is LEFT; VERTEX, CYCLE to be covered
    variables: NDArray[np.int64]  # (7, MAX_CLASSES + 1) REP, SIZE, OWN reversal; first ROW and ENTRY; search stack
    rows: NDArray[np.int64]  # (2, MAX_SETS * MAX_CLASSES) SET and COEF of each entry
    entries: NDArray[np.int64]  # (5, MAX_ENTRIES) choices of a variable: GAIN, INDEX, PACKED, COPIES, COVER
    tables: NDArray[np.int64]  # (2, MAX_CLASSES + 1, states) WAYS and GAINS of variables j, j+1, ...
    pairs: NDArray[np.int64]  # (4, MAX_PAIRS + 1) PAIR_AT per variable; ONE <= OTHER, TURNED or not
    lanes: NDArray[np.uint64]  # per variable: coefficients, then what later variables can contribute; a byte per set
    covers: NDArray[np.uint64]  # per variable and cover: what it gives to vertices and cycles; a byte per set
    keys: NDArray[np.uint64]  # two layers of states of the dynamic program
    states: NDArray[np.int64]  # (3, key_words) SUM of a state; hash table: SLOT -> state, STAMP = its layer
    state: NDArray[np.int64]  # scalars that survive between calls of a stream


def make_work(resources: int, group: int = 20_000, key_words: int = 1 << 18) -> Work:
    """Allocate the workspace for problems with the given number of resource states.

    ``group`` bounds the order of automorphism groups, ``key_words`` (a power of two) the states of the dynamic program.
    """

    def ints(*shape: int) -> NDArray[np.int64]:
        return np.zeros(shape, np.int64)

    return Work(
        perms=np.zeros((group, MAX_VERTICES), np.uint8),
        members=ints(group),
        class_of=ints(MAX_VERTICES, MAX_VERTICES),
        classes=ints(7, MAX_CLASSES),
        subsets=np.zeros((2, 1 << MAX_VERTICES), np.int16),
        sets=ints(5, MAX_SETS),
        variables=ints(7, MAX_CLASSES + 1),
        rows=ints(2, MAX_SETS * MAX_CLASSES),
        entries=ints(5, MAX_ENTRIES),
        tables=ints(2, MAX_CLASSES + 1, resources),
        pairs=ints(4, MAX_PAIRS + 1),
        lanes=np.zeros(2 * MAX_CLASSES * (MAX_SETS // 8), np.uint64),
        covers=np.zeros(MAX_CLASSES * COVERS * (MAX_SETS // 8), np.uint64),
        keys=np.zeros(2 * key_words, np.uint64),
        states=ints(3, key_words),
        state=ints(22),
    )
