"""Simulated devices that speak the wire protocols, each a program of its own.

This is the front door: which devices there are, what they are told, and the scan that they will send. They share no line
with `drivers`, so that a mistake in one is not hidden by the same mistake in the other.
"""

from simulators.devices import known_devices
from simulators.faults import CATALOGUE, Fault, Injector
from simulators.motion import Motion, Walk, read_path, walk
from simulators.settings import SimulatorSettings, end_with_stdin, say, settings_from

__all__ = [
    "CATALOGUE",
    "Fault",
    "Injector",
    "Motion",
    "SimulatorSettings",
    "Walk",
    "end_with_stdin",
    "known_devices",
    "read_path",
    "say",
    "settings_from",
    "walk",
]
