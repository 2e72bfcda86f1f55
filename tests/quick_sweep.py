"""The command line with numbers that cost nothing, for tests that kill it; its workers load this file as they start."""

import os

from sweeping import slowly_made_up

from kerrcaustics.__main__ import main
from kerrcaustics.sweeps import run as engine
from kerrcaustics.workers import worker_failures

engine.computed = slowly_made_up
worker_failures.MOST_DEATHS_WITH_A_JOB = int(os.environ.get("DEATHS", worker_failures.MOST_DEATHS_WITH_A_JOB))

if __name__ == "__main__":
    main()
