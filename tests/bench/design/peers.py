"""What others would do in the same processor time: scipy's differential evolution, and pylinkage's particle swarm.

Differential evolution has the unknowns of the literature: lengths, place and direction of the frame, crank angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from tests.bench.design import measure
from tests.bench.design.four_bars import FourBar, of_lengths
from tests.bench.design.search import Result, of_four_bar
from tests.bench.design.tasks import Trial

Array = NDArray[np.float64]
#: Members of a population, of a swarm; cost of what does not turn; samples of a turn that is looked at.
_MEMBERS, _SWARM, _WRONG, _TURN = 100, 60, 1e6, np.linspace(0.0, 2.0 * np.pi, 121)
#: A cost of many sets (n, sets) -> (sets,), bounds, and how to read one set.
Model = tuple[Callable[[Array], Array], list[tuple[float, float]], Callable[[Array], FourBar | None]]


def evolved(trial: Trial, seconds: float) -> Result:
    """Run differential evolution, with another seed whenever it has converged, and keep the best."""
    begin, seed, best, bar = process_time(), 0, math.inf, None
    costs, bounds, read = _model(trial)

    def spent(*_: object, **__: object) -> bool:
        return process_time() - begin > seconds

    while not spent():
        found = differential_evolution(
            costs, bounds, popsize=max(4, -(-_MEMBERS // len(bounds))), maxiter=10**7, tol=1e-8, rng=seed,
            vectorized=True, updating="deferred", polish=False, callback=spent,
        )  # fmt: skip
        seed += 1
        own = read(found.x)
        error = float(found.fun) if own is None else of_four_bar(trial, own)
        if error < best:
            best, bar = error, own
    links = {"dwell": 6, "cylinder": 6}.get(trial.kind, 4)
    curve = None if bar is None or trial.goals is None else bar.curve(np.linspace(0.0, 2.0 * np.pi, 721))
    transmission = math.nan if bar is None else math.degrees(bar.transmission())
    return Result(best, None, links, True, transmission, process_time() - begin, curve)


def _model(trial: Trial) -> Model:
    if trial.kind in ("timed", "path", "curve", "foot"):
        return _paths(trial)
    return {
        "function": _functions,
        "poses": _poses,
        "stroke": _strokes,
        "dwell": _dwells,
        "cylinder": _cylinders,
    }[trial.kind](trial)


def _lack(one: Any, two: Any, opposite: Any) -> Any:
    """Cost of a transmission angle below 25 degrees: of two sides of a triangle, at the joint where they meet."""
    with np.errstate(all="ignore"):
        cosine = np.abs((one**2 + two**2 - opposite**2) / (2.0 * one * two))
    worst = np.nan_to_num(cosine, nan=1.0).max(axis=1)
    return 100.0 * np.maximum(0.0, worst - math.cos(math.radians(25.0)))


def _clean(cost: Array, wrong: Any = False) -> Array:
    return np.where(np.isfinite(cost) & ~np.asarray(wrong), cost, _WRONG)


def _paths(trial: Trial) -> Model:
    """Lengths, coupler point and frame; crank angles of all points, or of the first."""
    goals = trial.goals
    assert goals is not None
    most = 3.0 if trial.kind == "curve" else trial.bounds
    bounds = [(1e-3, most)] * 4 + [(-most, most)] * 4 + [(0.0, 2.0 * np.pi)]
    if trial.name == "five_timed":  # published so: the crank's pivot at the origin, the frame along x
        bounds[6:] = [(0.0, 0.0)] * 3
    unknown = {"path": len(goals), "curve": 0}.get(trial.kind, 1)
    if trial.name in ("five_timed", "semicircle"):  # published so: from 30 degrees
        unknown = 0
    bounds += [(0.0, 2.0 * np.pi)] * unknown
    fixed = [k for k, (low, high) in enumerate(bounds) if low == high]
    free = [k for k in range(len(bounds)) if k not in fixed]

    def whole(x: Array) -> Array:
        y = np.zeros((len(bounds), *x.shape[1:]))
        y[free] = x
        return y

    def start(y: Array) -> Any:
        return y[9] if unknown == 1 else np.pi / 6.0 + 0.0 * y[0]

    def costs(x: Array) -> Array:
        y = whole(np.atleast_2d(x.T).T)
        bar = of_lengths(y[:9, :, None])
        if trial.kind == "path":
            angles = y[9:].T
            falls = (np.diff(angles, axis=1) < 0.0).sum(axis=1)
            error = (np.abs(bar.curve(angles) - goals) ** 2).sum(axis=1)
            disorder = np.maximum(0, np.minimum(falls, len(goals) - 1 - falls) - 1)  # one fall: where the turn ends
            return _clean(error, ~bar.turns[:, 0]) + 1e4 * disorder
        if trial.kind == "curve":
            far = np.abs(bar.curve(_TURN[:-1])[:, :, None] - goals[None, None, :])
            return _clean(0.5 * (far.min(axis=1).mean(axis=1) + far.min(axis=2).mean(axis=1)), ~bar.turns[:, 0])
        z = bar.curve(start(y)[:, None] + trial.inputs)
        far = np.abs(z - goals)
        error = far.max(axis=1) if trial.kind == "foot" else (far**2).sum(axis=1)
        if trial.kind == "foot":
            curve = bar.curve(_TURN)
            above = np.array([-12 + 4j, 6j, 12 + 4j])
            error = error + np.abs(curve[:, :, None] - above).min(axis=1).max(axis=1)
            error = error + np.maximum(0.0, -2.0 - curve.imag.min(axis=1))
            pivots = np.concatenate([np.atleast_1d(bar.a0[:, 0]), np.atleast_1d(bar.b0[:, 0])]).reshape(2, -1)
            outside = np.abs(pivots.real) > 40.0, pivots.imag < 25.0, pivots.imag > 80.0
            error = error + 100.0 * np.any(outside, axis=(0, 1))
        return _clean(error, ~bar.turns[:, 0])

    def read(x: Array) -> FourBar:
        y = whole(x)
        bar = of_lengths(y)
        begin = 0.0 if trial.kind in ("path", "curve") else float(start(y))
        return bar._replace(crank=bar.crank * np.exp(1j * begin))

    return costs, [bounds[k] for k in free], read


def _functions(trial: Trial) -> Model:
    """Lengths over that of the frame, and the first crank angle; both modes, both senses of the output."""
    bounds = [(0.05, 20.0)] * 3 + [(0.0, 2.0 * np.pi)]

    def bars(y: Array) -> list[FourBar]:
        crank = y[0] * np.exp(1j * y[3])
        return [FourBar(0j, 1.0 + 0j, crank, y[1], y[2], 0j, mode, sense) for mode in (1, -1) for sense in (1, -1)]

    def errors(y: Array) -> Array:
        found = []
        for bar in bars(y):
            values = bar.output(trial.inputs[::6])  # NaN where it does not close
            found.append(_clean(np.degrees(0.5 * np.ptp(values - trial.wanted[::6], axis=-1))))
        return np.array(found)

    def costs(x: Array) -> Array:
        return np.asarray(errors(x[:, :, None]).min(axis=0))

    def read(x: Array) -> FourBar:
        own = errors(x[:, None, None])[:, 0]
        return bars(x)[int(own.argmin())]

    return costs, bounds, read


def _poses(trial: Trial) -> Model:
    """Pivots, both pins in the first pose, the crank angle of each pose; the body is where the linkage puts it."""
    goals = np.array([complex(x, y) for x, y, _ in trial.wanted])
    turns = np.array([angle - trial.wanted[0][2] for *_, angle in trial.wanted])
    size = float(np.abs(goals - goals.mean()).max())
    n = len(goals)
    bounds = [(-6.0, 6.0)] * 8 + [(-np.pi, np.pi)] * (n - 1)

    def bar_of(y: Array) -> FourBar:
        a0, b0, a, b = (y[k] + 1j * y[k + 1] for k in (0, 2, 4, 6))
        along = (b - a) / np.abs(b - a)
        mode = np.sign((along * np.conj(b0 - a)).imag)
        return FourBar(a0, b0, a - a0, np.abs(b - a), np.abs(b - b0), (goals[0] - a) / along, mode)

    def costs(x: Array) -> Array:
        with np.errstate(all="ignore"):
            bar = bar_of(x[:8, :, None])
            angles = np.concatenate([np.zeros((1, x.shape[1])), x[8:]]).T
            a, b, p = bar.at(angles)
            turn = np.angle((b - a) * np.conj(b[:, :1] - a[:, :1]) * np.exp(-1j * turns))
        falls = (np.diff(np.concatenate([angles, angles[:, :1]], axis=1) % (2 * np.pi), axis=1) < 0.0).sum(axis=1)
        order = np.minimum(falls, n - falls) > 1
        return _clean(np.hypot(np.abs(p - goals), size * turn).max(axis=1) / size, order)

    return costs, bounds, bar_of


def _strokes(trial: Trial) -> Model:
    """Crank, coupler, follower and mode; the pivots are given, or lie one apart."""
    ground = abs(320 + 60j) if trial.name == "wiper" else 1.0
    least = math.sin(math.radians(28.0 if trial.name == "wiper" else 25.0))
    bounds = [(0.05 * ground, 3.0 * ground)] * 3

    def bar_of(y: Array) -> FourBar:
        return FourBar(0j, ground + 0j, y[0] + 0j, y[1], y[2], 0j)

    def costs(x: Array) -> Array:
        found = []
        for y in x.T:
            bar = bar_of(y)
            if not bar.turns:
                found.append(_WRONG)
                continue
            lack = max(0.0, least - math.sin(bar.transmission(121)))
            found.append(min(measure.stroke(bar, *trial.wanted) + 100.0 * lack, _WRONG))
        return np.array(found)

    return costs, bounds, bar_of


def _dwells(trial: Trial) -> Model:
    """A Stephenson III six-bar: a four-bar, and from its coupler point a dyad to the output link."""
    share, least = trial.wanted
    width = math.ceil(share * 120) + 1
    bounds = [(0.1, 4.0)] * 3 + [(-4.0, 4.0)] * 4 + [(0.1, 6.0)] * 2

    def costs(x: Array) -> Array:
        y = x[:, :, None]
        bar = FourBar(0j, 1.0 + 0j, y[0] + 0j, y[1], y[2], y[3] + 1j * y[4])
        with np.errstate(all="ignore"):
            gap = bar.curve(_TURN) - (y[5] + 1j * y[6])
            far = np.abs(gap)
            angle = np.angle(gap) + np.arccos((y[8] ** 2 + far**2 - y[7] ** 2) / (2.0 * y[8] * far))
        whole = np.isfinite(angle).all(axis=1) & bar.turns[:, 0]
        values = np.degrees(np.unwrap(np.where(whole[:, None], angle, 0.0), axis=1))
        twice = np.concatenate([values[:, :-1], values[:, :-1]], axis=1)
        windows = np.lib.stride_tricks.sliding_window_view(twice, width, axis=1)[:, :120]
        quiet = 0.5 * np.ptp(windows, axis=2).min(axis=1)
        turned = np.abs(values[:, -1] - values[:, 0]) > 1.0
        gap = 1.0 - y[0] * np.exp(1j * _TURN)
        angles = _lack(y[8], y[7], far) + _lack(y[1], y[2], np.abs(gap))
        return _clean(quiet + np.maximum(0.0, least - np.ptp(values, axis=1)) + angles, ~whole | turned)

    return costs, bounds, lambda _: None


def _cylinders(trial: Trial) -> Model:
    """The usual six-bar of a bucket: the cylinder turns a rocker, a rod turns the bucket; its given pivots."""
    foot, rocker = 1.7 + 0.35j, 0.4 + 0.06j
    bounds = [(0.5, 1.9), (0.5, 1.1), (0.2, 1.9), (0.2, 1.9), (0.2, 1.9), (0.2, 1.9), (0.0, 2.0 * np.pi)]
    # first length and stroke of the cylinder, its arm, arm of the rod, rod, arm of the bucket, angle of the arms

    def costs(x: Array) -> Array:
        y, found = x[:, :, None], []
        gap = foot - rocker
        with np.errstate(all="ignore"):
            length = y[0] + y[1] * np.linspace(0.0, 1.0, 9)
            own = np.arccos((abs(gap) ** 2 + y[2] ** 2 - length**2) / (2.0 * abs(gap) * y[2]))
            for side in (1.0, -1.0):
                pin = rocker + y[3] * np.exp(1j * (np.angle(gap) + side * own + y[6]))
                far = np.abs(pin)
                angle = np.arccos((far**2 + y[5] ** 2 - y[4] ** 2) / (2.0 * far * y[5]))
                for mode in (1.0, -1.0):
                    values = np.unwrap(np.angle(pin) + mode * angle)[:, ::2]
                    error = _clean(np.degrees(0.5 * np.ptp(values - trial.wanted, axis=1)))
                    found.append(error + _lack(abs(gap), y[2], length) + _lack(y[5], y[4], far))
        return np.asarray(np.min(found, axis=0))

    return costs, bounds, lambda _: None


# --- pylinkage


def swarmed(trial: Trial, seconds: float) -> Result:
    """Run pylinkage's particle swarm over the dimensions of its four-bar; loci are placed as they fit best."""
    try:
        from pylinkage.optimization import particle_swarm_optimization
    except ImportError:
        return Result(math.nan, note="pylinkage is not installed")
    if trial.kind not in ("timed", "path", "curve", "function", "stroke"):
        return Result(math.nan, note="no loci of a four-bar")
    begin, best = process_time(), (math.inf, None)
    linkage, crank = _linkage(trial)

    class Spent(Exception):
        pass

    def score(own: Any, numbers: Any, _: object) -> float:
        nonlocal best
        if process_time() - begin > seconds:
            raise Spent
        error, bar = _swarm_error(trial, own, crank, numbers)
        if error < best[0]:
            best = (error, bar)
        return min(error, _WRONG)

    most = 6.0
    bounds = ([0.05, 0.05, 0.05, 0.0, -math.pi, -math.pi], [most, most, most, most, math.pi, math.pi])
    while process_time() - begin < seconds:
        try:
            particle_swarm_optimization(
                score, linkage, dimensions=6, n_particles=_SWARM, iterations=10**6, bounds=bounds,
                order_relation=min, verbose=False,
            )  # fmt: skip
        except Spent:
            break
    if best[1] is None:
        return Result(math.inf, seconds=process_time() - begin)
    bar = best[1]
    curve = None if trial.goals is None else bar.curve(np.linspace(0.0, 2.0 * np.pi, 721))
    return Result(
        of_four_bar(trial, bar), None, 4, True, math.degrees(bar.transmission()), process_time() - begin, curve
    )


def _linkage(trial: Trial) -> tuple[Any, Any]:
    """A four-bar of pylinkage with a coupler point, its frame from 0 to 1; its crank steps as the task asks."""
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import FixedDyad, RRRDyad
    from pylinkage.simulation import Linkage

    step = 2.0 * np.pi / 60
    if trial.inputs is not None:
        step = float(np.diff(trial.inputs)[0]) * (6 if trial.kind == "function" else 1)
    ends = [Ground(0.0, 0.0, name="O"), Ground(1.0, 0.0, name="C")]
    crank = Crank(anchor=ends[0], radius=0.3, angular_velocity=step, name="crank")
    follower = RRRDyad(anchor1=crank.output, anchor2=ends[1], distance1=1.0, distance2=1.0, name="follower")
    point = FixedDyad(anchor1=crank.output, anchor2=follower, distance=0.5, angle=0.3, name="P")
    return Linkage([*ends, crank, follower, point]), crank


def _swarm_error(trial: Trial, linkage: Any, crank: Any, numbers: Any) -> tuple[float, FourBar | None]:
    """Simulate by pylinkage, place the locus by least squares, and return its error with the linkage so placed."""
    radius, coupler, follower, distance, angle, start = numbers
    begin = start - crank.angular_velocity  # its first step is the first position
    pin = radius * np.exp(1j * begin)
    bar = FourBar(0j, 1.0 + 0j, radius * np.exp(1j * start), coupler, follower, distance * np.exp(1j * angle))
    if trial.inputs is None and not bar.turns:
        return math.inf, None
    _, b, p = bar._replace(crank=pin).at(0.0)  # pylinkage goes on from a position
    if not np.isfinite(b):
        return math.inf, None
    linkage.set_constraints([radius, coupler, follower, distance, angle])
    linkage.set_coords([(0.0, 0.0), (1.0, 0.0), *((float(z.real), float(z.imag)) for z in (pin, b, p))])
    linkage.compile()
    count = 60 if trial.inputs is None else len(trial.inputs[::6] if trial.kind == "function" else trial.inputs)
    loci = linkage.step_fast(count)
    if np.isnan(loci).any():
        return math.inf, None
    z = loci[:, 4, 0] + 1j * loci[:, 4, 1]
    if trial.kind in ("function", "stroke"):
        values = np.unwrap(np.arctan2(loci[:, 3, 1], loci[:, 3, 0] - 1.0))
        if trial.kind == "function":
            return measure.function(values, trial.wanted[::6]), bar
        lack = max(0.0, math.radians(25.0) - bar.transmission(61))
        return _swing(values, trial.wanted) + 100.0 * lack, bar
    return _placed(trial, z, bar)


def _swing(values: Array, wanted: Any) -> float:
    """Error of a stroke whose angles were simulated at equal inputs."""
    swing, apart = math.degrees(np.ptp(values)), abs(int(values.argmax()) - int(values.argmin())) * 360.0 / len(values)
    slow = max(apart, 360.0 - apart)
    least, most, ratio = wanted
    return max(least - swing, swing - most, abs(slow - 360.0 * ratio / (1.0 + ratio)), 0.0)


def _placed(trial: Trial, z: Any, bar: FourBar) -> tuple[float, FourBar]:
    """Turn, scale and shift a locus to the points, or its mirror image; nearest points anew where none are timed."""
    goals, best = trial.goals, (math.inf, bar)
    assert goals is not None
    for mirrored in (False, True):
        own = np.conj(z) if mirrored else z
        for shift in (0,) if trial.inputs is not None else range(0, len(z), 10):
            at = (
                own
                if trial.inputs is not None
                else own[(shift + np.arange(len(goals)) * len(z) // len(goals)) % len(z)]
            )
            for _ in range(1 if trial.inputs is not None else 4):
                s, t = np.linalg.lstsq(np.stack([at, np.ones_like(at)], axis=1), goals, rcond=None)[0]
                if trial.inputs is None:
                    far = np.abs(goals[:, None] - (s * own + t)[None])
                    at = own[far.argmin(axis=1)]
            far = np.abs(s * at + t - goals)
            error = float((far**2).sum())
            if trial.kind == "curve":
                every = np.abs(goals[:, None] - (s * own + t)[None])
                error = float(0.5 * (every.min(axis=0).mean() + every.min(axis=1).mean()))
            if error < best[0]:
                best = (error, _moved(bar, complex(s), complex(t), mirrored))
    return best


def _moved(bar: FourBar, s: complex, t: complex, mirrored: bool) -> FourBar:
    a0, b0, crank, point = bar.a0, bar.b0, bar.crank, bar.point
    if mirrored:
        a0, b0, crank, point = (np.conj(z) for z in (a0, b0, crank, point))
    flip = -1.0 if mirrored else 1.0
    far = abs(s)
    return FourBar(
        s * a0 + t, s * b0 + t, s * crank, far * bar.coupler, far * bar.follower, far * point,
        flip * bar.mode, flip * bar.sense,
    )  # fmt: skip
