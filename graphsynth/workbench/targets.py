"""The small index of closed curves that the page searches for a target: mechanisms of the library's index, packed.

``python -m graphsynth.workbench.targets`` makes ``curves.bin`` anew.
"""

from __future__ import annotations

import json
import tempfile
from base64 import b64encode
from importlib.resources import files
from pathlib import Path
from typing import Any
from zlib import compress

import numpy as np
from numpy.typing import NDArray

CURVES = Path(__file__).with_name("curves.bin")
#: Rows kept, and what they are chosen from: closed curves of four- and six-bars with revolute joints.
ROWS, DRAWN, LINKS, SEED = 5000, 12_000, (4, 6), 1
#: Harmonics whose sizes are stored; most joints of a mechanism.
HARMONICS, JOINTS = 8, 7
#: One row: the family, the tracing link, places of the joints and of the point in 32767ths, roots of sizes in 255ths.
ROW = np.dtype([("family", "u1"), ("link", "u1"), ("places", "<i2", (JOINTS + 1, 2)), ("sizes", "u1", 2 * HARMONICS)])


def packed() -> tuple[list[list[Any]], NDArray[Any]]:
    """Build an index, and return the families (links, joints, driven link) and the rows of its closed curves.

    Every mechanism is moved into the square from -1 to 1; its sizes are those of the curve that is drawn then.
    """
    from graphsynth.design.curves.fourier import coefficients, magnitudes, unit
    from graphsynth.design.curves.index import CurveIndex

    with tempfile.TemporaryDirectory() as folder:
        index = CurveIndex.build(Path(folder) / "curves", DRAWN, links=LINKS, sliders=0, seed=SEED)
        rows, numbers = np.zeros(ROWS, ROW), {own: k for k, own in enumerate(index.families)}
        kept = 0
        for number in range(len(index)):
            entry = index.entry(number)
            if not entry.closed or kept == ROWS:
                continue
            at = np.vstack([entry.places, [entry.point.real, entry.point.imag]])
            middle = 0.5 * (at.max(axis=0) + at.min(axis=0))
            size = float(np.abs(at - middle).max())
            places = np.zeros((JOINTS + 1, 2))
            places[[*range(len(at) - 1), JOINTS]] = (at - middle) / size
            found = unit(coefficients(entry.traced().curve[None], np.array([True]), 2 * HARMONICS))
            sizes = magnitudes(found, HARMONICS)[0]
            whole = np.rint(places * 32767), np.rint(255.0 * np.sqrt(sizes))
            rows[kept] = numbers[entry.family], int(entry.row["link"]), *whole
            kept += 1
        graphs = [(own.design.graph, own.driven) for own in index.families]
    return [[g.links, [[joint.a, joint.b] for joint in g.joints], driven] for g, driven in graphs], rows[:kept]


def write(path: Path = CURVES) -> None:
    """Write the families as a line of JSON, then the rows."""
    families, rows = packed()
    path.write_bytes(json.dumps(families, separators=(",", ":")).encode() + b"\n" + rows.tobytes())


def script() -> str:
    """Return the script that hands the index to the page."""
    held = files("graphsynth.workbench").joinpath("curves.bin").read_bytes()
    return f"Curves.register({json.dumps(b64encode(compress(held, 9)).decode())});\n"


if __name__ == "__main__":
    write()
