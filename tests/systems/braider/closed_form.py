"""Joint reactions of the braider in closed form: Newton and Euler for each link (theory/braider 5)."""

from __future__ import annotations

import numpy as np


def cross(u, v):
    return (np.conj(u) * v).imag


def reactions(braider, theta, w, alpha):
    """Forces at O1, A, B, O2 as complex numbers, and the torque on the crank.

    The dyad is solved first: the moments of the coupler about A and of the rocker about O2 give the force at B.
    """
    s = braider.linkage.motion(theta)
    m1, m2, m3, m4 = braider.masses
    _, i2, i3 = braider.moments

    def turning(arm, rate, second):
        return (1j * second - rate * rate) * arm

    w2, w3, a2, a3 = s.k2 * w, s.k3 * w, s.f2 * w * w + s.k2 * alpha, s.f3 * w * w + s.k3 * alpha
    crank = turning(s.crank, w, alpha)
    coupler = crank + 0.5 * turning(s.coupler, w2, a2)
    ratio = braider.switch / braider.linkage.rocker * np.exp(1j * braider.switch_angle)
    rocker = turning(0.5 * s.rocker * (m3 + m4 * ratio), w3, a3)
    arm = braider.tip(theta) - braider.linkage.frame
    load = braider.thread.force(braider.linkage.frame + arm)
    first = -(i2 * a2 + cross(0.5 * s.coupler, m2 * coupler))
    second = i3 * a3 - cross(arm, load)
    F23 = (first * s.rocker - second * s.coupler) / cross(s.coupler, s.rocker)
    F12 = F23 + m2 * coupler
    torque = m1 * braider.linkage.crank**2 / 3.0 * alpha + cross(s.crank, F12)
    return np.stack([F12 + m1 * 0.5 * crank, F12, F23, rocker - F23 - load], axis=-1), torque
