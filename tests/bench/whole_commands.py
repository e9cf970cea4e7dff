"""Whole commands, from the start of the process to the last byte written, beside the straightforward script.

    python tests/bench/whole_commands.py [MINUTES ...]      (1, 10 and 60 when absent)

Every command runs in a process of its own. Of each length the script comes first, then ``detect`` cold (the log put out
of the page cache) and three times warm, of which the median is printed. Printed are the processor's seconds of all
threads, seconds that passed, peak memory, what was written, and the limit: bare decompression of the log in one thread.
The script runs on the same log, of more than ten minutes on ten and scaled; it is a loop. It is compared by the seconds
that passed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent
#: On a log that is longer, the script would keep the bench waiting.
MOST_SCRIPT_MINUTES = 10.0
TURNS = 3
MAIN = "from collaudit.cli.main import main; main()"
SCRIPT = "import sys, detection_script; from pathlib import Path; detection_script.run(Path(sys.argv[1]), True)"
MADE = "import sys, detection_hour as hour; print(hour.hour_log(float(sys.argv[1])))"
LIMIT = "import sys, test_logs_bench as b; from pathlib import Path; print(b.bare_decompression(Path(sys.argv[1])))"


@dataclass(frozen=True, slots=True)
class Cost:
    """What a process took: processor time and time that passed, s; peak memory, MB."""

    processor_s: float
    passed_s: float
    peak_mb: float


def cost(code: str, *arguments: object, codes: tuple[int, ...] = (0, 1, 3)) -> Cost:
    """Run code in a process of its own, with modules compiled once: as an installation does."""
    environment = dict(os.environ, PYTHONPATH=str(HERE), OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    start = time.perf_counter()
    command = [sys.executable, "-c", code, *map(str, arguments)]
    running = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    assert running.stderr is not None
    words = running.stderr.read()
    _, status, used = os.wait4(running.pid, 0)
    if os.waitstatus_to_exitcode(status) not in codes:
        raise RuntimeError(words.decode(errors="replace"))
    return Cost(used.ru_utime + used.ru_stime, time.perf_counter() - start, used.ru_maxrss / 1024)


def forget(path: Path) -> None:
    """Put a file out of the page cache, where the system lets us."""
    if hasattr(os, "posix_fadvise"):
        with path.open("rb") as stream:
            os.fsync(stream.fileno())
            os.posix_fadvise(stream.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def bench_log(minutes: float) -> Path:
    """The log of so many minutes, made in a process of its own: our memory would count as that of our children."""
    environment = dict(os.environ, PYTHONPATH=str(HERE))
    made = subprocess.run(
        [sys.executable, "-c", MADE, f"{minutes:g}"], env=environment, capture_output=True, check=True
    )
    return Path(made.stdout.decode().strip())


def written_mb(path: Path) -> float:
    """Size of a file or of the files of a folder."""
    files = path.rglob("*") if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file()) / 1e6


def line(name: str, minutes: float, found: Cost, made: Path | None = None, times: float | None = None) -> None:
    """Print one row of the table."""
    size = f"{written_mb(made):8.1f}" if made is not None else 8 * " "
    ratio = f"{times:6.1f} ×" if times is not None else ""
    numbers = f"{found.processor_s:8.2f} {found.passed_s:8.2f} {found.peak_mb:8.0f}"
    print(f"{minutes:4g} min  {name:<22}{numbers} {size}  {ratio}", flush=True)


@cache
def script_cost(minutes: float) -> Cost:
    """The straightforward script on a log of so many minutes."""
    return cost(SCRIPT, bench_log(minutes))


def measure(minutes: float, folder: Path) -> None:
    """The script and all commands on a log of so many minutes."""
    scripted = min(minutes, MOST_SCRIPT_MINUTES)
    script = script_cost(scripted)
    line("script", scripted, script)
    log = bench_log(minutes)
    config, run, page = log.with_suffix(".toml"), folder / f"run-{minutes:g}", folder / f"page-{minutes:g}.html"
    scaled = script.passed_s * minutes / scripted
    forget(log)
    detect = (MAIN, "detect", log, "-c", config, "-o", run)
    cold = cost(*detect)
    line("detect, cold", minutes, cold, run, scaled / cold.passed_s)
    warm = sorted((cost(*detect) for _ in range(TURNS)), key=lambda each: each.passed_s)[TURNS // 2]
    line("detect, warm", minutes, warm, run, scaled / warm.passed_s)
    line("inspect -c", minutes, cost(MAIN, "inspect", log, "-c", config))
    fitted = folder / "friction.json"
    line("fit, any motion", minutes, cost(MAIN, "fit", log, "-c", config, "--set", "fit.motion=any", "-o", fitted))
    line("report", minutes, cost(MAIN, "report", run, "-o", page), page)
    environment = dict(os.environ, PYTHONPATH=str(HERE))
    bare = subprocess.run([sys.executable, "-c", LIMIT, str(log)], env=environment, capture_output=True, check=True)
    print(
        f"{minutes:4g} min  limit: bare decompression {float(bare.stdout):.2f} s passed, without the start of a process"
    )


def main(lengths: list[float]) -> None:
    """Print the table."""
    print(f"{'':10}{'':22}{'processor s':>8} {'passed s':>8} {'peak MB':>8} {'written':>8}  script / ours")
    with tempfile.TemporaryDirectory() as name:
        for minutes in lengths:
            measure(minutes, Path(name))


if __name__ == "__main__":
    main([float(argument) for argument in sys.argv[1:]] or [1.0, 10.0, 60.0])
