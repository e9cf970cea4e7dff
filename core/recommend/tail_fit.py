"""The tail of one joint's peaks: where it begins, whether the law fits, how far its counts scatter and drift.

The law is fitted to the squares of the peaks. A residual is a sum of many errors, each bounded or Gaussian, and the
squares of such peaks have an exponential tail or a lighter one; an exponential tail of the peaks themselves
would double thresholds that rest on minutes. Where the squares show a heavier tail, the law follows them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.special import boxcox, inv_boxcox
from scipy.special import stdtr as student_share
from scipy.special import stdtrit as student_quantile

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.recommend.sustained_levels import SustainedPeaks

#: Shares of the peaks that may be the tail; the largest that the law fits is taken.
_SHARES = (0.1, 0.05, 0.025, 0.0125)
#: A tail of fewer peaks than this has no shape; more than this many bring in what is no tail.
_FEWEST, _MOST = 20, 500
_FITS = 0.1
_DRAWS = 100
#: Fewer windows or logs than this do not tell how far counts scatter; fewer than four are never asked how surely.
_FEWEST_WINDOWS, _FEWEST_LOGS = 3, 3
_LEAST_FREEDOM = 3
#: Counts that scatter more than this differ for a reason, and that may be the log.
_CROWDED = 1.5
#: One-sided 95 %.
_CONFIDENCE = 0.95
#: Chance of a drift that is none.
_DRIFT_P = 5e-3
#: Less change than this is no drift worth a word.
_DRIFT_LEAST = 0.1
#: … and between a few logs, whose levels differ from day to day.
_DAYS_DIFFER = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class JointTail:
    """The tail of one joint.

    Attributes:
        likelihood: rate, scale and shape of the squares, with their bounds; levels are squares, (N·m)².
        quantile: of the signed root of the deviance for one-sided 95 %; Student's where few logs tell the scatter.
        fit_p: chance of a worse fit of the law, Anderson and Darling's statistic; low: the law does not fit.
        dispersion_minutes, dispersion_logs: variance of the counts over their mean, between minutes and between logs;
            None where there are too few of them.
        drift: ratio of the latest third's level of peaks to the first third's, where they differ by more than chance.
        largest_nm: the largest level seen.
        hours: clean time behind it all.
        logs: number of logs it was seen in.
    """

    likelihood: TailLikelihood
    quantile: float
    fit_p: float
    dispersion_minutes: float | None
    dispersion_logs: float | None
    drift: float | None
    largest_nm: float
    hours: float
    logs: int

    def rate_bound(self, gamma_nm: float) -> float:
        """At 95 % confidence no more alarms an hour than this; the bound at the tail's beginning below that."""
        return self.likelihood.rate_bound(max(gamma_nm, self.begins_nm) ** 2, self.quantile)

    def rate_at(self, gamma_nm: float) -> float:
        """The likeliest rate of alarms, 1/h, above the tail's beginning."""
        return self.likelihood.rate_at(gamma_nm**2)

    def level_bound(self, rate_per_hour: float, times: float = 1.0) -> float:
        """The level that at 95 % confidence is passed no more often, N·m; of so many times the hours."""
        return sqrt(self.likelihood.level_bound(rate_per_hour, self.quantile, times))

    def least_level(self, rate_per_hour: float) -> float:
        """The level that at 95 % confidence is passed at least that often, N·m; the tail's beginning at least."""
        return sqrt(self.likelihood.least_level(rate_per_hour, self.quantile))

    @property
    def begins_nm(self) -> float:
        """The level that the tail begins at."""
        return sqrt(self.likelihood.level)


def fit_tail(peaks: SustainedPeaks) -> JointTail | None:
    """The tail of a joint's peaks, from where the law fits; None where they are too few, or do not differ."""
    count = peaks.level_nm.size
    if count < 2 * _FEWEST or peaks.hours <= 0:
        return None
    squares = peaks.level_nm**2
    order = np.sort(squares)[::-1]
    if order[0] <= order[_FEWEST]:
        return None
    k, fit_p = _tail_count(order)
    level = float(order[k])
    over = squares > level
    excess, window = squares[over] - level, peaks.window[over]
    log = peaks.log_of_window[window]
    log_hours: FloatArray = np.bincount(peaks.log_of_window, weights=peaks.window_hours).astype(np.float64)
    minutes = _dispersion(window, peaks.window_hours, _FEWEST_WINDOWS)
    logs = _dispersion(log, log_hours, _FEWEST_LOGS)
    counts = max(1.0, minutes or 1.0, logs or 1.0)
    sizes = max(1.0, _size_dispersion(excess, window), _size_dispersion(excess, log) if logs is not None else 1.0)
    by_log = logs is not None and counts > _CROWDED
    groups = int(np.count_nonzero(log_hours if by_log else peaks.window_hours)) if counts > 1.0 else excess.size
    # Student's: a scatter known from few groups is itself uncertain
    quantile = float(student_quantile(max(_LEAST_FREEDOM, groups - 1), _CONFIDENCE))
    known = int(np.count_nonzero(log_hours))
    counts *= _skewed(window, peaks.window_hours, quantile)
    likelihood = tail_likelihood(excess, level, peaks.hours, (counts, sizes), quantile)
    return JointTail(likelihood, quantile, fit_p, minutes, logs, _drift(peaks), sqrt(order[0]), peaks.hours, known)


def _dispersion(owner: IntArray, hours: FloatArray, fewest: int) -> float | None:
    """Variance of counts over their mean, Pearson's statistic over its degrees of freedom."""
    if hours.size < fewest or owner.size == 0:
        return None
    counts = np.bincount(owner, minlength=hours.size)
    expected = owner.size * hours / hours.sum()
    used = expected > 0
    if np.count_nonzero(used) < fewest:
        return None
    return float(np.sum((counts[used] - expected[used]) ** 2 / expected[used]) / (np.count_nonzero(used) - 1))


def _skewed(owner: IntArray, hours: FloatArray, quantile: float) -> float:
    """By how much a dispersion grows since a few minutes have most of the peaks: the mean of such counts is bounded
    too low by Student's quantile q. It grows by skewness (1 + 2 q²) / (6 sqrt(minutes)) (Johnson 1978; Hall 1992).
    """
    rates = np.bincount(owner, minlength=hours.size)[hours > 0] / hours[hours > 0]
    spread = float(rates.std())
    if rates.size < _FEWEST_WINDOWS or spread <= 0:
        return 1.0
    skewness = max(0.0, float(np.mean((rates - rates.mean()) ** 3)) / spread**3)
    return (1.0 + skewness * (1.0 + 2.0 * quantile**2) / (6.0 * sqrt(rates.size)) / quantile) ** 2


def _size_dispersion(excess: FloatArray, owner: IntArray) -> float:
    """How much more the sums of the sizes scatter between groups than independent sizes would; 1 with one group."""
    centred = excess - excess.mean()
    sums, sizes = np.bincount(owner, weights=centred), np.bincount(owner)
    groups = int(np.count_nonzero(sizes))
    if groups < 2:
        return 1.0
    return float(np.sum(sums**2) / np.sum(centred**2) * groups / (groups - 1))


def _tail_count(order: FloatArray) -> tuple[int, float]:
    """How many of the peaks (falling) are the tail, and the chance of a worse fit there."""
    best = (0, -1.0)
    for share in _SHARES:
        k = int(np.clip(share * order.size, _FEWEST, _MOST))
        if best[0] == k:
            continue
        p = _fit_chance(order[:k] - order[k])
        if p >= _FITS:
            return k, p
        if p > best[1]:
            best = (k, p)
    return best


def _moments_fit(excess: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Shape and scale of (m, k) rising excesses by probability-weighted moments (Hosking and Wallis 1987)."""
    k = excess.shape[1]
    weights = (k - np.arange(k) - 1.0) / (k - 1.0)
    first, second = excess.mean(axis=1), (excess * weights).mean(axis=1)
    gap = first - 2.0 * second
    gap = np.where(np.abs(gap) < 1e-12 * first, 1e-12 * first, gap)
    return np.asarray(2.0 - first / gap), np.asarray(2.0 * first * second / gap)


def _anderson_darling(excess: FloatArray, shape: FloatArray, scale: FloatArray) -> FloatArray:
    """(m,) A² of (m, k) rising excesses against their generalised Pareto laws."""
    k = excess.shape[1]
    shape = np.where(np.abs(shape) < 1e-9, 1e-9, shape)[:, None]
    inner = np.maximum(1.0 + shape * excess / scale[:, None], 1e-300)
    left = np.clip(inner ** (-1.0 / shape), 1e-12, 1.0 - 1e-12)
    weights = 2.0 * np.arange(1, k + 1) - 1.0
    return np.asarray(-k - (weights * (np.log1p(-left) + np.log(left[:, ::-1]))).mean(axis=1))


def _fit_chance(excess: FloatArray) -> float:
    """Chance of a worse fit if the law holds, from draws of it fitted in the same way (a parametric bootstrap)."""
    rising = np.sort(excess)[None, :]
    shape, scale = _moments_fit(rising)
    found = _anderson_darling(rising, shape, scale)[0]
    rng = np.random.default_rng(excess.size)
    xi = float(np.clip(shape[0], -0.9, 0.45)) or 1e-9
    draws = np.sort((rng.random((_DRAWS, excess.size)) ** -xi - 1.0) / xi, axis=1)
    return float(np.mean(_anderson_darling(draws, *_moments_fit(draws)) >= found))


def _drift(peaks: SustainedPeaks) -> float | None:
    """Level of the last third of the time over the first's, where they differ by more than chance, and enough.

    The units that scatter by chance are logs where there are enough of them, and minutes otherwise; between a few logs
    a drift and another day look the same, and less change than that between days is not called one.
    """
    medians = np.array([median_of(x) if x.size else np.nan for x in _by_window(peaks, peaks.window_hours.size)])
    with np.errstate(divide="ignore"):
        size = np.log(medians)
    known = np.isfinite(size)
    size, owner = size[known], peaks.log_of_window[known]
    count = int(owner.max(initial=0)) + 1
    if count >= 3 * _FEWEST_WINDOWS:
        size = np.array([size[owner == k].mean() for k in np.unique(owner)])
    third, least = size.size // 3, _DRIFT_LEAST if count == 1 or count >= 3 * _FEWEST_WINDOWS else _DAYS_DIFFER
    early, late = size[:third], size[size.size - third :]
    if early.size < _FEWEST_WINDOWS:
        return None
    change = float(late.mean() - early.mean())
    variance = float(early.var(ddof=1) / early.size + late.var(ddof=1) / late.size)
    p = 2.0 * float(student_share(early.size + late.size - 2, -abs(change) / np.sqrt(max(variance, 1e-12))))
    return float(np.exp(change)) if p < _DRIFT_P and abs(change) > least else None


def _by_window(peaks: SustainedPeaks, windows: int) -> list[FloatArray]:
    order = np.argsort(peaks.window, kind="stable")
    edges = np.searchsorted(peaks.window[order], np.arange(1, windows))
    return list(np.split(peaks.level_nm[order], edges))


#: What is believed of the shape before data. Minutes of data leave +-0.2 open, which for rare alarms is a factor of
#: several. So the shape is at most 0, the exponential law, unless the peaks themselves show a heavier tail.
SHAPE_MEAN, SHAPE_SD = 0.0, 0.1
#: Deviance by which a heavier tail must fit better: one-sided 95 %.
_HEAVIER = 2.71
_SHAPES = np.linspace(-0.5, 0.5, 51)
_SCALES = 81
_TINY = 1e-9
#: x and x - 1 - ln x, for the largest rate of a Poisson process that a deviance leaves room for.
_RATIO = 1.0 + np.geomspace(1e-6, 1e3, 4000)
_ROOM = _RATIO - 1.0 - np.log(_RATIO)


@dataclass(frozen=True, slots=True, eq=False)
class TailLikelihood:
    """Rate and level of the peaks of one joint, with bounds.

    Attributes:
        level: u.
        scale, shape: sigma and xi at the largest likelihood.
        rate_per_hour: lambda there.
        peaks: number of them.
        heavy: whether the peaks show a tail heavier than exponential.
        count_dispersion: what the deviance of the count is divided by, 1 at least.
        scales, shapes, deviance: (g,) points of the grid and how much less likely they are, dispersion included.
    """

    level: float
    scale: float
    shape: float
    rate_per_hour: float
    peaks: int
    heavy: bool
    count_dispersion: float
    scales: FloatArray
    shapes: FloatArray
    deviance: FloatArray

    def rate_at(self, gamma: float) -> float:
        """The likeliest rate of peaks above a level at or over u, 1/h."""
        left = _survival(np.array([self.shape]), np.array([self.scale]), gamma - self.level)
        return self.rate_per_hour * float(left[0])

    def rate_bound(self, gamma: float, quantile: float) -> float:
        """With a confidence no more peaks an hour than this lie above a level at or over u.

        Args:
            gamma: the level.
            quantile: of the signed root of the deviance, 1.645 for one-sided 95 %.
        """
        rates, inside = self._rates(quantile)
        left = _survival(self.shapes[inside], self.scales[inside], gamma - self.level)
        return float(np.max(rates * left))

    def level_bound(self, rate_per_hour: float, quantile: float, times: float = 1.0) -> float:
        """The level that with a confidence is passed no more often than this; u at least.

        Args:
            rate_per_hour: the rate.
            quantile: as of :meth:`rate_bound`.
            times: the bound as it would be of so many times the hours, if they continue as these do.
        """
        rates, inside = self._rates(quantile, times)
        return float(np.max(_level(self.shapes[inside], self.scales[inside], rates / rate_per_hour))) + self.level

    def least_level(self, rate_per_hour: float, quantile: float) -> float:
        """The level that with a confidence is passed at least that often; u at least."""
        inside = self.deviance <= quantile**2
        ratio = np.full(int(np.count_nonzero(inside)), self.rate_per_hour / rate_per_hour)
        return float(np.min(_level(self.shapes[inside], self.scales[inside], ratio))) + self.level

    def shape_interval(self, quantile: float) -> tuple[float, float]:
        """Shapes that the deviance leaves room for."""
        inside = self.deviance <= quantile**2
        return float(self.shapes[inside].min()), float(self.shapes[inside].max())

    def _rates(self, quantile: float, times: float = 1.0) -> tuple[FloatArray, np.ndarray]:
        """For the points of the grid inside the bound: the largest lambda there, and which points they are."""
        room = quantile**2 / times - self.deviance
        inside = np.flatnonzero(room >= 0.0)
        ratio = np.interp(self.count_dispersion * room[inside] / (2.0 * self.peaks), _ROOM, _RATIO, left=1.0)
        return self.rate_per_hour * ratio, inside


def tail_likelihood(
    excess: FloatArray, level: float, hours: float, dispersion: tuple[float, float], quantile: float = 3.0
) -> TailLikelihood:
    """The likelihood of a tail.

    Args:
        excess: (k,) how far the peaks exceed u, above 0.
        level: u.
        hours: time they were seen in.
        dispersion: of the counts and of the sizes, 1 at least.
        quantile: the largest that bounds will be asked for; the grid reaches so far.
    """
    k = excess.size
    mean = float(np.mean(excess))
    reach = min(3.0, 1.5 * quantile * float(np.sqrt(dispersion[1] * 2.0 / k)) + 0.2)
    spread = np.exp(np.linspace(-reach, reach, _SCALES))
    shapes = np.repeat(_SHAPES, _SCALES)
    # Where the shape is negative the law ends at sigma / -xi, beyond the largest peak.
    least = np.where(shapes < 0, -shapes * float(np.max(excess)) * (1 + _TINY), 0.0)
    scales = np.maximum(np.outer(mean * (1.0 - _SHAPES).clip(0.4), spread).ravel(), least)
    likelihood = _log_likelihood(excess, shapes, scales) / dispersion[1] - 0.5 * ((shapes - SHAPE_MEAN) / SHAPE_SD) ** 2
    light = shapes <= _TINY
    heavy_tail = 2.0 * (np.max(likelihood) - np.max(likelihood[light])) > _HEAVIER
    if not heavy_tail:
        shapes, scales, likelihood = shapes[light], scales[light], likelihood[light]
    best = int(np.argmax(likelihood))
    deviance = 2.0 * (likelihood[best] - likelihood)
    return TailLikelihood(
        level,
        float(scales[best]),
        float(shapes[best]),
        k / hours,
        k,
        bool(heavy_tail),
        dispersion[0],
        scales,
        shapes,
        np.asarray(deviance, dtype=np.float64),
    )


def _log_likelihood(excess: FloatArray, shapes: FloatArray, scales: FloatArray) -> FloatArray:
    """(g,) of the generalised Pareto law at each point."""
    out = np.empty(shapes.size)
    for part in np.array_split(np.arange(shapes.size), max(1, shapes.size * excess.size // 1_000_000)):
        xi, sigma = shapes[part], scales[part]
        rarity = np.log(inv_boxcox(excess[None, :] / sigma[:, None], xi[:, None])).sum(axis=1)
        out[part] = -excess.size * np.log(sigma) - (1.0 + xi) * rarity
    return out


def _survival(shapes: FloatArray, scales: FloatArray, excess: float) -> FloatArray:
    """(g,) share of peaks that exceed u by more than ``excess``: (1 + xi x / sigma)^(-1 / xi), exp(-x / sigma) at 0."""
    end = -1.0 / np.minimum(shapes, -_TINY)  # in scales, where the shape is negative
    return np.asarray(1.0 / inv_boxcox(np.minimum(max(0.0, excess) / scales, end), shapes))


def _level(shapes: FloatArray, scales: FloatArray, ratio: FloatArray) -> FloatArray:
    """(g,) excess over u that is passed once in ``ratio`` peaks: sigma (ratio^xi - 1) / xi; 0 for a ratio below one."""
    return np.asarray(scales * boxcox(np.maximum(ratio, 1.0), shapes))
