"""The truth of filters, section numbers, placements and outliers of written reference cases, found by other means than they were made."""

from typing import Any

import numpy as np
from mpmath import mp, mpf
from numpy.typing import NDArray

from tests.cmmlink.reference.exact_truth import Written

Array = NDArray[np.float64]
AGREED = 1e-13  # of deviations of some hundredths of a mm, by sums in double precision


def numbers(values: list[Any]) -> Array:
    return np.array([float(value) for value in values])


def check_filters(case: Written) -> None:
    """Every filtered profile, by the spectrum of the deviations and integrals over the kernel; a spline by its linear equations."""
    deviation = numbers(case.truth["deviation"])
    for each in case.truth["filtered"]:
        found, cutoff = numbers(each["deviation"]), each["cutoff"]
        if case.truth["case"] in ("filter-parabola", "filter-spikes"):
            station = np.array([float(case.placed(point)[0]) for point in case.points])
            share = np.polynomial.Polynomial.fit(station, found, 2)
            assert np.abs(share(station) - found).max() < AGREED
            spikes = np.flatnonzero(found != deviation)
            assert len(spikes) == (5 if each["name"].startswith("robust") else 0)
            assert np.abs(found - deviation)[spikes].min(initial=1.0) > 0.01
            continue
        placed = np.array([[float(v) for v in case.placed(point)] for point in case.points])
        turned = np.unwrap(np.arctan2(placed[:, 1], placed[:, 0]))
        assert np.abs(np.diff(turned) - 2 * np.pi / len(turned)).max() < AGREED
        around = 2 * mp.pi * mpf(repr(round(float(np.hypot(*placed.mean(axis=0) - placed[0])), 1)))
        if each["name"] == "spline":
            expected = np.linalg.solve(_spline_equations(len(deviation), float(cutoff / (around / len(deviation)))), deviation)
        else:
            order = int(each["name"][-1])
            spectrum = np.fft.rfft(deviation)
            swings = np.flatnonzero(np.abs(spectrum) > 1e-9 * len(deviation))
            assert len(swings) in (1, 3)
            width = _width(order)
            expected = np.fft.irfft(_passed(spectrum, {int(k): _share(order, width, k * cutoff / around) for k in swings}), len(deviation))
        assert np.abs(found - expected).max() < AGREED, each["name"]
    value = case.truth["values"][0]
    wanted = next(one["filter"] for one in case.plan["characteristics"] if "filter" in one)
    named = next(one for one in case.truth["filtered"] if one["name"].endswith(str(wanted["order"])))
    assert float(named["cutoff"]) == wanted["cutoff_mm"]
    assert abs(value["value"] - 2 * max(map(abs, named["deviation"]))) < AGREED


def _passed(spectrum: NDArray[np.complex128], shares: dict[int, float]) -> NDArray[np.complex128]:
    found = np.zeros_like(spectrum)
    for k, share in shares.items():
        found[k] = share * spectrum[k]
    return found


def _share(order: int, width: Any, ratio: Any) -> float:
    """What regression with a Gaussian exp(-pi (x / width)^2) leaves of a cosine of the frequency `ratio`, by integrals; cutoff 1."""
    width = mpf(width)

    def moment(power: int, wave: bool) -> Any:
        def inner(x: Any) -> Any:
            return mp.exp(-mp.pi * (x / width) ** 2) * x**power * (mp.cos(2 * mp.pi * ratio * x) if wave else 1)

        return 2 * mp.quad(inner, mp.linspace(0, 6 * width, 13))

    if order == 0:
        return float(moment(0, True) / moment(0, False))
    m0, m2, m4 = (moment(power, False) for power in (0, 2, 4))
    return float((m4 * moment(0, True) - m2 * moment(2, True)) / (m0 * m4 - m2 * m2))


def _width(order: int) -> float:
    """The width of the kernel, in cutoffs, at which half of a wave as long as the cutoff is left."""
    with mp.workdps(20):
        return float(mp.findroot(lambda width: _share(order, width, 1) - 0.5, (0.4, 0.8), solver="anderson", tol=1e-16, verify=False))


def _spline_equations(count: int, cutoff_steps: float) -> Array:
    """The equations of the periodic spline filter (ISO 16610-22, tension 0): identity and the fourth difference, weighted."""
    second = -2 * np.eye(count) + np.roll(np.eye(count), 1, axis=1) + np.roll(np.eye(count), -1, axis=1)
    return np.asarray(np.eye(count) + second @ second / (2 * np.sin(np.pi / cutoff_steps)) ** 4)


def check_section(case: Written) -> None:
    """Numbers of a part at an even distance from its nominal, by the nominal's points, tangents and curvatures."""
    told = case.truth["deviation"]
    d = mp.fsum(told) / len(told)
    assert max(abs(each - d) for each in told) < mpf(10) ** -13
    value = {each["name"]: each["value"] for each in case.truth["values"]}
    _, places, _ = case.samples
    tail, nose = places[np.argmax(places[:, 0])], places[np.argmin(places[:, 0])]
    assert max(abs(tail[1]), abs(nose[1])) < 1e-2
    length = float(value["chord"] - 2 * d)
    assert abs(np.ptp(places[:, 0]) - length) < 1e-9  # no two places of a section of this kind are farther apart
    assert np.hypot(*(places[::7, None] - places[None, ::7]).T).max() <= length + 1e-12
    for edge, tip, way in (("leading", nose, 1), ("trailing", tail, -1)):
        radius = float(value[f"{edge} edge radius"] - d)
        near = places[np.hypot(*(places - tip).T) < radius]
        centre = np.array([tip[0] + way * radius, 0.0])
        assert len(near) > 50
        assert np.abs(np.hypot(*(near - centre).T) - radius).max() < 1e-9
    assert value["leading edge radius by curvature"] == value["leading edge radius"]
    along = np.append(np.linspace(nose[0] + 0.5, tail[0] - 0.1, 2000), nose[0] + float(value["leading edge radius"] - d))
    inscribed = [np.hypot(*(places - (x, 0.0)).T).min() for x in along]  # the largest circle is that of the leading edge
    assert abs(2 * max(inscribed) - float(value["largest thickness"] - 2 * d)) < 1e-9
    offset = next(one["offset_mm"] for one in case.plan["characteristics"] if one["type"] == "edge-thickness")
    assert abs(_thickness_at(case, nose[0] - float(d) + offset, float(d)) - float(value["leading edge thickness"])) < 1e-9


def check_bent(case: Written) -> None:
    """Numbers of a part at an even distance from the bent section: circles about the middle line, an arc, touch both of its sides."""
    told = case.truth["deviation"]
    d = float(mp.fsum(told) / len(told))
    assert max(abs(each - d) for each in told) < mpf(10) ** -13
    value = {each["name"]: float(each["value"]) for each in case.truth["values"]}
    _, places, _ = case.samples
    radius = value["leading edge radius"]
    assert value["largest thickness"] == 2 * radius
    assert {value["trailing edge radius"], value["leading edge radius by curvature"]} == {radius}
    angles = np.arcsin(0.6) * np.linspace(-1, 1, 301)
    middle = np.column_stack([50 * np.sin(angles), 50 * np.cos(angles) - 40])
    for x, y in middle[::30]:
        assert abs(float(-case.foot((mpf(x), mpf(y))).deviation) + d - radius) < 1e-12
    assert abs(np.hypot(*(places[::9, None] - places[None, ::9]).T).max() + 2 * d - value["chord"]) < 1e-4  # of every ninth sample
    assert abs(np.ptp(places[:, 0]) + 2 * d - value["chord"]) < 2e-6
    along = np.array([np.cos(angles[-1]), -np.sin(angles[-1])])
    tail, nose = middle[-1] + radius * along, middle[0] + radius * along * (-1, 1)
    nominal_tip = middle[-1] + (radius - d) * along
    assert np.hypot(*(places - nominal_tip).T).min() < 1e-9
    assert abs(np.hypot(*(tail - nose)) - value["chord by nose and tail"]) < 1e-12
    assert abs(middle[:, 1].max() - tail[1] - value["largest camber"]) < 1e-12


def _thickness_at(case: Written, x: float, d: float) -> float:
    """Twice the height above x of the curve at a distance from the nominal, between two of its samples."""
    _, places, _ = case.samples
    tangent = np.gradient(places, axis=0)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.hypot(*tangent.T)[:, None]
    upper = (places + d * normal)[(places[:, 1] > 0.5) & (np.abs(places[:, 0] - x) < 3)]
    order = np.argsort(upper[:, 0])
    return 2 * float(np.interp(x, upper[order, 0], upper[order, 1]))


def check_placement(case: Written) -> None:
    """Twist and displacement are those of the pose turned about."""
    pose, value = case.truth["pose"], {each["name"]: each["value"] for each in case.truth["values"]}
    assert value["twist"] == value.get("twist of the chord", value["twist"]) == -pose["rotation_deg"]
    if "twist of the chord" in value:  # a form would turn the chord by itself
        assert max(map(abs, case.truth["deviation"])) < mpf(10) ** -13
    asked = next(one for one in case.plan["characteristics"] if one["type"] == "displacement")
    place = [mpf(repr(each)) for each in asked["place_mm"]]
    actual = mp.lu_solve(_rotation(pose), mp.matrix([place[k] - pose["translation"][k] for k in (0, 1)]))
    moved = [actual[k] - place[k] for k in (0, 1)]
    for name, expected in (("displacement along x", moved[0]), ("displacement along y", moved[1]), ("displacement", mp.hypot(*moved))):
        assert abs(value[name] - expected) < mpf(10) ** -15
    assert case.plan["registration"]["datum"] == {"rotation_deg": 0.0, "translation_mm": [0.0, 0.0]}


def _rotation(pose: dict[str, Any]) -> Any:
    angle = mp.radians(pose["rotation_deg"])
    return mp.matrix([[mp.cos(angle), -mp.sin(angle)], [mp.sin(angle), mp.cos(angle)]])


def check_outliers(case: Written) -> None:
    """Every outlier lies millimetres off, and nothing else does."""
    rows = case.truth["outliers"]
    assert [row for row, d in enumerate(case.truth["deviation"]) if d is None] == rows
    for row in rows:
        assert abs(case.foot(case.placed(case.points[row])).deviation) > 2
