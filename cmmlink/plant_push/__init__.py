"""From the record of a station to the results database of its plant: what is pushed, what waits, and whether both agree.

This is the front door.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.plant_push.following import LOOK_S, be_last_in_line, follow
    from cmmlink.plant_push.plant_settings import RESULTS_FILE, SETTINGS_FILE, address_for, keep_address, named_address
    from cmmlink.plant_push.pushing import Outbox, outbox_of, push
    from cmmlink.plant_push.recorded_results import characteristics_of, part_of, stored_run
    from cmmlink.plant_push.verifying import PlantVerified, Row, verify_plant
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.plant_push.following": ("LOOK_S", "be_last_in_line", "follow"),
        "cmmlink.plant_push.plant_settings": ("RESULTS_FILE", "SETTINGS_FILE", "address_for", "keep_address", "named_address"),
        "cmmlink.plant_push.pushing": ("Outbox", "outbox_of", "push"),
        "cmmlink.plant_push.recorded_results": ("characteristics_of", "part_of", "stored_run"),
        "cmmlink.plant_push.verifying": ("PlantVerified", "Row", "verify_plant"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "LOOK_S",
    "RESULTS_FILE",
    "SETTINGS_FILE",
    "Outbox",
    "PlantVerified",
    "Row",
    "address_for",
    "be_last_in_line",
    "characteristics_of",
    "follow",
    "keep_address",
    "named_address",
    "outbox_of",
    "part_of",
    "push",
    "stored_run",
    "verify_plant",
]
