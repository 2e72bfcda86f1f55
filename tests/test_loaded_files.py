"""Files that are not what `save` wrote, be it by damage or by intent: one ValueError, and soon."""

import io
import json
import os
import random
import tracemalloc
import zipfile
from dataclasses import fields, replace
from types import UnionType
from typing import get_args, get_origin, get_type_hints

import numpy as np
import pytest
from made_results import CAMERA, GIVEN, KINDS, example

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet, Cusp
from kerrcaustics.films.film import FilmResult
from kerrcaustics.results.declared import stored

NOT_OURS = "Argument `path` must name a file that `kerrcaustics.save` wrote, but "
TIMES = {"seconds", "stages"}


def members(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def head_of(path):
    return json.loads(str(np.load(io.BytesIO(members(path)["head.npy"]))))


def rewritten(path, head=None, **others):
    """The file with another header, text or not, and with other arrays."""
    parts = members(path)
    text = head if isinstance(head, str) else json.dumps(head)
    for name, array in {**({} if head is None else {"head": np.array(text)}), **others}.items():
        content = io.BytesIO()
        np.save(content, array, allow_pickle=True)
        parts[f"{name}.npy"] = content.getvalue()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)


def refused(path):
    with pytest.raises(ValueError, match=NOT_OURS) as error:
        kc.load(path)
    assert "\n" not in str(error.value)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "result.npz"


@pytest.mark.parametrize(
    "tree",
    [
        42,
        None,
        "hello",
        [],
        {"path": "/etc/passwd"},
        {"tuple": [1]},
        {"dict": []},
        {"list": [{"list": []}]},
        {"array": "array_0", "shape": [3], "dtype": "<f8"},
        {"kind": "Path", "fields": {}},
        {"kind": "Camera"},
        {"kind": "Camera", "fields": {}},
    ],
)
def test_only_results_are_loaded(tree, path):
    kc.save(path, CAMERA)
    rewritten(path, {"schema": "kerrcaustics/result/1", "result": tree}, array_0=np.zeros(3))
    refused(path)


@pytest.mark.parametrize(
    "wrong",
    [
        {"spin": "hello"},
        {"spin": 1.5},
        {"spin": -0.0001},
        {"spin": True},
        {"spin": None},
        {"spin": float("nan")},
        {"radius": 0.5},
        {"radius": float("inf")},
        {"inclination": 4.0},
        {"velocity": "warp"},
        {"velocity": {"tuple": [0.9, 0.9, 0.9]}},
        {"velocity": {"list": [0.1, -0.2, 0.3]}},
        {"velocity": None},
        {"colour": 1},
    ],
)
def test_a_camera_that_cannot_be_is_refused(wrong, path):
    """Also where it is deep in a result."""
    for made, way in ((CAMERA, []), (example(CausticSet, 1), ["camera", "fields"])):
        kc.save(path, made)
        head = head_of(path)
        part = head["result"]["fields"]
        for step in way:
            part = part[step]
        part.update(wrong)
        rewritten(path, head)
        refused(path)


OTHERS = (7, "hello", None, True, 0.5, np.zeros(2), np.zeros((2, 2, 2, 2, 2)), (), {}, CAMERA)


def with_another(path, made, name, other):
    """Write the file of a result in which one field is something else."""
    kc.save(path, CAMERA)
    tree = {CAMERA: head_of(path)["result"], (): {"tuple": []}}
    kc.save(path, made)
    head, array = head_of(path), isinstance(other, np.ndarray)
    if array:
        part = {"array": "other", "shape": list(other.shape), "dtype": other.dtype.str}
    else:
        part = {"dict": []} if other == {} else tree.get(other, other)
    head["result"]["fields"][name] = part
    rewritten(path, head, **({"other": other} if array else {}))


def check_types(kind, path):
    """A loaded value is of a type that the field declares."""
    made, refusals = example(kind, 2), 0
    for name, hint in get_type_hints(kind).items():
        if name not in stored(kind) or name.startswith("_"):
            continue
        parts = get_args(hint) if isinstance(hint, UnionType) else (hint,)
        declared = {get_origin(part) or part for part in parts}
        for other in OTHERS:
            with_another(path, made, name, other)
            try:
                loaded = type(getattr(kc.load(path), name))
            except ValueError:
                refusals += 1
                continue
            fits = any(issubclass(loaded, one) for one in declared if isinstance(one, type))
            assert fits or (loaded is int and float in declared), (name, loaded)
    assert refusals > 5


@pytest.mark.parametrize("kind", [kc.Caustic])
def test_a_field_of_another_type_is_refused(kind, path):
    check_types(kind, path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in GIVEN], ids=lambda kind: kind.__name__)
def test_a_field_of_another_type_is_refused_in_every_result(kind, path):
    check_types(kind, path)


def test_lengths_of_arrays_belong_together(path):
    made = example(kc.StarImages, 3)
    with_another(path, made, "error", np.zeros(3))
    assert kc.load(path) == replace(made, error=np.zeros(3))
    with_another(path, made, "error", np.zeros(4))
    refused(path)


@pytest.mark.parametrize(
    ("name", "wrong", "reported"), [("error", np.zeros(4), "another length"), ("certified", "yes", "another type")]
)
def test_what_would_not_load_is_not_saved(name, wrong, reported, path):
    with pytest.raises(ValueError, match=rf"must hold what it declares, but StarImages\.{name} .*{reported}\."):
        kc.save(path, replace(example(kc.StarImages, 3), **{name: wrong}))
    assert not path.exists()


@pytest.mark.parametrize("change", [{"shape": [2, 3]}, {"shape": [3, 4]}, {"dtype": "<f4"}, {"dtype": "O"}])
def test_an_array_that_is_not_what_the_header_says_is_refused(change, path):
    kc.save(path, example(Cusp, 1))
    head = head_of(path)
    head["result"]["fields"]["sky"].update(change)
    rewritten(path, head)
    refused(path)


def test_an_array_of_objects_is_refused(path):
    kc.save(path, example(Cusp, 1))
    rewritten(path, array_0=np.array([os.getpid, None, 1], object))
    refused(path)


def largest_memory(work):
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_what_the_header_does_not_name_is_not_read(path):
    kc.save(path, CAMERA)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb.npy", bytes(50_000_000))
    assert path.stat().st_size < 100_000
    assert largest_memory(lambda: kc.load(path)) < 5_000_000
    assert kc.load(path) == CAMERA


def huge(shape, kind="<f8"):
    """The header of an array, however large."""
    content = io.BytesIO()
    np.lib.format.write_array_header_1_0(content, {"descr": kind, "fortran_order": False, "shape": shape})
    return content.getvalue()


@pytest.mark.parametrize("says", [(10**12, 3), (6_000_000, 3)])
@pytest.mark.parametrize("reported", [True, False], ids=["in the header", "not in the header"])
def test_an_array_is_unpacked_only_where_it_is_what_it_says(says, reported, path):
    """The header of the file, the array's own preamble, and the member's length: each may claim much."""
    kc.save(path, example(Cusp, 1))
    head = head_of(path)
    head["result"]["fields"]["sky"].update({"shape": list(says)} if reported else {})
    rewritten(path, head)
    parts = members(path)
    for content in (huge(says), huge((3,)) + bytes(20_000_000), huge(says) + bytes(20_000_000)):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, part in {**parts, "array_0.npy": content}.items():
                archive.writestr(name, part)
        assert largest_memory(lambda: refused(path)) < 5_000_000


def test_a_header_that_is_too_long_is_not_unpacked(path):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("head.npy", huge((), "<U20000000") + bytes(80_000_000))
    assert largest_memory(lambda: refused(path)) < 5_000_000


def test_deep_headers_are_refused(path):
    kc.save(path, CAMERA)
    deep = '{"schema": "kerrcaustics/result/1", "result": ' + '{"tuple": [' * 50_000 + "]}" * 50_000 + "}"
    rewritten(path, deep)
    refused(path)


def test_a_flipped_bit_is_refused_or_changes_nothing(path):
    made, chance = example(kc.StarImages, 5), random.Random(4)
    kc.save(path, made)
    good = path.read_bytes()
    for _ in range(60):
        content = bytearray(good)
        place = chance.randrange(8 * len(good))
        content[place // 8] ^= 1 << place % 8
        path.write_bytes(content)
        try:
            assert kc.load(path) == made
        except ValueError as error:
            assert NOT_OURS in str(error)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if {f.name for f in fields(kind)} & TIMES])
def test_results_that_took_another_time_are_equal(kind):
    made = example(kind, 2)
    slower = {name: {"frames": 9.0} if name == "stages" else 99.0 for name in TIMES & {f.name for f in fields(kind)}}
    assert replace(made, **slower) == made
    assert FilmResult is not kind or replace(made, drawn=77) != made


def test_caustics_of_two_calls_are_equal():
    assert kc.caustics(CAMERA, 1) == kc.caustics(CAMERA, 1)
