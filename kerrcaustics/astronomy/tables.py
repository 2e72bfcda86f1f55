"""Results over time as tables: one row for each time, in CSV and FITS files that other programs read."""

import csv
import io
import os
from itertools import product
from typing import Any

import numpy as np

from kerrcaustics.astronomy.plate_carree import write_units
from kerrcaustics.extras import needed
from kerrcaustics.files import check_name, writing
from kerrcaustics.results.declared import Quantity, Shown, quantities
from kerrcaustics.results.storage import as_json
from kerrcaustics.results.units import as_in

Array = np.ndarray

# Names of the parts of a place on the sky, by their number.
_AXES = {2: ("alpha", "beta"), 3: ("x", "y", "z")}


class TimeTable(Shown):
    """A result with quantities over time, which is written as a table.

    A column is named as the quantity, with the number of the image or crossing from 1, and the axis, where it has them:
    `share_2`, `centroid_x`. Angles are in radians; values that are not known are NaN.
    """

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all quantities over time as CSV: a line of names, then a line for each time, with all digits."""
        check_name(path)
        columns = _columns(self)
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(columns)
        table.writerows(zip(*(values.tolist() for _, values in columns.values()), strict=True))
        with writing(path) as file:
            file.write(text.getvalue().encode())

    def to_fits(self, path: str | os.PathLike[str]) -> None:
        """Write tables LIGHT, of all quantities over time, and EVENTS, a row for each. Needs the package astropy.

        Comments on the columns (TCOMM) have their units and texts; the card VIEWER is the viewer as JSON.
        """
        fits = needed("astro", "astropy.io.fits")
        light = _table(fits, "LIGHT", _columns(self))
        viewer: Any = self
        light.header["VIEWER"] = as_json(viewer.camera)
        light.header["CERTIF"] = viewer.certified
        write_units(path, [fits.PrimaryHDU(), light, _table(fits, "EVENTS", _event_columns(viewer.events))])


def _columns(result: Any) -> dict[str, tuple[str, Array]]:
    """Text and values (time,) of each column: those of images alone are the same at all times."""
    columns, count = {}, len(result.time)
    for name, about in quantities(type(result)).items():
        values = np.asarray(getattr(result, name))
        if "time" in about.dims:
            values = np.moveaxis(values, about.dims.index("time"), 0)
        elif about.dims == ("image",):
            values = np.broadcast_to(values, (count, *values.shape))
        else:
            continue
        columns |= _flat(name, tuple(dim for dim in about.dims if dim != "time"), _text(result, about), values)
    return columns


def _event_columns(events: Any) -> dict[str, tuple[str, Array]]:
    """Text and values (event,) of all numbers and words of events; empty without events."""
    columns: dict[str, tuple[str, Array]] = {}
    for name, about in quantities(type(events[0])).items() if events else ():
        values = np.array([getattr(event, name) for event in events])
        if values.dtype.kind != "O":
            columns |= _flat(name, about.dims, _text(events[0], about), values)
    return columns


def _flat(name: str, dims: tuple[str, ...], text: str, values: Array) -> dict[str, tuple[str, Array]]:
    """The columns of values (rows, dims): the axes of a place are named, images and crossings are counted."""
    sizes = list(zip(dims, values.shape[1:], strict=True))
    labels = [_AXES[size] if dim == "axis" else [str(i + 1) for i in range(size)] for dim, size in sizes]
    base = name.removesuffix("s") if dims and dims[0] != "axis" else name
    places = product(*(range(size) for _, size in sizes))
    return {
        "_".join([base, *(label[i] for label, i in zip(labels, place, strict=True))]): (text, values[:, *place])
        for place in places
    }


def _text(result: Any, about: Quantity) -> str:
    """The declaration of a quantity in one line."""
    unit = as_in(result, about).unit
    return f"{about.text} [{unit}]" if unit not in ("", "1") else about.text


def _table(fits: Any, name: str, columns: dict[str, tuple[str, Array]]) -> Any:
    """A FITS table, with the texts of its columns as comments."""
    kinds = {"f": "D", "i": "K", "b": "L"}
    cells = [
        fits.Column(column, kinds.get(values.dtype.kind) or f"{values.dtype.itemsize // 4}A", array=values)
        for column, (_, values) in columns.items()
    ]
    unit = fits.BinTableHDU.from_columns(cells, name=name)
    for k, (text, _) in enumerate(columns.values(), start=1):
        unit.header[f"TCOMM{k}"] = text
    return unit
