"""The one curve of a drawing that is the nominal: chosen among its chains, in mm, in its plane, joined to one exact NURBS.

What a file of a CAD system holds is a drawing; each format gives one, and all that follows is done here once.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files.chains import Chain, Chains, chains_of
from cmmlink.nominal_files.pieces import Piece, join, reverse
from inspection import NominalError, NurbsCurve, SectionPlane

Array = NDArray[np.float64]

_FLAT = 1e-6  # of the size: how far a plane curve may leave its plane
_LYING = 0.5  # the z of a normal: planes whose normal has more are looked at from above
_SHOWN = 8
_DIGITS = 9
_MOST_DRAWN = 4000  # points of a piece on a picture
_ROUNDS = 20
_SMALLEST_MM, _LARGEST_MM = 1e-2, 1e6
_OPEN = 0.25  # of the size: a chain with a larger gap between its ends is an open profile


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """The curves of a drawing.

    pieces        : in the unit of the drawing, in the order of the file
    source_format : the name of the format, like "dxf-r2010"
    mm_per_unit   : None where the file states no unit
    unit          : how the file states its unit, in words
    has_layers    : whether curves can be told apart by the layer that they are drawn on
    cut           : whether the curves are the section of a solid by the plane that was asked for
    notes         : what was left out or assumed when it was read
    """

    pieces: tuple[Piece, ...]
    source_format: str
    mm_per_unit: float | None
    unit: str
    has_layers: bool = True
    cut: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Choice:
    """Which curve of a drawing is the nominal: one of a layer, or that of a number, the longest being 1."""

    layer: str | None = None
    curve: int | None = None

    def __bool__(self) -> bool:
        return self.layer is not None or self.curve is not None


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A chain of a drawing as a nominal: the curve in mm, the plane it lies in (None: x and y of the drawing), layers, notes."""

    curve: NurbsCurve
    plane: SectionPlane | None
    layers: tuple[str, ...]
    notes: tuple[str, ...]


def nominal_of(drawing: Drawing, choice: Choice, scale: float | None, closed: bool | None, section: SectionPlane | None = None) -> Found:
    """Choose the curve and join it.

    scale   : mm per unit, above what the file states; None: as it states
    closed  : True: one that goes round; False: taken as open, whatever its ends do; None: as its ends tell
    section : the plane that was asked for; a curve that lies in it gets its coordinates

    Raises NominalError, with the list of the chains, where none or several can be meant.
    """
    pieces = _on_layer(drawing, choice.layer)
    factor, unit_note = _factor(drawing, scale)
    if drawing.cut and drawing.mm_per_unit not in (None, factor):
        raise NominalError(f"the unit of a solid that is cut is that of its file ({drawing.unit}); expected no other unit and no scale")
    found = chains_of([_scaled(piece, factor) for piece in pieces])
    chain = _chosen(found, choice, closed, drawing.has_layers)
    _refuse_gap(chain, closed)
    curve, plane, notes = _flat_curve(chain, found.joint, closed, section, drawing.cut)
    layers = tuple(chain.layers) if drawing.has_layers else ()
    said = [unit_note, *drawing.notes, *found.notes, *_on_choice(found, chain, layers), *notes]
    return Found(curve, plane, layers, tuple(said))


@dataclass(frozen=True, slots=True, eq=False)
class DrawnCurve:
    """One of the curves of a drawing: its number, what tells it from the others, its points (k, 3), its loose place.

    loose : where a gap or a fork is (3,); None where there is none
    unit  : that of its points and its length: mm, or what says that it is not known
    """

    number: int
    words: str
    points: Array
    closed: bool
    loose: Array | None
    unit: str


def curves_of(drawing: Drawing, scale: float | None, layer: str | None = None) -> list[DrawnCurve]:
    """All curves of a drawing, longest first, as `curve` counts them, whether one of them is a nominal or not.

    scale : mm per unit, above what the file states; None: as it states
    layer : that of the curves that are counted; None: every one
    """
    factor, found = scale or drawing.mm_per_unit, []
    unit = "mm" if factor else "units of the file"
    pieces = [_scaled(piece, factor or 1.0) for piece in _on_layer(drawing, layer)]
    for number, chain in enumerate(chains_of(pieces).chains, start=1):
        points = np.vstack([piece.derivatives(_drawn_at(piece), 0)[0] for piece in chain.pieces])
        loose = chain.fork if chain.fork is not None else chain.gap[1] if chain.gap is not None else None
        found.append(DrawnCurve(number, _words(chain, drawing.has_layers, unit), points, chain.closed, loose, unit))
    return found


def _drawn_at(piece: Piece) -> Array:
    """Parameters of a piece that are dense enough to be drawn."""
    spans = np.unique(piece.knots)
    each = max(2, min(24, _MOST_DRAWN // len(spans)))
    return np.unique((spans[:-1, None] + np.diff(spans)[:, None] * np.linspace(0, 1, each + 1)).ravel())


def _factor(drawing: Drawing, scale: float | None) -> tuple[float, str]:
    if scale is not None:
        stated = f", above what the file states ({drawing.unit})" if drawing.mm_per_unit not in (None, scale) else ""
        return scale, f"read with {scale:g} mm a unit, as asked{stated}"
    if drawing.mm_per_unit is None:
        raise NominalError(
            f"{drawing.unit}; expected the unit of the drawing: give nominal.unit or nominal.scale (--unit, --nominal-unit or --scale)"
        )
    return drawing.mm_per_unit, f"unit of the file: {drawing.unit}"


def _on_layer(drawing: Drawing, layer: str | None) -> list[Piece]:
    if not drawing.pieces:
        left_out = "; ".join(drawing.notes)
        raise NominalError(f"holds no curve; expected lines, arcs, ellipses or splines{f' ({left_out})' if left_out else ''}")
    if layer is None:
        return list(drawing.pieces)
    if not drawing.has_layers:
        raise NominalError(f"layer {layer}: this format tells no layers; expected the number of a curve")
    chosen = [piece for piece in drawing.pieces if piece.layer.casefold() == layer.casefold()]
    if not chosen:
        layers = sorted({piece.layer for piece in drawing.pieces})
        shown = ", ".join(layers[:_SHOWN]) + (f" and {len(layers) - _SHOWN} more" if len(layers) > _SHOWN else "")
        left_out = "; ".join(drawing.notes)
        raise NominalError(f"no curve is drawn on a layer {layer}; expected one of {shown}{f' ({left_out})' if left_out else ''}")
    return chosen


def _scaled(piece: Piece, factor: float) -> Piece:
    if factor == 1.0:
        return piece
    poles = piece.poles * np.array([factor, factor, factor, 1.0])
    return replace(piece, poles=poles)


def _chosen(found: Chains, choice: Choice, closed: bool | None, has_layers: bool) -> Chain:
    """The chain that is meant: that of the number, else the only closed one, else the only one."""
    chains = found.chains
    if choice.curve is not None:
        if not 1 <= choice.curve <= len(chains):
            raise NominalError(f"curve {choice.curve} is not there; expected 1 to {len(chains)}: {_listed(chains, has_layers)}")
        return chains[choice.curve - 1]
    round_ones = [chain for chain in chains if chain.closed]
    candidates = round_ones if round_ones and closed is not False else list(chains)
    if len(candidates) == 1:
        return candidates[0]
    kinds = f"{len(round_ones)} closed curves" if round_ones else f"{len(chains)} curves, none of which is closed"
    ways = "nominal.layer or nominal.curve (--layer, --curve)" if has_layers else "nominal.curve (--curve)"
    raise NominalError(f"holds {kinds}; expected {ways} to name the profile: {_listed(chains, has_layers)}")


def _listed(chains: tuple[Chain, ...], has_layers: bool) -> str:
    shown = [f"curve {i}: {_words(chain, has_layers)}" for i, chain in enumerate(chains[:_SHOWN], 1)]
    more = [f"and {len(chains) - _SHOWN} shorter ones"] if len(chains) > _SHOWN else []
    return "; ".join([*shown, *more])


def _words(chain: Chain, has_layers: bool, unit: str = "mm") -> str:
    """What tells one chain from another."""
    count = len(chain.pieces)
    layers = f", layer {' and '.join(chain.layers)}" if has_layers else ""
    ending = ""
    if chain.fork is not None:
        ending = f", ends in a fork at {_place(chain.fork)}, where more than two ends meet"
    elif chain.gap is not None:
        ending = f", with a gap of {chain.gap[0]:.4g} {unit} at {_place(chain.gap[1])}"
    return f"{'closed' if chain.closed else 'open'}, {chain.length:.6g} {unit}, {count} piece{'' if count == 1 else 's'}{layers}{ending}"


def _place(point: Array) -> str:
    told = np.round(point, _DIGITS) + 0.0  # no -0, and no 2e-16 of rounding
    return f"({', '.join(f'{value:.6g}' for value in (told if told[2:].any() else told[:2]))})"


def _refuse_gap(chain: Chain, closed: bool | None) -> None:
    """Refuse a chain that forks, and one that nearly closes although nobody said that it is open."""
    if chain.fork is not None:
        raise NominalError(
            f"the curve forks at {_place(chain.fork)}, where more than two ends meet: nothing tells which way the profile goes; "
            "expected the profile on a layer of its own"
        )
    if chain.closed or closed is False:
        return
    first, last = chain.pieces[0].ends[0], chain.pieces[-1].ends[1]
    gap = float(np.linalg.norm(last - first))
    points = np.vstack([piece.points for piece in chain.pieces])
    if closed or gap <= _OPEN * float(np.ptp(points, axis=0).max()):
        raise NominalError(
            f"the curve does not close: a gap of {gap:.6g} mm between {_place(last)} and {_place(first)}. A gap is never closed here: "
            "expected a drawing that closes it, or closed: false (--open) for an open profile"
        )


def _flat_curve(
    chain: Chain, joint: float, closed: bool | None, section: SectionPlane | None, cut: bool
) -> tuple[NurbsCurve, SectionPlane | None, list[str]]:
    """The chain as one curve in its plane, closed ones counter-clockwise from the joint of the greatest x, and what is said of it."""
    pieces = list(chain.pieces)
    points = np.vstack([piece.points for piece in pieces])
    size = float(np.ptp(points, axis=0).max())
    _require_size(points, size)
    plane, notes = (section, []) if cut and section is not None else _plane_of(points, size, section)
    if chain.closed:
        if _turns_right(pieces, plane):
            pieces = [reverse(piece) for piece in reversed(pieces)]
        pieces = _from_greatest_x(pieces, plane, joint)
    whole = join(pieces, joint if chain.closed else 0.0)
    gaps = [float(np.linalg.norm(b.ends[0] - a.ends[1])) for a, b in pairwise(pieces)]
    if gaps and max(gaps) > 1e-9 * size:
        notes.append(f"ends up to {max(gaps):.2g} mm apart were taken as one joint")
    weights = whole.poles[:, 3]
    flat = _in_plane(whole.points, plane)
    curve = NurbsCurve(
        whole.degree, flat, whole.knots, None if np.all(weights == 1.0) else weights, closed=chain.closed and closed is not False
    )
    start, end = curve.point(np.array(curve.domain))
    if chain.closed:
        notes.append(f"runs counter-clockwise from {_place(start)}" + (", open as asked" if closed is False else ""))
    else:
        notes.append(f"open: runs from {_place(start)} to {_place(end)}")
    return curve, plane, notes


def _require_size(points: Array, size: float) -> None:
    far = float(np.abs(points).max())
    if not size >= _SMALLEST_MM or far > _LARGEST_MM or size < 1e-6 * far:
        raise NominalError(
            f"the curve is {size:.4g} mm large and reaches to {far:.4g} mm from the origin; expected a profile of some mm near the "
            "origin: look at the unit of the drawing"
        )


def _plane_of(points: Array, size: float, section: SectionPlane | None) -> tuple[SectionPlane | None, list[str]]:
    """The plane of a curve with these control points, None for z = 0, and what is said of it. Raises NominalError for none."""
    z = points[:, 2]
    if np.ptp(z) <= _FLAT * size:
        if np.abs(z).max() <= _FLAT * size:
            return None, []
        plane = SectionPlane(np.array([0.0, 0.0, float(np.mean([z.min(), z.max()]))]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    else:
        plane = _fitted_plane(points, size)
    plane = _spelt(plane)
    if section is None:
        return plane, [f"the curve lies in space: the section is {words_of_plane(plane)}"]
    if np.abs(section.heights(points)).max() <= _FLAT * size:
        return section, ["the curve lies in the section that was asked for, and has its coordinates"]
    return plane, [
        f"the curve does not lie in the section that was asked for, but in {words_of_plane(plane)}: it has the coordinates of this"
    ]


def _fitted_plane(points: Array, size: float) -> SectionPlane:
    """The plane through points (k, 3), with axes that follow from its normal alone, as those of a cut of a surface do."""
    from drivers.surface import axes_of  # noqa: PLC0415 - only curves in space need it

    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    height = (points - middle) @ normal
    if np.ptp(height) > _FLAT * size:
        raise NominalError(f"the curve is not plane: it leaves its plane by {np.abs(height).max():.4g} mm; expected a section of the part")
    axes = axes_of(tuple(np.where(np.abs(normal) < 1e-12, 0.0, normal).tolist()))
    if (axes.normal[2] if abs(axes.normal[2]) > _LYING else axes.y[2]) < 0:  # seen from above, or with z up, as the planes xz and yz are
        axes = axes_of(tuple((-axes.normal).tolist()))
    return SectionPlane(axes.normal * (middle @ axes.normal), axes.x, axes.normal)


def _spelt(plane: SectionPlane) -> SectionPlane:
    """The plane that comes back to the last bit when its vectors are written and read, so that a replay has the same coordinates."""
    for _ in range(_ROUNDS):
        again = SectionPlane(plane.origin_mm, plane.x_axis, plane.normal)
        if np.array_equal(again.packed, plane.packed):
            break
        plane = again
    return plane


def words_of_plane(plane: SectionPlane) -> str:
    """The plane as a plan spells it."""
    told = (f"{name}: [{', '.join(f'{value:.9g}' for value in vector + 0.0)}]" for name, vector in _vectors(plane))
    return "{" + ", ".join(told) + "}"


def _vectors(plane: SectionPlane) -> list[tuple[str, Array]]:
    return [("origin_mm", plane.origin_mm), ("normal", plane.normal), ("x_axis", plane.x_axis)]


def _in_plane(points: Array, plane: SectionPlane | None) -> Array:
    if plane is None:
        return points[:, :2]
    return (points - plane.origin_mm) @ np.column_stack([plane.x_axis, np.cross(plane.normal, plane.x_axis)])


def _turns_right(pieces: list[Piece], plane: SectionPlane | None) -> bool:
    """Whether a closed chain runs clockwise: the sign of its area, of many points of it."""
    samples = [
        piece.derivatives(np.unique(np.concatenate([np.linspace(piece.knots[0], piece.knots[-1], 33), piece.knots])), 0)[0]
        for piece in pieces
    ]
    x, y = (_in_plane(np.vstack(samples), plane) - _in_plane(samples[0][:1], plane)).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) < 0


def _from_greatest_x(pieces: list[Piece], plane: SectionPlane | None, joint: float) -> list[Piece]:
    """The closed chain from the joint of the greatest x, of several the greatest y, so that the order of a file moves no station."""
    starts = np.round(_in_plane(np.array([piece.ends[0] for piece in pieces]), plane) / (10 * joint))
    first = max(range(len(pieces)), key=lambda i: tuple(starts[i]))
    return pieces[first:] + pieces[:first]


def _on_choice(found: Chains, chain: Chain, layers: tuple[str, ...]) -> list[str]:
    number, others = found.chains.index(chain) + 1, len(found.chains) - 1
    count = len(chain.pieces)
    where = f" of layer {' and '.join(layers)}" if layers else ""
    of = f"curve {number} of {others + 1}" if others else "the only curve"
    return [f"the profile is {of}{where}, made of {count} piece{'' if count == 1 else 's'}"]
