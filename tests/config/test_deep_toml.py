"""Settings that are nested without end are refused, whatever Python's bound of recursion is."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from collaudit.core.config import load_config
from collaudit.core.errors import ConfigError
from collaudit.core.small_files import parse_toml


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * 400 + "]" * 400,
        "x = " + "{a = " * 400 + "1" + "}" * 400,
        "[" + ".".join(["a"] * 3000) + "]\nb = 1",
        ".".join(["a"] * 20_000) + " = 1",
        "x = { " + " . ".join(['"a b"'] * 20_000) + " = 1 }",
        "[[" + ".".join(["'a'"] * 20_000) + "]]",
    ],
)
def test_settings_nested_without_end_are_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(tomllib.TOMLDecodeError, match="deep"):
        parse_toml(text)
    path = tmp_path / "deep.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match="ested too deeply"):
        load_config(path)


def test_settings_without_end_are_not_parsed(tmp_path: Path) -> None:
    path = tmp_path / "long.toml"
    path.write_text("# " + "x" * (5 << 20))
    with pytest.raises(ConfigError, match="onger than"):
        load_config(path)


@pytest.mark.parametrize("text", ['x = "' + "a." * 20 + '"', "x = '" + "." * 99 + "'"])
def test_dots_of_values_are_no_depth(text: str) -> None:
    assert parse_toml(text)
