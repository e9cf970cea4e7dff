"""Results as JSON text: the same result always gives the same bytes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from collaudit.reports.values.visible_text import visible_json

Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]


def json_text(value: object, indent: int = 1) -> str:
    """A dataclass (or plain value) as JSON: fields in their declared order, floats in shortest exact form.

    Numbers that are not finite become null: JSON has no word for them. Text that UTF-8 cannot carry (bytes
    of a file name that are no text) is written as a visible backslash escape; characters that control a
    terminal, hide or turn the direction of text are written as JSON escapes.

    Args:
        value: dataclasses, mappings, sequences, text, numbers, None.
        indent: spaces a level.

    Returns:
        Text that ends in a line feed.
    """
    # Not msgspec's encoder: it writes 1e-05 as 0.00001, other bytes than in files that are out already,
    # and refuses the surrogates that stand for bytes of file names which are no text.
    return visible_json(json.dumps(plain(value), ensure_ascii=False, allow_nan=False, indent=indent)) + "\n"


def plain(value: object) -> Json:
    """The value as nothing but dict, list, str, int, float, bool and None."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, int):
        return value
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode("utf-8")
    if is_dataclass(value) and not isinstance(value, type):
        return {item.name: plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, dict):
        return {str(plain(key)): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    raise TypeError(f"{type(value).__name__} has no place in a JSON result")


def not_finite(value: Any, path: str = "$") -> Iterator[str]:
    """Where a decoded JSON value holds numbers too large for a double."""
    if isinstance(value, float) and not math.isfinite(value):
        yield path
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from not_finite(item, f"{path}.{key}")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from not_finite(item, f"{path}[{index}]")
