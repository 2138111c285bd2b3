"""How the words of the command line are read."""

import argparse

from ..names import listed, nearest


class Parser(argparse.ArgumentParser):
    """A parser that suggests similar words when it refuses one."""

    def _check_value(self, action, value):
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, f"{value!r} is none of {listed(action.choices, value)}")

    def _get_value(self, action, text):
        try:
            return super()._get_value(action, text)
        except argparse.ArgumentError:
            due = {int: "a whole number, as in 20", float: "a number, as in 1e-3"}.get(action.type)
            if due is None:
                raise
            raise argparse.ArgumentError(action, f"{text!r} is none: give {due}") from None

    def error(self, message):
        """Ends the program with the error and a pointer to --help."""
        message = message.replace("the following arguments are required:", "missing:")
        super().error(f"{message}; see '{self.prog} --help'")

    def parse_args(self, args=None, namespace=None):
        options, unknown = self.parse_known_args(args, namespace)
        if unknown:
            parser = self.commands.get(options.command, self)
            word = next((word for word in unknown if word.startswith("-")), None)
            if word is None:
                parser.error(f"there is no place for {' '.join(unknown)}")
            word = word.partition("=")[0]
            known = [text for action in parser._actions for text in action.option_strings if text.startswith("--")]
            # compared without the dashes, which all of them share
            like = nearest(word.lstrip("-").replace("-", "_"), [text[2:].replace("-", "_") for text in known])
            told = f"did you mean '--{like.replace('_', '-')}'?" if like else f"there are {listed(known)}"
            parser.error(f"there is no option {word}; {told}")
        return options

    commands = {}


def add_command(commands, name, summary, examples):
    """The parser of a command, with its examples in the help."""
    return commands.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog="examples:\n  " + examples.replace("\n", "\n  "),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
