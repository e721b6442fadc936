"""A scene: one question, the mechanism it is about, and the outputs wanted, as frozen data read from TOML."""

from __future__ import annotations

import hashlib
import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from graphsynth.errors import FormatError, SceneError
from graphsynth.scenes.tables import Place, read_table, suggest
from graphsynth.structure.variables import nearest

__all__ = [
    "MECHANISMS",
    "GenerateTable",
    "LambdaTable",
    "PlatformTable",
    "Scene",
    "available_scenes",
    "find_scene",
    "load_scene",
]

_PACKAGE = Path(__file__).resolve().parent


def _require(condition: bool, sentence: str) -> None:
    if not condition:
        raise SceneError(sentence)


@dataclass(frozen=True, slots=True)
class SceneTable:
    """``[scene]``: how the scene is called."""

    name: str
    title: str
    description: str = ""
    seed: int = 0

    def __post_init__(self) -> None:
        _require(
            re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", self.name) is not None,
            f"has name {self.name!r}; it names a folder, so use letters, digits, '-', '_' and '.'",
        )


@dataclass(frozen=True, slots=True)
class GenerateTable:
    """``[structure.generate]``: which mechanisms of the question become candidates.

    Attributes
    ----------
    symmetry : int or None
        Keep mechanisms that have an automorphism of this order that fixes the frame.
    fixed_moving_links : int or None
        Of such an automorphism, the number of moving links that stay in place.
    limit : int
        Stop with an error when there are more candidates than this.
    """

    symmetry: int | None = None
    fixed_moving_links: int | None = None
    limit: int = 10_000

    def __post_init__(self) -> None:
        _require(self.symmetry in (None, 3), f"has symmetry {self.symmetry}; only 3 is known, or leave it out")
        _require(self.limit >= 1, f"has limit {self.limit}; it must be at least 1")
        if self.fixed_moving_links is not None:
            _require(self.symmetry is not None, "gives fixed_moving_links without symmetry; add symmetry = 3")
            _require(self.fixed_moving_links >= 0, f"has fixed_moving_links {self.fixed_moving_links}; at least 0")


@dataclass(frozen=True, slots=True)
class StructureTable:
    """``[structure]``: the structural question and how candidates are generated from its solutions."""

    question: Mapping[str, object]
    generate: GenerateTable = field(default_factory=GenerateTable)


@dataclass(frozen=True, slots=True)
class LambdaLengths:
    """Link lengths of the four-bar, in any one unit: the model only uses their ratios."""

    frame: float
    crank: float
    coupler: float
    rocker: float

    def __post_init__(self) -> None:
        for name in ("frame", "crank", "coupler", "rocker"):
            _require(getattr(self, name) > 0, f"has {name} = {getattr(self, name)}; a length must be positive")


@dataclass(frozen=True, slots=True)
class Tilt:
    """Tilt of the motor axis: by `alpha_rad` about the direction `axis`."""

    alpha_rad: float
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _require(any(self.axis), "has axis [0, 0, 0]; a direction must not vanish")
        _require(abs(self.alpha_rad) < math.pi / 2, f"has alpha_rad = {self.alpha_rad}; it must be within pi/2")


@dataclass(frozen=True, slots=True)
class BearingTable:
    """The bearing at B: radius, height and radial clearance in millimetres, and the contact condition."""

    radius_mm: float
    height_mm: float
    clearance_mm: float
    condition: Literal["A", "B"] = "A"

    def __post_init__(self) -> None:
        _require(self.radius_mm > 0, f"has radius_mm = {self.radius_mm}; it must be positive")
        _require(self.height_mm > 0, f"has height_mm = {self.height_mm}; it must be positive")
        _require(self.clearance_mm >= 0, f"has clearance_mm = {self.clearance_mm}; it must not be negative")


@dataclass(frozen=True, slots=True)
class LambdaTable:
    """``[mechanism]`` with ``module = "lambda_linkage"``."""

    module: Literal["lambda_linkage"]
    lengths: LambdaLengths
    tilt: Tilt
    bearing: BearingTable
    branch: Literal[1, -1] = 1
    positions: int = 360
    tolerances: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check_positions(self.positions)


@dataclass(frozen=True, slots=True)
class PlatformTable:
    """``[mechanism]`` with ``module = "single_motor_platform"``: one leg, repeated at three directions.

    Points are ``[along, across]`` in the frame of a leg, whose first axis points away from the centre.
    """

    module: Literal["single_motor_platform"]
    leg_directions_deg: tuple[float, float, float]
    wheel_axis_mm: tuple[float, float]
    rocker_pivot_mm: tuple[float, float]
    platform_vertex_mm: tuple[float, float]
    arm_mm: float
    intermediate_mm: float
    rocker_mm: float
    coupler_mm: float
    crank_mm: tuple[float, float, float]
    crank_phase_rad: tuple[float, float, float]
    rocker_angle_deg: float
    pinion_teeth: int
    wheel_teeth: int
    drive_branch: Literal[1, -1] = 1
    working_mode: tuple[Literal[1, -1], Literal[1, -1], Literal[1, -1]] = (-1, -1, -1)
    positions: int = 360

    def __post_init__(self) -> None:
        for name in ("arm_mm", "intermediate_mm", "rocker_mm", "coupler_mm"):
            _require(getattr(self, name) > 0, f"has {name} = {getattr(self, name)}; a length must be positive")
        for name in ("pinion_teeth", "wheel_teeth"):
            _require(getattr(self, name) > 0, f"has {name} = {getattr(self, name)}; a gear needs teeth")
        _require(min(self.crank_mm) >= 0, f"has crank_mm = {list(self.crank_mm)}; a crank must not be negative")
        _check_positions(self.positions)


def _check_positions(positions: int) -> None:
    _require(8 <= positions <= 1_000_000, f"has positions = {positions}; use 8 to 1000000 crank positions per turn")


#: Every mechanism module a scene can name, with the schema of its ``[mechanism]`` table.
MECHANISMS: dict[str, type] = {"lambda_linkage": LambdaTable, "single_motor_platform": PlatformTable}


@dataclass(frozen=True, slots=True)
class OutputsTable:
    """``[outputs]``: the products wanted; nothing that they do not need is imported or computed."""

    products: tuple[str, ...]

    def __post_init__(self) -> None:
        _require(bool(self.products), "has no products; name at least one output")
        _require(len(set(self.products)) == len(self.products), f"names a product twice in {list(self.products)}")


@dataclass(frozen=True, slots=True)
class Scene:
    """A scene as read: checked, frozen, and with its raw text for the record.

    Attributes
    ----------
    scene, structure, mechanism, outputs
        The four tables of the file.
    source : str
        File name, or ``<mapping>``.
    raw : Mapping
        The tables as TOML gave them.
    digest : str
        SHA-256 of the file's bytes, empty for a mapping.
    """

    scene: SceneTable
    structure: StructureTable
    mechanism: LambdaTable | PlatformTable
    outputs: OutputsTable
    source: str = "<mapping>"
    raw: Mapping[str, object] = field(default_factory=dict, compare=False, repr=False)
    digest: str = ""

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.scene.name

    @property
    def place(self) -> Place:
        """Where the scene was read from, for messages."""
        return Place(self.source)

    @classmethod
    def from_mapping(cls, tables: object, source: str = "<mapping>", digest: str = "") -> Scene:
        """Read a scene from the tables of a TOML document.

        Raises
        ------
        SceneError
            With the file, the key, what was expected and the nearest valid key.
        """
        place = Place(source)
        if not isinstance(tables, Mapping):
            raise place.error("must hold tables")
        known: dict[str, type | None] = {
            "scene": SceneTable,
            "structure": StructureTable,
            "mechanism": None,  # chosen by its module, below
            "outputs": OutputsTable,
        }
        for key in tables:
            if key not in known:
                raise place.error(f"has an unknown table [{key}]{suggest(str(key), known)}")
        for key in known:
            if key not in tables:
                raise place.error(f"lacks the table [{key}]")
        known["mechanism"] = _mechanism_schema(tables["mechanism"], place / "mechanism")
        read: dict[str, Any] = {
            key: read_table(schema, tables[key], place / key) for key, schema in known.items() if schema
        }
        return cls(**read, source=source, raw=dict(tables), digest=digest)


def _mechanism_schema(table: object, place: Place) -> type:
    """Choose the schema of ``[mechanism]`` by its key ``module``."""
    if not isinstance(table, Mapping):
        raise place.error("must be a table")
    module = table.get("module")
    if not isinstance(module, str):
        raise place.error(f"lacks the key 'module'{suggest('', MECHANISMS)}")
    if module not in MECHANISMS:
        raise place.error(f"has module = {module!r}, which no room provides{suggest(module, MECHANISMS)}")
    return MECHANISMS[module]


def _folders() -> tuple[Path, ...]:
    """Folders with shipped scenes: inside a wheel, then beside an editable checkout."""
    return (_PACKAGE / "shipped", _PACKAGE.parent.parent / "catalog" / "scenes")


def available_scenes() -> tuple[str, ...]:
    """Return the names of the scenes shipped with the package, sorted.

    Examples
    --------
    >>> available_scenes()
    ('didenko', 'lambda')
    """
    return tuple(sorted({path.stem for folder in _folders() for path in folder.glob("*.toml")}))


def find_scene(name_or_path: str | Path) -> Path:
    """Return the file of a scene given by the name of a shipped one or by a path.

    A path wins if it exists as a file; a bare word is looked up among the shipped scenes.

    Raises
    ------
    SceneError
        If there is neither; the message lists the shipped scenes.

    Examples
    --------
    >>> find_scene("lambda").name
    'lambda.toml'
    """
    path = Path(name_or_path)
    if path.suffix == ".toml" and path.is_file():
        return path
    for folder in _folders():
        shipped = folder / f"{name_or_path}.toml"
        if path.name == str(name_or_path) and shipped.is_file():
            return shipped
    raise SceneError(
        f"no scene {str(name_or_path)!r}: neither the path of a .toml file nor one of the shipped scenes "
        f"{', '.join(map(repr, available_scenes()))}{nearest(path.stem, available_scenes())}"
    )


def load_scene(name_or_path: str | Path) -> Scene:
    """Read a scene by name or path.

    Raises
    ------
    SceneError
        On a missing scene, an unknown key, a wrong type or a missing table.
    FormatError
        If the file is not TOML; the place carries line and column.

    Examples
    --------
    >>> load_scene("lambda").mechanism.tilt.alpha_rad == 1 / 30
    True
    """
    path = find_scene(name_or_path)
    data = path.read_bytes()
    try:
        tables = tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise FormatError("not UTF-8 text; save the scene as UTF-8", f"{path.name}, byte {error.start}") from None
    except (ValueError, RecursionError) as error:  # ValueError: TOMLDecodeError, and integers of thousands of digits
        raise FormatError(f"not TOML: {error}", path.name) from None
    return Scene.from_mapping(tables, path.name, hashlib.sha256(data).hexdigest())
