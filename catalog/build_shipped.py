"""Make ``up-to-10-links.sqlite`` anew, check it, and write its counts and digest beside it.

    python catalog/build_shipped.py

All planar chains of mobility-1 joints with mobility 1 to 4 and at most ten links, fractionated ones included.  One
mechanism of each chain with at most eight links has dimensions with which it turns and a verdict on jamming, where
drivers on one link move it (in five chains of mobility 3 and 4 none do).

The check compares the structural content exactly (digest of all rows, and the statement beside it), and which
mechanisms were evaluated, with every status, unit and guarantee.  The digits of dimensions are found by optimisation;
they may differ between processors and versions, are counted, and decide nothing: `Catalogue.verify` turns the stored
ones anew.
"""

import sys
import tempfile
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
    """Give the smaller chains dimensions and verdicts."""
    with Catalogue(path) as catalogue:
        catalogue.evaluate(EVALUATED, MOBILITIES, jamming=JAMMING)


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


def differences(shipped: Catalogue, fresh: Catalogue, text: str) -> list[str]:
    """Say how a fresh catalogue differs from the shipped one and its statement."""
    found = []
    if shipped.digest() != fresh.digest():
        found.append(f"structure: digest {shipped.digest()} is now {fresh.digest()}")
    if statement(fresh) != text:
        found.append("the statement of counts and sources is another")
    own, new = (evaluated(catalogue) for catalogue in (shipped, fresh))
    found += [f"evaluation {row} is not found now" for row in sorted(own - new, key=repr)]
    found += [f"evaluation {row} is new" for row in sorted(new - own, key=repr)]
    return found


def evaluated(catalogue: Catalogue) -> set[tuple[object, ...]]:
    """List what was evaluated, without the numbers that optimisation finds."""
    rows = catalogue.sql(
        "SELECT key, frame, CAST(driver AS TEXT) AS driver, kind, status, unit, guarantee FROM evaluations "
        "JOIN chains USING (chain_id)"
    )
    return set(rows.itertuples(index=False, name=None))


def same_dimensions(shipped: Catalogue, fresh: Catalogue) -> tuple[int, int]:
    """Count stored mechanisms that are the same to the last digit, and all of them."""
    labels = shipped.sql(
        "SELECT DISTINCT label FROM chains JOIN evaluations USING (chain_id) WHERE kind = 'dimensions'"
    )["label"].tolist()
    return sum(shipped.mechanism(label) == fresh.mechanism(label) for label in labels), len(labels)


def check() -> None:
    """Build in a folder of its own and compare."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fresh.sqlite"
        build(path)
        evaluate(path)
        with Catalogue(FOLDER / "up-to-10-links.sqlite") as shipped, Catalogue(path) as fresh:
            found = differences(shipped, fresh, (FOLDER / "up-to-10-links.toml").read_text())
            if found:
                raise SystemExit("\n".join(found))
            same, count = same_dimensions(shipped, fresh)
            print(f"the same: {len(fresh)} chains, {len(evaluated(fresh))} evaluations; {same} of {count} mechanisms")
            print("have the same dimensions to the last digit")


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
    check() if sys.argv[1:] == ["--check"] else main()
