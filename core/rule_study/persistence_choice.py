"""Choosing the persistence: of those whose thresholds the evidence supports, the one that notices the least force."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.rule_study_result import PersistenceChoice
from collaudit.core.rule_study.arm_contacts import AddedContacts

#: Persistences that are compared, s; the one that is set is among them.
_PERSISTENCES_S = (0.004, 0.008, 0.012, 0.02, 0.03, 0.05, 0.1)
#: A persistence is chosen over the one that is set only where it gains as much.
_WORTH = 0.97
#: Of the contacts every third: the comparison is between persistences, on the same contacts.
_EVERY = 3
#: Persistences closer than this are the same.
_SAME_S = 1e-9


def compared_persistences(
    added: Sequence[AddedContacts],
    joints: Sequence[str],
    set_n: int,
    gammas_at: Callable[[int], Mapping[str, float | None]],
    longest_delay_s: float | None,
) -> tuple[PersistenceChoice, ...]:
    """Persistences with their thresholds and what these notice; one of them is chosen.

    All shapes count alike: a knock asks for a short persistence, and a short one for a high threshold.

    Args:
        added: contacts, one entry a shape.
        joints: the watched joints.
        set_n: the persistence that is set.
        gammas_at: thresholds that the evidence supports at a persistence; None where it supports none.
        longest_delay_s: a persistence at which a push takes longer to be noticed is not chosen.
    """
    if not added or not joints:
        return ()
    found = []
    for n in sorted({set_n, *(max(1, round(p / added[0].period_s)) for p in _PERSISTENCES_S)}):
        gammas = gammas_at(n)
        known = {joint: gamma for joint in joints if (gamma := gammas.get(joint)) is not None}
        if len(known) == len(joints):
            found.append(_noticed(added, known, n))
    return chosen_of(found, set_n, longest_delay_s)


def pooled_choices(
    logs: Sequence[Sequence[PersistenceChoice]],
    set_n: int,
    longest_delay_s: float | None = None,
    longest_s: float | None = None,
) -> tuple[PersistenceChoice, ...]:
    """Persistences that several logs were studied at, with what they notice over all of them; one is chosen.

    Forces are geometric means over the logs, delays the longest of any log. Thresholds are those of the last log: what
    all logs together support is for the recommendation to say.

    Args:
        logs: choices of the study of each log; logs without any are left out.
        set_n: the persistence that is set.
        longest_delay_s: as of :func:`compared_persistences`.
        longest_s: a longer persistence is not chosen, either.
    """
    by_length = [{round(choice.persistence_s, 5): choice for choice in log} for log in logs if log]
    if not by_length:
        return ()
    common = [length for length in by_length[0] if all(length in log for log in by_length)]
    found = [_pooled([log[length] for log in by_length]) for length in common]
    return chosen_of(found, set_n, longest_delay_s, longest_s)


def _pooled(logs: Sequence[PersistenceChoice]) -> PersistenceChoice:
    """One persistence over several logs."""
    force: dict[str, float | None] = {}
    delay: dict[str, float | None] = {}
    for shape in logs[0].force_n:
        forces = [log.force_n.get(shape) for log in logs]
        known = [f for f in forces if f is not None]
        force[shape] = float(f"{np.exp(np.mean(np.log(known))):.3g}") if len(known) == len(logs) else None
        late = [d for log in logs if (d := log.delay_s.get(shape)) is not None]
        delay[shape] = max(late, default=None)
    return replace(logs[-1], force_n=force, delay_s=delay, cost=None, chosen=False)


def _noticed(added: Sequence[AddedContacts], gamma_nm: dict[str, float], n: int) -> PersistenceChoice:
    gamma = np.array(list(gamma_nm.values()))
    added = [contacts.part(_EVERY) for contacts in added]
    force: dict[str, float | None] = {}
    delay: dict[str, float | None] = {}
    for contacts in added:
        needed, delay[contacts.shape.name] = contacts.noticed(gamma, n)
        middle = float(np.median(needed[~np.isnan(needed)])) if (~np.isnan(needed)).any() else np.inf
        force[contacts.shape.name] = float(f"{middle:.3g}") if np.isfinite(middle) else None
    return PersistenceChoice(n, n * added[0].period_s, gamma_nm, force, delay, None, False)


def chosen_of(
    found: Sequence[PersistenceChoice], set_n: int, longest_delay_s: float | None, longest_s: float | None = None
) -> tuple[PersistenceChoice, ...]:
    """The same with their cost, and the best one marked; the one that is set where no other is better by much."""
    means = [_mean_force(choice) for choice in found]
    known = [mean for mean in means if mean is not None]
    if not known:
        return tuple(found)
    costs = [None if mean is None else mean / min(known) for mean in means]
    allowed = [
        k
        for k, choice in enumerate(found)
        if costs[k] is not None
        and (longest_delay_s is None or all(d is None or d <= longest_delay_s for d in _quick(choice)))
        and (longest_s is None or choice.persistence_s <= longest_s + _SAME_S)
    ]
    best = min(allowed, key=lambda k: costs[k] or np.inf, default=None)
    for k in allowed:
        if best is not None and found[k].n == set_n and (costs[best] or 1.0) > _WORTH * (costs[k] or np.inf):
            best = k
    return tuple(replace(c, cost=cost, chosen=k == best) for k, (c, cost) in enumerate(zip(found, costs, strict=True)))


def _quick(choice: PersistenceChoice) -> list[float | None]:
    """Delays of all shapes but the slowest, whose own rise takes longer than any persistence."""
    return [delay for name, delay in choice.delay_s.items() if not name.startswith("clamp")]


def _mean_force(choice: PersistenceChoice) -> float | None:
    forces = list(choice.force_n.values())
    if any(force is None for force in forces):
        return None
    return float(np.exp(np.mean([np.log(force or 1.0) for force in forces])))
