"""Motor without a platform, by formulas."""

from __future__ import annotations

from typing import Any


def linear_motor(resistance: float, times: list[float]) -> tuple[list[Any], list[Any]]:
    """Speeds and currents of the motor without a platform, by the formulas of theory/motor-drive 6."""
    import mpmath as mp

    with mp.workdps(60):
        L, J, Km, K, ce, wd = (mp.mpf(x) for x in (0.2, 0.002, 0.1, 20.0, 0.1, 20.0))
        a, wn2 = mp.mpf(resistance) / (2 * L), Km * (K + ce) / (L * J)
        wf, w_inf = mp.sqrt(mp.mpc(wn2 - a * a)), K * wd / (K + ce)
        speeds, currents = [], []
        for t in map(mp.mpf, times):
            decay = mp.exp(-a * t)
            sine = t if abs(wf) < mp.mpf(10) ** -20 else mp.sin(wf * t) / wf
            speeds.append((w_inf * (1 - decay * (mp.cos(wf * t) + a * sine))).real)
            currents.append((w_inf * J / Km * decay * wn2 * sine).real)
        return speeds, currents
