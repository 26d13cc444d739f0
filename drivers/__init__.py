"""Devices, and files of points, to batches of points in millimetres.

This is the front door: the contract of every source and decoder, the errors, the wire formats by name, register maps, and
files of points. What opens a link stays in `drivers.links`, what cuts surfaces in `drivers.surface`, and what reads scans of them in
`drivers.scan_file`: pyserial, pymodbus, scipy and Open3D are loaded only by those who import from there.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from drivers.codecs import axes_in, decoder, decoders, unseen_in
    from drivers.codecs.dme_commands import (
        curve_density,
        move_to,
        point_measurement,
        scan_on_circle,
        scan_on_line,
        scan_unknown,
        scans_on_curve,
    )
    from drivers.codecs.dme_points import PointCheck
    from drivers.codecs.dme_session import DME_UNSEEN, DmeJob
    from drivers.codecs.register_decoder import RegisterDecoder
    from drivers.codecs.register_map import RegisterMap, register_map
    from drivers.codecs.register_survey import KINDS, TABLES, WORD_ORDERS, RegisterSurvey, Table, WordOrder, registers_of, stored_number
    from drivers.errors import CadError, DeviceError, DeviceRefused, LinkError, MeshError, PointFileError, ProtocolError
    from drivers.files.column_choice import AxisName
    from drivers.files.point_file import PointArraySource, PointFile, PointFileSource, convert_to_mm, points_in, points_of, read_points
    from drivers.files.row_reading import shorten
    from drivers.files.stated_units import UnitName, mm_per
    from drivers.files.text_table import Columns, count_of, numbers_of, parse_columns, read_bytes, read_text
    from drivers.links.address import HostPort, device_address
    from drivers.links.capture import Capture
    from drivers.maps import shipped_map, shipped_maps
    from drivers.source import (
        HARMLESS_REASONS,
        Arrival,
        Damaged,
        Decoder,
        Heartbeat,
        LinkDown,
        LinkUp,
        Lost,
        PointBatch,
        Rejected,
        ScanClosed,
        ScanOpened,
        ScanSource,
        WireBytes,
    )
else:
    _PLACES = {
        "drivers.codecs": ("axes_in", "decoder", "decoders", "unseen_in"),
        "drivers.codecs.dme_commands": (
            "curve_density",
            "move_to",
            "point_measurement",
            "scan_on_circle",
            "scan_on_line",
            "scan_unknown",
            "scans_on_curve",
        ),
        "drivers.codecs.dme_points": ("PointCheck",),
        "drivers.codecs.dme_session": ("DME_UNSEEN", "DmeJob"),
        "drivers.codecs.register_decoder": ("RegisterDecoder",),
        "drivers.codecs.register_map": ("RegisterMap", "register_map"),
        "drivers.codecs.register_survey": (
            "KINDS",
            "TABLES",
            "WORD_ORDERS",
            "RegisterSurvey",
            "Table",
            "WordOrder",
            "registers_of",
            "stored_number",
        ),
        "drivers.errors": ("CadError", "DeviceError", "DeviceRefused", "LinkError", "MeshError", "PointFileError", "ProtocolError"),
        "drivers.files.column_choice": ("AxisName",),
        "drivers.files.point_file": (
            "PointArraySource",
            "PointFile",
            "PointFileSource",
            "convert_to_mm",
            "points_in",
            "points_of",
            "read_points",
        ),
        "drivers.files.row_reading": ("shorten",),
        "drivers.files.stated_units": ("UnitName", "mm_per"),
        "drivers.files.text_table": ("Columns", "count_of", "numbers_of", "parse_columns", "read_bytes", "read_text"),
        "drivers.links.address": ("HostPort", "device_address"),
        "drivers.links.capture": ("Capture",),
        "drivers.maps": ("shipped_map", "shipped_maps"),
        "drivers.source": (
            "HARMLESS_REASONS",
            "Arrival",
            "Damaged",
            "Decoder",
            "Heartbeat",
            "LinkDown",
            "LinkUp",
            "Lost",
            "PointBatch",
            "Rejected",
            "ScanClosed",
            "ScanOpened",
            "ScanSource",
            "WireBytes",
        ),
    }

    def __getattr__(name: str) -> object:
        from importlib import import_module  # noqa: PLC0415 - nothing is loaded before a name is used

        for place, names in _PLACES.items():
            if name in names:
                return getattr(import_module(place), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "DME_UNSEEN",
    "HARMLESS_REASONS",
    "KINDS",
    "TABLES",
    "WORD_ORDERS",
    "Arrival",
    "AxisName",
    "CadError",
    "Capture",
    "Columns",
    "Damaged",
    "Decoder",
    "DeviceError",
    "DeviceRefused",
    "DmeJob",
    "Heartbeat",
    "HostPort",
    "LinkDown",
    "LinkError",
    "LinkUp",
    "Lost",
    "MeshError",
    "PointArraySource",
    "PointBatch",
    "PointCheck",
    "PointFile",
    "PointFileError",
    "PointFileSource",
    "ProtocolError",
    "RegisterDecoder",
    "RegisterMap",
    "RegisterSurvey",
    "Rejected",
    "ScanClosed",
    "ScanOpened",
    "ScanSource",
    "Table",
    "UnitName",
    "WireBytes",
    "WordOrder",
    "axes_in",
    "convert_to_mm",
    "count_of",
    "curve_density",
    "decoder",
    "decoders",
    "device_address",
    "mm_per",
    "move_to",
    "numbers_of",
    "parse_columns",
    "point_measurement",
    "points_in",
    "points_of",
    "read_bytes",
    "read_points",
    "read_text",
    "register_map",
    "registers_of",
    "scan_on_circle",
    "scan_on_line",
    "scan_unknown",
    "scans_on_curve",
    "shipped_map",
    "shipped_maps",
    "shorten",
    "stored_number",
    "unseen_in",
]
