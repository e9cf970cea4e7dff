"""At a prompt and in a notebook: a screen of text, and a table that runs nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import samples

from collaudit.core import api
from collaudit.core.data.joint_log import JointLog, LogSource
from collaudit.core.errors import LogError


def log() -> JointLog:
    time_s = np.arange(500) * 0.01
    position = np.sin(time_s)[:, None] * np.ones(2)
    source = LogSource("x.csv", "0", "csv", None, "column", "x")
    return JointLog(time_s, ("a", "b"), position, None, 2 * position, "Nm", None, source)


@pytest.mark.parametrize("make", [samples.failed, samples.not_judged, samples.busy, samples.hostile])
def test_an_audit_is_one_screen(make) -> None:
    audit = make()
    for shown in (audit, audit.result):
        lines = repr(shown).splitlines()
        assert 3 <= len(lines) <= 24 and max(map(len, lines)) <= 100
    assert audit.result.verdict.replace("_", " ").upper() in repr(audit)
    assert audit.result.log.name[:30] in repr(audit)


def test_what_is_shown_is_what_was_found() -> None:
    audit = samples.busy(30)
    assert "; and 25 more" in repr(audit), "five of the thirty contacts, and how many are left"
    assert f"{audit.result.contacts[0].onset_s:.3f} s" in repr(audit)
    for joint, gamma in audit.result.rule.gamma_nm.items():
        assert f"{joint} {gamma:.3g}" in repr(audit)
    assert "wrist_3 not fitted" in " ".join(repr(samples.friction_file()).split())


def test_a_log_and_signals_are_short_too() -> None:
    assert "500, about 100 Hz" in repr(log()) and "velocity_rad_s" in repr(log())
    assert len(repr(samples.failed().signals)) < 400


def test_a_notebook_shows_a_table_in_which_no_text_is_markup() -> None:
    shown = samples.hostile()._repr_html_()
    assert "<table>" in shown and "&lt;script&gt;" in shown
    assert "<script" not in shown and "<img" not in shown and "<svg" not in shown


def test_tables_without_rows_have_the_types_of_those_with() -> None:
    some, none = samples.busy(), samples.passed()
    none = replace(none, result=replace(none.result, findings=()))
    for table in (api.alarms, api.near_misses, api.contacts, api.disturbances, api.findings):
        empty, full = table(none), table(some)
        assert len(empty) == 0
        assert empty.dtypes.to_dict() == full.dtypes.to_dict(), table.__name__
        assert pd.concat([empty, full]).dtypes.to_dict() == full.dtypes.to_dict()
    assert api.contacts(none)["force_n"].dtype == np.float64
    assert api.alarms(none)["joint"].dtype == "str"
    assert api.contacts(samples.busy())["force_high_n"].tolist() == [54.0] * 30


def test_many_logs_are_one_table() -> None:
    error = LogError("the file is cut short", where="b.mcap")
    table = api.overview([samples.failed(), error, samples.passed()])
    assert table["verdict"].tolist() == ["fail", "not_judged", "pass"]
    assert table["log"].tolist()[1] == "b.mcap" and table["why"].tolist()[1] == "the file is cut short"
    assert table["contacts"].isna().tolist() == [False, True, False], "what was not judged has no count"
    assert api.overview([]).dtypes.to_dict() == table.dtypes.to_dict()


def test_a_log_that_cannot_be_read_does_not_end_the_others(tmp_path) -> None:
    (tmp_path / "a.csv").write_text("no log\n")
    made = api.audits([tmp_path / "a.csv", tmp_path / "absent.mcap"], api.load_config(None))
    assert all(isinstance(one, LogError) for one in made)
