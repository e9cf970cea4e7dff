"""What a refusal tells a user to do, taken word by word: keys of the configuration, a command, another file."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path
from typing import Any

import tomlkit

SETUP = Path(__file__).resolve().parents[2] / "setup.cfg"
#: More steps than these are no advice but a labyrinth.
_MOST = 8

#: A table of the configuration, and the first of its keys; a colon may stand between.
_TABLE = re.compile(r"\[([a-z_]+(?:\.[a-z_]+)*)\]:? (?=[a-z_]+ = )")
_KEY = re.compile(r"(?:; |, |, and |; and )?([a-z_]+) = ")
_COMMAND = re.compile(r"(?:python -c|pip install|collaudit inspect) (?:'(?:[^']|'\"'\"')*'|[^\s,;]+)(?: [^\s,;]+)*")
_FILE = re.compile(r"did you mean '([^']+)'|name its header instead: (.+)$")
#: A key or a value of the configuration that is not known, in the message, and the one that is proposed, in the hint.
_KEY_PROBLEM, _OTHER_KEY = re.compile(r"\[([a-z_.]+)\] has no key '([^']+)'"), re.compile(r"did you mean (\w+)\?")
_VALUE_PROBLEM = re.compile(r"([a-z_.]+) has a value that cannot be used")
_OTHER_VALUE = re.compile(r"did you mean (\"[^\"]+\")\?")


@dataclass
class Advice:
    """One thing to do.

    Attributes:
        keys: dotted keys and their values, which stand together.
        command: words of a command line; empty for none.
        file: another file to name; "" for none.
        drop: dotted key that is taken out; "" for none.
        instead: a name in the configuration, and the one to be there instead.
    """

    keys: dict[str, Any] = field(default_factory=dict)
    command: list[str] = field(default_factory=list)
    file: str = ""
    drop: str = ""
    instead: tuple[str, str] | None = None


def advice_in(text: str, message: str = "", stated: object = None, found: str = "") -> Iterator[Advice]:
    """All that a text tells to do, in its order; keys of several tables that ``;`` joins are one thing.

    Args:
        text: the hint.
        message: of the refusal, which says where a word that the hint proposes belongs.
        stated: the value that an unknown key has.
        found: what the refusal says was found.
    """
    at, held = 0, Advice()
    if (problem := _KEY_PROBLEM.search(message)) and (other := _OTHER_KEY.search(text)):
        yield Advice({f"{problem[1]}.{other[1]}": stated}, drop=f"{problem[1]}.{problem[2]}")
    if (problem := _VALUE_PROBLEM.search(message)) and (other := _OTHER_VALUE.search(text)):
        yield Advice({problem[1]: tomllib.loads(f"x = {other[1]}")["x"]})
    named = _FILE.search(text)
    if named is not None and (named[2] or "no such file" in message):
        yield Advice(file=named[1] or named[2])
    elif named is not None:
        yield Advice(instead=(found.split(", ")[0], named[1]))
    for table in _TABLE.finditer(text):
        between = text[at : table.start()]
        if held.keys and between.strip() not in (";", ", and", "; and", "and"):
            yield held
            held = Advice()
        at = table.end()
        while (key := _KEY.match(text, at)) is not None:
            value, end = _value(text, key.end())
            if end is None:
                break
            held.keys[f"{table[1]}.{key[1]}"], at = value, end
    if held.keys:
        yield held
    for command in _COMMAND.finditer(text):
        yield Advice(command=shlex.split(command[0]))


def _value(text: str, start: int) -> tuple[Any, int | None]:
    """The value of TOML that begins at a place, and where it ends; None where none does."""
    word = re.compile(r"[^\s,;()]+").match(text, start)
    whole = word is not None and text[start] not in "\"'[{"
    ends = [word.end() - text[word.end() - 1].count(".")] if whole and word else range(start + 1, len(text) + 1)
    for end in ends:
        try:
            return tomllib.loads(f"x = {text[start:end]}")["x"], end
        except tomllib.TOMLDecodeError:
            continue
    return None, None


def write(config: Path, keys: dict[str, Any], drop: str = "") -> None:
    """Set keys of a configuration; take one out."""
    document = tomlkit.parse(config.read_text(encoding="utf-8"))
    if drop:
        *tables, key = drop.split(".")
        reduce(lambda place, name: place[name], tables, document).pop(key)  # type: ignore[attr-defined]
    for dotted, value in keys.items():
        *tables, key = dotted.split(".")
        place: Any = document
        for name in tables:
            place = place.setdefault(name, tomlkit.table())
        place[key] = value
    config.write_text(tomlkit.dumps(document), encoding="utf-8")
    tomllib.loads(config.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Step:
    """One run: what it said, and all that it told to do; no message where the log was judged."""

    message: str
    told: tuple[Advice, ...]


def step_of(outcome: Any, config: Path) -> Step:
    """What a run of ``detect`` said."""
    if outcome.code not in (2, 3) or "run written" in outcome.err:
        return Step("", ())
    lines = [line for line in outcome.err.splitlines() if not line.startswith(("not taken", "  info", "  warn"))]
    said = next((line.partition("try:")[2].strip() for line in lines if line.startswith("  try:")), "")
    found = next((line for line in lines if line.startswith("  found:")), "")
    wrong = re.search(r"has no key '([^']+)'", lines[0])
    held = tomllib.loads(config.read_text(encoding="utf-8"))
    stated = held.get("log", {}).get("csv", {}).get(wrong[1]) if wrong else None
    told = advice_in(said or lines[0], lines[0], stated, found.partition("found:")[2].strip(" '"))
    return Step(lines[0] + found, tuple(told))


def extras() -> set[str]:
    section = SETUP.read_text(encoding="utf-8").partition("[options.extras_require]")[2].partition("\n[")[0]
    return {line.removesuffix(" =") for line in section.splitlines() if line.endswith(" =")}


def done(advice: Advice, config: Path, log: Path, collaudit: Any) -> Path | None:
    """Do what is told, and return the log to name then; None where it leaves the rest to a person."""
    if advice.file:
        return log.with_name(Path(advice.file).name)
    if advice.instead is not None:
        text = config.read_text(encoding="utf-8")
        assert json.dumps(advice.instead[0]) in text
        config.write_text(text.replace(*map(json.dumps, advice.instead)), encoding="utf-8")
        return log
    if advice.keys:
        if any("…" in json.dumps(value, ensure_ascii=False) for value in advice.keys.values()):
            return None
        write(config, advice.keys, advice.drop)
        return log
    if advice.command[:1] == ["pip"]:
        extra = re.fullmatch(r"collaudit\[(\w+)\]", advice.command[2])
        assert extra is None or extra[1] in extras()
        return None
    if advice.command[:2] == ["collaudit", "inspect"]:
        shown = collaudit("inspect", log, "-c", config)
        assert "column" in shown.out or "topic" in shown.out, "it lists what there is to choose from"
        return None
    assert advice.command[:2] == ["python", "-c"]
    before = set(log.parent.iterdir())
    subprocess.run([sys.executable, *advice.command[1:]], cwd=log.parent, check=True)
    return next(iter(set(log.parent.iterdir()) - before))


def walked(collaudit: Any, log: Path, config: Path, friction: Path, choice: int) -> list[Step]:
    """Runs until nothing more is told; ``choice``: which advice of the first refusal is taken, later the first one."""
    steps: list[Step] = []
    while len(steps) < _MOST:
        out = config.parent / f"out{len(steps)}"
        outcome = collaudit("detect", log, "-c", config, "--friction", friction, "-o", out)
        steps.append(step_of(outcome, config))
        told = steps[-1].told
        after = done(told[choice if len(steps) == 1 else 0], config, log, collaudit) if told else None
        if after is None:
            return steps
        log = after
    raise AssertionError(f"no end of advice: {[step.message for step in steps]}")
