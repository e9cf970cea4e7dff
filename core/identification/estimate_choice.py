"""What a fit identifies beside friction, and how far the description is trusted: chosen by held-out error.

A description that is right needs no identification, and one that lacks a tool, rotors or good inertials leaves what no
friction law explains. Which of them it is the motion tells: each candidate is fitted without a part of the data and
predicts that part. Parts are blocks of time, and whole logs where there are several. The simplest candidate within one
standard error of the best is taken (the one-standard-error rule: Breiman et al., Classification and Regression Trees,
1984, ch. 3), an error that stretches of five seconds tell, for neighbouring samples err alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import EstimateChoice, TriedEstimate
from collaudit.core.identification.identification_problem import Unknowns, residual, solve, terms_of
from collaudit.core.identification.identification_samples import Motion
from collaudit.core.identification.problem_terms import Terms
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Trust in the description that is tried where none is stated: standard deviation of its inertials, as a share.
WIDTHS = (0.2, 1.0, 5.0)
#: Gauss-Newton steps of a held-out fit; nearly all of the change is in the first.
HELD_OUT_STEPS = 3
#: An error counts as at most this many times the usual one: contact and stops choose nothing.
_MOST = 3.0
#: Seconds that err alike: a stroke, or a few of them.
_ALIKE = 5
#: Whole logs are held out where there are so many.
_FEWEST_LOGS = 2


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to fit.

    Attributes:
        estimate: what is identified beside friction; empty for friction on the description as it is.
        width: standard deviation of the described inertials, as a share of them.
    """

    estimate: tuple[str, ...]
    width: float

    @property
    def words(self) -> str:
        """What it identifies."""
        if "inertials" not in self.estimate:
            return ", ".join(("friction", *self.estimate))
        return f"{', '.join(('friction', *self.estimate))} (description ± {100 * self.width:g} %)"


def candidates_of(estimate: Sequence[str] | str, config: Config, with_gain: bool) -> tuple[Candidate, ...]:
    """What is tried, the simplest first.

    Args:
        estimate: as configured: ``auto``, or what is to be identified in any case.
        config: states how far the description is trusted, or leaves that to the data.
        with_gain: whether the scale of the effort is open to the data.
    """
    widths = WIDTHS if config.fit.cad_sd is None else (config.fit.cad_sd,)
    if estimate != "auto":
        stated = tuple(item for item in estimate if item != "friction")
        return tuple(Candidate(stated, w) for w in (widths if "inertials" in stated else widths[:1]))
    plain = [Candidate(part, widths[0]) for part in ((), ("rotor",), ("rotor", "tool"))]
    every = [*plain, *(Candidate(("inertials",), w) for w in widths)]
    return tuple([*every, *(replace(c, estimate=(*c.estimate, "gain")) for c in every)] if with_gain else every)


def choose_estimate(
    tried: Sequence[Candidate],
    motion: Motion,
    regressor: FloatArray,
    unknowns_of: Callable[[Candidate], Unknowns],
    joint_names: Sequence[str],
    blocks: int,
) -> tuple[Candidate, EstimateChoice]:
    """The simplest candidate within one standard error of the least held-out error, and what each leaves.

    Args:
        tried: the simplest first.
        motion, regressor: samples of the logs.
        unknowns_of: priors of a candidate.
        joint_names: of the columns.
        blocks: of time, held out in turn.
    """
    left = [
        held_out(terms_of(motion, regressor, unknowns), unknowns, parts)
        for unknowns in map(unknowns_of, tried)
        for parts in [_parts(motion, blocks)]
    ]
    rms = np.array([_rms(rest) for rest in left])
    usual = np.min(np.where(np.isfinite(rms), rms, np.inf), axis=0)
    loss = np.array([_by_cluster(rest, usual, motion.cluster // _ALIKE) for rest in left])
    best = int(np.argmin(loss.mean(axis=1)))
    worse = loss.mean(axis=1) - float(loss[best].mean())
    error = float(loss[best].std() / np.sqrt(loss.shape[1]))
    taken = int(np.flatnonzero(worse <= error)[0])
    facts = tuple(
        TriedEstimate(
            what=one.words,
            held_out_rms_nm={j: float(x) for j, x in zip(joint_names, row, strict=True) if np.isfinite(x)},
            worse=float(a),
        )
        for one, row, a in zip(tried, rms, worse, strict=True)
    )
    return tried[taken], EstimateChoice(tried[taken].words, error, facts)


def _parts(motion: Motion, blocks: int) -> list[IntArray]:
    """Numbers of the parts that samples belong to, one array (n,) a way to divide them."""
    logs = np.unique(motion.log).size
    return [motion.block, *([motion.log] if logs >= _FEWEST_LOGS else [])]


def held_out(terms: Terms, unknowns: Unknowns, divisions: Sequence[IntArray]) -> FloatArray:
    """(n, j) torque left of each sample by a fit without its part, N·m; root mean square over the divisions.

    Samples at which a joint does not count are NaN.
    """
    motion, steady = terms.motion, terms.without_drift()
    squares = np.zeros_like(motion.effort)
    for part in divisions:
        for number in np.unique(part):
            out = np.asarray(part == number)
            others = steady.over(replace(motion, moving=np.asarray(motion.moving & ~out[:, None])))
            rest = residual(others, solve(others, unknowns, HELD_OUT_STEPS))
            squares[out] += rest[out] ** 2
    return np.where(motion.moving, np.sqrt(squares / len(divisions)), np.nan)


def _rms(rest: FloatArray) -> FloatArray:
    """(j,) root mean square of what is known."""
    count = np.count_nonzero(np.isfinite(rest), axis=0)
    mean = np.nansum(rest**2, axis=0) / np.maximum(count, 1)
    return np.asarray(np.where(count > 0, np.sqrt(mean), np.nan))


def _by_cluster(rest: FloatArray, usual: FloatArray, cluster: IntArray) -> FloatArray:
    """(c,) mean over samples and joints of squared errors in units of the usual, of each cluster with any."""
    size = np.minimum(np.abs(rest) / np.maximum(usual, 1e-9), _MOST) ** 2
    known = np.isfinite(size)
    count = np.bincount(cluster, known.sum(axis=1))
    total = np.bincount(cluster, np.where(known, size, 0.0).sum(axis=1))
    return np.asarray(total[count > 0] / count[count > 0])
