"""Filters along the arc length: printed values of independent programs, closed forms of the transmission, and what must not matter."""

import numpy as np
import pytest
from scipy.special import erfi

from inspection import FilterOrder, ProfileFilter, filter_profile
from tests.inspection.profiles import Array

LENGTH, CUTOFF = 200.0, 8.0


def reference(count: int = 400) -> tuple[Array, Array]:
    """The reference signal: two waves and one spike at uneven stations."""
    i = np.arange(count)
    s = 200 * (i / 400 + 0.3 * np.sin(2 * np.pi * i / 400) / (2 * np.pi))
    return s, 0.02 * np.sin(6 * np.pi * s / 200 + 0.5) + 0.005 * np.sin(82 * np.pi * s / 200) + 0.03 * (i == 123)


def closed_filter(s: Array, z: Array, order: FilterOrder, robust: bool = False, at_mm: Array | None = None) -> Array:
    return filter_profile(s, z, LENGTH, True, ProfileFilter(CUTOFF, order, robust), at_mm=at_mm).waviness_mm


def uneven(count: int, ratio: float, beats: int) -> Array:
    """Stations on the closed profile whose spacing varies as `ratio` to 1, that many times around."""
    x, part = np.arange(count) / count, (ratio - 1) / (ratio + 1)
    return np.asarray(LENGTH * (x + part * np.sin(2 * np.pi * beats * x) / (2 * np.pi * beats)))


@pytest.mark.parametrize(
    ("order", "printed"),
    [
        (0, [0.009493281, 0.006122897, -0.000226120, -0.009493281, 0.008198812]),
        (2, [0.009585757, 0.005842723, 0.000063395, -0.009585757, 0.008567223]),
    ],
)
def test_reference_values_on_a_closed_profile(order: FilterOrder, printed: list[float]) -> None:
    found = closed_filter(*reference(), order, at_mm=np.array([0, 25, 61.5, 100, 199.5]))
    np.testing.assert_allclose(found, printed, rtol=0, atol=6e-10)


def test_reference_values_of_the_robust_filter() -> None:
    found = filter_profile(*reference(), LENGTH, True, ProfileFilter(CUTOFF, 2, robust=True))
    printed = [0.009584966, 0.014463928, 0.014882235, 0.015252561, -0.009584967]
    np.testing.assert_allclose(found.waviness_mm[[0, 122, 123, 124, 200]], printed, rtol=0, atol=6e-10)
    assert (found.weight[123], found.rounds, found.settled) == (0.0, 6, True)


@pytest.mark.parametrize(
    ("order", "printed"),
    [(0, [0.013933543, 0.017920412, -0.004328481]), (2, [0.013561058, 0.017634566, -0.003464278])],
)
def test_reference_values_on_an_open_profile(order: FilterOrder, printed: list[float]) -> None:
    s, z = reference(200)
    found = filter_profile(s, z, float(s[-1]), False, ProfileFilter(CUTOFF, order)).waviness_mm
    np.testing.assert_allclose(found[[0, 9, 198]], printed, rtol=0, atol=6e-10)


# By order and wavelength: the exact transmission, then the largest errors of a unit sine at even spacing and at spacings of 7.4 : 1,
# as printed; at random spacing twice what is printed, because the stations are others. Without arc weights the last two are 50 times more.
TRANSMISSION = {
    (0, 8): (0.5, 4.5e-8, 0.0018, 2 * 0.0055),
    (2, 8): (0.5, 3e-5, 0.0015, 2 * 0.0045),
    (0, 40): (0.972655, 7.5e-8, 0.0004, 2 * 0.0010),
    (2, 40): (0.997845, 2.5e-6, 2e-5, 2 * 6.5e-5),
    (0, 4): (0.0625, 8.5e-8, 0.0036, 2 * 0.016),
}


@pytest.mark.parametrize(("order", "wavelength"), TRANSMISSION)
def test_a_sine_passes_as_the_closed_form_says_at_any_spacing(order: FilterOrder, wavelength: int) -> None:
    share, even, at_7_to_1, at_random = TRANSMISSION[order, wavelength]
    assert ProfileFilter(CUTOFF, order).transmission(wavelength) == pytest.approx(share, abs=5e-7)
    spacings = {even: np.arange(2000) / 10, at_7_to_1: uneven(2000, 7.4, 25), at_random: random_stations()}
    for largest, s in spacings.items():
        wave = np.sin(2 * np.pi * s / wavelength)
        exact = ProfileFilter(CUTOFF, order).transmission(wavelength) * wave
        assert np.abs(closed_filter(s, wave, order) - exact).max() <= largest


def random_stations() -> Array:
    return np.sort(np.random.default_rng(5).uniform(0, LENGTH, 2000))


@pytest.mark.parametrize("order", [0, 2])
def test_the_seam_is_no_place(order: FilterOrder) -> None:
    s, z = reference()
    turned = np.argsort(np.mod(s + 77.7, LENGTH))
    found = closed_filter(np.mod(s + 77.7, LENGTH)[turned], z[turned], order)
    np.testing.assert_allclose(found, closed_filter(s, z, order)[turned], rtol=0, atol=5e-15)


def test_ends_of_an_open_profile() -> None:
    """Order 2 is right up to the ends for lines and parabolas; order 0 is off by what the kernel's half leans to one side."""
    s = np.arange(2001) / 10
    ends = {
        (name, order): filter_profile(s, z, LENGTH, False, ProfileFilter(CUTOFF, order)).waviness_mm[[0, -1]] - z[[0, -1]]
        for name, z in {"line": 0.01 * s, "parabola": 0.005 * np.square(s), "sine": np.sin(2 * np.pi * s / 16)}.items()
        for order in (0, 2)
    }
    assert np.abs(ends["line", 0]) == pytest.approx(0.012, abs=5e-4)
    assert np.abs(ends["line", 2]).max() < 5e-15
    assert np.abs(ends["parabola", 2]).max() < 2e-12  # of 200 mm
    z = np.log(2) * (CUTOFF / 16) ** 2
    assert ends["sine", 0][0] == pytest.approx(np.exp(-z) * erfi(np.sqrt(z)), abs=4e-4)  # the mean of a sine under half a Gaussian
    assert np.abs(ends["sine", 2]).max() < 0.1


def test_spikes_do_not_draw_the_robust_waviness() -> None:
    rng = np.random.default_rng(8)
    s = np.arange(1000) / 5
    wave = 0.02 * np.sin(6 * np.pi * s / LENGTH)
    spikes = rng.choice(1000, 30, replace=False)
    z = wave + rng.normal(0, 0.003, 1000)
    z[spikes] += rng.uniform(0.1, 0.5, 30) * rng.choice([-1, 1], 30)
    plain = filter_profile(s, z, LENGTH, True, ProfileFilter(CUTOFF, 2))
    robust = filter_profile(s, z, LENGTH, True, ProfileFilter(CUTOFF, 2, robust=True))
    rms = [1e3 * np.sqrt(np.square(found.waviness_mm - wave).mean()) for found in (plain, robust)]
    assert rms[0] > 6
    assert rms[1] < 0.8
    assert (robust.weight[spikes] == 0).all()
    assert (np.delete(robust.weight, spikes) == 0).mean() < 0.01


def test_a_profile_smoother_than_a_nanometre_has_no_spikes() -> None:
    s = np.arange(1000) / 5
    found = filter_profile(s, 0.02 * np.sin(2 * np.pi * s / 50), LENGTH, True, ProfileFilter(1.6, 2, robust=True))
    assert (found.settled, found.rounds) == (True, 2)
    assert found.weight.min() > 0.5


@pytest.mark.parametrize("robust", [False, True])
def test_order_and_dwelling_do_not_change_the_waviness(robust: bool) -> None:
    s, z = reference()
    mixed = np.random.default_rng(3).permutation(np.append(np.arange(400), [57] * 300))
    found = closed_filter(s[mixed], z[mixed], 2, robust)
    np.testing.assert_allclose(found, closed_filter(s, z, 2, robust)[mixed], rtol=0, atol=1e-15)


def test_there_is_no_value_in_a_gap_and_it_weighs_nothing() -> None:
    s, z = reference()
    kept = (s < 60) | (s > 80)
    at = np.array([59.0, 63.0, 66.0, 70.0, 74.0, 77.0])
    found = filter_profile(s, np.where(kept, z, np.nan), LENGTH, True, ProfileFilter(CUTOFF), at_mm=at)
    assert np.isnan(found.waviness_mm).tolist() == [False, False, True, True, True, False]
    assert (found.weight == kept).all()
    alone = filter_profile([50.0, 50.1], [0.1, 0.2], LENGTH, False, ProfileFilter(CUTOFF, 2), at_mm=[50.0, 53.0])
    assert np.isnan(alone.waviness_mm).all()  # two points determine no parabola


def test_nothing_passes_a_corner() -> None:
    s = np.arange(0.25, 200, 0.5)
    step = np.where((s > 40) & (s < 120), 1.0, 0.0)
    for closed, corners in ((True, [40.0, 120.0]), (False, [40.0, 120.0]), (True, [120.0, 40.0])):
        found = filter_profile(s, step, LENGTH, closed, ProfileFilter(CUTOFF, 0), corners)
        np.testing.assert_allclose(found.waviness_mm, step, rtol=0, atol=1e-14)
    seam = filter_profile(s, s / 200, LENGTH, True, ProfileFilter(CUTOFF, 2), [0.0])
    np.testing.assert_allclose(seam.waviness_mm, s / 200, rtol=0, atol=1e-14)


@pytest.mark.parametrize("cutoff", [60.0, 150.0, 200.0])
def test_a_cutoff_as_long_as_the_closed_profile_sees_its_images(cutoff: float) -> None:
    s = np.arange(800) / 4
    wave = np.cos(2 * np.pi * s / 200 + 0.3)
    for order in (0, 2):
        wanted = ProfileFilter(cutoff, order)
        found = filter_profile(s, wave, LENGTH, True, wanted).waviness_mm
        assert np.abs(found - wanted.transmission(200.0) * wave).max() < 6e-5


def test_the_work_grows_with_the_points_and_not_with_their_square() -> None:
    """At one spacing it is a window and a block a point; denser points are put together, and change the waviness by a share of 1e-4."""
    pairs = {}
    for count in (2_000, 20_000, 100_000):
        s = np.sort(np.random.default_rng(count).uniform(0, LENGTH, count))
        found = filter_profile(s, np.sin(2 * np.pi * s / CUTOFF), LENGTH, True, ProfileFilter(CUTOFF, 2))
        pairs[count] = found.pairs
        if count > 2_000:
            assert np.abs(found.waviness_mm - 0.5 * np.sin(2 * np.pi * s / CUTOFF)).max() < 2e-4
    assert pairs[100_000] <= 1.1 * pairs[20_000]
    assert pairs[20_000] <= 3.8 * 128**2 * 25  # nodes times nodes in a window and a block, however many the points
    longer = filter_profile(np.arange(8_000) / 10, np.zeros(8_000), 800.0, True, ProfileFilter(CUTOFF, 2))
    assert longer.pairs <= 297 * 8_000  # 240 neighbours in the window, 56 in the block


def test_what_no_filter_can_do_is_refused() -> None:
    with pytest.raises(ValueError, match=r"a cutoff of 250 mm is longer than the profile \(200 mm\)"):
        filter_profile([1.0], [0.0], LENGTH, True, ProfileFilter(250.0))
    with pytest.raises(ValueError, match="positive length"):
        ProfileFilter(0.0)
    with pytest.raises(ValueError, match="one shape"):
        filter_profile([1.0, 2.0], [0.0], LENGTH, True, ProfileFilter(8.0))
