"""Policy, waivers and baseline decide over an audit, and never make a pass of what nobody judged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

WAIVER = """
[[policy.waivers]]
rule = "contacts"
reason = "teaching by hand"
owner = "cell lead"
expires = {expires}
up_to = {up_to}
"""


@pytest.fixture
def night(arm, collaudit, tmp_path: Path):
    """Audit logs of the arm with more lines of configuration; exit code, lines of the summary, policy.json."""

    def run(logs, text: str = "", *flags: object, out: str = "out"):
        config = tmp_path / "collaudit.toml"
        config.write_text(f"{arm.config.read_text()}\n{text}", encoding="utf-8")
        command = ["audit", *logs, "-c", config, "--friction", arm.friction, "-o", tmp_path / out, *flags]
        done = collaudit(*command, "--as-of", "2026-06-15")
        entries = json.loads((tmp_path / out / "summary.json").read_text())["logs"]
        policy = json.loads((tmp_path / out / "policy.json").read_text())
        return done, {Path(entry["name"]).name: entry for entry in entries}, policy

    return run


def test_levels(arm, night) -> None:
    done, logs, _ = night([arm.pushed], '[policy]\nlevels = { contacts = "warn" }\n')
    assert done.code == 0 and logs["pushed.csv"]["verdict"] == "pass"
    assert "Warning: 1 contact (policy: at most 0)" in " ".join(logs["pushed.csv"]["reasons"])
    done, _, _ = night([arm.pushed], '[policy]\nlevels = { contacts = "warn" }\n', "--fail-on", "warn")
    assert done.code == 1
    done, logs, policy = night([arm.pushed], '[policy]\nlevels = { contacts = "off" }\n')
    assert done.code == 0 and not [rule for rule in policy["logs"][0]["rules"] if rule["rule"] == "contacts"]
    said = " ".join(logs["pushed.csv"]["reasons"])
    assert "Switched off by the policy: 1 contact" in said, "a pass must not read as if nothing was found"


def test_residual_limits_and_findings_by_code(arm, night, tmp_path: Path) -> None:
    done, _, policy = night([arm.clean], "[policy]\nmax_residual_rms_nm = { joint1 = 0.0001, joint2 = 50 }\n")
    states = {tuple(rule["joints"]): rule["state"] for rule in policy["logs"][0]["rules"] if rule["rule"] == "residual"}
    assert done.code == 1 and states == {("joint1",): "broken", ("joint2",): "kept"}
    code = json.loads((tmp_path / "out" / arm.run(arm.clean) / "audit.json").read_text())["findings"][0]["code"]
    done, logs, _ = night([arm.clean], f'[policy]\nfindings = {{ {code} = "error" }}\n')
    assert done.code == 1 and f"Finding {code}:" in " ".join(logs["clean.csv"]["reasons"])
    assert night([arm.clean], f'[policy]\nfindings = {{ {code} = "warn" }}\n')[0].code == 0


def test_what_a_rule_cannot_know_is_not_judged(arm, night) -> None:
    for text, said in (
        ("max_fit_age_days = 30", "does not say when"),
        ("max_friction_change = 0.1", "no baseline"),
        ("min_observable_s = 100000", "at least"),
    ):
        done, logs, _ = night([arm.clean], f"[policy]\n{text}\n")
        assert done.code == 3 and logs["clean.csv"]["verdict"] == "not_judged", text
        assert said.split()[-1] in " ".join(logs["clean.csv"]["reasons"]), text
    done, _, _ = night([arm.clean], "[policy]\nmin_observable_s = 100000\n", "--fail-on", "not-judged")
    assert done.code == 1


def test_a_waiver_waives_until_its_day_and_up_to_its_size(arm, night) -> None:
    done, logs, policy = night([arm.pushed, arm.clean], WAIVER.format(expires="2026-06-15", up_to=1))
    assert done.code == 0 and logs["pushed.csv"]["verdict"] == "pass"
    assert "teaching by hand" in " ".join(logs["pushed.csv"]["reasons"])
    assert policy["findings"] == []
    done, logs, policy = night([arm.pushed], WAIVER.format(expires="2026-06-14", up_to=1))
    assert done.code == 1 and logs["pushed.csv"]["verdict"] == "fail"
    assert [finding["code"] for finding in policy["findings"]] == ["waiver-expired"]
    assert "waiver-expired" in done.err
    assert night([arm.pushed], WAIVER.format(expires="2026-06-15", up_to=0))[0].code == 1
    _, _, policy = night([arm.clean], WAIVER.format(expires="2026-06-15", up_to=1))
    assert [finding["code"] for finding in policy["findings"]] == ["waiver-unused"]
    expired = WAIVER.format(expires="2026-06-14", up_to=1)
    assert night([arm.clean], f'[policy]\nfindings = {{ waiver-expired = "error" }}\n{expired}')[0].code == 1


def test_a_waived_contact_in_a_log_that_is_not_judged_is_no_pass(arm, night) -> None:
    text = "[policy]\nobservable_nm = 0.01\n" + WAIVER.format(expires="2026-12-31", up_to=9)
    done, logs, policy = night([arm.pushed], text)
    assert done.code == 3 and logs["pushed.csv"]["verdict"] == "not_judged"
    assert {rule["state"] for rule in policy["logs"][0]["rules"]} == {"waived"}


def test_the_log_keeps_its_own_verdict(arm, night, tmp_path: Path) -> None:
    night([arm.pushed], WAIVER.format(expires="2026-12-31", up_to=1))
    assert json.loads((tmp_path / "out" / arm.run(arm.pushed) / "audit.json").read_text())["verdict"] == "fail"


def test_formats_show_the_decision(arm, night, tmp_path: Path) -> None:
    text = WAIVER.format(expires="2026-12-31", up_to=1)
    night([arm.pushed], text, "--format", "junit,sarif,markdown,github")
    assert "<failure" not in (tmp_path / "out" / "summary.xml").read_text()
    assert "policy-broken" not in [r["ruleId"] for r in _sarif(tmp_path / "out" / "summary.sarif")]
    assert "PASS" in (tmp_path / "out" / "summary.md").read_text()
    assert (tmp_path / "out" / "summary.txt").read_text().startswith("::notice")


def _sarif(path: Path) -> list[dict[str, object]]:
    return json.loads(path.read_text())["runs"][0]["results"]


def test_a_baseline_excuses_the_contacts_of_the_same_log_only(arm, night, tmp_path: Path) -> None:
    assert night([arm.pushed], out="before")[0].code == 1
    baseline = ("--baseline", tmp_path / "before")
    done, logs, policy = night([arm.pushed], "", *baseline)
    assert done.code == 0 and "Known: 1 contact" in " ".join(logs["pushed.csv"]["reasons"])
    assert policy["baseline"] == "before"
    other = tmp_path / "other.csv"
    lines = arm.pushed.read_text().splitlines()
    other.write_text("\n".join(lines[:-1]) + "\n")
    assert night([other], "", *baseline)[0].code == 1, "another log's contact is a new one"
    assert night([arm.pushed], "", "--baseline", tmp_path / "before" / arm.run(arm.pushed) / "audit.json")[0].code == 0


def test_a_baseline_that_is_none_is_an_error(arm, collaudit, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    run = collaudit("audit", arm.clean, "-c", arm.config, "-o", tmp_path / "out", "--baseline", tmp_path / "empty")
    assert run.code == 2 and "no audit to compare with" in run.err


@pytest.mark.parametrize("jobs", [1, 2])
def test_fail_fast_leaves_the_rest_not_judged(jobs: int, arm, night, tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    for k, source in enumerate([arm.pushed, *[arm.clean] * 4]):
        (logs / f"{k}.csv").write_bytes(source.read_bytes())
    done, entries, _ = night([logs], "", "--fail-fast", "-j", jobs)
    verdicts = [entries[f"{k}.csv"]["verdict"] for k in range(5)]
    assert done.code == 1 and verdicts[0] == "fail" and verdicts[-1] == "not_judged"
    assert "--fail-fast" in entries["4.csv"]["reasons"][0]
    assert not (tmp_path / "out" / "4").exists()


def test_the_nights_of_a_store_are_a_baseline(arm, night, tmp_path: Path) -> None:
    """A log that is judged again in the same night meets no result of itself; in a later one its contact is known."""
    store = tmp_path / "store"
    history = ("--store", store, "--baseline", store, "--robot", "cell-1", "--night")
    assert night([arm.pushed], "", *history[:2], "--robot", "cell-1", "--night", "2026-06-01")[0].code == 1
    assert night([arm.pushed], "", *history, "2026-06-01")[0].code == 1
    limit = "[policy]\nmax_friction_change = 0.2\n"
    done, logs, policy = night([arm.pushed], limit, *history[2:], "2026-06-02")
    assert done.code == 0, logs["pushed.csv"]["reasons"]
    assert "Known: 1 contact" in " ".join(logs["pushed.csv"]["reasons"]) and policy["baseline"] == str(store)
    changes = [rule for rule in policy["logs"][0]["rules"] if rule["rule"] == "friction_change"]
    assert len(changes) == 2 and all(rule["state"] == "kept" and "interval" in rule["text"] for rule in changes)
