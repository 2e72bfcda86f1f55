"""How a sweep ends that has lost its workers."""

from kerrcaustics.workers.losses import WorkersLost as WorkersLost
