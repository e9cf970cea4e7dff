"""Shared fixtures: where the real logs are, and what to say when they are not there."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from collaudit.core.numeric.linear_algebra import one_thread_of_linear_algebra
from collaudit.core.numeric.parallel import use_threads

one_thread_of_linear_algebra()  # as the commands do, and as early
if int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")) >= (os.cpu_count() or 1):
    use_threads(1)  # as the workers of an audit: the other cores have processes of their own
gc.set_threshold(200_000, 10, 20)  # as the commands do

# Where this package is installed, jsonschema builds its grammars of web addresses: a second, and no schema here asks.
sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]

sys.path.insert(0, str(Path(__file__).with_name("helpers")))  # importlib mode leaves the tests' folders off the path
pytest_plugins = ["simulated_logs"]

PROJECT = Path(__file__).resolve().parent.parent


@pytest.fixture(autouse=True, scope="session")
def without_waiting_for_the_disk() -> Iterator[None]:
    """What tests write need not outlive a power cut; the order of writing and renaming has a test of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _file: None)
        yield


def real_data_dir() -> Path:
    """The folder of real logs: ``COLLAUDIT_DATA``, or the one beside the project."""
    stated = os.environ.get("COLLAUDIT_DATA")
    return Path(stated) if stated else PROJECT.parent / "shared" / "data"


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Real logs; the test is skipped, saying so, where they are absent."""
    path = real_data_dir()
    if not path.is_dir():
        if os.environ.get("COLLAUDIT_REQUIRE_DATA"):
            pytest.fail(f"the real logs are required here and absent: {path}")
        pytest.skip(f"real logs absent: {path} (set COLLAUDIT_DATA to their folder)")
    return path


#: Tests that take longest, the longest first: minutes of simulation and fitting, or whole commands one after the other.
LONGEST = (
    "test_intervals_hold_the_truth_as_often_as_they_say",
    "test_every_line_of_the_quick_start_runs",
    "test_it_passes_on_this_machine",
    "test_axe_finds_nothing_at_any_width_light_or_dark",
    "test_a_push_that_nothing_measured_never_passes",
    "test_ur10_from_inspect_to_report",
    "test_a_push_of_the_asked_force_never_passes",
    "test_what_was_open_is_determined",
    "test_an_lbr_without_time_goes_from_init_to_audit_once_its_rate_and_sign_are_stated",
    "test_a_log_of_the_motors_is_audited_as_one_of_the_joints",
    "test_pushes_in_the_fitting_log_are_left_out",
    "test_a_dead_or_hanging_worker_costs_its_log_only",
    "test_the_page_runs",
    "test_mutants",
    "test_noise_in_the_acceleration_is_not_subtracted",
    "test_what_a_description_lacks_is_no_scale_and_a_scale_shows_beside_it",
    "test_results_do_not_depend_on_threads",
    "test_small_files_stay_small_in_memory",
    "test_every_line_of_the_tutorial_runs",
    "test_an_identification_run_is_left_whole",
    "test_an_ended_audit_leaves_no_verdict_no_part_and_no_worker",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest tests first: begun last, one of them would keep a single process busy while the others wait."""
    rank = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.name.partition("[")[0], len(rank)))


def pytest_collection_finish() -> None:
    """Take modules and thousands of tests out of the garbage collector's rounds: they took 3 % of the tests' time.

    Without a round before it, which finds little.
    """
    gc.freeze()
