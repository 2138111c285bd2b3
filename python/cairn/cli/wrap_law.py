"""`cairn wrap-law`: an adapter that makes a contact law of an existing scalar routine."""


def add_parser(add, commands):
    """The parser of `cairn wrap-law`."""
    wrap = add(
        commands,
        "wrap-law",
        "write an adapter that makes a contact law of an existing scalar routine",
        "cairn wrap-law old_law.toml --isolate     see docs/plugins.md for the interface",
    )
    wrap.add_argument("interface", help="a .toml file that says what the routine is called with")
    wrap.add_argument("--isolate", action="store_true", help="run it in a process of its own: its STOP becomes an error message")


def main(options):
    """`cairn wrap-law`."""
    from ..plugs.wrap_law import wrap_law as write

    path, build = write(options.interface, **({"isolate": True} if options.isolate else {}))
    print(path)
    print(f"\nnow:  {build}")
    return 0
