"""A fleet over nights: ``python tests/bench/fleet_night.py WORKDIR [LOGS] [NIGHTS] [ROBOTS] [FOLLOWED]``.

One-minute logs of a small arm; 1000, 60, 20 and 20 where nothing is said. FOLLOWED robots have one log a
night; on the last night all have, LOGS together. Planted: contacts and near misses in a twentieth of the last
night's logs each; friction of one joint of robot-07 that grows by 0.5 % a night from a sixth of the nights
on; another tool on robot-13 from two thirds on; ten damaged and three hostile logs. What was planted must be
found and named, and nothing else: ends with 1 where it is not. Prints what docs/evidence.md states.
"""

from __future__ import annotations

import gzip
import importlib.util
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
RUN = [sys.executable, "-c", "import sys; from collaudit.cli.main import main; sys.exit(main())"]
WORN, SWAPPED, GROWTH, TOOL_KG = "robot-07", "robot-13", 0.005, 0.4
SAMPLES = 15_000  # a minute at 250 Hz
SAMPLE_LOGS = 24  # of the comparisons
FIRST, TOGETHER = np.datetime64("2026-09-01"), 10  # first night; nights of the history that one audit takes


def small_arm() -> object:
    """The arm of the command line's tests."""
    spec = importlib.util.spec_from_file_location("arm_of_tests", HERE.parents[0] / "cli" / "conftest.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


class Arm:
    """Signals of the arm: rigid-body torque without and with the other tool, and friction; (n, 2) each."""

    def __init__(self, module: object) -> None:
        from collaudit.core.config import parse_config
        from collaudit.core.robot.robot_building import build_robot

        config = parse_config(module.CONFIG, None).config  # type: ignore[attr-defined]
        rows = config.robot.dh
        heavier = rows[1].changed({
            "mass_kg": rows[1].mass_kg + TOOL_KG,
            "com_m": tuple(rows[1].mass_kg * c / (rows[1].mass_kg + TOOL_KG) for c in rows[1].com_m),
        })  # fmt: skip
        other = config.robot.changed({"dh": (rows[0], heavier)})
        q, dq = module._motion()  # type: ignore[attr-defined]
        ddq = np.gradient(dq, 1 / 250.0, axis=0)
        part = slice(len(q) - SAMPLES - 13_000, len(q) - 13_000)
        models = [build_robot(robot, Path(), ["joint1", "joint2"]) for robot in (config.robot, other)]
        self.rigid, self.heavy = (m.inverse_dynamics(q, dq, ddq)[part] for m in models)
        self.q, self.dq = q[part], dq[part]
        self.friction = np.sign(self.dq) * (1.0 + 0.8 * np.exp(-np.abs(self.dq) / 0.08)) + 1.5 * self.dq

    def write(
        self, path: Path, seed: int, start_s: float, wear: float = 0.0, heavy: bool = False, push_nm: float = 0.0
    ) -> None:
        """One log that begins at ``start_s`` since 1970."""
        import pyarrow as pa
        from pyarrow import csv

        rng = np.random.default_rng(seed)
        scale = 1.0 + rng.normal(0.0, 0.005, 2) + np.array([0.0, wear])  # friction differs a little from night to night
        tau = (self.heavy if heavy else self.rigid) + scale * self.friction + rng.normal(0.0, 0.05, self.q.shape)
        if push_nm:
            fast = np.flatnonzero(np.abs(self.dq[:, 0]) + np.abs(self.dq[:, 1]) > 0.2)
            start = fast[len(fast) // 2]
            friction = tau[start, 0] - self.rigid[start, 0] - self.friction[start, 0]
            tau[start : start + 75, 0] += push_nm * np.sign(friction + 1e-9)
        t = start_s + np.arange(SAMPLES) / 250.0
        names = ("t", "q1", "q2", "dq1", "dq2", "tau1", "tau2")
        columns = np.column_stack([t, self.q, self.dq, tau]).round(6)
        path.parent.mkdir(parents=True, exist_ok=True)
        csv.write_csv(pa.table(dict(zip(names, columns.T, strict=True))), path)


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    done = subprocess.run([*RUN, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode in (0, 1, 3), done.stderr[-3000:]
    return done


def damaged(folder: Path) -> list[str]:
    """Ten logs that cannot be judged."""
    rng, made = np.random.default_rng(0), []
    for k in range(10):
        name = f"damaged-{k}." + ("csv", "mcap", "bag", "csv", "db3")[k % 5]
        kinds = (b"", rng.bytes(5000), b"#ROSBAG V2.0\n" + rng.bytes(3000), b"t,q1,q2\n0,x,\n", b"SQLite format 3\0")
        content = kinds[k % 5]
        (folder / name).write_bytes(content + bytes([k]) * (k > 4))
        made.append(name)
    return made


def hostile(folder: Path) -> list[str]:
    """Three logs that are meant ill: a name that steers terminals and CI, a bomb, a length beyond all memory."""
    names = ["\x1b[2J::error::hostile.csv", "bomb.csv.gz", "huge.mcap"]
    (folder / names[0]).write_text("t,q1\n0,1\n")
    with gzip.open(folder / names[1], "wb", 1) as file:
        for _ in range(300):
            file.write(b"0" * 10_000_000)
    (folder / names[2]).write_bytes(b"\x89MCAP0\r\n" + b"\x06" + (2**62).to_bytes(8, "little") + b"\0" * 100)
    return names


def main(work: Path, logs: int, nights: int, robots: int, followed: int) -> int:
    module = small_arm()
    arm, config, friction = Arm(module), work / "arm.toml", work / "friction.json"
    work.mkdir(parents=True, exist_ok=True)
    config.write_text(module.CONFIG)  # type: ignore[attr-defined]
    module.write_arm_csv(work / "fit.csv")  # type: ignore[attr-defined]
    run("fit", work / "fit.csv", "-c", config, "-o", friction)
    names = [f"robot-{k:02d}" for k in range(robots)]
    history_of = sorted(names, key=lambda name: name not in (WORN, SWAPPED))[:followed]
    begin, swap = nights // 6, 2 * nights // 3
    settings = ["-c", config, "--friction", friction]
    last, history = work / "night", work / "history"
    planted: dict[str, str] = {}
    for night in range(nights):
        for number, robot in enumerate(names):
            count = -(-logs // robots) if night == nights - 1 else int(robot in history_of)
            for k in range(count):
                push = {3: 12.0, 11: 3.6}.get((number + robots * k) % 20, 0.0) if night == nights - 1 else 0.0
                name = f"{robot}-{night:03d}-{k:03d}.csv"
                if push:
                    planted[name] = "contact" if push > 4 else "near miss"
                place = last if night == nights - 1 else history / f"{night // TOGETHER:03d}"
                wear = GROWTH * max(0, night - begin) if robot == WORN else 0.0
                seed = number + robots * (night + nights * k)
                start = (FIRST + night).astype("datetime64[s]").astype(float) + 60.0 * k
                arm.write(place / robot / name, seed, start, wear, robot == SWAPPED and night >= swap, push)
    bad = damaged(last / names[0]), hostile(last / names[1])
    for part in sorted(history.iterdir()):  # several nights an audit: each log counts to its own date
        run("audit", part, *settings, "-o", work / "out-history", "--store", work / "store",
            "--robot", "{folder}", "-j", 2, "--timeout", 120)  # fmt: skip
    return check(work, settings, (last, FIRST + nights - 1), planted, bad, (str(FIRST + begin), str(FIRST + swap)))


def check(
    work: Path,
    settings: list[object],
    night: tuple[Path, object],
    planted: dict[str, str],
    bad: tuple[list[str], list[str]],
    dates: tuple[str, str],
) -> int:
    """Audit the last night, compare with what was planted, measure; 1 where something is wrong."""
    out = work / "out"
    start = time.monotonic()
    done = run("audit", night[0], *settings, "-o", out, "--store", work / "store", "--robot", "{folder}",
               "--night", night[1], "-j", 2, "--timeout", 120, "--memory-limit", 4)  # fmt: skip
    took = time.monotonic() - start
    summary = json.loads((out / "summary.json").read_text())
    wrong = []
    for entry in summary["logs"]:
        name, verdict = entry["name"], entry["verdict"]
        ill = name in bad[0] or any(name.endswith(h[-9:]) for h in bad[1])
        expected = "not_judged" if ill else "fail" if planted.get(name) == "contact" else "pass"
        swapped = name.startswith(SWAPPED)  # a tool that is not stated may alarm
        near = planted.get(name) == "near miss" and not entry["near_misses"]
        if (verdict != expected and not swapped) or near:
            wrong.append(f"{name!r}: {verdict}, expected {expected}, {entry['near_misses']} near misses")
    steering = "\x1b" in done.stderr + done.stdout or any(x.startswith("::") for x in done.stderr.splitlines())
    found = json.loads(run("trend", work / "store", "-o", work / "trend.html", "--json").stdout)["robots"]
    events = {robot["robot"]: robot["events"] for robot in found if robot["events"]}
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
    print(f"{len(summary['logs'])} logs in {took:.0f} s on two workers: {len(summary['logs']) / took:.2f} "
          f"log-hours a minute; largest process {peak:.2f} GB")  # fmt: skip
    for robot, own in events.items():
        for event in own:
            change = event["changes"][0]
            print(f"  {robot}: {event['cause']}, {change['joint']}, {change['night']} {change['night_ci95']}, told "
                  f"{change['told_night']}, a night {change['per_night']} {change['per_night_ci95']}")  # fmt: skip
    wrong += unexpected(events, dates)
    if steering:
        wrong.append("a name steered the terminal")
    print("\n".join(wrong) or "everything planted was found and named, and nothing else", flush=True)
    measure(work, settings, night[0])
    return int(bool(wrong))


def unexpected(events: dict[str, list[dict[str, object]]], dates: tuple[str, str]) -> list[str]:
    """What the trends say wrongly, or not."""
    wrong = [f"{robot}: an event where nothing was planted" for robot in events if robot not in (WORN, SWAPPED)]
    for robot, cause, joint, date in (
        (WORN, "wear-like growth", "joint2", dates[0]),
        (SWAPPED, "payload or tool", None, dates[1]),
    ):
        own = [event for event in events.get(robot, []) if event["cause"] == cause]
        changes = [change for event in own for change in event["changes"]]  # type: ignore[attr-defined]
        hit = [c for c in changes if c["night_ci95"][0] <= date <= c["night_ci95"][1] and joint in (None, c["joint"])]
        if not hit:
            wrong.append(f"{robot}: {cause} since {date} was not found: {events.get(robot)}")
        if len(events.get(robot, [])) > 1:
            wrong.append(f"{robot}: {len(events[robot])} events, one planted")
    return wrong


def measure(work: Path, settings: list[object], night: Path) -> None:
    """The same logs one by one with ``detect``, and on one and two workers: wall clock and processor time."""
    logs = sorted(path for path in night.rglob("robot-0*.csv"))[:SAMPLE_LOGS]
    ways = {
        "detect, one by one": lambda: [run("detect", log, *settings, "-o", work / "run") for log in logs],
        "audit -j 1": lambda: run("audit", *logs, *settings, "-o", work / "out-1"),
        "audit -j 2": lambda: run("audit", *logs, *settings, "-o", work / "out-2", "-j", 2),
    }
    for name, way in ways.items():
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        way()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        took = time.monotonic() - start
        rate = f"{len(logs) / took:.2f} log-hours a minute, load {os.getloadavg()[0]:.1f}"
        print(f"  {name}: {len(logs)} logs, {took:.1f} s, {cpu:.1f} s of processor time, {rate}", flush=True)


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[2:]]
    sys.exit(main(Path(sys.argv[1]), *(numbers + [1000, 60, 20, 20][len(numbers) :])))
