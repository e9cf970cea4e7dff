"""What the reference page says of a key beside what it accepts: meaning, header, default."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args, get_origin

from msgspec import NODEFAULT, Meta

from collaudit.core.config.config_table import ConfigTable
from collaudit.core.config.describe import Key
from collaudit.core.small_files import to_toml


def meaning(key: Key) -> str:
    """What it means."""
    notes = get_args(key.field.type)[1:] if get_origin(key.field.type) is Annotated else ()
    return " ".join(item.description or "" for item in notes if isinstance(item, Meta)).strip()


def header(key: Key) -> str:
    """The table's header as in TOML."""
    return {"array": f"[[{key.dotted}]]", "by-name": f"[{key.dotted}.NAME]"}.get(key.shape, f"[{key.dotted}]")


def default_text(key: Key) -> str:
    """The default as TOML, or ``absent``, or ``required``."""
    if key.field.required:
        return "required"
    made = key.field.default_factory
    value = key.field.default if made is NODEFAULT else made()
    if isinstance(value, ConfigTable):
        value = _without_absent(value.plain())
    return "absent" if value is None else to_toml(value)


def names_of_entries(key: Key) -> tuple[str, ...]:
    """The names that entries of a table may have, where it lists them."""
    annotation = key.field.type
    if get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    names = get_args(annotation)[:1] if get_origin(annotation) is dict else ()
    return get_args(names[0]) if names and get_origin(names[0]) is Literal else ()


def _without_absent(table: dict[str, Any]) -> dict[str, Any]:
    """Without keys that have no value, at any depth: TOML has no word for them."""
    return {
        name: _without_absent(inner) if isinstance(inner, dict) else inner
        for name, inner in table.items()
        if inner is not None
    }
