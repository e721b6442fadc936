"""Colours by name, for light and dark pages: hues of the Okabe-Ito palette, told apart by colour-blind readers too."""

from __future__ import annotations

#: Every colour on a light page and on a dark one; names that share the first value share the second.
_PAIRS = {
    "ink": ("#1b2733", "#e6edf3"),
    "soft": ("#8794a1", "#8b98a5"),
    "note": ("#55626f", "#a5b1bd"),
    "paper": ("#ffffff", "#12181f"),
    "link": ("#1b2733", "#e6edf3"),
    "fill": ("#dbe4ee", "#2b3a49"),
    "a": ("#0072b2", "#56b4e9"),
    "b": ("#d55e00", "#f0a060"),
    "c": ("#009e73", "#3ecf9f"),
    "d": ("#aa4499", "#dd88cc"),
    "jam": ("#d55e00", "#f0a060"),
    "pale": ("#e3e7ec", "#28333e"),
    "bad": ("#aa0044", "#ff7096"),
}
#: Values on a light page, and of pictures without pages (PNG, PDF, GIF).  SVG elements carry them as plain attributes.
LIGHT = {name: light for name, (light, _) in _PAIRS.items()}
#: Values on a dark page.
DARK = {name: dark for name, (_, dark) in _PAIRS.items()}
#: White that stays white on dark pages: lines and letters on a coloured map.
WHITE = "#fefefe"
#: Colours of paths, in order of use.
TRACE_COLOURS = ("a", "c", "d", "b")
#: Rules that give every element with a light colour its dark one; nothing above it counts, for copies by `use`.
_RECOLOURED = "".join(
    f'[{what}="{light}"]{{{what}:{dark}}}'
    for light, dark in dict(_PAIRS.values()).items()
    for what in ("fill", "stroke")
)
_ON_LIGHT, _ON_DARK = (";".join(f"--{name}:{value}" for name, value in own.items()) for own in (LIGHT, DARK))
#: Rules of pictures.  The attributes alone are a right picture, on white paper, for programs that read no style
#: sheets; these rules follow readers who ask for dark pages or for reduced motion (see `graphsynth.drawing.moving`).
STYLE = (
    f"@media (prefers-color-scheme:dark){{svg.gs:root{{color-scheme:dark}}{_RECOLOURED}}}"
    "@media (prefers-reduced-motion:reduce){.gs .move{display:none}.gs .rest{display:inline}}"
)
#: Style sheet of every SVG that stands alone: its paper too, for the page it is put in (a notebook) may be of the other
#: scheme than the one the reader asks the system for.
STYLE_ALONE = STYLE + "".join(
    f"@media (prefers-color-scheme:{scheme}){{svg.gs{{background:{own['paper']}}}}}"
    for scheme, own in (("light", LIGHT), ("dark", DARK))
)
#: The same colours by name, for the style sheet of a page.
VARIABLES = f":root{{color-scheme:light dark;{_ON_LIGHT}}}@media (prefers-color-scheme:dark){{:root{{{_ON_DARK}}}}}"
