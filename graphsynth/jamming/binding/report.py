"""The report of what binding costs: torque over the turn, loads and wear of the joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown, work
from graphsynth.mechanism.joints import Prismatic

if TYPE_CHECKING:
    import graphsynth as gs
    from graphsynth.jamming.binding.exact import ExactBinding
    from graphsynth.jamming.binding.parts import JointStiffness
    from graphsynth.jamming.joints.program import JointProblem
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]


class JointWear(NamedTuple):
    """Loads and wear of one joint over the motion; NaN where the size of its contacts is not known.

    ``moment`` (N m) and ``force`` (axial, N) are the largest; ``contact`` (N) the largest force at one end of the
    bearing; ``sliding`` (m) the distance that its surfaces slide; ``wear`` (N/m) pressure times that distance, with the
    pressure on half the length of the bearing; ``loss`` (J) the work of friction; ``push`` (N) the largest force in the
    plane, where the mechanism does not close without pressing its pins.
    """

    joint: tuple[int, int]
    moment: float
    force: float
    contact: float
    sliding: float
    wear: float
    loss: float
    push: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class BindingReport(Shown):
    """Result of `binding_torque` (estimated); arrays over the n inputs, NaN where the mechanism is not assembled.

    Attributes
    ----------
    energy : ndarray, shape (n,)
        Least elastic energy that closes the loops, J; 0 where no joint leaves its limits.
    elastic_torque, friction_torque : ndarray, shape (n,)
        Derivative of the energy by the driven coordinate (N m; of a driven guide N): what drives the mechanism into
        the tightness, and comes back behind it; losses, always against the motion.  Infinite where nothing gives way.
    moment, force : ndarray, shape (n, joints)
        Tilting moments and axial forces in the joints, N m and N.
    push, shift : ndarray, shape (n, joints)
        Forces of the joints in the plane (N), and shifts of their pins (in the mechanism's unit of length), where the
        mechanism does not close without them; else zero.
    tilt : ndarray, shape (n, names)
        Relative tilt of the joints in contact, radians; NaN where a joint is open within its limit.
    error : ndarray, shape (n,)
        Bound of the error of the loads, relative to those without any clearance (that of the optimum only).
    blocked : ndarray of bool, shape (n,)
        Where a misalignment meets neither clearance nor compliance.
    wear : tuple of JointWear
        Those that wear most first.
    motor_torque, unit : float or None, float
        What the motor can give; metres of the mechanism's unit of length.
    problem, springs, bent : JointProblem, tuple of JointStiffness, bool
        Limits and misalignments; stiffness of every joint; whether links have sections.
    """

    motion: Motion
    energy: Array
    elastic_torque: Array
    friction_torque: Array
    moment: Array
    force: Array
    tilt: Array
    error: Array
    push: Array
    shift: Array
    blocked: NDArray[np.bool_]
    names: tuple[tuple[tuple[int, int], str], ...]
    joints: tuple[tuple[int, int], ...]
    wear: tuple[JointWear, ...]
    motor_torque: float | None
    unit: float
    problem: JointProblem
    springs: tuple[JointStiffness, ...]
    bent: bool
    notes: tuple[str, ...] = ()
    seconds: float = field(default=0.0, compare=False)

    @property
    def inputs(self) -> Array:
        """Inputs of the motion, shape (n,)."""
        return self.motion.inputs

    @property
    def torque(self) -> Array:
        """Drive torque that binding costs, positive in the sense of the motion, shape (n,)."""
        sense = np.sign(self._rate() * (self.inputs[-1] - self.inputs[0]))
        return np.asarray(np.where(sense < 0.0, -1.0, 1.0) * self.elastic_torque + self.friction_torque)

    @property
    def contact(self) -> NDArray[np.bool_]:
        """Joints under load, shape (n, joints)."""
        return np.asarray((self.moment > 0.0) | (np.abs(self.force) > 0.0) | (self.push > 0.0))

    @property
    def peak_torque(self) -> float:
        """Largest torque at the samples in either sense of the motion; NaN if nothing is assembled."""
        size = np.abs(self.elastic_torque) + self.friction_torque
        return float(np.nanmax(size)) if np.isfinite(self.energy).any() or self.blocked.any() else math.nan

    @property
    def peak_input(self) -> float:
        """Input of the largest torque."""
        size = np.abs(self.elastic_torque) + self.friction_torque
        return math.nan if np.isnan(size).all() else float(self.inputs[int(np.nanargmax(size))])

    @property
    def share(self) -> float:
        """Share of the assembled inputs at which joints are pressed beyond their limits."""
        known = np.isfinite(self.energy) | self.blocked
        return float(np.mean((self.energy > 0.0)[known] | self.blocked[known])) if known.any() else math.nan

    @property
    def loss(self) -> float:
        """Work of friction over the motion, J; the elastic part of a full rotation returns to zero."""
        return float(np.nansum([row.loss for row in self.wear]))

    @property
    def work_error(self) -> float:
        """How finely the motion is sampled: work of the elastic torque less the change of energy, over all work.

        By the rule of trapezoids over the samples; NaN where there is no work.
        """
        power = self.elastic_torque * self._rate()
        good = np.isfinite(power)
        if good.sum() < 2 or not np.any(power[good]):
            return math.nan
        u, power, energy = self.inputs[good], power[good], self.energy[good]
        total = abs(float(np.trapezoid(np.abs(power), u)))
        return abs(float(np.trapezoid(power, u)) - float(energy[-1] - energy[0])) / total

    def _rate(self) -> Array:
        """Rate of the driven coordinate by the input, as in `binding_torque`."""
        from graphsynth.jamming.binding.rows import driven_rate

        return driven_rate(self.motion, self.unit)

    @property
    def answer(self) -> str:
        """Return "free", "binds", "blocks", or "not assembled"."""
        peak = self.peak_torque
        if math.isnan(peak):
            return "not assembled"
        if self.blocked.any() or (self.motor_torque is not None and peak > self.motor_torque):
            return "blocks"
        return "binds" if bool(np.nanmax(self.energy) > 0.0) else "free"

    @property
    def statement(self) -> str:
        """The answer in one sentence."""
        if self.answer == "not assembled":
            return f"The parts cannot be assembled: {self.motion.reason}."
        if self.answer == "free":
            return "Estimated: free, no joint is pressed beyond its limits."
        at, peak = self._place(self.peak_input), f"{self.peak_torque:.4g} {self._effort}"
        if self.blocked.any():
            return f"Estimated: blocks, at input {at} nothing gives way: neither clearance nor compliance."
        if self.answer == "blocks":
            return f"Estimated: blocks, {peak} at input {at} exceed the motor's {self.motor_torque:.4g} {self._effort}."
        given = "" if self.motor_torque is None else f"; the motor gives {self.motor_torque:.4g} {self._effort}"
        return f"Estimated: binds with at most {peak}, at input {at}{given}."

    @property
    def _linear(self) -> bool:
        """Whether a guide is driven."""
        return isinstance(self.motion.mechanism.joint(*self.motion.mechanism.drivers[0].pair), Prismatic)

    @property
    def _effort(self) -> str:
        return "N" if self._linear else "N m"

    def _place(self, value: float) -> str:
        return f"{value:.6g}" if self._linear else f"{math.degrees(value):.4g}°"

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [("model", "small tilts, least elastic energy beyond the limits"), *self._figures()]
        rows += [("unit", f"mechanism in {self.unit:g} m; torques N m")] if self.unit != 1.0 else []
        rows += [("note", note) for note in self.notes[:1]]
        return self.statement, [*rows, ("more", ".plot(), .wear, .details(), .to_pandas()")]

    def _figures(self) -> list[tuple[str, str]]:
        if self.answer in ("free", "not assembled"):
            return []
        rows = [
            ("contact", f"over {100.0 * self.share:.3g} % of the inputs"),
            ("energy", f"{np.nanmax(self.energy[~self.blocked], initial=0.0):.4g} J at most"),
        ]
        if self.loss > 0.0:
            rows.append(("friction", f"{self.loss:.4g} J lost over the motion"))
        for row in self.wear[:3]:
            told = f"moment {row.moment:.4g} N m"
            told += f", axial force {row.force:.4g} N" if row.force > 0.0 else ""
            told += f", force in the plane {row.push:.4g} N" if row.push > 0.0 else ""
            told += f", contact {row.contact:.4g} N, wear {row.wear:.4g} N/m" if row.wear > 0.0 else ""
            rows.append((f"joint {row.joint[0]}-{row.joint[1]}", told))
        return rows

    def exact(self, samples: Sequence[int] | None = None) -> ExactBinding:
        """Solve some samples again with every loop closed exactly in space, as a check of small tilts (rigid links).

        ``samples`` are numbers of assembled samples, by default all that close without their pins shifted.
        `GeometryError` for links with sections, samples with shifted pins (the closure has none), or joints that it
        does not describe.
        """
        from graphsynth.jamming.binding.exact import exact_binding
        from graphsynth.jamming.space.model import Unsupported

        if self.bent:
            raise GeometryError("links have sections; the exact closure takes them as rigid: leave links out")
        aside = np.asarray((self.shift > 0.0).any(axis=1))
        whole = np.flatnonzero(self.motion.assembled & ~aside)
        chosen = whole if samples is None else np.asarray(samples, dtype=np.intp)
        if aside[chosen].any():
            name = f"sample {chosen[aside[chosen]][0]} closes only with its pins shifted"
            raise GeometryError(f"{name}, which the exact closure leaves out; leave it out too")
        try:
            return exact_binding(self.problem, self.springs, self.motion.poses[chosen], self.unit)
        except Unsupported as error:
            raise GeometryError(str(error)) from error

    def details(self) -> str:
        """Return all figures, all joints and all notes in words."""
        rows = [*self._figures(), ("sampling", f"work of the torque off by {self.work_error:.2g} of all work")]
        if self.loss > 0.0:
            rows.append(("contacts", "a moment presses on both ends of its bearing, an axial force on its face"))
        rows += [("note", note) for note in self.notes] + [("run time", f"{self.seconds:.2f} s")]
        wide = max(len(name) for name, _ in rows)
        return "\n".join([self.statement, *(f"  {name:<{wide}}  {value}" for name, value in rows)])

    def summary(self) -> dict[str, Any]:
        """Plain values (numbers, strings, lists) for a report or a JSON file."""
        names = ("answer", "statement", "peak_torque", "peak_input", "motor_torque", "loss", "work_error", "unit")
        return {
            **{name: getattr(self, name) for name in names},
            "largest_energy": float(np.nanmax(self.energy, initial=0.0)),
            "wear": [row._asdict() | {"joint": list(row.joint)} for row in self.wear],
            "notes": list(self.notes),
            "seconds": self.seconds,
        }

    def to_pandas(self) -> Any:
        """Return a table over the inputs: energy, torques, moment and axial force of every joint."""
        import pandas as pd

        columns = {name: getattr(self, name) for name in ("energy", "elastic_torque", "friction_torque", "torque")}
        columns = {"input": self.inputs, **columns, "blocked": self.blocked}
        for k, (a, b) in enumerate(self.joints):
            columns |= {f"moment_{a}_{b}": self.moment[:, k], f"force_{a}_{b}": self.force[:, k]}
            columns |= {f"push_{a}_{b}": self.push[:, k], f"shift_{a}_{b}": self.shift[:, k]}
        return pd.DataFrame(columns)

    def plot(self, *, ax: Any = None) -> gs.Chart:
        """Plot the torque over the inputs, with the ranges of contact; a chart that shows itself in a notebook."""
        x = self.inputs if self._linear else np.degrees(self.inputs)
        line, band = work("chart line"), work("chart band")
        lines = [line(x, self.torque, "drive torque", "a")]
        if np.nanmax(self.friction_torque, initial=0.0) > 0.0:
            lines.append(line(x, self.elastic_torque, "elastic part", "soft", "--"))
        levels = [] if self.motor_torque is None else [line([x[0]], [self.motor_torque], "motor", "ink", ":")]
        bands = [band(a, b, "contact" if k == 0 else "", "c") for k, (a, b) in enumerate(self._runs(self.energy > 0.0))]
        bands += [band(a, b, "blocks" if k == 0 else "", "jam") for k, (a, b) in enumerate(self._runs(self.blocked))]
        label = "driver displacement [length]" if self._linear else "driver angle [°]"
        name = f"{'force' if self._linear else 'torque'} of binding [{self._effort}]"
        chart: gs.Chart = work("chart")(lines, label, name, bands, (), levels)
        if ax is not None:
            chart.draw(ax)
        return chart

    def _runs(self, where: NDArray[np.bool_]) -> list[tuple[float, float]]:
        """Ranges of the plotted inputs in which a condition holds, from half a step before to half a step after."""
        x = self.inputs if self._linear else np.degrees(self.inputs)
        edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
        change = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
        return [(float(edges[a]), float(edges[b])) for a, b in zip(change[::2], change[1::2])]

    def _picture(self) -> str:
        return self.plot().svg() if np.isfinite(self.torque).any() else ""
