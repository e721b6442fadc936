"""Statement of completeness: how many chains are listed, how many counting gives, how many are published."""

from __future__ import annotations

import sqlite3
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

_OEIS = "OEIS A233288"
_PAIR = "literature, confirmed by two independent programs (catalog/counts/published.toml)"
_TESTS = "independent generator and subset test (tests/synthesis)"

#: Published numbers of planar chains, ``{(mobility, links): (non-fractionated, with fractionated, source)}``; the same
#: as in catalog/counts/published.toml, which has the full references.
PUBLISHED: dict[tuple[int, int], tuple[int, int, str]] = {
    (1, 4): (1, 1, "textbooks: four-bar"),
    (1, 6): (2, 2, "textbooks: Watt, Stephenson"),
    (1, 8): (16, 16, _OEIS),
    (1, 10): (230, 230, _OEIS),
    (1, 12): (6856, 6856, _OEIS),
    (1, 14): (318162, 318162, "Butcher and Hartman (2005)"),
    (1, 16): (19819281, 19819281, "Sunkari and Schmidt (2006)"),
    (1, 18): (1535380884, 1535380884, _OEIS),
    (2, 5): (1, 1, _PAIR),
    (2, 7): (3, 4, _PAIR),
    (2, 9): (35, 40, _PAIR),
    (2, 11): (753, 839, _PAIR),
    (2, 13): (27496, 29685, _TESTS),
    (3, 6): (1, 1, _PAIR),
    (3, 8): (5, 7, _PAIR),
    (3, 10): (74, 98, _PAIR),
    (3, 12): (1962, 2422, _TESTS),
    (4, 7): (1, 1, _PAIR),
    (4, 9): (6, 10, _PAIR),
    (4, 11): (126, 189, _PAIR),
}


def completeness(connection: sqlite3.Connection) -> pd.DataFrame:
    """Return the statement; see :meth:`graphsynth.atlas.catalogue.Catalogue.completeness`."""
    import pandas as pd

    rows = []
    for mobility, links, fractionated, expected, finished, listed in connection.execute(
        "SELECT mobility, links, fractionated, expected, complete, (SELECT COUNT(DISTINCT key) FROM chains c "
        "WHERE c.family_id = f.family_id) FROM families f ORDER BY mobility, links"
    ):
        known = PUBLISHED.get((mobility, links))
        published = known[fractionated] if known else None
        agrees = finished == 1 and listed == expected and published in (None, listed)
        rows.append(
            (mobility, links, bool(fractionated), listed, expected, published, known[2] if known else "", agrees)
        )
    columns = ["mobility", "links", "fractionated", "listed", "counted", "published", "source", "complete"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.astype({"counted": "Int64", "published": "Int64", "complete": bool, "fractionated": bool})
