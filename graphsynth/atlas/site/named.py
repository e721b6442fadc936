"""Names of chains and of the mechanisms that are built of them, with what they are for and where they are told of."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Any

from graphsynth.atlas.site.families import script


def named() -> list[dict[str, Any]]:
    """Return the entries of ``names.toml``: key, name, uses, source; a template of the workbench, sliders, frame."""
    text = files("graphsynth.atlas.site").joinpath("names.toml").read_text("utf-8")
    entries: list[dict[str, Any]] = tomllib.loads(text)["named"]
    return entries


def named_script() -> str:
    """Write the names for the page."""
    return script("takeNames", named())
