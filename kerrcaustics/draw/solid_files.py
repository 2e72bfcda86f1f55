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

# Constants of glTF 2.0.
_FLOAT, _UNSIGNED, _VERTICES, _INDICES, _STRIP, _TRIANGLES = 5126, 5125, 34962, 34963, 3, 4


class _Buffer:
    """The numbers of a glTF file, and what they are."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, kind: str, target: int) -> int:
        """Number of the accessor of an array."""
        raw = values.tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), "target": target})
        self.data += raw
        accessor = {
            "bufferView": len(self.views) - 1,
            "componentType": _FLOAT if values.dtype == np.float32 else _UNSIGNED,
            "count": len(values),
            "type": kind,
        }
        if kind == "VEC3":
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def write_gltf(model: Model, path: str | os.PathLike[str]) -> None:
    """The model as glTF 2.0: binary where the name ends in .glb, else as text with the numbers in it (.gltf).

    The spin axis is glTF's y axis, which points upward there.
    """
    ending = Path(path).suffix.lower()
    if ending not in (".glb", ".gltf"):
        raise ValueError(f"Argument `path` must end in .glb or .gltf, but is {os.fspath(path)!r}.")
    buffer = _Buffer()
    meshes, materials = [], []
    for part in (*model.lines, *model.surfaces):
        attributes = {"POSITION": buffer.add(_upright(_places(part)), "VEC3", _VERTICES)}
        primitive: dict[str, Any] = {"attributes": attributes, "material": len(materials), "mode": _STRIP}
        if isinstance(part, Surface):
            attributes["NORMAL"] = buffer.add(_upright(part.normals()), "VEC3", _VERTICES)
            corners = part.triangles().astype(np.uint32).ravel()
            primitive |= {"mode": _TRIANGLES, "indices": buffer.add(corners, "SCALAR", _INDICES)}
        meshes.append({"name": part.name, "primitives": [primitive]})
        materials.append(_material(part))
    tree = {
        "asset": {"version": "2.0", "generator": "kerrcaustics"},
        "scene": 0,
        "scenes": [{"name": model.title, "nodes": list(range(len(meshes)))}],
        "nodes": [{"mesh": i, "name": mesh["name"]} for i, mesh in enumerate(meshes)],
        "meshes": meshes,
        "materials": materials,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    with writing(path) as file:
        if ending == ".gltf":
            uri = "data:application/octet-stream;base64," + base64.b64encode(buffer.data).decode()
            tree["buffers"] = [{"byteLength": len(buffer.data), "uri": uri}]
            file.write(json.dumps(tree).encode())
        else:
            file.write(_binary(tree, bytes(buffer.data)))


def write_html(model: Model, path: str | os.PathLike[str]) -> None:
    """The model as one HTML page that turns by the mouse; it holds all it needs, and loads nothing."""
    numbers = bytearray()

    def stored(values: np.ndarray) -> list[int]:
        begin = len(numbers)
        numbers.extend(values.tobytes())
        return [begin, values.size]

    parts = []
    for part in (*model.surfaces, *model.lines):
        entry: dict[str, Any] = {"colour": _rgb(part.colour), "opacity": part.opacity}
        entry["points"] = stored(_places(part).astype(np.float32))
        if isinstance(part, Surface):
            entry["normals"] = stored(part.normals().astype(np.float32))
            entry["corners"] = stored(part.triangles().astype(np.uint32))
        else:
            entry["width"] = part.width
        parts.append(entry)
    tree = {"parts": parts, "look": model.look, "extent": model.extent}
    key = "".join(f'<li style="color:{colour}">{html.escape(words)}</li>' for words, colour in model.key)
    page = resources.files("kerrcaustics.draw").joinpath("solid_page.html").read_text(encoding="utf-8")
    filled = {
        "TITLE": html.escape(model.title),
        "KEY": key,
        "MODEL": json.dumps(tree),
        "NUMBERS": base64.b64encode(numbers).decode(),
    }
    for name, text in filled.items():
        page = page.replace(f"@{name}@", text)
    with writing(path) as file:
        file.write(page.encode())


def _places(part: Surface | SpaceCurve) -> np.ndarray:
    return part.points.reshape(-1, 3)


def _upright(vectors: np.ndarray) -> np.ndarray:
    """From z upward to y upward."""
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
