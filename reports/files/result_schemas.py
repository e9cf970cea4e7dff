"""JSON Schemas of the result files, made from the dataclasses that write them.

``python -m collaudit.reports.files.result_schemas docs/schemas`` writes them anew; a test keeps them current.
"""

from __future__ import annotations

import re
import sys
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from collaudit.core.data import audit_result as result_types
from collaudit.core.data import detection_result, friction_result, identification_result
from collaudit.core.data.audit_result import AUDIT_SCHEMA, FRICTION_SCHEMA, AuditResult, FrictionFile
from collaudit.core.findings import Finding
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_writer import json_text
from collaudit.reports.page.index import SUMMARY_SCHEMA, Summary
from collaudit.reports.values.entries import IndexEntry

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_ATTRIBUTE = re.compile(r"^    ([a-z0-9_]+(?:, [a-z0-9_]+)*): (.+)$")


def audit_schema() -> dict[str, Any]:
    """The JSON Schema of ``audit.json``."""
    return _published(AuditResult, AUDIT_SCHEMA, "collaudit audit of one log (audit.json)")


def friction_schema() -> dict[str, Any]:
    """The JSON Schema of ``friction.json``."""
    return _published(FrictionFile, FRICTION_SCHEMA, "collaudit friction fit (friction.json)")


def summary_schema() -> dict[str, Any]:
    """The JSON Schema of ``summary.json``."""
    return _published(Summary, SUMMARY_SCHEMA, "collaudit audit of many logs (summary.json)")


def write_schemas(folder: Path) -> tuple[Path, ...]:
    """Write the schemas into a folder and return their paths."""
    documents = {
        "audit-1.schema.json": audit_schema(),
        "friction-1.schema.json": friction_schema(),
        "summary-1.schema.json": summary_schema(),
    }
    for name, document in documents.items():
        atomic_write(folder / name, json_text(document))
    return tuple(folder / name for name in documents)


def _published(kind: type, version: str, title: str) -> dict[str, Any]:
    body = _untitled(TypeAdapter(kind).json_schema(mode="serialization"))
    body["properties"]["schema"] = {"const": version}
    definitions = body.pop("$defs")
    if "Finding" in definitions:
        definitions["Finding"]["properties"]["code"] = {"type": "string", "pattern": "^[a-z0-9]+(-[a-z0-9]+)*$"}
    for name, definition in definitions.items():
        _describe(definition, _dataclass(name))
    _describe(body, kind)
    return {"$schema": _DIALECT, "title": title, **body, "$defs": dict(sorted(definitions.items()))}


def _dataclass(name: str) -> type:
    elsewhere = {"Finding": Finding, "IndexEntry": IndexEntry}
    homes = (result_types, detection_result, friction_result, identification_result)
    kind = elsewhere.get(name) or next(getattr(home, name) for home in homes if hasattr(home, name))
    assert isinstance(kind, type)
    assert is_dataclass(kind)
    return kind


def _untitled(schema: Any) -> Any:
    """Without the titles pydantic derives from names; a property that is called title stays."""
    if isinstance(schema, list):
        return [_untitled(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key: {name: _untitled(item) for name, item in value.items()}
        if key in ("properties", "$defs")
        else _untitled(value)
        for key, value in schema.items()
        if key != "title"
    }


def _describe(schema: dict[str, Any], kind: type) -> None:
    """The class's docstring as descriptions of the object and of its properties."""
    doc = (kind.__doc__ or "").splitlines()
    schema["description"] = doc[0] if doc else kind.__name__
    for names, text in _attributes(doc):
        for name in names:
            if name in schema["properties"]:
                schema["properties"][name]["description"] = text


def _attributes(doc: list[str]) -> list[tuple[list[str], str]]:
    found: list[tuple[list[str], str]] = []
    inside = False
    for line in doc:
        text = line.removeprefix("    ")
        if text.startswith("Attributes:"):
            inside = True
        elif inside and (match := _ATTRIBUTE.match(text)):
            found.append((match[1].split(", "), match[2]))
        elif inside and text.startswith("        ") and found:
            found[-1] = (found[-1][0], f"{found[-1][1]} {text.strip()}")
    return found


if __name__ == "__main__":
    for written in write_schemas(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/schemas")):
        sys.stdout.write(f"{written}\n")
