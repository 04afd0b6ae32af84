#!/usr/bin/python3
"""usage: json_schema.py SCHEMA < DOCUMENT
       json_schema.py OPENAPI POINTER < DOCUMENT

Prints what speaks against the document, a line each, and then exits with 1. With a POINTER, that part of an OpenAPI 3.1
file is the schema. A key that the schema does not name counts too, although readers must not mind it: what is written is
to be published.
"""
import json
import sys

import jsonschema


def close_objects(schema):
    if isinstance(schema, dict):
        if isinstance(schema.get("properties"), dict):
            schema.setdefault("additionalProperties", False)
        parts = schema.values()
    else:
        parts = schema if isinstance(schema, list) else []
    for part in parts:
        close_objects(part)


def part_of(document, pointer):
    for key in pointer.split("/")[1:]:
        document = document[key.replace("~1", "/").replace("~0", "~")]
    return document


with open(sys.argv[1], encoding="utf-8") as file:
    whole = json.load(file)
pointed = len(sys.argv) > 2
judge = jsonschema.Draft202012Validator if pointed else jsonschema.Draft7Validator
schema = part_of(whole, sys.argv[2]) if pointed else whole
judge.check_schema(schema)
close_objects(whole)
errors = list(judge(schema, resolver=jsonschema.RefResolver("", whole)).iter_errors(json.load(sys.stdin)))
for error in errors:
    print("/" + "/".join(map(str, error.absolute_path)) + ": " + error.message[:300])
sys.exit(1 if errors else 0)
