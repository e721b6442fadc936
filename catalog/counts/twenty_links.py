"""Count the chains of 20 links (or fewer) with their shares by vertices of the contracted graph; write a certificate.

    python catalog/counts/twenty_links.py LINKS [FILE]

Some minutes of one core for 20 links, 300 MB.  The certificate (TOML) has, for each number of vertices k, the number of
contracted graphs, what the identities contribute and what all other automorphisms do; each is a fraction, their sum for
each k the number of chains with k links of three or more joints.  The graphs are grown from those that are shipped; of
each run of them there is a checksum of its shares.
"""

from __future__ import annotations

import sys
import time
from fractions import Fraction
from hashlib import sha256
from pathlib import Path

from graphsynth.synthesis.problem import EnumerationProblem
from graphsynth.synthesis.rigid_blocks import identity_sums
from graphsynth.synthesis.totals import Grown, Listed


def certificate(links: int) -> list[str]:
    """Count; return the lines of the certificate."""
    begin = time.process_time()
    problem = EnumerationProblem.chains(links, 1, 3, None, False, None, counted=True)
    graphs = {family.vertices: 0 for family in problem.families}
    others = dict.fromkeys(graphs, Fraction(0))
    runs = []
    for part in problem.parts():
        if isinstance(part, Grown):
            found = part.by_vertices()
        elif isinstance(part, Listed):
            found = {part.family.vertices: (part.stop - part.start, part.count())}
        else:
            continue
        for k, (number, share) in found.items():
            graphs[k] += number
            others[k] += share
        text = " ".join(f"{k}:{number}:{share}" for k, (number, share) in found.items())
        runs.append(sha256(text.encode()).hexdigest()[:16])
        sys.stderr.write(f"run {len(runs)}: {time.process_time() - begin:.0f} s, {sum(graphs.values())} graphs\n")
    middle = time.process_time()
    identities = identity_sums(links)
    end = time.process_time()
    total = 0
    rows = []
    for k in graphs:
        chains = identities[k] + others[k]
        if chains.denominator != 1:
            raise SystemExit(f"{k} vertices: {chains} chains is no whole number")
        total += int(chains)
        rows.append(
            f'{{ vertices = {k}, contracted = {graphs[k]}, chains = {chains}, identities = "{identities[k]}", '
            f'others = "{others[k]}" }},'
        )
    return [
        f"links = {links}",
        f"chains = {total}",
        f"contracted = {sum(graphs.values())}",
        f"cpu_seconds = {{ others = {middle - begin:.1f}, identities = {end - middle:.1f} }}",
        "by_vertices = [",
        *(f"  {row}" for row in rows),
        "]",
        f'runs = "{" ".join(runs)}"',
    ]


if __name__ == "__main__":
    lines = certificate(int(sys.argv[1]))
    text = "\n".join(lines) + "\n"
    if len(sys.argv) > 2:
        Path(sys.argv[2]).write_text(text, encoding="utf-8")
    sys.stdout.write(text)
