"""ISO 286: every tabulated value against tables of another origin, the formulas of the standard, and its two rules."""

import math
import tomllib
from fractions import Fraction as F
from itertools import pairwise
from pathlib import Path

import pytest

from graphsynth import Fit
from graphsynth.core.errors import GeometryError
from graphsynth.jamming import ToleranceBox, assess_fits
from graphsynth.tolerances import limit_deviations, standard_tolerance
from graphsynth.tolerances.iso286 import GRADES, LETTERS, table

PUBLISHED = tomllib.loads((Path(__file__).parent / "published.toml").read_text(encoding="utf-8"))
SIZES = [int(end) for end in table()["sizes"]]
FINE = [int(end) for end in table()["fine_sizes"]]


def rows(name):
    return [line.split() for line in PUBLISHED[name].strip().splitlines()]


def micro(tolerance_class, size):
    """(upper, lower) limit deviation in micrometres."""
    found = limit_deviations(tolerance_class, size)
    return found.upper * 1000, found.lower * 1000


def test_every_standard_tolerance_is_the_published_one():
    for end, row in zip(SIZES, rows("grades"), strict=True):
        for grade, value in zip(GRADES, row):
            assert standard_tolerance(grade, end) * 1000 == F(value), (grade, end)
        for grade in (17, 18):  # from IT11 on, five grades are a factor of ten: exact in the standard
            assert standard_tolerance(grade, end) == 10 * standard_tolerance(grade - 5, end)
    for end, row in zip(SIZES, rows("coarse_and_j"), strict=True):
        assert [standard_tolerance(grade, end) * 1000 for grade in (17, 18)] == [F(own) for own in row[1:3]]
        assert [-micro(own, row[0])[1] for own in ("j5", "j6", "j7")] == [F(row[3]), F(row[3]), F(row[4])]


def test_every_hole_a_to_h_and_its_shaft_is_the_published_one():
    for row, expected in zip(rows("holes_a_h"), FINE, strict=True):
        end, *values = row
        assert int(end) == expected
        for letter, value in zip(("A", "B", "C", "CD", "D", "E", "EF", "F", "FG", "G", "H"), values, strict=True):
            if value != "-":
                for grade in ("01", "6", "13"):
                    assert micro(letter + grade, end)[1] == F(value), (letter, end)
                    assert micro(letter.lower() + grade, end)[0] == -F(value), (letter, end)


def test_the_letters_of_the_latest_edition_are_geometric_means_of_their_neighbours():
    for column, (letter, step) in enumerate({"cd": 5, "ef": 1, "fg": 1}.items(), 1):
        for size, *published in rows("between"):
            value = -micro(letter + "8", size)[0]
            first, last = (-micro(own + "8", size)[0] for own in letter)
            # rounded to whole micrometres, from 60 on to fives
            assert value == step * round(math.sqrt(first * last) / step) == F(published[column - 1]), (letter, size)
        with pytest.raises(GeometryError, match="not standardised at 51 mm"):
            limit_deviations(letter + "8", 51)


def test_every_hole_p_to_zc_and_its_shaft_is_the_published_one():
    for row, expected in zip(rows("holes_p_zc"), FINE, strict=True):
        end, *values = row
        assert int(end) == expected
        for letter, value in zip(("P", "R", "S", "T", "U", "V", "X", "Y", "Z", "ZA", "ZB", "ZC"), values, strict=True):
            if value == "-":
                with pytest.raises(GeometryError, match="not standardised"):
                    limit_deviations(letter + "9", end)
                continue
            for grade in ("8", "11"):
                assert micro(letter + grade, end)[0] == -F(value), (letter, end)
            for grade in ("01", "6", "16"):
                assert micro(letter.lower() + grade, end)[1] == F(value), (letter, end)


def test_every_hole_j_to_n_follows_the_published_deviations_and_delta():
    delta = {row[0]: dict(zip("345678", map(F, row[1:]), strict=True)) for row in rows("delta")}
    for end, j6, j7, j8, k, m, n in rows("holes_j_n"):
        assert [micro(own, end)[0] for own in ("J6", "J7", "J8")] == [F(j6), F(j7), F(j8)]
        for letter, less in (("K", F(k)), ("M", F(m)), ("N", F(n))):
            assert micro(letter.lower() + "6", end)[1] == less
            for grade, more in delta[end].items():
                special = letter + grade == "M6" and end == "315"  # "ES = -9 instead of -11"
                assert micro(letter + grade, end)[0] == (-9 if special else more - less), (letter, grade, end)
        assert micro("M9", end)[0] == -F(m) and micro("N9", end)[0] == 0
        for grade, more in delta[end].items():
            if grade != "8":
                assert micro("P" + grade, end)[0] == more - micro("p" + grade, end)[1]
    assert [micro(own, 3)[0] for own in ("J6", "J7", "J8", "K7", "K10", "M7", "M9", "N7", "N9", "P7")] == [
        2, 4, 6, 0, 0, -2, -2, -4, -4, -6,
    ]  # fmt: skip
    assert [micro(own, 3)[1] for own in ("j5", "j6", "j7", "j8", "k6", "m6", "n6")] == [-2, -2, -4, -6, 0, 2, 4]
    assert micro("j7", 500)[1] == -32 and micro("j5", 500)[1] == -20 and micro("k5", 500)[1] == 5
    assert [micro(f"k{grade}", 400)[1] for grade in (3, 4, 7, 8)] == [0, 4, 4, 0]


def test_limits_of_whole_classes_are_those_of_the_second_part_of_the_standard():
    for name, text in PUBLISHED["limits"].items():
        for end, pair in zip(SIZES[1:], text.split()):
            for size in (end, end - F(1, 1000)):
                assert micro(name, size) == tuple(map(F, pair.split("/"))), (name, end)


def test_grades_and_deviations_follow_the_formulas_of_the_standard():
    """Tolerance unit, and fundamental deviations t to zc, at the geometric mean of each range, within the rounding.

    ISO 286-1:1988, annex A; the standard rounds by steps that grow with the value.
    """
    units = dict(zip(range(5, 19), (7, 10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500), strict=True))
    for first, end in zip((1, *SIZES), SIZES):
        d = math.sqrt(first * end)
        for grade, factor in units.items():
            exact, value = factor * (0.45 * d ** (1 / 3) + 0.001 * d), float(standard_tolerance(grade, end) * 1000)
            share = 0.16 if end == 3 else 0.03 if grade <= 11 else 0.05  # coarse grades are rounded to whole tens
            assert abs(value - exact) <= max(share * exact, 0.8), (grade, end)
        for grade, (a, b) in {"01": (0.3, 0.008), "0": (0.5, 0.012), "1": (0.8, 0.02)}.items():
            value = float(standard_tolerance(grade, end) * 1000)
            assert abs(value - (a + b * d)) <= 0.24 * value, (grade, end)
    over = {"u": (7, 1.0), "v": (7, 1.25), "x": (7, 1.6), "y": (7, 2.0), "z": (7, 2.5), "za": (8, 3.15), "zb": (9, 4.0)}
    over |= {"t": (7, 0.63), "zc": (10, 5.0)}
    for first, end in pairwise(FINE[4:]):
        d = math.sqrt(first * end)
        for letter, (grade, factor) in over.items():
            if letter != "t" or end >= 30:
                exact = float(standard_tolerance(grade, end) * 1000) + factor * d
                off = abs(float(micro(letter + "9", end)[1]) / exact - 1.0)
                assert off <= (0.09 if letter == "t" else 0.025), (letter, end)


def test_shafts_a_to_g_follow_the_formulas_of_the_standard():
    """The same for the shafts a to g; those of c from 10 to 40 mm do not follow them."""
    coarse = {"d": (16, 0.44), "e": (11, 0.41), "f": (5.5, 0.41), "g": (2.5, 0.34), "h": (0, 1)}
    for letter, (factor, exponent) in coarse.items():
        for first, end in zip((1, *SIZES), SIZES):
            d, value = math.sqrt(first * end), -float(micro(letter + "9", end)[0])
            assert abs(value - factor * d**exponent) <= max(0.024 * value, 1.1), (letter, d)
    fine = {
        "a": lambda d: 265 + 1.3 * d if d <= 120 else 3.5 * d,
        "b": lambda d: 140 + 0.85 * d if d <= 160 else 1.8 * d,
        "c": lambda d: 52 * d**0.2 if d <= 40 else 95 + 0.8 * d,
    }
    edges = [end for end in FINE if end not in (14, 24)]  # these letters have one value from 10 to 18 and 18 to 30 mm
    for letter, formula in fine.items():
        for first, end in zip((1, *edges), edges):
            d, value = math.sqrt(first * end), -float(micro(letter + "9", end)[0])
            known = letter == "c" and 10 < end <= 40
            assert abs(value / formula(d) - 1) <= (0.14 if known else 0.05), (letter, end)


def test_a_fit_on_the_basis_of_the_shaft_is_that_on_the_basis_of_the_hole():
    """The special rule: H7/p6 and P7/h6 have the same clearances, above 3 mm, for every letter k to zc."""
    for size in ("4.5", 25, 40, 99, 260, 450):
        for letter in LETTERS[LETTERS.index("k") :]:
            grade = 8 if letter in "kmn" else 7
            try:
                hole, shaft = Fit.read(f"H{grade}/{letter}{grade - 1}", size), letter.upper()
            except GeometryError:
                continue
            other = Fit.read(f"{shaft}{grade}/h{grade - 1}", size)
            assert (hole.smallest_clearance, hole.largest_clearance) == (
                other.smallest_clearance, other.largest_clearance,
            ), (letter, size)  # fmt: skip


def test_fits_are_told_apart():
    expected = {"H7/g6": "clearance", "H7/h6": "clearance", "H7/k6": "transition", "H7/s6": "interference"}
    assert {name: Fit.read(name, 25).kind for name in expected} == expected
    fit = Fit.read("25 H7/g6")
    assert (fit.smallest_clearance, fit.largest_clearance) == (F(7, 1000), F(41, 1000))
    assert Fit.read("25H7/g6") == Fit.read("H7/g6", "25") == fit
    assert Fit.read("1/2 H7/g6").nominal == F(1, 2)
    assert Fit.read("12.5 JS9/h8").hole.upper * 1000 == F(43, 2)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: limit_deviations("q7", 25), "'q7' is not in the table"),
        (lambda: limit_deviations("Zc7", 25), "'Zc7' is not in the table"),
        (lambda: limit_deviations("H19", 25), "'H19' is not in the table"),
        (lambda: limit_deviations(7, 25), "7 is not in the table"),
        (lambda: limit_deviations("H7", 0), "0 mm is outside"),
        (lambda: limit_deviations("H7", "500.001"), "outside the table"),
        (lambda: limit_deviations("H7", "wide"), "'wide' is no number"),
        (lambda: limit_deviations("H7", math.nan), "nan is no number"),
        (lambda: limit_deviations("K9", 25), "K9 is not standardised at 25 mm"),
        (lambda: limit_deviations("P2", 25), "P2 is not standardised at 25 mm"),
        (lambda: limit_deviations("a11", 1), "a11 is not standardised at 1 mm"),
        (lambda: limit_deviations("N9", 1), "N9 is not standardised at 1 mm"),
        (lambda: limit_deviations("j8", 25), "j8 is not standardised at 25 mm"),
        (lambda: standard_tolerance(14, 1), "IT14 is not standardised up to 1 mm"),
        (lambda: standard_tolerance(19, 25), "IT19 does not exist"),
        (lambda: Fit.read("H7/g6"), "no nominal size"),
        (lambda: Fit.read("25 H7/g6", 25), "give it once"),
        (lambda: Fit.read("H7-g6", 25), "'H7-g6' is not in the table"),
    ],
)
def test_what_is_not_in_the_standard_is_refused(call, message):
    with pytest.raises(GeometryError, match=message):
        call()


def test_bearings_with_transition_and_interference_fits_are_not_called_free():
    box = ToleranceBox(alpha="0.02")
    found = {one.fit.name: one.verdict.name for one in assess_fits(box, fits=("H7/p6", "H7/k6", "D9/h9", "G7/h6"))}
    assert found == {
        "H7/p6": "CANNOT_ASSEMBLE", "H7/k6": "CERTIFIED_JAMMED_FOR_SOME", "D9/h9": "CERTIFIED_FREE",
        "G7/h6": "CERTIFIED_JAMMED",
    }  # fmt: skip
