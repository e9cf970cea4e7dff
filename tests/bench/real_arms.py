"""Writes docs/evidence.md: what real arms do that the paper's does not, each simulated and judged out of the box.

``python real_arms.py LOGS [SEEDS [COMMAND [PAGE [NAME]]]]``: LOGS is a folder for the logs and results (kept, so that a
run goes on where it ended), SEEDS how many (0: what is kept), COMMAND the collaudit to measure, PAGE the page whose
table NAME ("after" if absent) is replaced ("-": none). A cell is one arm:
friction is fitted on a minute of free motion and a log with graded pushes is judged, with ``init``, ``fit`` and
``detect``, told nothing but the robot and units.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from simulated_arm import robot_of, simulated
from tables import put

from collaudit.fixtures import simulation

#: Used for nothing else.
FIRST_SEED = 7300
#: Alarms nearer than this are of one contact; a push is found by an alarm that begins so long after it at most, s.
_TOGETHER_S, _AFTER_S = 0.5, 0.4
#: Name of a row: scenario of the fitting log, of the judged log, imperfections of both.
ROWS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "none": ("free-clean", "free-hits", ()),
    "contacts in the fitting log": ("free-hits", "free-hits", ()),
    **{name: ("free-clean", "free-hits", (name,)) for name in simulation.IMPERFECTIONS},
}
#: Rows without pushes: what the judged log has is no contact.
FAULTS = {
    name: ("free-clean", name, ())
    for name in ("faulty-drives-off", "faulty-stuck-effort", "faulty-inverted-effort")
    if name in simulation.SCENARIOS
}


@dataclass(frozen=True, slots=True)
class Cell:
    """One row and seed.

    Attributes:
        codes: exit codes of init, fit and detect.
        pushes, found, false: pushes above the paper's rule, those found, and contacts at no push.
        clean_s: judged log away from pushes.
        judged: share of the joints' time that was judged.
        findings: codes of warnings and errors, in ``detect``.
    """

    codes: tuple[int, ...]
    pushes: int = 0
    found: int = 0
    false: int = 0
    clean_s: float = 0.0
    judged: float = 0.0
    findings: tuple[str, ...] = ()


def memoised() -> None:
    """One motion is integrated once: most imperfections are of its recording."""
    made: dict[Any, Any] = {}
    carry_out: Callable[..., Any] = simulation.carry_out

    def once(experiment: Any, arm: Any, model: Any, rng: Any, progress: Any, loads: Any) -> Any:
        key = (experiment.position.tobytes(), loads.tobytes())
        if key not in made:
            while len(made) > 3:
                made.pop(next(iter(made)))
            made[key] = carry_out(experiment, arm, model, rng, progress, loads)
        return made[key]

    simulation.carry_out = once


def measured(row: str, results: Path) -> list[Cell]:
    """The cells of a row that are kept."""
    return [_kept(path) for path in sorted(results.glob(f"{row.replace(' ', '-')}-[0-9]*.json"))]


def _kept(path: Path) -> Cell:
    held = json.loads(path.read_text(encoding="utf-8"))
    return Cell(**{key: tuple(value) if isinstance(value, list) else value for key, value in held.items()})


def measure(row: str, seed: int, logs: Path, results: Path, command: list[str]) -> Cell:
    """One cell; kept in ``results`` and not measured twice."""
    fitted, judged, imperfections = {**ROWS, **FAULTS}[row]
    kept = results / f"{row.replace(' ', '-')}-{seed}.json"
    if not kept.exists():
        work = results / "work" / f"{row.replace(' ', '-')}-{seed}"
        work.mkdir(parents=True, exist_ok=True)
        first, second = (
            simulated(logs, scenario, its, imperfections, seconds=60.0 if scenario == "free-clean" else None)
            for scenario, its in ((fitted, seed + 500 * (fitted == judged)), (judged, seed))
        )
        cell = _run(first, second, work, command)
        kept.write_text(json.dumps(cell), encoding="utf-8")
    return _kept(kept)


def _run(first: Path, second: Path, work: Path, command: list[str]) -> dict[str, Any]:
    config, friction, out = work / "c.toml", work / "friction.json", work / "run"
    codes = []
    for arguments in (
        ["init", first, "-c", robot_of(first), "-o", config, "--force"],
        ["fit", first, "-c", config, "-o", friction],
        ["detect", second, "-c", config, "--friction", friction, "-o", out],
    ):
        done = subprocess.run([*command, *map(str, arguments)], capture_output=True, text=True, check=False)
        (work / f"{arguments[0]}.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
        codes.append(done.returncode)
    audit = out / "audit.json"
    if not audit.exists():
        return {"codes": codes}
    return {"codes": codes, **_counted(json.loads(audit.read_text()), json.loads(_truth(second).read_text()))}


def _truth(log: Path) -> Path:
    return log.with_suffix(".truth.json")


def _counted(audit: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    """Pushes found, and contacts at no push."""
    pushes = [(one["onset_s"], one["onset_s"] + one["duration_s"]) for one in truth["collisions"] or ()]
    others = [
        (one["onset_s"], one["onset_s"] + one["duration_s"])
        for key in ("near_misses", "below_threshold")
        for one in truth[key] or ()
    ]
    alarms = sorted((one["onset_s"], one["onset_s"] + one["duration_s"]) for one in audit["collisions"])
    found = sum(any(a < end + _AFTER_S and b > start for a, b in alarms) for start, end in pushes)
    false, last = 0, -1e9
    for start, end in alarms:
        own = any(start < b + _AFTER_S and end > a for a, b in (*pushes, *others))
        false += not own and start > last + _TOGETHER_S
        last = max(last, end)
    clean = audit["log"]["duration_s"] - sum(b - a + _AFTER_S for a, b in (*pushes, *others))
    cover = audit["coverage"]["joints"].values()
    share = sum(one["judged_s"] for one in cover) / (len(cover) * audit["log"]["duration_s"])
    said = sorted({one["code"] for one in audit["findings"] if one["severity"] != "info"})
    return {
        "pushes": len(pushes), "found": found, "false": false, "clean_s": clean, "judged": share, "findings": said,
    }  # fmt: skip


def table_row(name: str, cells: list[Cell], usual: set[str]) -> str:
    """What a row of the page says."""
    judged = [cell for cell in cells if cell.judged]
    if not judged:
        codes = Counter(max(cell.codes) for cell in cells).most_common(1)[0][0]
        return f"| {name} | – | 0 of {len(cells)} (exit {codes}) | – | – | – |"
    pushes, minutes = sum(c.pushes for c in judged), sum(c.clean_s for c in judged) / 60.0
    found, false = sum(c.found for c in judged), sum(c.false for c in judged)
    said = Counter(code for cell in judged for code in set(cell.findings) - usual)
    most = ", ".join(f"`{code}`" for code, count in said.most_common(3) if 2 * count >= len(judged)) or "–"
    recall = f"{100 * found / pushes:.0f} % ({found}/{pushes})" if pushes else "–"
    share = median(cell.judged for cell in judged)
    rate = f"{false} in {minutes:.1f} min"
    return f"| {name} | {most} | {len(judged)} of {len(cells)} | {recall} | {rate} | {100 * share:.0f} % |"


HEAD = ("| imperfection | findings beyond those of none | judged | recall | false contacts | time judged |",
        "|---|---|---|---|---|---|")  # fmt: skip


def main(arguments: list[str]) -> None:
    """Measure and print the table, and put it on the page where one is named."""
    folder, count = Path(arguments[0]), int((arguments[1:] or ["10"])[0])
    command = arguments[2].split() if arguments[2:] else ["collaudit"]
    results = folder / ("after" if len(arguments) < 5 else arguments[4])
    memoised()
    for seed in range(FIRST_SEED, FIRST_SEED + count):
        for row in (*ROWS, *FAULTS):
            print(seed, row, measure(row, seed, folder / "logs", results, command), flush=True)
    cells = {row: measured(row, results) for row in (*ROWS, *FAULTS)}
    usual = {code for cell in cells["none"] for code in cell.findings}
    lines = [*HEAD, *(table_row(row, its, usual) for row, its in cells.items() if its)]
    print("\n".join(lines))
    if arguments[3:] and arguments[3] != "-":
        put(Path(arguments[3]), results.name, lines)


if __name__ == "__main__":
    main(sys.argv[1:])
