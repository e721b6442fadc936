"""Make ``cognates-8.csv`` anew: how many cognates the coupler curves of all eight-bars have.

    python catalog/counts/cognates.py 8 [FILE]

For each chain of mobility 1 with so many links, each link as frame, and each link whose points draw more than circles
(one of each orbit, numbered as in the key): the number of mechanisms of the same chain that draw the same curve, the
given one among them; how many of them are families; and how far the points lie apart at most,
over the size, when all are simulated.  Dimensions are random, one choice for each mechanism.  Rows that are in the file
are not made again.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import graphsynth as gs
from graphsynth.design import cognates
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import TracePoint

FIELDS = ("key", "link", "degree", "cognates", "families", "apart")
#: Inputs from the pose in which all stand.
STEPS = np.linspace(0.0, 0.002, 5)


def questions(links: int) -> Iterator[tuple[gs.MechanismGraph, int]]:
    """Yield every mechanism with one link of each orbit whose points draw more than circles."""
    for chain in gs.enumerate_chains(links):
        for mechanism in (own.canonical() for own in chain.inversions()):
            for orbit in mechanism.orbits:
                if mechanism.frame not in orbit and gs.coupler_curve_degree(mechanism, orbit[0]) > 2:
                    yield mechanism, orbit[0]


def random_mechanism(graph: gs.MechanismGraph, link: int, rng: np.random.Generator) -> gs.Mechanism:
    """Give a mechanism joints at random places, and a point on a link."""
    frame, still = graph.frame or 0, (0.0, 0.0, 0.0)
    places = [(float(x), float(y)) for x, y in rng.uniform(-1.0, 1.0, (len(graph.joints) + 1, 2))]
    joints = tuple(Revolute(joint.a, joint.b, at, at) for joint, at in zip(graph.joints, places))
    driven = next(joint.a + joint.b - frame for joint in graph.joints if frame in (joint.a, joint.b))
    return gs.Mechanism(
        graph, joints, (Driver(frame, driven),), {"P": TracePoint(link, places[-1])}, (still,) * graph.links
    )


def row(graph: gs.MechanismGraph, link: int, seed: int) -> tuple[object, ...]:
    """Count the cognates of one curve, and simulate them."""
    rng = np.random.default_rng(seed)
    while not (motion := (given := random_mechanism(graph, link, rng)).simulate(STEPS)).completed:
        pass  # a dead centre is near
    found = cognates(given)
    curve = motion.point("P").position
    apart = [np.abs(one.mechanism.simulate(one.inputs(motion)).point("P").position - curve).max() for one in found]
    families, degree = sum(one.freedom > 0 for one in found), gs.coupler_curve_degree(graph, link)
    return graph.key, link, degree, len(found), families, f"{max(apart):.1e}"


def main() -> None:
    """Add the rows that are not there."""
    links = int(sys.argv[1])
    path = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).with_name(f"cognates-{links}.csv")
    fresh = not path.exists()
    with path.open("a+", newline="", encoding="utf-8") as stream:
        stream.seek(0)
        done = {(one["key"], int(one["link"])) for one in csv.DictReader(stream)}
        writer = csv.writer(stream, lineterminator="\n")
        if fresh:
            writer.writerow(FIELDS)
        for seed, (graph, link) in enumerate(questions(links)):
            if (graph.key, link) not in done:
                writer.writerow(row(graph, link, seed))
                stream.flush()


if __name__ == "__main__":
    main()
