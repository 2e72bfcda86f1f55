"""Build hook of hatchling: compiles the kernels of this processor into a checkout, those of a platform into a wheel."""

import os
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_BUILD = "kerrcaustics.beams.kernels.build"
_OBJECTS = "kerrcaustics/beams/kernels/objects"


class KernelHook(BuildHookInterface[BuilderConfig]):
    """Kernels for an editable install or a wheel; KERRCAUSTICS_PLATFORM names another platform for the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the kernels before the wheel is written."""
        if version == "editable":
            self._python("-m", _BUILD)
        else:
            self._add_all_levels(os.environ.get("KERRCAUSTICS_PLATFORM") or None, build_data)

    def _add_all_levels(self, platform: str | None, build_data: dict[str, Any]) -> None:
        """Add the kernels of a platform to the wheel, and the platform to its name."""
        # Outside the checkout, whose own kernels stay as they are. Python removes the folder at its end.
        self._folder = TemporaryDirectory(prefix="kerrcaustics-kernels-")
        chosen = ["--platform", platform] if platform else []
        self._python("-m", _BUILD, "--all-levels", *chosen, "--into", self._folder.name)
        tag = self._python("-c", f"from {_BUILD} import wheel_platform; print(wheel_platform({platform!r}))").strip()
        build_data["force_include"][self._folder.name] = _OBJECTS
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{tag}"

    def _python(self, *arguments: str) -> str:
        """Standard output of a Python process that imports the package from these sources."""
        path = os.pathsep.join(filter(None, [self.root, os.environ.get("PYTHONPATH")]))
        process = subprocess.run(
            [sys.executable, *arguments],
            cwd=self.root,
            env={**os.environ, "PYTHONPATH": path},
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        if process.returncode:
            raise SystemExit(f"{process.stdout}The kernels could not be compiled.")
        return process.stdout
