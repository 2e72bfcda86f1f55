"""Results over time, frequency or baselines as tables, in CSV and FITS files that other programs read."""

import csv
import io
import os
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.extras import needed
from kerrcaustics.files import check_name, writing
from kerrcaustics.interop.physical_scale import PhysicalScale, checked_scale
from kerrcaustics.interop.plate_carree import write_units
from kerrcaustics.results.declared import Quantity, quantities
from kerrcaustics.results.shown import Shown
from kerrcaustics.results.storage import as_json
from kerrcaustics.results.units import as_in

Array = np.ndarray


class Column(NamedTuple):
    """A column of a table."""

    text: str
    """The description."""
    unit: str
    """As quantities declare it."""
    values: Array
    """(rows, dims)."""
    on_screen: bool = False
    """True for lengths on the screen of an Observer."""

    def comment(self) -> str:
        """The description, and the unit in which the values are."""
        return f"{self.text} [{self.unit}]" if self.unit not in ("", "1") else self.text


Columns = dict[str, Column]
"""Columns by name."""

# Other units, such as M and microarcseconds, have no name in FITS: they are in the comments only.
_FITS_UNITS = ("rad", "sr", "d", "min", "s", "ms")
# Names of the parts of a place on the sky, by their number.
_AXES = {2: ("alpha", "beta"), 3: ("x", "y", "z")}


class RowTable(Shown):
    """A result with quantities in rows, which is written as a table.

    A column is named as the quantity, with the number of the image or crossing from 1, and the axis, where it has them:
    `share_2`, `centroid_x`. Angles are in radians; values that are not known are NaN.
    """

    def _tables(self) -> dict[str, Columns]:
        """Columns by name of table, the main one first."""
        raise NotImplementedError

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the quantities of each row as CSV: a line of names, then a line for each row, with all digits."""
        _write_csv(path, self._tables())

    def to_fits(self, path: str | os.PathLike[str]) -> None:
        """Write tables: LIGHT or WAVES with EVENTS or IMAGES, or VISIBILITIES, a row for each baseline and order.

        Needs astropy.

        TCOMM of a column has its text and unit, TUNIT the unit of angles; the card VIEWER is the viewer as JSON.
        """
        _write_fits(path, self, self._tables())


class TimeTable(RowTable):
    """A result over time, with events.

    `scale`, a `PhysicalScale`, converts times to its `time_unit` and, if it has a distance, places on the screen of an
    Observer to microarcseconds: names then end in the unit, as `time_min` and `centroid_alpha_uas` do.
    """

    def to_csv(self, path: str | os.PathLike[str], scale: PhysicalScale | None = None) -> None:
        """Write the quantities at each time as CSV: a line of names, then a line for each time, with all digits."""
        _write_csv(path, _in_units_of(checked_scale(scale), self._tables()))

    def to_fits(self, path: str | os.PathLike[str], scale: PhysicalScale | None = None) -> None:
        """Write two tables: LIGHT, a row for each time, and EVENTS. Needs astropy.

        TCOMM of a column has its text and unit, TUNIT the unit of angles, and with a scale of times; the card VIEWER is
        the viewer as JSON.
        """
        _write_fits(path, self, _in_units_of(checked_scale(scale), self._tables()))

    def _tables(self) -> dict[str, Columns]:
        result: Any = self
        return {"LIGHT": _columns(self, "time", len(result.time)), "EVENTS": _event_columns(result.events)}


class FrequencyTable(RowTable):
    """A result over frequencies, with the images that make it."""

    def _tables(self) -> dict[str, Columns]:
        return {"WAVES": _columns(self, "wave"), "IMAGES": _columns(self, "image")}


def _write_csv(path: str | os.PathLike[str], tables: dict[str, Columns]) -> None:
    """The main table as text."""
    check_name(path)
    columns = next(iter(tables.values()))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    table.writerows(zip(*(column.values.tolist() for column in columns.values()), strict=True))
    with writing(path) as file:
        file.write(text.getvalue().encode())


def _write_fits(path: str | os.PathLike[str], result: Any, tables: dict[str, Columns]) -> None:
    """All tables of a result, after an empty unit."""
    fits = needed("astro", "astropy.io.fits")
    units = [_table(fits, name, columns) for name, columns in tables.items()]
    units[0].header["VIEWER"] = as_json(result.camera)
    units[0].header["CERTIF"] = result.certified
    write_units(path, [fits.PrimaryHDU(), *units])


def _in_units_of(scale: PhysicalScale | None, tables: dict[str, Columns]) -> dict[str, Columns]:
    """Tables with times, and places on a screen if the scale has a distance, in physical units, which names end in."""
    if scale is None:
        return tables

    def converted(name: str, column: Column) -> tuple[str, Column]:
        if column.unit == "GM/c^3":
            unit, each = scale.time_unit
        elif column.on_screen and scale.distance is not None:
            unit, each = "uas", scale.microarcseconds
        else:
            return name, column
        return f"{name}_{unit}", column._replace(unit=unit, values=column.values * each)

    return {table: dict(converted(*item) for item in columns.items()) for table, columns in tables.items()}


class BaselineTable(RowTable):
    """A result over baselines, with a row for each baseline and order."""

    def _tables(self) -> dict[str, Columns]:
        result: Any = self
        about, orders, count = quantities(type(self)), len(result.order), len(result.u)
        rows = {name: np.tile(getattr(result, name), orders) for name in ("u", "v")}
        rows["order"] = np.repeat(result.order, count)
        rows |= {name: getattr(result, name).ravel() for name in ("real", "imaginary", "error")}
        return {"VISIBILITIES": {name: _column(result, about[name], values) for name, values in rows.items()}}


def _columns(result: Any, rows: str, count: int | None = None) -> Columns:
    """The columns of a result; with a count those of images alone too, the same in all rows."""
    columns: Columns = {}
    for name, about in quantities(type(result)).items():
        values = np.asarray(getattr(result, name))
        if rows in about.dims:
            values = np.moveaxis(values, about.dims.index(rows), 0)
        elif count is not None and about.dims == ("image",):
            values = np.broadcast_to(values, (count, *values.shape))
        else:
            continue
        column = _column(result, about, values)
        columns |= _flat(name, tuple(dim for dim in about.dims if dim != rows), column)
    return columns


def _event_columns(events: Any) -> Columns:
    """The columns of all numbers and words of events; empty without events."""
    columns: Columns = {}
    for name, about in quantities(type(events[0])).items() if events else ():
        values = np.array([getattr(event, name) for event in events])
        if values.dtype.kind != "O":
            columns |= _flat(name, about.dims, _column(events[0], about, values))
    return columns


def _flat(name: str, dims: tuple[str, ...], column: Column) -> Columns:
    """The columns of values (rows, dims): the axes of a place are named, images and crossings are counted."""
    sizes = list(zip(dims, column.values.shape[1:], strict=True))
    labels = [_AXES[size] if dim == "axis" else [str(i + 1) for i in range(size)] for dim, size in sizes]
    base = name.removesuffix("s") if dims and dims[0] != "axis" else name
    places = product(*(range(size) for _, size in sizes))
    return {
        "_".join([base, *(label[i] for label, i in zip(labels, place, strict=True))]): column._replace(
            values=column.values[:, *place]
        )
        for place in places
    }


def _column(result: Any, about: Quantity, values: Array) -> Column:
    """Values with the declaration of their quantity."""
    on_sky = about.unit == "sky" or "axis" in about.dims
    return Column(about.text, as_in(result, about).unit, values, on_sky and result.camera.sky_unit != "rad")


def _table(fits: Any, table_name: str, columns: Columns) -> Any:
    """A FITS table, with the texts of its columns as comments."""
    kinds = {"f": "D", "i": "K", "b": "L"}
    cells = [
        fits.Column(
            name,
            kinds.get(column.values.dtype.kind) or f"{column.values.dtype.itemsize // 4}A",
            unit=column.unit if column.unit in _FITS_UNITS else None,
            array=column.values,
        )
        for name, column in columns.items()
    ]
    table = fits.BinTableHDU.from_columns(cells, name=table_name)
    for k, column in enumerate(columns.values(), start=1):
        table.header[f"TCOMM{k}"] = column.comment()
    return table
