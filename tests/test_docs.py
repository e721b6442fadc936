"""Every example of the documentation runs, every relative link leads somewhere, every command line parses."""

import contextlib
import doctest
import io
import re
import shlex
from pathlib import Path
from urllib.parse import unquote

import pytest

from graphsynth.cli import main

ROOT = Path(__file__).parents[1]
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md"])
FLAGS = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(?<!!)\[[^\]\n]*\]\(([^)\s]+)\)|!\[[^\]\n]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ +(.*)$", re.MULTILINE)

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


def name_of(page):
    return page.relative_to(ROOT).as_posix()


def fences(page):
    text = page.read_text(encoding="utf-8")
    for match in FENCE.finditer(text):
        yield match[1].strip(), match[2], text.count("\n", 0, match.start(2))


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


@pytest.mark.parametrize(
    "page", [page for page in PAGES if any(is_example(*fence[:2]) for fence in fences(page))], ids=name_of
)
def test_examples_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__example__"}
    exec(GIVEN.get(name_of(page), ""), namespace)
    for language, body, line in fences(page):
        if is_example(language, body):
            (run_session if ">>> " in body else run_plain)(body, page, line, namespace)


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
    assert [name_of(page) for page in PAGES if "docs" in page.parts and page not in seen] == []


def commands():
    """Yield (page, words after ``graphsynth``, the number a count is said to print or None)."""
    for page in PAGES:
        for language, body, _ in fences(page):
            if language not in ("", "sh", "bash", "console"):
                continue
            lines = body.replace("\\\n", " ").splitlines()
            for line, after in zip(lines, [*lines[1:], ""]):
                if not re.match(r"(\$ )?graphsynth ", line) or "$(" in line:
                    continue
                words = shlex.split(line.removeprefix("$ "), comments=True)[1:]
                # a synopsis is not a command
                if not words or any(word.isupper() or word in ("...", "|") or "[" in word for word in words):
                    continue
                said = re.search(r"# (\d+)\b", line) or re.fullmatch(r"(\d+)", after)
                yield page, words, int(said[1]) if said else None


def title(page, words):
    return f"{name_of(page)}: {' '.join(words)}"


@pytest.mark.parametrize("words", [pytest.param(words, id=title(page, words)) for page, words, _ in commands()])
def test_documented_commands_parse(words):
    from graphsynth.cli.main import _parser

    options = _parser().parse_args([re.sub(r"\$\{?\w+\}?", "1", word) for word in words])
    assert options.verb == words[0]


@pytest.mark.parametrize(
    ("words", "said"),
    [pytest.param(words, said, id=title(page, words)) for page, words, said in commands() if said is not None],
)
def test_documented_counts(words, said, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    assert words[0] == "count"
    assert main(words) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(said)
