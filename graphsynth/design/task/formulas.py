"""Formulas of x in files: arithmetic and a few functions, nothing else; not Python's ``eval``."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError

Array = NDArray[np.float64]
_FUNCTIONS: dict[str, Any] = {
    name: getattr(np, name)
    for name in ("sin", "cos", "tan", "sqrt", "exp", "log", "log10", "arctan", "sinh", "cosh", "tanh")
}
_OPERATORS: dict[type, Any] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.USub: np.negative,
    ast.UAdd: np.positive,
}
_LONGEST = 200


def formula(text: str) -> Callable[[Array], Array]:
    """Return the function of x that a text names; a `GeometryError` if it holds anything else.

    >>> formula("2*x**2 - log10(x) + pi")(np.array([1.0])).round(6).tolist()
    [5.141593]
    """
    try:
        tree = ast.parse(text if len(text) <= _LONGEST else "", mode="eval").body
        _value(tree, np.ones(1))
    except (SyntaxError, KeyError, TypeError, ValueError, RecursionError) as error:
        known = ", ".join(_FUNCTIONS)
        raise GeometryError(f"formula = {text[:60]!r} is none; write x, numbers, pi, + - * / ** and {known}") from error

    def function(x: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(_value(tree, np.asarray(x, dtype=np.float64)) + 0.0 * x)

    return function


def _value(node: ast.AST, x: Array) -> Any:
    with np.errstate(all="ignore"):
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and node.value is not True:
            return float(node.value)
        if isinstance(node, ast.Name):
            return {"x": x, "pi": np.pi}[node.id]
        if isinstance(node, ast.BinOp):
            return _OPERATORS[type(node.op)](_value(node.left, x), _value(node.right, x))
        if isinstance(node, ast.UnaryOp):
            return _OPERATORS[type(node.op)](_value(node.operand, x))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1 and not node.keywords:
            return _FUNCTIONS[node.func.id](_value(node.args[0], x))
    raise ValueError(node)
