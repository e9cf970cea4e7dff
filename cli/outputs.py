"""No output may be an input: a log or a result is not replaced by what is made of it."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from collaudit.core.errors import CollauditError

_RUN_FILES = ("audit.json", "signals.parquet", "friction.json")


def refuse_input_as_output(params: Mapping[str, object]) -> None:
    """Refuse an output that one of the command's inputs already is.

    Args:
        params: arguments and options of the command, files among them.

    Raises:
        CollauditError: writing the output would destroy an input.
    """
    output = params.get("output")
    if not isinstance(output, Path):
        return
    targets = [output / name for name in _RUN_FILES] if output.is_dir() else [output]
    targets = [path for path in targets if path.is_file()]
    if not targets:
        return
    for name, value in params.items():
        if name == "output":
            continue
        for path in _files(value, runs=name == "runs"):
            if any(path.samefile(target) for target in targets):
                raise CollauditError(
                    "the output is one of the inputs, which it would replace",
                    where=str(output),
                    found=str(path),
                    hint="name another file with -o",
                )


def _files(value: object, runs: bool) -> Iterator[Path]:
    """Existing files that a parameter names: itself, what its pattern matches, the logs or results in its folder."""
    values: Iterable[object] = value if isinstance(value, list | tuple) else [value]
    for item in values:
        if not isinstance(item, str | Path):
            continue
        path = Path(item)
        if path.is_dir():
            yield from (file for file in _inside(path, runs) if file.is_file())
        elif path.is_file():
            yield path
        elif glob.has_magic(str(item)):
            from collaudit.core.logs.inputs import matching_paths

            yield from (match for match in matching_paths(str(item)) if match.is_file())


def _inside(folder: Path, runs: bool) -> list[Path]:
    if runs:
        return [folder / name for name in _RUN_FILES]
    from collaudit.core.logs.inputs import expand_inputs

    try:
        return expand_inputs([folder])
    except CollauditError:
        return []  # the command itself says what is wrong with its input
