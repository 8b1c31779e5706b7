"""What the command lines of all executables have in common.

Nothing slow is imported here, so that `--help` and a wrong argument are answered at once.
"""

import argparse
import json
from typing import Any


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
