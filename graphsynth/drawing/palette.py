"""Colours by name, for light and dark pages: hues of the Okabe-Ito palette, told apart by colour-blind readers too."""

from __future__ import annotations

__all__ = ["DARK", "LIGHT", "STYLE", "TRACE_COLOURS"]

#: Values on a light page, and of pictures without pages (PNG, PDF, GIF).
LIGHT = {
    "ink": "#1b2733", "soft": "#8794a1", "note": "#55626f", "paper": "#ffffff", "link": "#1b2733", "fill": "#dbe4ee",
    "a": "#0072b2", "b": "#d55e00", "c": "#009e73", "d": "#aa4499", "jam": "#d55e00",
}  # fmt: skip
#: Values on a dark page.
DARK = {
    "ink": "#e6edf3", "soft": "#8b98a5", "note": "#a5b1bd", "paper": "#12181f", "link": "#e6edf3", "fill": "#2b3a49",
    "a": "#56b4e9", "b": "#f0a060", "c": "#3ecf9f", "d": "#dd88cc", "jam": "#f0883e",
}  # fmt: skip
#: Colours of paths, in order of use.
TRACE_COLOURS = ("a", "c", "d", "b")


def _variables(colours: dict[str, str]) -> str:
    return ";".join(f"--{name}:{value}" for name, value in colours.items())


#: Style sheet of every SVG: colours are variables, so that a picture follows the page it is put in.
STYLE = (
    f".gs{{{_variables(LIGHT)};font-family:system-ui,-apple-system,'Segoe UI',Roboto,sans-serif}}"
    f"@media (prefers-color-scheme:dark){{.gs{{{_variables(DARK)}}}}}"
)
