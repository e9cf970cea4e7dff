"""A night that everything goes wrong in: ``python tests/bench/night_soak.py [LOGS] [KILLS] [SEED]`` (500, 50, 1).

LOGS small logs of two kinds, clean and pushed, are audited by two workers. Workers are killed at random, KILLS in all;
once the audit runs under a file-size limit that its files exceed, as on a full disk (the process that writes gets
EFBIG, as it would get ENOSPC); once it gets SIGTERM. After each it goes on with ``--resume``. Then every log must have
been judged, no finished one twice, and the folder must equal that of an undisturbed audit byte for byte.
Ends with 1 where it does not.
"""

from __future__ import annotations

import importlib.util
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).resolve().parent
RUN = [sys.executable, "-c", "import sys; from collaudit.cli.main import main; sys.exit(main())"]
LIMIT_BYTES = 100_000  # a report is larger, a result smaller


def small_arm() -> object:
    """The arm of the command line's tests."""
    spec = importlib.util.spec_from_file_location("arm_of_tests", HERE.parents[0] / "cli" / "conftest.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def make(folder: Path, count: int) -> list[str]:
    """Logs, friction and settings in a folder; the arguments of the audit but for OUT."""
    arm = small_arm()
    config, logs, friction = folder / "arm.toml", folder / "logs", folder / "friction.json"
    logs.mkdir()
    config.write_text(arm.CONFIG)  # type: ignore[attr-defined]
    arm.write_arm_csv(folder / "fit.csv")  # type: ignore[attr-defined]
    fit = ["fit", str(folder / "fit.csv"), "-c", str(config), "-o", str(friction)]
    subprocess.run([*RUN, *fit], check=True, capture_output=True)
    texts = []
    for seed, push in ((1, 0.0), (2, 12.0)):
        arm.write_arm_csv(folder / "one.csv", push_nm=push, seed=seed)  # type: ignore[attr-defined]
        head, *rows = (folder / "one.csv").read_text().splitlines()
        fast = len(rows) // 2  # the fastest strokes of joint 1 end there
        texts.append("\n".join([head, *rows[fast - 1500 : fast]]) + "\n")
    for number in range(count):  # a comment makes each content, and so each hash, its own
        (logs / f"{number:04d}.csv").write_text(texts[number % 7 == 3] + f"# {number}\n")
    return ["audit", str(logs), "-c", str(config), "--friction", str(friction), "-j", "2"]


def start(arguments: list[str], out: Path, limit: Callable[[], None] | None = None) -> subprocess.Popen[bytes]:
    command = [*RUN, *arguments, "-o", str(out), "--resume"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, preexec_fn=limit)


def workers(pid: int) -> list[int]:
    """Processes that judge logs."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        return [int(child) for child in children if b"spawn" in Path(f"/proc/{child}/cmdline").read_bytes()]
    except OSError:
        return []


def finished(out: Path) -> dict[str, int]:
    """Finished runs and when."""
    return {path.parent.name: path.stat().st_mtime_ns for path in out.glob("*/finished.json")}


def full_disk() -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT_BYTES, LIMIT_BYTES))


def disturb(arguments: list[str], out: Path, count: int, kills: int, rng: random.Random) -> dict[str, int]:
    """Run until all is judged; what was done to it."""
    done = {"kills": 0, "full": 0, "terminated": 0, "starts": 0}
    while True:
        before = finished(out)
        full = not done["full"] and len(before) > count // 4
        process = start(arguments, out, full_disk if full else None)
        done["starts"] += 1
        last = time.monotonic()
        while process.poll() is None:
            time.sleep(0.05)
            have = len(finished(out))
            if full and time.monotonic() - last > 20:
                done["full"] = 1
                process.send_signal(signal.SIGTERM)
            elif not full and done["kills"] < kills and time.monotonic() - last > rng.uniform(0.5, 4.0):
                if (have > count * done["kills"] / kills) and (found := workers(process.pid)):
                    os.kill(rng.choice(found), signal.SIGKILL)
                    done["kills"] += 1
                    last = time.monotonic()
            elif not full and not done["terminated"] and have > count // 2:
                done["terminated"] = 1
                process.send_signal(signal.SIGTERM)
        again = {name for name, at in finished(out).items() if name in before and at != before[name]}
        assert not again, f"judged twice: {sorted(again)[:5]}"
        if len(finished(out)) == count and process.returncode in (0, 1):
            assert done["full"] and done["terminated"] and done["kills"] == kills, f"too few logs for all that: {done}"
            return done
        print(f"  ended with {process.returncode}; {len(finished(out))} of {count} finished, {done}", flush=True)
        assert process.returncode in (1, 2, 3, 143, -15), process.stderr.read()[-2000:] if process.stderr else ""


def contents(out: Path) -> dict[str, bytes]:
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}


def main(count: int, kills: int, seed: int) -> int:
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory(prefix="collaudit-soak-") as name:
        folder = Path(name)
        arguments = make(folder, count)
        done = disturb(arguments, folder / "disturbed", count, kills, random.Random(seed))
        plain = start(arguments, folder / "quiet")
        plain.communicate()
        one, other = contents(folder / "disturbed"), contents(folder / "quiet")
        verdicts = [log["verdict"] for log in json.loads(one["summary.json"])["logs"]]
        tally = {verdict: verdicts.count(verdict) for verdict in sorted(set(verdicts))}
        print(f"{count} logs, {done}: {tally}; {len(one)} files, exit {plain.returncode}")
        different = sorted(path for path in one.keys() | other.keys() if one.get(path) != other.get(path))
        print("equal byte for byte" if not different else f"different: {different[:10]}")
        return 0 if not different and "not_judged" not in tally and len(verdicts) == count else 1


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*given, *(500, 50, 1)[len(given) :]))
