"""Exact tilts by brute force: links as rotation matrices in space, the least factor on all limits by optimization.

Nothing of graphsynth is used but the plane poses to start from.  Of every moving link the rotation vector and the
displacement are unknown; a joint keeps its centres on one axis of its seat, at most the play apart (and across it
within a radial clearance, where it has one), and the angle between its axes within the limit.  What comes out is
feasible, so it bounds the least factor from above.
"""

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

Z = np.array([0.0, 0.0, 1.0])


def about_z(angle):
    return Rotation.from_rotvec(angle * Z)


class Spatial:
    """A mechanism of turning joints whose driven link follows the tilted axis of its seat on the frame, link 0."""

    def __init__(self, joints, poses, alpha, direction, limits, unit):
        self.joints, self.limits, self.unit = joints, limits, unit  # unit: scale of tilts and small lengths
        self.base = [about_z(angle) for _, _, angle in poses]
        self.place = [np.array([x, y, 0.0]) for x, y, _ in poses]
        self.seat = Rotation.from_rotvec(alpha * np.array([np.cos(direction), np.sin(direction), 0.0]))
        driven = next(j for j in joints if j["driven"])
        self.fixed = driven["b"]
        centre = np.array([*driven["at_a"], 0.0])
        turn = self.seat * self.base[self.fixed]
        self.held = turn, centre - turn.apply([*driven["at_b"], 0.0])
        self.free = [k for k in range(1, len(poses)) if k != self.fixed]

    def links(self, x):
        found = {0: (self.base[0], self.place[0]), self.fixed: self.held}
        for k, own in zip(self.free, x[:-1].reshape(-1, 6) * self.unit):
            found[k] = Rotation.from_rotvec(own[:3]) * self.base[k], self.place[k] + own[3:]
        return found

    def gaps(self, x):
        """Distances of the centres across the axis (must vanish), and tilts and slips over their limits."""
        links, across, ratios = self.links(x), [], []
        for joint, (tilt, play, *radial) in zip(self.joints, self.limits):
            if joint["driven"]:
                continue
            (Ra, pa), (Rb, pb) = links[joint["a"]], links[joint["b"]]
            axis = Ra.apply(Z)
            d = pb + Rb.apply([*joint["at_b"], 0.0]) - pa - Ra.apply([*joint["at_a"], 0.0])
            if radial:
                ratios.append(np.linalg.norm(Ra.inv().apply(d)[:2]) / radial[0])
            else:
                across += (Ra.inv().apply(d)[:2] / self.unit).tolist()
            for limit, own in ((tilt, Rb.apply(Z) - (Rb.apply(Z) @ axis) * axis), (play, np.array([d @ axis]))):
                if limit == 0.0:
                    across += ((Ra.inv().apply(own)[:2] if own.size > 1 else own) / self.unit).tolist()
                elif np.isfinite(limit):
                    size = np.arcsin(np.linalg.norm(own)) if own.size > 1 else abs(own[0])
                    ratios.append(size / limit)
        return np.array(across), np.array(ratios)

    def least_factor(self, starts=1):
        """Least factor on all limits that was found, and by how much the centres miss their axes."""
        x, least = self.solve(starts)
        return least, float(np.abs(self.gaps(x)[0]).max(initial=0.0))

    def solve(self, starts=1):
        """Return the best of local searches that close the loops, the first of them from the plane poses."""
        rng = np.random.default_rng(1)
        found = [self._search(0.5 * rng.standard_normal(6 * len(self.free)) * (k > 0)) for k in range(starts)]
        missed = [float(np.abs(self.gaps(x)[0]).max(initial=0.0)) for x in found]
        least = [float(max(self.gaps(x)[1])) for x in found]
        best = min(range(starts), key=lambda k: (max(missed[k], 1e-7), least[k]))
        return found[best], least[best]

    def _search(self, start):
        x0 = np.append(start, 0.0)
        x0[-1] = max(1.0, *self.gaps(x0)[1])
        return minimize(
            lambda x: x[-1],
            x0,
            jac=lambda x: np.eye(x.size)[-1],
            method="SLSQP",
            bounds=[(-9.0, 9.0)] * (x0.size - 1) + [(0.0, None)],
            constraints=[
                {"type": "eq", "fun": lambda x: self.gaps(x)[0]},
                {"type": "ineq", "fun": lambda x: x[-1] ** 2 - self.gaps(x)[1] ** 2},
            ],
            options={"ftol": 1e-13, "maxiter": 300},
        ).x


def spatial(mechanism, poses, tilt, limits):
    """Set one pose of a mechanism up; ``limits`` (tilt, play) or (tilt, play, radial clearance) by pair."""
    joints = []
    for joint in mechanism.joints:
        driven = joint.pair == (tilt.base, tilt.link)
        joints.append({"a": joint.a, "b": joint.b, "at_a": joint.at_a, "at_b": joint.at_b, "driven": driven})
    own = [limits[joint.pair] for joint in mechanism.joints]
    return Spatial(joints, poses, tilt.alpha, tilt.direction, own, abs(tilt.alpha))
