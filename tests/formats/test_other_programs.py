"""Files given to the programs they are for: LaTeX, Graphviz, DXF viewers."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from graphsynth.drawing.export import tikz
from graphsynth.drawing.graphs import graph_sketch, levels_sketch
from graphsynth.formats import write
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

FRAMED = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (0, 5)], frame=0)
HIGHER = MechanismGraph(5, [(0, 1), (1, 2, 2), (2, 3), (3, 4), (0, 4)], frame=0)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_sets_the_sketches(tmp_path: Path) -> None:
    pictures = [tikz(*graph_sketch(graph, driver=1, title="100 % of_it & #1 ~^{}")) for graph in (FRAMED, HIGHER)]
    pictures.append(tikz(levels_sketch(FRAMED)))
    pictures.append(tikz(*graph_sketch(FRAMED, width=1500.0)))
    text = "\n\n".join(f"\\noindent {picture}" for picture in pictures)
    (tmp_path / "x.tex").write_text(
        "\\documentclass{article}\\usepackage{tikz}\\begin{document}\n" + text + "\n\\end{document}\n"
    )
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "x.tex"],
        cwd=tmp_path, capture_output=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout.decode(errors="replace")[-2000:]
    assert "Overfull" not in (tmp_path / "x.log").read_text(errors="replace")  # none is wider than the column
    assert (tmp_path / "x.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.skipif(shutil.which("dot") is None, reason="Graphviz is not installed")
def test_graphviz_reads_dot(tmp_path: Path) -> None:
    joints = [Revolute(0, 1, (0.1, 0.2))]
    points = {'a "b"\n\\': (1, (1.0, 2.0)), "é<&>": (0, (0.0, 0.0))}
    write([FRAMED, HIGHER, Mechanism(MechanismGraph(2, [(0, 1)], frame=0), joints, points=points)], tmp_path / "x.dot")
    done = subprocess.run(["dot", "-Tplain", "x.dot"], cwd=tmp_path, capture_output=True, timeout=60, check=False)
    assert done.returncode == 0 and not done.stderr
    lines = done.stdout.decode().splitlines()
    count = len(FRAMED.joints) + len(HIGHER.joints) + 1
    assert sum(line.startswith("edge ") for line in lines) == count
    assert sum(line.startswith("node ") for line in lines) == 6 + 5 + 2
    assert sum(" doublecircle " in line for line in lines) == 3
    assert sum("dashed" in line for line in lines if line.startswith("edge ")) == 1
