"""What a mesh has besides its shape, and how it travels through the native module."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import as_array, check_shape, short
from ._errors import InputError
from ._native import Materials

# Number types that the library knows; of others, values are numbered.
KINDS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64")
COLOURS = {"colour", "color", "colours", "colors", "rgb", "rgba", "vertex_colors", "face_colors"}
NORMALS = {"normal", "normals"}
# What VTK calls the numbers of the cells that a surface was made of; those of corners occur several times.
NUMBERS = ("vtkOriginalCellIds",)
# As the library has it: with fewer faces, each may have a label of its own; with many, labels have more than
# two faces each.
FEW, MANY = 8, 100
# Most numbers that the library takes for a vertex or face.
WIDEST = 4

Decode = Callable[[NDArray[np.float64]], NDArray[Any]]


class Alias(str):
    """The name that an array travels under, with what its owner calls it, which another array may be called.

    Messages have the owner's name, and `keep_labels` knows both.
    """

    called: str

    def __new__(cls, travels: str, called: str) -> Alias:
        """Of both names."""
        alias = super().__new__(cls, travels)
        alias.called = called
        return alias

    def __reduce__(self) -> tuple[Any, ...]:
        """Makes copies."""
        return Alias, (str(self), self.called)


def called(name: str) -> str:
    """What the owner of an array calls it."""
    return name.called if isinstance(name, Alias) else name


@dataclass(eq=False)
class Attributes:
    """Colours, normals, labels and other numbers of a mesh with V vertices and F faces.

    Floating-point numbers of vertices are interpolated on the way to a result. Colours (three or four columns
    of uint8, or of any number under a name such as "colour" or "rgb") are too, and rounded; arrays named
    "normals" get length 1. Everything else (integers, truth values, strings) is that of the nearest corner of
    the triangle underneath. A face gets the value of the triangle under its centre.
    """

    vertex: dict[str, NDArray[Any]] = field(default_factory=dict)
    """Of the vertices: arrays of shape (V,) or (V, ...) by name."""
    face: dict[str, NDArray[Any]] = field(default_factory=dict)
    """Of the faces: arrays of shape (F,) or (F, ...) by name."""
    uv: NDArray[np.floating[Any]] | None = None
    """Texture coordinates of the faces' corners, shape (F, 3, 2); v grows upwards."""
    label_names: dict[str, list[str]] = field(default_factory=dict)
    """For a label with names, such as an OBJ file's groups: what 0, 1, ... are called."""
    materials: Materials | None = None
    """What `read` found of materials, for `write`; opaque."""

    def __post_init__(self) -> None:
        self.check()

    def check(self) -> None:
        """Raises `InputError` for parts of another type; their arrays are checked where they are used."""
        for part, given in (("vertex", self.vertex), ("face", self.face), ("label_names", self.label_names)):
            if not isinstance(given, Mapping):
                what = "lists of words" if part == "label_names" else "arrays"
                raise InputError(f"`attributes.{part}` is {short(given)}; give a dict of {what} by name")
        for name, words in self.label_names.items():
            is_list = isinstance(words, (list, tuple, np.ndarray))
            if not is_list or not all(isinstance(word, str) for word in words):
                place = f"`attributes.label_names[{name!r}]`"
                raise InputError(f"{place} is {short(words)}; give a list of what 0, 1, ... are called")
        if not (self.materials is None or isinstance(self.materials, Materials)):
            remedy = "give what rtfmesh.read has found, or None"
            raise InputError(f"`attributes.materials` is {short(self.materials)}; {remedy}")

    @classmethod
    def of(cls, given: Attributes | Mapping[str, Any] | bool | None) -> Attributes:
        """Attributes as an argument has them: these, or a dict with the same keys; else none.

        Where an object brings its own, None and True are for those; who calls this knows of them.
        """
        if given is None or isinstance(given, bool):
            return cls()
        if isinstance(given, cls):
            # They may have been changed since they were made.
            given.check()
            return given
        if isinstance(given, Mapping):
            unknown = set(given) - set(cls.__dataclass_fields__)
            if not unknown:
                return cls(**given)
            names = ", ".join(cls.__dataclass_fields__)
            raise InputError(f"`attributes` has {sorted(map(str, unknown))}; its keys are {names}")
        raise InputError(
            "`attributes` is neither rtfmesh.Attributes nor a dict with keys such as 'vertex', 'face'"
        )


def brings_own(attributes: Any) -> bool:
    """Whether an object's arrays come along, as an argument `attributes` says that has no others."""
    if attributes is None or isinstance(attributes, (bool, np.bool_)):
        return attributes is None or bool(attributes)
    remedy = "use True or False, and put other arrays into the object"
    raise InputError(f"`attributes` is {short(attributes)}; {remedy}")


@dataclass
class Column:
    """One to four numbers for each vertex or face, as the native module takes and gives them."""

    name: str
    role: str
    kind: str
    components: int
    values: NDArray[np.float64]
    names: list[str]


@dataclass
class Given:
    """Attributes as the native module takes them."""

    vertex: list[Column]
    face: list[Column]
    uv: NDArray[np.float64] | None
    uv_kind: str
    materials: Materials | None


def role(name: str, columns: int, dtype: np.dtype[Any]) -> str:
    """What an attribute means, by its name and type."""
    word = name.lower()
    if columns in (3, 4) and (dtype == np.uint8 or word in COLOURS):
        return "colour"
    if columns == 3 and dtype.kind == "f" and word in NORMALS:
        return "normal"
    return "label" if dtype.kind in "iu" else "other"


def rows(value: Any, name: str, count: int, of: str) -> NDArray[Any]:
    """An attribute as an array with a row for each vertex or face."""
    name = called(name)
    array = as_array(value, f"attributes.{of}['{name}']")
    if array.ndim == 0 or len(array) != count:
        have = f"shape {array.shape}, but there are {count} {'vertices' if of == 'vertex' else 'faces'}"
        raise InputError(f"`attributes.{of}['{name}']` has {have}; give a row for each")
    return array


def of_type(dtype: np.dtype[Any], width: int, found: NDArray[np.float64]) -> NDArray[Any]:
    """The numbers of a column in rows of this many."""
    return found.reshape(-1, width).astype(dtype)


def numbered(array: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """The rows that occur, and for each row its number among them: equal labels are equal numbers."""
    try:
        values, own = np.unique(array, axis=0 if array.ndim > 1 else None, return_inverse=True)
    except TypeError:
        # Objects that have no order: each row is a value of its own.
        values, own = array, np.arange(len(array))
    return values, np.ascontiguousarray(own, dtype=np.float64).ravel()


def columns(name: str, array: NDArray[Any], names: list[str]) -> tuple[list[Column], list[Decode]]:
    """The columns that an attribute travels in, and how to make it of them again."""
    flat = array.reshape(len(array), int(np.prod(array.shape[1:], dtype=int)))
    kind = array.dtype.name
    if kind not in KINDS and array.dtype.kind == "f":
        kind = "float64"
    if kind not in KINDS:
        values, own = numbered(array)
        return [Column(name, "label", "uint32", 1, own, [])], [lambda found: values[found.astype(np.intp)]]
    means = role(name, flat.shape[1], array.dtype)
    parts: list[Column] = []
    decode: list[Decode] = []
    for start in range(0, flat.shape[1], WIDEST):
        part = flat[:, start : start + WIDEST]
        title = f"{name} {start // WIDEST}" if start else name
        values = np.ascontiguousarray(part, dtype=np.float64).ravel()
        parts.append(Column(title, means, kind, part.shape[1], values, names if part.shape[1] == 1 else []))
        decode.append(partial(of_type, array.dtype, part.shape[1]))
    return parts, decode


def as_label(name: str, array: NDArray[Any], names: list[str]) -> tuple[list[Column], list[Decode]]:
    """As `columns`, of an array that is to be a label whatever its type."""
    if array.ndim == 1 and array.dtype.name in KINDS and array.dtype.kind in "iu":
        return columns(name, array, names)
    values, own = numbered(array.reshape(len(array), -1) if array.ndim > 1 else array)
    if array.dtype.kind == "O" and values is array:
        text = "has values without an order, such as None beside words; give numbers or words alone"
        raise InputError(f"`attributes.face['{called(name)}']` {text}")
    return [Column(name, "label", "uint32", 1, own, [])], [lambda found: values[found.astype(np.intp)]]


def numbers_faces(values: NDArray[np.float64]) -> bool:
    """Whether values are all different, or were of polygons that are triangles now."""
    distinct, count = len(np.unique(values)), len(values)
    return count >= FEW and (distinct == count or (count >= MANY and 2 * distinct >= count))


@dataclass
class Labels:
    """Which arrays of the faces are labels whose borders are kept."""

    names: Sequence[str] | None
    """Those that were asked for; None for all but those that number the faces."""
    kept: list[str] = field(default_factory=list)
    numbers: list[str] = field(default_factory=list)
    """Arrays that look like labels, but number the faces."""

    @classmethod
    def of(cls, keep: bool | list[str], face: Mapping[str, Any]) -> Labels | None:
        """What `keep_labels` says of arrays with these names; None if no borders are kept."""
        if not keep:
            return None
        names = None if keep is True else list(keep)
        there = {*face, *map(called, face)}
        unknown = [name for name in names or () if name not in there]
        if unknown:
            listed = ", ".join(repr(called(name)) for name in face) or "no arrays"
            raise InputError(f"`keep_labels` names {unknown[0]!r}; the faces have {listed}")
        return cls(names)

    def has_named(self, name: str) -> bool:
        """Whether this array was asked for by its name."""
        return self.names is not None and (name in self.names or called(name) in self.names)

    def choose(self, name: str, array: NDArray[Any], own: list[Column]) -> None:
        """Decides whether the columns of an array count."""
        if not any(column.role == "label" for column in own):
            return
        counts = self.names is None or self.has_named(name)
        if self.names is None and (name in NUMBERS or numbers_faces(own[0].values)):
            self.numbers.append(called(name))
            counts = False
        if counts:
            self.kept.append(called(name))
            return
        # Faces get values of the triangle underneath in any case.
        for column in own:
            column.role = "other" if column.role == "label" else column.role

    def warning(self) -> str | None:
        """What to tell of the choice, where it may not be the one that was meant."""
        if self.names is not None or not (self.numbers or len(self.kept) > 1):
            return None
        kept = ", ".join(map(repr, self.kept)) or "no array"
        text = f"`keep_labels` keeps the borders of {kept}"
        if self.numbers:
            text += (
                f", and not of {', '.join(map(repr, self.numbers))}, whose values differ from face to face"
            )
        return f"{text}; name the arrays to choose others"


@dataclass
class Group:
    """The attributes of vertices or of faces on their way through the native module."""

    columns: list[Column]
    back: list[tuple[str, tuple[int, ...], list[Decode]]]

    @classmethod
    def of(
        cls,
        arrays: Mapping[str, Any],
        count: int,
        of: str,
        names: Mapping[str, list[str]],
        labels: Labels | None = None,
    ) -> Group:
        """Of arrays by name, a row for each of `count` vertices or faces; `labels` chooses among these."""
        group = cls([], [])
        for name, value in arrays.items():
            array = rows(value, name, count, of)
            if labels is not None and labels.has_named(name):
                own, decode = as_label(str(name), array, list(names.get(name, [])))
            else:
                own, decode = columns(str(name), array, list(names.get(name, [])))
            if labels is not None:
                labels.choose(name, array, own)
            group.columns += own
            group.back.append((name, array.shape[1:], decode))
        return group

    def decoded(self, found: list[tuple[Any, ...]], count: int) -> dict[str, NDArray[Any]]:
        """The arrays for a result, of the types that they had; none if nothing was carried."""
        if len(found) != len(self.columns):
            return {}
        values = iter(column[4] for column in found)
        arrays = {}
        for name, shape, decode in self.back:
            parts = [one(next(values)) for one in decode]
            whole = np.concatenate(parts, axis=1) if len(parts) > 1 else parts[0] if parts else np.empty(0)
            plain = str(name) if isinstance(name, Alias) else name
            arrays[plain] = whole.reshape((count, *shape))
        return arrays


def texture(uv: Any, faces: int) -> tuple[NDArray[np.float64] | None, str]:
    """Texture coordinates for the native module, with their number type."""
    if uv is None:
        return None, "float64"
    array = as_array(uv, "attributes.uv")
    check_shape(array, "attributes.uv", (faces, 3, 2))
    if array.dtype.kind not in "fiu":
        raise InputError(f"`attributes.uv` has values of type {array.dtype}; give real numbers")
    kind = "float32" if array.dtype == np.float32 else "float64"
    return np.ascontiguousarray(array, dtype=np.float64), kind


@dataclass
class Carrier:
    """Attributes of an input, and what makes those of the result."""

    source: Attributes
    vertex: Group
    face: Group
    given: Given
    labels: Labels | None

    @classmethod
    def of(cls, source: Attributes, vertices: int, faces: int, keep: bool | list[str] = False) -> Carrier:
        """Of attributes of a mesh with this many vertices and faces; `keep` is what `keep_labels` says."""
        labels = Labels.of(keep, source.face)
        vertex = Group.of(source.vertex, vertices, "vertex", source.label_names)
        face = Group.of(source.face, faces, "face", source.label_names, labels)
        uv, kind = texture(source.uv, faces)
        given = Given(vertex.columns, face.columns, uv, kind, source.materials)
        return cls(source, vertex, face, given, labels)

    def carried(self, found: tuple[Any, ...], vertices: int, faces: int) -> Attributes:
        """The attributes of a result with these numbers of vertices and faces."""
        vertex, face, uv, kind, materials = found
        return Attributes(
            self.vertex.decoded(vertex, vertices),
            self.face.decoded(face, faces),
            None if uv is None else uv.reshape(-1, 3, 2).astype(kind, copy=False),
            dict(self.source.label_names),
            materials,
        )


def read_attributes(found: tuple[Any, ...]) -> Attributes:
    """The attributes of a file."""
    vertex, face, uv, kind, materials = found
    attributes = Attributes(materials=materials)
    for own, arrays in ((vertex, attributes.vertex), (face, attributes.face)):
        for name, _, number, width, values, names in own:
            array = values.astype(number, copy=False)
            arrays[name] = array.reshape(-1, width) if width > 1 else array
            if names:
                attributes.label_names[name] = names
    if uv is not None:
        attributes.uv = uv.reshape(-1, 3, 2).astype(kind, copy=False)
    return attributes


def for_files(attributes: Attributes) -> Attributes:
    """The attributes with number types that files have."""

    def fitting(name: str, value: Any) -> NDArray[Any]:
        array = as_array(value, name)
        if array.dtype.name in KINDS:
            return array
        if array.dtype.kind == "f":
            return array.astype(np.float64)
        if array.dtype.kind == "b":
            return array.astype(np.uint8)
        for kind in (np.int32, np.uint32):
            limits = np.iinfo(kind)
            fits = array.dtype.kind in "iu" and (
                array.size == 0 or (limits.min <= array.min() and array.max() <= limits.max)
            )
            if fits:
                return array.astype(kind)
        text = f"attribute '{name}' is of type {array.dtype}, which no file holds"
        raise InputError(f"`attributes`: {text}; remove it or convert it")

    return Attributes(
        {name: fitting(name, value) for name, value in attributes.vertex.items()},
        {name: fitting(name, value) for name, value in attributes.face.items()},
        attributes.uv,
        attributes.label_names,
        attributes.materials,
    )
