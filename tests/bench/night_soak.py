"""A night that everything goes wrong in: ``python tests/bench/night_soak.py [LOGS] [KILLS] [SEED]`` (500, 50, 1).

LOGS logs of 4 s, 20 recordings each with a comment of its own and every seventh with a push, are audited by two
workers. Workers are killed at KILLS random moments; the disk that OUT lies on is full once for some seconds; once the
audit gets SIGTERM. It goes on with ``--resume`` until every log was judged. Then no finished log may have been judged
twice, and the folder must equal that of an undisturbed audit byte for byte. Ends with 1 where it does not.

OUT lies on a tmpfs that is filled up (ENOSPC) where this user may mount one. Elsewhere the audit runs under a limit of
file size for that time (EFBIG).
"""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))
from small_arm import arm_module

RUN = [sys.executable, "-c", "import sys; from collaudit.cli.main import main; sys.exit(main())"]
LIMIT_BYTES = 100_000  # a report is larger, a result smaller
FULL_S = 15.0
RECORDINGS = 20
POLL_S = 0.1


@dataclass
class Done:
    """What was done to the audit."""

    kills: int = 0
    full: int = 0
    terminated: int = 0
    starts: int = 0


def make(folder: Path, count: int) -> list[str]:
    """Logs, friction and settings in a folder; the arguments of the audit but for OUT."""
    arm = arm_module()
    config, logs, friction = folder / "arm.toml", folder / "logs", folder / "friction.json"
    logs.mkdir()
    config.write_text(arm.CONFIG)
    arm.write_arm_csv(folder / "fit.csv")
    fit = ["fit", str(folder / "fit.csv"), "-c", str(config), "-o", str(friction)]
    subprocess.run([*RUN, *fit], check=True, capture_output=True)
    texts = []
    for seed in range(min(RECORDINGS, count)):
        arm.write_arm_csv(folder / "one.csv", push_nm=12.0 * (seed % 7 == 3), seed=seed)
        head, *rows = (folder / "one.csv").read_text().splitlines()
        fast = len(rows) // 2  # the fastest strokes of joint 1 end there
        texts.append("\n".join([head, *rows[fast - 1000 : fast]]) + "\n")
    for number in range(count):  # a comment makes each content, and so each hash, its own
        (logs / f"{number:04d}.csv").write_text(texts[number % len(texts)] + f"# {number}\n")
    return ["audit", str(logs), "-c", str(config), "--friction", str(friction), "-j", "2"]


def start(arguments: list[str], out: Path) -> subprocess.Popen[bytes]:
    command = [*RUN, *arguments, "-o", str(out), "--resume"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def workers(pid: int) -> list[int]:
    """Processes that judge logs: the audit's server of forks started them."""
    try:
        return [further for child in children(pid) for further in children(child)]
    except OSError:  # one has just ended
        return []


def children(pid: int) -> list[int]:
    """Processes that a process started, from any of its threads."""
    return [int(child) for task in Path(f"/proc/{pid}/task").glob("*/children") for child in task.read_text().split()]


def finished(out: Path) -> dict[str, int]:
    """Finished runs and when."""
    return {path.parent.name: path.stat().st_mtime_ns for path in out.glob("*/finished.json")}


@contextmanager
def disk(folder: Path, megabytes: int) -> Iterator[bool]:
    """A small disk of its own at ``folder``, where this user may mount one; says whether it is."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(folder)]
    own = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    try:
        yield own
    finally:
        if own:
            subprocess.run(["umount", str(folder)], check=True)


@contextmanager
def full_disk(folder: Path, own: bool, pid: int) -> Iterator[None]:
    """Nothing can be written in the block: the disk is filled, or files of the audit and its workers are limited."""
    if not own:
        unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
        for one in (pid, *workers(pid)):
            resource.prlimit(one, resource.RLIMIT_FSIZE, (LIMIT_BYTES, resource.RLIM_INFINITY))
        yield
        for one in (pid, *workers(pid)):
            resource.prlimit(one, resource.RLIMIT_FSIZE, unlimited)
        return
    ballast = folder / "ballast"
    with ballast.open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            yield
    ballast.unlink()


def disturb(arguments: list[str], folder: Path, own: bool, count: int, moments: list[int], rng: random.Random) -> Done:
    """Run until all is judged, killing a worker when so many logs are finished as each of ``moments`` says."""
    done, out, kills = Done(), folder / "out", len(moments)
    while True:
        before = finished(out)
        process = start(arguments, out)
        done.starts += 1
        while process.poll() is None:
            time.sleep(POLL_S)
            have = len(finished(out))
            if moments and have >= moments[0]:
                time.sleep(rng.uniform(0, 0.5))
                if found := workers(process.pid):
                    os.kill(rng.choice(found), signal.SIGKILL)
                    done.kills += 1
                    moments = moments[1:]
            if not done.full and have > count // 4:
                with full_disk(folder, own, process.pid):
                    time.sleep(FULL_S)
                done.full = 1
            if not done.terminated and have > count // 2:
                done.terminated = 1
                process.send_signal(signal.SIGTERM)
                process.wait(timeout=30)
        after = finished(out)
        again = {name for name, at in after.items() if name in before and at != before[name]}
        assert not again, f"judged twice: {sorted(again)[:5]}"
        print(f"  ended with {process.returncode}; {len(after)} of {count} finished, {asdict(done)}", flush=True)
        assert process.returncode in (1, 2, 3, 143), "it did not end as one that was disturbed ends"
        if len(after) == count and process.returncode == 1:
            assert done.full and done.terminated and done.kills == kills, "too few logs for all that"
            return done


def contents(out: Path) -> dict[str, bytes]:
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}


def main(count: int, kills: int, seed: int) -> int:
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    rng, began = random.Random(seed), time.monotonic()
    with tempfile.TemporaryDirectory(prefix="collaudit-soak-") as name:
        folder = Path(name)
        arguments = make(folder, count)
        moments = sorted(rng.randrange(count * 9 // 10) for _ in range(kills))
        with disk(folder / "disk", 200 + 2 * count) as own:
            print(f"disk that fills up: {'tmpfs (ENOSPC)' if own else 'limit of file size (EFBIG)'}", flush=True)
            done = disturb(arguments, folder / "disk", own, count, moments, rng)
            one = contents(folder / "disk" / "out")
        plain = start(arguments, folder / "quiet")
        plain.communicate()
        other = contents(folder / "quiet")
    verdicts = [log["verdict"] for log in json.loads(one["summary.json"])["logs"]]
    tally = {verdict: verdicts.count(verdict) for verdict in sorted(set(verdicts))}
    minutes = (time.monotonic() - began) / 60
    print(f"{count} logs, {asdict(done)}: {tally}; {len(one)} files, exit {plain.returncode}, {minutes:.0f} min")
    different = sorted(path for path in one.keys() | other.keys() if one.get(path) != other.get(path))
    print("equal byte for byte" if not different else f"different: {different[:10]}")
    return 0 if not different and "not_judged" not in tally and len(verdicts) == count else 1


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*given, *(500, 50, 1)[len(given) :]))
