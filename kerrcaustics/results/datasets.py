"""Results as xarray Datasets: units and texts as declared, numbers of several curves or images padded to one array."""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from kerrcaustics.results.declared import LAYOUTS, Quantity, element, quantities
from kerrcaustics.results.records import check_result
from kerrcaustics.results.units import as_in

if TYPE_CHECKING:
    import xarray

# Dimensions whose places have names; the value of empty places, by kind of number.
_NAMED = {
    "axis": ["x", "y", "z"],
    "local_axis": ["e_r", "e_theta", "e_phi"],
    "angle": ["theta", "phi"],
    "pair": ["outer", "inner"],
    "channel": ["red", "green", "blue"],
}
# Those of places on the sky of an observer.
_ON_SCREEN = ["alpha", "beta"]
_FILL = {"i": -1, "b": False, "U": ""}


def to_xarray(result: Any) -> "xarray.Dataset":
    """The numbers of a result as an xarray Dataset; angles in radians.

    A quantity with dimensions is a variable, with its unit and its text in the attributes `units` and `long_name`; all
    others are attributes of the Dataset. Curves and images of fewer points than the others are padded: with NaN, -1 in
    whole numbers, False, or an empty string. None is left out.

    Parameters
    ----------
    result
        A result of any function of this package.

    Raises
    ------
    ValueError
        If `result` is not a result.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> data = kc.to_xarray(kc.star_images(camera, star=(1.4, 2.9), max_index=0))
    >>> data.magnification.attrs["units"], data.sizes["image"]
    ('1', 1)
    """
    import xarray

    check_result(result)
    data, attributes = {}, {}
    for name, about, values in _columns(type(result), result, (), ""):
        if about.dims:
            data[name or about.name] = _variable(about, values)
        elif isinstance(values, dict):
            attributes |= {f"{name.removesuffix('s')}_{key}": value for key, value in values.items()}
        elif values is not None:
            attributes[name] = _attribute(values)
    # Of arrays without entries it is not known how many axes a place has.
    known = sorted(data.values(), key=lambda column: column[1].size)
    sizes = {dim: size for dims, array, _ in known for dim, size in zip(dims, array.shape, strict=True)}
    data = {name: (dims, _sized(array, dims, sizes), about) for name, (dims, array, about) in data.items()}
    named = _NAMED | ({"axis": _ON_SCREEN} if sizes.get("axis") == len(_ON_SCREEN) else {})
    if surface := getattr(result, "surface", None):
        named["angle"] = [coordinate.name for coordinate in surface.coordinates]
    coordinates = {dim: names for dim, names in named.items() if sizes.get(dim) == len(names)}
    return xarray.Dataset(data, coords=coordinates, attrs=attributes)


def _sized(array: np.ndarray, dims: tuple[str, ...], sizes: dict[str, int]) -> np.ndarray:
    """An array without entries in the shape that goes with others."""
    return array if array.size else np.empty([sizes[dim] for dim in dims], array.dtype)


def _columns(kind: type, results: Any, dims: tuple[str, ...], prefix: str) -> Iterator[tuple[str, Quantity, Any]]:
    """The quantities of one result, or of many in lists as deep as there are dimensions: name, declaration, values."""
    for name, about in quantities(kind).items():
        values = _each(results, len(dims), name)
        inner, several = element(kind, name)
        own = name.removesuffix("s") if inner else name
        column = "_".join(filter(None, (prefix, own if about.column is None else about.column)))
        if several:
            # Of a base class, what its first member declares.
            one = _first(values, len(dims + about.dims))
            yield from _columns(inner if one is None else type(one), values, dims + about.dims, column)
        elif inner and dims and inner not in LAYOUTS:
            # The viewer and the surface are those of the outer result.
            continue
        elif inner:
            for part, each, numbers in _columns(inner if dims else type(values), values, dims, column):
                yield part, replace(each, dims=about.dims or each.dims) if each.dims else each, numbers
        elif values is not None:
            one = _first(results, len(dims))
            resolved = about if one is None else as_in(one, about)
            yield column, replace(resolved, dims=dims + about.dims), values


def _first(results: Any, depth: int) -> Any:
    """The first result in lists of this depth; None if there is none."""
    if depth == 0:
        return results
    return next((first for part in results if (first := _first(part, depth - 1)) is not None), None)


def _each(results: Any, depth: int, name: str) -> Any:
    return getattr(results, name) if depth == 0 else [_each(part, depth - 1, name) for part in results]


def _variable(about: Quantity, values: Any) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
    array = np.asarray(values) if isinstance(values, np.ndarray | np.generic) else _padded(values, about.dims)
    dims = tuple(name for dim in about.dims for name in _spread(dim, array.ndim - len(about.dims) + 1))
    return dims, array, {"units": about.unit, "long_name": about.text} if about.unit else {"long_name": about.text}


def _spread(dim: str, count: int) -> list[str]:
    """The names of a dimension that may stand for several."""
    if not dim.endswith("..."):
        return [dim]
    name = dim.removesuffix("...")
    return [name] if count == 1 else [f"{name}_{i}" for i in range(count)]


def _padded(values: Any, dims: tuple[str, ...]) -> np.ndarray:
    """Nested lists of numbers, or of arrays, as one array."""
    leaves = list(_leaves(values, len(dims), ()))
    ends = [[0] * len(dims), *([*(i + 1 for i in place), *leaf.shape] for place, leaf in leaves)]
    sizes = [len(values), *np.max(ends, axis=0)[1:]]
    shape = [size or len(_NAMED.get(dim, ())) for dim, size in zip(dims, sizes, strict=True)]
    kinds = [leaf.dtype for _, leaf in leaves if leaf.size]
    dtype = np.result_type(*kinds) if kinds else np.dtype(float)
    array = np.full(shape, _FILL.get(dtype.kind, np.nan), dtype)
    for place, leaf in leaves:
        array[(*place, *map(slice, leaf.shape))] = leaf
    return array


def _leaves(values: Any, depth: int, place: tuple[int, ...]) -> Iterator[tuple[tuple[int, ...], np.ndarray]]:
    """The rows and arrays in nested lists, each after its place."""
    if depth == 1 or isinstance(values, np.ndarray):
        yield place, np.asarray(_row(values))
        return
    for i, part in enumerate(values):
        yield from _leaves(part, depth - 1, (*place, i))


def _row(values: Any) -> Any:
    """Numbers or words in one row: those of a dict, and remarks joined to one."""
    if isinstance(values, dict):
        return list(values.values())
    if isinstance(values, list):
        return ["; ".join(map(str, value)) if isinstance(value, tuple) else value for value in values]
    return values


def _attribute(value: Any) -> Any:
    """A value as an attribute that a netCDF file can hold too."""
    if isinstance(value, tuple) and all(isinstance(part, str) for part in value):
        return "; ".join(value)
    return value if isinstance(value, str | float | tuple) else int(value) if isinstance(value, int) else str(value)
