"""Animations: the right poses, nothing from outside, small, and a player that works."""

from __future__ import annotations

import html
import json
import math
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import graphsynth
from graphsynth.core.errors import GeometryError
from graphsynth.drawing.animation import animated_svg, animation_html, save_gif
from graphsynth.drawing.diagram import mechanism_sketch
from graphsynth.drawing.frames import frames_of, motion_over_reach, with_trace_points
from graphsynth.drawing.motion_charts import coupler_curves
from graphsynth.drawing.shapes import FIXED
from graphsynth.kinematics import simulate
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

from .conftest import TURN, cylinder, four_bar

SVG = "{http://www.w3.org/2000/svg}"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


class Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in ("meta", "input", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_page_is_well_formed_and_needs_nothing_else(motion: Any) -> None:
    page = animation_html(motion, frames=30)
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert not {"link", "img", "iframe", "object", "embed"} & {tag for tag, _ in tags.seen}
    assert not any("src" in given or "href" in given for _, given in tags.seen)
    assert set(re.findall(r"https?://[^\s\"'<]+", page)) == {"http://www.w3.org/2000/svg"}
    assert "@import" not in page and "url(" not in page
    ET.fromstring(re.search(r"<svg.*?</svg>", page, re.DOTALL)[0])  # type: ignore[index]


def test_poses_in_the_file_are_those_of_the_motion(motion: Any) -> None:
    """Both links of a joint, carried by the numbers of the file, put it where the display transform does."""
    page = animation_html(motion, frames=40, width=540, height=440)
    frames, data = frames_of(motion, 40), data_of(page)
    sketch = mechanism_sketch(motion.mechanism, frames.poses, width=540, height=440)
    assert data["count"] == len(frames.poses)
    local = {}
    for group in re.finditer(r'<g data-k="(\d+)" data-layer="joint"[^>]*>(.*?)</g>', page, re.DOTALL):
        for circle in re.finditer(r'<circle cx="(\S+)" cy="(\S+)"[^>]*data-part="joint ([\d-]+)"', group[2]):
            local[circle[3]] = int(group[1]), float(circle[1]), float(circle[2])
    checked = 0
    for joint in motion.mechanism.joints:
        if not isinstance(joint, Revolute | PinSlot):
            continue
        link, x, y = local[f"{joint.a}-{joint.b}"]
        for i in range(data["count"]):
            X, Y, turn = np.array(data["poses"][link][3 * i : 3 * i + 3]) / [10, 10, 100]
            c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
            pose = frames.poses[i, joint.b]
            world = complex(pose[0], pose[1]) + np.exp(1j * pose[2]) * complex(*joint.at_b)
            assert (X + c * x - s * y, Y + s * x + c * y) == pytest.approx(sketch.xy(world), abs=0.15)
            checked += 1
    assert checked >= data["count"]


def test_ten_links_at_120_frames_stay_small(motions: dict[str, Any]) -> None:
    motion = motions["ladder"]
    assert motion.mechanism.graph.links == 10 and motion.completed
    assert len(animation_html(motion, frames=120).encode()) < 200_000
    assert len(animated_svg(motion, frames=120).encode()) < 300_000


def test_a_closed_turn_goes_round_and_a_part_goes_to_and_fro_with_the_reason(motions: dict[str, Any]) -> None:
    closed, stops = motions["lambda"], motions["stops"]
    assert data_of(animation_html(closed))["loop"] is True
    page = animation_html(stops)
    assert data_of(page)["loop"] is False
    words = html.unescape(re.search(r'<p class="stop">(.*?)</p>', page)[1])  # type: ignore[index]
    assert "to and fro over the part that is reached" in words and "stretched or folded" in words
    assert stops.reason[1:] in words
    frames = frames_of(stops, 20)
    assert np.isfinite(frames.poses).all() and not frames.loops
    assert frames.coordinates[-1, 0] < stops.stopped_at
    n = len(frames.poses)
    assert frames.order == [*range(n), *range(n - 2, 0, -1)]
    assert frames_of(closed, 20).order == list(range(20))


def test_text_is_escaped(motions: dict[str, Any]) -> None:
    evil = "</script><script>alert(1)</script>@SVG@ & <b>"
    page = animation_html(motions["lambda"], title=evil, note=evil)
    assert "<script>alert" not in page
    assert page.count("<svg") == 1
    assert html.escape(evil) in page


def test_a_point_named_like_markup_does_not_leave_the_data() -> None:
    motion = simulate(four_bar(2, 1, 2.5, 2.5, points={"</script><i>": (2, (1.0, 1.0))}), TURN, modes={0: 1})
    page = animation_html(motion)
    assert data_of(page)["points"][0]["name"] == "</script><i>" and page.count("</script>") == 2


def test_bounds_are_told(motions: dict[str, Any]) -> None:
    with pytest.raises(GeometryError, match="frames = 1 must be from 2 to 2000"):
        animation_html(motions["lambda"], frames=1)
    for seconds in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(GeometryError, match="must be positive and finite"):
            animated_svg(motions["lambda"], seconds=seconds)
    apart = simulate(four_bar(5, 1, 1, 1), TURN)
    with pytest.raises(GeometryError, match="nothing of the motion is assembled"):
        animation_html(apart)


def test_driver_values_are_degrees_or_lengths(motions: dict[str, Any]) -> None:
    (turning,) = data_of(animation_html(motions["lambda"], frames=4))["drivers"]
    assert turning == {"name": "driver 0-1", "angle": True, "values": [0.0, 90.0, 180.0, 270.0, 360.0]}
    (sliding,) = data_of(animation_html(motions["cylinder"], frames=4))["drivers"]
    assert sliding["angle"] is False and sliding["values"][0] == 1.2 and sliding["values"][-1] == 3.4


def test_same_motion_same_bytes(motions: dict[str, Any], tmp_path: Path) -> None:
    motion = motions["yoke"]
    assert animation_html(motion) == animation_html(motion) and animated_svg(motion) == animated_svg(motion)
    for name in "ab":
        save_gif(motion, tmp_path / name, frames=6)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


# --- SVG and GIF


def values_of(element: ET.Element) -> np.ndarray:
    return np.array([[float(x) for x in place.split()] for place in element.get("values", "").split(";")])


def test_svg_moves_every_link_and_stands_still_on_request(motion: Any) -> None:
    text = animated_svg(motion, frames=12, seconds=3.0)
    moving, resting = (g for g in ET.fromstring(text).iter(f"{SVG}g") if g.get("class") in ("move", "rest"))
    driven = {
        int(g.get("data-link", -1)) for g in moving.iter(f"{SVG}g") if g.find(f"{SVG}animateTransform") is not None
    }
    links = {shape.link for shape in mechanism_sketch(motion.mechanism, motion.poses[:1]).shapes}
    assert driven - {-1} == links - {FIXED, motion.mechanism.frame}
    # who asks for no motion sees what does not move at all; programs without style sheets see the first frame
    assert not any("animate" in part.tag for part in resting.iter()) and resting.get("display") == "none"
    assert "(prefers-reduced-motion:reduce){.gs .move{display:none}.gs .rest{display:inline}}" in text
    # there and back where the motion does not close
    frames = frames_of(motion, 12)
    passes = {len(values_of(part)) for part in moving.iter(f"{SVG}animateTransform")}
    assert passes == {len(frames.poses) if motion.closure.closed else 2 * len(frames.poses) - 1}
    assert {part.get("dur") for part in moving.iter(f"{SVG}animateTransform")} == {
        "3.000s" if motion.closure.closed else "6.000s"
    }


def test_joints_of_the_svg_are_where_the_motion_has_them(motion: Any) -> None:
    """Both links of a turning pair carry its circle and its pin's place to the same pixels in every frame."""
    frames = frames_of(motion, 12)
    moving = next(g for g in ET.fromstring(animated_svg(motion, frames=12)).iter(f"{SVG}g") if g.get("class") == "move")
    sketch = mechanism_sketch(motion.mechanism, frames.poses, width=560, height=480)
    circles = {
        part.get("data-part"): (group, float(part.get("cx", 0)), float(part.get("cy", 0)))
        for group in moving.iter(f"{SVG}g")
        if group.get("data-link") and int(group.get("data-link", -1)) != motion.mechanism.frame
        for part in group.iter(f"{SVG}circle")
    }
    checked = 0
    for joint in motion.mechanism.joints:
        group, x, y = circles.get(f"joint {joint.a}-{joint.b}", (None, 0.0, 0.0))
        if group is None or not isinstance(joint, Revolute | PinSlot):
            continue
        places, turns = (
            next((values_of(p) for p in group.iter(f"{SVG}animateTransform") if p.get("type") == kind), None)
            for kind in ("translate", "rotate")
        )
        for i in range(len(frames.poses)):
            turn = complex(np.exp(1j * np.radians(turns[i, 0]))) if turns is not None else 1.0
            if places is None:
                break
            at = complex(*places[i]) + turn * complex(x, y)
            pose = frames.poses[i, joint.b]
            world = complex(pose[0], pose[1]) + np.exp(1j * pose[2]) * complex(*joint.at_b)
            assert (at.real, at.imag) == pytest.approx(sketch.xy(world), abs=0.15)
            checked += 1
    assert checked or motion.mechanism.graph.links < 4


def test_nothing_in_the_package_moves_by_style_sheets() -> None:
    """Key frames of CSS begin when the style of their element is found: parts of a picture start at different times."""
    for path in Path(graphsynth.__file__).parent.rglob("*"):
        if path.suffix in (".py", ".html", ".css", ".js"):
            assert "@keyframes" not in path.read_text("utf-8"), path


def test_gif_has_the_frames_and_the_time(motions: dict[str, Any], tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "turn.gif"
    assert save_gif(motions["lambda"], path, frames=24, seconds=2.4) == 24
    with Image.open(path) as picture:
        assert picture.n_frames == 24 and picture.info["duration"] == 100 and picture.info["loop"] == 0
        first = np.asarray(picture.convert("RGB")).astype(int)
        picture.seek(12)
        changed = (np.abs(np.asarray(picture.convert("RGB")).astype(int) - first).sum(axis=2) > 60).mean()
    assert 0.002 < changed < 0.2  # the links have moved, the paper has not
    assert (first.reshape(-1, 3).mean(axis=0) > 240).all()
    assert (first.reshape(-1, 3) == 255).all(axis=1).mean() > 0.9  # the paper is white
    assert path.stat().st_size < 120_000


def test_names_are_not_read_as_mathematics(tmp_path: Path) -> None:
    """What matplotlib would take for a formula, and a wrong one."""
    name = r"$\frac{a$"
    motion = simulate(four_bar(2, 1, 2.5, 2.5, points={name: (2, (1.0, 1.0))}), TURN, modes={0: 1})
    assert save_gif(motion, tmp_path / "x.gif", frames=2, title=name) == 2
    assert name in coupler_curves(motion).svg()


@pytest.mark.long
def test_gif_of_a_part_goes_to_and_fro(motions: dict[str, Any], tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "part.gif"
    n = len(frames_of(motions["stops"], 10).poses)
    assert save_gif(motions["stops"], path, frames=10, title="stops") == 2 * n - 2
    with Image.open(path) as picture:
        assert picture.n_frames == 2 * n - 2


# --- which motion is shown


def test_reach_of_a_rocking_driver_is_shown_from_end_to_end() -> None:
    """Lengths 2, 1, 1, 1 turn between the limit angles -+ arccos(1/4)."""
    motion = motion_over_reach(four_bar(2, 1, 1, 1))
    limit = math.acos(0.25)
    step = math.tau / 360
    assert not motion.completed and "at the other end" in motion.reason
    assert -limit < motion.inputs[0] < -limit + step and limit - step < motion.inputs[-1] < limit
    assert (np.diff(motion.inputs) > 0).all() and motion.assembled.all()
    assert np.abs(np.diff(motion.poses, axis=0)).max() < 0.5 and motion.residual < 1e-12


def test_reach_is_the_turn_where_there_is_one_and_starts_where_it_can_be_assembled() -> None:
    assert motion_over_reach(four_bar(2, 1, 2.5, 2.5)).closure.closed
    # D = |A - C| must be at least l3 + ... : not assembled at u = 0 for 1, 2, 3.5, 0.9 (|A - C| = 1 < 2.6)
    late = motion_over_reach(four_bar(1, 2, 3.5, 0.9))
    assert late.assembled.all() and late.inputs[0] > 0.0
    with pytest.raises(GeometryError, match="cannot be assembled at any of 24 inputs"):
        motion_over_reach(four_bar(9, 1, 1, 1))


def test_reach_of_a_sliding_driver_needs_a_pose() -> None:
    with pytest.raises(GeometryError, match="sliding driver has no turn"):
        motion_over_reach(cylinder())
    pose = simulate(cylinder(), [2.0]).poses[0]
    motion = motion_over_reach(replace(cylinder(), pose=tuple(map(tuple, pose.tolist()))))
    assert motion.inputs.min() < 1.9 and motion.inputs.max() > 2.1 and motion.assembled.all()
    at_2 = np.argmin(np.abs(motion.inputs - 2.0))
    np.testing.assert_allclose(motion.poses[at_2], pose, atol=1e-9)


def test_a_point_is_traced_even_if_none_has_a_name(motions: dict[str, Any]) -> None:
    plain = simulate(four_bar(2, 1, 2.5, 2.5), TURN, modes={0: 1})
    traced = with_trace_points(plain)
    assert traced.mechanism.points == {"P": (2, (1.25, 0.0))}
    assert with_trace_points(motions["lambda"]) is motions["lambda"]


# --- the player in a browser

PROBE = """
<script>
const log = {}, $$ = q => document.querySelector(q), where = k => $$(`[data-k="${k}"]`).getAttribute("transform");
log.start = where(1); log.autoplay = $$("#play").textContent;
const slider = $$("#time");
slider.value = 30; slider.dispatchEvent(new Event("input"));
log.slid = where(1); log.words = $$("#value").textContent; log.button = $$("#play").textContent;
log.trail = document.querySelector("[data-trail]").getAttribute("d").split("L").length;
const key = k => document.dispatchEvent(new KeyboardEvent("keydown", {key: k, bubbles: true, cancelable: true}));
key("ArrowRight"); log.right = +slider.value; key("ArrowLeft"); key("ArrowLeft"); log.left = +slider.value;
key(" "); log.space = $$("#play").textContent; key(" "); log.again = $$("#play").textContent;
$$("#trace").checked = false; $$("#trace").dispatchEvent(new Event("change"));
log.hidden = document.querySelector("[data-trail]").getAttribute("d");
const held = $$(".grip"), m = $$("svg.gs").getScreenCTM(), c = D.grip.centre;
held.setPointerCapture = () => {}; held.hasPointerCapture = () => true;
const at = (x, y) => ({clientX: m.a * x + m.e, clientY: m.d * y + m.f, pointerId: 1, bubbles: true});
held.dispatchEvent(new PointerEvent("pointerdown", at(c[0], c[1] - 50))); log.dragged = +slider.value;
held.dispatchEvent(new PointerEvent("pointermove", at(c[0] - 70, c[1]))); log.further = +slider.value;
const out = document.createElement("pre"); out.id = "log"; out.textContent = JSON.stringify(log);
document.body.append(out);
</script></body>"""


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here")
def test_the_player_moves_the_links(motions: dict[str, Any], tmp_path: Path) -> None:
    motion = motions["lambda"]
    page = animation_html(motion, frames=120)
    probe = re.search(r"<script>(.*?)</script>", PROBE, re.DOTALL)
    assert probe
    allowed = b64encode(sha256(probe[1].encode()).digest()).decode()  # beside the page's own script
    page = page.replace("script-src ", f"script-src 'sha256-{allowed}' ").replace("</body>", PROBE)
    (tmp_path / "page.html").write_text(page, "utf-8")
    command = [
        str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync",
        f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", (tmp_path / "page.html").as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    found = re.search(r'<pre id="log">(.*?)</pre>', done.stdout)
    assert found, done.stderr[-2000:]
    log = json.loads(html.unescape(found[1]))
    assert log["autoplay"] == "Pause" and log["button"] == "Play" and log["words"] == "driver 0-1: 90.0°"
    # the crank at 90 degrees: its middle is half a crank above the pivot, turned by -90 in the page's sense
    x, y, turn = map(float, re.findall(r"-?[\d.]+", log["slid"]))
    frames = frames_of(motion, 120)
    sketch = mechanism_sketch(motion.mechanism, frames.poses, width=540, height=440)
    assert (x, y) == pytest.approx(sketch.xy(0.5j), abs=0.06) and turn == pytest.approx(-90, abs=0.006)
    assert log["start"] != log["slid"]
    assert log["trail"] == 32  # frames 0..30 and the present place
    assert (log["right"], log["left"]) == (31, 29)
    assert (log["space"], log["again"]) == ("Pause", "Play")
    assert log["hidden"] == ""
    assert (log["dragged"], log["further"]) == (30, 60)


@pytest.mark.parametrize(("base", "link", "sense"), [(0, 3, 1.0), (3, 0, -1.0)])
def test_reach_of_a_slider_begins_at_its_pose_whichever_way_the_driver_is_named(
    base: int, link: int, sense: float
) -> None:
    """Crank 1, rod 3: the slider runs from 2 to 4."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3)]
    angle = math.asin(1.0 / 3.0)
    pose = [(0, 0, 0), (0, 0, math.pi / 2), (0, 1, -angle), (3.0 * math.cos(angle), 0, 0)]
    motion = motion_over_reach(Mechanism(graph, joints, [Driver(base, link)], pose=pose))
    assert sorted(sense * motion.inputs[[0, -1]]) == pytest.approx([2.0, 4.0], abs=0.02)
    np.testing.assert_allclose(motion.poses[:, 3, 0], sense * motion.inputs, atol=1e-12)


def test_reach_is_looked_for_over_one_turn_of_the_driver_whatever_its_law() -> None:
    """A rocker that is assembled only around pi; a hundred turns of the driver for one of the input."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1),
        Revolute(1, 2, (2.0, 0.0)),
        Revolute(2, 3, (1.0, 0.0), (1.0, 0.0)),
        Revolute(0, 3, (-3.0, 0)),
    ]
    motion = motion_over_reach(Mechanism(graph, joints, [Driver(0, 1, Linear(rate=100.0))]))
    ends = np.sort(motion.inputs[[0, -1]]) * 100.0
    limit = math.acos((4.0 + 9.0 - 4.0) / 12.0)  # |AB| = 2 between the crank's end and the pivot at -3
    assert ends == pytest.approx([math.pi - limit, math.pi + limit], abs=0.02)
