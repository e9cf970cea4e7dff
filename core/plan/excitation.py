"""An exciting trajectory: moves between poses, each the one that tells most for its time of what is not known yet.

The joint torques are linear in inertial parameters, rotor inertias, gains' errors and friction that goes with the load;
friction of its own and an offset stand beside them, without a prior, as in the identification
(``identification/problem/nuisance.py``). The information of samples is Phi^T Phi / s²; the determinant of the unknowns'
covariance is made small (D-optimal: Atkinson, Donev and Tobias, Optimum Experimental Designs, 2007), given
what earlier logs determine. Poses are chosen one after the other out of random ones, so that every move can be checked
against all limits before it is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.plan.timing import Motion, MoveCheck, move
from collaudit.core.plan.unknowns import Unknowns

#: Between samples that count as independent: errors of a model and of a gear last about so long.
INDEPENDENT_S = 0.2
_SAMPLE_S = 0.05
PAUSE_S = 0.1
_TRIED = 24
_STUCK = 8  # rounds without any free move, after which the search ends


@dataclass(frozen=True, slots=True, eq=False)
class Excitation:
    """Moves, and the information (m, m) of all unknowns and of friction beside them."""

    moves: tuple[Motion, ...]
    information: FloatArray


def excite(check: MoveCheck, unknowns: Unknowns, joints: IntArray, seconds: float, seed: int = 0) -> Excitation:
    """Choose moves from the start and back to it.

    Args:
        check: limits of the arm.
        unknowns: what is not known, and how well it is.
        joints: numbers of those that may move.
        seconds: of all moves at most, pauses included.
        seed: of the poses that are tried.
    """
    rng, limits = np.random.default_rng(seed), check.limits
    information = unknowns.prior()
    moves: list[Motion] = []
    at, left, stuck = limits.start, seconds, 0
    while stuck < _STUCK:
        tried = _tried(check, unknowns, information, at, left, (joints, rng))
        if not tried:  # no time left
            break
        taken = next((one for one in tried if check.problem(*one[:2]) is None), None)
        if taken is None:
            stuck += 1
            continue
        there, _, added = taken
        stuck, at = 0, there.q[-1]
        moves.append(there)
        information = information + added
        left -= there.duration_s + PAUSE_S
    if moves:
        moves.append(move(limits, at, limits.start))
        information = information + information_of(check, unknowns, moves[-1])
    return Excitation(tuple(moves), information)


def _tried(
    check: MoveCheck, unknowns: Unknowns, information: FloatArray, at: FloatArray, left: float,
    chance: tuple[IntArray, np.random.Generator],
) -> list[tuple[Motion, Motion, FloatArray]]:  # fmt: skip
    """Random moves that leave time for the way home from their ends, what they tell; the best for their time first."""
    limits, before, found = check.limits, unknowns.criterion(information), []
    for _ in range(_TRIED):
        goal = _pose(at, limits.low, limits.high, *chance)
        there = move(limits, at, goal)
        cost = there.duration_s + PAUSE_S
        if cost > left:
            continue
        home = move(limits, goal, limits.start)
        if cost + home.duration_s + PAUSE_S <= left:
            added = information_of(check, unknowns, there)
            found.append(((unknowns.criterion(information + added) - before) / cost, (there, home, added)))
    return [one for _, one in sorted(found, key=lambda pair: -pair[0])]


def information_of(check: MoveCheck, unknowns: Unknowns, motion: Motion) -> FloatArray:
    """(m, m) information of a motion's samples on all unknowns and on friction and offset of every joint."""
    _, q, v, a = motion.sampled(_SAMPLE_S)
    return unknowns.information(check.robot, q, v, a, _SAMPLE_S / INDEPENDENT_S)


def _pose(at: FloatArray, low: FloatArray, high: FloatArray, joints: IntArray, rng: np.random.Generator) -> FloatArray:
    """A random pose; some joints may stay where they are, and ranges beyond a turn are not all used."""
    goal = at.copy()
    moved = joints[rng.random(joints.size) < rng.choice([0.5, 1.0])]
    moved = moved if moved.size else joints
    middle, half = 0.5 * (low + high), np.minimum(0.5 * (high - low), 0.5 * np.pi)
    goal[moved] = np.clip(rng.uniform(middle - half, middle + half), low, high)[moved]
    return goal
