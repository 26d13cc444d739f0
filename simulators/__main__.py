"""`python -m simulators DEVICE --address ... --path ...`: one simulated device as a process of its own."""

import signal
import sys

from simulators.devices import known_devices
from simulators.settings import end_with_stdin, say, settings_from


def main(arguments: list[str]) -> None:
    """Serve the device named first. It leaves nothing behind when it is asked to end, or when its parent is gone."""
    known = known_devices()
    if not arguments or arguments[0] not in known:
        raise SystemExit(f"name a device: {', '.join(sorted(known))}")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        settings = settings_from(arguments[1:])
        if settings.bound:
            end_with_stdin()
        known[arguments[0]](settings, say)
    except (ValueError, OSError) as error:
        raise SystemExit(f"{arguments[0]}: {error}") from error
    except KeyboardInterrupt:
        raise SystemExit(130) from None


if __name__ == "__main__":
    main(sys.argv[1:])
