"""Execution of many jobs on processes of this machine or on a cluster; workers that die are replaced."""
