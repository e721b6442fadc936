"""Evaluations computed by the catalogue: dimensions that turn, their transmission, verdicts; gone on with, verified."""

from __future__ import annotations

import json
import math
import signal
import sqlite3
import subprocess
import sys

import numpy as np
import pytest

from graphsynth.atlas import evaluating
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.rechecking import Turning
from graphsynth.atlas.references import Reference
from graphsynth.atlas.sealing import seal
from graphsynth.cli import main
from graphsynth.core.errors import SpecError
from graphsynth.kinematics.simulation import simulate

TILT = (0.001, 0.005)


@pytest.fixture(scope="module")
def file(built, tmp_path_factory):
    """Four and six links evaluated, eight not."""
    path = built(tmp_path_factory.mktemp("evaluated"), [4, 6, 8])
    with Catalogue(path) as catalogue:
        assert catalogue.evaluate([4, 6]) == 3
    return path


@pytest.fixture(scope="module")
def four(built, tmp_path_factory):
    """The four-bar linkage alone, with dimensions."""
    path = built(tmp_path_factory.mktemp("four"), [4])
    with Catalogue(path) as catalogue:
        assert catalogue.evaluate() == 1
    return path


@pytest.fixture(scope="module")
def judged(four):
    """The same with a verdict."""
    path = four.with_name("judged.sqlite")
    path.write_bytes(four.read_bytes())
    with Catalogue(path) as catalogue:
        assert catalogue.evaluate(jamming=TILT) == 1
        assert catalogue.evaluate(jamming=TILT) == 0
    return path


def copied(file, folder):
    path = folder / "x.sqlite"
    path.write_bytes(file.read_bytes())
    return path


@pytest.fixture
def copy(file, tmp_path):
    return copied(file, tmp_path)


def table(path):
    with Catalogue(path) as catalogue:
        return catalogue.connection.execute(
            "SELECT * FROM evaluations ORDER BY chain_id, frame, driver, kind"
        ).fetchall()


def test_every_chain_asked_for_has_dimensions_that_turn(file):
    with Catalogue(file) as catalogue:
        for label in ("1.4.4.1", "1.6.4-2.1", "1.6.4-2.2"):
            entry = catalogue.entry(label)
            found = [own for own in entry["mechanisms"] if own["evaluations"]["dimensions"] != "not computed"]
            (own,) = found
            mechanism = catalogue.mechanism(label, own["frame"], own["driver"])
            assert mechanism == catalogue.mechanism(label)
            chain = catalogue.chain(label)
            assert [joint.pair for joint in mechanism.joints] == [(joint.a, joint.b) for joint in chain.joints]
            assert (mechanism.frame, mechanism.drivers[0].link) == (own["frame"], own["driver"])
            motion = simulate(mechanism, np.linspace(0.0, math.tau, 91))
            assert motion.completed and motion.closure.closed
            known = own["evaluations"]
            assert known["dimensions"]["guarantee"] == "certified"
            assert known["transmission"]["value"] >= math.radians(25.0) - 1e-6
            assert known["dimensions"]["data"]["seed"] == 0
        assert catalogue.entry("1.8.4-4.1")["mechanisms"][0]["evaluations"]["dimensions"] == "not computed"
        with pytest.raises(SpecError, match="catalog evaluate"):
            catalogue.mechanism("1.8.4-4.1")


def test_the_transmission_angle_of_a_four_bar_in_closed_form(file):
    """Smallest angle between coupler and rocker, at the ends of the dead line of crank and frame."""
    with Catalogue(file) as catalogue:
        mechanism = catalogue.mechanism("1.4.4.1")
        stored = catalogue.query("evaluations", "kind = 'transmission' AND chain_id = 1")["value"][0]
    frame, crank = mechanism.frame, mechanism.drivers[0].link
    (rocker,) = [
        joint.a + joint.b - frame for joint in mechanism.joints if frame in joint.pair and crank not in joint.pair
    ]

    def length(link):
        ends = [j.at_a if j.a == link else j.at_b for j in mechanism.joints if link in j.pair]
        return math.dist(*ends)

    (coupler,) = set(range(4)) - {frame, crank, rocker}
    a, b, c, d = (length(link) for link in (crank, coupler, rocker, frame))
    angles = [math.acos((b * b + c * c - s * s) / (2 * b * c)) for s in (d - a, d + a)]
    exact = min(min(angle, math.pi - angle) for angle in angles)
    assert exact <= stored + 1e-12 and stored - exact < 1e-3  # the samples are half a degree apart


def test_what_is_there_is_not_evaluated_again(copy):
    before = table(copy)
    with Catalogue(copy) as catalogue:
        assert catalogue.evaluate([4, 6]) == 0
        assert catalogue.evaluate([4, 6], seed=5) == 0  # found dimensions stay
        assert table(copy) == before
        assert catalogue.evaluate([8], limit=1, mobility=[2]) == 0
        assert catalogue.evaluate([6], per_chain=2, limit=1) == 1


@pytest.mark.long
def test_without_dimensions_another_seed_searches_anew(copy, monkeypatch):
    from graphsynth.kinematics.dimensional import Goals

    searched = []
    embody = evaluating._embody
    hard = Goals(min_transmission_angle=math.radians(85.0), max_length_ratio=2.0)

    def search(graph, **options):
        searched.append(options["seed"])
        return embody(graph, goals=hard if options["seed"] < 2 else None, **options)

    monkeypatch.setattr(evaluating, "_embody", search)
    with Catalogue(copy) as catalogue:
        for seed in (0, 0, 1, 2):
            catalogue.evaluate([8], limit=1, tries=1, seed=seed)
    # seed 0 again goes on with the next chain; the others come back to the first
    assert searched == [0, 0, 1, 2]
    assert len([row for row in table(copy) if row[3] == "dimensions" and row[4] == "not found"]) == 1


@pytest.mark.long
def test_an_interrupted_evaluation_goes_on_to_the_same(copy, tmp_path):
    whole = tmp_path / "whole.sqlite"
    whole.write_bytes(copy.read_bytes())

    def stop(step):
        if step.done == 1:
            raise KeyboardInterrupt

    with Catalogue(copy) as catalogue:
        with pytest.raises(KeyboardInterrupt):
            catalogue.evaluate([8], limit=2, watch=stop)
        assert catalogue.evaluate([8], limit=1) == 1
    with Catalogue(whole) as catalogue:
        assert catalogue.evaluate([8], limit=2) == 2
    assert table(copy) == table(whole)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["whole.sqlite", "x.sqlite"]


@pytest.mark.slow
def test_a_killed_evaluation_loses_nothing_that_was_stored(copy):
    script = (
        "import os, signal, sys\nfrom graphsynth.atlas.catalogue import Catalogue\n"
        "def kill(step):\n    if step.done == 1: os.kill(os.getpid(), signal.SIGKILL)\n"
        "Catalogue(sys.argv[1]).evaluate([8], watch=kill)"
    )
    assert subprocess.run([sys.executable, "-c", script, copy], check=False).returncode == -signal.SIGKILL
    assert len([row for row in table(copy) if row[3] == "dimensions"]) == 3 + 1
    with Catalogue(copy) as catalogue:
        assert catalogue.connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert catalogue.evaluate([8], limit=1) == 1
    assert [path.name for path in copy.parent.iterdir()] == [copy.name]


@pytest.mark.parametrize(
    "given",
    [{"seed": -1}, {"tries": 0}, {"tries": 10**9}, {"jamming": (0.5, 0.005)}, {"jamming": (0.001, 0.0)},
     {"jamming": (math.nan, 0.001)}, {"per_chain": -1}, {"limit": -1}],
)  # fmt: skip
def test_settings_without_sense_are_refused(file, given):
    with Catalogue(file) as catalogue, pytest.raises(SpecError):
        catalogue.evaluate([4], **given)


def test_evaluations_are_exported_and_merged(file, tmp_path):
    with Catalogue(file) as catalogue:
        catalogue.export(tmp_path / "out", "jsonl")
    rows = [json.loads(line) for line in (tmp_path / "out" / "evaluations.jsonl").read_text().splitlines()]
    assert len(rows) == 6
    found = [json.loads(row["data"])["mechanism"]["format"] for row in rows if row["kind"] == "dimensions"]
    assert found == ["graphsynth mechanism"] * 3
    parts = [tmp_path / "1.sqlite", tmp_path / "2.sqlite"]
    for i, part in enumerate(parts, 1):
        with Catalogue.build(part, [4], shard=(i, 2)) as shard:
            shard.evaluate()
    with Catalogue.merge(tmp_path / "m.sqlite", parts) as merged:
        own = merged.export(tmp_path / "merged", "jsonl")
        assert merged.mechanism("1.4.4.1")
    assert "evaluations.jsonl" in {path.name for path in own}


# --- verification


def spoil(path, change):
    """Change the first row of dimensions of the four-bar."""
    connection = sqlite3.connect(path)
    text = connection.execute("SELECT data FROM evaluations WHERE chain_id = 1 AND kind = 'dimensions'").fetchone()[0]
    data = json.loads(text)
    change(data)
    connection.execute(
        "UPDATE evaluations SET data = ? WHERE chain_id = 1 AND kind = 'dimensions'", (json.dumps(data),)
    )
    connection.execute("DELETE FROM meta")
    connection.commit()
    seal(connection)
    connection.close()


def longer(data):
    """One coupler so long that it cannot be assembled."""
    joint = data["mechanism"]["joints"][3]
    joint["at_a"] = [10 * value for value in joint["at_a"]]


def slightly(data):
    joint = data["mechanism"]["joints"][3]
    joint["at_a"] = [1.001 * value for value in joint["at_a"]]


SPOILED = {
    "cannot turn": (longer, "dimensions turn"),
    "other transmission": (slightly, "evaluations: transmission"),
    "ratio": (lambda data: data.update(length_ratio=2.0), "length ratio"),
    "bound": (lambda data: data["goals"].update(max_length_ratio=1.5), "length ratio in bounds"),
    "no mechanism": (lambda data: data.pop("mechanism"), "cannot be checked"),
    "driver": (lambda data: data["mechanism"]["drivers"][0].update(link=3), "dimensions turn"),
    "frame": (lambda data: data["mechanism"].update(graph="C] f1"), "cannot be checked"),
}


@pytest.mark.parametrize(("change", "named"), SPOILED.values(), ids=SPOILED)
def test_wrong_dimensions_are_found(four, tmp_path, change, named):
    path = copied(four, tmp_path)
    spoil(path, change)
    with Catalogue(path) as catalogue:
        found = catalogue.verify()
    assert not found.passed and any(named in text for text in found.differences)


@pytest.mark.long
@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE evaluations SET value = value + 1e-4 WHERE kind = 'transmission'",
        "UPDATE evaluations SET unit = 'deg' WHERE kind = 'transmission'",
        pytest.param("UPDATE evaluations SET status = 'jammed' WHERE kind = 'jamming'", marks=pytest.mark.slow),
        pytest.param("UPDATE evaluations SET guarantee = NULL WHERE kind = 'jamming'", marks=pytest.mark.slow),
    ],
)
def test_wrong_values_are_found(four, judged, tmp_path, altered, statement):
    path = copied(judged if "jamming" in statement else four, tmp_path)
    with altered(path) as connection:
        assert connection.execute(statement).rowcount
    with Catalogue(path) as catalogue:
        assert not catalogue.verify().passed


@pytest.mark.long
def test_a_verdict_is_proved_again(judged):
    with Catalogue(judged) as catalogue:
        own = catalogue.entry("1.4.4.1")["mechanisms"][0]["evaluations"]["jamming"]
        found = catalogue.verify()
    assert (own["status"], own["guarantee"], own["value"]) == ("free", "certified", TILT[0])
    assert found.differences == ()
    for field in ("dimensions turn", "transmission", "turn proved", "jamming", "free in samples"):
        assert found.compared[f"evaluations: {field}"] == 1


@pytest.mark.parametrize(
    ("links", "limit"),
    [(8, 2), pytest.param(8, None, marks=pytest.mark.slow), pytest.param(10, 25, marks=pytest.mark.slow)],
)
def test_newton_and_the_engine_agree_on_larger_groups(tmp_path, links, limit):
    """Transmission by its definition on all joints at once, against the engine, for groups of four links and more."""
    with Catalogue.build(tmp_path / "x.sqlite", [links]) as catalogue:
        catalogue.evaluate(limit=limit)
        rows = catalogue.sql(
            "SELECT c.graph6, d.frame, d.driver, d.data, t.value FROM evaluations d JOIN evaluations t "
            "USING (chain_id, frame, driver) JOIN chains c USING (chain_id) "
            "WHERE d.kind = 'dimensions' AND t.kind = 'transmission'"
        ).to_dict("records")
    sizes = set()
    for row in rows:
        groups = Reference(row["graph6"], 1).members(row["frame"], (row["driver"],))
        sizes |= {len(group) for group in groups}
        turning = Turning(json.loads(row["data"])["mechanism"], row["frame"], (row["driver"],))
        assert abs(turning.transmission(turning.turn(), groups) - row["value"]) < 1e-9
    assert max(sizes) >= 4


# --- command line


def test_the_command(copy, capsys):
    command = ["catalog", "evaluate", str(copy)]
    assert main([*command, "--links", "4..6"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].split() == ["dimensions", "found", "(certified):", "3"]
    assert said[-1].startswith(f"{copy}: 0 evaluated now")
    assert main([*command, "--links", "8", "--limit", "1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    first = document["held"][0]
    assert document["evaluated"] == 1
    assert (first["kind"], first["status"], first["guarantee"], first["count"]) == (
        "dimensions",
        "found",
        "certified",
        4,
    )


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--joint-limit", "0.3"], "goes with --tilt"),
        (["--tilt", "20"], "must lie in (0, 0.1) radians"),
        (["--tilt", "nan"], "must lie in (0, 0.1) radians"),
        (["--tries", "0"], "between 1 and 1000"),
    ],
)
def test_bad_input_is_one_sentence(file, words, sentence, capsys):
    assert main(["catalog", "evaluate", str(file), *words]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and sentence in error
