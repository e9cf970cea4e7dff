"""``recommend --store``: thresholds from the nights of a store, and since when they are supported."""

from __future__ import annotations

from dataclasses import asdict

from collaudit.cli.console import say, say_json, terminal_width
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, ConfigError
from collaudit.core.history.stored_thresholds import StoredRecommendation, stored_recommendation

STORED_SCHEMA = "collaudit/recommend-store/1"


def recommend_from_store(store: str, robot: str | None, per_hour: float, as_json: bool) -> int:
    """Print what the nights of a robot recommend.

    Args:
        store: folder or URL.
        robot: its name; None where the store holds one only.
        per_hour: false alarms of the arm that are accepted.
        as_json: print JSON.

    Raises:
        ConfigError: the store holds several robots and none is named.
    """
    from collaudit.reports.files.json_files import json_text
    from collaudit.reports.store.result_store import ResultStore

    records = ResultStore(store).records(evidence=True)
    names = sorted({record.robot for record in records})
    if robot is None and len(names) != 1:
        raise ConfigError(
            "the store holds several robots",
            where="--robot",
            found=", ".join(names[:10]) or "none",
            expected="the name of one",
        )
    found = stored_recommendation(records, robot or names[0], per_hour)
    if as_json:
        say_json(json_text({"schema": STORED_SCHEMA, **asdict(found)}, indent=2))
    else:
        say(_text(found, per_hour), nl=False)
    known = any(rule.gamma_nm is not None for rule in found.joints.values())
    return EXIT_PASS if known else EXIT_NOT_JUDGED


def _text(found: StoredRecommendation, per_hour: float) -> str:
    from collaudit.reports.terminal.text_table import table
    from collaudit.reports.values.numbers import significant, stated

    head = ("joint", "gamma N·m", "n", "clean h", "largest clean N·m", "set N·m")
    rows = [
        (
            joint,
            "–" if rule.gamma_nm is None else stated(rule.gamma_nm),
            str(rule.n),
            significant(rule.hours),
            "–" if rule.largest_clean_nm is None else significant(rule.largest_clean_nm),
            "–" if rule.set_nm is None else stated(rule.set_nm),
        )
        for joint, rule in found.joints.items()
    ]
    asked = f"{significant(per_hour)} false alarms of the arm an hour"
    lines = [
        f"{found.robot}: {found.logs} logs of {len(found.nights)} nights, {significant(found.rate.hours)} clean hours"
    ]
    lines.append(_since("recommended gamma", found.supported_since, asked, found.rate.more_hours))
    if found.rate_set is not None:
        lines.append(_since("gamma as set", found.set_supported_since, asked, found.rate_set.more_hours))
    if found.left_out:
        lines.append(
            f"{found.left_out} logs judged with another friction file, model, detector or persistence do not count"
        )
    return "\n".join(lines) + "\n" + table(head, rows, range(1, len(head)), terminal_width(), fold=True)


def _since(what: str, night: str | None, asked: str, more_hours: float) -> str:
    if night is not None:
        return f"{what}: at most {asked} supported since {night}"
    missing = f"; {more_hours:.3g} more clean hours are needed at least" if more_hours > 0 else ""
    return f"{what}: at most {asked} not supported yet{missing}"
