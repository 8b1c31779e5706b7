"""What the command lines of all executables have in common.

Nothing slow is imported here, so that `--help` and a wrong argument are answered at once.
"""

import argparse
import json
import re
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

# What may follow an option without being one itself; argparse of Python up to 3.13 knows no exponents.
NEGATIVE_NUMBER = re.compile(r"-((\d+\.?\d*|\.\d+)(e[-+]?\d+)?|inf|infinity|nan)", re.IGNORECASE)
UNKNOWN = re.compile(r"unrecognized arguments: (.*)")

prefix = ""  # of the names of executables, where they are commands of another: "sbs-sim "


class Parser(argparse.ArgumentParser):
    """Command line of an executable: `--version`, numbers with exponents, suggestions for what was mistyped.

    Parameters
    ----------
    name : str
        Of the executable.
    example : str
        A call of it, from its name on.
    **options
        Those of ArgumentParser.
    """

    def __init__(self, name: str, *, example: str = "", **options: Any) -> None:
        options.setdefault("epilog", f"example: {prefix or './run '}{example}" if example else None)
        super().__init__(prog=f"{prefix}{name}", **options)
        self._negative_number_matcher = NEGATIVE_NUMBER
        self.add_argument("--version", action=_Version, help="print the version of the package and end")

    def parse_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """Parse; options may be between the arguments."""
        return self.parse_intermixed_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """End with the usage, the message and what may have been meant."""
        if found := UNKNOWN.match(message):
            word = found[1].split()[0].partition("=")[0]
            message += suggestion(word, [name for name in self._option_string_actions if name.startswith("--")])
        super().error(message)

    def hidden(self, group: Any, old: str, new: str) -> None:
        """Take an old spelling of an option as well, without a word about it."""
        action = self._option_string_actions[new]
        options: dict[str, Any] = {"dest": action.dest, "type": action.type, "default": argparse.SUPPRESS}
        kind = "append" if isinstance(action, argparse._AppendAction) else "store"
        group.add_argument(old, action=kind, help=argparse.SUPPRESS, **options)


class _Version(argparse._VersionAction):
    """Look the version up when it is asked for, and not whenever there is a parser."""

    def __call__(self, *arguments: Any) -> None:
        self.version = version_line()
        super().__call__(*arguments)


def version_line() -> str:
    """Name and version of the package."""
    import sbs_sim

    return f"sbs_sim {sbs_sim.__version__}"


def suggestion(word: str, known: Iterable[str]) -> str:
    """What may have been meant, as the end of a message; empty if nothing is near."""
    from difflib import get_close_matches

    near = get_close_matches(word, list(known), 1)
    return f"; did you mean {near[0]}?" if near else ""


def assignment(text: str) -> tuple[str, Any]:
    """Path and value of PATH=VALUE.

    Raises
    ------
    ArgumentTypeError
        It is not of that form.
    """
    path, equals, value = text.partition("=")
    if not equals or not path.strip():
        raise argparse.ArgumentTypeError(f"{text!r}: allowed is PATH=VALUE, for example body.mass=25")
    return path.strip(), _value(value.strip())


def _value(text: str) -> Any:
    """Number, list or mapping as JSON or YAML writes it, any other text as it is."""
    readers = (json.loads, float, _flow) if text[:1] in ("[", "{") else (json.loads, float)
    for read in readers:
        try:
            return read(text)
        except Exception:  # the readers raise errors of many kinds
            continue
    return text


def _flow(text: str) -> Any:
    from ruamel.yaml import YAML

    return YAML(typ="safe", pure=True).load(text)
