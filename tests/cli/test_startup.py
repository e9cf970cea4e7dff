"""The command line imports nothing heavy before a command needs it; `tests/bench` has its time."""

import os
import subprocess
import sys

import pytest

from collaudit.cli.main import collaudit


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\nfrom collaudit.cli.main import run\nrun(['--help'])\n"
        "heavy = {'numpy', 'scipy', 'pandas', 'msgspec', 'pyarrow', 'IPython', 'pinocchio', 'mcap', 'rosbags'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stderr.strip() == "[]"


def test_help_of_a_command_imports_nothing_that_computes() -> None:
    """All commands in one process, one after the other: the first that imports any is named."""
    code = (
        "import sys\nfrom collaudit.cli.main import collaudit, run\n"
        "heavy = {'scipy', 'pandas', 'pyarrow', 'IPython', 'pinocchio', 'mcap', 'rosbags'}\n"
        "for name in collaudit.summaries:\n"
        "    assert run([name, '--help']) == 0\n"
        "    assert not heavy & set(sys.modules), (name, heavy & set(sys.modules))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("Examples:\n  collaudit ") == len(collaudit.summaries)


@pytest.mark.parametrize(("debug", "shown"), [("", False), ("1", True)])
def test_warnings_of_libraries_do_not_reach_users(debug: str, shown: bool) -> None:
    code = (
        "import sys, warnings\nfrom collaudit.cli import main as entry\n"
        "entry.run = lambda args: warnings.warn('overflow encountered', RuntimeWarning)\nentry.main([])"
    )
    environment = os.environ | {"COLLAUDIT_DEBUG": debug}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert ("overflow encountered" in done.stderr) is shown


def test_ending_looks_for_no_garbage() -> None:
    code = (
        "import atexit, gc\natexit.register(lambda: print(gc.get_freeze_count() > 1000))\n"
        "from collaudit.cli import main as entry\nentry.run = lambda args: 3\nentry.main([])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (3, "True\n"), done.stderr


def test_too_little_memory_to_start_is_no_bug() -> None:
    code = (
        "import sys\nfrom collaudit.cli import main as entry\n"
        "def fail(**_): raise ImportError('libx.so.6: failed to map segment from shared object')\n"
        "entry.collaudit.main = fail\nsys.exit(entry.run([]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 3
    assert "not enough memory to load the program: nothing was judged" in done.stderr and "bug" not in done.stderr
