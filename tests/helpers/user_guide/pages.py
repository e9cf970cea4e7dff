"""Generated pages of the user guide: ``python -m user_guide.pages docs``.

The configuration reference and its JSON Schema come from the schema, findings from their table, commands and manual
pages from their own help, the JSON Schemas of results from their types, calls from their docstrings; a test
compares the files with what this module makes.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import click
import msgspec

from collaudit.cli.main import collaudit
from collaudit.core.config import schema as config_of_core
from collaudit.core.config.describe import Key, all_keys, choices_of_laws, keys_of, value_text
from collaudit.core.config.schema import Config
from collaudit.core.findings.finding_kinds import KINDS, Kind
from collaudit.reports.files.written_files import json_text
from user_guide.api_page import api_page
from user_guide.config_words import default_text, header, meaning, names_of_entries
from user_guide.man_pages import man_pages
from user_guide.output_schemas import output_schema_texts
from user_guide.result_schemas import of_any_msgspec, schema_texts
from user_guide.room_picture import ROOMS, picture
from user_guide.who_sets import WHO_SETS


def pages() -> dict[str, str]:
    """File name in ``docs/`` to its content."""
    return {
        "config-schema.json": config_schema(),
        "config.md": config_page(),
        "findings.md": findings_page(),
        "commands.md": commands_page(),
        "api.md": api_page(),
        **{f"schemas/{name}": text for name, text in schema_texts().items()},
        **{f"schemas/{name}": text for name, text in output_schema_texts().items()},
        **{f"man/{name}": text for name, text in man_pages().items()},
    }


def config_schema() -> str:
    """The JSON Schema of collaudit.toml."""
    schema: dict[str, Any] = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "collaudit.toml"}
    (reference,), tables = msgspec.json.schema_components(
        (Config,), schema_hook=lambda _path: {"type": "string", "format": "path"}, ref_template="#/$defs/{name}"
    )
    tables = of_any_msgspec(tables)
    for key in all_keys():
        published = tables[key.holder.__name__]["properties"][key.path[-1]]
        if choices := choices_of_laws(key.field.type):
            published["enum"] = [*choices]
        if names := names_of_entries(key):
            published["propertyNames"] = {"enum": [*names]}
    schema |= {**tables.pop(reference["$ref"].rpartition("/")[2]), "$defs": tables}
    return json_text(schema, indent=2)


def config_page() -> str:
    """The reference of collaudit.toml: one table a section."""
    lines = [
        "# Configuration reference",
        "",
        "`collaudit.toml` of the working folder, or the file given with `-c`; flags override it.",
        "`collaudit init` writes one for a log. Relative paths start from the folder of the",
        "configuration file. A key without a default is decided from the data, and said. For editors:",
        "`config-schema.json`. The keys that most users meet: [Everyday settings](tutorial.md#everyday-settings).",
        "",
        "_Generated from the schema by `make docs`._",
    ]
    tables = [key for key in all_keys() if key.table is not None]
    for key in tables:
        lines += ["", f"## `{header(key)}`", "", f"{meaning(key)} Set by {WHO_SETS[key.dotted]}", ""]
        assert key.table is not None
        rows = [inner for inner in keys_of(key.table, key.path) if inner.table is None]
        lines += [_config_row(row) for row in rows]
    return "\n".join(lines) + "\n"


def findings_page() -> str:
    """Every finding code with its meaning, its effect and what to do about it."""
    lines = [
        "# Findings",
        "",
        "A finding is a stated fact about the data, or about a choice that was made for you. Codes are stable: scripts",
        "may match them. Severity: `info` is worth knowing, `warning` limits trust, `error` forbids judging.",
        "",
        "| effect | does |",
        "|---|---|",
        "| none | Nothing by itself. Time without signal, friction or model counts as not judged in the coverage. |",
        "| `excludes` | A kind of contact cannot be seen. The verdict lists it under what it does not cover. |",
        "| `doubts-alarms` | The verdict says that alarms of the joint may be errors of the model. |",
        "| `excludes-and-doubts` | Both of these. |",
        "| `not-judged-part` | Part of the log could not be judged. The rest is, and a contact in it counts. |",
        "| `not-judged-joint` | Nothing of the joint is judged; where the finding names none, nothing of any. |",
        "| `not-judged-log` | Nothing of the log is judged. |",
        "",
        "A log with any `not-judged-*` never passes: it fails by what could be judged, or it is not judged, and its",
        "reasons hold the finding. `inspect` and `init` exit with 3. An error of a joint that is not to be judged",
        "(`[robot] joints`, `[detect] watch`) is a warning, without this effect.",
        "",
        "_Generated from `core/findings/finding_kinds.py` by `make docs`._",
        "",
    ]
    return "\n".join([*lines, *(_finding_row(code, kind) for code, kind in KINDS.items())]) + "\n"


def commands_page() -> str:
    """What every command is for, with examples and the names of its options."""
    lines = [
        "# Commands",
        "",
        "`collaudit COMMAND --help` explains all options, and so do the manual pages ([`man/`](man/)). Here stand",
        "examples, purpose and the names of all options; what `simulate` can make, its help lists. Exit codes:",
        "[Nights](fleet.md#what-the-exit-codes-mean).",
        "",
        "_Generated from the commands by `make docs`._",
    ]
    top = click.Context(collaudit, info_name="collaudit")
    for name in collaudit.summaries:
        command = collaudit.get_command(top, name)
        assert command is not None
        options = [f"`{max(param.opts, key=len)}`" for param in command.params if param.param_type_name == "option"]
        shown = re.split(r"\n\n(?:Options|  Scenarios):\n", help_text(name))[0]
        lines += ["", f"## collaudit {name}", "", "```text", shown, "```", "", f"Options: {', '.join(options)}."]
    return "\n".join(lines) + "\n"


def help_text(name: str) -> str:
    """What ``collaudit NAME --help`` prints on a terminal of 80 columns."""
    top = click.Context(collaudit, info_name="collaudit", terminal_width=80, help_option_names=["-h", "--help"])
    if not name:
        return collaudit.get_help(top).rstrip()
    command = collaudit.get_command(top, name)
    if command is None:
        raise KeyError(name)
    context = click.Context(command, info_name=name, parent=top, terminal_width=80)
    return command.get_help(context).rstrip()


def _config_row(key: Key) -> str:
    default = default_text(key)
    shown = {"absent": "", "{}": "", "[]": "", "required": ", required"}.get(default, f", default `{default}`")
    accepts = value_text(key).replace('" or "', '", "').replace("a table of name = ", "by name: ")
    return f"- `{key.path[-1]}` ({accepts}{shown}): {meaning(key)}".replace("\n", " ")


def _finding_row(code: str, kind: Kind) -> str:
    """One line; severities are said where the effect depends on them."""
    effects = [f"`{effect}`" if effect != "none" else effect for effect in kind.effects.values()]
    if len(set(effects)) == 1:
        effect = effects[0]
    else:
        effect = ", ".join(f"{severity}: {shown}" for severity, shown in zip(kind.effects, effects, strict=True))
    return f"- `{code}` ({effect}): {kind.meaning} *Do:* {kind.remedy}".replace("\n", " ")


def with_picture(page: str) -> str:
    """The architecture page with the rooms, their arrows and their order as the code has them now."""
    core = Path(config_of_core.__file__).parents[1]
    page = re.sub(r"```mermaid\nflowchart LR.*?```", lambda _: f"```mermaid\n{picture(core)}```", page, flags=re.DOTALL)
    order = ", ".join(f"`{room}`" for room in ROOMS)
    return re.sub(r"in this order: .*?\.(?= `tests)", lambda _: f"in this order: {order}.", page, flags=re.DOTALL)


def main(arguments: list[str]) -> int:
    """Write the pages into the folder named."""
    if len(arguments) != 1:
        sys.stderr.write("usage: python -m user_guide.pages FOLDER\n")
        return 2
    for name, text in pages().items():
        path = Path(arguments[0]) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    architecture = Path(arguments[0]) / "architecture.md"
    if architecture.exists():
        architecture.write_text(with_picture(architecture.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
