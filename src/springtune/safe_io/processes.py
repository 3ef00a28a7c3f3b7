"""Which processes live, and where."""

import os
import platform

SAME_START = 2.0
"""Seconds by which two readings of a process's start may differ, since the clock may be set."""


def this_host() -> str:
    """Name of the machine, or the container, in which a process's number says something."""
    try:
        return f"{platform.node()} {os.readlink('/proc/self/ns/pid')}"
    except OSError:
        return platform.node()


def lives(pid: int, start: float | None = None) -> bool:
    """Whether a process lives."""
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
