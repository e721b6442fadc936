"""Draw the pictures of the README and of the pages anew: ``python docs/pictures/make.py [FOLDER]``.

Examples of the gallery and of some pages write their own pictures.  Those of other pages are taken from the reports of
shipped scenes, five minutes in all; tribometer-error-time.svg is measured on a quiet machine, by ``graphsynth
accuracy tribometer``.
"""

from __future__ import annotations

import contextlib
import doctest
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import graphsynth as gs
from graphsynth.drawing.animation import animated_svg
from graphsynth.drawing.coupled_pictures import clearance_picture
from graphsynth.drawing.frames import with_trace_points
from graphsynth.drawing.graphs import graph_sketch
from graphsynth.drawing.svg import bare, painted, picture
from graphsynth.jamming.joints import JointLimits, Misalignment
from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.runner import run

CHOSEN = 5  # of the sixteen chains: the one that becomes a mechanism
CELL, GAP, COLUMNS = 150, 10, 8
#: Pages whose examples write pictures.
WITH_EXAMPLES = ("gallery.md", "explanation/jamming-in-space.md", "how-to/build-it.md", "how-to/gear-trains.md")
#: Parts of the best answer that can be built: file, millimetres of its unit, inputs (a full rotation if none).
PARTS: dict[str, tuple[str, float, tuple[float, float] | None]] = {
    "excavator_bucket": ("design-bucket-parts", 100.0, (0.0, 1.0)),
    "walking_leg": ("design-leg-parts", 3.0, None),
    "windscreen_wiper": ("design-wiper-parts", 1.0, None),
}
#: Pictures of the pages: scene, file, title in the report.
FROM_SCENES = {
    "antenna": {
        "antenna-scan": "A scan",
        "antenna-in-space": "The mechanism in space, cranks at 35° and 25°",
        "antenna-two-models": "Two models over equal crank angles",
        "antenna-difference-map": "Map of the difference of the two models",
        "antenna-tolerances": "Map of the certified deviations",
    },
    "braider": {
        "braider-mechanism": "The mechanism",
        "braider-start-up": "Start-up: crank speed",
        "braider-reactions": "Sensors: polar plot of the reactions",
    },
    "didenko_drive": {
        "drive-torque": "Motor torque",
        "drive-speed": "Crank speed",
        "drive-dead-centres": "Without inertia: speed of the platform",
        "drive-claim": "The claim about the resistance as a map",
    },
    "excavator_bucket": {
        "design-bucket": "Place 1: 6 links",
        "design-bucket-function": "Target and answers: function",
    },
    "walking_leg": {
        "design-leg": "Place 1: 6 links",
        "design-leg-path": "Target and answers: path 1",
    },
    "windscreen_wiper": {
        "design-wiper": "Place 1: 4 links",
        "design-wiper-swing": "Target and answers: swing",
    },
    "tribometer": {
        "tribometer-motion": "In motion",
        "tribometer-figure-7b": "Both platforms over time",
        "tribometer-limit-cycle": "Limit cycle",
    },
}


def chains_picture(chains: list[gs.MechanismGraph]) -> str:
    """All chains of eight links side by side, the chosen one framed."""
    rows = -(-len(chains) // COLUMNS)
    width, height = COLUMNS * (CELL + GAP) + GAP, rows * (CELL + GAP) + GAP
    parts = []
    for k, chain in enumerate(chains):
        x, y = GAP + k % COLUMNS * (CELL + GAP), GAP + k // COLUMNS * (CELL + GAP)
        sketch, pose = graph_sketch(chain, width=480.0, height=480.0, numbers=False)
        found = re.fullmatch(r"<svg [^>]*viewBox=\"([^\"]*)\"[^>]*>(.*)</svg>", bare(sketch.svg(pose)), re.DOTALL)
        assert found is not None
        body = re.sub(r"<title>.*?</title>", "", found[2])
        if k == CHOSEN:
            frame = painted(stroke="b", width=3.0)
            parts.append(f'<rect x="{x}" y="{y}" width="{CELL}" height="{CELL}" rx="8" {frame}/>')
        parts.append(f'<svg x="{x}" y="{y}" width="{CELL}" height="{CELL}" viewBox="{found[1]}">{body}</svg>')
    return picture(parts, width, height, "The sixteen chains of eight links with mobility 1") + "\n"


def scene_pictures(scene: str, wanted: dict[str, str]) -> dict[str, str]:
    """Run a scene; return the chosen pictures of its report by file name."""
    with TemporaryDirectory() as place:
        report = run(scene, out=Path(place))
    found = {
        item.title: item.svg
        for product in report.products.values()
        if isinstance(product, tuple)
        for item in product
        if isinstance(item, Picture)
    }
    if scene not in PARTS:
        return {f"{name}.svg": found[title] + "\n" for name, title in wanted.items()}
    name, unit, reach = PARTS[scene]
    for place, text in enumerate(report["mechanisms"].columns["mechanism"], 1):
        own = gs.Mechanism.from_json(text)
        motion = own.simulate() if reach is None else own.simulate(np.linspace(*reach, 361))
        with contextlib.suppress(gs.GraphsynthError):  # not every answer can be built above one board
            drawn = gs.parts(motion, unit=unit).draw().svg
            titles = {file: title.replace("Place 1", f"Place {place}") for file, title in wanted.items()}
            return {f"{file}.svg": found[title] + "\n" for file, title in titles.items()} | {
                f"{name}.svg": drawn + "\n"
            }
    raise SystemExit(f"no answer of {scene} can be built")


def pictures_of_examples(page: str, folder: Path) -> None:
    """Run the examples of a page in the folder; what they write are its pictures."""
    text = (Path(__file__).parents[1] / page).read_text("utf-8")
    names: dict[str, object] = {}
    with contextlib.chdir(folder):
        for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
            exec(doctest.script_from_examples(code) if code.startswith(">>>") else code, names)


def make(folder: Path) -> list[Path]:
    """Write the pictures; return their paths."""
    for page in WITH_EXAMPLES:
        pictures_of_examples(page, folder)
    chains = list(gs.enumerate_chains(8))
    found = gs.embody(chains[CHOSEN], seed=0)
    assert found.accepted, found.statement
    motion = with_trace_points(gs.simulate(found.mechanism, np.linspace(0.0, 2.0 * np.pi, 181)), 2)
    driver = found.mechanism.drivers[0]
    tilt = Misalignment(driver.base, driver.link, alpha=0.01)
    report = gs.assess_jamming(motion, tilt=tilt, joints=JointLimits(0.004))
    pictures = {
        "readme-chains.svg": chains_picture(chains),
        "readme-motion.svg": animated_svg(motion, frames=60, title="One of them, with dimensions, turning"),
    }
    for scene, wanted in FROM_SCENES.items():
        pictures |= scene_pictures(scene, wanted)
    written = [folder / "readme-verdict.png"]
    clearance_picture(report).savefig(written[0], dpi=110, metadata={"Software": None})
    for name, text in pictures.items():
        path = folder / name
        path.write_text(text, encoding="utf-8")
        written.append(path)
    print(found.statement, report.statement, sep="\n")  # noqa: T201
    return written


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
