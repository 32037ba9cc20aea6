"""Loads the schemas in docs/schemas, and validates JSON against them."""

import json
from functools import cache
from pathlib import Path

from jsonschema import Draft202012Validator
from referencing import Registry, Resource

SCHEMA_FOLDER = Path(__file__).resolve().parents[2] / "docs" / "schemas"
SHARED_SCHEMA = "common"  # definitions for other schemas


@cache
def load_schemas():
    """Return all schemas by name."""
    return {path.stem: json.loads(path.read_text("utf-8")) for path in SCHEMA_FOLDER.glob("*.json")}


@cache
def _build_registry():
    schemas = load_schemas().values()
    return Registry().with_resources(
        (schema["$id"], Resource.from_contents(schema)) for schema in schemas
    )


def validate(document):
    """Raise ValidationError if a JSON object does not match the schema that it names."""
    tool, name, _version = document["schema"].split("/")
    assert tool == "quarc-ref"
    Draft202012Validator(load_schemas()[name], registry=_build_registry()).validate(document)
