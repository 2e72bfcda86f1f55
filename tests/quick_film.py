"""The command line with a scene that costs nothing, for tests that kill it; its workers load this file too."""

import os
import sys
from types import SimpleNamespace

from filming import read_bar

from kerrcaustics.__main__ import main
from kerrcaustics.workers import worker_failures

sys.modules["kerrcaustics.sweeps.reading"] = SimpleNamespace(read_scene=read_bar)
sys.modules.setdefault("kerrcaustics.scene_files", SimpleNamespace())
worker_failures.MOST_DEATHS_WITH_A_JOB = int(os.environ.get("DEATHS", worker_failures.MOST_DEATHS_WITH_A_JOB))

if __name__ == "__main__":
    main()
