"""Commands around a measurement: what a nominal says, what a plan would do, what this computer has, a simulated device."""

import os
import platform
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.exit_codes import UNUSABLE, fail
from cmmlink.commands.options import Closed, CurveNumber, Json, Layer, Records, SectionPlaneNumbers, records_folder, section_in
from cmmlink.commands.output import now, print_json
from cmmlink.errors import PlanError
from cmmlink.version import __version__
from drivers import LinkError, UnitName
from inspection import NominalError

if TYPE_CHECKING:
    from cmmlink.nominal_files import NominalFile
    from cmmlink.nominal_files.drawing import DrawnCurve
    from inspection import SectionPlane


def nominal(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The nominal profile: UIUC dat, points, nurbs yaml, or a drawing.")],
    scale: Annotated[float, typer.Option(metavar="S", help="Units of the file to mm.")] = 1.0,
    unit: Annotated[UnitName | None, typer.Option(help="Unit of the file, in place of --scale, above what the file states.")] = None,
    closed: Closed = None,
    layer: Layer = None,
    curve: CurveNumber = None,
    section: SectionPlaneNumbers = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE.png", help="Draw it: shape, start, direction, corners, notes.")] = None,
    as_json: Json = False,
) -> int:
    """Show what was understood of a nominal file."""
    from cmmlink.nominal_files import curves_in, load_nominal

    plane = _plane_from(section)
    try:
        understood = load_nominal(file, scale, closed, unit, layer=layer, curve=curve, section=plane)
    except NominalError as error:
        if out is not None and (drawn := _draw_all(curves_in(file, scale, unit, layer, plane), file, out)):
            raise NominalError(f"{error}; {out} shows {drawn} curves with their numbers") from None
        raise
    if out is not None:
        _draw(understood, file, out)
    if as_json:
        print_json(_nominal_json(understood))
        return 0
    nurbs = understood.curve
    typer.echo(f"{file}: {understood.source_format}, degree {nurbs.degree}, {len(nurbs.control_points_mm)} control points")
    typer.echo(f"{'closed' if nurbs.closed else 'open'}, length {nurbs.length_mm:.4f} mm, corners {len(nurbs.corners)}")
    for note in understood.notes:
        typer.echo(f"  {note}")
    return 0


def _draw(understood: "NominalFile", file: Path, out: Path) -> None:
    from cmmlink.report import write_nominal_picture

    _require_picture(out)
    write_nominal_picture(understood, file.name, out)


def _draw_all(curves: "list[DrawnCurve]", file: Path, out: Path) -> int:
    """Draw the curves of a drawing of which none could be taken, each with its number. Returns how many; 0 where there are not several."""
    _require_picture(out)
    if len(curves) > 1:
        from cmmlink.report import write_curves_picture

        write_curves_picture(curves, file.name, out)
    return len(curves) if len(curves) > 1 else 0


def _require_picture(out: Path) -> None:
    if out.suffix.lower() != ".png":
        raise PlanError(f"--out {out}: expected the name of a picture that ends in .png")


def _plane_from(section: tuple[float, ...] | None) -> "SectionPlane | None":
    if section is None:
        return None
    from cmmlink.from_plan import plane_of
    from cmmlink.plan import Section

    return plane_of(Section(**section_in("xy", section)))


def _nominal_json(understood: "NominalFile") -> dict[str, Any]:
    from cmmlink.nominal_files import material_side

    def plane_json(plane: "SectionPlane") -> dict[str, list[float]]:
        return {name: getattr(plane, name).tolist() for name in ("origin_mm", "normal", "x_axis")}

    curve = understood.curve
    assert curve.weights is not None
    return {
        "degree": curve.degree,
        "knots": curve.knots.tolist(),
        "control_points_mm": curve.control_points_mm.tolist(),
        "weights": curve.weights.tolist(),
        "closed": curve.closed,
        "length_mm": curve.length_mm,
        "source_format": understood.source_format,
        "corners": len(curve.corners),
        "material": material_side(curve),
        "layers": list(understood.layers),
        "plane": None if understood.plane is None else plane_json(understood.plane),
        "notes": list(understood.notes),
    }


def prepare() -> int:
    """Compile the inspection, once after an installation, so that no measurement waits for it."""
    from cmmlink.demo import plan_file as demo_plan_file
    from cmmlink.from_plan import profile_of
    from cmmlink.plan import load_plan
    from inspection import Outline, compiled_code_folder, find_airfoil, rehearse
    from inspection.surface import rehearse_surfaces

    profile = profile_of(load_plan(demo_plan_file()))
    rehearse(profile, "veaw", reject_outliers=True)  # the method and the fit that need the most
    rehearse(profile)
    _ = Outline(find_airfoil(profile)).camber  # by what it takes, characteristics look for places on a section
    rehearse_surfaces()
    folder = compiled_code_folder()
    if folder is None:
        return fail("no folder for compiled code can be written, so that every command compiles anew", UNUSABLE)
    typer.echo(f"the inspection is compiled, in {folder}")
    return 0


def doctor(
    bundle: Annotated[
        Path | None, typer.Option("--bundle", metavar="FILE", help="Pack log, versions and the newest run into this zip file, to be sent.")
    ] = None,
    records: Records = None,
) -> int:
    """Look at what cmmlink needs of this computer, and mend or name what is missing."""
    said: list[str] = []

    def say(text: str) -> None:
        said.append(text)
        typer.echo(text)

    try:
        return _look_after_all(say, records)
    finally:
        if bundle is not None:  # packed even when a check above raises
            from cmmlink.commands.support_bundle import pack_bundle

            for line in pack_bundle(bundle, said, records_folder(records), now):
                typer.echo(line)


def _look_after_all(say: Callable[[str], None], records: Path | None) -> int:
    from cmmlink.commands.open3d_doctor import look_after_open3d
    from cmmlink.demo import plan_file as demo_plan_file
    from cmmlink.devices import serial_ports
    from cmmlink.from_plan import profile_of
    from cmmlink.nominal_files.solids import words_on_kernel
    from cmmlink.plan import load_plan
    from cmmlink.scratch import words_of_room
    from inspection import rehearse

    say(f"cmmlink {__version__} on Python {platform.python_version()}, {platform.system()} {platform.machine()}")
    rehearse(profile_of(load_plan(demo_plan_file())))
    say("inspection: compiled and working")
    folder = records_folder(records)
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    writable = os.access(nearest, os.W_OK)
    say(f"records: {folder}" + ("" if writable else f" cannot be written: choose another folder with --records ({nearest})"))
    if writable:
        say(f"records in {words_of_room(folder)}")
    say(f"qualification: {_words_on_qualification()}")
    say(f"serial ports: {', '.join(name for name, _ in serial_ports()) or 'none found'}")
    say(words_on_kernel())
    whole = look_after_open3d(say)
    return 0 if whole and writable else UNUSABLE


def _words_on_qualification() -> str:
    """What came of the last qualification, and whether it still holds: of every file of the installation, which is read anew."""
    from cmmlink.installation import read_installation, station_folder
    from cmmlink.last_qualification import last_qualification

    last = last_qualification(station_folder())
    if last is None:
        return "none was made; `cmmlink qualify` makes one in about a minute"
    changes = last.changes(read_installation(station_folder()))
    anew = "; `cmmlink qualify` makes a new one" if last.warning(changes) else ""
    return f"{last.words(changes)} (certificate {last.certificate}){anew}"


def list_ports() -> int:
    """List the serial ports of this computer."""
    from cmmlink.devices import serial_ports

    found = serial_ports()
    for name, description in found:
        typer.echo(f"{name}\t{description}")
    if not found:
        typer.echo("no serial port was found")
    return 0


def simulate(context: typer.Context, device: Annotated[str, typer.Argument(metavar="DEVICE")] = "") -> int:
    """Serve a simulated device. Without --path it scans the section of the demonstration."""
    from cmmlink.demo import section_on_machine
    from simulators import end_with_stdin, known_devices, say, settings_from

    known = known_devices()
    if device in ("-h", "--help"):
        typer.echo(textwrap.fill(f"cmmlink simulate DEVICE, one of: {', '.join(sorted(known))}", 80) + "\n")
        settings_from(["--help"], "cmmlink simulate DEVICE", section_on_machine)
    if device not in known:
        problem = f"no simulated device is called {device}" if device else "name the device to simulate"
        raise PlanError(f"{problem}; known: {', '.join(sorted(known))}; `cmmlink simulate --help` shows their options")
    settings = settings_from(context.args, f"cmmlink simulate {device}", section_on_machine)
    if settings.bound:
        end_with_stdin()
    try:
        known[device](settings, say)
    except (ValueError, OSError) as error:
        raise LinkError(f"the simulated device cannot serve {settings.address}: {error}") from None
    return 0
