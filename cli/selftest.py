"""Does this installation compute what it should? Known-truth logs, audited and compared with their truth."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.cli.truth import compare_events, compare_friction, curve_error, read_truth
from collaudit.core.errors import CollauditError

if TYPE_CHECKING:
    from collaudit.fixtures.simulate import SimulatedFiles

SELFTEST_SCHEMA = "collaudit/selftest/1"
_SEED = 1
_CURVE_LIMIT = 0.03
_FITTED = (1, 2)
_SPEEDS = 10
_SHORT_S = 12.0
_FORMATS = ("csv", "mcap", "bag", "db3")


@dataclass(frozen=True, slots=True)
class Check:
    """One comparison.

    Attributes:
        name: what was compared.
        passed: whether it is as it should be.
        expected: what should be.
        found: what is.
    """

    name: str
    passed: bool
    expected: str
    found: str


@dataclass(frozen=True, slots=True)
class _Job:
    """A log to simulate."""

    key: str
    scenario: str
    robot: str
    fmt: str
    duration_s: float | None = None


def run_selftest(folder: Path, progress: Callable[[int, int], None]) -> list[Check]:
    """Simulate the logs into ``folder``, two at a time, and make every comparison.

    Args:
        folder: scratch.
        progress: called with logs done and in all.
    """
    jobs = _jobs()
    files: dict[str, SimulatedFiles] = {}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        futures: list[tuple[_Job, Future[SimulatedFiles]]] = [
            (job, pool.submit(_simulate, job, folder)) for job in jobs
        ]
        for job, future in futures:
            files[job.key] = future.result()
            progress(len(files), len(jobs))
    checks = [*_friction_and_pushes(files, folder), _formats_agree(files)]
    return [*checks, *(_fault_is_named(job, files[job.key]) for job in jobs if job.scenario.startswith("faulty"))]


def selftest_json(checks: list[Check]) -> str:
    """The result as a file to keep: versions, machine, every check."""
    import platform

    from collaudit.cli.provenance import versions

    content = {
        "schema": SELFTEST_SCHEMA,
        "passed": all(check.passed for check in checks),
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "packages": versions(),
        "checks": [asdict(check) for check in checks],
    }
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _jobs() -> list[_Job]:
    from collaudit.fixtures.scenarios import SCENARIOS

    long = [_Job("friction", "friction", "paper6", "mcap"), _Job("run", "polish-const", "paper6", "mcap")]
    formats = [_Job(f"format-{fmt}", "stop-go", "seven", fmt, _SHORT_S) for fmt in _FORMATS]
    faults = [_Job(name, name, "paper6", "mcap") for name in SCENARIOS if name.startswith("faulty")]
    return [*long, *formats, *faults]


def _simulate(job: _Job, folder: Path) -> SimulatedFiles:
    from collaudit.fixtures.simulate import Reduction, simulate_to

    home = folder / job.key
    home.mkdir()
    suffix = "" if job.fmt == "db3" else f".{job.fmt}"
    reduction = Reduction(joints=_FITTED, speeds=_SPEEDS)
    path = home / f"log{suffix}"
    return simulate_to(job.scenario, job.robot, _SEED, job.fmt, path, duration_s=job.duration_s, reduction=reduction)


def _friction_and_pushes(files: dict[str, SimulatedFiles], folder: Path) -> Iterator[Check]:
    """Friction curves against the truth; then a polishing run judged with that friction."""
    from collaudit.cli.chain import judge, prepare_log
    from collaudit.cli.provenance import make_provenance
    from collaudit.core.audit import fit_logs
    from collaudit.core.config import load_config
    from collaudit.reports.files import write_friction

    loaded = load_config(files["friction"].config)
    prepared = prepare_log(files["friction"].log, loaded)
    friction = fit_logs([prepared], loaded.config, make_provenance(loaded, None, prepared.robot.sha256))
    truth = read_truth(files["friction"].truth)
    for joint in (f"joint{number}" for number in _FITTED):
        error = curve_error(friction.joints[joint], truth["friction"][joint])
        found = "not fitted" if error is None else f"{100 * error:.2f} %"
        name, limit = f"friction curve of {joint}", f"within {100 * _CURVE_LIMIT:g} % of the truth"
        yield Check(name, error is not None and error <= _CURVE_LIMIT, limit, found)
    inside = [c.inside for c in compare_friction(friction.joints, truth) if c.inside is not None]
    # At 95 % a truth may lie outside now and then; most of them outside would be a wrong interval.
    enough = len(inside) > 0 and sum(inside) >= 0.75 * len(inside)
    yield Check("95 % intervals hold the truth", enough, "at least 3 of 4", f"{sum(inside)} of {len(inside)}")
    path = folder / "friction.json"
    write_friction(path, friction)
    settings = load_config(files["run"].config, {"friction.file": str(path), "detect.watch": ["joint1"]})
    audit, _ = judge(files["run"].log, settings)
    comparison = compare_events(audit.result, read_truth(files["run"].truth), ["joint1"])
    hit = sum(push.alarm is not None for push in comparison.pushes)
    count = len(comparison.pushes)
    yield Check("pushes found", hit == count > 0, f"{count}", f"{hit}")
    yield Check("false alarms", not comparison.false_alarms, "0", str(len(comparison.false_alarms)))
    limit_s = (audit.result.rule.n + 2) * audit.result.log.sample_period_s
    worst = max((push.delay_s for push in comparison.pushes if push.delay_s is not None), default=float("inf"))
    yield Check("detection delay", worst <= limit_s, f"at most {1e3 * limit_s:.0f} ms", f"{1e3 * worst:.0f} ms")


def _formats_agree(files: dict[str, SimulatedFiles]) -> Check:
    """The same recording in every format gives the same audit, but for what names the log."""
    from collaudit.cli.chain import judge
    from collaudit.core.config import load_config
    from collaudit.reports.files import audit_json

    texts = {}
    for fmt in _FORMATS:
        simulated = files[f"format-{fmt}"]
        result = judge(simulated.log, load_config(simulated.config))[0].result
        log = replace(result.log, name="", sha256="", format="", topic="", time_source="", start=None)
        provenance = replace(result.provenance, config_sha256=None)
        texts[fmt] = audit_json(replace(result, log=log, provenance=provenance, findings=()))
    other = [fmt for fmt in _FORMATS if texts[fmt] != texts["mcap"]]
    found = "the same" if not other else f"{', '.join(other)} differ from mcap"
    return Check(f"audits of one recording as {', '.join(_FORMATS)}", not other, "the same", found)


def _fault_is_named(job: _Job, files: SimulatedFiles) -> Check:
    """A spoilt log gives the finding that names its fault, or a clear error, and never a silent pass."""
    from collaudit.cli.chain import judge
    from collaudit.core.config import load_config

    fault = read_truth(files.truth)["fault"]
    expected, may_fail = list(fault["expected"]), bool(fault.get("error"))
    wanted = " or ".join([*expected, *(["an error"] if may_fail else [])])
    try:
        codes = {finding.code for finding in judge(files.log, load_config(files.config))[0].result.findings}
    except CollauditError as error:
        return Check(job.scenario, may_fail, wanted, f"error: {error.message}")
    named = sorted(codes.intersection(expected))
    return Check(job.scenario, bool(named), wanted, ", ".join(named) or "no such finding")
