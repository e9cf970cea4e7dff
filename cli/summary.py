"""An audit in the few lines a terminal shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from collaudit.cli.words import table, verdict_word
from collaudit.core.errors import EXIT_FAIL, EXIT_NOT_JUDGED, EXIT_PASS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from collaudit.core.result import AuditResult, Collision, NearMiss, Verdict

_MOST_EVENTS = 20


def exit_code(verdicts: Sequence[Verdict]) -> int:
    """The contracted exit code: a broken policy wins over what could not be judged."""
    if "fail" in verdicts:
        return EXIT_FAIL
    return EXIT_NOT_JUDGED if "not_judged" in verdicts or not verdicts else EXIT_PASS


def result_text(result: AuditResult) -> str:
    """Verdict with its reasons, rule, events and residual levels of one audit."""
    rule = result.rule
    gamma = ", ".join(f"{name} {value:g}" for name, value in rule.gamma_nm.items() if name in rule.watch)
    asked = "" if rule.persistence_requested_ms is None else f" (asked: {rule.persistence_requested_ms:g} ms)"
    lines = [
        f"{verdict_word(result.verdict)}  {result.log.name}",
        *(f"  {reason}" for reason in result.reasons),
        f"  rule: {rule.detector}, n = {rule.n} samples = {1e3 * rule.persistence_s:g} ms{asked}",
        f"  gamma [N·m]: {gamma or 'none'}",
    ]
    if result.collisions or result.near_misses:
        lines += ["", events_table(result)]
    return "\n".join([*lines, "", residual_table(result)])


def residual_table(result: AuditResult) -> str:
    """Per joint: residual level, seconds judged, and why a joint was not watched."""
    rows = []
    for name, cover in result.coverage.joints.items():
        stats = result.residual.get(name)
        level = "" if stats is None or stats.mean_abs_nm is None else f"{stats.mean_abs_nm:.3f}"
        p99 = "" if stats is None or stats.p99_nm is None else f"{stats.p99_nm:.3f}"
        rows.append(
            (
                name,
                "yes" if cover.watched else "no",
                level,
                p99,
                f"{cover.judged_s:.1f}",
                f"{cover.moving_s:.1f}",
                f"{cover.standing_s:.1f}",
                "" if cover.watched else cover.why,
            )
        )
    head = ("joint", "watched", "mean |r| N·m", "p99 N·m", "judged s", "moving s", "standing s", "why not")
    return table(head, rows)


def events_table(result: AuditResult) -> str:
    """Collisions, then near misses; what does not fit on a screen is counted."""
    rows = [_event_row("collision", event) for event in result.collisions[:_MOST_EVENTS]]
    rows += [_event_row(f"near miss ({event.kind})", event) for event in result.near_misses[:_MOST_EVENTS]]
    head = ("event", "joint", "onset s", "duration s", "peak N·m", "gamma N·m", "phase")
    left = len(result.collisions) + len(result.near_misses) - len(rows)
    return table(head, rows) + (f"\n… and {left} more, in audit.json" if left else "")


def _event_row(kind: str, event: Collision | NearMiss) -> tuple[str, ...]:
    times = (f"{event.onset_s:.3f}", f"{event.duration_s:.3f}")
    return (kind, event.joint, *times, f"{event.peak_nm:.2f}", f"{event.gamma_nm:g}", event.phase)
