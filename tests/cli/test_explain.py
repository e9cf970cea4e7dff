"""``collaudit explain``: causes as JSON and in lines; the exit code is the verdict's."""

from __future__ import annotations

import json


def test_pushes_have_no_cause_and_a_pass_nothing_to_explain(arm, collaudit) -> None:
    settings = ("-c", arm.config, "--friction", arm.friction)
    found = collaudit("explain", arm.pushed, *settings, "--json")
    made = json.loads(found.out)
    assert found.code == 1
    assert made["schema"] == "collaudit/explain/1" and made["verdict"] == "fail"
    assert not any(cause["speaks"] for cause in made["causes"])
    assert collaudit("explain", arm.pushed, *settings).out.startswith("FAIL")
    clean = collaudit("explain", arm.clean, *settings)
    assert clean.code == 0 and "nothing to explain" in clean.out
