"""The schemas of docs/schemas, and JSON validated against them."""

import json
from functools import cache
from pathlib import Path

from jsonschema import Draft202012Validator
from referencing import Registry, Resource

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "schemas"
SHARED = "common"  # definitions for other schemas


@cache
def load_schemas():
    """All schemas by name."""
    return {path.stem: json.loads(path.read_text("utf-8")) for path in FOLDER.glob("*.json")}


@cache
def _registry():
    schemas = load_schemas().values()
    return Registry().with_resources(
        (item["$id"], Resource.from_contents(item)) for item in schemas
    )


def validate(printed_output):
    """Raise ValidationError unless JSON matches the schema that it names."""
    tool, name, _version = printed_output["schema"].split("/")
    assert tool == "quarc-ref"
    Draft202012Validator(load_schemas()[name], registry=_registry()).validate(printed_output)
