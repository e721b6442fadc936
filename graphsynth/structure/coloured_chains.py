"""What chains share that are a mechanism graph some of whose joints are of another kind: frame, key, text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from graphsynth.core.errors import FormatError
from graphsynth.structure.canonical import KEY_VERSION
from graphsynth.structure.graph import MechanismGraph

#: Where joints of the other kind are written: with this mobility, which no joint of these chains has.
OTHER = 2


@dataclass(frozen=True, repr=False)
class ColouredChain:
    """A chain whose graph has joints of two kinds; canonical form and key are those of the coloured graph."""

    coloured: MechanismGraph
    letter: ClassVar[str]  # before the joints of the other kind in the text form; in the key it is small
    what: ClassVar[str]  # in messages

    def __post_init__(self) -> None:
        if self.coloured.space != 3:
            raise FormatError(f"{self.what} is planar: space = {self.coloured.space} must be 3", "space")

    @property
    def links(self) -> int:
        """Number of links N, the frame included."""
        return self.coloured.links

    @property
    def frame(self) -> int | None:
        """The fixed link; a chain has none."""
        return self.coloured.frame

    @property
    def automorphism_order(self) -> int:
        """Order of the automorphism group (exact)."""
        return self.coloured.automorphism_order

    def canonical(self) -> Self:
        """Return the canonical representative of the isomorphism class."""
        return type(self)(self.coloured.canonical())

    @property
    def key(self) -> str:
        """Canonical key: the version, a letter, a dot, and the graph with its two kinds of joints.

        Equal for two chains exactly when they are isomorphic, the frame included.
        """
        return f"{KEY_VERSION}{self.letter.lower()}.{self.coloured.key[1:]}"

    @classmethod
    def from_key(cls, key: str) -> Self:
        """Read a canonical key; anything else is a :class:`FormatError`."""
        start = f"{KEY_VERSION}{cls.letter.lower()}."
        if not key.startswith(start):
            raise FormatError(f"a key of {cls.what} begins with {start}", "key")
        return cls(MechanismGraph.from_key(KEY_VERSION + key[3:]))

    def to_text(self) -> str:
        """Return the one-line form: that of the graph, with the joints of the other kind behind a letter."""
        return self.coloured.to_text().replace(f" {OTHER}:", f" {self.letter}:")

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Read the one-line form; anything else is a :class:`FormatError`."""
        if f" {OTHER}:" in text:
            raise FormatError(f"{cls.what} has no joints of mobility {OTHER}", "text")
        return cls(MechanismGraph.from_text(text.replace(f" {cls.letter}:", f" {OTHER}:")))

    def __repr__(self) -> str:
        return f"{type(self).__name__}.from_text({self.to_text()!r})"
