"""Pictures of joints that share a misalignment: how far from a jam over the turn, what every joint uses of its limits.

Every function returns a matplotlib figure that belongs to no window; write it with ``figure.savefig(path)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from graphsynth.jamming.joints import CoupledReport, SensitivityTable

#: Shown at most: how many times the allowed scale at the worst input.
_HIGH = 4.0


def clearance_picture(report: CoupledReport) -> Figure:
    """Draw the allowed scale over the inputs, with what is proved, above the use that every joint makes of its limits.

    `report`: of `graphsynth.jamming.joints.assess_coupled`; with a certificate the proved ranges are shaded. Above: the
    factor by which all misalignments may grow; below 1 it jams.  Below: ``|tau| / t`` of every limit in the sharing
    with the least largest value; a dot where the limit is binding. Raises `GeometryError` if no sample is assembled, or
    no joint has a limit.
    """
    if not np.isfinite(report.factor).any():
        raise GeometryError("no sample has a finite factor, so there is nothing to draw; see the report's reason")
    used = report.consumption * report.factor[:, None]
    shown = [k for k in range(used.shape[1]) if np.isfinite(used[:, k]).any() and np.nanmax(used[:, k]) > 0.0]
    if not shown:
        raise GeometryError("no joint uses any of its clearance, so there is nothing to draw")
    figure = new_figure((7.2, 3.4 + 0.22 * len(shown)))
    axes, table = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 0.6 + 0.3 * len(shown)))
    _uses(figure, table, report, used[:, shown].T, shown)
    proof = report.certificate
    if proof is not None:
        for state, colour, label in ((-1, "jam", "binds, proved"), (0, "soft", "undecided"), (1, "c", "free, proved")):
            for k, (a, b) in enumerate(proof.arcs(state)):
                axes.axvspan(a, b, color=LIGHT[colour], alpha=0.16, lw=0, label=label if k == 0 else None)
    axes.plot(report.inputs, report.allowed_scale, color=LIGHT["a"], lw=1.7)
    axes.axhline(1.0, color=LIGHT["jam"], lw=1.0, ls="--", label="no clearance left")
    axes.plot(
        [report.smallest_scale_input], [report.smallest_scale], "o", color=LIGHT["ink"], ms=4, label="worst input"
    )
    finite = report.allowed_scale[np.isfinite(report.allowed_scale)]
    axes.set_ylim(0.0, 1.08 * min(float(finite.max(initial=1.2)), _HIGH * max(1.0, report.smallest_scale)))
    axes.set_ylabel("misalignment allowed\n(times the given one)")
    axes.legend(fontsize=8, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    return figure


def _uses(figure: Figure, axes: Any, report: CoupledReport, used: Any, shown: list[int]) -> None:
    x = report.inputs
    edges = np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]]) if len(x) > 1 else np.array([x[0], x[0] + 1.0])
    picture = axes.pcolormesh(edges, np.arange(len(shown) + 1), used, cmap="Blues", vmin=0.0, vmax=np.nanmax(used))
    for row, k in enumerate(shown):
        tight = report.inputs[report.binding[:, k]]
        axes.plot(tight, np.full(tight.size, row + 0.5), ".", color=LIGHT["jam"], ms=2.5)
    names = [f"{a}-{b} {what}".removesuffix(" tilt") for (a, b), what in (report.names[k] for k in shown)]
    axes.set_yticks(np.arange(len(shown)) + 0.5, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("input (rad, or a length)")
    figure.colorbar(picture, ax=axes, label="use of the limit\n(dots: binding)", fraction=0.06, pad=0.01)


def sensitivity_picture(table: SensitivityTable) -> Figure:
    """Draw what loosening each limit alone gains, and what could be had at most.

    `table`: of `graphsynth.jamming.joints.compare_sensitivities`. Raises `GeometryError` if loosening one limit alone
    gains nothing.
    """
    useful = [row for row in table.rows if row.gain > 0.0]
    if not useful:
        raise GeometryError("loosening one limit alone gains nothing here, so there is nothing to draw")
    figure = new_figure((6.4, 1.6 + 0.32 * len(useful)))
    axes = figure.add_subplot()
    place = np.arange(len(useful))
    most = [min(row.without, _HIGH * table.scale) - table.scale for row in useful]
    axes.barh(place, most, left=table.scale, color=LIGHT["fill"], height=0.62, label="without this limit")
    gained = [row.scale - table.scale for row in useful]
    axes.barh(place, gained, left=table.scale, color=LIGHT["a"], height=0.62, label=f"limit {table.by:+.0%}")
    axes.axvline(table.scale, color=LIGHT["ink"], lw=1.2, label="as it is")
    axes.axvline(1.0, color=LIGHT["jam"], lw=1.0, ls="--", label="no clearance left")
    axes.set_yticks(place, [f"{row.joint[0]}-{row.joint[1]} {row.what}" for row in useful], fontsize=9)
    axes.invert_yaxis()
    low, high = min(table.scale, 1.0), max(table.scale + max(most), 1.0)
    axes.set_xlim(low - 0.04 * (high - low), high + 0.04 * (high - low))
    rest = len(table.rows) - len(useful)
    note = f"\n{rest} other limits gain nothing alone" if rest else ""
    axes.set_xlabel(f"smallest allowed misalignment over the motion (times the given one){note}")
    axes.legend(fontsize=8, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    return figure
