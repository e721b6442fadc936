"""SVG files of every writer: right in programs that read no style sheets, and the same in librsvg and in Chromium."""

from __future__ import annotations

import io
import math
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageChops, ImageFilter

from graphsynth import LambdaLinkage
from graphsynth.cli import main
from graphsynth.drawing.animation import animated_svg
from graphsynth.drawing.diagram import mechanism_svg
from graphsynth.drawing.graphs import draw_levels, graph_svg
from graphsynth.drawing.pages import whole_page
from graphsynth.drawing.palette import DARK, LIGHT, STYLE
from graphsynth.drawing.plots import Band, Chart, Line, Mark, new_figure, themed_svg
from graphsynth.kinematics import simulate
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.antenna import PointingMechanism
from graphsynth.systems.antenna.animation import pointing_animation
from graphsynth.systems.lambda_linkage.pictures import lambda_animation, lambda_sketch, lambda_sketch_3d
from graphsynth.systems.piston import FloatingPiston
from graphsynth.systems.piston.pictures import piston_sketch
from graphsynth.systems.tribometer.animation import tribometer_animation, tribometer_sketch
from graphsynth.systems.tribometer.model import Tribometer

from ..plain_svg import faults
from .conftest import four_bar

DOCS = Path(__file__).parents[2] / "docs" / "pictures"
SLOTTED = MechanismGraph(4, [(0, 1), (1, 2), (2, 3, 2), (0, 3)], frame=0, space=3)
TURN = np.linspace(0.0, math.tau, 25)


def chart() -> str:
    x = np.linspace(0.0, 9.0, 50)
    lines = [Line(x, np.sin(x), "a < b & c"), Line(x, np.cos(x), "ünlike", "d", "--")]
    return Chart(lines, "x [mm]", "y_1 [$]", [Band(1.0, 2.0, "jams")], [Mark(3.0, "event")], in_pi=True).svg()


def zoo() -> str:
    """What figures of the scenes have: hatching, a map, letters of all kinds, a legend with a ground of its own."""
    figure = new_figure((6.0, 3.0))
    left, right = figure.subplots(1, 2)
    left.fill_between([0.0, 1.0, 2.0], [1.0, 3.0, 2.0], color=LIGHT["fill"], hatch="//", label="hatched")
    left.plot([0.0, 1.0, 2.0], [3.0, 1.0, 2.0], "o--", color=LIGHT["b"], label="marks")
    left.set_title(r"bold, $\alpha_{ij}^2$", fontweight="bold")
    left.set_ylabel("slanted", fontstyle="italic")
    left.legend()
    drawn = right.pcolormesh(np.arange(12.0).reshape(3, 4), rasterized=True, cmap="viridis")
    figure.colorbar(drawn)
    right.annotate("here", (1.0, 1.0), xytext=(2.0, 2.0), arrowprops={"arrowstyle": "->"}, color="white")
    return themed_svg(figure)


def run() -> Any:
    return Tribometer().event_driven(2.0, times=np.linspace(0.0, 2.0, 101), estimate=False)


#: Every way to an SVG: sketches, charts, figures, moving pictures; `motions` are those of the fixture.
WRITERS: dict[str, Callable[[dict[str, Any]], str]] = {
    "diagram": lambda motions: mechanism_svg(motions["geared"], 30, title="<title> & more"),
    "cam": lambda motions: mechanism_svg(motions["cam"], 10),
    "slots": lambda motions: mechanism_svg(motions["quick return"], 10),
    "graph": lambda motions: graph_svg(SLOTTED, driver=1),
    "levels": lambda motions: draw_levels(SLOTTED),
    "lambda": lambda motions: lambda_sketch(LambdaLinkage(2.0, 1.0, 2.5, 2.5), 1.0, ring=True).svg(),
    "lambda in space": lambda motions: lambda_sketch_3d(LambdaLinkage(2.0, 1.0, 2.5, 2.5, alpha=0.02), 1.0).svg(),
    "piston": lambda motions: piston_sketch(FloatingPiston.crank_slider(0.05, 0.2, lead=0.08), 1.0).svg(),
    "tribometer": lambda motions: tribometer_sketch(run(), 0.5),
    "chart": lambda motions: chart(),
    "figure": lambda motions: zoo(),
    "moving": lambda motions: animated_svg(motions["lambda"], frames=30),
    "moving to and fro": lambda motions: animated_svg(motions["stops"], frames=10, title="part"),
    "moving lambda": lambda motions: lambda_animation(LambdaLinkage(2.0, 1.0, 2.5, 2.5), lambda f: f < 3.0, frames=12),
    "moving tribometer": lambda motions: tribometer_animation(run(), frames=20),
    "moving antenna": lambda motions: pointing_animation(
        PointingMechanism(), 0.6 * np.sin(TURN), 0.6 * np.sin(2.0 * TURN)
    ),
}
#: Those that are drawn by both; the others have no other elements.
COMPARED = ("diagram", "slots", "levels", "lambda in space", "piston", "chart", "figure", "moving", "moving antenna")


@pytest.fixture(scope="module")
def written(motions: dict[str, Any]) -> dict[str, str]:
    return {name: write(motions) for name, write in WRITERS.items()}


@pytest.mark.long
@pytest.mark.parametrize("name", WRITERS)
def test_every_writer_keeps_to_what_all_programs_read(written: dict[str, str], name: str) -> None:
    assert faults(written[name]) == []


def test_letters_that_no_file_may_hold_are_replaced(motions: dict[str, Any]) -> None:
    wrong = "a\x00b\x0b\ud800"
    for svg in (
        mechanism_svg(motions["lambda"], 0, title=wrong),
        animated_svg(motions["lambda"], frames=4, title=wrong),
    ):
        assert faults(svg) == [] and "a\ufffdb\ufffd\ufffd" in svg
    curve = Chart([Line([0.0, 1.0], [0.0, 1.0], "a\x01b 長")], "x", "y").svg()
    assert faults(curve) == [] and "a\ufffdb 長" in curve


def test_files_of_the_command_line_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for view in ("diagram", "levels", "both"):
        assert main(["show", "Cl f0", "--driver", "1", "--view", view, "-o", "x.svg"]) == 0
        assert faults(Path("x.svg").read_text("utf-8")) == [], view


@pytest.mark.parametrize("path", sorted(DOCS.glob("*.svg")), ids=lambda path: path.stem)
def test_pictures_of_the_documentation_too(path: Path) -> None:
    assert faults(path.read_text("utf-8")) == []


def test_dark_pages_recolour_every_colour_of_the_palette() -> None:
    assert DARK.keys() == LIGHT.keys()
    for name, light in LIGHT.items():
        for what in ("fill", "stroke"):
            assert STYLE.count(f'[{what}="{light}"]{{{what}:{DARK[name]}}}') == 1


# --- as drawn by others


@pytest.fixture(scope="module")
def window() -> Iterator[Any]:
    """Chromium with its driver, 1000 by 1000 pixels."""
    webdriver = pytest.importorskip("selenium.webdriver")
    chromium, driver = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
    if not chromium or not driver:
        pytest.skip("no Chromium with chromedriver on this machine")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--force-color-profile=srgb"):
        options.add_argument(flag)
    found = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield found
    found.quit()


def difference(one: Image.Image, other: Image.Image) -> float:
    """Share of pixels (percent) that differ by more than an eighth of the range, edges of shapes smoothed."""
    smooth = [picture.convert("RGB").filter(ImageFilter.GaussianBlur(1.0)) for picture in (one, other)]
    apart = np.asarray(ImageChops.difference(*smooth)).max(axis=2)
    return float(100.0 * (apart > 32).mean())


def in_chromium(window: Any, path: Path, size: tuple[int, int], paused: bool = True, **features: str) -> Image.Image:
    media = [{"name": f"prefers-{name}", "value": value} for name, value in features.items()]
    window.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": media})
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
    window.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    window.get(path.as_uri())
    if paused:
        window.execute_script("document.documentElement.pauseAnimations(); document.documentElement.setCurrentTime(0)")
    return Image.open(io.BytesIO(window.get_screenshot_as_png()))


def in_librsvg(path: Path) -> Image.Image:
    done = subprocess.run(["rsvg-convert", "-b", "white", path], capture_output=True, check=True, timeout=60)
    assert not done.stderr
    return Image.open(io.BytesIO(done.stdout))


@pytest.mark.skipif(shutil.which("rsvg-convert") is None, reason="rsvg-convert is not on this machine")
def test_librsvg_draws_what_chromium_draws(window: Any, written: dict[str, str], tmp_path: Path) -> None:
    """At most 0.5 % of the pixels differ (letters); it is 3 to 40 % where lines and plates are missing."""
    apart = {}
    for name in COMPARED:
        text = written[name]
        path = tmp_path / f"{name}.svg"
        path.write_text(text.replace("system-ui,", "'DejaVu Sans',"), "utf-8")  # the same letters for both
        picture = in_librsvg(path)
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 8, name
        apart[name] = difference(picture, in_chromium(window, path, picture.size, **{"color-scheme": "light"}))
    assert max(apart.values()) < 0.5, apart


def test_dark_pages_recolour_copies_of_marks_too(window: Any, tmp_path: Path) -> None:
    figure = new_figure((3.0, 2.0))
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.plot([0.0, 1.0], [0.0, 1.0], "o", ms=40.0, color=LIGHT["a"])
    path = tmp_path / "x.svg"
    path.write_text(themed_svg(figure), "utf-8")
    shown = in_chromium(window, path, (288, 192), **{"color-scheme": "dark"}).convert("RGB")
    seen = {f"#{r:02x}{g:02x}{b:02x}" for _, (r, g, b) in shown.getcolors(1 << 24)}
    assert DARK["a"] in seen and LIGHT["a"] not in seen


def test_dark_pages_and_reduced_motion_are_followed(window: Any, written: dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / "x.svg"
    path.write_text(written["moving antenna"], "utf-8")
    light, dark = (
        np.asarray(in_chromium(window, path, (620, 400), **{"color-scheme": way}).convert("RGB")).mean()
        for way in ("light", "dark")
    )
    assert light > 230 and dark < 60
    in_chromium(window, path, (620, 400), **{"reduced-motion": "reduce"})
    shown = "return ['move', 'rest'].map(name => getComputedStyle(document.querySelector('.' + name)).display)"
    assert window.execute_script(shown) == ["none", "inline"]
    in_chromium(window, path, (620, 400), **{"reduced-motion": "no-preference"})
    assert window.execute_script(shown) == ["inline", "none"]


def test_a_page_runs_nothing_and_loads_nothing(window: Any, tmp_path: Path) -> None:
    (tmp_path / "other.svg").write_text(chart(), "utf-8")
    body = (
        "<script>document.title = 'ran'</script><img src=other.svg onload=\"document.title = 'loaded'\">"
        "<svg onload=\"document.title = 'ran'\"><circle r='5' style='fill: #010203'/></svg>"
    )
    (tmp_path / "page.html").write_text(whole_page("a < b", "p{color:#040506}", f"{body}<p>text</p>"), "utf-8")
    window.get((tmp_path / "page.html").as_uri())
    assert window.title == "a < b"
    shown = "return ['p', 'circle', 'img'].map(name => document.querySelector(name)).map(e => e.naturalWidth ?? "
    colours = window.execute_script(f"{shown} [getComputedStyle(e).color, getComputedStyle(e).fill])")
    assert colours == [["rgb(4, 5, 6)", "rgb(0, 0, 0)"], ["rgb(0, 0, 0)", "rgb(1, 2, 3)"], 0]


#: The largest distance, in pixels, of a joint from the ends of the bars it joins, over all pictures of the page.
APART = """
const at = (shape, x, y) => { const m = shape.getCTM(); return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f]; };
let worst = 0, joints = 0;
for (const circle of document.querySelectorAll(".move circle[data-part]")) {
  const svg = circle.ownerSVGElement;
  const [x, y] = at(circle, circle.cx.baseVal.value, circle.cy.baseVal.value);
  for (const link of circle.dataset.part.match(/\\d+/g)) {
    const bar = svg.querySelector(`.move [data-part="link ${link}"]`);
    if (!bar) continue;
    const ends = [...bar.getAttribute("d").matchAll(/(-?[\\d.]+) (-?[\\d.]+)/g)].map(p => at(bar, +p[1], +p[2]));
    worst = Math.max(worst, Math.min(...ends.map(p => Math.hypot(p[0] - x, p[1] - y))));
    joints += 1;
  }
}
return [worst, joints];"""


def test_all_parts_of_a_picture_have_one_clock(window: Any, tmp_path: Path) -> None:
    """On a machine that is six times slower the parts of a picture are read in different frames, but move together."""
    inputs = np.linspace(0.0, math.tau, 121)
    motions = [simulate(four_bar(2, 1, 2.5 + 0.1 * k, 2.5), inputs, modes={0: 1}) for k in range(4)]
    pictures = [animated_svg(motion, frames=120, seconds=2.0) + "<p>words</p>" * 2000 for motion in motions]
    path = tmp_path / "page.html"
    path.write_text(f"<!doctype html><meta charset=utf-8>{''.join(pictures)}", "utf-8")
    in_chromium(window, path, (900, 900), **{"reduced-motion": "no-preference"}, paused=False)
    window.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 6})
    try:
        for _ in range(3):
            window.get(path.as_uri())
            seen = [window.execute_script(APART) for _ in range(3)]
            assert all(joints == 4 * 6 for _, joints in seen)
            assert max(worst for worst, _ in seen) < 0.3
    finally:
        window.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 1})


@pytest.mark.parametrize("page", ["#fff", "#111"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_notebook_of_the_other_scheme_shows_pictures_on_their_own_paper(
    window: Any, tmp_path: Path, page: str, scheme: str
) -> None:
    """A notebook has a scheme of its own, pictures follow that of the system: inks are read on the paper they bring."""
    figure = new_figure((3.0, 2.0))
    figure.add_subplot().plot([0.0, 1.0], [0.0, 1.0], color=LIGHT["a"])
    path = tmp_path / "x.html"
    path.write_text(f"<!doctype html><body style='margin:0;background:{page}'>{themed_svg(figure)}</body>", "utf-8")
    shown = in_chromium(window, path, (400, 192), paused=False, **{"color-scheme": scheme}).convert("RGB")
    colours = LIGHT if scheme == "light" else DARK
    seen = {f"#{r:02x}{g:02x}{b:02x}" for _, (r, g, b) in shown.crop((0, 0, 288, 192)).getcolors(1 << 24)}
    assert {colours["paper"], colours["ink"], colours["a"]} <= seen
    assert "#{:02x}{:02x}{:02x}".format(*shown.getpixel((1, 1))) == colours["paper"]
    assert "#{:02x}{:02x}{:02x}".format(*shown.getpixel((350, 100))) == f"#{page[1:] * 2}"
