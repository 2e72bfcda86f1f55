"""Kernels for browsers: the same bits as those of the program, in both builds."""

import base64
import json
import math

import numpy as np
import pytest
from living import needs_kernels, ran

import kerrcaustics as kc
from kerrcaustics.beams.kernels import library, webassembly
from kerrcaustics.beams.kernels.trees import leaves
from kerrcaustics.spacetime.kerr import horizon
from kerrcaustics.spacetime.shadow import shadow_edge

# Calls a program of a module: the numbers, the columns and the table in its memory, and the outputs behind them.
CALLER = """
const bytes = (text) => Uint8Array.from(Buffer.from(text, "base64"));
const module = await WebAssembly.instantiate(bytes(given.module), {});
const { memory, __heap_base, ...programs } = module.instance.exports;
memory.grow(64);
return given.calls.map(({ name, numbers, columns, table, count }) => {
  let free = (__heap_base.value + 15) & ~15;
  const put = (data) => {
    const at = free;
    new Uint8Array(memory.buffer).set(data, at);
    free += (data.length + 15) & ~15;
    return at;
  };
  const words = (pairs) => Int32Array.from(pairs.flatMap(([at, stride]) => [at, 0, stride, 0]));
  const slots = (pairs) => put(new Uint8Array(words(pairs).buffer));
  const numbersAt = put(bytes(numbers));
  const inputs = columns.map((column) => [put(bytes(column)), 1]);
  if (table) inputs.push([put(bytes(table.data)), table.rows]);
  const outputs = given.layout[name].outputs.map(([, kind, size]) => {
    const width = kind === "f" ? 8 : 1;
    return { width, size, at: put(new Uint8Array(width * size * count)) };
  });
  const parts = ({ width, size, at }) => Array.from({ length: size }, (_, i) => [at + width * i, size]);
  const places = outputs.flatMap(parts);
  programs[name](numbersAt, slots(inputs), slots(places), BigInt(count));
  return outputs.map(({ width, size, at }) =>
    Buffer.from(memory.buffer.slice(at, at + width * size * count)).toString("base64"));
});
"""
RAYS = 96


def cameras():
    """Cameras of all kinds: no spin and nearly extremal ones, on the axis, next to the horizon and far away."""
    for spin in (0.0, 0.5, 0.9999):
        yield kc.Camera(spin, 1.05 * horizon(spin), math.pi / 2, "fiducial")
        yield kc.Camera(spin, 6.03, math.pi / 2, "circular")
        yield kc.Camera(spin, 1e3, 0.0, "static")
        yield kc.Camera(spin, 1e6, 1.1, (0.0, 0.0, 0.3))


def directions(camera, rng):
    """Directions everywhere, and next to the shadow edge."""
    sky = rng.normal(size=(RAYS, 3))
    sky /= np.linalg.norm(sky, axis=1)[:, None]
    edge = shadow_edge(camera, RAYS // 2)
    near = edge + rng.normal(size=edge.shape) * 10.0 ** rng.uniform(-8, -1, (len(edge), 1))
    sky[: len(edge)] = near / np.linalg.norm(near, axis=1)[:, None]
    return sky


def calls():
    """For each camera and each of its programs the numbers, the columns, and the table of Newton's method."""
    rng = np.random.default_rng(1)
    for camera in cameras():
        sky, star = directions(camera, rng), rng.normal(size=(RAYS, 3))
        star /= np.linalg.norm(star, axis=1)[:, None]
        frame = [float(number) for number in leaves(camera.frame())]
        place = "_equator" if camera.on_equator else ""
        yield from ((f"{kind}{place}_sky", frame, [*sky.T], None) for kind in ("rays", "beams"))
        yield from ((f"{kind}_sky", frame, [*sky.T], None) for kind in ("short_rays", "short_beams"))
        table = np.tile([0.0, 0.01, 0.1, 0.5], (8, 1))
        columns = [*sky.T, *star.T, rng.integers(0, 3, RAYS).astype(float)]
        yield f"root{place}_sky", [*frame, float(camera.on_equator), 8.0, 12.0], columns, table


def _encoded(values):
    return base64.b64encode(np.ascontiguousarray(values, float).tobytes()).decode()


def _told(name, numbers, columns, table):
    call = {"name": name, "numbers": _encoded(numbers), "columns": [*map(_encoded, columns)], "count": RAYS}
    return {**call, "table": None if table is None else {"data": _encoded(table), "rows": len(table)}}


def _outputs(name, numbers, columns, table):
    """The outputs of the native kernel, in the order of the layout."""
    value = library.kernel(name).on_rays(numbers, columns, tables=[] if table is None else [table])
    return [leaf for leaf in leaves(value) if leaf is not None]


def _bits(values):
    """Bits of numbers; all of NaN alike, whose bits are left to the processor."""
    return np.where(np.isnan(values), np.nan, values).tobytes() if values.dtype == float else values.tobytes()


@pytest.mark.parametrize("build", ["simd", "plain"])
def test_kernels_for_browsers_have_the_bits_of_the_program(build):
    needs_kernels()
    kernels, asked = webassembly.browser_kernels(), [*calls()]
    assert {name for name, *_ in asked} == set(webassembly.PROGRAMS)
    module = base64.b64encode(getattr(kernels, build)).decode()
    given = {"module": module, "layout": kernels.layout, "calls": [_told(*call) for call in asked]}
    answers = ran(f"const given = {json.dumps(given)};{CALLER}")
    for (name, *call), found in zip(asked, answers, strict=True):
        names = [output[0] for output in kernels.layout[name]["outputs"]]
        for output, native, data in zip(names, _outputs(name, *call), found, strict=True):
            own = np.frombuffer(base64.b64decode(data), native.dtype)
            assert _bits(own) == _bits(native.ravel()), (name, output)


def test_kernels_for_browsers_older_than_their_sources_are_refused(tmp_path):
    needs_kernels()
    for name in (webassembly.LAYOUT, *map(webassembly.file_name, ("simd", "plain"))):
        (tmp_path / name).write_bytes((library.OBJECTS / name).read_bytes())
    assert webassembly.browser_kernels(tmp_path) == webassembly.browser_kernels()
    layout = tmp_path / webassembly.LAYOUT
    about = json.loads(layout.read_text())
    layout.write_text(json.dumps({**about, "digest": "0"}))
    with pytest.raises(RuntimeError, match="The kernels are older than their sources: run `make kernels`"):
        webassembly.browser_kernels(tmp_path)
    layout.unlink()
    assert webassembly.browser_kernels(tmp_path) is None
