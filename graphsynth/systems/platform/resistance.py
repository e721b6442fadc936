"""The claim about the armature resistance: when a larger one calms the speed, and that it always calms the torque.

With pictures: the claim as a map, ripples over the resistance, the simulated truth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array, not_negative, whole
from graphsynth.core.errors import SpecError
from graphsynth.drawing.drive_pictures import COLOURS, STYLES, panel
from graphsynth.drawing.palette import WHITE
from graphsynth.drawing.plots import new_figure
from graphsynth.dynamics.motors import DCMotor
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ResistanceEffect:
    """Effect of the armature resistance on the steady ripples; peak to peak, speed in rad/s, current in A.

    ``speed_falls`` is the linear criterion ``Om > w_n/sqrt(2)`` at the mean speed (the same for every resistance);
    ``speed`` and ``current`` are the linear predictions, ``simulated_speed`` and ``simulated_current`` those of the
    full model (NaN if not asked for, or where the run failed).
    """

    resistance: Array
    mean_speed: float
    mean_inertia: float
    natural_frequency: float
    forcing_frequency: float
    harmonic: int
    damping: Array
    speed_falls: bool
    current_falls: bool
    speed: Array
    current: Array
    simulated_speed: Array
    simulated_current: Array

    @property
    def frequency_ratio(self) -> float:
        """``Om / w_n``."""
        return self.forcing_frequency / self.natural_frequency


def ripple_gain(ratio: ArrayLike, damping: ArrayLike) -> tuple[Array, Array]:
    """Dimensionless linear gains of speed and torque over the frequency ratio ``Om/w_n`` and the damping ``zeta``.

    ``|dw| sqrt(J_m K_c / L) / F`` and ``|dM| / F`` for a torque disturbance of amplitude F; arrays broadcast.

    With ``nu = Om/w_n``: ``(4 zeta^2 + nu^2) / ((1 - nu^2)^2 + 4 zeta^2 nu^2)`` and ``1`` over the same denominator.
    The derivative of the first by zeta^2 has the sign of ``1 - 2 nu^2``: theory/motor-drive 5.

    >>> speed, torque = ripple_gain(2**-0.5, [0.1, 1.0, 10.0])
    >>> speed.round(12).tolist()
    [1.414213562373, 1.414213562373, 1.414213562373]
    """
    nu2, z2 = np.square(np.asarray(ratio, dtype=np.float64)), 4.0 * np.square(np.asarray(damping, dtype=np.float64))
    below = np.square(1.0 - nu2) + z2 * nu2
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((z2 + nu2) / below)), np.asarray(1.0 / np.sqrt(below))


def resistance_effect(
    drive: MotorDrivenPlatform, resistances: Sequence[float], *, simulate: bool = False, revolutions: int = 40
) -> ResistanceEffect:
    """Linear criterion, predicted ripples and, on request, those of the full model for several resistances.

    Parameters
    ----------
    drive : MotorDrivenPlatform
        With a `DCMotor` whose inductance is positive; its resistance is replaced by each of ``resistances`` (ohm).
    resistances : sequence of float
        Armature resistances, ohm.
    simulate : bool, optional
        Also integrate the full model from rest and measure over the second half.
    revolutions : int, optional
        Mean revolutions of that run.

    Returns
    -------
    ResistanceEffect
        Arrays in the order of ``resistances``: speeds rad/s, torques N m (estimated).

    Raises
    ------
    SpecError
        Another motor, no inductance, no variation of the inertia, a resistance that is negative.

    Notes
    -----
    See theory/motor-drive 5, with the train included and the largest harmonic of J.

    Examples
    --------
    >>> motor = DCMotor(1.0, 0.01, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> effect = resistance_effect(MotorDrivenPlatform.source(motor), [0.5, 20.0])
    >>> effect.speed_falls, effect.speed.round(2).tolist()
    (False, [0.65, 9.73])
    """
    if not isinstance(drive.motor, DCMotor) or drive.motor.inductance == 0.0:
        raise SpecError("the effect of the resistance needs a DCMotor with positive inductance; give one")
    motor = _armature(drive)
    if 0.0 in (motor.gain, motor.speed, motor.torque_constant):
        raise SpecError(
            f"gain = {motor.gain:g}, speed = {motor.speed:g} and torque_constant = {motor.torque_constant:g} must not "
            "vanish: the machine would stand still; give what drives it"
        )
    values = np.array([not_negative("resistance", r, SpecError) for r in resistances])
    if values.size == 0:
        raise SpecError("there is no resistance to try; give at least one, in ohm")
    ratio, feedback = drive.train.ratio, motor.gain + motor.emf_constant
    harmonic, amplitude, mean = _harmonic(drive)
    inertia = drive.constant_inertia + mean
    stiffness = ratio**2 * motor.torque_constant * feedback
    w = motor.gain * motor.speed / feedback / ratio
    natural = math.sqrt(stiffness / (motor.inductance * inertia))
    damping = 0.5 * values * math.sqrt(inertia / (motor.inductance * stiffness))
    forcing = abs(harmonic * w)
    force = 0.5 * harmonic * amplitude * w * w
    speed, torque = ripple_gain(forcing / natural, damping)
    size = 2.0 * force * math.sqrt(motor.inductance / (inertia * stiffness))
    found = np.full((values.size, 2), np.nan)
    if simulate:
        for k, value in enumerate(values):
            found[k] = steady_ripple(replace(drive, motor=replace(motor, resistance=float(value))), revolutions)
    calms, ripple = forcing > natural / math.sqrt(2.0), np.asarray(size * speed)
    current = np.asarray(2.0 * force * torque / (ratio * motor.torque_constant))
    return ResistanceEffect(
        values, w, inertia, natural, forcing, harmonic, damping, calms, True, ripple, current, found[:, 0], found[:, 1]
    )


@dataclass(frozen=True, eq=False)
class RippleMap:
    """Simulated steady ripples over inductance (rows) and resistance (columns), and where the claim holds.

    ``speed`` (rad/s) and ``current`` (A) are peak to peak, NaN after a failure; ``speed_slope`` and ``current_slope``
    (n_L, n_r - 1) are ``d ln(ripple) / d ln(r)`` between neighbours: the claim holds where they are negative.
    ``frequency_ratio`` (n_L,) is ``Om / w_n``; the linear condition is that it exceeds ``1 / sqrt(2)``.
    """

    resistance: Array
    inductance: Array
    frequency_ratio: Array
    speed: Array
    current: Array
    speed_slope: Array
    current_slope: Array

    @property
    def agreement(self) -> float:
        """Share of the map on which the linear condition tells the sign of the simulated slope of the speed ripple."""
        falls = self.speed_slope < 0.0
        known = np.isfinite(self.speed_slope)
        said = np.broadcast_to((self.frequency_ratio > math.sqrt(0.5))[:, None], falls.shape)
        return float((falls == said)[known].mean()) if known.any() else math.nan


def ripple_map(
    drive: MotorDrivenPlatform, resistances: Sequence[float], inductances: Sequence[float], *, revolutions: int = 40
) -> RippleMap:
    """Simulate the steady ripples over resistances (ohm) and inductances (H): the claim's true condition as a map.

    Raises `SpecError`: as `resistance_effect`; fewer than two resistances, or not in increasing order.

    >>> drive = MotorDrivenPlatform.source(DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0))
    >>> (ripple_map(drive, [5.0, 20.0], [0.2, 0.01]).speed_slope < 0.0).tolist()
    [[True], [False]]
    """
    r, L = finite_array("resistances", resistances, SpecError), finite_array("inductances", inductances, SpecError)
    if r.ndim != 1 or r.size < 2 or not (np.diff(r) > 0.0).all() or r[0] <= 0.0:
        raise SpecError(f"resistances of shape {r.shape} must be two or more increasing positive numbers; give ohm")
    motor = _armature(drive)
    drives = (replace(drive, motor=replace(motor, inductance=float(x))) for x in L)
    effects = [resistance_effect(own, r.tolist(), simulate=True, revolutions=revolutions) for own in drives]
    speed, current = (np.array([getattr(e, f"simulated_{name}") for e in effects]) for name in ("speed", "current"))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = [np.diff(np.log(values), axis=1) / np.diff(np.log(r)) for values in (speed, current)]
    ratio = np.array([effect.frequency_ratio for effect in effects])
    return RippleMap(r, L, ratio, speed, current, slopes[0], slopes[1])


def _harmonic(drive: MotorDrivenPlatform) -> tuple[int, float, float]:
    """Return number and amplitude of the harmonic of J whose derivative is largest, and the mean of J."""
    count = 4 * drive.inertia.rows.shape[1] + 8
    values = drive.inertia.value(np.linspace(0.0, math.tau, count, endpoint=False))
    spectrum = 2.0 * np.abs(np.fft.rfft(values)) / count
    harmonic = int(np.argmax(np.arange(spectrum.size) * spectrum))
    if not spectrum[1:].max() > 1e-14 * spectrum[0]:
        raise SpecError("the inertia does not vary over a turn: there is no ripple to speak of; give a moving mass")
    return harmonic, float(spectrum[harmonic]), float(0.5 * spectrum[0])


def steady_ripple(drive: MotorDrivenPlatform, revolutions: int = 40, rtol: float = 1e-9) -> tuple[float, float]:
    """Peak-to-peak speed (rad/s) and current (A) in the second half of ``revolutions`` mean revolutions from rest.

    Estimated: 240 samples per mean revolution, the extremes through parabolas.  NaN if the run fails.

    Raises `SpecError` for a motor that is no DCMotor.
    """
    motor = _armature(drive)
    whole("revolutions", revolutions, 1, error=SpecError)
    free = motor.gain * motor.speed
    if free == 0.0:
        raise SpecError(
            f"gain = {motor.gain:g} and speed = {motor.speed:g} leave the machine at rest; give both another value"
        )
    w = abs(free / (motor.gain + motor.emf_constant) / drive.train.ratio)
    end = revolutions * math.tau / w
    times = np.concatenate([[0.0], np.linspace(0.5 * end, end, 120 * revolutions + 1)])
    motion = drive.simulate(times, rtol=rtol, estimate=False, reduce=False)
    if not motion.complete:
        return math.nan, math.nan
    return _peak_to_peak(motion.speed[1:]), _peak_to_peak(motion.currents[1:, 0])


def _armature(drive: MotorDrivenPlatform) -> DCMotor:
    """Motor of a drive whose crank speed is bounded; `SpecError` for another motor or drive."""
    if not isinstance(drive.motor, DCMotor):
        raise SpecError(f"{type(drive.motor).__name__} has no armature; give a DCMotor")
    if drive.constant_inertia == 0.0 and drive.inertia.dead_centres:
        raise SpecError("without inertia the crank speed is unbounded at dead centres: no ripple; give J_0 > 0")
    return drive.motor


def _peak_to_peak(values: Array) -> float:
    left, middle, right = values[:-2], values[1:-1], values[2:]
    bend = left - 2.0 * middle + right
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = middle - 0.125 * (right - left) ** 2 / bend
    peak = (middle >= left) & (middle >= right) & (bend < 0.0)
    low = (middle <= left) & (middle <= right) & (bend > 0.0)
    highest = max(values.max(), *vertex[peak])
    lowest = min(values.min(), *vertex[low])
    return float(highest - lowest)


def resistance_picture(effects: Mapping[str, ResistanceEffect], *, size: tuple[float, float] = (10.0, 4.4)) -> Figure:
    """Draw the resistance claim as a map, and ripples over the resistance: linear (lines) and simulated (dots).

    The map shows the linear speed gain over ``Om/w_n`` and ``zeta``; left of the bar at 1/sqrt(2) a larger resistance
    raises the speed ripple, right of it the ripple falls.

    `effects`: label and effect, for example one for each inductance. `size`: inches. Raises `SpecError` without any
    effect.
    """
    if not effects:
        raise SpecError("there is no effect to draw; give at least one result of resistance_effect")
    figure = new_figure(size)
    chart, ripples = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _gain_map(figure, chart)
    for label, effect in effects.items():
        chart.plot(np.full(effect.damping.size, effect.frequency_ratio), effect.damping, "o-", ms=3, lw=0.8, color="k")
        top, look = (effect.frequency_ratio, effect.damping.max()), {"fontsize": 7, "color": WHITE}
        chart.annotate(label, top, xytext=(3, 3), textcoords="offset points", **look)
    _ripples(ripples, effects, "speed")
    return figure


def ripple_picture(
    effects: Mapping[str, ResistanceEffect], of: str = "speed", *, size: tuple[float, float] = (5.4, 3.4)
) -> Figure:
    """Ripples of the speed or the current over the resistance: linear (lines) and simulated (dots).

    Raises `SpecError` without any effect, or for another quantity.
    """
    if not effects or of not in ("speed", "current"):
        raise SpecError(f"there is nothing to draw of {of!r}; give effects, and 'speed' or 'current'")
    figure = new_figure(size)
    _ripples(figure.add_subplot(), effects, of)
    return figure


def _log_axes(axes: Any, x: str, y: str, xticks: tuple[float, ...], yticks: tuple[float, ...]) -> None:
    """Logarithmic axes with a few ticks inside the view, written plainly."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    for axis, ticks in ((axes.xaxis, xticks), (axes.yaxis, yticks)):
        low, high = sorted(axis.get_view_interval())
        shown = [tick for tick in ticks if low <= tick <= high]
        axis.set_ticks(shown, [f"{tick:g}" for tick in shown])
        axis.set_ticks([], minor=True)


def _ripples(axes: Any, effects: Mapping[str, ResistanceEffect], of: str) -> None:
    for k, (label, effect) in enumerate(effects.items()):
        colour = COLOURS[k % 6]
        axes.loglog(effect.resistance, getattr(effect, of), color=colour, ls=STYLES[k % 6], lw=1.3, label=label)
        axes.loglog(effect.resistance, getattr(effect, f"simulated_{of}"), "o", ms=4, color=colour)
    unit = "rad/s" if of == "speed" else "A"
    title = f"{of} ripple: linear (lines), simulated (dots)"
    panel(axes, title, "armature resistance [ohm]", f"peak to peak [{unit}]")
    axes.legend(fontsize=8, frameon=False)


def ripple_map_picture(found: RippleMap, *, size: tuple[float, float] = (5.4, 4.0)) -> Figure:
    """Draw the simulated truth of the claim: slope of the speed ripple over the resistance; bar: the linear condition.

    Blue: the ripple falls with a larger resistance; red: it rises; grey: no result.
    """
    figure = new_figure(size)
    axes = figure.add_subplot()
    middle = np.sqrt(found.resistance[1:] * found.resistance[:-1])
    order = np.argsort(found.frequency_ratio)
    axes.set_facecolor("#999999")
    shown: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -1.0, "vmax": 1.0, "rasterized": True}
    cells = (_edges(middle), _edges(found.frequency_ratio[order]), found.speed_slope[order])
    drawn = axes.pcolormesh(*cells, **shown)
    figure.colorbar(drawn, ax=axes, extend="both").set_label("d ln(speed ripple) / d ln r")
    axes.axhline(1.0 / math.sqrt(2.0), color="#111111", lw=2.0)
    axes.text(axes.get_xlim()[0] * 1.1, 0.73, "linear: falls above", fontsize=8, color="#111111")
    ticks = ((0.5, 1, 2, 5, 10, 20), (0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2))
    _log_axes(axes, "armature resistance [ohm]", "Ω/ω_n", *ticks)
    return figure


def _edges(centres: Any) -> Any:
    """Borders of cells around centres, evenly between them in the logarithm."""
    log = np.log(centres)
    if log.size == 1:
        return np.exp([log[0] - 0.3, log[0] + 0.3])
    inner = 0.5 * (log[1:] + log[:-1])
    return np.exp(np.concatenate([[2.0 * log[0] - inner[0]], inner, [2.0 * log[-1] - inner[-1]]]))


def _gain_map(figure: Figure, axes: Any) -> None:
    nu, zeta = np.geomspace(0.1, 3.0, 181), np.geomspace(0.02, 8.0, 161)
    gain = np.log10(ripple_gain(nu[None, :], zeta[:, None])[0])
    drawn = axes.contourf(nu, zeta, gain, levels=np.linspace(-1.0, 1.6, 14), cmap="viridis", extend="both")
    figure.colorbar(drawn, ax=axes).set_label("log10 of the speed gain")
    axes.axvline(1.0 / math.sqrt(2.0), color=WHITE, lw=2.0)
    for x, text in ((0.26, "ripple rises with r"), (1.4, "ripple falls with r")):
        axes.text(x, 0.024, text, color=WHITE, fontsize=8, ha="center")
    axes.set_xlim(nu[0], nu[-1])
    axes.set_ylim(zeta[0], zeta[-1])
    _log_axes(axes, "Ω/ω_n", "damping ratio ζ", (0.1, 0.2, 0.5, 1, 2, 3), (0.02, 0.1, 0.5, 1, 5))
    axes.set_title("speed gain; bar: Ω = ω_n/√2", fontsize=10)
