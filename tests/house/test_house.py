"""The rules of the house (docs/explanation/architecture.md), one test each.

``debts.toml`` says how much of a rule is not kept yet: it may shrink, never grow.  ``budget.toml`` is the budget of
lines and files of every room; raising it needs a decision record (docs/explanation/decisions.md).
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from . import rules

HERE = Path(__file__).parent
DEBTS = tomllib.loads((HERE / "debts.toml").read_text(encoding="utf-8"))
BUDGET = tomllib.loads((HERE / "budget.toml").read_text(encoding="utf-8"))

MODEL = '''"""See the specification, section 7.2."""
SIZE = 1  # fmt: skip


class Same:
    pass
'''
LONG = "\n".join(f"    x{k} = {k}" for k in range(90))
WRONG = {
    "core/low.py": f'PLACE = "graphsynth.cli.high:f"\n\n\nclass Same:\n    pass\n\n\ndef f():\n{LONG}\n',
    "cli/high.py": "from graphsynth.systems.swing import model\nimport graphsynth.core.low\n",
    "systems/swing/__init__.py": "",
    "systems/swing/model.py": MODEL,
    "core/kernels/fast.py": f"def slow(a, b, c, d, e, f, g, h, i, j, k, l, m):\n{LONG}\n",
    "__init__.py": "",
    "__init__.pyi": "from .core.low import Same as Same\n",
}


@pytest.mark.parametrize("rule", sorted(rules.RULES))
def test_rule(rule: str) -> None:
    found = list(rules.RULES[rule]())
    allowed = DEBTS.get(rule, 0)
    assert len(found) <= allowed, f"{rule}: {len(found)} places, {allowed} allowed:\n" + "\n".join(found)


@pytest.fixture
def wrong_house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package in which every rule is broken."""
    for name, text in WRONG.items():
        path = tmp_path / "graphsynth" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    monkeypatch.setattr(rules, "ROOT", tmp_path)
    monkeypatch.setattr(rules, "PACKAGE", tmp_path / "graphsynth")
    for remembered in (rules.modules, rules.tree, rules.imports):
        remembered.cache_clear()


@pytest.mark.usefixtures("wrong_house")
def test_every_rule_finds_what_breaks_it() -> None:
    found = {name: list(rule()) for name, rule in rules.RULES.items()}
    for remembered in (rules.modules, rules.tree, rules.imports):
        remembered.cache_clear()
    assert found == {
        "upward": ["graphsynth.core.low -> graphsynth.cli.high"],
        "circles": ["graphsynth.cli.high <-> graphsynth.core.low"],
        "systems_named_outside": ["graphsynth.cli.high names swing"],
        "many_parameters": ["graphsynth.core.kernels.fast.slow: 13"],
        "silent_kernels": ["graphsynth.core.kernels.fast.slow: 91 lines"],
        "long_functions": ["graphsynth.core.kernels.fast.slow", "graphsynth.core.low.f"],
        "unformatted": ["graphsynth.systems.swing.model"],
        "unresolved_references": ["graphsynth.systems.swing.model: specification, section 7.2"],
        "repeated_public_names": ["Same: graphsynth.core.low, graphsynth.systems.swing.model"],
    }


def test_every_room_keeps_its_budget() -> None:
    sizes = rules.sizes()
    assert set(BUDGET["rooms"]) == set(sizes)
    over = {
        name: (size, BUDGET["rooms"][name])
        for name, size in sizes.items()
        if any(own > most for own, most in zip(size, BUDGET["rooms"][name]))
    }
    assert over == {}
