"""Example scene files of the package."""

from pathlib import Path

_FOLDER = Path(__file__).parent / "templates"


def first_lines() -> dict[str, str]:
    """The first lines of the templates, which are comments, by their names."""
    return {name: template_text(name).partition("\n")[0].lstrip("# ") for name in template_names()}


def template_names() -> list[str]:
    """Names of all templates."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


def template_path(name: str) -> Path:
    """The file of a template."""
    return _FOLDER / f"{name}.toml"


def template_text(name: str) -> str:
    """A template as it is in its file."""
    return template_path(name).read_text(encoding="utf-8")


def film_templates() -> list[str]:
    """Names of the templates of films."""
    return [name for name in first_lines() if "\n[film]" in template_text(name)]
