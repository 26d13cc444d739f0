"""What a finished run leaves behind, one file per kind of output. This is the front door of the package.

Pictures are drawn by matplotlib, which is loaded when the first one is.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.report.folder import prepare, write_results, write_run
    from cmmlink.report.stack_folder import write_stack
    from cmmlink.report.terminal import STYLE_OF, STYLES, LiveTable, print_summary
else:
    _PLACES = {
        "cmmlink.report.folder": ("prepare", "write_results", "write_run"),
        "cmmlink.report.stack_folder": ("write_stack",),
        "cmmlink.report.terminal": ("STYLE_OF", "STYLES", "LiveTable", "print_summary"),
    }

    def __getattr__(name: str) -> object:
        from importlib import import_module  # noqa: PLC0415 - nothing is loaded before a name is used

        for place, names in _PLACES.items():
            if name in names:
                return getattr(import_module(place), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "STYLES",
    "STYLE_OF",
    "LiveTable",
    "prepare",
    "print_summary",
    "write_results",
    "write_run",
    "write_stack",
]
