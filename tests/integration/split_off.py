"""Processes that are split off from one that has loaded everything, where the system can; elsewhere each of them loads it anew."""

import multiprocessing
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from pkgutil import iter_modules

from simulators import devices


def split_off(work: Callable[..., None], *arguments: object) -> BaseProcess:
    """Do the work in a process of its own, which may be killed."""
    process: BaseProcess
    if "forkserver" in multiprocessing.get_all_start_methods():
        forking = multiprocessing.get_context("forkserver")
        simulated = (f"{devices.__name__}.{found.name}" for found in iter_modules(devices.__path__))
        forking.set_forkserver_preload(["tests.integration.simulated", "tests.integration.killed", *simulated])  # before the first only
        process = forking.Process(target=work, args=arguments)
    else:
        process = multiprocessing.get_context("spawn").Process(target=work, args=arguments)
    process.start()
    return process
