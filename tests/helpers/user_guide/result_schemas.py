"""JSON Schemas of the result files, made from the dataclasses that write them.

``make docs`` writes them to ``docs/schemas``. Commands do without this module, and without the parser of docstrings.
"""

from __future__ import annotations

from dataclasses import is_dataclass
from inspect import cleandoc
from typing import Any, get_type_hints

import msgspec
from docstring_parser import DocstringStyle, parse

from collaudit.core.config.describe import choices_of_laws
from collaudit.core.contacts.contact_states import AcceptanceUse
from collaudit.core.data import audit_result as result_types
from collaudit.core.data import (
    detection_result,
    friction_result,
    identification_result,
    plan_result,
    recommendation_result,
    sensitivity_result,
    signals,
)
from collaudit.core.data.audit_result import AUDIT_SCHEMA, FRICTION_SCHEMA, AuditResult, FrictionFile
from collaudit.core.data.joint_log import LeftOut
from collaudit.core.data.plan_result import PLAN_SCHEMA, PlanFile
from collaudit.core.findings import Finding
from collaudit.core.history.night_groups import Moment, NightGroup
from collaudit.reports.files.written_files import json_text
from collaudit.reports.page.index import SUMMARY_SCHEMA, Summary
from collaudit.reports.values.entries import IndexEntry

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


#: Result file to its dataclass, the version of its schema, and its title.
RESULTS: dict[str, tuple[type, str, str]] = {
    "audit": (AuditResult, AUDIT_SCHEMA, "collaudit audit of one log (audit.json)"),
    "friction": (FrictionFile, FRICTION_SCHEMA, "collaudit friction fit (friction.json)"),
    "summary": (Summary, SUMMARY_SCHEMA, "collaudit audit of many logs (summary.json)"),
    "plan": (PlanFile, PLAN_SCHEMA, "collaudit plan of a motion (plan.json)"),
}


def result_schema(name: str) -> dict[str, Any]:
    """The JSON Schema of one of :data:`RESULTS`."""
    return _published(*RESULTS[name])


def schema_texts() -> dict[str, str]:
    """File name to JSON Schema, of every result file."""
    return {f"{name}-1.schema.json": json_text(result_schema(name)) for name in RESULTS}


def _published(kind: type, version: str, title: str) -> dict[str, Any]:
    body = schema_of(kind)
    body["properties"]["schema"] = {"const": version}
    definitions = body.pop("$defs", {})
    if "Finding" in definitions:
        definitions["Finding"]["properties"]["code"] = {"type": "string", "pattern": "^[a-z0-9]+(-[a-z0-9]+)*$"}
    for name, definition in definitions.items():
        found = _dataclass(name)
        _describe(definition, found)
        for field, annotation in get_type_hints(found, include_extras=True).items():
            if choices := choices_of_laws(annotation):
                definition["properties"][field] |= {"anyOf": [{"enum": [*choices]}, {"type": "null"}]}
    _describe(body, kind)
    return {"$schema": _DIALECT, "title": title, **body, "$defs": dict(sorted(definitions.items()))}


def _dataclass(name: str) -> type:
    elsewhere = {one.__name__: one for one in (Finding, IndexEntry, LeftOut, AcceptanceUse, NightGroup, Moment)}
    homes = (
        signals,
        result_types,
        detection_result,
        friction_result,
        identification_result,
        plan_result,
        sensitivity_result,
        recommendation_result,
    )
    kind = elsewhere.get(name) or next(getattr(home, name) for home in homes if hasattr(home, name))
    assert isinstance(kind, type)
    assert is_dataclass(kind)
    return kind


def of_any_msgspec(node: Any) -> Any:
    """A schema without what versions of msgspec say differently.

    0.22 takes the indent off docstrings; 0.23 keeps it, states empty tables as defaults, and the names of entries.
    """
    if isinstance(node, list):
        return [of_any_msgspec(one) for one in node]
    if not isinstance(node, dict):
        return node
    if isinstance(node.get("description"), str):
        node = {**node, "description": cleandoc(node["description"])}
    return {
        key: of_any_msgspec(value)
        for key, value in node.items()
        if not (key == "default" and value == {}) and not (key == "propertyNames" and "properties" not in node)
    }


def schema_of(kind: type) -> dict[str, Any]:
    """The JSON Schema of a dataclass; ``$defs`` holds those within it."""
    (reference,), definitions = msgspec.json.schema_components((kind,), ref_template="#/$defs/{name}")
    definitions = of_any_msgspec(definitions)
    for definition in definitions.values():
        del definition["title"]
    own = definitions.pop(reference["$ref"].rpartition("/")[2])
    return {**own, "$defs": definitions} if definitions else own


def _describe(schema: dict[str, Any], kind: type) -> None:
    """The class's docstring as descriptions of the object and of its properties."""
    doc = parse(kind.__doc__ or "", DocstringStyle.GOOGLE)
    schema["description"] = doc.short_description or kind.__name__
    for attribute in doc.params:
        for name in attribute.arg_name.split(", "):
            if name in schema["properties"]:
                schema["properties"][name]["description"] = " ".join((attribute.description or "").split())
