#!/usr/bin/python3
"""usage: json_schema.py SCHEMA < DOCUMENT

Prints what speaks against the document, a line each, and then exits with 1. A key that the schema does not name counts
too, although readers must not mind it: what is written is to be published.
"""
import json
import sys

import jsonschema


def close_objects(schema):
    if isinstance(schema, dict):
        if "properties" in schema:
            schema.setdefault("additionalProperties", False)
        parts = schema.values()
    else:
        parts = schema if isinstance(schema, list) else []
    for part in parts:
        close_objects(part)


with open(sys.argv[1], encoding="utf-8") as file:
    schema = json.load(file)
jsonschema.Draft7Validator.check_schema(schema)
close_objects(schema)
errors = list(jsonschema.Draft7Validator(schema).iter_errors(json.load(sys.stdin)))
for error in errors:
    print("/" + "/".join(map(str, error.absolute_path)) + ": " + error.message[:300])
sys.exit(1 if errors else 0)
