"""A set of runs whose results a change of structure must not change: made once before it, once after, and compared.

    python tests/bench/result_set.py make COLLAUDIT LOGS DATA OUT
    python tests/bench/result_set.py compare BEFORE AFTER

``make`` runs the command COLLAUDIT (of whichever version) on every log of DATA (the real logs), on every fault of
``simulate`` for both arms, on pushes with every detector, and on the whole demonstration, and keeps what each command
wrote and printed below OUT. LOGS keeps the simulated logs, so that both versions judge the same bytes; their hashes are
compared as well, since the simulator is part of what may not change.

``compare`` lists every file that differs, and counts those that do not. Times of day and of running are left out.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROBOTS = ("paper6", "seven")
FAULTS = (
    "gap",
    "degrees",
    "inverted-effort",
    "truncated",
    "joint-order",
    "stuck-effort",
    "frozen-position",
    "drives-off",
)
DETECTORS = ("direct", "momentum", "filtered", "eso")
CALIBRATED = "--set 'log.wrench_bias=\"calibrated\"'"
KEPT = (".json", ".toml", ".txt", ".xml", ".md")


@dataclass(frozen=True)
class Job:
    """Commands that run one after the other in one folder below OUT."""

    name: str
    lines: tuple[str, ...]


def simulated() -> Iterator[Job]:
    """Logs made once for all."""
    for robot in ROBOTS:
        yield Job(f"{robot}-friction", (f"simulate friction --robot {robot} -o LOGS/{robot}-friction.mcap",))
        for scenario in ("free-hits", "polish-sine", "tool-calibration"):
            yield Job(f"{robot}-{scenario}", (f"simulate {scenario} --robot {robot} -o LOGS/{robot}-{scenario}.mcap",))
        for scenario in ("free-clean", "stop-go"):
            made = f"simulate {scenario} --robot {robot} --duration 30 -o LOGS/{robot}-{scenario}.bag"
            yield Job(f"{robot}-{scenario}", (made,))
        for fault in FAULTS:
            made = f"simulate faulty-{fault} --robot {robot} --duration 12 -o LOGS/{robot}-faulty-{fault}.mcap"
            yield Job(f"{robot}-faulty-{fault}", (made,))


def on_simulated(robot: str) -> Iterator[Job]:
    """What is asked of the simulated logs of one arm; the first job makes the friction files of the others."""
    at = f"LOGS/{robot}"
    friction, everything = f"--friction ../{robot}-fit/friction.json", f"--friction ../{robot}-fit/everything.json"
    every = """--set 'fit.estimate=["friction","gain","inertials","tool"]'"""
    fit = f"fit {at}-friction.mcap -c {at}-friction.toml -o"
    yield Job(
        f"{robot}-fit",
        (
            f"{fit} friction.json",
            f"{fit} everything.json {every}",
            f"{fit} any.json --set fit.motion=any",
            f"{fit} rbf.json --set friction.model=rbf",
            f"fit {at}-tool-calibration.mcap -c {at}-tool-calibration.toml -o tool.json",
            f"fit {at}-friction.mcap {at}-tool-calibration.mcap -c {at}-polish-sine.toml -o both.json {CALIBRATED}",
            f"inspect {at}-friction.mcap -c {at}-friction.toml --json",
        ),
    )
    for scenario in ("free-hits", "polish-sine"):
        judged = f"detect {at}-{scenario}.mcap -c {at}-{scenario}.toml --truth {at}-{scenario}.truth.json"
        for detector in DETECTORS:
            yield Job(
                f"{robot}-{scenario}-{detector}", (f"{judged} {friction} --set detect.detector={detector} -o run",)
            )
        yield Job(f"{robot}-{scenario}-causal", (f"{judged} {friction} --set detect.causal=true -o run",))
        yield Job(f"{robot}-{scenario}-everything", (f"{judged} {everything} -o run",))
        calibrated = f"{judged} --friction ../{robot}-fit/both.json {CALIBRATED} -o run"
        yield Job(f"{robot}-{scenario}-calibrated", (calibrated,))
        alone = f"{judged} -o run"
        yield Job(f"{robot}-{scenario}-alone", (alone, "recommend run --json", "recommend run"))
    for scenario in ("free-clean", "stop-go"):
        log = f"{at}-{scenario}.bag -c {at}-{scenario}.toml"
        reports = "report run -o page.html --format html,json,junit,sarif,markdown"
        yield Job(f"{robot}-{scenario}", (f"inspect {log} --json", f"detect {log} {friction} -o run", reports))
    for fault in FAULTS:
        log = f"{at}-faulty-{fault}.mcap -c {at}-faulty-{fault}.toml"
        yield Job(f"{robot}-faulty-{fault}", (f"inspect {log} --json", f"detect {log} {friction} -o run"))
    logs = " ".join(f"{at}-faulty-{fault}.mcap" for fault in FAULTS[:3])
    yield Job(
        f"{robot}-audit", (f"audit {logs} -c {at}-free-clean.toml {friction} -o out --format junit,sarif,markdown",)
    )


def on_real() -> Iterator[Job]:
    """Every log of DATA: what init, inspect, fit, detect say of it."""

    def job(name: str, log: str, urdf: str | None, *edits: str, estimate: str = "") -> Job:
        model = f" --urdf DATA/urdf/{urdf}" if urdf else ""
        lines = [f"inspect {log}{model} --json", f"inspect {log}", f"init {log}{model} -o c.toml", *edits]
        lines += [f"fit {log} -c c.toml -o friction.json{estimate}", f"detect {log} -c c.toml -o alone"]
        lines += [f"detect {log} -c c.toml --friction friction.json -o run", "recommend run --json"]
        return Job(f"real-{name}", tuple(lines))

    signs = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    inverted = ", ".join(f"{sign}_joint = -1" for sign in signs)
    sign = f"! sed -i 's/^# effort_sign = .*/effort_sign = {{ {inverted} }}/' c.toml"
    raw = """! sed -i 's/^effort = "Nm".*/effort = "raw"/' c.toml"""
    tiago = " ".join(f"DATA/tiago_csv/tiago_{part}.csv" for part in ("position", "velocity", "effort"))
    yield job("ur10", "DATA/ur10_db3/ur10_exciting_trajectory.db3", "ur10_robot.urdf")
    every = """ --set 'fit.estimate=["friction","gain","inertials"]'"""
    yield job("ur10-everything", "DATA/ur10_db3/ur10_exciting_trajectory.db3", "ur10_robot.urdf", estimate=every)
    for name in ("id1", "id2", "_2019-11-27-20-59-11"):
        yield job(f"ur3-{name}", f"DATA/ur3_bags/{name}.bag", "ur3_robot.urdf")
        yield job(f"ur3-{name}-signed", f"DATA/ur3_bags/{name}.bag", "ur3_robot.urdf", sign)
    yield job("ur3-mcap2", "DATA/ur3_mcap_ros2", "ur3_robot.urdf", sign)
    yield job("ur3-mcap1", "DATA/ur3_mcap_ros1/ur3_id1_ros1profile.mcap", "ur3_robot.urdf", sign)
    yield job("kuka-bag", "DATA/kuka_lwr_bag/test.bag", None)
    yield job("kuka-mcap", "DATA/kuka_mcap_ros2", None)
    yield job("panda", "DATA/panda_db3/panda_exciting_trajectory.db3", "panda.urdf")
    yield job("tiago", tiago, "tiago_no_hand.urdf")
    yield job("tiago-raw", tiago, "tiago_no_hand.urdf", raw)
    yield job("not-a-robot", "DATA/not_a_robot_log_db3", None)
    yield job("cobotops", "DATA/ur3_cobotops_csv/dataset_02052023.csv", "ur3_robot.urdf")
    yield job("franka", "DATA/franka_touch_csv/touch_01.csv", "panda.urdf")
    yield job("tx40", "DATA/tx40_csv/pos_read_data.csv DATA/tx40_csv/curr_data.csv", "tx40_mdh_modified.urdf")
    yield job("lbr", "DATA/lbr_csv/measurements.csv", "med7dock.urdf")


def run(job: Job, command: Path, logs: Path, data: Path, out: Path) -> None:
    """Run a job's lines; what each printed stands beside what it wrote."""
    folder = out / job.name
    folder.mkdir(parents=True, exist_ok=True)
    environment = dict(os.environ, NO_COLOR="1", COLUMNS="110", OMP_NUM_THREADS="1")
    for number, line in enumerate(job.lines):
        line = line.replace("LOGS/", f"{logs}/").replace("DATA/", f"{data}/")
        shell = line[2:] if line.startswith("! ") else f"{shlex.quote(str(command))} {line}"
        done = subprocess.run(["bash", "-c", shell], cwd=folder, env=environment, capture_output=True, text=True)
        text = f"exit {done.returncode}\n--- stdout\n{done.stdout}--- stderr\n{done.stderr}"
        (folder / f"said-{number}.txt").write_text(text, encoding="utf-8")


def make(command: Path, logs: Path, data: Path, out: Path) -> None:
    """Run everything, two jobs at a time."""
    command, logs, data, out = (path.absolute() for path in (command, logs, data, out))
    logs.mkdir(parents=True, exist_ok=True)

    def all_of(jobs: Iterator[Job]) -> None:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda job: run(job, command, logs, data, out), jobs))

    all_of(job for job in simulated() if not (logs / f"{job.name}.toml").exists())
    all_of(on_real())
    robots = {robot: list(on_simulated(robot)) for robot in ROBOTS}
    all_of(jobs[0] for jobs in robots.values())
    all_of(job for jobs in robots.values() for job in jobs[1:])
    hashes = {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(logs.iterdir()) if p.is_file()}
    (out / "simulated-logs.json").write_text(json.dumps(hashes, indent=1), encoding="utf-8")


def plain(path: Path) -> str:
    """A file's text without what is different in every run: folders of the run itself, versions, seconds."""
    text = path.read_text(encoding="utf-8", errors="replace")
    return re.sub(r"(/[\w.+-]+)+/(?=[\w.+-]+)", "", re.sub(r'"seconds": [\d.]+', "", text))


def compare(before: Path, after: Path) -> int:
    """Print what differs; 1 when anything does."""
    names = sorted(
        {p.relative_to(top) for top in (before, after) for p in top.rglob("*") if p.suffix in KEPT and p.is_file()}
    )
    same, differing = 0, 0
    for name in names:
        one, other = before / name, after / name
        if not (one.exists() and other.exists()):
            print(f"only {'before' if one.exists() else 'after'}: {name}")
            differing += 1
        elif (a := plain(one)) == (b := plain(other)):
            same += 1
        else:
            differing += 1
            lines = list(difflib.unified_diff(a.splitlines(), b.splitlines(), lineterm="", n=0))[2:]
            print(f"differs: {name} ({len(lines)} lines)")
            for line in lines[:6]:
                print(f"    {line[:300]}")
    print(f"{same} files equal, {differing} differ")
    return 1 if differing else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["make"] and len(sys.argv) == 6:
        make(*(Path(argument) for argument in sys.argv[2:]))
    elif sys.argv[1:2] == ["compare"] and len(sys.argv) == 4:
        sys.exit(compare(Path(sys.argv[2]), Path(sys.argv[3])))
    else:
        sys.exit(__doc__)
