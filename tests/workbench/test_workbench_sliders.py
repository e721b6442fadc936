"""Chains with prismatic joints on the workbench: addresses, dimensions that turn, looked at by the library."""

from __future__ import annotations

import json
from itertools import product

import numpy as np
import pytest

from graphsynth import Mechanism, enumerate_chains, enumerate_slider_chains
from graphsynth.mechanism.constraints import residual
from graphsynth.structure.slider_chains import SliderChain

TURNED = """const sketch = await Kernels.load("sketch"), motion = await Kernels.load("motion");
return args[0].map(([links, joints, more]) => {
  const data = Turning.found(motion, links, joints, Layout.places(sketch, links, joints).places, more);
  const engine = Engine.open(motion, data), swept = engine.fault ? null : engine.sweep(73, 0);
  const reach = swept && [swept.inputs[0], swept.inputs[72]];
  const told = [data, engine.fault && engine.fault.kind, Boolean(swept && swept.full), reach];
  engine.close();
  return told;
});"""
ADDRESS = """const app = { labels: await Kernels.load("labels") };
return args[0].map(address => {
  try { const [chain, more] = Bench.chainOfAddress(app, address); return [chain.links, more]; } catch (fault) {
    return fault instanceof Bench.Fault ? Bench.word(fault.key, fault.values) : `crash: ${fault.stack}`;
  }
});"""


def given(chain, **more):
    return [chain.links, [list(pair) for pair in chain.joints], {"sliders": [list(s) for s in chain.sliders], **more}]


def slider_key(mechanism):
    sliding = [(joint.a, joint.b) for joint in mechanism.joints if joint.kind == "P"]
    return SliderChain.from_graph(mechanism.graph.without_frame(), sliding).key


def looked_at(chains, found):
    """Compare what the page found with the library; return how many turn."""
    turned = dict.fromkeys((1, 2, 3), 0)
    for chain, (data, fault, full, reach) in zip(chains, found, strict=True):
        mechanism = Mechanism.from_json(json.dumps(data))
        assert slider_key(mechanism) == chain.key
        assert fault is None, (chain, fault)
        assert np.abs(residual(mechanism.joints, np.zeros((chain.links, 3)))).max() < 1e-9
        assert reach[1] > reach[0], chain
        if chain.mobility == 1:
            assert mechanism.simulate().closure.closed or not full, chain
        turned[len(chain.sliders)] += full
    print("chains that turn, by number of sliders:", turned, "of", len(chains))
    return sum(turned.values())


#: Chains that turn, of all: fewer may turn where each link guides another or is guided.
SIX = {1: (6, 6), 2: (13, 13), 3: (6, 10)}


@pytest.mark.long
@pytest.mark.parametrize("sliders", SIX)
def test_six_links_turn_in_the_library_where_the_page_says_so(scripts, sliders):
    chains = list(enumerate_slider_chains(6, sliders))
    turned = looked_at(chains, scripts(TURNED, [given(chain) for chain in chains], modules=("sketch", "motion")))
    assert len(chains) == SIX[sliders][1] and turned >= SIX[sliders][0]


SAMPLES = [(4, 1, 0, 1), (5, 2, 0, 1), pytest.param(8, 1, 0, 60, marks=pytest.mark.long)]
ALL = [(8, 1, part, 8) for part in range(8)] + [(7, 2, 0, 1), (6, 3, 0, 1), (8, 3, 0, 2), (8, 3, 1, 2)]


@pytest.mark.parametrize(
    ("links", "mobility", "part", "parts"), [*SAMPLES, *(pytest.param(*own, marks=pytest.mark.slow) for own in ALL)]
)
def test_every_choice_opens_and_moves(scripts, links, mobility, part, parts):
    """All that the atlas lists, or a part of them."""
    chains = [chain for count in (1, 2, 3) for chain in enumerate_slider_chains(links, count, mobility)][part::parts]
    turned = looked_at(chains, scripts(TURNED, [given(chain) for chain in chains], modules=("sketch", "motion")))
    assert turned > 0.4 * len(chains)


def test_a_crank_of_a_slider_crank_turns_and_its_slider_drives(scripts):
    """The frame and the driver that are asked for are taken; a driver that slides has a range."""
    chain = next(iter(enumerate_slider_chains(4, 1)))
    (slider,) = chain.sliders
    frame, block = slider
    (crank,) = [a + b - frame for a, b in chain.joints if frame in (a, b) and (a, b) != slider]
    asked = [given(chain, frame=frame, drivers=[link]) for link in (crank, block)]
    turning, sliding = scripts(TURNED, asked, modules=("sketch", "motion"))
    for link, (data, _, full, _) in ((crank, turning), (block, sliding)):
        mechanism = Mechanism.from_json(json.dumps(data))
        assert mechanism.graph.frame == frame
        assert [(own.base, own.link) for own in mechanism.drivers] == [(frame, link)]
        assert full == (link == crank)
    assert mechanism.joint(*slider).kind == "P"
    low, high = sliding[3]
    motion = mechanism.simulate(np.linspace(low, high, 41)[1:-1])
    assert motion.assembled.all()


def test_where_nothing_can_turn_it_is_drawn_with_the_range_that_it_reaches(scripts):
    """Of RPRP each link guides or is guided: the guide and what it guides become parallel within half a turn."""
    (chain,) = enumerate_slider_chains(4, 2)
    ((_, fault, full, (low, high)),) = scripts(TURNED, [given(chain)], modules=("sketch", "motion"))
    assert fault is None and not full and high > low


WHOLE = {
    "#k=1BAN4": {},
    "#k=1BAN4&p=0-3": {"sliders": [[0, 3]]},
    "#k=1BAN4&p=3-0,1-2": {"sliders": [[0, 3], [1, 2]]},
    "#k=1BAN4&p=0-3&f=0&d=2": {"sliders": [[0, 3]], "frame": 0, "drivers": [2]},
    "#k=1BAN4&f=0&d=2": {"frame": 0, "drivers": [2]},
    "#k=1BAN4&f=0": {"frame": 0, "drivers": None},
}
HOSTILE = [
    *("", "0", "0-", "-", "0-1", "0-0", "0-99", "0-3,", "0-3,0-3", "0-3,3-0", "0-3-1", "%30-3", "a-b", "0-3;1-2"),
    *("1e1-2", "<b>", "9" * 5000, "0-3," * 2000, "__proto__", "0--3", "\uff10-\uff13"),
]


def test_addresses_with_sliders_are_read(scripts):
    assert scripts(ADDRESS, list(WHOLE), modules=()) == [[4, more] for more in WHOLE.values()]


def test_what_an_address_cannot_mean_is_one_sentence(scripts):
    asked = [f"#k=1BAN4&p={text}" for text in HOSTILE]
    asked += [
        f"#k=1BAN4&p=0-3&{rest}" for rest in ("f=4", "d=1", "f=9&d=1", "f=0&d=1", "f=0&d=", "f=x&d=2", "f=0,1&d=2")
    ]
    asked += ["#k=", "#k=1BAN", "#k=1BAN4x&p=0-3", "#k=%00"]
    for address, told in zip(asked, scripts(ADDRESS, asked, modules=()), strict=True):
        assert isinstance(told, str) and told.endswith(".") and "\n" not in told, (address[:60], told)
        assert "crash" not in told and len(told) < 200, (address[:60], told)


def test_the_way_back_to_the_atlas_names_the_sliders(scripts):
    chains = [*enumerate_slider_chains(6, 2), next(iter(enumerate_chains(6)))]
    drawn = [
        {
            "pose": [0] * chain.links,
            "joints": [
                {"kind": "P" if (a, b) in getattr(chain, "sliders", ()) else "R", "a": a, "b": b}
                for a, b, *_ in chain.joints
            ],
        }
        for chain in chains
    ]
    keys = """const labels = await Kernels.load("labels"); return args[0].map(data => Bench.sliderKey(labels, data));"""
    assert scripts(keys, drawn) == [chain.key for chain in chains]


def test_many_sliders_at_once_are_tried_in_bounded_time(scripts):
    """All joints prismatic, or four on a link: nothing moves, and that is soon known."""
    joints = [[a, b] for a, b in product(range(4), range(4, 8)) if (b - a) % 4 != 1]
    kinds = scripts(TURNED, [[8, joints[:10], {"sliders": joints[:10]}]], modules=("sketch", "motion"))
    assert kinds[0][1] is not None
