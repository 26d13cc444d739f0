"""`python -m simulators DEVICE --address ... --path ...`: one simulated device as a process of its own."""

import sys

from simulators.devices import known_devices
from simulators.settings import say, settings_from


def main(arguments: list[str]) -> None:
    """Serve the device named first."""
    known = known_devices()
    if not arguments or arguments[0] not in known:
        raise SystemExit(f"name a device: {', '.join(sorted(known))}")
    try:
        known[arguments[0]](settings_from(arguments[1:]), say)
    except (ValueError, OSError) as error:
        raise SystemExit(f"{arguments[0]}: {error}") from error


if __name__ == "__main__":
    main(sys.argv[1:])
