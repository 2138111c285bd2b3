"""`cairn check`: a scene as a JSON document, its faults, and what would be run."""

import json
import sys


def add_parser(add, commands):
    """The parser of `cairn check`."""
    check = add(
        commands,
        "check",
        "check a scene that is a JSON document, without running it",
        "cairn check pile.json                 a line for each fault, exit status 1; else what would be run, and warnings\n"
        "cairn check pile.json --json          the same for programs\n"
        "cairn check --schema > scene.schema.json",
    )
    check.add_argument("file", nargs="?", help="a .json document")
    check.add_argument("--json", action="store_true", help="answer in JSON: ok, errors and warnings (path, message), explain")
    check.add_argument("--schema", action="store_true", help="write the JSON schema of documents")


def main(options):
    """`cairn check`."""
    from ..base.errors import FileError
    from ..run import documents

    if options.schema:
        print(json.dumps(documents.schema(), indent=1))
        return 0
    if options.file is None:
        raise ValueError("say which document to check: cairn check pile.json, or --schema")
    made, warned = None, []
    try:
        made = documents._Builder(documents.read(options.file)).build()
        problems, warned = made.problems, documents.warnings_of(made)
    except FileError as error:
        if not options.json:
            raise
        problems = [documents.Problem("", str(error))]
    if options.json:
        told = [[{"path": p.path, "message": p.message} for p in of] for of in (problems, warned)]
        found = {"ok": not problems, "errors": told[0], "warnings": told[1]}
        if not problems and made.simulation is not None:
            found["explain"] = made.simulation.explain(json=True)
        print(json.dumps(found, indent=1, allow_nan=False))
        return 1 if problems else 0
    for kind, of in (("error", problems), ("warning", warned)):
        for problem in of:
            print(f"cairn: {kind}: {options.file}{problem.path and ' '}{problem.path}: {problem.message}", file=sys.stderr)
    if problems:
        return 1
    count = f", {len(warned)} warning{'s' if len(warned) > 1 else ''}" if warned else ""
    if made.simulation is None:
        print(f"{options.file}: no fault{count}; it tells no simulation")
    else:
        print(f"{options.file}: no fault{count}\n\n{made.simulation.explain()}")
    return 0
