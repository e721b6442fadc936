"""The documentation is true of the code.

Every example runs, every link leads somewhere, every command line parses; every public name,
verb and option is documented.
"""

import contextlib
import doctest
import importlib.util
import inspect
import io
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote

import pytest


def of_docs(name):
    """Import a module of the documentation's folder."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parents[1] / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TEXT, API = of_docs("pages"), of_docs("public_api")
ROOT, PAGES, FENCE, name_of, fences = TEXT.ROOT, TEXT.PAGES, TEXT.FENCE, TEXT.name_of, TEXT.fences
FLAGS = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL
LINK = re.compile(r"(?<!!)\[[^\]\n]*\]\(([^)\s]+)\)|!\[[^\]\n]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ +(.*)$", re.MULTILINE)

# other tools in the README's table, for each of the benches named under it
PEERS = [
    ["geng"],
    ["pylinkage", "fsolve"],
    ["companion matrices"],
    ["codac", "IntvalPy", "python-flint"],
    ["exudyn", "MuJoCo", "scipy"],
    ["LSODA"],
]

# what an excerpt takes for granted
GIVEN = {
    "docs/reference/mechanism-graph.md": (
        "import numpy as np\n"
        "from graphsynth.structure.kernels import canon, canon_workspace\n"
        "n, layers = 3, 1\n"
        "masks = np.array([[6, 5, 3]], np.uint64)\n"
        "colours = np.zeros(3, np.int64)\n"
    ),
}


def is_example(language, body):
    return language == "python" or (language in ("", "pycon") and body.lstrip().startswith(">>> "))


def run_plain(source, page, line, namespace):
    code = compile("\n" * line + source, str(page), "exec")
    with contextlib.redirect_stdout(io.StringIO()):
        exec(code, namespace)


def run_session(source, page, line, namespace):
    test = doctest.DocTestParser().get_doctest(source, namespace, name_of(page), str(page), line)
    test.globs = namespace  # names live on in the next example of the page
    said = io.StringIO()
    results = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=said.write, clear_globs=False)
    assert results.attempted > 0
    assert results.failed == 0, said.getvalue()


def differ(one, other):
    """Whether two pictures differ by more than half a pixel in any number, or in anything else."""
    numbers = r"-?\d+(?:\.\d+)?"
    texts = [path.read_text(encoding="utf-8").strip() for path in (one, other)]
    found = [[float(value) for value in re.findall(numbers, text)] for text in texts]
    plain = [re.sub(numbers, "#", text) for text in texts]
    return plain[0] != plain[1] or max(map(abs, map(float.__sub__, *found)), default=0.0) > 0.5


#: Pages whose examples search or sweep for seconds, or repeat what tests/test_newcomer.py, atlas and testing run.
#: Pages whose examples take about a second or more.
LONG_PAGES = (
    *("closure-in-space", "probability-of-a-mechanism", "design-a-mechanism", "four-bars-through-points"),
    *("floating-piston", "design-for-poses", "find-a-curve", "gear-trains"),
)
SLOW_PAGES = (
    *("embody", "point-an-antenna", "jamming-of-any-mechanism", "the-deck-reproduced", "bearing-jamming"),
    *(
        "certificates",
        "jamming-in-space",
        "closure-in-space",
        "probability-of-a-mechanism",
        "stick-slip",
        "gallery",
        "choose-a-method",
        "intervals",
    ),
    *("README", "build-a-catalogue", "browse-the-atlas", "draw-and-animate", "property-tests"),
    *("windscreen-wiper", "excavator-bucket"),
)


def marks_of(page):
    """How long the examples of a page take."""
    return pytest.mark.slow if page.stem in SLOW_PAGES else pytest.mark.long if page.stem in LONG_PAGES else ()


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name_of(page), marks=marks_of(page))
        for page in PAGES
        if any(is_example(*fence[:2]) for fence in fences(page))
    ],
)
def test_examples_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__example__"}
    exec(GIVEN.get(name_of(page), ""), namespace)
    for language, body, line in fences(page):
        if is_example(language, body):
            (run_session if ">>> " in body else run_plain)(body, page, line, namespace)
    kept = {path.name: path for path in (ROOT / "docs" / "pictures").iterdir()}
    stale = [own.name for own in tmp_path.glob("*.svg") if own.name in kept and differ(own, kept[own.name])]
    assert stale == [], "draw the pictures anew: python docs/pictures/make.py"


def test_every_page_of_the_theory_has_a_drawing():
    pages = sorted((ROOT / "docs" / "theory").glob("*.md"))
    assert len(pages) > 20
    assert [page.name for page in pages if "](../pictures/" not in page.read_text(encoding="utf-8")] == []


def test_pictures_of_the_gallery_are_made_by_ten_lines_at_most():
    page = ROOT / "docs" / "gallery.md"
    codes = [body for language, body, _ in fences(page) if language == "python"]
    assert [body for body in codes if len(body.strip().splitlines()) > 10] == []
    shown = re.findall(r"pictures/gallery-([\w-]+)\.", page.read_text(encoding="utf-8"))
    written = re.findall(r"\"gallery-([\w-]+)\.", "".join(codes))
    loops = {"chain-0", "chain-123", "chain-229", *API.public_names("graphsynth.mechanism.gallery")}
    assert set(shown) == {*written, *loops}


def slug(heading):
    """Make an anchor of a heading, as the usual renderers do."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")


def links(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    for match in LINK.finditer(text):
        target = match[1] or match[2]
        if not re.match(r"[a-z][a-z0-9+.-]*:", target):
            yield unquote(target)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page):
    dead = []
    for target in links(page):
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or not file.is_relative_to(ROOT):
            dead.append(target)
        elif anchor and file.suffix == ".md":
            anchors = {slug(heading) for heading in HEADING.findall(FENCE.sub("", file.read_text(encoding="utf-8")))}
            if anchor not in anchors:
                dead.append(target)
    assert dead == []


def test_every_page_can_be_reached_from_the_index():
    index = ROOT / "docs" / "index.md"
    seen, stack = {index}, [index]
    while stack:
        page = stack.pop()
        for target in links(page):
            file = (page.parent / target.partition("#")[0]).resolve()
            if file.suffix == ".md" and file.exists() and file not in seen:
                seen.add(file)
                stack.append(file)
    assert [name_of(page) for page in PAGES if page.is_relative_to(ROOT / "docs") and page not in seen] == []


def test_every_page_is_in_the_navigation():
    """The site's navigation is made from the links of the index alone."""
    linked = {target.partition("#")[0] for target in links(ROOT / "docs" / "index.md")}
    pages = {page.relative_to(ROOT / "docs").as_posix() for page in (ROOT / "docs").rglob("*.md")} - {"index.md"}
    assert pages - linked == set()


def test_every_page_has_one_title():
    for page in PAGES:
        text = FENCE.sub("", page.read_text(encoding="utf-8"))
        if name_of(page) != "docs/changes.md":  # it includes the changelog
            assert len(re.findall(r"^# ", text, re.MULTILINE)) == 1, name_of(page)
            assert text.lstrip().startswith("# "), name_of(page)


def reference_text():
    return "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "reference").glob("*.md"))


def explained_names():
    """Words in code font in the reference; runnable examples alone explain nothing."""
    text = FENCE.sub("", reference_text())
    return set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]+)`", text))))


@pytest.mark.parametrize("room", API.rooms())
def test_public_names_are_explained_in_the_reference(room):
    assert set(API.public_names(room)) - explained_names() == set()


def test_every_public_name_is_shown_on_one_page_of_the_reference():
    shown = [name for names in API.shown().values() for name in names]
    assert sorted(shown) == sorted(set(shown))
    assert set(API.places()) - set(shown) == set()
    asking = [
        page for page in (ROOT / "docs" / "reference").glob("*.md") if len(API.MARK.findall(page.read_text())) > 1
    ]
    assert asking == []


def callables():
    """Public functions, classes and methods of the library by their last name."""
    found = {}
    for path in (ROOT / "graphsynth").rglob("*.py"):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if {"cli", "__main__", "kernels", "cases", "steps"} & set(parts):
            continue
        module = import_module(".".join(parts).removesuffix(".__init__"))
        for name, thing in list(vars(module).items()):
            if inspect.isfunction(thing) or (inspect.isclass(thing) and thing.__module__.startswith("graphsynth")):
                found.setdefault(name, set()).add(thing)
            if inspect.isclass(thing):
                for inner, method in vars(thing).items():
                    method = getattr(method, "__func__", method)
                    if inspect.isfunction(method):
                        found.setdefault(inner, set()).add(method)
    return found


def takes(thing, names):
    try:
        parameters = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return False
    return any(p.kind is p.VAR_KEYWORD for p in parameters) or names <= {p.name for p in parameters}


def test_documented_parameters_exist():
    """A parameter that a signature in the reference names can be given by that name."""
    known, wrong, checked = callables(), [], 0
    for page in (ROOT / "docs" / "reference").glob("*.md"):
        for code in re.findall(r"`([^`]+)`", FENCE.sub("", page.read_text(encoding="utf-8"))):
            match = re.fullmatch(r"[\w.]*?(\w+)\(([^()]*(?:\([^()]*\)[^()]*)*)\)(?: -> .*)?", code)
            if match is None or match[1] not in known or code.startswith("kernels."):
                continue
            checked += 1
            plain = re.sub(r"\([^()]*\)|\[[^\]]*\]", "", match[2])
            said = set(filter(str.isidentifier, (part.partition("=")[0].strip(" *") for part in plain.split(","))))
            if not any(takes(thing, said) for thing in known[match[1]]):
                wrong.append((page.name, code))
    assert checked > 300
    assert wrong == []


def test_dotted_names_exist():
    groups = {"graphsynth.systems", "graphsynth.stages", "graphsynth.evidence"}  # of entry points
    for page in PAGES:
        for dotted in set(re.findall(r"\bgraphsynth(?:\.\w+)+", page.read_text(encoding="utf-8"))) - groups:
            parts = dotted.split(".")
            thing, rest = import_module(parts[0]), parts[1:]
            while rest:
                if not hasattr(thing, rest[0]):
                    import_module(".".join(parts[: len(parts) - len(rest) + 1]))
                thing = getattr(thing, rest.pop(0))


def test_pictures_are_drawn_by_documented_modules():
    """Every public module of `graphsynth.drawing` that draws something is named in the reference."""
    text = reference_text()
    helpers = {"bodies", "canvas", "figures", "lettering", "moving", "pages", "palette", "shapes", "svg", "symbols"}
    drawing = {path.stem for path in (ROOT / "graphsynth" / "drawing").glob("*.py")} - {"__init__"}
    assert [name for name in sorted(drawing - helpers) if f"{name}." not in text and f"`{name}`" not in text] == []


def test_architecture_is_that_of_the_code():
    text = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    package = ROOT / "graphsynth"
    rooms = [init.parent.name for init in package.glob("*/__init__.py")]
    assert len(rooms) > 10
    assert [room for room in rooms if f"| `{room}/` |" not in text] == []
    folders = {path.name for path in package.rglob("*") if path.is_dir()} | {"catalog", "tests"}
    assert set(re.findall(r"`(\w+)/`", text)) - folders == set()
    modules = {path.relative_to(package).as_posix() for path in package.rglob("*.py")}
    named = set(re.findall(r"\b(?:\w+/)*\w+\.py\b", text))
    assert len(named) > 20
    assert [name for name in named if not any(f"/{module}".endswith(f"/{name}") for module in modules)] == []
    for kernels in re.findall(r"^(engine/)?kernels/ +(.*)$", text, re.MULTILINE):
        names = re.split(r", ", kernels[1])
        assert [name for name in names if not any(module.endswith(f"kernels/{name}.py") for module in modules)] == []


def test_notation_names_what_exists():
    text = (ROOT / "docs" / "explanation" / "notation.md").read_text(encoding="utf-8")
    words = set()
    for path in (ROOT / "graphsynth").rglob("*.py"):
        words.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    named = set(re.findall(r"[A-Za-z_]\w{2,}", " ".join(re.findall(r"`([^`]+)`", text))))
    assert len(named) > 100
    assert named - words == set()


def test_the_table_of_the_readme_is_repeated_by_benches():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    section = text.partition("## Beside other tools")[2].partition("\n## ")[0]
    benches = re.findall(r"`(test_\w+_speed\.py)`", section)
    assert len(benches) == 6
    code = [(ROOT / "tests" / "bench" / name).read_text(encoding="utf-8").lower() for name in benches]
    for peers, source in zip(PEERS, code):
        for peer in peers:
            assert peer.lower() in section.lower() and peer.lower() in source, peer


@pytest.mark.slow
def test_the_site_builds_without_warnings_and_other_sites_can_link_to_it(tmp_path):
    """The inventory is read as intersphinx reads it; every public name in it leads to its docstring."""
    inventories = pytest.importorskip("sphinx.util.inventory")
    pytest.importorskip("myst_parser")
    pytest.importorskip("furo")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-b", "html", str(ROOT / "docs"), str(tmp_path / "site")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    site = tmp_path / "site"
    inventory = inventories.InventoryFile.loads((site / "objects.inv").read_bytes(), uri="")
    kinds = [items for kind, items in inventory.data.items() if kind.startswith("py:")]
    held = {name: item for items in kinds for name, item in items.items()}
    pages = {path.relative_to(site).as_posix(): path.read_text("utf-8") for path in (site / "reference").glob("*.html")}
    for short, names in API.places().items():
        for name in names:
            page, _, anchor = held[name].uri.partition("#")
            assert anchor == short and f'id="{anchor}"' in pages[page], name
    assert "graphsynth.Motion.animate" in held
    front = (site / "index.html").read_text(encoding="utf-8")
    assert all(
        f'href="{page}.html"' in front for page in ("explanation/errata", "reference/api", "tutorial/first-mechanism")
    )


def test_every_source_stands_once():
    keys = re.findall(r"^@\w+\{(\w+),", (ROOT / "docs" / "references.bib").read_text("utf-8"), re.MULTILINE)
    assert len(keys) > 100 and sorted(keys) == sorted({*keys})


def test_every_formula_can_be_read():
    pytest.importorskip("docutils")
    read, checked = of_docs("mathml").mathml, 0
    for page in PAGES:
        text = re.sub(r"`[^`]*`", "", FENCE.sub("", page.read_text(encoding="utf-8")))
        for block, tex in re.findall(r"(\$\$|\$)(.+?)\1", text, re.DOTALL):
            read(tex.strip(), block == "$$")  # a ValueError names the formula
            checked += 1
    assert checked > 1000
