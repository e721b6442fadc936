"""Rigorous intervals: arithmetic with outward rounding, proofs of roots, certified pavings.

Names are resolved on first use.  Importing the package checks that the processor rounds to nearest and keeps
subnormal numbers; every public solve checks it again.
"""

from __future__ import annotations

from typing import Any

from graphsynth.intervals.guard import check_rounding
from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "CellPaving": "cells",
    "Decoration": "interval",
    "Dual": "dual",
    "Image": "proving",
    "Interval": "interval",
    "KrawczykResult": "proving",
    "LinearResult": "linear",
    "Paving": "boxes",
    "Progress": "boxes",
    "Search": "paving",
    "Status": "status",
    "acos": "functions",
    "asin": "functions",
    "atan": "functions",
    "atan2": "functions",
    "compiled_system": "compiled",
    "cos": "functions",
    "divide_extended": "functions",
    "exp": "functions",
    "gauss_seidel": "linear",
    "hypot": "functions",
    "image": "proving",
    "jacobian": "dual",
    "krawczyk": "proving",
    "log": "functions",
    "maximum": "functions",
    "minimum": "functions",
    "pave": "paving",
    "pave_cells": "cells",
    "pave_compiled": "compiled",
    "pi": "functions",
    "sin": "functions",
    "solve_linear": "linear",
    "sqr": "functions",
    "sqrt": "functions",
    "tan": "functions",
    "variables": "dual",
}

__all__ = ["check_rounding", *sorted(_PUBLIC)]


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)


check_rounding()
