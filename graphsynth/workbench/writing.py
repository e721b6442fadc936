"""Writing the page: a folder of files, or all in one file."""

from __future__ import annotations

import json
from base64 import b64encode, urlsafe_b64encode
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.wholefiles import replacing
from graphsynth.core.wholefolders import PageFolder, put
from graphsynth.mechanism.model import Mechanism
from graphsynth.workbench.modules import names, script
from graphsynth.workbench.posing import assembled

#: Modules of kernels that the page loads at once, and those that it loads when they are asked for.
_FIRST, _LATER = ("motion", "labels"), ("chains", "sketch", "binding", "design", "proof")
_FOLDER = PageFolder("workbench-page.txt", {".": (".html", ".css", ".js")})


def write_workbench(place: str | Path, mechanism: Mechanism | None = None, *, single: bool = False) -> Path:
    """Write the workbench page, which opens from a disk and loads nothing from elsewhere.

    Parameters
    ----------
    place : str or Path
        A folder, made if it does not exist; a page that is there is replaced, anything else is refused.  Of a single
        page, the file.
    mechanism : Mechanism, optional
        What lies on the table when the page is opened, in its pose, or in one that is found.
    single : bool
        Write one file instead of a folder.

    Returns
    -------
    Path
        The page to open.

    Raises
    ------
    GraphsynthError
        If the folder holds something else, or the page cannot be written.
    GeometryError
        If the mechanism has more than 64 links, or no pose can be found.

    Examples
    --------
    >>> import tempfile
    >>> from graphsynth import Mechanism
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write_workbench(folder + "/bench", Mechanism.four_bar(4, 1, 3.5, 3))
    ...     page.name, page.stat().st_size > 0
    ('index.html', True)
    """
    place, given = Path(place), _given(mechanism)
    if single:
        if place.is_dir() or not place.parent.is_dir():
            raise GraphsynthError(f"{place} is a folder, or in none: name a file in a folder that exists")
        with replacing(place) as fresh:
            put(fresh, single_page(given))
        return place
    with _FOLDER.replaced(place) as (target, building):
        write_files(building, given)
        put(building / _FOLDER.mark, "This folder is written by 'graphsynth workbench' and replaced by it.\n")
    return target / "index.html"


def write_files(folder: Path, given: str = "", atlas: str = "") -> None:
    """Write the files of the page into a folder that exists; ``atlas`` is the address of an atlas page to lead to."""
    scripts = page_scripts(given, atlas=atlas)
    for name, text in {**scripts, **later_scripts()}.items():
        put(folder / f"{name}.js", text)
    put(folder / "style.css", page_file("style.css"))
    page = _page(
        theme='<script src="theme.js"></script>',
        style='<link rel="stylesheet" href="style.css">',
        scripts=[f'<script src="{name}.js"></script>' for name in scripts if name != "theme"],
        own="'self' file:",
        allowed="'self' file:",
    )
    put(folder / "index.html", page)


def fragment(mechanism: Mechanism) -> str:
    """Return the part of an address, from ``#`` on, with which the page opens with a mechanism in its pose.

    Raises
    ------
    GeometryError
        As `write_workbench`.
    """
    from zlib import compressobj

    packer = compressobj(9, wbits=-15)
    text = f'{{"u":"mm","m":{_compact(assembled(mechanism))}}}'
    packed = packer.compress(text.encode()) + packer.flush()
    return f"#m={urlsafe_b64encode(packed).decode().rstrip('=')}"


def single_page(given: str = "") -> str:
    """Return the whole page as one text; ``given`` is the JSON of what lies on the table."""
    scripts = page_scripts(given, whole=True)
    theme, last = scripts.pop("theme"), scripts.pop("main")
    scripts |= {**later_scripts(), "main": last}
    allowed = " ".join(_digest(text) for text in (theme, *scripts.values()))
    return _page(
        theme=f"<script>{theme}</script>",
        style=f"<style>{page_file('style.css')}</style>",
        scripts=[f"<script>{text}</script>" for text in scripts.values()],
        own="",
        allowed=allowed,
    )


def page_scripts(given: str = "", *, whole: bool = False, atlas: str = "") -> dict[str, str]:
    """Return the scripts by name, in the order in which the page loads them; ``whole``: nothing is loaded later."""
    own = [name for line in page_file("order.txt").splitlines()[1:] for name in line.split()]
    words = (f"Bench.words({_json(name)}, {_json(table)});\n" for name, table in languages().items())
    told = {"templates": templates(), "given": given, "whole": whole, "atlas": atlas}
    data = "".join(f"Bench.{name} = {_json(value)};\n" for name, value in told.items())
    return {
        "theme": page_file("theme.js"),
        "workbench": mathematics() + "".join(page_file(f"{name}.js") for name in own if name != "main"),
        "words": "".join(words),
        "given": data,
        **{f"{name}.wasm": script(name) for name in names() if name in _FIRST},
        "main": page_file("main.js"),
    }


def mathematics() -> str:
    """Return the scripts that know no page, as one function: a worker is made of its text."""
    own = page_file("order.txt").splitlines()[0].split()
    known = ", ".join(name.capitalize() for name in own)
    text = "".join(page_file(f"{name}.js") for name in own)
    return (
        f"const Mathematics = function () {{\n{text}return {{ {known} }};\n}};\nconst {{ {known} }} = Mathematics();\n"
    )


def later_scripts() -> dict[str, str]:
    """Return the scripts that the page asks for when they are needed, by name."""
    from graphsynth.workbench import chains, targets

    modules = {f"{name}.wasm": script(name) for name in names() if name in _LATER}
    return {"chains-data": chains.script(), "curves-data": targets.script(), **modules}


def languages() -> dict[str, dict[str, str]]:
    """Return the words of every language by name, English first."""
    folder = files("graphsynth.workbench").joinpath("pages", "words")
    found = [path.name.removesuffix(".json") for path in folder.iterdir() if path.name.endswith(".json")]
    found.sort(key=lambda name: (name != "en", name))
    return {name: json.loads(folder.joinpath(f"{name}.json").read_text("utf-8")) for name in found}


def templates() -> list[dict[str, str]]:
    """Return the classic mechanisms that the page offers, each with its name and its JSON."""
    from graphsynth.mechanism import gallery

    found = {
        "four_bar": Mechanism.four_bar(4.0, 1.2, 3.5, 3.0, coupler_point=(1.8, 1.4)),
        "slider_crank": Mechanism.slider_crank(1.0, 3.0),
        **{name: getattr(gallery, name)() for name in gallery.__all__},
    }
    return [{"name": name, "text": _compact(mechanism)} for name, mechanism in found.items()]


def page_file(name: str) -> str:
    """Return a file of the page."""
    return files("graphsynth.workbench").joinpath("pages", name).read_text("utf-8")


def _given(mechanism: Mechanism | None) -> str:
    if mechanism is None:
        return ""
    return _compact(assembled(mechanism))


def _compact(mechanism: Mechanism) -> str:
    from graphsynth.mechanism.files import to_dict

    return json.dumps(to_dict(mechanism), separators=(",", ":"), ensure_ascii=True, allow_nan=False)


def _json(value: object) -> str:
    """Return JSON that may stand in a script of a page, whatever it holds."""
    return json.dumps(value, ensure_ascii=True, separators=(",", ":")).replace("<", "\\u003c")


def _digest(script: str) -> str:
    return f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'"


def _page(theme: str, style: str, scripts: list[str], own: str, allowed: str) -> str:
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    page = Environment(undefined=StrictUndefined, autoescape=True, keep_trailing_newline=True)
    return page.from_string(page_file("index.html")).render(
        words=languages()["en"],
        theme=Markup(theme),
        style=Markup(style),
        scripts=Markup("\n".join(scripts)),
        own=Markup(own),
        allowed=Markup(allowed),
    )
