"""Sketches of chains in the page, and dimensions with which they turn: looked at by the library."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from graphsynth import Mechanism, MechanismGraph, enumerate_chains
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.kinematics.dimensional.sketch import layout
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.files import to_dict
from graphsynth.mechanism.laws import Linear, Polynomial
from graphsynth.workbench.posing import assembled
from tests.kinematics.test_page_engine import check_turns, turning
from tests.workbench.test_workbench_scripts import CASES

SHIPPED = Path(__file__).parents[2] / "catalog" / "up-to-10-links.sqlite"

LAID = """const sketch = await Kernels.load("sketch");
return args[0].map(([links, joints]) => Layout.places(sketch, links, joints));"""
TURNED = """const sketch = await Kernels.load("sketch"), motion = await Kernels.load("motion");
const places = (links, joints) => Layout.places(sketch, links, joints).places;
return args[0].map(([links, joints, more]) => Turning.found(motion, links, joints, places(links, joints), more));"""


def given(chain, more=None):
    return [chain.links, [[a, b] for a, b, _ in chain.joints], *([more] if more is not None else [])]


def side(p, q, r):
    """Which side of p-q has r: exact, in whole numbers."""
    return np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))


def check(chain, places):
    """No two sides of links cross, and every plate is convex with no joint of another link in it."""
    at = [tuple(round(2**20 * float(value)) for value in place) for place in places]
    sides = set()
    for link in range(chain.links):
        own = [k for k, joint in enumerate(chain.joints) if link in (joint.a, joint.b)]
        middle = np.mean([places[k] for k in own], axis=0)
        around = sorted(own, key=lambda k: np.arctan2(*(np.array(places[k]) - middle)[::-1]))
        sides |= {tuple(sorted(pair)) for pair in zip(around, [*around[1:], around[0]]) if pair[0] != pair[1]}
        if len(own) > 2:
            turns = {side(at[around[k - 2]], at[around[k - 1]], at[around[k]]) for k in range(len(around))}
            assert turns == {1}, (chain.key, link)
            for other in set(range(len(at))) - set(own):
                inside = {side(at[around[k - 1]], at[around[k]], at[other]) for k in range(len(around))}
                assert -1 in inside, (chain.key, link, other)
    for (p, q), (r, s) in combinations(sides, 2):
        if len({p, q, r, s}) == 4:
            apart = side(at[p], at[q], at[r]) * side(at[p], at[q], at[s])
            assert apart > 0 or side(at[r], at[s], at[p]) * side(at[r], at[s], at[q]) > 0, (chain.key, p, q, r, s)


@pytest.mark.parametrize("links", [pytest.param(8, marks=pytest.mark.long), pytest.param(10, marks=pytest.mark.slow)])
def test_sketches_have_no_crossings_where_the_library_s_have_none(scripts, links):
    chains = list(enumerate_chains(links, 1))
    laid = scripts(LAID, [given(chain) for chain in chains], modules=("sketch",))
    for chain, own in zip(chains, laid):
        assert own["planar"] == chain.is_planar
        places = np.array(own["places"])
        assert np.isfinite(places).all() and np.ptp(places, axis=0).min() > 0.1
        if chain.is_planar:
            check(chain, places)
            near = [np.hypot(*(p - q)) for p, q in combinations(places, 2)]
            ours = [np.hypot(*(p - q)) for p, q in combinations(layout(chain).positions, 2)]
            assert min(near) / max(near) > 0.5 * min(ours) / max(ours)


FEW = [(4, 1), (6, 1), (5, 2)]
MORE = [(7, 2), (8, 1), (6, 3), (8, 3)]


@pytest.mark.parametrize(
    "kinds", [pytest.param(FEW, marks=pytest.mark.long), pytest.param(MORE, marks=pytest.mark.slow)]
)
def test_what_is_put_on_the_table_turns_in_the_library_too(scripts, kinds):
    """Every chain of these kinds gets dimensions whose drivers on the frame turn fully, one after another."""
    chains = [chain for kind in kinds for chain in enumerate_chains(*kind)]
    found = scripts(TURNED, [given(chain, {}) for chain in chains], modules=("sketch", "motion"))
    for chain, data in zip(chains, found):
        mechanism = Mechanism.from_json(json.dumps(data))
        assert mechanism.graph.without_frame().key == chain.key
        count = len(mechanism.drivers)
        assert count == chain.mobility
        if chain.mobility == 1:
            assert mechanism.drivers[0].base == mechanism.graph.frame
        for driver in range(count):
            if mechanism.drivers[driver].base != mechanism.graph.frame:
                continue  # a loop of six links has two joints on its frame, and three drivers
            laws = [Linear() if k == driver else Polynomial((0.0,)) for k in range(count)]
            drivers = tuple(replace(own, law=law) for own, law in zip(mechanism.drivers, laws))
            motion = replace(mechanism, drivers=drivers).simulate(np.linspace(0.0, 2.0 * np.pi, 181))
            assert motion.assembled.all(), (chain.key, motion.reason)
            turned = np.abs(motion.poses[-1, :, :2] - motion.poses[0, :, :2]).max()
            assert turned < 1e-7 * 100, chain.key


@pytest.mark.long
@pytest.mark.parametrize("label", ["3.6.6.1", "3.8.6-2.3", "3.8.6-2.5", "3.8.6-2.6", "4.7.7.1"])
def test_where_no_drivers_on_the_frame_are_enough_some_sit_between_moving_links(scripts, label):
    """The shipped chains that have no mechanisms with all drivers on the frame, held by each link in turn."""
    with Catalogue(SHIPPED) as catalogue:
        assert catalogue.entry(label)["mechanisms"] == []
        chain = MechanismGraph.from_key(catalogue.chain(label).key)
    found = scripts(TURNED, [given(chain, {"frame": k}) for k in range(chain.links)], modules=("sketch", "motion"))
    for frame, data in enumerate(found):
        mechanism = Mechanism.from_json(json.dumps(data))
        assert mechanism.graph.frame == frame and len(mechanism.drivers) == chain.mobility
        assert {own.base for own in mechanism.drivers} > {frame}
        still = tuple(replace(own, law=Polynomial((0.0,))) for own in mechanism.drivers[1:])
        first = replace(mechanism.drivers[0], law=Linear())
        assert replace(mechanism, drivers=(first, *still)).simulate(np.linspace(0.0, 0.1, 5)).assembled.all()


@pytest.mark.long
@pytest.mark.parametrize("more", [{}, {"frame": 0}])
def test_a_chain_of_very_many_sets_of_drivers_is_laid(scripts, more):
    """A loop of 32 links with four chords: 21 drivers among 36 joints, in 5.6e9 ways."""
    joints = [*((k, (k + 1) % 32) for k in range(32)), (0, 8), (2, 14), (5, 20), (10, 26)]
    chain = MechanismGraph(32, [(min(pair), max(pair)) for pair in joints])
    (data,) = scripts(TURNED, [given(chain, more)], modules=("sketch", "motion"))
    assert len(data["drivers"]) == chain.mobility == 21


@pytest.mark.slow  # every frame and driver: two minutes a part
@pytest.mark.parametrize("part", range(10))
def test_all_chains_to_ten_links_turn_as_in_the_library(scripts, tmp_path, part):
    """Dimensions that turn for each of 249 chains; then every frame and driver with which they make a full turn."""
    chains = [chain for links in (4, 6, 8, 10) for chain in enumerate_chains(links)]
    assert len(chains) == 249
    chains, turned = chains[part::10], 0
    for data in scripts(TURNED, [given(chain, {}) for chain in chains], modules=("sketch", "motion")):
        turns = turning([Mechanism.from_json(json.dumps(data))])
        assert turns
        check_turns(tmp_path, turns)
        turned += len(turns)
    print(turned, "frames and drivers turn")
    assert turned > 4 * len(chains)


@pytest.mark.long
def test_a_frame_and_drivers_that_are_asked_for_are_taken(scripts):
    chain = MechanismGraph.from_key("1BgMw8g")
    frame = 2
    near = [joint.b if joint.a == frame else joint.a for joint in chain.joints if frame in (joint.a, joint.b)]
    asked = [given(chain, {"frame": frame, "drivers": [link]}) for link in near]
    for link, data in zip(near, scripts(TURNED, asked, modules=("sketch", "motion"))):
        mechanism = Mechanism.from_json(json.dumps(data))
        assert mechanism.graph.frame == frame
        assert [(own.base, own.link) for own in mechanism.drivers] == [(frame, link)]


RELATIVES = """const app = { labels: await Kernels.load("labels") };
const keys = all => all.map(({ links, joints }) =>
  Bench.chainKey(app.labels, { pose: Array(links), joints: joints.map(([a, b]) => ({ kind: "R", a, b })) })).sort();
return args[0].map(([links, joints]) => {
  const { smaller, larger } = Bench.relatives(app, { links, joints });
  return [keys(smaller), keys(larger)];
});"""


@pytest.mark.long
def test_relatives_are_those_of_the_catalogue(scripts):
    with Catalogue(SHIPPED) as catalogue:
        rows = catalogue.sql("SELECT key, parent_key FROM dyads JOIN chains USING (chain_id) WHERE mobility = 1")
    pairs = list(rows.itertuples(index=False, name=None))
    chains = [chain for links in (4, 6, 8) for chain in enumerate_chains(links, 1)]
    for chain, (smaller, larger) in zip(chains, scripts(RELATIVES, [given(chain) for chain in chains])):
        assert smaller == sorted(parent for key, parent in pairs if key == chain.key)
        assert larger == sorted(key for key, parent in pairs if parent == chain.key)


ASSEMBLED = """const engine = Engine.open(await Kernels.load("motion"), args[0]);
return engine.groups.map((group, k) => [group.twoModes, Assembling.found(engine, k).map(pose => Array.from(pose))]);"""


@pytest.mark.long
@pytest.mark.parametrize("name", ["four_bar", "watt_six_bar", "stephenson_six_bar", "klann"])
def test_other_assemblies_are_assemblies(scripts, name):
    """The joints close, the driver stands, and a dyad has one other assembly, which the library starts from."""
    made = assembled(CASES[name]())
    (driver,) = made.drivers
    here = np.array(made.pose)
    known = [np.array(mode.pose) for mode in made.modes()] if name != "klann" else []
    found = scripts(ASSEMBLED, to_dict(made), modules=("motion",))
    assert name == "klann" or [len(poses) for _, poses in found] == [1] * len(found)
    for two, poses in found:
        assert not two or len(poses) <= 1  # none where what follows cannot be assembled then
        for pose in poses:
            there = np.array(pose).reshape(-1, 3)
            assert not known or any(np.abs(own[:, :2] - there[:, :2]).max() < 1e-8 for own in known)
            assert np.abs(residual(made.joints, there)).max() < 1e-9 * np.abs(made.dimensions).max()
            assert np.abs(there - here).max() > 1e-3
            turned = [at[driver.link, 2] - at[driver.base, 2] for at in (here, there)]
            assert np.cos(turned[0] - turned[1]) == pytest.approx(1.0, abs=1e-12)


def test_a_drawn_cam_lifts_its_follower(scripts):
    """A roller on a block: the stroke of the library's motion is the lift."""
    data = scripts(
        """let s = Bench.empty(), p, q, pair;
        [s, p] = Bench.withPoint(s, 0, 0); [s, q] = Bench.withPoint(s, 0, 40);
        s = Bench.toggleGround(s, p); [s] = Bench.withLink(s, [q]);
        [s] = Bench.withPair(s, { kind: "P", a: "l0", b: Object.keys(s.links)[1], at: q, angle: Math.PI / 2 });
        [s, pair] = Bench.addCam(s, p, q);
        s = Bench.toggleDriver(s, "l0", s.pairs[pair].a);
        return Bench.written(s);"""
    )
    motion = Mechanism.from_json(json.dumps(data)).simulate(np.linspace(0.0, 2.0 * np.pi, 361))
    assert motion.assembled.all()
    assert np.ptp(motion.poses[:, 1, 1]) == pytest.approx(20.0, rel=1e-4)
