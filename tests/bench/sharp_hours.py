"""Alarms in clean simulated hours, beside the rate that the fit claims (part ``hours``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.stats import chi2
from simulated_arm import ARMS, forget, settings_of, simulated

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import FrictionFile

#: Length of one log, s, and of the log that is fitted.
LENGTH_S = 600.0


def measure(asked: Any, known: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Log after log of both arms in turn, until each has so many hours; a log is forgotten once it is judged."""
    folder = asked.work / "simulated"
    ready: dict[str, tuple[LoadedConfig, FrictionFile]] = {}
    for number in range(round(asked.hours * 3600.0 / LENGTH_S)):
        for robot in ARMS:
            name = f"{robot} {number}"
            if name in known:
                continue
            if robot not in ready:
                first = simulated(folder, "free-clean", asked.seed + 50, robot=robot, seconds=LENGTH_S)
                settings = settings_of(first)
                ready[robot] = settings, api.fit([first], settings)
            settings, friction = ready[robot]
            log = simulated(folder, "free-clean", asked.seed + 100 + number, robot=robot, seconds=LENGTH_S)
            result = api.audit(log, settings, friction).result
            forget(log)
            judged_s = sum(one.judged_s for one in result.coverage.joints.values())
            yield name, {
                "hours": result.log.duration_s / 3600.0, "contacts": len(result.contacts),
                "alarms": len(result.collisions), "near_misses": len(result.near_misses), "verdict": result.verdict,
                "judged": judged_s / (len(result.coverage.joints) * result.log.duration_s),
                "claimed_per_hour": claimed(friction, result.rule.persistence_s),
                "gamma_nm": dict(result.rule.gamma_nm),
            }  # fmt: skip


def claimed(friction: FrictionFile, persistence_s: float) -> float | None:
    """False alarms of the whole arm an hour that the fit's thresholds claim; None for no claim.

    Those of the persistence that is set.
    """
    if friction.thresholds is None:
        return None
    whole = getattr(friction.thresholds, "false_alarms_per_hour", None)
    if whole is not None:
        return float(whole)
    rates = []
    for known in friction.thresholds.joints.values():
        near = min(known.levels, key=lambda one: abs(one.persistence_s - persistence_s), default=None)
        rates += [near.false_alarms_per_hour] if near is not None else []
    told = [rate for rate in rates if rate is not None]
    return sum(told) if told and len(told) == len(rates) else None


def tables(found: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """One row an arm."""
    lines = ["| arm | hours | contacts | an hour (95 %) | claimed an hour, at most | alarms of joints "
             "| near misses an hour | joint time judged | contacts before |",
             "|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for robot in ARMS:
        its, old = ([one for name, one in of.items() if name.split()[0] == robot] for of in (found, before))
        if not its:
            continue
        hours, contacts, alarms, near = (
            sum(one[key] for one in its) for key in ("hours", "contacts", "alarms", "near_misses")
        )
        low, high = poisson(contacts)
        said = its[-1]["claimed_per_hour"]
        was = f"{sum(one['contacts'] for one in old)} in {sum(one['hours'] for one in old):.1f} h" if old else "–"
        lines.append(
            f"| {robot} | {hours:.1f} | {contacts} | {contacts / hours:.2g} ({low / hours:.2g} to {high / hours:.2g}) "
            f"| {'–' if said is None else format(said, '.2g')} | {alarms} | {near / hours:.1f} "
            f"| {100 * np.mean([one['judged'] for one in its]):.0f} % | {was} |"
        )
    yield "hours", lines


def poisson(count: int) -> tuple[float, float]:
    """Exact 95 % interval of a Poisson mean (Garwood 1936)."""
    low = 0.0 if count == 0 else float(chi2.ppf(0.025, 2 * count) / 2)
    return low, float(chi2.ppf(0.975, 2 * count + 2) / 2)
