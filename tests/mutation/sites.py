"""Where a source file can be changed a little, and how: one operator, bound, sign or rounding at a time."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["Change", "changes"]

_COMPARISONS = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "=="}
_OPERATORS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.BitAnd: "|", ast.BitOr: "&",
              ast.LShift: ">>", ast.RShift: "<<", ast.FloorDiv: "*", ast.Mod: "//"}  # fmt: skip
#: Functions that round outward: the call is replaced by its first argument, or its direction is turned.
_ROUNDING = {"down", "up", "nextafter", "next_down", "next_up"}
_OPPOSITE = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "floor": "ceil", "ceil": "floor",
             "all": "any", "any": "all"}  # fmt: skip


@dataclass(frozen=True)
class Change:
    """One small change: characters ``start`` to ``end`` of the source become ``new``."""

    line: int
    function: str
    start: int
    end: int
    old: str
    new: str

    def applied(self, source: str) -> str:
        """Return the changed source."""
        return source[: self.start] + self.new + source[self.end :]


def changes(source: str) -> list[Change]:
    """Return every change of the code of functions; sentences, docstrings and annotations stay."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for function, node in _code(ast.parse(source), ""):
        for (a, b), new in _edits(node, source, starts):
            old = source[a:b]
            if old != new:
                found.append(Change(node.lineno, function, a, b, old, new))
    return sorted(set(found), key=lambda c: (c.start, c.end, c.new))


def _code(node: ast.AST, function: str) -> Iterator[tuple[str, ast.AST]]:
    """Yield the nodes inside functions, without what only makes sentences."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Raise | ast.Assert | ast.JoinedStr | ast.arguments) or _is_words(child):
            continue
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            if child.name not in ("__repr__", "__str__"):
                for part in child.body:
                    yield from _code(ast.Module([part], []), child.name)
            continue
        if isinstance(child, ast.AnnAssign):
            child = ast.Module([ast.Expr(child.value)] if child.value else [], [])
        elif function and hasattr(child, "lineno"):
            yield function, child
        yield from _code(child, function)


def _is_words(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _edits(node: ast.AST, source: str, starts: list[int]) -> Iterator[tuple[tuple[int, int], str]]:
    def at(line: int, column: int) -> int:
        text = source[starts[line - 1] : starts[line]].encode()[:column].decode()
        return starts[line - 1] + len(text)

    def span(n: ast.expr) -> tuple[int, int]:
        return at(n.lineno, n.col_offset), at(n.end_lineno or 0, n.end_col_offset or 0)

    def between(left: ast.expr, right: ast.expr, word: str) -> Iterator[tuple[tuple[int, int], str]]:
        a, b = span(left)[1], span(right)[0]
        gap = source[a:b]
        operator = gap.strip(" ()\n\\")
        if operator and "#" not in gap and gap.count(operator) == 1:
            yield (a + gap.index(operator), a + gap.index(operator) + len(operator)), word

    match node:
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
            yield from between(left, right, _COMPARISONS[type(op)])
        case ast.BinOp(left=left, op=op, right=right) if (
            type(op) in _OPERATORS and not _text(left) and not _text(right)
        ):
            yield from between(left, right, _OPERATORS[type(op)])
        case ast.BoolOp(op=op, values=[left, right]):
            yield from between(left, right, "or" if isinstance(op, ast.And) else "and")
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            yield span(node), f"({source[slice(*span(operand))]})"
        case ast.Constant(value=bool() as value):
            yield span(node), str(not value)
        case ast.Constant(value=int() as value):
            yield span(node), str(value + 1)
        case ast.Constant(value=float() as value) if value:
            yield span(node), f"(2.0 * {source[slice(*span(node))]})"
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=[first, *_]):
            if name in _ROUNDING:
                yield span(node), f"({source[slice(*span(first))]})"
            end = span(node.func)[1]
            turned = _OPPOSITE.get(name) or _turned(name)
            if turned:
                yield (end - len(name), end), turned
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            yield span(test), f"(not ({source[slice(*span(test))]}))"


def _text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _turned(name: str) -> str:
    """Name of the function that rounds the other way, if the name tells that it rounds."""
    for one, other in (("_up", "_down"), ("_down", "_up")):
        if name.endswith(one):
            return name.removesuffix(one) + other
    return {"up": "down", "down": "up"}.get(name, "")
