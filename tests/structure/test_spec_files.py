"""Structural questions from TOML, mappings and the command line; the questions shipped with the project."""

from __future__ import annotations

from pathlib import Path

import pytest
from scipy.optimize import linprog

from graphsynth import StructuralSpec
from graphsynth.core.errors import FormatError, SpecError
from graphsynth.structure.system.equations import EquationRow
from graphsynth.structure.system.solving import maximum

SHIPPED = Path(__file__).parents[2] / "catalog" / "specs"
COUNTS = {"worked-example": 5, "worked-example-n4": 1, "four-link": 1}


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_questions(path):
    spec = StructuralSpec.from_toml(path)
    solutions = spec.solve()
    assert len(solutions) == COUNTS.get(path.stem, len(solutions))
    assert StructuralSpec.from_toml(str(path)) == spec


def test_shipped_questions_are_there():
    assert set(COUNTS) <= {path.stem for path in SHIPPED.glob("*.toml")}


def test_toml_gives_the_question_back(tmp_path):
    spec = StructuralSpec(
        W=1, links=(6, 12), p2=(None, 3), n4=(1, None), levels={-1: 3, 1: (2, None)}, fractionated=True,
        max_joint_mobility=2, max_link_joints="all",
    )  # fmt: skip
    path = tmp_path / "spec.toml"
    path.write_text(spec.to_toml())
    assert StructuralSpec.from_toml(path) == spec


def test_toml_forms_of_a_range(tmp_path):
    path = tmp_path / "spec.toml"
    text = 'mobility = 1\nlinks = [4, 8]\nn4 = "0..2"\nt0 = "2.."\n'
    path.write_text(text + '[joints_by_mobility]\n2 = 3\n[levels]\n-1 = "..3"\n')
    expected = StructuralSpec(W=1, N=(4, 8), n4=(0, 2), t0=(2, None), p2=3, levels={-1: (None, 3)})
    assert StructuralSpec.from_toml(path) == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mobilty = 1", ["mobilty", "did you mean 'mobility'"]),
        ("W = 1\nlnks = 6", ["'lnks'", "did you mean 'links'"]),
        ("W = 1.0", ["'W'", "not an integer"]),
        ("W = true", ["'W'", "not an integer"]),
        ("W = nan", ["'W'", "not an integer"]),
        ('W = "one"', ["'W'", "0..2"]),
        ('W = 1\nlinks = "4"', ["'links'", "write the number without quotes: 4"]),
        ('W = "-1"', ["'W'", "without quotes: -1"]),
        ('[joints_by_mobility]\n2 = "3"', ["'joints_by_mobility'", "without quotes: 3"]),
        ('max_link_joints = "4"', ["'max_link_joints'", "without quotes: 4"]),
        ("n = -4", ["'n'", "between 1 and 9999"]),
        ("n = [4, 2]", ["'n'", "swap"]),
        ("n = 5\nN = 7", ["'N'", "given twice"]),
        ("W = 2024-01-01", ["'W'", "not an integer"]),
        ("[levels]\nlast = 3", ["'levels'", "'last'"]),
        ("W = ", [": not TOML"]),
        ("W = 1\nW = 2", [": not TOML"]),
        ("[" * 5000, [": not TOML"]),
    ],
)
def test_a_bad_file_names_the_file_the_key_and_the_remedy(tmp_path, text, words):
    path = tmp_path / "question.toml"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        StructuralSpec.from_toml(path)
    for word in ["question.toml", *words]:
        assert word in str(caught.value)


def test_a_file_that_is_not_text_or_not_there(tmp_path):
    path = tmp_path / "question.toml"
    path.write_bytes(b"W = 1\xff\xfe")
    with pytest.raises(FormatError, match="UTF-8"):
        StructuralSpec.from_toml(path)
    with pytest.raises(FormatError, match=r"none\.toml: cannot be read"):
        StructuralSpec.from_toml(tmp_path / "none.toml")
    with pytest.raises(FormatError, match="table of variables"):
        StructuralSpec.from_mapping([("W", 1)])


def test_assignments():
    spec = StructuralSpec.from_assignments(
        ["W=1", "links = 15", "n4=0..2", "p2=3", "t0=..7", "levels.-1=1", "fractionated=false", "max_link_joints=all"]
    )
    assert spec == StructuralSpec(
        W=1, N=15, n4=(0, 2), p2=3, t0=(None, 7), levels={-1: 1}, fractionated=False, max_link_joints="all"
    )


@pytest.mark.parametrize(
    "text",
    ["W", "W=", "=1", "W=1=2", "W=1.5", "W=true", "W=nan", "W=1..2..3", "W=2..1", "levels.x=1", "fractionated=yes",
     "mobilty=1", "n=99999999999999999999999999", "W=" + "9" * 5000, "levels=1", "p_i=3"],
)  # fmt: skip
def test_bad_assignments(text):
    with pytest.raises(SpecError) as caught:
        StructuralSpec.from_assignments([text])
    assert len(str(caught.value)) < 6000


def test_an_assignment_given_twice():
    assert StructuralSpec.from_assignments(["W=1", "W=1"]) == StructuralSpec(W=1)
    with pytest.raises(SpecError, match="twice"):
        StructuralSpec.from_assignments(["W=1", "W=2"])


@pytest.mark.parametrize("seed", range(60))
def test_the_exact_linear_programme_agrees_with_scipy(seed):
    import random

    random_ = random.Random(seed)
    names = ["a", "b", "c", "d"]
    domains = {name: (random_.choice([0, -3, 1]), random_.choice([None, None, 5])) for name in names}
    domains["d"] = random_.choice([(None, None), (None, 4), (0, None)])
    rows = []
    for _ in range(random_.randint(1, 4)):
        terms = tuple((name, random_.randint(-3, 4)) for name in random_.sample(names, random_.randint(1, 4)))
        side = random_.randint(-2, 8)
        rows.append(
            EquationRow("", terms, *random_.choice([(None, side), (side, None), (side, side), (side - 2, side + 2)]))
        )
    objective = {name: random_.randint(-2, 3) for name in names}
    upper, bounds = [], []
    for row in rows:
        line = [dict(row.terms).get(name, 0) for name in names]
        upper += [] if row.highest is None else [(line, row.highest)]
        upper += [] if row.lowest is None else [([-x for x in line], -row.lowest)]
    bounds = [domains[name] for name in names]
    reference = linprog(
        [-objective[name] for name in names],
        [line for line, _ in upper],
        [side for _, side in upper],
        bounds=bounds,
        method="highs",
        options={"presolve": False},
    )
    try:
        best = maximum(objective, rows, domains)
    except ValueError:
        assert reference.status == 2
        return
    if best is None:
        assert reference.status == 3
    else:
        assert reference.status == 0
        assert abs(float(best) + reference.fun) < 1e-9


def test_the_documentation_is_true():
    """The commands and the TOML of the reference page, and the contradiction of the explanation."""
    import doctest
    import tomllib

    docs = SHIPPED.parents[1] / "docs"
    page = (docs / "reference" / "structural-spec.md").read_text(encoding="utf-8")
    namespace: dict[str, object] = {}
    exec(page.split("```python\n")[1].split("```")[0].replace("print(", "str("), namespace)
    assert len(namespace["spec"].solve()) == 5
    spec = StructuralSpec.from_mapping(tomllib.loads(page.split("```toml\n")[1].split("```")[0]))
    assert spec == StructuralSpec(W=1, N=8, n4=(0, 2), p2=2, levels={-1: 3})
    assert len(StructuralSpec(W=1, links=12).solve()) == 46
    page = docs / "explanation" / "structural-system.md"
    assert doctest.testfile(str(page), module_relative=False) == (0, 2)


@pytest.mark.parametrize("module", ["spec", "assortment", "variables", "solving"])
def test_docstring_examples(module):
    import doctest
    from importlib import import_module

    result = doctest.testmod(import_module(f"graphsynth.structure.system.{module}"))
    assert result.failed == 0
    assert result.attempted > 0
