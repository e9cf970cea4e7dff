"""Installs the wheel with the oldest and the newest dependencies it allows, and runs ``collaudit selftest`` in each.

``python tests/bench/install_matrix.py [bounds|newest ...]`` (both when none is named). ``bounds``: every direct
dependency, extras included, at its lower bound of setup.cfg, on Python 3.11. ``newest``: the newest of each, on every
Python from 3.11 to 3.13 that is there or that uv can
fetch. Needs the package ``uv``. Ends with 1 where a selftest fails.
"""

from __future__ import annotations

import configparser
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
PYTHONS = ("3.11", "3.12", "3.13")
EXTRAS = ("hdf5",)


def requirements() -> list[str]:
    """Direct dependencies as setup.cfg states them."""
    setup = configparser.ConfigParser()
    setup.read(PROJECT / "setup.cfg")
    lines = setup["options"]["install_requires"].splitlines()
    for extra in EXTRAS:
        lines += setup["options.extras_require"][extra].splitlines()
    return [line.strip() for line in lines if line.strip()]


def uv(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([shutil.which("uv") or "uv", *map(str, arguments)], capture_output=True, text=True)


def selftest(wheel: Path, python: str, resolution: str, folder: Path) -> bool:
    """Install in a new environment, and say what the selftest says."""
    place = folder / f"{python}-{resolution}"
    made = uv("venv", "--python", python, place)
    if made.returncode:
        print(f"Python {python}: not there, and cannot be fetched", flush=True)
        return True
    direct = requirements() if resolution == "lowest-direct" else []
    done = uv("pip", "install", "--python", place / "bin" / "python", "--resolution", resolution, wheel, *direct)
    if done.returncode:
        print(f"Python {python}, {resolution}: cannot be installed\n{done.stderr}", flush=True)
        return False
    run = subprocess.run([place / "bin" / "collaudit", "selftest"], capture_output=True, text=True)
    last = (run.stdout.strip() or run.stderr.strip()).splitlines()[-1:]
    print(f"Python {python}, {resolution}: exit {run.returncode}; {''.join(last)}", flush=True)
    if run.returncode:
        print(run.stdout[-2000:], run.stderr[-2000:])
    return run.returncode == 0


def main(wanted: list[str]) -> int:
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory(prefix="collaudit-install-") as name:
        folder = Path(name)
        build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(PROJECT)]
        subprocess.run(build, check=True)
        (wheel,) = folder.glob("collaudit-*.whl")
        good = [selftest(wheel, PYTHONS[0], "lowest-direct", folder)] if "bounds" in wanted else []
        good += [selftest(wheel, python, "highest", folder) for python in PYTHONS] if "newest" in wanted else []
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or ["bounds", "newest"]))
