"""No candidate is left out: each gets dimensions, a motion and a verdict, or a reason; a sample speaks for all."""

from __future__ import annotations

import copy
import tomllib
from collections import Counter
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError, GraphError, SceneError
from graphsynth.kinematics.dimensional import Goals, embody
from graphsynth.mechanism.joints import Gear, PinSlot, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.pipeline.planar.stages import _crank, _passes
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import OutputsTable, Scene, find_scene, load_scene
from graphsynth.pipeline.steps import threefold_symmetry
from graphsynth.pipeline.summary import facts
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.system.spec import StructuralSpec
from graphsynth.synthesis import count_mechanisms
from graphsynth.systems.platform.others import as_mechanism
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

#: A mechanism of the scene that is not the platform: three pins in slots.
OTHER = "NsaCC@oE@OH?@C?a?G_ f0 2:1-8,2-8,3-8"


def tables(name: str) -> dict[str, Any]:
    return copy.deepcopy(tomllib.loads(find_scene(name).read_text(encoding="utf-8")))


def test_the_platform_as_joints_moves_as_the_platform() -> None:
    """Two programs that share no equation: legs in closed form with given wheels, joints solved with the teeth."""
    platform = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
    turn = platform.full_turn(91)
    motion = as_mechanism(platform).simulate(np.linspace(0.0, 2.0 * np.pi, 91))
    assert motion.completed and motion.closure.closed
    moved = motion.poses[:, 14] - motion.poses[0, 14]
    at = turn.pose[:, 0] + 1j * turn.pose[:, 1]
    spin = turn.pose[:, 2] - turn.pose[0, 2]
    carried = at - np.exp(1j * spin) * at[0]  # frames of link 14 coincide with the fixed one at the start
    assert np.abs(moved[:, 0] + 1j * moved[:, 1] - carried).max() < 1e-12 * 105.0
    assert np.abs(moved[:, 2] - spin).max() < 1e-13


@pytest.fixture(scope="module")
def both() -> Any:
    scene = tables("didenko")
    scene["structure"] = {"graphs": [SingleMotorPlatform().graph().to_text(), OTHER]}
    scene["outputs"]["products"] = ["records", "ranking", "comparison", "best_pictures"]
    return execute(Scene.from_mapping(scene))


@pytest.mark.long
def test_both_are_assessed_and_ranked(both: Any) -> None:
    records = both["records"]
    assert [record.status for record in records] == ["assessed", "assessed"]
    names = [{margin.name for margin in record.margins} for record in records]
    assert {"transmission angle", "use of the clearances", "distance to singularity"} <= names[0] & names[1]
    assert sorted(both["ranking"].numbers) == [1, 2] and len(both["best_pictures"]) == 2


def test_the_platform_is_compared_with_the_other(both: Any) -> None:
    (table,) = both["comparison"]
    platform, other = ({margin.name: margin.value for margin in record.margins} for record in both["records"])
    for (name, value, better, best), larger in zip(table.rows, (True, False), strict=True):
        sign = 1.0 if larger else -1.0
        assert float(value.rstrip("°")) == pytest.approx(platform[name], rel=1e-3)
        assert int(better) == (sign * other[name] > sign * platform[name])
        assert float(best.rstrip("°")) == pytest.approx(sign * max(sign * other[name], sign * platform[name]), rel=1e-3)
        assert f"{name} {value}, {better} of 1 others" in table.findings[0].text


def test_the_platform_keeps_its_own_dimensions(both: Any) -> None:
    """They are not searched: a length ratio, which a search would give, is none of its margins."""
    assert "length ratio" not in {margin.name for margin in both["records"][0].margins}
    assert "length ratio" in {margin.name for margin in both["records"][1].margins}


def test_a_mechanism_that_moves_badly_is_told_apart_from_one_that_does_not() -> None:
    scene = tables("didenko")
    scene["structure"] = {"graphs": [OTHER]}
    scene["mechanism"]["others"]["embody"] |= {"min_transmission_deg": 89, "tries": 1, "effort": 0.1}
    scene["outputs"]["products"] = ["records"]
    (record,) = execute(Scene.from_mapping(scene))["records"]
    assert record.status == "rejected" and record.cause == "embody: moves, but the transmission angle is too small"


def test_what_cannot_move_is_told_to_be_over_constrained() -> None:
    """A truss, and a loose loop on four links that are braced twice."""
    braced = MechanismGraph(
        11, [*combinations(range(4), 2), (0, 4), *((k, k + 1) for k in range(4, 10)), (1, 10)], frame=0
    )
    scene = tables("worked_example") | {"structure": {"graphs": ["Bw f0", braced.to_text()]}}
    scene["outputs"]["products"] = ["records"]
    truss, loose = execute(Scene.from_mapping(scene))["records"]
    for record in (truss, loose):
        assert record.status == "rejected" and record.cause == "embody: over-constrained"
        assert record.reason.endswith("it moves with special dimensions, if at all")
    assert "mobility 0: nothing moves" in truss.reason
    assert loose.reason.startswith(
        "over-constrained: links 0, 1, 2, 3 form an over-constrained sub-chain of mobility -3"
    )


def test_a_rigid_part_alone_is_not_called_over_constrained() -> None:
    """A braced triangle, mobility 0, hangs on the frame by a pin in a slot: two freedoms, and no joint to drive."""
    hung = MechanismGraph(4, [(1, 2), (2, 3), (1, 3), (0, 2, 2)], frame=0)
    scene = tables("worked_example") | {"structure": {"graphs": [hung.to_text()]}}
    scene["outputs"]["products"] = ["records"]
    (record,) = execute(Scene.from_mapping(scene))["records"]
    assert record.status == "rejected" and record.cause == "embody: no driver fits it"
    assert record.reason.partition(": ")[2].startswith("links 1, 2, 3 form a rigid sub-chain")
    assert "driving 2 of its joints of mobility 1" in record.reason and "special" not in record.reason


@pytest.mark.long
def test_a_sample_speaks_for_all(tmp_path: Path) -> None:
    scene = tables("worked_example")
    scene["structure"]["generate"] = {"sample": 6, "limit": 6}
    scene["mechanism"]["embody"] |= {"tries": 1, "effort": 0.1}
    scene["outputs"]["products"] = ["records", "shares"]
    report = run(Scene.from_mapping(scene), out=tmp_path)
    (shares,) = report["shares"]
    assert "187\u202f985\u202f407" in shares.title and "6 were drawn" in shares.findings[0].text
    moving = sum(record.status == "assessed" for record in report["records"])
    assert shares.rows[0][:2] == ("moves as asked", str(moving))
    rest = Counter(record.status for record in report["records"])
    verdicts = {record.verdict for record in report["records"] if record.status == "assessed"}
    # verdicts stand below "moves as asked" where there are several
    assert sum(int(row[1]) for row in shares.rows) == 6 + moving * (len(verdicts) > 1)
    assert rest["assessed"] == moving and sum(rest.values()) == 6
    assert any(fact.text == "time per candidate" and float(fact.value.split()[0]) > 0.0 for fact in facts(report))
    low, high = (float(text) for text in shares.rows[0][2].removesuffix(" %").split(" to "))
    # Clopper and Pearson: with k of n, the chance of k or more at the lower end is 2.5 %, of k or fewer at the upper;
    # one digit behind the point is shown
    from scipy.stats import binom

    assert 0 < moving < 6
    assert binom.sf(moving - 1, 6, (low - 0.05) / 100) <= 0.025 <= binom.sf(moving - 1, 6, (low + 0.05) / 100)
    assert binom.cdf(moving, 6, (high + 0.05) / 100) <= 0.025 <= binom.cdf(moving, 6, (high - 0.05) / 100)


WHEELS = MechanismGraph(5, [(0, 1), (1, 2, 2), (0, 2), (2, 3), (3, 4), (0, 4)], frame=0)


def wheels(second: Any) -> Mechanism:
    """A driven wheel, and a four-bar behind it."""
    bars = [Revolute(0, 2, (3.0, 0.0)), Revolute(2, 3, (1.0, 0.0)), Revolute(3, 4, (4.0, 0.0), (3.0, 0.0))]
    return Mechanism(WHEELS, [Revolute(0, 1), second, *bars, Revolute(0, 4, (7.0, 0.0))], [Driver(0, 1)])


def test_a_tilt_passes_through_gears_and_slots() -> None:
    """The driven joint is in a loop with a gear only; driven behind the gear, its loop has bearings only."""
    before = wheels(Gear(1, 2, radius_a=1.2, radius_b=1.8))
    assert _passes(before) and not _passes(replace(before, drivers=(Driver(0, 2),)))
    assert not _passes(Mechanism.four_bar(2.0, 1.0, 2.5, 2.5))


def test_what_tilts_freely_has_no_largest_tilt() -> None:
    scene = tables("worked_example")
    scene["structure"] = {"graphs": [wheels(Gear(1, 2, radius_a=1.2, radius_b=1.8)).graph.to_text()]}
    scene["mechanism"]["embody"] |= {"tries": 4, "effort": 0.3, "min_transmission_deg": 5}
    scene["outputs"]["products"] = ["records"]
    (record,) = execute(Scene.from_mapping(scene))["records"]
    assert record.status == "assessed" and "none takes up the tilt" in record.verdict
    use = next(margin for margin in record.margins if margin.name == "use of the clearances")
    assert (use.value, use.guarantee) == (0.0, "exact")
    assert all(np.isfinite(margin.value) for margin in record.margins)


def test_the_unit_of_length_is_a_pivot_a_pin_or_a_wheel() -> None:
    """Never the point by which the line of a slot is given: it may lie anywhere on the line."""
    assert _crank(wheels(Gear(1, 2, radius_a=1.2, radius_b=1.8))) == 1.2
    assert _crank(wheels(PinSlot(1, 2, (0.01, 0.0), (0.5, 0.0)))) == 1.0  # a slot alone has no length
    assert _crank(wheels(PinSlot(2, 1, (0.01, 0.0), (0.5, 0.0)))) == 0.5


@pytest.mark.long
@pytest.mark.parametrize("name", ["four-link", "geared-five-link", "two-dof-seven-link"])
def test_a_question_is_run_to_verdicts(name: str, tmp_path: Path) -> None:
    """A file of a structural question is enough: all its mechanisms have a verdict, and shares are exact."""
    question = find_scene("lambda").parents[1] / "specs" / f"{name}.toml"
    scene = load_scene(question)
    every = count_mechanisms(StructuralSpec.from_toml(question))
    tables = copy.deepcopy(dict(scene.raw))
    tables["mechanism"]["embody"] |= {"tries": 1, "effort": 0.05}
    tables["mechanism"].pop("bearings")
    tables["ranking"]["objectives"].pop()
    tables["outputs"]["products"] = ["records", "shares"]
    report = run(Scene.from_mapping(tables), out=tmp_path)
    told = Counter(record.status for record in report["records"])
    assert every == sum(told.values()) == told["assessed"] + told["rejected"]
    (shares,) = report["shares"]
    assert sum(int(row[1]) for row in shares.rows) == every
    told_first = f"All {every} mechanisms were examined" if every > 1 else "There is one"
    assert shares.findings[0].text.startswith(told_first)
    assert told["assessed"] > every / 2 and f"{told['assessed']} move" in shares.findings[0].text


def test_a_question_with_more_mechanisms_is_sampled(tmp_path: Path) -> None:
    (tmp_path / "ten.toml").write_text("W = 1\nlinks = 10\n", encoding="utf-8")
    scene = load_scene(tmp_path / "ten.toml")
    assert scene.name == "ten" and scene.structure is not None
    candidates = execute(replace(scene, outputs=OutputsTable(("candidates",))))["candidates"]
    assert 150 < len(candidates) <= 200 < 1834


@pytest.mark.parametrize("text", ["W = 1\nlnks = 10\n", "W = 1.5\n", "x = 1\n"])
def test_a_wrong_question_is_told(text: str, tmp_path: Path) -> None:
    (tmp_path / "ten.toml").write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=r"ten\.toml.*structure.*question"):
        execute(load_scene(tmp_path / "ten.toml"))


def test_dimensions_keep_the_symmetry_of_the_graph() -> None:
    """At the first input a third of a rotation about the one joint that stays carries every joint into its image."""
    graph = MechanismGraph.from_text(OTHER)
    image = threefold_symmetry(graph, 2)
    assert image and all(image[image[image[link]]] == link for link in range(15))
    found = embody(graph, Goals(symmetry=image), tries=2, effort=0.1).mechanism
    assert found is not None and found.pose is not None
    places = {}
    for joint in found.joints:
        x, y, angle = found.pose[joint.a]
        places[joint.pair] = complex(x, y) + complex(*joint.at_a) * np.exp(1j * angle)
    carried = {pair: tuple(sorted(image[link] for link in pair)) for pair in places}
    (still,) = [pair for pair in places if carried[pair] == pair]
    turned = [
        (places[carried[pair]] - places[still]) / (z - places[still]) for pair, z in places.items() if pair != still
    ]
    assert np.abs(np.array(turned) - turned[0]).max() < 1e-9
    assert abs(turned[0] ** 3 - 1.0) < 1e-9 < abs(turned[0] - 1.0)
    slots = [joint.angle_a + found.pose[joint.a][2] for joint in found.joints if isinstance(joint, PinSlot)]
    turns = np.exp(2j * np.diff(slots))  # a slot has no sense
    assert len(slots) == 3 and np.abs(turns - turned[0] ** 2).max() < 1e-9


#: Two four-bars on one crank.
TWINS = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (1, 4), (4, 5), (0, 5)], frame=0)
MET = MechanismGraph(8, [(0, 1), (0, 4), (0, 5), (1, 2), (1, 3), (2, 4), (2, 6), (3, 5), (3, 7), (6, 7)], frame=0)
EXCHANGED = {(0, 1): (0, 1), (1, 2): (1, 4), (2, 3): (4, 5), (0, 3): (0, 5)}


@pytest.mark.parametrize("joints", [None, {(0, 3): "P", (0, 5): "P"}])
def test_dimensions_are_their_own_mirror_image(joints: Any) -> None:
    """At the inputs u and -u all joints, and the directions of slides, are images about one line through the pivot."""
    found = embody(TWINS, Goals(mirrored=True), joints=joints, tries=4)
    assert found.accepted and found.mechanism is not None and found.drivers == ((0, 1),)
    motion = found.mechanism.simulate(np.linspace(0.0, 2.0 * np.pi, 73))
    at = {}
    for joint in found.mechanism.joints:
        link, place = (joint.b, joint.at_b) if joint.kind == "P" else (joint.a, joint.at_a)  # on the slider
        at[joint.pair] = motion.point(link, place).position @ [1.0, 1.0j]
    pivot = at[0, 1]
    twice = ((at[1, 2] - pivot) * (at[1, 4] - pivot))[0]
    twice /= abs(twice)
    for one, other in EXCHANGED.items():
        if joints is None or one != (0, 3):
            assert np.abs((at[one] - pivot)[::-1] - twice * np.conj(at[other] - pivot)).max() < 1e-8
    if joints is not None:
        first, second = (found.mechanism.joint(0, k) for k in (3, 5))
        assert abs(np.exp(2j * (first.angle_a + second.angle_a)) - twice**2) < 1e-9  # a slide has no sense


def test_what_cannot_be_its_own_mirror_image_is_told() -> None:
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    with pytest.raises(GraphError, match="exchange places in pairs; take another graph"):
        embody(graph, Goals(mirrored=True))
    with pytest.raises(GeometryError, match="one can be given"):
        Goals(mirrored=True, symmetry=(0, 1, 2, 3))
    with pytest.raises(GeometryError, match=r"joint .* has no mirror image of its kind; let it be R"):
        embody(MET, Goals(mirrored=True), joints={(6, 7): "P"})


@pytest.mark.parametrize(("links", "count"), [(6, 1), (8, 3)])
def test_candidates_are_their_own_mirror_image(links: int, count: int) -> None:
    """A specification asks for them; the counts are those of `tests/design/task/test_mirror.py`, by brute force."""
    scene = tables("worked_example")
    scene["structure"] = {"question": {"W": 1, "links": links, "p2": 0}, "generate": {"symmetry": 2}}
    scene["mechanism"]["embody"] = {"symmetric": True, "tries": 1, "effort": 0.05}
    scene["outputs"]["products"] = ["candidates"]
    candidates = execute(Scene.from_mapping(scene))["candidates"]
    assert len(candidates) == count


@pytest.mark.parametrize(
    ("image", "said"),
    [((0, 1), "image of every link"), ((1, 0, 2, 3), "the frame its own"), ((0, 2, 1, 3), "same mobility")],
)
def test_what_is_no_symmetry_is_told(image: tuple[int, ...], said: str) -> None:
    with pytest.raises(GeometryError, match=said):
        embody(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0), Goals(symmetry=image))
