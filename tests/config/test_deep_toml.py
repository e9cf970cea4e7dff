"""Settings that are nested without end are refused, whatever Python's bound of recursion is."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from collaudit.core.config import load_config
from collaudit.core.config.toml_text import parse_toml
from collaudit.core.errors import ConfigError


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * 400 + "]" * 400,
        "x = " + "{a = " * 400 + "1" + "}" * 400,
        "[" + ".".join(["a"] * 3000) + "]\nb = 1",
    ],
)
def test_settings_nested_without_end_are_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(tomllib.TOMLDecodeError, match="deep"):
        parse_toml(text)
    path = tmp_path / "deep.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match="ested too deeply"):
        load_config(path)
