"""Figures, films and studies, located by their place in a checkout or beside the modules of an installed package.

A study is a folder studies/NAME/ with a main.py, a figure a file figures/NAME.py; both have a function
`main(output: Path, ...) -> list[Path]`, which puts its files into a folder that exists and returns them. A study also
has QUICK, arguments of `main` for fewer cases. A film is a file figures/films/NAME.py with
`film(frames: int = ...) -> Film`. Names that begin with an underscore are none of them.
"""

import os
import re
import subprocess
import sys
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from kerrcaustics.choices import suggestion

if TYPE_CHECKING:
    from kerrcaustics.films.film import Film


QUICK_RUN = ContextVar("QUICK_RUN", default=False)
"""True while a study runs on fewer cases; its record says so."""


def scripts_home(package: Path) -> Path:
    """The folder of figures/ and studies/ for a package that lies in a folder: its checkout, or its own copy."""
    checkout = package.parent
    # The folder that holds installed packages has no such file.
    return checkout if (checkout / "pyproject.toml").is_file() else package / "_scripts"


HOME = scripts_home(Path(__file__).resolve().parent)
"""Folder of the checkout, or of the scripts in a wheel."""


@dataclass(frozen=True)
class ScriptFolder:
    """A folder of scripts: the word for a script ("study", "figure", "film"), and its place in the folder."""

    word: str
    folder: Path
    place: str = "{}.py"

    def names(self) -> list[str]:
        """Names of the scripts, in alphabetical order; none if there is no such folder."""
        paths = self.folder.glob(self.place.format("[!_]*"))
        return sorted(path.relative_to(self.folder).parts[0].removesuffix(".py") for path in paths)

    def load(self, name: str) -> ModuleType:
        """A script as a module."""
        if name not in self.names():
            raise ImportError(f"There is no {self.word} {name} in {self.folder}{suggestion(name, self.names())}")
        return self.module(self.place.format(name).removesuffix(".py").replace("/", "."))

    def module(self, name: str) -> ModuleType:
        """A module of the folder by its dotted name, which imports its neighbours by relative imports."""
        return import_module(f"{self.package()}.{name}")

    def package(self) -> str:
        """The package of the scripts, under a unique name: other packages may be called `studies`."""
        name = "kerrcaustics_scripts" + re.sub(r"\W", "_", str(self.folder))
        if name not in sys.modules:
            sys.modules[name] = ModuleType(name)
            sys.modules[name].__path__ = [str(self.folder)]
        return name

    def run(self, name: str, output: Path, quick: bool = False) -> list[Path]:
        """Run a script and return the files it wrote into the folder `output`, which is made when missing.

        quick: run a study with the arguments in its QUICK.
        """
        output.mkdir(parents=True, exist_ok=True)
        script = self.load(name)
        before = QUICK_RUN.set(quick)
        try:
            return script.main(output, **(script.QUICK if quick else {}))
        finally:
            QUICK_RUN.reset(before)

    def run_apart(self, name: str, output: Path, quick: bool = False) -> None:
        """Run a script in a process of its own, whose threads and memory no other script shares.

        quick: as for `run`.

        Raises
        ------
        RuntimeError
            If the script failed; its error is on standard error.
        """
        arguments = [self.word, str(self.folder), self.place, name, str(output), *["quick"] * quick]
        process = subprocess.run([sys.executable, "-m", "kerrcaustics.scripts", *arguments], check=False)
        if process.returncode:
            raise RuntimeError(f"The {self.word} {name} ended with status {process.returncode}.")


@dataclass(frozen=True)
class ScriptFrames:
    """The frames of a film's script, for other processes: they load it themselves."""

    scripts: ScriptFolder
    name: str
    count: int | None = None

    def __call__(self, number: int) -> Any:
        """The picture (height, width, 3) of a frame."""
        return script_film(self.scripts, self.name, self.count).draw(number)


@lru_cache(maxsize=1)
def script_film(scripts: ScriptFolder, name: str, count: int | None = None) -> "Film":
    """The film of a script, of `count` frames, or of its own number."""
    script = scripts.load(name)
    return script.film() if count is None else script.film(count)


def figures_folder(figures: ScriptFolder) -> Path:
    """The folder of figures: beside the scripts of a checkout, or here, as nothing is written into a package."""
    return Path("kerrcaustics-figures") if figures.folder.parent.name == "_scripts" else figures.folder / "out"


FIGURES = ScriptFolder("figure", HOME / "figures")
STUDIES = ScriptFolder("study", HOME / "studies", "{}/main.py")
FILMS = ScriptFolder("film", HOME / "figures" / "films")


def run_one(word: str, folder: str, place: str, name: str, output: str, *quick: str) -> None:
    """Run a script for `run_apart`; a failure is one line."""
    try:
        ScriptFolder(word, Path(folder), place).run(name, Path(output), bool(quick))
    except KeyboardInterrupt:
        sys.exit(1)
    except Exception as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        sys.exit(f"kerrcaustics: {name}: {type(error).__name__}: {' '.join(str(error).split())}")


if __name__ == "__main__":
    # Of the module that studies import, whose QUICK_RUN is another one.
    import_module("kerrcaustics.scripts").run_one(*sys.argv[1:])
