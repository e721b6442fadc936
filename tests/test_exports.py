"""The public names exist and are documented; importing the package is free."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import graphsynth
from graphsynth.core import errors

REFERENCE = Path(__file__).parents[1] / "docs" / "reference"


def documented_names():
    """Collect the identifiers that open a code span in the reference, or are named in full in one."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in sorted(REFERENCE.glob("*.md")))
    spans = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL))
    return {name for span in spans for name in re.findall(r"[A-Za-z_]\w*", span.split("(")[0])}


@pytest.mark.parametrize("name", [name for name in graphsynth.__all__ if name != "__version__"])
def test_public_name_resolves_and_is_documented(name):
    value = getattr(graphsynth, name)
    assert value.__name__.rpartition(".")[2] == name
    assert value.__doc__
    assert getattr(value, "__module__", value.__name__).startswith("graphsynth.")
    assert name in documented_names()


@pytest.mark.parametrize("name", errors.__all__)
def test_exception_is_documented(name):
    assert issubclass(getattr(errors, name), errors.GraphsynthError)
    page = (REFERENCE / "errors.md").read_text(encoding="utf-8")
    assert f"| `{name}` |" in page
    assert name in errors.__doc__


def test_unknown_name():
    with pytest.raises(AttributeError, match="no_such_name"):
        graphsynth.no_such_name  # noqa: B018


def test_dir_lists_the_public_names():
    assert set(graphsynth.__all__) <= set(dir(graphsynth))


def loaded_by(statement):
    """Return the top-level modules that a statement loads in a fresh process."""
    new = "sorted(set(sys.modules) - before)"
    code = f"import json, sys; before = set(sys.modules); {statement}; print(json.dumps({new}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return {name.partition(".")[0] for name in json.loads(done.stdout)}


def test_import_loads_no_third_party_package():
    assert loaded_by("import graphsynth") - set(sys.stdlib_module_names) == {"graphsynth", "lazy_loader"}


def test_solving_the_integer_system_loads_no_third_party_package():
    statement = "from graphsynth import StructuralSpec; StructuralSpec(W=1, links=8).solve()"
    assert loaded_by(statement) - set(sys.stdlib_module_names) == {"graphsynth", "lazy_loader"}


def test_the_measurement_sees_third_party_packages():
    assert "numpy" in loaded_by("import numpy")
