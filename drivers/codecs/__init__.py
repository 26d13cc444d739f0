"""Which wire formats there are: every `*_frames.py` of this package that says `DECODERS`. A new one needs no entry here.

A format that cannot show every loss or every damage says so in `UNSEEN`, by its name, and one that measures not all of x, y and z which of
them it does, in `AXES`.
"""

import importlib
import inspect
from collections.abc import Callable, Iterator, Mapping
from importlib import resources
from math import isfinite
from types import ModuleType
from typing import get_args

from drivers.source import Decoder

_AXES = ("x", "y", "z")


def decoders() -> Mapping[str, Callable[..., Decoder]]:
    """Return what makes a decoder, by the name of its format."""
    found: dict[str, Callable[..., Decoder]] = {}
    for module in _modules():
        found.update(module.DECODERS)
    return found


def unseen_in(name: str) -> tuple[str, ...]:
    """Return what the format of this name cannot show, in sentences that belong beside a verdict; none where all shows."""
    return tuple(getattr(module, "UNSEEN", {})[name] for module in _modules() if name in getattr(module, "UNSEEN", {}))


def axes_in(name: str, options: Mapping[str, object]) -> tuple[str, ...]:
    """Return which of x, y and z the format of this name tells, by its options; what it does not tell is taken as 0."""
    if "pattern" in options:
        from drivers.codecs.pattern_frames import point_pattern  # noqa: PLC0415 - for those who have one

        groups = point_pattern(str(options["pattern"])).groupindex
        return tuple(axis for axis in _AXES if axis in groups)
    return next((getattr(module, "AXES", {}).get(name, _AXES) for module in _modules() if name in module.DECODERS), _AXES)


def _modules() -> Iterator[ModuleType]:
    """The modules of formats. Raises OSError where the folder cannot be read, which `pkgutil.iter_modules` takes for an empty one."""
    for name in sorted(file.name for file in resources.files(__name__).iterdir()):
        if name.endswith("_frames.py"):
            yield importlib.import_module(f"{__name__}.{name.removesuffix('.py')}")


def _require_kind(name: str, option: inspect.Parameter, given: object) -> None:
    """Raise ValueError unless an option is what its annotation says: text, a whole number, or any finite number."""
    kinds = set(get_args(option.annotation) or (option.annotation,))
    if float in kinds:
        kinds.add(int)
    fits = type(given) in kinds or (given is None and type(None) in kinds)
    if fits and not (isinstance(given, float) and not isfinite(given)):
        return
    expected = "a number" if float in kinds else "a whole number" if int in kinds else "text"
    raise ValueError(f"format {name}: {option.name} is {given!r:.80}; it takes {expected}")


def decoder(name: str, **options: object) -> Decoder:
    """Make the decoder of a format; raise `ValueError` naming what is missing, unknown or out of range."""
    known = decoders()
    if name not in known:
        raise ValueError(f"format {name!r} is none of {', '.join(sorted(known))}")
    try:
        inspect.signature(known[name]).bind(**options)
    except TypeError as error:
        expected = ", ".join(inspect.signature(known[name]).parameters) or "nothing"
        raise ValueError(f"format {name}: {error}; it takes {expected}") from None
    for option, given in options.items():
        _require_kind(name, inspect.signature(known[name]).parameters[option], given)
    return known[name](**options)
