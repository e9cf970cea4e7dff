"""The tail of one joint's peaks: where it begins, whether the law fits, how far its counts scatter and drift.

The law is fitted to the squares of the peaks. A residual is a sum of many errors, each bounded or Gaussian, and the
squares of such peaks have an exponential tail or a lighter one; an exponential tail of the peaks themselves
would double thresholds that rest on minutes. Where the squares show a heavier tail, the law follows them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.special import stdtr as student_share
from scipy.special import stdtrit as student_quantile

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.recommend.sustained_levels import SustainedPeaks
from collaudit.core.recommend.tail_likelihood import TailLikelihood, tail_likelihood

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


def fit_tail(peaks: SustainedPeaks, tested: bool = True) -> JointTail | None:
    """The tail of a joint's peaks; None where they are too few, or do not differ.

    Args:
        peaks: of the joint.
        tested: whether the law is tested, and the tail begins where it fits; otherwise it is a twentieth of the peaks.
    """
    count = peaks.level_nm.size
    if count < 2 * _FEWEST or peaks.hours <= 0:
        return None
    squares = peaks.level_nm**2
    order = np.sort(squares)[::-1]
    if order[0] <= order[_FEWEST]:
        return None
    k, fit_p = _tail_count(order) if tested else (int(np.clip(order.size // 20, _FEWEST, _MOST)), float("nan"))
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
    quantile = _quantile(groups)
    known = int(np.count_nonzero(log_hours))
    counts *= _skewed(window, peaks.window_hours, quantile)
    likelihood = tail_likelihood(excess, level, peaks.hours, (counts, sizes), quantile)
    return JointTail(likelihood, quantile, fit_p, minutes, logs, _drift(peaks), sqrt(order[0]), peaks.hours, known)


def _quantile(groups: int) -> float:
    """Student's quantile: a scatter known from few groups is itself uncertain."""
    return float(student_quantile(max(_LEAST_FREEDOM, groups - 1), _CONFIDENCE))


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
