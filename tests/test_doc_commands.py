"""The command lines, tables and files that the documentation shows: they parse, run, and print what is shown."""

import argparse
import importlib.util
import json
import math
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

from graphsynth.cli import main


def of_docs(name):
    """Import a module of the documentation's folder."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parents[1] / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TEXT = of_docs("pages")
ROOT, PAGES, name_of, fences = TEXT.ROOT, TEXT.PAGES, TEXT.name_of, TEXT.fences

#: Languages of blocks, and what checks them.
CHECKED = {
    "python": "test_docs.py runs it",
    "console": "run below, and what it shows is compared",
    "sh": "graphsynth's own commands are run below; those of other programs are not",
    "toml": "read below",
    "text": "a synopsis, a report or a formula: nothing to run",
    "": "a command, run below; or a formula, a drawing, a session that test_docs.py runs",
    "{include} ../CHANGELOG.md": "the site's own copy of the changelog",
}

#: Commands that no test of this file runs, and why.
NOT_RUN = {
    r"run |accuracy |stress": "the scenes, methods and cases have tests of their own: tests/pipeline, accuracy, stress",
    r"(enumerate|build) --links 16|--links (18|20)": "much disk or many hours; fewer in tests/synthesis, atlas",
    r"\$|part-": "jobs of a batch system; shards in tests/synthesis, atlas",
    r"--scheduler|sixteen": "needs a cluster; tests/atlas starts one",
    r"--mobility 2\.\.4|verify chains.sqlite$": "minutes; tests/atlas verify every chain of the shipped catalogue",
    r"catalog site": "tests/atlas",
    r"^design my_": "the tasks shown are those of the shipped scenes, which are run",
}
SLOW = r"catalog |animate|worked-example|^design |graphsynth-out"
#: Commands that need an optional package, and which one.
NEEDS = {r"\.dxf\b|--form (dxf|stl)": "ezdxf", r"parquet": "pyarrow", r"dataset": "duckdb"}


def commands():
    """Yield (page, words after ``graphsynth``, lines shown below the command)."""
    for page in PAGES:
        for language, body, _ in fences(page):
            if language not in ("", "sh", "bash", "console"):
                continue
            shown = None
            for line in body.replace("\\\n", " ").splitlines():
                if not re.match(r"(\$ )?graphsynth ", line):
                    if shown is not None and language == "console":
                        shown.append(line)
                    continue
                words = shlex.split(line.removeprefix("$ ").partition(" $(")[0], comments=True)[1:]
                # a synopsis is not a command
                if not words or any(word.isupper() or word in ("...", "|") or "[" in word for word in words):
                    continue
                said = re.search(r"# (\d+)\b", line)
                shown = [said[1]] if said else []
                yield page, words, shown


def title(page, words):
    return f"{name_of(page)}: {' '.join(words)}"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_block_is_of_a_kind_that_is_checked(page):
    assert {language for language, _, _ in fences(page)} - set(CHECKED) == set()


@pytest.mark.parametrize("words", [pytest.param(words, id=title(page, words)) for page, words, _ in commands()])
def test_documented_commands_parse(words):
    from graphsynth.cli.options import command_line

    options = command_line().parse_args([re.sub(r"\$\{?\w+\}?", "1", word) for word in words])
    assert options.verb == words[0]


def runnable(slow):
    """Yield the commands of each page that has any; the slow ones need what the fast ones wrote."""
    pages = {}
    for page, words, shown in commands():
        line = " ".join(words)
        reason = next((why for pattern, why in NOT_RUN.items() if re.search(pattern, line)), None)
        if reason:
            assert not shown, f"{name_of(page)}: an output is shown that nothing compares: {line}"
            continue
        is_slow = bool(re.search(SLOW, line))
        pages.setdefault(page, []).append((words, shown, is_slow))
    for page, found in pages.items():
        if slow and any(is_slow for *_, is_slow in found):
            yield pytest.param([entry[:2] for entry in found], id=name_of(page))
        elif not slow and any(not is_slow for *_, is_slow in found):
            yield pytest.param([entry[:2] for entry in found if not entry[2]], id=name_of(page))


def has(package):
    return importlib.util.find_spec(package) is not None


def run_commands(lines, folder, capsys, monkeypatch):
    (folder / "catalog").symlink_to(ROOT / "catalog")  # some commands name files of a checkout
    monkeypatch.chdir(folder)
    for words, shown in lines:
        if missing := [
            name for pattern, name in NEEDS.items() if re.search(pattern, " ".join(words)) and not has(name)
        ]:
            pytest.skip(f"'graphsynth {' '.join(words)}' needs {missing[0]}; what stands before it was run")
        assert main(words) == 0, words
        said = iter([line.split() for line in capsys.readouterr().out.splitlines()])
        missing = [line for line in shown if line.strip() not in ("", "...") and line.split() not in said]
        assert missing == [], words  # shown lines are printed, in this order


@pytest.mark.long
@pytest.mark.parametrize("lines", list(runnable(slow=False)))
def test_documented_commands_run(lines, tmp_path, capsys, monkeypatch):
    run_commands(lines, tmp_path, capsys, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("lines", list(runnable(slow=True)))
def test_slow_documented_commands_run(lines, tmp_path, capsys, monkeypatch):
    run_commands(lines, tmp_path, capsys, monkeypatch)


def merged(tables, more):
    """Tables with those of a fragment laid over them."""
    both = dict(tables)
    for key, value in more.items():
        both[key] = merged(both[key], value) if isinstance(value, dict) and isinstance(both.get(key), dict) else value
    return both


def reads(tables):
    from graphsynth.core.errors import GraphsynthError
    from graphsynth.pipeline.scene import Scene

    try:
        return Scene.from_mapping(tables)
    except GraphsynthError:
        return None


def tables_of_scenes():
    return [tomllib.loads(path.read_text("utf-8")) for path in sorted((ROOT / "catalog" / "scenes").glob("*.toml"))]


def toml_blocks():
    for page in PAGES:
        for language, body, line in fences(page):
            if language == "toml":
                yield pytest.param(body, id=f"{name_of(page)}:{line}")


@pytest.mark.parametrize("body", list(toml_blocks()))
def test_tables_of_scenes_and_questions_are_read(body, tmp_path, capsys):
    tables = tomllib.loads(body)
    if tables.get("mechanism", {}).get("module") == "pendulum" or "my_package" in str(tables.get("use")):
        return  # of the package that the page makes: tests/pipeline/test_third_party.py installs it and runs this
    if "scene" in tables:  # a whole scene
        assert reads(tables) is not None
    elif {"mechanism", "outputs"} & set(tables):  # part of one: it fits a shipped scene
        assert any(reads(merged(scene, tables)) for scene in tables_of_scenes())
    elif "project" in tables:  # how another package adds systems and stages
        groups = set(tables["project"]["entry-points"])
        code = "".join(path.read_text("utf-8") for path in (ROOT / "graphsynth" / "pipeline").rglob("*.py"))
        assert groups and all(f'announced("{group.removeprefix("graphsynth.")}")' in code for group in groups)
    elif "case" in tables:  # stress cases of one's own
        (tmp_path / "mine.toml").write_text(body, "utf-8")
        assert main(["stress", "--cases", str(tmp_path / "mine.toml")]) == 0
    elif "W" in tables:  # a structural question
        (tmp_path / "question.toml").write_text(body, "utf-8")
        assert main(["solve", "--spec", str(tmp_path / "question.toml"), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)
    else:  # ways to write a value, of a table that the page names
        assert "radius_mm" in tables
        for key in ("radius_mm", "radius"):
            scene = next(scene for scene in tables_of_scenes() if scene["scene"]["name"] == "lambda")
            scene["mechanism"]["bearing"].pop("radius_mm")
            scene["mechanism"]["bearing"][key] = tables[key]
            assert reads(scene).mechanism.bearing.radius_mm == 17.5


def test_a_wrong_table_is_seen():
    lambda_scene = next(scene for scene in tables_of_scenes() if scene["scene"]["name"] == "lambda")
    assert reads(lambda_scene) is not None
    assert reads(merged(lambda_scene, {"mechanism": {"bearing": {"clearence_mm": 1}}})) is None


@pytest.mark.long
def test_the_first_run_is_as_the_tutorial_tells(tmp_path, monkeypatch):
    """The values shown, the changed clearance, the misspelt key."""
    from graphsynth.core.errors import SceneError
    from graphsynth.pipeline.runner import execute
    from graphsynth.pipeline.scene import find_scene, load_scene

    blocks = list(fences(ROOT / "docs" / "tutorial" / "first-run.md"))
    shown, message = (body for language, body, _ in blocks if language == "text")
    opened, fewer = (tomllib.loads(body) for language, body, _ in blocks if language == "toml")
    text = find_scene("lambda").read_text("utf-8")
    scene = merged(tomllib.loads(text), fewer)

    report = execute(reads(scene))
    rows = [[cell.strip() for cell in re.split(r"  +", line)] for line in shown.splitlines()]
    values = {margin.name: margin.text for margin in report["records"][0].margins}
    spans = [(name, value) for name, value in rows if name.startswith("interval of binding")]
    assert [(name, value) for name, value in rows if (name, value) not in spans and values[name] != value] == []
    arcs = [re.findall(r"[\d.]+", value) for _, value in spans]
    # theory/jam-arcs 2
    critical = math.asin(math.sin(float(values["critical tilt"].split()[0])) / (0.4 * math.sin(1 / 30)))
    first = [math.degrees(critical), 180 - math.degrees(critical)]
    assert np.allclose([float(x) for arc in arcs for x in arc], [*first, *(180 + x for x in first)], atol=1e-6)

    after = execute(reads(merged(scene, opened)))
    assert (
        after["records"][0].verdict.startswith("free over the whole range")
        and "certified" in after["records"][0].verdict
    )

    wrong = re.sub(r"(?m)^clearance_mm = 0\.03$", "clearence_mm = 0.07", text, count=1)
    (tmp_path / "mine.toml").write_text(wrong, "utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError) as caught:
        load_scene("mine.toml")
    assert f"graphsynth: {caught.value}" == message.strip()


def verbs():
    """Yield (verb or pair of verbs, its parser)."""
    from graphsynth.cli.options import command_line

    def inside(parser, words):
        nested = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
        if words and not nested:
            yield " ".join(words), parser
        for action in nested:
            for word, child in action.choices.items():
                yield from inside(child, (*words, word))

    yield from inside(command_line(), ())


def section_of(page, verb):
    """Return the text under the heading of a verb; for two words also the text under the first one."""
    text = page.read_text(encoding="utf-8")
    sections = re.split(r"(?m)^(?=#{2,4} )", text)
    wanted = {f"`{verb}`", f"`{verb.split()[0]}`"}
    return "".join(part for part in sections if wanted & set(re.findall(r"`[^`]+`", part.partition("\n")[0])))


@pytest.mark.parametrize("verb", [verb for verb, _ in verbs()])
def test_every_option_is_documented(verb):
    page = ROOT / "docs" / "reference" / "command-line.md"
    text = page.read_text(encoding="utf-8")
    parser = dict(verbs())[verb]
    assert re.search(rf"^graphsynth {re.escape(verb)}\b", text, re.MULTILINE), "no line in the synopsis"
    section = section_of(page, verb)
    assert section, "no section of its own"
    shared = "".join(part for part in re.split(r"(?m)^(?=## )", text) if re.match(r"## (QUESTION|WORK)", part))
    if verb in ("solve", "count", "enumerate"):
        section += shared
    ranges = {f"--{letter}{k}" for letter in "np" for k in range(10)}  # `--n2 X` .. `--n9 X`
    options = {option for action in parser._actions for option in action.option_strings} - ranges - {"-h", "--help"}
    known = set(re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", section)) | {"--json"}  # every verb has it, says the top
    assert options - known == set()


def test_documented_options_exist():
    text = (ROOT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
    options = {option for _, parser in verbs() for action in parser._actions for option in action.option_strings}
    assert set(re.findall(r"`(--[a-z][\w-]*)", text)) - options - {"--version"} == set()
