"""A scene: one question, the mechanism it is about, and the outputs wanted, as frozen data read from TOML."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from graphsynth.core.errors import SceneError
from graphsynth.core.textfiles import read_bytes, text_of, toml_tables
from graphsynth.core.wording import nearest
from graphsynth.pipeline.system import RANK, STRUCTURE, Stage, system, system_names
from graphsynth.pipeline.tables import In, Place, read_table, require, suggest

_PACKAGE = Path(__file__).resolve().parent
#: Folders with shipped scenes: inside a wheel, then beside an editable checkout.
_FOLDERS = (_PACKAGE / "shipped", _PACKAGE.parent.parent / "catalog" / "scenes")

_LONGEST_NAME = 100
#: The shipped scene whose mechanism, ranking and products serve any structural question, and how many it draws.
_FOR_QUESTIONS, _SAMPLE = "worked_example", 200


@dataclass(frozen=True, slots=True)
class SceneTable:
    """``[scene]``: how the scene is called."""

    name: str
    title: str
    description: str = ""
    seed: int = 0

    def __post_init__(self) -> None:
        require(
            re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", self.name) is not None,
            f"has name {self.name!r}; it names a folder, so use letters, digits, '-', '_' and '.'",
        )
        require(len(self.name) <= _LONGEST_NAME, f"has name of {len(self.name)} letters; use at most {_LONGEST_NAME}")
        for key in ("title", "description"):
            strange = [c for c in getattr(self, key) if not c.isprintable() and c not in "\n\t"]
            require(not strange, f"has {key} with {strange[:1]}, which cannot be printed; remove it")
        require(0 <= self.seed < 2**63, f"has seed = {self.seed}; use 0 to 2**63 - 1")


@dataclass(frozen=True, slots=True)
class GenerateTable:
    """``[structure.generate]``: which mechanisms of the question become candidates."""

    symmetry: int | None = None  # 3: keep those with a three-fold automorphism that fixes the frame; 2: mirror images
    fixed_moving_links: int | None = None  # of such an automorphism, the number of moving links that stay in place
    planar: bool = False  # leave out graphs that cannot be drawn without crossings
    sample: int | None = None  # of more mechanisms draw so many uniformly, with the scene's seed; repeats are dropped
    limit: int = 10_000  # stop with an error when there are more candidates than this

    def __post_init__(self) -> None:
        require(self.symmetry in (None, 2, 3), f"has symmetry {self.symmetry}; 2 and 3 are known, or leave it out")
        require(self.limit >= 1, f"has limit {self.limit}; it must be at least 1")
        most = min(self.limit, 1_000_000)
        require(
            self.sample is None or 1 <= self.sample <= most,
            f"has sample {self.sample}; draw 1 to {most}, the limit on candidates",
        )
        require(self.sample is None or self.symmetry is None, "has sample and symmetry; only one of them works")
        if self.fixed_moving_links is not None:
            require(self.symmetry == 3, "gives fixed_moving_links without a rotation; add symmetry = 3")
            require(self.fixed_moving_links >= 0, f"has fixed_moving_links {self.fixed_moving_links}; at least 0")


@dataclass(frozen=True, slots=True)
class StructureTable:
    """``[structure]``: the structural question, or graphs by their keys or text forms, and which become candidates."""

    question: Mapping[str, object] | None = None
    graphs: tuple[str, ...] = ()
    generate: GenerateTable = field(default_factory=GenerateTable)

    def __post_init__(self) -> None:
        require((self.question is None) != (not self.graphs), "must have either a table question or a list graphs")
        if self.graphs:
            only = "of graphs that are given; it is for a question"
            require(self.generate.symmetry is None, f"has generate.symmetry {only}")
            require(self.generate.sample is None, f"has generate.sample {only}")


@dataclass(frozen=True, slots=True)
class OutputsTable:
    """``[outputs]``: the products wanted; nothing that they do not need is imported or computed."""

    products: tuple[str, ...]
    files: tuple[Literal["csv", "parquet"], ...] = ("csv",)

    def __post_init__(self) -> None:
        require(bool(self.products), "has products = []; name at least one output")
        twice = len(set(self.products)) < len(self.products)
        require(not twice, f"has products = {list(self.products)}, one of them twice")


@dataclass(frozen=True, slots=True)
class BudgetTable:
    """``[budget]``: where a run stops.  What is stored by then stays, and a run with more goes on from it."""

    time: Annotated[float | None, In("s", above=0)] = None  # wall time; looked at after candidates, between stages
    memory: Annotated[float | None, In("MB", above=0)] = None  # resident, bytes, of the process that runs the scene
    boxes: Annotated[int | None, In(above=0)] = None  # the most that stages which pave or prove may look at


@dataclass(frozen=True, slots=True)
class ObjectiveTable:
    """One of ``[[ranking.objectives]]``: a margin of the records, and what is wanted of it."""

    quantity: str
    goal: Literal["min", "max"] = "min"
    target: float | None = None
    weight: Annotated[float, In(above=0)] = 1.0


@dataclass(frozen=True, slots=True)
class RankingTable:
    """``[ranking]``: the objectives, and how many candidates the report lists."""

    objectives: tuple[ObjectiveTable, ...]
    show: Annotated[int, In(least=1, why="it must be at least 1")] = 10

    def __post_init__(self) -> None:
        require(bool(self.objectives), "has no objectives; name at least one quantity")


@dataclass(frozen=True, slots=True)
class TiltTable:
    """Tilt of the motor axis: by `alpha_rad` about the direction `axis`."""

    alpha: Annotated[float, In("rad", above=-math.pi / 2, below=math.pi / 2, why="it must be within pi/2")]
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require(any(self.axis), "has axis [0, 0, 0]; a direction must not vanish")


@dataclass(frozen=True, slots=True)
class BearingTable:
    """The bearing at B: radius, height and radial clearance in millimetres, and the contact condition."""

    radius_mm: Annotated[float, In(above=0)]
    height_mm: Annotated[float, In(above=0)]
    clearance_mm: Annotated[float, In(least=0)]
    condition: Literal["A", "B"] = "A"


#: Every table of a scene but ``[mechanism]``, which its system describes.
TABLES: dict[str, type] = {
    "scene": SceneTable,
    "structure": StructureTable,
    "ranking": RankingTable,
    "budget": BudgetTable,
    "outputs": OutputsTable,
}


@dataclass(frozen=True, slots=True)
class Scene:
    """The tables of a scene as read, checked and frozen, and where they come from."""

    scene: SceneTable
    mechanism: Any  # of the type its system says
    outputs: OutputsTable
    structure: StructureTable | None = None
    ranking: RankingTable | None = None
    budget: BudgetTable = field(default_factory=BudgetTable)
    source: str = "<mapping>"  # or the name of the file
    raw: Mapping[str, object] = field(default_factory=dict, compare=False, repr=False)  # as TOML gave it
    digest: str = ""  # SHA-256 of the bytes of the file
    text: str = field(default="", compare=False, repr=False)  # of the file, for the line numbers of messages
    folder: Path = field(default=Path(), compare=False, repr=False)  # of the file: where paths in it begin

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.scene.name

    @property
    def place(self) -> Place:
        """Where the scene was read from, for messages."""
        return Place(self.source, (), self.text)

    @classmethod
    def from_mapping(cls, tables: object, source: str = "<mapping>", digest: str = "", text: str = "") -> Scene:
        """Read a scene from the tables of a TOML document; a `SceneError` names file, key and the nearest valid key."""
        place = Place(source, (), text)
        if not isinstance(tables, Mapping):
            raise place.error("must hold tables")
        known: dict[str, type] = {**TABLES, "mechanism": object}
        for key in tables:
            if key not in known:
                other = "; it holds a mechanism, not a scene" if key == "format" else suggest(str(key), known)
                raise place.error(f"has an unknown table [{key}]{other}", str(key))
        for key in ("scene", "mechanism", "outputs"):
            if key not in tables:
                remedy = '; give it with products, such as ["records", "tables"]' if key == "outputs" else ""
                raise place.error(f"lacks the table [{key}]{remedy}")
        mechanism, at = tables["mechanism"], place / "mechanism"
        if not isinstance(mechanism, Mapping):
            raise at.error("must be a table")
        if not isinstance(mechanism.get("module"), str):
            raise at.error(f"lacks the key 'module'{suggest('', system_names())}")
        chosen = system(mechanism["module"], at)
        if chosen.structure == "required" and "structure" not in tables:
            raise place.error("lacks the table [structure]")
        if chosen.structure == "none" and "structure" in tables:
            raise place.error("has a table [structure], which its mechanism does not need; remove it")
        known["mechanism"] = chosen.table
        read: dict[str, Any] = {
            key: read_table(schema, tables[key], place / key) for key, schema in known.items() if key in tables
        }
        return cls(**read, source=source, raw=dict(tables), digest=digest, text=text)

    def stages(self) -> tuple[Stage, ...]:
        """Return every stage this scene can use; most are not needed for its outputs."""
        chosen = system(self.mechanism.module)
        own = (*chosen.stages, *(chosen.more(self) if chosen.more else ()))
        given = {product for stage in (*STRUCTURE, *own) for product in stage.gives}
        common = tuple(stage for stage in STRUCTURE if given.issuperset(stage.needs)) if self.structure else ()
        ranking = (RANK,) if self.ranking is not None and "ranking" not in given else ()
        return (*common, *ranking, *own)


def available_scenes() -> tuple[str, ...]:
    """Return the names of the scenes shipped with the package, sorted.

    >>> "lambda" in available_scenes()
    True
    """
    return tuple(sorted({path.stem for folder in _FOLDERS for path in folder.glob("*.toml")}))


def find_scene(name_or_path: str | Path) -> Path:
    """Return the file of a scene given by the name of a shipped one or by a path; a `SceneError` if there is neither.

    A path wins if it exists as a file; a bare word is looked up among the shipped scenes.

    >>> find_scene("lambda").name
    'lambda.toml'
    """
    path = Path(name_or_path)
    if path.suffix == ".toml" and path.is_file():
        return path
    for folder in _FOLDERS:
        shipped = folder / f"{name_or_path}.toml"
        if path.name == str(name_or_path) and shipped.is_file():
            return shipped
    raise SceneError(
        f"no scene {str(name_or_path)!r}: neither the path of a .toml file nor one of the shipped scenes "
        f"{', '.join(map(repr, available_scenes()))}{nearest(path.stem, available_scenes())}"
    )


def load_scene(name_or_path: str | Path) -> Scene:
    """Read a scene by name or path; the file of a structural question asks what becomes of its mechanisms.

    A `SceneError` tells of a missing scene, an unknown key, a wrong type or a missing table, a `FormatError` with line
    and column of a file that is not TOML.

    >>> load_scene("lambda").mechanism.tilt.alpha == 1 / 30
    True
    """
    path = find_scene(name_or_path)
    data = read_bytes(path, what="a scene", place=path.name)
    text = text_of(data, path.name, "the scene")
    tables = toml_tables(text, path.name)
    if tables and not tables.keys() & {*TABLES, "mechanism", "format"}:
        tables = _of_question(tables, path)
    scene = Scene.from_mapping(tables, path.name, hashlib.sha256(data).hexdigest(), text)
    return replace(scene, folder=path.parent)


def _of_question(question: Mapping[str, object], path: Path) -> dict[str, Any]:
    """Tables of a scene that gives the mechanisms of a question, or a sample of them, dimensions and verdicts."""
    tables = toml_tables(find_scene(_FOR_QUESTIONS).read_text(encoding="utf-8"), path.name)
    told = f"Every mechanism of {path.name}, {_SAMPLE} drawn at random where there are more: which move, which bind?"
    tables["scene"] = {"name": path.stem, "title": f"Mechanisms of the question {path.stem}", "description": told}
    tables["structure"] = {"question": question, "generate": {"sample": _SAMPLE, "limit": _SAMPLE}}
    return tables
