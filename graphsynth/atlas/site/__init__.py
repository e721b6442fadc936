"""The atlas page: a catalogue as a static site that opens from a file."""

from graphsynth.lazy import resolve

__all__ = ["SiteReport", "build_site"]

_PUBLIC = {"build_site": "building", "SiteReport": "building"}


def __getattr__(name: str) -> object:
    return resolve(__name__, _PUBLIC, name)
