"""Make ``up-to-10-links.sqlite`` anew, check it, and write its counts and digest beside it.

    python catalog/build_shipped.py

All planar chains of mobility-1 joints with mobility 1 to 4 and at most ten links, fractionated ones included.  One
mechanism of each chain of mobility 1 with at most eight links has dimensions with which it turns; the four-bar linkage
also has a verdict on jamming.
"""

from pathlib import Path

from graphsynth.atlas.catalogue import Catalogue

FOLDER = Path(__file__).parent
LINKS = range(4, 11)
MOBILITIES = range(1, 5)
EVALUATED = range(4, 9)
#: Tilt of the motor and of what every joint takes up, radians.
JAMMING = (0.001, 0.005)


def build(path: Path) -> None:
    """Build the shipped catalogue."""
    for mobility in MOBILITIES:
        Catalogue.build(path, LINKS, mobility, fractionated=True).close()


def evaluate(path: Path) -> None:
    """Give the smaller chains dimensions."""
    with Catalogue(path) as catalogue:
        catalogue.evaluate(EVALUATED, [1])
        catalogue.evaluate([4], [1], jamming=JAMMING)


def statement(catalogue: Catalogue) -> str:
    """Write counts, sources and digest as TOML."""
    lines = [
        "# Made by catalog/build_shipped.py: what the shipped catalogue holds.  listed: chains in the file, each with",
        "# another canonical key; counted: by orbit counting without listing; published: see source.",
        f'digest = "{catalogue.digest()}"',
        "",
    ]
    for row in catalogue.completeness().to_dict("records"):
        lines += [
            "[[families]]",
            f"mobility = {row['mobility']}",
            f"links = {row['links']}",
            f"fractionated_included = {str(row['fractionated']).lower()}",
            f"listed = {row['listed']}",
            f"counted = {row['counted']}",
            f"published = {row['published']}",
            f'source = "{row["source"]}"',
            "",
        ]
    return "\n".join(lines)


def main() -> None:
    """Build, verify, replace."""
    path, fresh = FOLDER / "up-to-10-links.sqlite", FOLDER / "up-to-10-links.sqlite.new"
    fresh.unlink(missing_ok=True)
    build(fresh)
    evaluate(fresh)
    with Catalogue(fresh) as catalogue:
        found = catalogue.verify()
        print(found.statement)
        if not found.passed:
            raise SystemExit("\n".join(found.differences))
        (FOLDER / "up-to-10-links.toml").write_text(statement(catalogue))
    fresh.replace(path)


if __name__ == "__main__":
    main()
