"""Which processes run, and on which machine."""

import os
import platform

SAME_START = 2.0
"""Tolerance [s] of a process's start time, since the clock may be set."""


def this_host() -> str:
    """Return the name of the machine or container in which process ids are valid."""
    try:
        return f"{platform.node()} {os.readlink('/proc/self/ns/pid')}"
    except OSError:
        return platform.node()


def lives(pid: int, start: float | None = None) -> bool:
    """Return whether a process runs."""
    import psutil  # here: hardly ever is there something to ask

    try:
        process = psutil.Process(pid)
        if start is not None and abs(process.create_time() - start) >= SAME_START:
            return False
        return process.status() != psutil.STATUS_ZOMBIE
    except (OverflowError, ValueError, psutil.NoSuchProcess):
        return False
    except psutil.AccessDenied:
        return True
