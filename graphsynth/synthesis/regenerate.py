"""``python -m graphsynth.synthesis.regenerate LOOPS FOLDER``: make the lists of contracted graphs anew."""

from __future__ import annotations

import sys
from pathlib import Path

from graphsynth.synthesis.contracted import Layers, encode, generate


def main(arguments: list[str]) -> int:
    """Make the lists for 2..LOOPS loops and write them to FOLDER."""
    if len(arguments) != 2 or not arguments[0].isdecimal() or not 2 <= int(arguments[0]) <= 10:
        sys.stderr.write("usage: python -m graphsynth.synthesis.regenerate LOOPS FOLDER, with LOOPS from 2 to 10\n")
        return 2
    folder = Path(arguments[1])
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[int, Layers] = {}
    for loops in range(2, int(arguments[0]) + 1):
        found = generate(loops, smaller=found)
        data = encode(found[loops])
        (folder / f"contracted-{loops}.xz").write_bytes(data)
        count = sum(map(len, found[loops].values()))
        sys.stdout.write(f"{loops} loops: {count} contracted graphs, {len(data)} bytes\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
