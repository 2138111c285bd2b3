"""`cairn completion`: scripts by which a shell completes commands and options."""


def add_parser(add, commands):
    """The parser of `cairn completion`."""
    parser = add(
        commands,
        "completion",
        "print a script by which a shell completes commands, options and files",
        "cairn completion bash > ~/.local/share/bash-completion/completions/cairn\n"
        "cairn completion zsh > ~/.zfunc/_cairn",
    )
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"), help="which shell")


def main(options):
    """`cairn completion`."""
    try:
        import shtab
    except ImportError as error:
        raise ImportError("completion needs shtab: pip install shtab") from error
    parser = options.whole
    for command in parser.commands.values():
        for action in command._actions:
            if not action.option_strings and action.dest in ("file", "files", "what", "a", "b", "study", "interface"):
                action.complete = shtab.FILE
    print(shtab.complete(parser, options.shell))
    return 0
