"""What is written keeps to its JSON Schema (test_docs keeps the published ones current)."""

from __future__ import annotations

import json

import pytest
import samples
from jsonschema import Draft202012Validator
from user_guide.result_schemas import result_schema

from collaudit.core.data.audit_result import Collision
from collaudit.core.errors import LogError
from collaudit.reports.files.run_files import result_json
from collaudit.reports.files.written_files import json_text
from collaudit.reports.page.index import summarise
from collaudit.reports.values.entries import entry_of, entry_of_error


@pytest.mark.parametrize("make", [samples.failed, samples.passed, samples.not_judged, samples.hostile])
def test_audits_keep_to_the_schema(make) -> None:
    Draft202012Validator(result_schema("audit")).validate(json.loads(result_json(make().result)))


def test_friction_keeps_to_the_schema() -> None:
    Draft202012Validator(result_schema("friction")).validate(json.loads(result_json(samples.friction_file())))


def test_summaries_keep_to_the_schema() -> None:
    entries = [entry_of(samples.failed(3000).result, "a/report.html"), entry_of_error("b", LogError("cut short"))]
    Draft202012Validator(result_schema("summary")).validate(json.loads(json_text(summarise(entries))))


@pytest.mark.parametrize("schema", [result_schema("audit"), result_schema("friction"), result_schema("summary")])
def test_schemas_are_schemas(schema) -> None:
    Draft202012Validator.check_schema(schema)
    assert schema["properties"]["schema"]["const"].startswith("collaudit/")


def test_fields_carry_their_documentation() -> None:
    fields = result_schema("audit")["$defs"]["Collision"]["properties"]
    undocumented = [name for name, field in fields.items() if not field.get("description")]
    assert not undocumented, f"fields of Collision without a sentence in its docstring: {undocumented}"
    assert fields["detected_s"]["description"] in " ".join((Collision.__doc__ or "").split())


@pytest.mark.parametrize("value", ['"4.0"', "null", "[]"])
def test_the_schema_refuses_what_the_reader_refuses(value: str) -> None:
    text = result_json(samples.failed(3000).result).replace("9.21734", value)
    assert list(Draft202012Validator(result_schema("audit")).iter_errors(json.loads(text)))
