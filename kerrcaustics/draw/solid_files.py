"""Models in space as files: glTF, and one HTML page that needs no network. Neither needs OpenGL to write."""

import base64
import html
import json
import os
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from kerrcaustics.draw.solids import Model, SpaceCurve, Surface
from kerrcaustics.files import writing
from kerrcaustics.shapes import Float, Float32

# Component types of glTF 2.0: 32-bit floats, and unsigned 32-bit integers.
_FLOAT = 5126
_UNSIGNED = 5125
# Targets of glTF buffer views: vertex attributes, and indices.
_VERTICES = 34962
_INDICES = 34963
# Modes of glTF primitives: line strip, and triangles.
_STRIP = 3
_TRIANGLES = 4


def write_gltf(model: Model, path: str | os.PathLike[str]) -> None:
    """The model as glTF 2.0: binary where the name ends in .glb, else as text with the numbers in it (.gltf).

    The spin axis is glTF's y axis, which points upward there.
    """
    ending = Path(path).suffix.lower()
    if ending not in (".glb", ".gltf"):
        raise ValueError(f"Argument `path` must end in .glb or .gltf, but is {os.fspath(path)!r}.")
    tree, data = _gltf(model)
    with writing(path) as file:
        if ending == ".gltf":
            tree["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
            file.write(json.dumps(tree).encode())
        else:
            file.write(_binary(tree, data))


def _gltf(model: Model) -> tuple[dict[str, Any], bytes]:
    """The tree of a glTF file, and its numbers."""
    parts = (*model.lines, *model.surfaces)
    tree: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "kerrcaustics"},
        "scene": 0,
        "scenes": [{"name": model.title, "nodes": list(range(len(parts)))}],
        "nodes": [{"mesh": i, "name": part.name} for i, part in enumerate(parts)],
        "meshes": [],
        "materials": [_material(part) for part in parts],
        "accessors": [],
        "bufferViews": [],
    }
    data = bytearray()
    for i, part in enumerate(parts):
        tree["meshes"].append({"name": part.name, "primitives": [_primitive(part, tree, data) | {"material": i}]})
    return tree | {"buffers": [{"byteLength": len(data)}]}, bytes(data)


def _primitive(part: Surface | SpaceCurve, tree: dict[str, Any], data: bytearray) -> dict[str, Any]:
    """The mesh of a part, whose numbers are added to the data."""
    attributes = {"POSITION": _add(_upright(_places(part)), "VEC3", _VERTICES, tree, data)}
    if not isinstance(part, Surface):
        return {"attributes": attributes, "mode": _STRIP}
    attributes["NORMAL"] = _add(_upright(part.normals()), "VEC3", _VERTICES, tree, data)
    corners = _add(part.triangles().astype(np.uint32).ravel(), "SCALAR", _INDICES, tree, data)
    return {"attributes": attributes, "mode": _TRIANGLES, "indices": corners}


def _add(values: np.ndarray, kind: str, target: int, tree: dict[str, Any], data: bytearray) -> int:
    """Number of the accessor of an array that is added to the data."""
    raw = values.tobytes()
    view = {"buffer": 0, "byteOffset": len(data), "byteLength": len(raw), "target": target}
    data += raw
    component = _FLOAT if values.dtype == np.float32 else _UNSIGNED
    accessor = {"bufferView": len(tree["bufferViews"]), "componentType": component, "count": len(values), "type": kind}
    if kind == "VEC3":
        accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
    tree["bufferViews"].append(view)
    tree["accessors"].append(accessor)
    return len(tree["accessors"]) - 1


def write_html(model: Model, path: str | os.PathLike[str]) -> None:
    """The model as one HTML page that turns by the mouse; it holds all it needs, and loads nothing."""
    numbers = bytearray()
    parts = [_entry(part, numbers) for part in (*model.surfaces, *model.lines)]
    tree = {"parts": parts, "look": model.look, "extent": model.extent}
    key = "".join(f'<li style="color:{colour}">{html.escape(words)}</li>' for words, colour in model.key)
    page = resources.files("kerrcaustics.draw").joinpath("solid_page.html").read_text(encoding="utf-8")
    entries = {
        "TITLE": html.escape(model.title),
        "KEY": key,
        "MODEL": json.dumps(tree),
        "NUMBERS": base64.b64encode(numbers).decode(),
    }
    for name, text in entries.items():
        page = page.replace(f"@{name}@", text)
    with writing(path) as file:
        file.write(page.encode())


def _entry(part: Surface | SpaceCurve, numbers: bytearray) -> dict[str, Any]:
    """A part for the page; its arrays are added to the numbers, and it holds the start and the size of each."""

    def store(values: np.ndarray) -> list[int]:
        begin = len(numbers)
        numbers.extend(values.tobytes())
        return [begin, values.size]

    entry: dict[str, Any] = {"colour": _rgb(part.colour), "opacity": part.opacity}
    entry["points"] = store(_places(part).astype(np.float32))
    if isinstance(part, SpaceCurve):
        return entry | {"width": part.width}
    entry["normals"] = store(part.normals().astype(np.float32))
    return entry | {"corners": store(part.triangles().astype(np.uint32))}


def _places(part: Surface | SpaceCurve) -> Float[np.ndarray, "n 3"]:
    return part.points.reshape(-1, 3)


def _upright(vectors: Float[np.ndarray, "n 3"]) -> Float32[np.ndarray, "n 3"]:
    """Vectors with y upward, for those with z upward."""
    return np.ascontiguousarray(vectors[:, [1, 2, 0]], np.float32)


def _rgb(colour: str) -> list[float]:
    return [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]


def _material(part: Surface | SpaceCurve) -> dict[str, Any]:
    linear = [((c + 0.055) / 1.055) ** 2.4 if c > 0.04045 else c / 12.92 for c in _rgb(part.colour)]
    surface = {"baseColorFactor": [*linear, part.opacity], "metallicFactor": 0.0, "roughnessFactor": 0.8}
    mode = "BLEND" if part.opacity < 1 else "OPAQUE"
    return {"name": part.name, "pbrMetallicRoughness": surface, "alphaMode": mode, "doubleSided": True}


def _binary(tree: dict[str, Any], data: bytes) -> bytes:
    """The parts of a .glb file, each filled up to four bytes."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = [len(text).to_bytes(4, "little"), b"JSON", text, len(data).to_bytes(4, "little"), b"BIN\0", data]
    body = b"".join(chunks)
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body
