"""Studies of a measuring system: one part measured again and again (type 1), and parts crossed with operators (gauge R&R by ANOVA).

Sources: AIAG, Measurement Systems Analysis, 4th edition 2010, chapter III section B and appendix A, for the crossed study; the type-1
study is that of VDA volume 5 and of Bosch booklet 10, whose share of the tolerance and number of standard deviations are arguments here,
since companies differ: 0.2 T over 6 s is the usual definition, 0.2 T over 4 s and 0.15 T over 6 s are others.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import f as f_distribution
from scipy.stats import t as t_distribution

from cmmlink.plant.crossed_anova import CrossedSums, Source, VarianceComponents, components_of, sums_of_squares

_USUAL_REPEATS = 25  # at least so many are asked of a type-1 study, better 50
ALPHA_TO_POOL = 0.25  # AIAG, appendix A: an interaction above this level is taken for noise
_CATEGORIES = 1.41  # AIAG prints the root of two so


@dataclass(frozen=True, slots=True)
class TypeOneStudy:
    """One part of known value, measured again and again under one roof.

    cg     : share of the tolerance over the spread: repeatability alone; None where it is not stated
    cgk    : the same with the bias; None where it is not stated
    bias   : mean less reference
    level  : of the test by Student that there is no bias; None where the values do not spread
    reason : why cg and cgk are not stated
    """

    cg: float | None
    cgk: float | None
    bias: float
    level: float | None
    mean: float
    sigma: float
    values: int
    notes: tuple[str, ...]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class AnovaLine:
    """A line of the analysis of variance. F and its level are None where nothing is tested."""

    source: str
    freedom: int
    sum_of_squares: float
    mean_square: float
    f: float | None = None
    level: float | None = None


@dataclass(frozen=True, slots=True)
class StudyLine:
    """A source of variation: its standard deviation and its shares. `to_tolerance` is 6 sigma over the tolerance; None without one.

    contribution : of the variance; the sources add up to one
    to_total     : of the standard deviation of all; the squares add up to one
    """

    source: str
    sigma: float
    contribution: float
    to_total: float
    to_tolerance: float | None


@dataclass(frozen=True, slots=True)
class CrossedStudy:
    """A gauge R&R study.

    anova      : the analysis with the interaction
    pooled     : whether the interaction was taken for noise, so that the components come from the analysis without it
    lines      : repeatability (EV), operator, interaction, reproducibility (AV), gauge R&R, part (PV), total (TV)
    freedom    : degrees of freedom of the repeatability
    categories : ndc, how many groups of parts the gauge tells apart
    notes      : what was assumed, in whole sentences
    """

    anova: tuple[AnovaLine, ...]
    pooled: bool
    lines: tuple[StudyLine, ...]
    freedom: int
    categories: int
    notes: tuple[str, ...]

    def line(self, source: str) -> StudyLine:
        """The line of a source by its name."""
        return next(line for line in self.lines if line.source == source)


@dataclass(frozen=True, slots=True, eq=False)
class StationStudy:
    """A gauge R&R study at every station of a profile; all fields are (s,) standard deviations, nan where a scan has a gap.

    pooled : (s,) whether the interaction was taken for noise there
    """

    repeatability: NDArray[np.float64]
    reproducibility: NDArray[np.float64]
    gauge: NDArray[np.float64]
    part: NDArray[np.float64]
    pooled: NDArray[np.bool_]


def type_one_study(
    values: ArrayLike, reference: float, tolerance: float, *, share: float = 0.2, spread_sigmas: float = 6.0
) -> TypeOneStudy:
    """Cg and Cgk of repeated measurements of one part.

    values        : (n,) all finite: a repeat that failed is a finding about the gauge, and the study is repeated
    reference     : value of the part from a better measurement
    tolerance     : width of the zone of the characteristic
    share         : of the tolerance that the gauge may use
    spread_sigmas : how many standard deviations count as its spread
    """
    measured = _finite(values, 1)
    if len(measured) < 2:
        raise ValueError(f"a type-1 study needs at least 2 repeats, and there are {len(measured)}")
    if not (tolerance > 0 and 0 < share <= 1 and spread_sigmas > 0):
        raise ValueError(f"tolerance {tolerance}, share {share} and spread {spread_sigmas} have to be positive, and the share at most 1")
    n, mean, sigma = len(measured), float(measured.mean()), float(measured.std(ddof=1))
    bias = mean - reference
    notes = [f"Cg is {share:g} T over {spread_sigmas:g} s, and Cgk is half of each after the bias was taken off."]
    if n < _USUAL_REPEATS:
        notes.append(f"The study has {n} repeats; at least {_USUAL_REPEATS} are usual.")
    if not np.ptp(measured):
        reason = "all values are equal, so that their resolution is too coarse to show the spread of the gauge"
        return TypeOneStudy(None, None, bias, None, mean, 0.0, n, tuple(notes), reason)
    cg = share * tolerance / (spread_sigmas * sigma)
    cgk = (share * tolerance / 2 - abs(bias)) / (spread_sigmas / 2 * sigma)
    level = float(2 * t_distribution.sf(abs(bias) / (sigma / math.sqrt(n)), n - 1))
    return TypeOneStudy(cg, cgk, bias, level, mean, sigma, n, tuple(notes))


def crossed_study(values: ArrayLike, tolerance: float | None = None, *, alpha: float = ALPHA_TO_POOL) -> CrossedStudy:
    """Gauge R&R of one characteristic.

    values    : (p, o, r) p parts, each measured r times by each of o operators; p, o and r at least 2, all finite: a cell that lacks a
                repeat would weigh as if it were whole
    tolerance : width of the zone of the characteristic; None: nothing is set in relation to it
    alpha     : level above which the interaction is pooled with the repeatability
    """
    measured = _crossed(values, 3, alpha)
    if tolerance is not None and not tolerance > 0:
        raise ValueError(f"the tolerance has to be positive, and is {tolerance}")
    if not np.ptp(measured, axis=2).any():
        raise ValueError("no repeat of the study differs from another: the resolution is too coarse to show the spread of the gauge")
    sums = sums_of_squares(measured)
    level = float(_interaction_level(sums))
    pooled = level > alpha
    components = components_of(sums, np.asarray(pooled))
    freedom = sums.freedom["repeatability"] + (sums.freedom["interaction"] if pooled else 0)
    notes = _notes(components, level, alpha, pooled)
    return CrossedStudy(_anova(sums, level), pooled, _study_lines(components, tolerance), freedom, _categories(components), notes)


def station_study(values: ArrayLike, *, alpha: float = ALPHA_TO_POOL) -> StationStudy:
    """Gauge R&R of the deviation at every station of a profile.

    values : (p, o, r, s) deviations at s stations that are common to all scans; nan where a scan has none. A station where any scan has
             none is nan in all results: fewer repeats would look like a better gauge.
    """
    measured = _crossed(values, 4, alpha, with_gaps=True)
    sums = sums_of_squares(measured)
    pooled = _interaction_level(sums) > alpha
    found = components_of(sums, pooled)
    return StationStudy(np.sqrt(found.repeatability), np.sqrt(found.reproducibility), np.sqrt(found.gauge), np.sqrt(found.part), pooled)


def _finite(values: ArrayLike, dimensions: int, with_gaps: bool = False) -> NDArray[np.float64]:
    """The values of a study."""
    measured = np.array(values, dtype=np.float64)
    if measured.ndim != dimensions:
        raise ValueError(f"the values of this study have {dimensions} dimensions, and {measured.ndim} were given")
    missing = np.isinf(measured) if with_gaps else ~np.isfinite(measured)
    if missing.any():
        raise ValueError(f"the study lacks a value at {tuple(np.argwhere(missing)[0].tolist())}: repeat that measurement")
    return measured


def _crossed(values: ArrayLike, dimensions: int, alpha: float, with_gaps: bool = False) -> NDArray[np.float64]:
    """The values of a crossed study, whose three first dimensions are parts, operators and repeats."""
    measured = _finite(values, dimensions, with_gaps)
    if min(measured.shape[:3]) < 2:
        raise ValueError(f"a crossed study needs at least 2 parts, 2 operators and 2 repeats, and has {measured.shape[:3]}")
    if not 0 <= alpha <= 1:
        raise ValueError(f"the level alpha has to lie between 0 and 1, and is {alpha}")
    return measured


def _interaction_level(sums: CrossedSums) -> NDArray[np.float64]:
    """The level of the test that operators differ alike on all parts; 1 where there is no interaction, and where nothing spreads."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = sums.mean_square("interaction") / sums.mean_square("repeatability")
    level = f_distribution.sf(np.nan_to_num(ratio, posinf=np.inf), sums.freedom["interaction"], sums.freedom["repeatability"])
    return np.asarray(level, dtype=np.float64)


def _anova(sums: CrossedSums, level: float) -> tuple[AnovaLine, ...]:
    """The analysis with the interaction: parts and operators against it, itself against the repeatability."""
    square = {source: float(sums.mean_square(source)) for source in sums.freedom}
    inner, repeat = square["interaction"], square["repeatability"]

    def tested(source: Source) -> AnovaLine:
        ratio = square[source] / inner if inner else math.inf
        beyond = float(f_distribution.sf(ratio, sums.freedom[source], sums.freedom["interaction"]))
        return AnovaLine(source, sums.freedom[source], float(sums.squares[source]), square[source], ratio, beyond)

    return (
        tested("part"),
        tested("operator"),
        AnovaLine("interaction", sums.freedom["interaction"], float(sums.squares["interaction"]), inner, inner / repeat, level),
        AnovaLine("repeatability", sums.freedom["repeatability"], float(sums.squares["repeatability"]), repeat),
    )


def _study_lines(found: VarianceComponents, tolerance: float | None) -> tuple[StudyLine, ...]:
    """All sources with their shares."""
    variances = {
        "repeatability": found.repeatability,
        "operator": found.operator,
        "interaction": found.interaction,
        "reproducibility": found.reproducibility,
        "gauge R&R": found.gauge,
        "part": found.part,
        "total": found.total,
    }
    total = float(found.total)
    lines = []
    for source, variance in variances.items():
        sigma = math.sqrt(float(variance))
        to_tolerance = None if tolerance is None else 6 * sigma / tolerance
        lines.append(StudyLine(source, sigma, float(variance) / total, sigma / math.sqrt(total), to_tolerance))
    return tuple(lines)


def _categories(found: VarianceComponents) -> int:
    """The number of distinct categories, cut to a whole number and at least one."""
    return max(1, int(_CATEGORIES * math.sqrt(float(found.part) / float(found.gauge))))


def _notes(found: VarianceComponents, level: float, alpha: float, pooled: bool) -> tuple[str, ...]:
    """What stands beside the study."""
    does = "was pooled with the repeatability, since its level lies above" if pooled else "was kept, since its level does not lie above"
    notes = [f"The interaction of parts and operators has the level {level:.3f}; it {does} {alpha:g}."]
    notes += [f"The variance of the source {source} came out negative and counts as zero." for source in found.cut]
    return tuple(notes)
