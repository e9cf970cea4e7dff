"""Where in decoded JSON or TOML something does not fit its type: msgspec's place, with the names it leaves out."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import reduce
from typing import Any

import msgspec

Place = tuple[str | int, ...]

#: How msgspec ends its messages: at `$.detect.n`, at `$.log.wrench_bias[2]`, at `$.detect.gamma_nm[...]` for a value
#: under any name, at `key` in `$.policy.levels` for a name itself.
_END = re.compile(r" - at (?P<name>`key` in )?`\$(?P<steps>[^`]*)`$")
_STEP = re.compile(r"\.(?P<field>\w+)|\[(?P<index>\d+)\]|\[(?P<any>\.\.\.)\]")
_ANY = "..."


def misfit_place(
    error: msgspec.ValidationError,
    data: Any,
    check: Callable[[Any], object],
    begin: dict[Place, int] | None = None,
) -> Place:
    """The place that an error names, the names of a mapping included; where one cannot be told, the mapping.

    Args:
        error: what ``check`` raised for ``data``.
        data: dictionaries and lists.
        check: raises ``msgspec.ValidationError`` where its argument does not fit.
        begin: of each mapping how many names were right before, where the search goes on; it is kept up to date.
    """
    begin = {} if begin is None else begin
    steps, of_name = _steps(error)
    path: Place = ()
    for end, step in enumerate(steps, 1):
        name = _name(data, path, steps[:end], False, check, begin) if step == _ANY else step
        if name is None:
            return path
        path = (*path, name)
    name = _name(data, path, steps, True, check, begin) if of_name else None
    return path if name is None else (*path, name)


def without_place(error: msgspec.ValidationError) -> str:
    """What an error says beside the place."""
    return _END.sub("", str(error))


def at_place(path: Place, data: Any) -> Any:
    """What lies at a place."""
    return reduce(lambda value, part: value[part], path, data)


def _name(
    data: Any,
    path: Place,
    steps: list[str | int],
    of_name: bool,
    check: Callable[[Any], object],
    begin: dict[Place, int],
) -> str | None:
    """Under which name of a mapping the error lies: the first that is an error when it stands there alone."""
    entries = list(at_place(path, data).items())
    before = begin.get(path, 0)
    for place, (name, value) in enumerate(entries[before:] + entries[:before], before):
        try:
            check(_with(data, path, {name: value}))
        except msgspec.ValidationError as error:
            again, again_of_name = _steps(error)
            if again[: len(steps)] == steps and again_of_name >= of_name:
                begin[path] = place % len(entries)
                return str(name)
    return None  # an error that needs the others


def _with(data: Any, path: Place, value: object) -> Any:
    """The same with another value at a place; what lies beside the way there is shared."""
    if not path:
        return value
    step, *rest = path
    copied = data.copy()
    copied[step] = _with(data[step], tuple(rest), value)
    return copied


def _steps(error: msgspec.ValidationError) -> tuple[list[str | int], bool]:
    match = _END.search(str(error))
    if match is None:
        return [], False
    found = _STEP.finditer(match["steps"])
    return [int(step["index"]) if step["index"] else step["field"] or _ANY for step in found], bool(match["name"])
