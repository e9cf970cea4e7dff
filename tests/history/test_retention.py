"""What may go of stored runs: never what is needed, never a failure before a pass, and the plan before the deed."""

from __future__ import annotations

import random
from datetime import date, timedelta
from pathlib import Path

import pytest
from histories import HIT, night_row

from collaudit.cli.batch.stored_runs import needs_of, prune_store, runs_of_store
from collaudit.core.config.accepted import Acceptance
from collaudit.core.history.night_row import NightRow
from collaudit.core.history.retention import KeptRun, runs_to_prune
from collaudit.reports.files.result_store import ResultStore

TODAY = date(2026, 12, 31)
VERDICTS = ("pass", "pass", "pass", "fail", "not_judged")


def random_rows(rng: random.Random) -> list[NightRow]:
    """Judgements of two robots and two programs over 200 nights."""
    rows = []
    for k in range(rng.randrange(1, 40)):
        verdict = rng.choice(VERDICTS)
        day = (TODAY - timedelta(days=rng.randrange(200))).isoformat()
        robot, program = rng.choice("AB"), rng.choice(("pick", "place"))
        rows.append(
            night_row(robot, 0, night=day, log=f"{robot}/{program}_{day}.mcap", log_sha256=f"{k}", verdict=verdict,
                      contacts=(HIT,) if verdict == "fail" or rng.random() < 0.1 else ())
        )  # fmt: skip
    return rows


def random_acceptance(rng: random.Random) -> Acceptance:
    return Acceptance(
        robot=rng.choice(("A", None)),
        program=rng.choice(("A/pick_#.mcap", "B/place_#.mcap", "A/other.mcap")),
        peak_nm={"j1": 6.0},
        reason="by design",
        owner="A. Lee",
        until=TODAY + timedelta(days=rng.choice((-3, 20))),
    )


@pytest.mark.parametrize("seed", range(60))
def test_nothing_goes_that_a_reference_or_an_acceptance_needs(seed: int, tmp_path: Path) -> None:
    check_store(seed, tmp_path)


def check_store(seed: int, folder: Path) -> None:
    """A store of random nights, pruned by a random rule: the rules read off what is left, not off the plan."""
    rng = random.Random(seed)
    rows, accepted = random_rows(rng), [random_acceptance(rng) for _ in range(rng.randrange(3))]
    store = ResultStore(str(folder / "store"))
    for part in (rows[: len(rows) // 2], rows[len(rows) // 2 :]):
        store.append(part)
    keep = rng.randrange(100)
    keep_failed, most = keep + rng.randrange(100), rng.choice((None, 0, 200 * len(rows) // 2))
    runs = runs_of_store(store, needs_of(accepted, [], TODAY))
    gone = runs_to_prune(runs, keep, keep_failed, most, TODAY)
    assert store.rows() and len(store.rows()) == len(rows), "a plan takes nothing"
    prune_store(store, gone)
    left = {row.log_sha256: row for row in store.rows()}
    lost = [row for row in rows if row.log_sha256 not in left]
    assert len(lost) == len(gone) and all(left[row.log_sha256] == row for row in rows if row not in lost)
    for row in lost:
        program = row.log.partition("_")[0]
        later = [one for one in left.values() if one.log.partition("_")[0] == program and one.verdict != "not_judged"]
        assert row.verdict == "not_judged" or any(one.night >= row.night for one in later), "its reference is gone"
        meant = [one for one in accepted if one.program == f"{program}_#.mcap" and one.robot in (None, row.robot)]
        assert not row.contacts or all(one.until < TODAY for one in meant), "an acceptance needs it"
        if most is None:
            age = (TODAY - date.fromisoformat(row.night)).days
            assert age > (keep if row.verdict == "pass" else keep_failed)


def _run(k: int, days: int, verdict: str = "pass", size: int = 10, needed: str = "") -> KeptRun:
    return KeptRun(str(k), "A", f"program{k}", TODAY - timedelta(days=days), verdict, size, needed)  # type: ignore[arg-type]


def test_failures_stay_longer_and_size_takes_passes_first() -> None:
    latest = [_run(k, 0) for k in range(6)]  # the reference of each program
    runs = [_run(0, 40), _run(1, 40, "fail"), _run(2, 20), _run(3, 20, "not_judged"), _run(4, 200, "fail", 10, "why")]

    def gone(most: int | None) -> list[str]:
        return [run.place for run in runs_to_prune([*latest, *runs], 30, 180, most, TODAY)]

    assert gone(None) == ["0"] == gone(100), "old, and passed"
    assert gone(99) == ["0", "2"], "not old; the pass first"
    assert gone(0) == ["0", "1", "2", "3"], "what is needed stays, whatever its age, and so do references"


@pytest.mark.parametrize("log", ["/data/night/A/pick_2026-11-01.csv", "A/pick_*.csv", "s3://cell/*/pick_*.csv"])
def test_an_entry_that_means_a_path_keeps_the_logs_that_it_may_mean(log: str) -> None:
    entry = Acceptance(log=log, peak_nm={"j1": 6.0}, reason="tray", owner="A. Lee", until=TODAY)
    needed = needs_of([entry], [], TODAY)
    assert needed("A", "A/pick_2026-11-01.csv", None, True)
    assert not needed("A", "A/pick_2026-11-01.csv", None, False), "it has no contact"
    assert not needed("A", "A/place_2026-11-01.csv", None, True)
