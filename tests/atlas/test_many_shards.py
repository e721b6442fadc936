"""Merging more shards than a process may have open."""

from __future__ import annotations

from graphsynth.atlas import merging
from graphsynth.atlas.catalogue import Catalogue


def test_few_shards_are_open_at_a_time(tmp_path, monkeypatch):
    count = 12
    parts = [tmp_path / f"{i}.sqlite" for i in range(1, count + 1)]
    for i, part in enumerate(parts, 1):
        Catalogue.build(part, range(4, 9), shard=(i, count)).close()
    connect, is_open, most = merging.connect, set(), [0]

    class Counted:
        """A connection that is counted while it is open."""

        def __init__(self, *arguments, **options):
            self.own = connect(*arguments, **options)
            is_open.add(id(self))
            most[0] = max(most[0], len(is_open))

        def close(self):
            is_open.discard(id(self))
            self.own.close()

        def __getattr__(self, name):
            return getattr(self.own, name)

    monkeypatch.setattr(merging, "connect", Counted)
    monkeypatch.setattr(merging, "settle", lambda connection: None)
    monkeypatch.setattr(merging, "_OPEN", 3)
    with Catalogue.build(tmp_path / "whole.sqlite", range(4, 9)) as whole:
        with Catalogue.merge(tmp_path / "merged.sqlite", parts) as merged:
            assert merged.digest() == whole.digest()
            assert len(merged) == 19
        assert most[0] == 3 + 1  # and the file that is written
        assert not is_open
