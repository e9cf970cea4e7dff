"""The bench behind docs/evidence.md: how sharp residual and thresholds are, on real and simulated logs.

    python tests/bench/sharpness.py --data DIR [--only levels,pushes,…] [-o docs/evidence.md]

Every part keeps what it measured in ``build/sharpness/PART.json``, item by item, so that a run goes on where it was
ended; ``--again`` measures anew, ``--only`` picks parts, ``--logs`` picks real logs. ``-o`` writes the tables between
their marks on the page, from what is kept. ``--before`` names a folder of such files, for the columns "before":
without, those of the version before thresholds were sharpened.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from tables import put

PROJECT = Path(__file__).resolve().parents[2]
KEPT = PROJECT / "build" / "sharpness"
#: What commit 62163d7 left, before residual and thresholds were sharpened.
BEFORE = Path(__file__).with_name("sharpness_before")
#: Name of a part: the module that measures it and makes its tables.
PARTS = {
    "levels": "sharp_levels",
    "pushes": "sharp_pushes",
    "touches": "sharp_touches",
    "contaminated": "sharp_contaminated",
    "delay": "sharp_delay",
    "hours": "sharp_hours",
    "intervals": "sharp_intervals",
}


@dataclass(frozen=True, slots=True)
class Asked:
    """What the command line asks for.

    Attributes:
        data: the folder of real logs.
        work: where logs and configurations are made.
        logs: real logs to measure; empty for all.
        seed: first seed of simulated logs.
        hours: of clean simulated motion an arm.
        seeds: simulated logs an arm where intervals are counted.
    """

    data: Path
    work: Path
    logs: tuple[str, ...]
    seed: int
    hours: float
    seeds: int


def measured(part: str, asked: Asked, again: bool) -> dict[str, Any]:
    """What a part finds, kept item by item."""
    kept = KEPT / f"{part}.json"
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    if again:
        found = {name: value for name, value in found.items() if asked.logs and name not in asked.logs}
    start = time.monotonic()
    for name, value in import_module(PARTS[part]).measure(asked, frozenset(found)):
        found[name] = rounded(value)
        kept.write_text(json.dumps(found, indent=1), encoding="utf-8")
        print(f"{part}: {name} ({time.monotonic() - start:.1f} s)", file=sys.stderr, flush=True)
        start = time.monotonic()
    return found


def rounded(value: Any) -> Any:
    """The same with four digits of every number: files to keep and compare."""
    if isinstance(value, dict):
        return {key: rounded(its) for key, its in value.items()}
    if isinstance(value, list):
        return [rounded(its) for its in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


def tables(part: str, found: dict[str, Any], before: Path | None) -> Iterator[tuple[str, list[str]]]:
    """The tables of a part."""
    old = before / f"{part}.json" if before else None
    earlier = json.loads(old.read_text(encoding="utf-8")) if old and old.exists() else {}
    return import_module(PARTS[part]).tables(found, earlier)


def main(arguments: list[str]) -> None:
    """As the module's first lines say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=PROJECT.parent / "shared" / "data")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, separated by commas: " + ", ".join(PARTS))
    parser.add_argument("--logs", default="", help="names of real logs, separated by commas")
    parser.add_argument("--again", action="store_true", help="measure what is kept anew")
    parser.add_argument("--tables", action="store_true", help="measure nothing: tables of what is kept")
    parser.add_argument("--before", type=Path, default=BEFORE, help="folder of earlier results")
    parser.add_argument("--seed", type=int, default=8100)
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("-o", "--output", type=Path, help="page whose tables are replaced")
    given = parser.parse_args(arguments)
    work = KEPT / "work"
    work.mkdir(parents=True, exist_ok=True)
    logs = tuple(name.strip() for name in given.logs.split(",") if name.strip())
    asked = Asked(given.data.absolute(), work, logs, given.seed, given.hours, given.seeds)
    for part in given.only.split(","):
        found = measured(part, asked, given.again) if not given.tables else _kept(part)
        for name, lines in tables(part, found, given.before):
            print("\n".join([f"## {name}", *lines, ""]), flush=True)
            if given.output:
                put(given.output, name, lines)


def _kept(part: str) -> dict[str, Any]:
    kept = KEPT / f"{part}.json"
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    return found


if __name__ == "__main__":
    main(sys.argv[1:])
