"""The command line: its commands, and the one place where errors become exit codes.

0 conform, 1 nonconform, 3 uncertain; 2 unusable input or plan, 4 device or link failure, 5 the record could not be kept.
"""

import io
import logging
import os
import sys
import traceback
from contextlib import suppress
from typing import Annotated

import typer

from cmmlink.commands.backup import backup, merge, restore
from cmmlink.commands.check import check
from cmmlink.commands.compare import compare
from cmmlink.commands.console import serve_console
from cmmlink.commands.exit_codes import DEVICE_FAILED, NO_RECORD, STOPPED, UNUSABLE, fail_as_asked, fail_in_words
from cmmlink.commands.export import export
from cmmlink.commands.key import key
from cmmlink.commands.measure import demo, run
from cmmlink.commands.plans import example, plan
from cmmlink.commands.plant import plant
from cmmlink.commands.point_files import inspect
from cmmlink.commands.proofs import verify_zone
from cmmlink.commands.qualification import qualify
from cmmlink.commands.records import replay, runs, show
from cmmlink.commands.reference_set import reference
from cmmlink.commands.registers import registers
from cmmlink.commands.rejudge import rejudge
from cmmlink.commands.report import report
from cmmlink.commands.setup import doctor, list_ports, nominal, prepare, simulate
from cmmlink.commands.study import study
from cmmlink.commands.surfaces import ManyHeights, ct
from cmmlink.commands.verify import verify
from cmmlink.commands.whole_surfaces import surface
from cmmlink.errors import PlanError, PlantAwayError, PlantError, RunError, StoreError
from cmmlink.log import keep_log, log_command, log_folder
from cmmlink.version import __version__
from drivers import DeviceError, MeshError, PointFileError
from inspection import InspectionError, while_compiling

_NO_MEMORY = "this computer has too little memory left for it; close other programs, or take fewer points at once"
_log = logging.getLogger(__name__)

app = typer.Typer(
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)
app.command()(demo)
app.command()(run)
app.command()(inspect)
app.command(cls=ManyHeights)(ct)
app.command(short_help="Inspect a scan of a whole surface against CAD, a mesh or a cloud.")(surface)
app.command()(nominal)
app.command(short_help="Write files to try every command on.")(example)
app.add_typer(plan, name="plan")
app.command()(check)
app.command("console", short_help="Serve the operator console in a browser.")(serve_console)
app.command(short_help="Compile the inspection, once after an installation.")(prepare)
app.command(short_help="Look at what cmmlink needs of this computer.")(doctor)
app.command(short_help="Judge parts whose truth is known, and write a certificate.")(qualify)
app.command("ports")(list_ports)
app.command(short_help="Show what a Modbus device's registers hold, and write a register map.")(registers)
app.command(add_help_option=False, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})(simulate)
app.command()(runs)
app.command()(show)
app.command(short_help="Write recorded runs as files, also for other programs.")(export)
app.command(short_help="Write the report of a recorded run as a PDF.")(report)
app.command(short_help="Lay two scans of one profile over one another.")(compare)
app.command(short_help="Judge a recorded run again, also with another plan.")(replay)
app.command(short_help="Judge a whole archive again with another plan.")(rejudge)
app.command(short_help="Show whether a record was altered, and who signed it.")(verify)
app.add_typer(key, name="key", short_help="Show or change the key that signs the runs.")
app.add_typer(plant, name="plant", short_help="Push results to a database that many stations share.")
app.add_typer(study, name="study", short_help="Study the measuring system by repeated scans.")
app.command("verify-zone", short_help="Check the proofs of minimum zones and least consumptions.")(verify_zone)
app.command(short_help="Write points and nominals whose truth is known.")(reference)
app.command(short_help="Copy all records to one checked file.")(backup)
app.command(short_help="Bring back what a backup holds.")(restore)
app.command(short_help="Add the runs of another station.")(merge)


@app.callback(invoke_without_command=True)
def cmmlink(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Acquire points from coordinate measuring machines and scanners and judge every one against the nominal profile as it arrives.

    Exit status: 0 conform, 1 nonconform, 3 uncertain; 2 unusable input or plan, 4 device or link failure, 5 the record could not be kept.
    """
    if version:
        typer.echo(f"cmmlink {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(UNUSABLE)


def main() -> None:
    """Run the command line; every error a user can cause ends as one message and an exit code."""
    _prepare_streams()
    with keep_log(log_folder()):
        log_command(sys.argv[1:])
        code = _run_command()
        _log.info("exit status %s", code or 0)
    sys.exit(code or 0)


def _run_command() -> int | str | None:
    """Run the command that the arguments name. Returns its exit status."""
    code: int | str | None
    try:
        _refuse_strange_bytes(sys.argv[1:])
        with while_compiling(_say_that_it_compiles):
            code = app(prog_name="cmmlink", standalone_mode=False)
        sys.stdout.flush()
        if code == STOPPED:
            fail_in_words("stopped", "stopped by the operator", STOPPED)
    except typer.TyperException as error:
        code = fail_in_words("usage", _usage(error))
    except (PlanError, RunError, InspectionError, PointFileError, MeshError) as error:
        code = fail_as_asked(error, UNUSABLE)
    except (DeviceError, PlantAwayError) as error:
        code = fail_as_asked(error, DEVICE_FAILED)
    except PlantError as error:
        code = fail_as_asked(error, UNUSABLE)
    except StoreError as error:
        code = fail_as_asked(error, NO_RECORD)
    except OSError as error:
        code = fail_in_words("system", _words_of(error))
        _silence_stdout()
    except MemoryError:
        code = fail_in_words("system", _NO_MEMORY)
    except SystemExit as ended:  # typer ends with 1 when standard output was closed, but 1 means nonconform here
        code = UNUSABLE if ended.code == 1 else ended.code
    except Exception as error:  # Python would end with 1, which means nonconform here
        traceback.print_exc()
        code = fail_in_words("defect", f"a defect of cmmlink, please report it: {error}")
    return code


def _refuse_strange_bytes(words: list[str]) -> None:
    """Raise PlanError for a name that is no text: no record and no result file could hold it."""
    for word in words:
        try:
            word.encode("utf-8")
        except UnicodeEncodeError:
            told = word.encode("utf-8", "backslashreplace").decode()
            raise PlanError(f"{told}: the name holds bytes that are no text (UTF-8); rename the file or folder") from None


def _prepare_streams() -> None:
    """Make sure stdout and stderr exist and replace characters they cannot encode, so that no verdict is lost to an encoding error."""
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - for as long as the program runs
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _words_of(error: OSError) -> str:
    """What the system refused. Where it names no file, a pipe is always the answer's; anything else may be a file's, too."""
    if error.filename:
        return str(error)
    what = "the answer could not be written" if isinstance(error, BrokenPipeError) else "the answer or a file could not be written or read"
    return f"{what}: {error}"


def _silence_stdout() -> None:
    """Point a broken stdout at the null device, so that the final flush does not fail again."""
    with suppress(OSError):
        broken = sys.stdout.fileno()
        os.dup2(os.open(os.devnull, os.O_WRONLY), broken)


def _say_that_it_compiles() -> None:
    sys.stderr.write("cmmlink: compiling the inspection, once after an installation, up to half a minute\n")


def _usage(error: typer.TyperException) -> str:
    """What is wrong with the arguments, and where to read what is right."""
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "cmmlink"
    problem = " ".join(error.format_message().replace("Value error, ", "").rstrip(".").split())
    return f"{problem}; `{command} --help` shows what is allowed"
