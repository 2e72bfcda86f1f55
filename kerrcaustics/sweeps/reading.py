"""Scene files of either kind: those of pictures and films, and those of sweeps."""

from pathlib import Path
from typing import Any

from kerrcaustics.scene_files.scene_file import SceneFile
from kerrcaustics.toml_files import read_toml

# Only the file of a sweep has these outside of all tables.
_SWEPT = {"spin", "radius"}


def read_scene(path: str | Path) -> Any:
    r"""The scene in a TOML file; a ValueError of one line names file, key and what it must be.

    Parameters
    ----------
    path : str or path

    Returns
    -------
    SceneFile
        The scene of `kerrcaustics render` and `kerrcaustics film`. For the file of a sweep, which has `spin` and
        `radius` outside of all tables, the `Scene` that `sweep` takes.

    Raises
    ------
    ValueError
        If the file cannot be read or an entry is invalid; the message names the key.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> text = 'hole = {spin = 0.9}\ncamera = {radius = 10}\nsky = {kind = "checkerboard"}'
    >>> _ = open("scene.toml", "w").write(text)
    >>> kc.read_scene("scene.toml").frames
    1
    """
    if _SWEPT & set(read_toml(path)):
        from kerrcaustics.sweeps.scene import read_scene as read_sweep

        return read_sweep(path)
    return SceneFile.read(path)
