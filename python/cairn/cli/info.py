"""`cairn info`: contents of a file and convergence of the solver."""


def add_parser(add, commands):
    """The parser of `cairn info`."""
    info = add(
        commands,
        "info",
        "what is in a file, and how the solver did",
        "cairn info pile.vtkhdf\ncairn info pile.vtkhdf --json\ncairn info pile.vtkhdf --script     the script that made it\n"
        "cairn info pile.vtkhdf --check",
    )
    info.add_argument("file", help="a run, a scene or a checkpoint")
    info.add_argument("--json", action="store_true", help="output as JSON, for programs")
    info.add_argument("--script", action="store_true", help="print the script that made the run")
    info.add_argument("--check", action="store_true", help="verify the checksums of all that the file holds")
    info.add_argument("--repair", action="store_true", help="after a loss of power: go back to the last state on the disk")


def main(options):
    """`cairn info`."""
    from ..files.container import restore_superblock
    from ..post.summary import describe, render

    if options.repair:
        changed = restore_superblock(options.file)
        print("went back to the last state that was on the disk" if changed else "nothing to repair")
    if options.script:
        from ..post.load import load

        with load(options.file) as run:
            print(run.provenance.get("script_text") or run.provenance.get("script") or "no script is stored")
        return 0
    facts = describe(options.file)
    if options.check:
        from ..files.sums import check

        facts["checksums"] = check(options.file)
    if options.json:
        import json

        print(json.dumps(facts, indent=2, default=str))
    else:
        print(render(facts))
    return 0
