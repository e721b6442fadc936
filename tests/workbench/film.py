"""A short film of the workbench for the README: ``python -m tests.workbench.film [FILE.gif]``, in a real Chromium.

A crank-rocker is drawn, turned and pulled by its coupler, and its axis is tilted; then a leg walks.
"""

from __future__ import annotations

import io
import math
import sys
import tempfile
from base64 import b64decode
from pathlib import Path

from PIL import Image

from graphsynth.workbench.writing import write_workbench
from tests.workbench.conftest import started
from tests.workbench.person import Person

FILE = Path(__file__).parents[2] / "docs" / "pictures" / "readme-workbench.gif"
SIZE, COLOURS = (960, 600), 64
#: How long a picture stands, in milliseconds: of a step of the work, of a motion.
STEP, MOVING = 900, 120


class Film:
    """Pictures of the page with the time that each stands."""

    def __init__(self, person: Person) -> None:
        self.person = person
        self.frames: list[Image.Image] = []
        self.times: list[int] = []

    def take(self, time: int) -> None:
        """Take the page as it is now; the same picture again stands longer."""
        data = b64decode(self.person.window.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})["data"])
        frame = Image.open(io.BytesIO(data)).convert("RGB")
        if self.frames and frame.tobytes() == self.frames[-1].tobytes():
            self.times[-1] += time
            return
        self.frames.append(frame)
        self.times.append(time)

    def write(self, path: Path) -> None:
        """Write the film, all its pictures in the colours of a few of them."""
        some = self.frames[::15]
        sheet = Image.new("RGB", (SIZE[0], SIZE[1] * len(some)))
        for k, frame in enumerate(some):
            sheet.paste(frame, (0, SIZE[1] * k))
        colours = sheet.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
        frames = [frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in self.frames]
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=self.times, loop=0, optimize=True)


def turn(film: Film, pictures: int) -> None:
    """Lead the driver through a full rotation."""
    for k in range(1, pictures + 1):
        film.person.script(
            "const t = document.getElementById('time'); t.value = arguments[0]; t.dispatchEvent(new Event('input'))",
            math.tau * k / pictures,
        )
        film.take(MOVING)


def draw(film: Film) -> None:
    """Draw a crank-rocker and trace a point of its coupler."""
    person = film.person
    person.look_at(0, 26, 3.2)
    film.take(STEP)
    person.tool("link")
    person.drag((-40, 0), (-40, 20))
    film.take(STEP)
    person.tool("plate")
    for place in ((-40, 20), (30, 60), (-10, 80)):
        person.click(*place)
    person.key("Enter")
    film.take(STEP)
    person.tool("link")
    person.drag((30, 60), (40, 0))
    film.take(STEP)
    person.tool("ground")
    for place in ((-40, 0), (40, 0)):
        person.click(*place)
    film.take(STEP)
    person.tool("driver")
    person.click(-40, 0)
    film.take(STEP)
    person.tool("trace")
    person.click(-10, 80)
    person.until("return document.querySelectorAll('[data-curve]').length === 1")
    film.take(STEP)


def pull(film: Film) -> None:
    """Pull the coupler by its free corner."""
    person, places = film.person, [(-10 - 2 * k, 80 + 4 * math.sin(k / 2)) for k in range(11)]
    ways = [person.pixels(*place) for place in places]
    person.mouse("mouseMoved", *ways[0], 0)
    person.mouse("mousePressed", *ways[0])
    for way in ways[1:] + ways[-2::-1]:
        person.mouse("mouseMoved", *way)
        film.take(MOVING)
    person.mouse("mouseReleased", *ways[0])


def tilt(film: Film) -> None:
    """Tilt the axis of the crank, more and more."""
    person = film.person
    person.script("document.querySelector('#binding input').click()")
    person.until("return document.getElementById('jammed')")
    for angle in (0.2, 1.0, 3.0):
        person.script("Bench.app.jamming.set({ alpha: arguments[0] * Math.PI / 180 })", angle)
        person.script("document.getElementById('binding').scrollIntoView()")
        film.take(STEP)
    person.script("document.querySelector('#binding input').click()")


def main(path: Path) -> None:
    """Make the film."""
    with tempfile.TemporaryDirectory() as folder:
        window = started(folder)
        try:
            film = Film(Person(window, write_workbench(Path(folder) / "bench"), SIZE).open())
            draw(film)
            film.person.key("h")
            film.take(STEP)
            turn(film, 24)
            pull(film)
            film.take(STEP)
            tilt(film)
            film.person.press("[data-do=templates]")
            film.take(STEP)
            film.person.press("[data-template=jansen]")
            film.person.key("h")
            film.take(STEP)
            turn(film, 32)
            film.take(2 * STEP)
        finally:
            window.quit()
    film.write(path)
    print(f"{path}: {len(film.frames)} pictures, {sum(film.times) / 1000:.0f} s, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
