"""Results that hold for one set of dimensions: named in the row, dropped with it, told by verification."""

from __future__ import annotations

import json
import sqlite3

import pytest

from graphsynth.atlas import evaluating
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.atlas.sealing import seal
from graphsynth.atlas.stored import fingerprint, stored_mechanisms
from graphsynth.core.errors import SpecError
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism

PLACE = "1.4.4.1", 0, 2


def mechanism(chain, crank=1.0):
    """Crank-rocker on frame 0 with crank 2."""
    joints = []
    places = {(0, 2): (0.0, 0.0), (0, 3): (4.0, 0.0), (1, 2): (crank, 0.0), (1, 3): (4.0, 3.5)}
    for joint in chain.joints:
        at = places[joint.a, joint.b]
        joints.append(Revolute(joint.a, joint.b, at, at))
    return json.loads(Mechanism(chain.with_frame(0), joints, [Driver(0, 2)], pose=[(0.0, 0.0, 0.0)] * 4).to_json())


def dimensions(own):
    return Evaluation(*PLACE, "dimensions", "found", data={"mechanism": own})


def verdict(own=None, **more):
    data = more if own is None else {"dimensions": fingerprint(own), **more}
    return Evaluation(*PLACE, "jamming", "free", 0.001, "rad", "certified", data)


@pytest.fixture
def catalogue(built, tmp_path):
    with Catalogue(built(tmp_path, [4])) as made:
        yield made


def kinds(catalogue):
    return sorted(catalogue.query("evaluations")["kind"])


def test_replaced_dimensions_drop_what_was_proved_for_them(catalogue):
    chain = catalogue.chain("1.4.4.1")
    first, second = mechanism(chain), mechanism(chain, crank=1.0 + 2.0**-52)
    transmission = Evaluation(*PLACE, "transmission", "found", 0.5, "rad", "estimated")
    other = Evaluation(*PLACE, "mass", "found", 2.0, "kg", "estimated")
    # in one call, whatever the order: the results are of the dimensions beside them
    catalogue.record([verdict(first), transmission, other, dimensions(first)])
    assert kinds(catalogue) == ["dimensions", "jamming", "mass", "transmission"]
    catalogue.record([dimensions(first)])  # the same again
    assert kinds(catalogue) == ["dimensions", "jamming", "mass", "transmission"]
    catalogue.record([dimensions(second)])  # one unit in the last place
    assert kinds(catalogue) == ["dimensions", "mass"]
    catalogue.record([verdict(second)])
    catalogue.record([Evaluation(*PLACE, "dimensions", "not found", data={"seed": 1})])
    assert kinds(catalogue) == ["dimensions", "mass"]


def test_a_verdict_of_other_dimensions_is_refused(catalogue):
    chain = catalogue.chain("1.4.4.1")
    first, second = mechanism(chain), mechanism(chain, crank=1.5)
    with pytest.raises(SpecError, match="not those stored"):
        catalogue.record([verdict(first)])
    catalogue.record([dimensions(first)])
    with pytest.raises(SpecError, match="not those stored"):
        catalogue.record([verdict(second)])
    with pytest.raises(SpecError, match="not those stored"):
        catalogue.record([verdict(first), dimensions(second)])  # nothing of it is written
    assert kinds(catalogue) == ["dimensions"]
    assert json.loads(next(stored_mechanisms(catalogue.connection)).text) == first
    assert catalogue.record([verdict(first)]) == 1
    assert catalogue.record([verdict()]) == 1  # names no dimensions


def test_verification_tells_of_results_of_other_dimensions(catalogue):
    own = mechanism(catalogue.chain("1.4.4.1"))
    goals = {"min_transmission_angle": 0.1, "max_length_ratio": 10.0}
    data = {"mechanism": own, "goals": goals, "length_ratio": 4.0}
    catalogue.record([Evaluation(*PLACE, "dimensions", "found", data=data), verdict(own)])
    field = "evaluations: dimensions of jamming"
    found = catalogue.verify()
    assert found.compared[field] == 1 and not any(field in words for words in found.differences)
    with sqlite3.connect(catalogue.path) as raw:
        statement = "UPDATE evaluations SET data = replace(data, ?, ?) WHERE kind = 'jamming'"
        assert raw.execute(statement, (fingerprint(own), "0" * 32)).rowcount == 1
        raw.execute("DELETE FROM meta")
    seal(raw)
    raw.close()
    with Catalogue(catalogue.path) as again:
        assert sum(field in words and "0" * 32 in words for words in again.verify().differences) == 1


def test_what_evaluate_writes_names_its_dimensions(catalogue, monkeypatch):
    """With the search itself replaced: a verdict is asked for again when the dimensions are others."""
    chain = catalogue.chain("1.4.4.1")
    first, second = mechanism(chain), mechanism(chain, crank=1.25)
    catalogue.record([dimensions(first)])
    proved = []

    class Proof:
        verdict, reason = type("Verdict", (), {"name": "CERTIFIED_FREE"}), ""

    def proof(judged, tilt, limit):
        proved.append(json.loads(judged.to_json()))
        return Proof

    monkeypatch.setattr(evaluating, "jamming_proof", proof)
    assert catalogue.evaluate(jamming=(0.001, 0.005)) == 1
    assert catalogue.evaluate(jamming=(0.001, 0.005)) == 0
    catalogue.record([dimensions(second)])
    assert catalogue.evaluate(jamming=(0.001, 0.005)) == 1
    assert proved == [first, second]
    data = json.loads(catalogue.query("evaluations", "kind = 'jamming'")["data"][0])
    assert data["dimensions"] == fingerprint(second)


def test_of_several_the_best_transmission_comes_first(tmp_path):
    with Catalogue.build(tmp_path / "x.sqlite", [4, 6]) as six:
        row = six.query("chains", "links = 6").iloc[0]
        choices = six.query("mechanisms", "chain_id = ?", (int(row["chain_id"]),)).head(3)
        for angle, frame, driver in zip((0.3, 0.9, 0.6), choices["frame"].tolist(), choices["driver"].tolist()):
            place = row["key"], int(frame), driver
            six.record(
                [
                    Evaluation(*place, "dimensions", "found", data={"mechanism": {"word": angle}}),
                    Evaluation(*place, "transmission", "found", angle, "rad", "estimated"),
                ]
            )
        found = [json.loads(own.text)["word"] for own in stored_mechanisms(six.connection, int(row["chain_id"]))]
        assert found == [0.9, 0.6, 0.3]
        assert not list(stored_mechanisms(six.connection, 1))
