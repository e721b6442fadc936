"""`Parts`: what `graphsynth.parts` gives back, with its bill, its mass properties and its files."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from graphsynth.core.checks import positive
from graphsynth.core.shown import Shown, work
from graphsynth.design.parts.collisions import Collision
from graphsynth.design.parts.outline import Moments
from graphsynth.design.parts.plan import PartsPlan, Sizes
from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.kinematics.engine.result import Motion

if TYPE_CHECKING:
    import pandas as pd

    import graphsynth as gs  # what methods give back that is made in rooms above, by its public name

#: Birch plywood, kg/m^3; pins are of beech, much the same.
PLYWOOD = 680.0
_MM = 1e-3  #: metres


class BillRow(NamedTuple):
    """A row of the bill of parts: lengths in mm, area in mm^2, mass of one in g; 0 where it does not apply."""

    part: str
    number: int
    layer: str
    length: float
    width: float
    height: float
    holes: int
    area: float
    mass: float


@dataclass(frozen=True, eq=False, repr=False)
class Parts(Shown):
    """Links as sheets with holes, in layers; pins, washers and spacers.  Lengths in millimetres.

    Attributes
    ----------
    motion : Motion
        What they are made for.
    unit : float
        Millimetres of one unit of length of the mechanism.
    plan : PartsPlan
        Outlines and holes of every link in its frame, pins, sizes.
    layers : tuple of int
        Layer of every link; the frame is 0, below all others.  Where a link consists of two sheets, the second one
        comes after all links, see `PartsPlan.links`.
    certified : bool
        Over the whole motion parts of one layer are proved to stay at least the clearance apart; else this is
        estimated at the samples, see ``reason``.
    reason : str
        Why it is estimated; empty if it is proved.
    gap : float
        A lower bound of the least gap between parts of one layer (certified), or the least one at the samples;
        infinite if no two parts share a layer.
        Wheels that mesh, and a cam and its roller, touch by design and are left out of it.
    collisions : tuple of Collision
        Pairs that are in different layers because they would meet; `Collision.status` is "undecided" where that is
        only not excluded.
    seconds : float
        Run time.
    """

    motion: Motion
    unit: float
    plan: PartsPlan
    layers: tuple[int, ...]
    certified: bool
    reason: str
    gap: float
    collisions: tuple[Collision, ...]
    seconds: float

    @property
    def sizes(self) -> Sizes:
        """All sizes, in millimetres."""
        return self.plan.sizes

    @property
    def count(self) -> int:
        """Layers above the frame."""
        return max(self.layers)

    def moments(self, sheet: int) -> Moments:
        """Area, first moment and polar second moment of a sheet without its holes; mm, closed form."""
        found = self.plan.outlines[sheet].moments
        for hole in self.plan.holes[sheet]:
            found = found.less(hole.moments)
        return found

    def span(self, pin: int) -> tuple[int, int]:
        """Lowest and highest layer of a pin."""
        own = [self.layers[link] for link in self.plan.pins[pin].sheets]
        return min(own), max(own)

    def pin_length(self, pin: int) -> float:
        """From the lower face of its lowest link to the upper face of its highest."""
        low, high = self.span(pin)
        return (high - low) * self.sizes.pitch + self.sizes.thickness

    def spacers(self, pin: int) -> list[float]:
        """Lengths of the spacers on a pin, between sheets that are not in neighbouring layers."""
        return [(b - a - 1) * self.sizes.pitch - self.sizes.washer for a, b in pairwise(self._stops(pin)) if b - a > 1]

    def washers(self, pin: int) -> int:
        """Count the washers on a pin: one between neighbouring layers, two at a spacer."""
        return len(self._stops(pin)) - 1 + len(self.spacers(pin))

    def heads(self, pin: int) -> tuple[bool, bool]:
        """Whether a head or nut, as wide as a washer and at most one layer high, has room below and above a pin.

        Estimated at the samples of the motion; the board leaves no room below what lies on it.
        """
        low, high = self.span(pin)
        name = self.plan.pins[pin].title
        met = [{found.one, found.other} - {name} for found in self.collisions if name in (found.one, found.other)]

        def room(layer: int) -> bool:
            sheets = {f"link {self.plan.label(sheet)}" for sheet, own in enumerate(self.layers) if own == layer}
            spans = ((other.title, self.span(k)) for k, other in enumerate(self.plan.pins))
            there = sheets | {title for title, (first, last) in spans if first <= layer <= last}
            return all(not names & there for names in met)

        return low == 0 or (low > 1 and room(low - 1)), high == self.count or room(high + 1)

    def _stops(self, pin: int) -> list[int]:
        """Layers of the sheets on a pin, and of those in whose slot it moves."""
        own, (low, high) = self.plan.pins[pin], self.span(pin)
        passed = [self.layers[sheet] for sheet in own.passes if low < self.layers[sheet] < high]
        return sorted([self.layers[sheet] for sheet in own.sheets] + passed)

    def bodies(self, density: float = PLYWOOD) -> dict[int, Body]:
        """Return mass (kg), moment of inertia (kg m^2) and centre (m) of every moving link with the pins it holds."""
        density = positive("density", density)
        found, sheet = {}, density * self.sizes.thickness * _MM
        for link in range(self.motion.mechanism.graph.links):
            if link == self.motion.mechanism.frame:
                continue
            own = [_body(self.moments(k), sheet) for k, whose in enumerate(self.plan.links) if whose == link]
            for k, pin in enumerate(self.plan.pins):
                if pin.link == link and pin.kind != "shaft":
                    r = 0.5 * self.sizes.pin * _MM
                    mass = density * np.pi * r * r * self.pin_length(k) * _MM
                    own.append(Body(mass, 0.5 * mass * r * r, (pin.at.real * _MM, pin.at.imag * _MM)))
            found[link] = Body.combined(*own)
        return found

    def dynamics(self, density: float = PLYWOOD, **options: Any) -> DynamicModel:
        """Return the mechanism in metres with these bodies; ``options`` are those of `DynamicModel`."""
        return DynamicModel(self.motion.mechanism.scaled(self.unit * _MM), self.bodies(density), **options)

    @cached_property
    def bill(self) -> tuple[BillRow, ...]:
        """Sheets by link, then pins, spacers and washers by length."""
        rows, grams = [], PLYWOOD * 1e-6
        for link, layer in enumerate(self.layers):
            length, width = sides(self, link)
            area = self.moments(link).area
            name = "frame" if link == self.motion.mechanism.frame else "link"
            name = f"{self.plan.wheel(link).partition(',')[0] or name} {self.plan.label(link)}"
            t = self.sizes.thickness
            rows.append(
                BillRow(
                    name,
                    1,
                    str(layer),
                    length,
                    width,
                    t,
                    len(self.plan.holes[link]),
                    area,
                    area * t * grams,
                )
            )
        pins = range(len(self.plan.pins))
        loose: Counter[tuple[str, float, float]] = Counter()
        for k in pins:
            loose[self.plan.pins[k].kind, self.sizes.pin, round(self.pin_length(k), 6)] += 1
            for length in self.spacers(k):
                loose["spacer", 2.0 * self.sizes.spacer, round(length, 6)] += 1
            loose["washer", 2.0 * self.sizes.spacer, self.sizes.washer] += self.washers(k)
        for (kind, wide, length), count in sorted(loose.items()):
            hole = self.sizes.hole if kind in ("spacer", "washer") else 0.0
            area = np.pi * (wide * wide - hole * hole) / 4.0
            rows.append(BillRow(kind, count, "", wide, wide, length, int(hole > 0.0), area, area * length * grams))
        return tuple(rows)

    def to_pandas(self) -> pd.DataFrame:
        """Return the bill of parts as a table."""
        import pandas as pd

        return pd.DataFrame(self.bill)

    def draw(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Draw the parts put together and apart, and write it to a file (.svg, .png, .pdf) if a path is given."""
        found: gs.Drawing = work("draw parts")(self, path, **options)
        return found

    def write(self, folder: str | Path, **options: Any) -> list[Path]:
        """Write drawings to cut, the bill and a picture; see :func:`graphsynth.formats.write_parts`."""
        found: list[Path] = work("write parts")(self, folder, picture=self.draw().svg, **options)
        return found

    @property
    def statement(self) -> str:
        """The result in one sentence."""
        pairs = " and ".join(self._touching)
        return self._proved + (f"; {pairs} touch by design, which is not part of it" if pairs else "")

    @property
    def _touching(self) -> list[str]:
        """Pairs of wheels that mesh, of cams and rollers."""
        return ["-".join(map(self.plan.label, pair)) for pair in self.plan.touching]

    @property
    def _proved(self) -> str:
        """What is said about gaps."""
        gap = (
            "no two parts share a layer"
            if np.isinf(self.gap)
            else f"at least {self.gap:.3g} mm between parts of a layer"
        )
        if self.certified:
            return f"certified: nothing collides over the whole motion, {gap}"
        return f"estimated at {int(self.motion.assembled.sum())} samples: nothing collides, {gap}; {self.reason}"

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        by_layer = [
            f"{k}: " + " ".join(self.plan.label(sheet) for sheet, own in enumerate(self.layers) if own == k)
            for k in range(self.count + 1)
        ]
        s = self.sizes
        undecided = [str(found) for found in self.collisions if found.status == "undecided"]
        rows = [
            ("links by layer", ", ".join(by_layer)),
            ("collisions", self._proved),
            (
                "sizes, mm",
                f"sheet {s.thickness:g}, pin {s.pin:g}, hole {s.hole:g}, wall {s.wall:g}, clearance {s.clearance:g}",
            ),
            (
                "pins",
                ", ".join(f"{row.number} x {row.height:g} mm ({row.part})" for row in self.bill if row.part in _PINS),
            ),
            ("mass", f"{sum(row.number * row.mass for row in self.bill):.3g} g of plywood and beech"),
        ]
        links = self.motion.mechanism.graph.links
        if self._touching:
            rows.insert(2, ("not proved", f"{', '.join(self._touching)}: they touch by design"))
        for sheet in reversed(range(links, len(self.layers))):
            if told := self.plan.wheel(sheet):
                rows.insert(1, (self.plan.label(sheet), told))
                continue
            joined = ", ".join(pin.name for pin in self.plan.pins if {sheet, self.plan.links[sheet]} <= set(pin.sheets))
            rows.insert(1, ("two sheets", f"link {self.plan.links[sheet]}, joined by the pin of joint {joined}"))
        if undecided:
            rows.append(("undecided", "; ".join(undecided)))
        return f"Parts of {links} links in {self.count} layers above the frame", rows

    def _picture(self) -> str:
        return self.draw().svg


_PINS = ("pin", "shaft", "guide", "dowel")


def turned(parts: Parts, link: int) -> complex:
    """Return the unit vector that lays the longest side of a link along x."""
    hull = parts.plan.outlines[link].hull
    sides = [q - p for p, q in zip(hull, hull[1:] + hull[:1])]
    longest = max(sides, key=abs)
    return longest.conjugate() / abs(longest) if longest else 1.0 + 0.0j


def sides(parts: Parts, link: int) -> tuple[float, float]:
    """Length and width of a link along its longest side and across."""
    outline, turn = parts.plan.outlines[link], turned(parts, link)
    low, high = outline.moved(turn, 0j).box
    return (high - low).real, (high - low).imag


def _body(moments: Moments, sheet: float) -> Body:
    """Return the body of a sheet of a mass per area; mm to m."""
    centre = moments.centroid * _MM
    return Body(sheet * moments.area * _MM**2, sheet * moments.central * _MM**4, (centre.real, centre.imag))
