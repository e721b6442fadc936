"""Every citation resolves, and the check sees one that does not."""

from __future__ import annotations

from . import references


def test_every_citation_leads_somewhere() -> None:
    assert sorted(references.unresolved_references()) == []


def test_citations_are_seen() -> None:
    text = "See theory/jam-arcs 1, 3 and theory/platform-direct\n    2 to 4"
    text += "; [Krawczyk 1969],\n# [Rump et\n# al. 2009]; x[A 1]"
    assert list(references.citing(text)) == [
        ("theory/jam-arcs 1, 3", "jam-arcs", [1, 3]),
        ("theory/platform-direct\n    2 to 4", "platform-direct", [2, 4]),
        ("[Krawczyk 1969]", "Krawczyk 1969", []),
        ("[Rump et\n# al. 2009]", "Rump et al. 2009", []),
    ]
