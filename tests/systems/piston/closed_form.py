"""Loads of a floating piston in closed form: one body after the other, signs of normal forces guessed and checked.

Nothing is shared with the general dynamics but the motion; forces are complex numbers.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from graphsynth.systems.piston import CrankSlider


def cross(a, b):
    return (np.conj(a) * b).imag


def wedge(tangent, mu):
    """Directions of a contact's force for a positive and for a negative normal force."""
    return {1: 1j * tangent - mu * tangent, -1: 1j * tangent + mu * tangent}


def single(candidates, size=0.0):
    """The value of all candidates that hold, if they agree; NaN otherwise."""
    values = np.array([np.where(good, value, np.nan) for good, value in candidates])
    low, high = np.fmin.reduce(values), np.fmax.reduce(values)
    agree = high - low <= 1e-12 * np.maximum(size, np.maximum(np.abs(low), np.abs(high)))
    return np.where(agree, np.where(np.abs(high) >= np.abs(low), high, low), np.nan)


def force(normal, contact):
    return np.where(normal >= 0.0, contact[1], contact[-1]) * normal


def one_contact(moment, lever, contact):
    """Normal force with ``lever x force = moment``."""
    values = {s: moment / cross(lever, contact[s]) for s in (1, -1)}
    return single([(s * value >= 0.0, value) for s, value in values.items()])


def two_contacts(wanted, first, second):
    """Normal forces of two contacts that carry a force together."""
    ones, others = [], []
    for s, t in product((1, -1), repeat=2):
        d, e = first[s], second[t]
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = cross(wanted, e) / cross(d, e), cross(d, wanted) / cross(d, e)
        good = (s * one >= 0.0) & (t * other >= 0.0)
        ones.append((good, one))
        others.append((good, other))
    return single(ones, np.abs(wanted)), single(others, np.abs(wanted))


def loads(machine, phi):
    """Reactions by name, with those of `PistonLoads`."""
    drive, group, masses, w, a = (
        machine.mechanism.drive, machine.mechanism.group, machine.masses, machine.speed, machine.acceleration,
    )  # fmt: skip
    weight, motion, f = complex(*machine.gravity), machine.mechanism.motion(phi), machine.friction

    def rates(of):
        return of.first * w, of.second * w**2 + of.first * a

    def mu(name, speed):
        return getattr(f, name) * np.tanh(speed / f.smoothing_velocity)

    crosshead, follower, piston, slot = map(rates, (motion.crosshead, motion.follower, motion.piston, motion.slot))
    turn, base = machine.mechanism.cylinder
    cylinder, at = np.exp(1j * turn), motion.crosshead.value + 1j * drive.offset
    pin = drive.crank * np.exp(1j * phi)
    pin_rate = (1j * a - w**2) * pin
    own = -cylinder * (machine.gas_force(phi) + mu("rings", piston[0]))
    found = {}
    wanted = masses.crosshead * (crosshead[1] - weight)
    name, couple = "cylinder", 0.0
    if group is not None:
        name, along = "guide", np.exp(1j * group.slot_angle)
        carried = masses.piston * (piston[1] * cylinder - weight) - own
        in_slot, on_wall = wedge(along, mu("slot", slot[0])), wedge(cylinder, mu("cylinder", piston[0]))
        found["slot"], found["wall"] = two_contacts(carried, in_slot, on_wall)
        wanted = wanted + force(found["slot"], in_slot)
        couple = cross(base + motion.piston.value * cylinder - at, force(found["slot"], in_slot))
    else:
        wanted = wanted - own
    guide = wedge(1.0 + 0j, mu(name, crosshead[0]))
    if isinstance(drive, CrankSlider):
        rod = np.exp(1j * motion.follower.value)
        lever = masses.rod_centre * rod
        centre = pin_rate + (1j * follower[1] - follower[0] ** 2) * lever
        moment = cross(lever, masses.follower * (weight - centre)) - masses.rod_inertia * follower[1]
        found["guide"] = one_contact(cross(rod, wanted) - moment / drive.rod, rod, guide)
        handed = wanted - force(found["guide"], guide)
        found["crosshead_pin"] = handed
    else:
        centre = pin_rate
        yoke = wedge(np.exp(1j * drive.yoke_angle), mu("yoke", -follower[0]))
        found["yoke"], found["guide"] = two_contacts(wanted, yoke, guide)
        handed = force(found["yoke"], yoke)
        couple = couple - cross(pin - at, handed)
    if group is None:
        found["wall"] = found["guide"]
    found["guide_couple"] = couple + np.zeros(len(phi))
    found["crank_pin"] = masses.follower * (centre - weight) + handed
    arm = masses.crank_centre * np.exp(1j * phi)
    found["bearing"] = masses.crank * ((1j * a - w**2) * arm - weight) + found["crank_pin"]
    inertia = masses.crank_inertia + masses.crank * masses.crank_centre**2
    found["torque"] = inertia * a + cross(pin, found["crank_pin"]) - cross(arm, masses.crank * weight)
    return found
