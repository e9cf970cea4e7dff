"""What a waiver lacks is named: who answers for it, why, and until when."""

from __future__ import annotations

import pytest

from collaudit.core.config import parse_config
from collaudit.core.errors import ConfigError

WAIVER = {"rule": '"near_misses"', "reason": '"taught by hand"', "owner": '"cell lead"', "expires": "2026-12-31"}


@pytest.mark.parametrize("missing", ["rule", "reason", "owner", "expires"])
def test_a_waiver_without_one_of_its_parts_is_refused_by_name(missing: str) -> None:
    lines = [f"{key} = {value}" for key, value in WAIVER.items() if key != missing]
    with pytest.raises(ConfigError) as caught:
        parse_config("\n".join(["[[policy.waivers]]", *lines]), None)
    assert f"[policy.waivers[0]] has no {missing}" in caught.value.render()


def test_a_reason_of_one_letter_is_none() -> None:
    lines = [f"{key} = {value}" for key, value in {**WAIVER, "reason": '"r"'}.items()]
    with pytest.raises(ConfigError) as caught:
        parse_config("\n".join(["[[policy.waivers]]", *lines]), None)
    assert "at least 3 characters" in caught.value.render()
