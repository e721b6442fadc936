"""Methods of a `Motion`: its instantaneous kinematics, and what rooms above show and say of it.

Derivatives are by the input, as in the motion; what is geometry (poles, the inflection circle) does not depend on it.
Estimated: float64, NaN where the branch does not reach, infinite where a link does not turn.

References
----------
[Bottema & Roth 1979], chapter 8; [Hunt 1978]; [Uicker et al. 2003], chapters 3 and 4.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import link_number
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown, work
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    import graphsynth as gs  # what methods give back that is made in rooms above, by its public name
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class GroupSamples(dict[int, Array]):
    """Arrays by the number of a group, which show their ranges."""

    def __repr__(self) -> str:
        shown = (f"{k}: {np.nanmin(v):.4g} to {np.nanmax(v):.4g} in {len(v)} samples" for k, v in self.items())
        return f"{{{', '.join(shown)}}}"


class Polodes(NamedTuple):
    """Fixed polode (in the frame of the base) and moving polode (in the frame of the link), each (n, 2)."""

    fixed: Array
    moving: Array

    def __repr__(self) -> str:
        return f"Polodes of {len(self.fixed)} samples: fixed, moving"


class Circles(NamedTuple):
    """A circle at every sample: ``centre`` (n, 2) in the base's frame, ``diameter`` (n,), ``pole`` (n, 2) on it."""

    centre: Array
    diameter: Array
    pole: Array

    def __repr__(self) -> str:
        return f"Circles at {len(self.pole)} samples: centre, diameter, pole"


def _points(z: Complex) -> Array:
    return np.column_stack([z.real, z.imag])


class MotionMethods(Shown):
    """Methods that every `Motion` has.

    Where they take `link` and `base`, the motion of the link against the base is meant, the frame by default;
    `GeometryError` for links that do not exist, or are the same.
    """

    if TYPE_CHECKING:
        mechanism: Mechanism
        inputs: Array
        poses: Array
        velocities: Array
        accelerations: Array
        events: tuple[Any, ...]
        completed: bool
        reason: str
        closure: Any
        residual: Any

        def transmission_angle(self) -> GroupSamples: ...  # noqa: D102

    # --- instantaneous kinematics

    def _relative(self, link: int, base: int | None) -> tuple[list[Complex], list[Array], Complex, Complex]:
        """Place of a link's origin in the frame of the base and its angle, both with two derivatives; direction, pole.

        The pole is ``I = r + i r' / theta'`` with the relative place r of the link's origin and its relative angle.
        """
        mechanism = self.mechanism
        link = link_number("link", link)
        base = mechanism.frame if base is None else link_number("base", base)
        if max(link, base) >= mechanism.graph.links or link == base:
            raise GeometryError(f"links {link} and {base}: give two of the links 0..{mechanism.graph.links - 1}")
        arrays = (self.poses, self.velocities, self.accelerations)
        angle, rate, second = (array[:, link, 2] - array[:, base, 2] for array in arrays)
        d, d1, d2 = (
            array[:, link, 0] - array[:, base, 0] + 1j * (array[:, link, 1] - array[:, base, 1]) for array in arrays
        )
        w, a = self.velocities[:, base, 2], self.accelerations[:, base, 2]
        back = np.exp(-1j * self.poses[:, base, 2])
        # derivatives of back * d, with back' = -i w back
        place = [back * d, back * (d1 - 1j * w * d), back * (d2 - 2j * w * d1 - (1j * a + w * w) * d)]
        with np.errstate(divide="ignore", invalid="ignore"):
            pole = np.where(rate == 0.0, complex(math.inf, math.inf), place[0] + 1j * place[1] / rate)
        return place, [angle, rate, second], np.exp(1j * angle), pole

    def instant_centre(self, link: int, base: int | None = None) -> Array:
        """Return the velocity pole of a link, shape (n, 2), in the frame of the base; infinite where it translates."""
        return _points(self._relative(link, base)[3])

    def polodes(self, link: int, base: int | None = None) -> Polodes:
        """Return the polodes (centrodes) of a link: its motion is the rolling of one on the other."""
        place, _, direction, pole = self._relative(link, base)
        with np.errstate(invalid="ignore"):
            return Polodes(_points(pole), _points((pole - place[0]) / direction))

    def inflection_circle(self, link: int, base: int | None = None) -> Circles:
        """Return the inflection circle of a link: its points pass an inflection of their path, they run straight.

        It passes through the instant centre I; the other end of its diameter is the inflection pole
        ``I + a_I / theta'^2``, with the acceleration a_I of the point of the link that lies at I.
        """
        return self._circles(link, base, False)

    def bresse_circle(self, link: int, base: int | None = None) -> Circles:
        """Return the second circle of Bresse of a link: its points have no tangential acceleration.

        Together with the inflection circle, the first circle of Bresse, it passes through the instant centre and the
        acceleration pole.  It depends on the angular acceleration, so on the input: it is that of a uniform input,
        infinite where the angular acceleration is 0.
        """
        return self._circles(link, base, True)

    def _circles(self, link: int, base: int | None, second: bool) -> Circles:
        """Return a circle of Bresse; its diameter follows from the acceleration at the pole."""
        place, turn, _, pole = self._relative(link, base)
        with np.errstate(divide="ignore", invalid="ignore"):
            a = place[2] + (1j * turn[2] - turn[1] ** 2) * (pole - place[0])
            across = 1j * a / turn[2] if second else a / turn[1] ** 2
            return Circles(_points(pole + 0.5 * across), np.abs(across), _points(pole))

    def transmission_index(self) -> GroupSamples:
        """Return the transmission index of every dyad with two modes, by group: the sine of its transmission angle.

        1 where force is handed on best, 0 in a dead-centre position [Sutherland & Roth, J. Eng. Ind. 95 (1973)
        589-597, for planar linkages].
        """
        return GroupSamples((group, np.sin(angle)) for group, angle in self.transmission_angle().items())

    def mechanical_advantage(self, link: int) -> Array:
        """Return effort on a link over effort of the driver, without losses, shape (n,) [Norton 2004, chapter 6].

        The link turns about the frame, or slides on it.  The ratio is ``q' / s'``, rate of the driver over that of the
        link (virtual power); angles count in radians, so torque over torque, or force over torque in units of 1 /
        length.  Infinite where the link rests.  `GeometryError` for several drivers, or a link that is not jointed to
        the frame.
        """
        mechanism = self.mechanism
        if len(mechanism.drivers) != 1:
            raise GeometryError(f"the mechanism has {len(mechanism.drivers)} drivers; mechanical advantage needs one")
        driver = mechanism.drivers[0]
        with np.errstate(divide="ignore"):
            return np.asarray(self._rate(driver.base, driver.link) / self._rate(mechanism.frame, link))

    def _rate(self, base: int, link: int) -> Array:
        """Rate of the coordinate of a joint."""
        joint = self.mechanism.joint(base, link)
        place, turn, direction, _ = self._relative(link, base)
        if not isinstance(joint, Prismatic):
            return turn[1]
        first = joint.a == base
        at = complex(*(joint.at_b if first else joint.at_a))
        along = np.exp(1j * (joint.angle_a if first else joint.angle_b))
        return np.asarray(((place[1] + 1j * turn[1] * direction * at) / along).real)

    # --- what is done in rooms above: pictures, binding, forces

    def plot(self, of: str | int | None = None, order: int = 0, *, ax: Any = None) -> gs.Chart:
        """Plot paths of the named points, or coordinates over the input; a chart that shows itself in a notebook.

        `of` is a named point, or a link: its x and y, its angle or displacement over the input.  Without it the paths
        of all named points; if there are none, the coordinates of the undriven links on the frame.  `order` 1 and 2
        are first and second derivatives by the input.  The chart is drawn on the matplotlib axes `ax` too.
        """
        chart: gs.Chart = work("plot motion")(self, of, order)
        if ax is not None:
            chart.draw(ax)
        return chart

    def animate(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Animate the motion: an SVG that moves by itself and shows itself in a notebook.

        It is written if a path is given: ``.html``, a page with a player; ``.svg``; ``.gif``.  Options: ``frames``,
        ``seconds``, ``title``, ``width``, ``height`` as for :func:`graphsynth.drawing.animation.animation_html`.
        `GraphsynthError` for another suffix, or if nothing of the motion is assembled.
        """
        found: gs.Drawing = work("animate motion")(self, path, **options)
        return found

    def draw(self, path: str | Path | None = None, sample: int = 0, **options: Any) -> gs.Drawing:
        """Draw the mechanism at one sample with the paths of its named points; see `Mechanism.draw`."""
        found: gs.Drawing = work("draw motion")(self, path, sample, **options)
        return found

    def assess_jamming(self, *, tilt: Any, joints: Any, **options: Any) -> gs.CoupledReport:
        """Assess whether the joints bind if an axis is tilted; see :func:`graphsynth.assess_jamming`.

        ``motion.assess_jamming(tilt="0.5 deg", joints="1 deg")``: the axis of the first driver is tilted by half a
        degree, and every joint allows a tilt of one degree.
        """
        found: gs.CoupledReport = work("assess jamming")(self, tilt=tilt, joints=joints, **options)
        return found

    def binding(self, *, tilt: Any, joints: Any, **options: Any) -> gs.BindingReport:
        """Return what a tilted axis costs where the joints bind; see :func:`graphsynth.binding_torque`.

        ``motion.binding(tilt="2 deg", joints="0.3 deg", stiffness=2000.0)``: each joint resists with 2000 N m for each
        radian beyond 0.3 degrees.
        """
        found: gs.BindingReport = work("binding torque")(self, tilt=tilt, joints=joints, **options)
        return found

    def forces(self, loads: Mapping[str | int, Any], **options: Any) -> gs.StaticForces:
        """Return the static forces in all joints under loads, as in ``motion.forces({"P": (0.0, -100.0)})``.

        See :func:`graphsynth.dynamics.inverse.static_forces`.
        """
        found: gs.StaticForces = work("static forces")(self, loads, **options)
        return found

    def parts(self, **options: Any) -> gs.Parts:
        """Make parts of the links, in layers where nothing collides; see :func:`graphsynth.parts`."""
        found: gs.Parts = work("parts")(self, **options)
        return found

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        mechanism, u = self.mechanism, self.inputs
        rows = []
        for driver in mechanism.drivers[:2]:
            angular = not isinstance(mechanism.joint(*driver.pair), Prismatic)
            ends = [f"{math.degrees(v):.6g}°" if angular else f"{v:.6g}" for v in (u[0], u[-1])]
            rows.append((f"driver {driver.base}-{driver.link}", f"input {ends[0]} to {ends[1]}, {len(u)} samples"))
        closed = self.closure.statement if self.closure.tested else "completed; no full rotation"
        rows.append(("motion", closed if self.completed else f"ends: {self.reason}"))
        counted = Counter(event.kind for event in self.events)
        if counted:
            rows.append(("events", ", ".join(f"{n} x {kind}" if n > 1 else kind for kind, n in counted.items())))
        rows.append(("joints close to", f"{self.residual:.1e} of the mechanism's size"))
        return f"Motion of a mechanism of {mechanism.graph.links} links (estimated: float64)", rows

    def _picture(self) -> str:
        picture: str = work("motion picture")(self)
        return picture
