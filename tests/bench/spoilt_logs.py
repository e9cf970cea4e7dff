"""Logs spoilt on purpose, with a push in each: the table of docs/evidence.md (``make spoilt``).

    python tests/bench/spoilt_logs.py [--seed N] [--kinds scale,frozen] [--every 5] [-o docs/evidence.md]

Every fault of ``log_faults`` and ``stretch_faults`` is done to the judged log alone, and to fitted and judged log
alike, on both simulated arms, with thresholds that are stated and with ``"auto"``. Results are kept in
``build/spoilt``, case by case, so that a run goes on where it was ended.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import zlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

import numpy as np
import stretch_faults
from changed_logs import fitted, judged, named, of_rows, prepared
from log_faults import FAMILIES, LogFault, Place
from push_campaign import free_log
from simulated_arm import ARMS, settings_of, simulated
from tables import put

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.pushes import Direction, Push

KEPT = Path(__file__).resolve().parents[2] / "build" / "spoilt"
FAULTS = tuple(
    fault
    for family in (
        *FAMILIES,
        stretch_faults.stretches,
        stretch_faults.stamps,
        stretch_faults.missing,
        stretch_faults.unjudged,
    )
    for fault in family()
)
#: Fitted and judged log, s, and of 500 Hz one row of how many.
FITTED_S, JUDGED_S, EVERY = 60.0, 30.0, 4
#: What a person states, N·m: the paper's.
STATED_NM = 4.0
#: Force that the policy asks for at the tool and at the forearm, N; half of the pushes have it or more.
ASKED_N = {"tool": 100.0, "forearm": 150.0}
_LOGS, _AFTER_S = 8, 0.4
#: Middles of the stretches that local faults spoil in the fitted log, s.
EVERY_SIX_S = tuple(np.arange(4.0, FITTED_S - 2.0, 6.0).tolist())
OUTCOMES = ("found", "alarm elsewhere", "not judged", "stated", "too weak", "silent", "crash")


@dataclass(frozen=True, slots=True, eq=False)
class Pushed:
    """A judged log and its push; ``asked`` when the push has the force that the policy asks for."""

    log: JointLog
    push: Push
    asked: bool


class Arm:
    """One simulated arm with everything that its cases share."""

    def __init__(self, robot: str, seed: int, folder: Path) -> None:
        self.robot, self.seed, self.folder = robot_named(robot), seed, folder
        self.fit_path = simulated(folder, "free-clean", seed, robot=robot, seconds=FITTED_S)
        self.auto = settings_of(self.fit_path)
        self.stated = settings_of(self.fit_path, {"detect.gamma_nm": STATED_NM})
        self.clean = _thinned(api.open_log((self.fit_path,), self.auto))
        self.model: RobotModel = self.robot.model()
        self.fits: dict[str, FrictionFile] = {}

    @cache  # noqa: B019 one arm lives as long as the program
    def pushed(self, number: int) -> Pushed:
        """One of the judged logs."""
        rng = np.random.default_rng([self.seed, number])
        tool, asked = number % 2 == 0, number % 4 < 2
        link = len(self.robot.links) if tool else len(self.robot.links) - 3
        force = ASKED_N["tool" if tool else "forearm"] * (rng.uniform(1.0, 1.5) if asked else rng.uniform(0.25, 0.6))
        directions: tuple[Direction, ...] = ("around", "down", "inward")
        push = Push(link, force, directions[number % 3], JUDGED_S / 2 + rng.uniform(-2.0, 2.0), 0.25, 0.03)
        return Pushed(self.free(self.seed + 10 + number, (push,)), push, asked)

    @cache  # noqa: B019
    def usual(self, stated: bool) -> frozenset[str]:
        """What is said of clean logs."""
        settings, friction = (self.stated if stated else self.auto), self.fitted(None, (), self.auto)
        logs = [self.free(self.seed + 30 + number, ()) for number in range(3)]
        return frozenset().union(*(statements(judged(log, settings, friction).result) for log in logs))

    @cache  # noqa: B019
    def too_weak(self, number: int, stated: bool) -> bool:
        """Whether a push below the asked force is not noticed in the log without any fault either."""
        if self.pushed(number).asked:
            return False
        settings, friction = (self.stated if stated else self.auto), self.fitted(None, (), self.auto)
        return judged(self.pushed(number).log, settings, friction).result.verdict == "pass"

    def free(self, seed: int, pushes: tuple[Push, ...]) -> JointLog:
        """Free motion with these pushes, read and thinned; the files are not kept."""
        out = self.folder / f"{self.robot.name}-free-{seed}.csv"
        files = free_log(self.robot.name, seed, JUDGED_S, pushes, out)
        log = _thinned(api.open_log(files.log, self.auto))
        for path in out.parent.glob(f"{out.stem}*"):
            path.unlink()
        return log

    def fitted(self, fault: LogFault | None, times: Sequence[float], settings: LoadedConfig) -> FrictionFile:
        """Friction of the fitted log, spoilt or not; thresholds that are stated are no part of it."""
        name = "" if fault is None else f"{fault.kind} {fault.name}"
        if name not in self.fits:
            log = self.clean
            if fault is not None and fault.change is not None:
                log = named(fault.change(log, self.place(times, f"fit {name}")), f"fit {name}")
            self.fits[name] = fitted([prepared(log, settings)], settings)
        return self.fits[name]

    def place(self, times: Sequence[float], name: str) -> Place:
        """Where a fault is done."""
        rng = np.random.default_rng([self.seed, zlib.crc32(name.encode())])
        return Place(tuple(times), self.model, self.robot.tool_frame, rng)


def _thinned(log: JointLog) -> JointLog:
    return of_rows(log, np.arange(0, log.time_s.size, EVERY), f"1 of {EVERY}")


def statements(result: AuditResult) -> set[str]:
    """What a result excludes or warns of, without numbers and joints: kinds of sentences."""
    said = [*result.exclusions, *(f"{one.code}" for one in result.findings if one.severity != "info")]
    names = "|".join(map(re.escape, sorted(result.log.joints, key=len, reverse=True)))
    return {re.sub(rf"{names}|[\d.,]+|\s+", " ", text).split(":")[0].strip() for text in said}


def cases(arm: Arm, kinds: Sequence[str]) -> Iterator[tuple[str, LogFault, str, bool]]:
    """Name, fault, which logs it spoils, whether thresholds are stated."""
    for fault in FAULTS:
        if kinds and fault.kind not in kinds:
            continue
        for where in ("fit",) if fault.fit_only else ("both",) if fault.lacks else ("judged", "both"):
            for stated in (True, False):
                name = f"{arm.robot.name} | {fault.kind} | {fault.name} | {where} | {'stated' if stated else 'auto'}"
                yield name, fault, where, stated


def outcome(arm: Arm, fault: LogFault, where: str, stated: bool, number: int | None = None) -> dict[str, Any]:
    """What becomes of the push of one case, in the judged log of that number, or the one that is the case's turn."""
    if number is None:
        number = (FAULTS.index(fault) + 2 * (where == "both")) % _LOGS  # 2: a hard push for a weak one
    pushed = arm.pushed(number)
    settings = _lacking(arm, fault, stated)
    middle = pushed.push.onset_s + pushed.push.duration_s / 2
    facts: dict[str, Any] = {"asked": pushed.asked and not fault.blinds, "force_n": pushed.push.force_n}
    try:
        friction = arm.fitted(None if where == "judged" else fault, EVERY_SIX_S, _lacking(arm, fault, False))
        log = pushed.log
        if fault.change is not None and where != "fit":
            log = named(fault.change(log, arm.place((middle,), fault.name)), fault.name)
        result = judged(log, settings, friction).result
    except CollauditError as error:
        return {**facts, "outcome": "not judged", "why": error.message}
    except Exception as error:  # noqa: BLE001 a bug of what is measured is one of its outcomes
        return {**facts, "outcome": "crash", "why": f"{type(error).__name__}: {error}"}
    onset, end = pushed.push.onset_s, pushed.push.onset_s + pushed.push.duration_s + _AFTER_S
    hit = any(one.onset_s < end and one.end_s > onset for one in result.contacts)
    new = sorted(statements(result) - arm.usual(stated))
    facts |= {"gamma_nm": dict(result.rule.gamma_nm), "why": next(iter(result.reasons), "")[:200], "new": new[:4]}
    if result.verdict == "fail":
        return {**facts, "outcome": "found" if hit else "alarm elsewhere"}
    if result.verdict != "pass":
        return {**facts, "outcome": "not judged"}
    return {**facts, "outcome": "stated" if new else "too weak" if arm.too_weak(number, stated) else "silent"}


def _lacking(arm: Arm, fault: LogFault, stated: bool) -> LoadedConfig:
    """Settings without what the fault leaves out of the description."""
    overrides: dict[str, object] = {"detect.gamma_nm": STATED_NM} if stated else {}
    if "tool" in fault.lacks:
        overrides["robot.tool.mass_kg"] = 0.0
    if "armature" in fault.lacks:
        overrides["robot.armature_kg_m2"] = [0.0] * len(arm.robot.joints)
    return settings_of(arm.fit_path, overrides)


def table(found: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """By class over all settings, by setting over all classes, and the cases that passed."""
    head = "| {} | tried | " + " | ".join(OUTCOMES) + " | of asked force: tried | passed |"
    rule = "|---|---|" + "---|" * len(OUTCOMES) + "---|---|"
    by_kind: dict[str, list[Any]] = defaultdict(list)
    by_setting: dict[str, list[Any]] = defaultdict(list)
    for name, its in found.items():
        robot, kind, _, where, gamma = name.split(" | ")
        by_kind[kind].append(its)
        by_setting[f"{_WHERE[where]}, γ {gamma}, {robot}"].append(its)
    for title, groups in (("class", by_kind), ("spoilt", by_setting)):
        lines = [head.format(title), rule]
        lines += [_row(group, its) for group, its in groups.items()]
        lines.append(_row("**all**", list(found.values())))
        yield f"spoilt-{title.split()[0]}", lines
    lines = ["| arm, class, fault, spoilt log, γ | outcome | push | what is said |", "|---|---|---|---|"]
    for name, its in found.items():
        if its["outcome"] in ("silent", "crash") or (its["outcome"] == "stated" and its["asked"]):
            said = its["why"] if its["outcome"] == "crash" else "; ".join(its.get("new", [])) or "–"
            lines.append(f"| {name.replace(' | ', ', ')} | {its['outcome']} | {its['force_n']:.0f} N | {said} |")
    yield "spoilt-passes", lines


_WHERE = {"judged": "judged log", "both": "fitted and judged log alike", "fit": "fitted log"}


def _row(name: str, its: Sequence[Mapping[str, Any]]) -> str:
    counts = [sum(one["outcome"] == outcome for one in its) for outcome in OUTCOMES]
    asked = [one for one in its if one["asked"]]
    passed = sum(one["outcome"] in ("stated", "silent") for one in asked)
    return f"| {name} | {len(its)} | " + " | ".join(map(str, counts)) + f" | {len(asked)} | {passed} |"


def main(arguments: list[str]) -> None:
    """As the module's first lines say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=9100)
    parser.add_argument("--kinds", default="", help="classes, separated by commas")
    parser.add_argument("--every", type=int, default=1, help="one case of so many, over all classes")
    parser.add_argument("--tables", action="store_true", help="judge nothing: tables of what is kept")
    parser.add_argument("-o", "--output", type=Path, help="page whose tables are replaced")
    given = parser.parse_args(arguments)
    kept = KEPT / f"{given.seed}.json"
    kept.parent.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    kinds = [kind.strip() for kind in given.kinds.split(",") if kind.strip()]
    for robot in () if given.tables else ARMS:
        arm = Arm(robot, given.seed, KEPT / "logs")
        for name, fault, where, stated in islice(cases(arm, kinds), None, None, given.every):
            if name not in found:
                found[name] = outcome(arm, fault, where, stated)
                kept.write_text(json.dumps(found, indent=1), encoding="utf-8")
                print(f"{name}: {found[name]['outcome']}", file=sys.stderr, flush=True)
    for name, lines in table(found):
        print("\n".join([f"## {name}", *lines, ""]), flush=True)
        if given.output:
            put(given.output, name, lines)


if __name__ == "__main__":
    main(sys.argv[1:])
