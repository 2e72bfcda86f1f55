"""Metadata hook of hatchling: the README as a package index shows it, away from the repository."""

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface


def index_page(readme: str, source: str | None, version: str) -> str:
    """Return the README with links and pictures that lead to the version's tag at the address `source`.

    Without an address, links stay as they are.
    """
    if source is None:
        return readme
    place = source.rstrip("/")
    outside = r"(?!https?:|mailto:|#)"
    readme = re.sub(rf'(src="|!\[[^\]]*\]\(){outside}', rf"\g<1>{place}/raw/v{version}/", readme)
    return re.sub(rf'(href="|\]\(){outside}', rf"\g<1>{place}/blob/v{version}/", readme)


class ReadmeHook(MetadataHookInterface):
    """The text of README.md, whose links need the address `Source` of [project.urls]."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the text to the metadata."""
        readme = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        text = index_page(readme, metadata.get("urls", {}).get("Source"), metadata["version"])
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
