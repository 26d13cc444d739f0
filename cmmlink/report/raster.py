"""Draws a surface into an image with a depth buffer, in numpy alone: no display is needed, and the same input gives the same bytes.

The nominal is drawn from places that lie close together on it, the scan from its points. Every pixel shows the worst point of those that
lie in it and are not hidden by the part; a pixel that no point reaches shows the nominal.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Keys = NDArray[np.int64]
Image = NDArray[np.uint8]
Steps = tuple[tuple[int, int], ...]

_ROW = 32  # bits of a key that hold the row of a point; above them stands what decides which point is seen
_ROW_MASK = (1 << _ROW) - 1
_LARGEST_DISC_PX = 14
_EDGE_ON = 0.15  # cosine beyond which a surface counts as seen no more from the side
_DEPTH_PX = 2.0  # how far behind the part's front a point may lie that still belongs to it, in pixels, where it is seen straight
_DARKEST = 0.55  # of its colour, where a surface is seen from the side
_INSIDE = 0.6  # more of it where an open surface is seen from behind
_PAPER = 255
_STRAIGHT: Steps = ((-1, 0), (1, 0), (0, -1), (0, 1))
_ASLANT: Steps = ((-1, -1), (-1, 1), (1, -1), (1, 1))


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """Looks at a part from so far away that lines stay parallel.

    right, up, towards : (3,) unit directions in space: to the right and up in the image, and from the part to the viewer
    centre_mm          : (3,) place in the middle of the image
    mm_per_px          : size of a pixel
    width_px, height_px: size of the image
    """

    right: Array
    up: Array
    towards: Array
    centre_mm: Array
    mm_per_px: float
    width_px: int
    height_px: int

    def pixels(self, places_mm: Array) -> Array:
        """Where places (n, 3) lie in the image: columns and rows from its upper left corner, in pixels, (n, 2)."""
        moved = places_mm - self.centre_mm
        column = moved @ self.right / self.mm_per_px + self.width_px / 2
        row = self.height_px / 2 - moved @ self.up / self.mm_per_px
        return np.column_stack([column, row])

    def nearness_mm(self, places_mm: Array) -> Array:
        """How far places (n, 3) lie in front of the middle, towards the viewer (n,)."""
        return np.asarray((places_mm - self.centre_mm) @ self.towards)


@dataclass(frozen=True, slots=True, eq=False)
class Dots:
    """Places that are drawn as discs.

    places_mm : (n, 3)
    normals   : (n, 3) unit, out of the material
    colours   : (n, 3) red, green and blue
    severity  : (n,) float32 above zero; of several dots in a pixel the one with the largest is seen
    spacing_mm: about how far neighbours are apart, which the discs have to bridge
    """

    places_mm: Array
    normals: Array
    colours: Image
    severity: NDArray[np.float32]
    spacing_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What a camera saw.

    image    : (height, width, 3) red, green and blue
    front_mm : (height, width) how far the part's front lies in front of the middle; -inf where there is no part
    """

    image: Image
    front_mm: Array


def draw_view(camera: Camera, nominal: Dots, scan: Dots) -> View:
    """Draw the scan upon the nominal."""
    ground = _ground_of(camera, nominal)
    shown = ground >= 0
    front_mm = np.where(shown, camera.nearness_mm(nominal.places_mm)[ground], -np.inf)
    faces = np.where(shown, _facing(camera, nominal.normals)[ground], 1.0)
    seen = _seen_of(camera, scan, _DEPTH_PX * camera.mm_per_px + nominal.spacing_mm, front_mm, faces)
    image: Image = np.full((*ground.shape, 3), _PAPER, dtype=np.uint8)
    image[shown] = _shaded(camera, nominal, ground[shown])
    image[seen >= 0] = _shaded(camera, scan, seen[seen >= 0])
    return View(image, front_mm)


def _ground_of(camera: Camera, nominal: Dots) -> Keys:
    """The row of the nominal's nearest place in every pixel (height, width), -1 where there is none."""
    nearness = camera.nearness_mm(nominal.places_mm)
    farthest = float(nearness.min()) - 1.0 if len(nearness) else 0.0
    rows, index = _inside(camera, nominal.places_mm)
    keys = _largest(camera, index, _keys(nearness[rows] - farthest, rows))
    return _row_of(_dilated(keys, nominal.spacing_mm / camera.mm_per_px))


def _seen_of(camera: Camera, scan: Dots, around_mm: float, front_mm: Array, faces: Array) -> Keys:
    """The row of the worst point seen in every pixel (height, width), -1 where there is none.

    around_mm : how far beside a point the nominal's place may lie that stands for its front
    """
    rows, index = _inside(camera, scan.places_mm)
    facing, nearness = _facing(camera, scan.normals), camera.nearness_mm(scan.places_mm)
    reach = nearness + around_mm / np.maximum(np.abs(facing), _EDGE_ON)
    at_front = reach[rows] >= front_mm.flat[index]
    same_side = facing[rows] * faces.flat[index] >= 0  # no wall is so thin that it is seen through
    rows, index = rows[at_front & same_side], index[at_front & same_side]
    if not len(rows):
        return np.full(front_mm.shape, -1)
    keys = _largest(camera, index, _keys(scan.severity[rows], rows))
    for neighbours in _steps(0.5 * scan.spacing_mm / camera.mm_per_px):
        worst, farthest = keys.copy(), np.where(keys > 0, reach[_row_of(keys)], -np.inf)
        for target, source in _shifts(keys.shape, neighbours):
            is_front = farthest[source] >= front_mm[target]
            worst[target] = np.maximum(worst[target], np.where(is_front, keys[source], 0))
        keys = worst
    return _row_of(keys)


def _inside(camera: Camera, places_mm: Array) -> tuple[Keys, Keys]:
    """Rows (k,) of the places inside the image, and the number (k,) of the pixel that each lies in."""
    cells = np.floor(camera.pixels(places_mm)).astype(np.int64)
    rows = np.flatnonzero((cells >= 0).all(axis=1) & (cells < (camera.width_px, camera.height_px)).all(axis=1))
    return rows, cells[rows, 1] * camera.width_px + cells[rows, 0]


def _keys(value: NDArray[np.floating], rows: Keys) -> Keys:
    """Whole numbers (k,) in the order of positive values (k,), with the rows of their points in the lower half."""
    order = np.ascontiguousarray(value, dtype=np.float32).view(np.int32).astype(np.int64)  # the bits of positive floats count upwards
    return np.asarray((order << _ROW) | rows)


def _row_of(keys: Keys) -> Keys:
    return np.asarray(np.where(keys > 0, keys & _ROW_MASK, -1))


def _largest(camera: Camera, index: Keys, keys: Keys) -> Keys:
    """The largest key in every pixel (height, width), 0 where there is none."""
    found = np.zeros(camera.height_px * camera.width_px, dtype=np.int64)
    np.maximum.at(found, index, keys)
    return found.reshape(camera.height_px, camera.width_px)


def _dilated(keys: Keys, radius_px: float) -> Keys:
    """Discs around the pixels that have a key (height, width); where several meet, the largest key is kept."""
    for neighbours in _steps(radius_px):
        found = keys.copy()
        for target, source in _shifts(keys.shape, neighbours):
            np.maximum(found[target], keys[source], out=found[target])
        keys = found
    return keys


def _steps(radius_px: float) -> Iterator[Steps]:
    """Steps of one pixel that make a disc of about a radius, an octagon, one after the other."""
    for step in range(int(min(max(np.round(radius_px), 1), _LARGEST_DISC_PX))):
        yield _STRAIGHT if step % 2 else _STRAIGHT + _ASLANT


def _shifts(shape: tuple[int, ...], neighbours: Steps) -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Pairs of windows, of which one is moved against the other by each of the steps down and right."""
    height, width = shape
    for down, right in neighbours:
        yield (_window(down, height), _window(right, width)), (_window(-down, height), _window(-right, width))


def _window(step: int, size: int) -> slice:
    return slice(max(step, 0), min(size + step, size))


def _facing(camera: Camera, normals: Array) -> Array:
    """Cosine (n,) between normals and the direction to the viewer."""
    return np.asarray(normals @ camera.towards)


def _shaded(camera: Camera, dots: Dots, rows: Keys) -> Image:
    """The colours (k, 3) of some dots, darker the more they are seen from the side, and darker still from behind."""
    facing = _facing(camera, dots.normals[rows])
    light = (_DARKEST + (1.0 - _DARKEST) * np.abs(facing)) * np.where(facing < 0, _INSIDE, 1.0)
    return np.round(dots.colours[rows] * light[:, None]).astype(np.uint8)
