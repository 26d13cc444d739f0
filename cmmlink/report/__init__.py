"""What a finished run leaves behind, one file per kind of output. This is the front door of the package.

Pictures are drawn by matplotlib, which is loaded when the first one is.
"""

from cmmlink.report.folder import prepare, write_results, write_run
from cmmlink.report.stack_folder import write_stack
from cmmlink.report.terminal import STYLE_OF, STYLES, LiveTable, print_summary

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
