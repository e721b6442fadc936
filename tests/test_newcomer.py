"""Six tasks of somebody who is new here, each at most ten lines; the README shows the same lines."""

import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
TASKS = {
    "move my own linkage": ("motion.html", r"closed after one pass"),
    "list the chains of eight links": ("chain.svg", r"chains of 8 links"),
    "find a four-bar through points": ("path.svg", r"accepted after .* search"),
    "design one and cut its parts": ("parts/parts.svg", r"2 mechanisms do the task(.|\n)*certified: nothing collides"),
    "see whether it binds": (None, r"CERTIFIED_FREE\nProved: nothing binds over the whole range"),
    "read the forces": (None, r"joint 1-2 +force up to"),
}
SEARCHES = ("find a four-bar through points", "design one and cut its parts")


def code_of(task):
    """Return the example of the README under the heading of a task."""
    section = README.partition(f"### {task.capitalize()}")[2]
    found = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    assert found, f"the README has no example under {task!r}"
    return found[1]


@pytest.mark.parametrize("task", [pytest.param(t, marks=pytest.mark.long) if t in SEARCHES else t for t in TASKS])
def test_ten_lines_suffice_in_a_fresh_process(task, tmp_path):
    code = code_of(task)
    assert len(code.strip().splitlines()) <= 10
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    file, said = TASKS[task]
    assert re.search(said, done.stdout), done.stdout
    assert all(len(line) <= 120 for line in done.stdout.splitlines())
    if file:
        text = (tmp_path / file).read_text(encoding="utf-8")
        assert "<svg" in text and "nan" not in text


def test_main_objects_print_at_most_ten_lines_and_show_themselves():
    import graphsynth as gs
    from graphsynth.jamming import ToleranceBox, certify_jamming
    from graphsynth.pipeline.products import Table

    linkage = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(5, 0))
    motion = linkage.simulate()
    found = gs.embody(gs.enumerate_chains(4)[0])
    report = gs.assess_jamming(gs.LambdaLinkage(alpha=1 / 30))
    coupled = motion.assess_jamming(tilt="0.5 deg", joints="1 deg")
    assert re.search(r"at most, at input [0-9.]+ rad$", repr(coupled), re.MULTILINE)
    table = Table("a title", ("a", "b"), (("1", "2"),) * 20)
    shown = [linkage, motion, found, report, coupled, motion.forces({"P": (0, -1)}), gs.enumerate_chains(6)]
    shown += [table, certify_jamming(ToleranceBox())]
    for thing in shown:
        lines = repr(thing).splitlines()
        assert 1 <= len(lines) <= 10 and all(len(line) <= 120 for line in lines)
        assert re.match("<(figure|p)>", thing._repr_html_())
    for thing in (linkage, motion, found):
        assert "<svg" in thing._repr_html_()
    assert "<animate" in motion._repr_html_()
    for thing in (linkage.graph, linkage.draw(), motion.animate(), motion.plot()):
        assert len(repr(thing).splitlines()) == 1 and thing._repr_svg_().startswith("<svg")


def test_jamming_takes_angles_for_all_joints_and_the_driven_axis():
    import graphsynth as gs

    motion = gs.Mechanism.four_bar(2, 1, 2.5, 2.5).simulate("0..90 deg")
    short = motion.assess_jamming(tilt="0.01 rad", joints=0.02, certify=False)
    tilt = gs.Misalignment(0, 1, 0.01)
    full = gs.assess_jamming(motion, tilt=tilt, joints=gs.JointLimits(0.02), certify=False)
    assert short.worst_factor == full.worst_factor
    assert short.misalignments == (tilt,)
    wide = motion.assess_jamming(tilt=tilt, joints="1 deg", certify=False)
    assert wide.limits[1].tilt == pytest.approx(math.radians(1))


@pytest.mark.parametrize("suffix", [".html", ".svg", ".gif"])
def test_motions_are_written_as_their_suffix_says(suffix, tmp_path):
    import graphsynth as gs

    path = tmp_path / f"motion{suffix}"
    gs.Mechanism.slider_crank(1, 3).simulate("0..360 deg").animate(path, frames=8)
    assert path.stat().st_size > 3000
    with pytest.raises(gs.GraphsynthError, match=r"must end in \.html, \.svg or \.gif"):
        gs.Mechanism.slider_crank(1, 3).animate(tmp_path / "motion.mp4")


@pytest.mark.parametrize("suffix", [".svg", ".png", ".tikz"])
def test_drawings_are_written_as_their_suffix_says(suffix, tmp_path):
    import graphsynth as gs

    linkage = gs.Mechanism.four_bar(2, 1, 2.5, 2.5)
    linkage.draw(tmp_path / f"linkage{suffix}")
    linkage.graph.draw(tmp_path / f"graph{suffix}")
    linkage.simulate().draw(tmp_path / f"motion{suffix}", 90)
    assert len(list(tmp_path.iterdir())) == 3
    assert linkage.plot().get_aspect() == 1.0
