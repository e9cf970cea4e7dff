"""The same contact in a second night: known, and no pass; accepted only by a person, by name, and for a time."""

from __future__ import annotations

import json
import re
import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from small_arm import arm_module

SOON = (datetime.now(UTC) + timedelta(days=30)).date()
FORMATS = "junit,sarif,markdown,github"


@pytest.fixture
def night(arm, collaudit, tmp_path: Path):
    """Audit logs with the arm's configuration and more lines of it; exit code, summary.json, audit.json by run."""
    config = tmp_path / "collaudit.toml"

    def run(logs, *flags: object, text: str = "", out: str = "out"):
        config.write_text(f"{arm.config.read_text()}\n{text}", encoding="utf-8")
        done = collaudit("audit", *logs, "-c", config, "--friction", arm.friction, "-o", tmp_path / out, *flags)
        summary = json.loads((tmp_path / out / "summary.json").read_text())
        audits = [json.loads(path.read_text()) for path in sorted((tmp_path / out).glob("*/audit.json"))]
        return done, summary, audits

    return run


def verdicts_everywhere(out: Path, summary: dict) -> set[str]:
    """The verdict on the one log of an audit, as each file tells it."""
    (entry,) = summary["logs"]
    page, index = ((out / name).read_text() for name in (entry["report"], "index.html"))
    junit, sarif = (out / "summary.xml").read_text(), json.loads((out / "summary.sarif").read_text())
    found = {
        summary["verdict"],
        entry["verdict"],
        json.loads((out / entry["report"]).with_name("audit.json").read_text())["verdict"],
    }
    for text in (page, index):
        found.add(re.search(r'class="word is-(\w+)"', text)[1])
    found.add(re.search(r'data-verdict="(\w+)"', index)[1])
    found.add("fail" if "<failure" in junit else "not_judged" if "<error" in junit else "pass")
    rules = {one["ruleId"] for one in sarif["runs"][0]["results"]}
    found.add("fail" if "policy-broken" in rules else "not_judged" if "not-judged" in rules else "pass")
    marks = {"✅": "pass", "❌": "fail", "❔": "not_judged"}
    found.add(next(marks[mark] for mark in (out / "summary.md").read_text() if mark in marks))
    found.add(
        {"error": "fail", "warning": "not_judged", "notice": "pass"}[
            (out / "summary.txt").read_text()[2:].split(" ")[0]
        ]
    )
    return found


def test_the_same_recording_twice_with_a_store_still_fails(arm, night, tmp_path: Path) -> None:
    store = ("--store", tmp_path / "store", "--robot", "cell-1", "--format", FORMATS, "--night")
    done, summary, (first,) = night([arm.pushed], *store, "2026-06-01")
    assert done.code == 1 and [c["state"] for c in first["contacts"]] == ["new"]
    done, summary, (again,) = night([arm.pushed], *store, "2026-06-02")
    (contact,) = again["contacts"]
    assert done.code == 1 and contact["state"] == "known" and contact["known_since"] == "2026-06-01"
    assert "known since 2026-06-01 (1 night)" in " ".join(again["reasons"])
    assert summary["logs"][0]["contact_states"] == {"known": 1} and contact["id"] == first["contacts"][0]["id"]
    assert verdicts_everywhere(tmp_path / "out", summary) == {"fail"}
    _, _, (third,) = night([arm.pushed], *store, "2026-06-03")
    assert (third["contacts"][0]["known_nights"], third["verdict"]) == (2, "fail")


def test_a_night_that_is_judged_again_is_no_earlier_one(arm, night, tmp_path: Path) -> None:
    """A nightly job that is started twice, or late for an older night: its own contact is new each time."""
    flags, allow = ("--store", tmp_path / "store", "--robot", "cell-1", "--night"), '[policy]\nknown = "allow"\n'
    for day in ("2026-06-02", "2026-06-02", "2026-06-01"):
        done, summary, (audit,) = night([arm.pushed], *flags, day, text=allow)
        assert done.code == 1 and [c["state"] for c in audit["contacts"]] == ["new"], day
        assert [group["nights"] for group in summary["groups"]] == [1]
    done, _, _ = night([arm.pushed], *flags, "2026-06-01", "--resume", text=allow)
    assert done.code == 1 and "1 of 1 logs were finished earlier" in done.err
    assert night([arm.pushed], *flags, "2026-06-03", text=allow)[0].code == 0


def test_a_folder_as_baseline_excuses_nothing(arm, night, tmp_path: Path) -> None:
    assert night([arm.pushed], out="before")[0].code == 1
    for baseline in (tmp_path / "before", tmp_path / "before" / arm.run(arm.pushed)):
        done, _, (audit,) = night([arm.pushed], "--baseline", baseline)
        assert done.code == 1 and audit["contacts"][0]["state"] == "known"


def test_a_log_with_contacts_is_laid_over_that_of_the_baseline(arm, night, tmp_path: Path) -> None:
    places = [tmp_path / folder / "cell" / "pick.csv" for folder in ("first", "second")]
    for place, source in zip(places, (arm.clean, arm.pushed), strict=True):
        place.parent.mkdir(parents=True)
        shutil.copy(source, place)
    assert night([places[0]], "--root", tmp_path / "first", out="before")[0].code == 0
    done, summary, _ = night([places[1]], "--root", tmp_path / "second", "--baseline", tmp_path / "before")
    assert done.code == 1 and summary["logs"][0]["name"] == "cell/pick.csv"
    out = tmp_path / "out"
    assert '<a href="./cell_pick/overlay.html">overlay</a>' in (out / "index.html").read_text()
    assert "its joints 0.000 rad away" in (out / "cell_pick" / "overlay.html").read_text()
    assert "cell_pick/overlay.html" in (out / "SHA256SUMS").read_text()
    done, _, _ = night([places[1]], "--root", tmp_path / "second")
    assert done.code == 1 and not (out / "cell_pick" / "overlay.html").exists(), "of an earlier audit"


def test_another_recording_of_the_program_is_known_and_comes_back(arm, night, tmp_path: Path) -> None:
    """Names differ by their dates; a night without the contact makes it come back; a harder one is new."""
    logs = {
        "01": arm.pushed,
        "02": tmp_path / "other.csv",
        "03": arm.clean,
        "04": arm.pushed,
        "05": tmp_path / "hard.csv",
    }
    arm_module().write_arm_csv(logs["02"], push_nm=12.0, seed=7)
    arm_module().write_arm_csv(logs["05"], push_nm=24.0, seed=8)
    found = []
    for day, source in logs.items():
        log = tmp_path / f"cell_2026-06-{day}.csv"
        shutil.copy(source, log)
        flags = ("--store", tmp_path / "store", "--robot", "a", "--night", f"2026-06-{day}")
        done, summary, (audit,) = night([log], *flags)
        groups = [(group["state"], group["since"], group["nights"]) for group in summary["groups"]]
        found.append((done.code, [c["state"] for c in audit["contacts"]], groups))
    assert found == [
        (1, ["new"], [("new", None, 1)]),
        (1, ["known"], [("known", "2026-06-01", 2)]),
        (0, [], [("gone", "2026-06-01", 2)]),
        (1, ["back"], [("back", "2026-06-01", 3)]),
        (1, ["new"], [("new", "2026-06-01", 4)]),  # harder
    ]


def test_known_may_be_allowed_by_the_owner_and_the_verdict_says_so(arm, night, tmp_path: Path) -> None:
    night([arm.pushed], out="before")
    flags, allow = ("--baseline", tmp_path / "before", "--format", FORMATS), '[policy]\nknown = "allow"\n'
    done, summary, (audit,) = night([arm.pushed], *flags, text=allow)
    assert done.code == 0 and 'known = "allow"' in " ".join(audit["reasons"]) and audit["exclusions"]
    assert verdicts_everywhere(tmp_path / "out", summary) == {"pass"}
    assert night([arm.pushed], text=allow)[0].code == 1, "a new contact breaks the policy"


def accept(collaudit, tmp_path: Path, name: str, until: object = SOON):
    words = ("--reason", "taught by hand", "--owner", "A. Lee", "--until", until)
    return collaudit("accept", tmp_path / "out", name, *words, "-c", tmp_path / "collaudit.toml")


def test_an_accepted_contact_passes_until_it_is_harder_or_its_day_is_over(
    arm, collaudit, night, tmp_path: Path
) -> None:
    _, _, (audit,) = night([arm.pushed])
    done = accept(collaudit, tmp_path, audit["contacts"][0]["id"])
    assert done.code == 0, done.err
    done, summary, (audit,) = night([arm.pushed], "--format", FORMATS)
    assert done.code == 0 and audit["contacts"][0]["state"] == "accepted" and "A. Lee" in " ".join(audit["exclusions"])
    assert [use["state"] for use in summary["accepted"]] == ["counted"]
    assert verdicts_everywhere(tmp_path / "out", summary) == {"pass"}
    run = collaudit("detect", arm.pushed, "-c", tmp_path / "collaudit.toml", "--friction", arm.friction, "--json")
    assert run.code == 0, "one log by itself has the same verdict"
    after = SOON + timedelta(days=1)
    done, summary, (audit,) = night([arm.pushed], "--as-of", after)
    assert done.code == 1 and [use["state"] for use in summary["accepted"]] == ["expired"] and "expired" in done.err
    hard = tmp_path / "hard" / arm.pushed.parent.name / "pushed.csv"
    hard.parent.mkdir(parents=True)
    arm_module().write_arm_csv(hard, push_nm=24.0, seed=1)
    done, summary, (audit,) = night([hard])
    assert done.code == 1 and "harder" in " ".join(audit["reasons"])
    assert [use["state"] for use in summary["accepted"]] == ["no longer matches"]
    pruned = collaudit("accept", tmp_path / "out", "--prune", "--json", "-c", tmp_path / "collaudit.toml")
    assert pruned.code == 0 and len(json.loads(pruned.out)["removed"]) == 1
    assert "[[accepted]]" not in (tmp_path / "accepted.toml").read_text()


def test_an_entry_that_nothing_needs_is_said_and_one_of_other_logs_is_left_alone(
    arm, collaudit, night, tmp_path
) -> None:
    common = 'reason = "by hand"\nowner = "A. Lee"\npeak_nm = { joint1 = 99 }\n' + f"until = {SOON}\n"
    text = f'# ours\n[[accepted]]\nlog = "clean.csv"\n{common}\n[[accepted]]  # theirs\nlog = "other/*"\n{common}'
    (tmp_path / "accepted.toml").write_text(text)
    done, summary, _ = night([arm.clean])
    assert done.code == 0 and [use["state"] for use in summary["accepted"]] == ["unused", "not asked"]
    assert "entry 1, unused" in done.err and "entry 2" not in done.err
    assert collaudit("accept", tmp_path / "out", "--prune", "-c", tmp_path / "collaudit.toml").code == 0
    left = (tmp_path / "accepted.toml").read_text()
    assert left.startswith("# ours") and "other/*" in left and "clean.csv" not in left


def test_ninety_days_at_most(arm, collaudit, night, tmp_path: Path) -> None:
    _, _, (audit,) = night([arm.pushed])
    far = (datetime.now(UTC) + timedelta(days=120)).date()
    name = audit["contacts"][0]["id"]
    refused = accept(collaudit, tmp_path, name, far)
    assert refused.code == 2 and "90 days" in refused.err and not (tmp_path / "accepted.toml").exists()
    near = far - timedelta(days=31)
    assert accept(collaudit, tmp_path, name, near).code == 0
    entries = tmp_path / "accepted.toml"
    entries.write_text(entries.read_text().replace(str(near), str(far)))
    done, summary, _ = night([arm.pushed])
    assert done.code == 1 and [use["state"] for use in summary["accepted"]] == ["too long"]


def test_what_is_not_judged_is_not_accepted(arm, collaudit, night, tmp_path: Path) -> None:
    _, _, (audit,) = night([arm.pushed])
    accept(collaudit, tmp_path, audit["contacts"][0]["id"])
    done, summary, (audit,) = night([arm.pushed], text="[policy]\nobservable_nm = 0.01\n")
    assert done.code == 3 and audit["contacts"][0]["state"] == "accepted" and summary["verdict"] == "not_judged"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nobody"], "no contact of this audit has that id"),
        ([], "names a contact"),
    ],
)
def test_what_cannot_be_accepted_says_why(arguments, said, arm, collaudit, night, tmp_path: Path) -> None:
    night([arm.pushed])
    words = ("--reason", "by hand", "--owner", "A. Lee", "--until", SOON) if arguments else ()
    done = collaudit("accept", tmp_path / "out", *arguments, *words, "-c", tmp_path / "collaudit.toml")
    assert done.code == 2 and said in done.err and not (tmp_path / "accepted.toml").exists()


def test_a_baseline_that_is_none_is_an_error(arm, collaudit, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    run = collaudit("audit", arm.clean, "-c", arm.config, "-o", tmp_path / "out", "--baseline", tmp_path / "empty")
    assert run.code == 2 and "no audit to compare with" in run.err
