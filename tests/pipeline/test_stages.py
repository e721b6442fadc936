"""Backward resolution: the smallest set of stages, in order, and an error for every way it can fail."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from graphsynth.core.errors import SceneError
from graphsynth.evidence.stress import stress_cases
from graphsynth.pipeline.scene import available_scenes, load_scene
from graphsynth.pipeline.stages import build, resolve
from graphsynth.pipeline.system import Stage, system, system_names


def stage(name: str, needs: str = "", gives: str = "") -> Stage:
    return Stage(name, f"nowhere:{name}", tuple(needs.split()), tuple(gives.split()))


CHAIN = [stage("c", "x y", "z"), stage("a", "", "x"), stage("b", "x", "y"), stage("other", "z", "w")]


def test_only_what_is_needed_in_the_order_it_is_needed() -> None:
    assert [s.name for s in resolve(CHAIN, ["z"])] == ["a", "b", "c"]
    assert [s.name for s in resolve(CHAIN, ["x"])] == ["a"]
    assert [s.name for s in resolve(CHAIN, ["y", "x"])] == ["a", "b"]


def test_unknown_output_missing_giver_cycle_and_two_givers() -> None:
    with pytest.raises(SceneError, match=r"asks for 'pictres', which no stage gives; did you mean 'pictures'"):
        resolve([stage("p", "", "pictures")], ["pictres"])
    with pytest.raises(SceneError, match=r"stage 'b' needs 'x', which no stage gives"):
        resolve([stage("b", "x", "y")], ["y"])
    with pytest.raises(SceneError, match=r"stages need each other: a -> b -> a"):
        resolve([stage("a", "y", "x"), stage("b", "x", "y")], ["x"])
    with pytest.raises(SceneError, match=r"'x' is given by two stages, 'a' and 'b'"):
        resolve([stage("a", "", "x"), stage("b", "", "x")], ["x"])


@pytest.mark.long
@given(st.data())
def test_random_pipelines_are_minimal_and_ordered(data: st.DataObject) -> None:
    count = data.draw(st.integers(1, 9))
    stages = []
    for i in range(count):
        needs = data.draw(st.lists(st.integers(0, i - 1), unique=True, max_size=3)) if i else []
        stages.append(Stage(f"s{i}", "m:f", tuple(f"p{n}" for n in needs), (f"p{i}",)))
    wanted = data.draw(st.lists(st.sampled_from([s.gives[0] for s in stages]), min_size=1, unique=True))
    chosen = resolve(data.draw(st.permutations(stages)), wanted)
    have: set[str] = set()
    for s in chosen:
        assert set(s.needs) <= have
        have |= set(s.gives)
    # Minimal: the closure of the wanted products under needs, found by an independent sweep.
    closure = set(wanted)
    for s in reversed(stages):
        if s.gives[0] in closure:
            closure |= set(s.needs)
    assert have == closure


@pytest.mark.parametrize("name", available_scenes())
def test_every_stage_of_a_shipped_scene_can_be_loaded_and_resolved(name: str) -> None:
    stages = load_scene(name).stages()
    products = [product for s in stages for product in s.gives]
    assert {s.name for s in resolve(stages, products)} == {s.name for s in stages}
    assert all(callable(s.load()) for s in stages)
    assert all(a.name != b.name for a, b in pairwise(sorted(stages, key=lambda s: s.name)))


@pytest.mark.parametrize(
    "function", ["graphsynth.nowhere:f", "graphsynth.core.errors:nothing", "graphsynth", ":f", "a:"]
)
def test_a_function_that_cannot_be_imported_is_named(function: str) -> None:
    with pytest.raises(SceneError, match=r"stage 's' names"):
        Stage("s", function, (), ("x",)).load()


def test_the_stress_cases_of_every_system_exist() -> None:
    named = [case for name in system_names() for case in system(name).cases]
    assert len(named) > 20
    for case in named:
        assert stress_cases([case])


ONE = {
    "lambda": "LambdaLinkage", "didenko": "SingleMotorPlatform", "antenna": "PointingMechanism",
    "tribometer": "Tribometer", "braider": "Braider",
}  # fmt: skip


@pytest.mark.parametrize("name", available_scenes())
def test_the_system_of_a_scene_builds_its_mechanism_or_says_that_there_are_many(name: str) -> None:
    scene = load_scene(name)
    if name in ONE:
        assert type(build(scene)).__name__ == ONE[name]
        return
    with pytest.raises(SceneError, match=f"has many mechanisms, not one: module = '{scene.mechanism.module}'"):
        build(scene)


def test_what_cannot_be_built_is_an_error_of_the_scene() -> None:
    scene = load_scene("didenko")
    broken = replace(scene, mechanism=replace(scene.mechanism, rocker=1e70))
    with pytest.raises(SceneError, match=r"mechanism\] cannot be built: .*1e\+70"):
        build(broken)
