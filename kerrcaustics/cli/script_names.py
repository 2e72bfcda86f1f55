"""Names of the scripts of figures, films and studies."""

from typing import TYPE_CHECKING

from kerrcaustics.cli.endings import BadInput

if TYPE_CHECKING:
    from kerrcaustics.scripts import ScriptFolder


def script_names(scripts: "ScriptFolder", what: str) -> list[str]:
    """Names of the scripts in a folder, of which there must be one."""
    names = scripts.names()
    if not names:
        raise BadInput(f"{what} need an installed wheel or a checkout: there is no folder {scripts.folder}.")
    return names
