"""The nights of a joint: what its logs say together, and what was not tested is no quiet night."""

from __future__ import annotations

import pytest
from histories import HIT, dark_row, history, night, night_row

from collaudit.core.history.night_row import joint_nights, rows_of_result


def test_logs_of_a_night_count_by_their_judged_time() -> None:
    rows = [
        night_row("a", 0, level_nm=0.2, judged_s=30.0, log="x", log_sha256="x"),
        night_row("a", 0, level_nm=0.6, judged_s=10.0, log="y", log_sha256="y", gamma_nm=5.0, contacts=(HIT, HIT)),
        night_row("a", 0, level_nm=None, judged_s=0.0, log="z", log_sha256="z", tested=False, gamma_nm=None),
    ]
    (one,) = joint_nights(rows)
    (found,) = one.nights
    assert (found.logs, found.tested, found.contacts, found.judged_s) == (3, 2, 2, 40.0)
    assert found.level_nm == pytest.approx(0.3) and found.gamma_nm == 5.0


def test_joints_and_nights_are_in_order_and_a_dark_log_has_none() -> None:
    rows = [*history("b", 3, ("j2", "j1"))[::-1], *history("a", 1), dark_row("a", 5)]
    found = joint_nights(rows)
    assert [(one.robot, one.joint) for one in found] == [
        ("a", "j1"),
        ("a", "j2"),
        ("a", "j3"),
        ("b", "j1"),
        ("b", "j2"),
    ]
    assert [each.night for each in found[-1].nights] == [night(0), night(1), night(2)]


def test_the_rows_of_an_audit(audited) -> None:
    rows = rows_of_result(audited, "cell", "2026-09-01", "stated")
    assert [row.joint for row in rows] == list(audited.coverage.joints)
    assert len({row.identity for row in rows}) == 1
    for row in rows:
        assert row.gamma_nm == audited.rule.gamma_nm.get(row.joint)
        assert row.tested == (audited.coverage.joints[row.joint].judged_s > 0)
        touched = [number for number, c in enumerate(audited.contacts, 1) if row.joint in c.joints]
        assert [contact.number for contact in row.contacts] == touched
    assert sum(len(row.contacts) for row in rows) == sum(len(contact.joints) for contact in audited.contacts) > 0


@pytest.fixture
def audited():
    import samples

    return samples.failed(4000).result
