"""The scripts of a checkout: found, loaded and run by name, from its folders studies/, figures/ and figures/films/.

The script of a study or a figure is a file NAME.py with a function `main(output: Path, ...) -> list[Path]`, which puts
its files into a folder that exists and returns them; that of a film has `film(frames: int = ...) -> Film`.
"""

import ast
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

CHECKOUT = Path(__file__).resolve().parents[1]
"""Folder of the checkout, where this package was not installed out of one."""


@dataclass(frozen=True)
class ScriptFolder:
    """A folder of scripts: what one of them is called ("study", "figure", "film"), its function and first argument."""

    word: str
    folder: Path
    function: str = "main"
    argument: str = "output"

    def names(self) -> list[str]:
        """Names of the scripts, in alphabetical order; none where there is no checkout."""
        return [path.stem for path in sorted(self.folder.glob("*.py")) if self._is_script(path)]

    def _is_script(self, path: Path) -> bool:
        """True where a file has the function; it is not run for this."""
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and node.name == self.function:
                return [argument.arg for argument in node.args.args][:1] == [self.argument]
        return False

    def docstring(self, name: str) -> str:
        """What a script says of itself; nothing where there is no such script. It is not run for this."""
        path = self.folder / f"{name}.py"
        return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "" if path.is_file() else ""

    def load(self, name: str) -> ModuleType:
        """A script as a module, imported with its neighbours in the folder within reach."""
        if str(self.folder) not in sys.path:
            sys.path.append(str(self.folder))
        spec = spec_from_file_location(name, self.folder / f"{name}.py")
        if spec is None or spec.loader is None:
            raise ImportError(f"There is no {self.word} {name} in {self.folder}.")
        module = module_from_spec(spec)
        # Under a name of its own: other packages may have a module `accuracy`.
        sys.modules[f"kerrcaustics_{self.word}_{name}"] = module
        spec.loader.exec_module(module)
        return module

    def run(self, name: str, output: Path) -> list[Path]:
        """Run a script and return the files it wrote into the folder `output`, which is made when missing."""
        output.mkdir(parents=True, exist_ok=True)
        return self.load(name).main(output)

    def run_apart(self, name: str, output: Path) -> None:
        """Run a script in a process of its own, whose threads and compiled programs no other script shares.

        Raises
        ------
        RuntimeError
            The script failed; it has said why on standard error.
        """
        arguments = [self.word, str(self.folder), name, str(output)]
        done = subprocess.run([sys.executable, "-m", "kerrcaustics.scripts", *arguments], check=False)
        if done.returncode:
            raise RuntimeError(f"The {self.word} {name} ended with status {done.returncode}.")


FIGURES = ScriptFolder("figure", CHECKOUT / "figures")
STUDIES = ScriptFolder("study", CHECKOUT / "studies")
FILMS = ScriptFolder("film", CHECKOUT / "figures" / "films", "film", "frames")

if __name__ == "__main__":
    # For `run_apart`.
    try:
        ScriptFolder(sys.argv[1], Path(sys.argv[2])).run(sys.argv[3], Path(sys.argv[4]))
    except KeyboardInterrupt:
        sys.exit(1)
    except Exception as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        sys.exit(f"kerrcaustics: {sys.argv[3]}: {type(error).__name__}: {' '.join(str(error).split())}")
