"""The keys of a table of the configuration that were given, as plain values."""

from __future__ import annotations

from typing import Any

from collaudit.core.config.config_table import ConfigTable


def given_values(table: ConfigTable) -> dict[str, Any]:
    """Given keys with dictionaries, lists, text and numbers."""
    return {name: _plain(getattr(table, name)) for name in table.__struct_fields__ if name in table.given}


def _plain(value: Any) -> Any:
    if isinstance(value, ConfigTable):
        return given_values(value)
    return [_plain(inner) for inner in value] if isinstance(value, list) else value
