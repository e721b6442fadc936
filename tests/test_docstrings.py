"""Docstrings of public names: every parameter, what is returned, and what is raised."""

import ast
import enum
import importlib.util
import inspect
import re
import textwrap
from importlib import import_module
from pathlib import Path

import pytest

SECTION = re.compile(r"(?m)^([A-Z][A-Za-z ]+)\n-{3,}$")


def of_docs(name):
    """Import a module of the documentation's folder."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parents[1] / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


API = of_docs("public_api")


def sections(thing):
    """Return the sections of a docstring by their titles; what precedes them under the empty title."""
    parts = SECTION.split(inspect.getdoc(thing) or "")
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2]))}


def missing_parameters(function):
    told = sections(function).get("Parameters", "")
    named = {word.strip(" *") for line in re.findall(r"(?m)^\S.*$", told) for word in line.partition(":")[0].split(",")}
    return [name for name in inspect.signature(function).parameters if name not in {*named, "self", "cls"}]


def says_what_it_returns(function):
    nothing = (None, "None", inspect.Signature.empty)
    return inspect.signature(function).return_annotation in nothing or bool(
        {"Returns", "Yields"} & set(sections(function))
    )


def unnamed_errors(function):
    """Exceptions that the function itself raises and its docstring does not name."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    calls = [node.exc for node in ast.walk(tree) if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)]
    raised = {call.func.id for call in calls if isinstance(call.func, ast.Name) and call.func.id.endswith("Error")}
    return sorted(name for name in raised if name not in (inspect.getdoc(function) or ""))


def things(room):
    module = import_module(room)
    return [(f"{room}.{name}", getattr(module, name)) for name in API.public_names(room)]


def functions(room):
    return [(name, thing) for name, thing in things(room) if inspect.isfunction(thing)]


def methods(room):
    for name, thing in things(room):
        if inspect.isclass(thing) and not issubclass(thing, enum.Enum):
            for inner, raw in vars(thing).items():
                method = getattr(raw, "__func__", raw)
                if not inner.startswith("_") and inspect.isfunction(method):
                    yield f"{name}.{inner}", method


@pytest.mark.parametrize("room", API.rooms())
def test_public_functions_say_what_they_take_and_return(room):
    assert [(name, missing) for name, function in functions(room) if (missing := missing_parameters(function))] == []
    assert [name for name, function in functions(room) if not says_what_it_returns(function)] == []


@pytest.mark.parametrize("room", API.rooms())
def test_public_functions_and_methods_name_what_they_raise(room):
    found = [*functions(room), *methods(room)]
    assert [(name, unnamed) for name, function in found if (unnamed := unnamed_errors(function))] == []


@pytest.mark.parametrize("room", API.rooms())
def test_every_public_name_and_method_is_described(room):
    described = [(name, thing) for name, thing in things(room) if inspect.isclass(thing) or inspect.isfunction(thing)]
    assert [name for name, thing in [*described, *methods(room)] if len(inspect.getdoc(thing) or "") < 5] == []


def test_gaps_are_seen():
    def wrong(mass, *, speed=0.0) -> float:
        """Energy.

        Parameters
        ----------
        mass : float
        """
        if mass < 0:
            raise ValueError(mass)
        return mass * speed**2 / 2

    assert missing_parameters(wrong) == ["speed"]
    assert not says_what_it_returns(wrong)
    assert unnamed_errors(wrong) == ["ValueError"]
