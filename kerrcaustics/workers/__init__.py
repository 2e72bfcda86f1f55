"""Where many jobs are done: on processes of this machine or on a cluster, which may die, and are replaced."""
