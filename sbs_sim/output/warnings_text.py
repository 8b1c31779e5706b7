"""Warnings of several rotors in as few lines as say the same."""

from collections.abc import Sequence


def joined(lines: Sequence[str]) -> list[str]:
    """Lines "MR1: text" and "MR2: text" as one, "MR1, MR2: text", in the order of the first of each text."""
    names: dict[str, list[str]] = {}
    for line in lines:
        name, colon, text = line.partition(": ")
        names.setdefault(text if colon else line, []).extend([name] if colon else [])
    return [f"{', '.join(dict.fromkeys(found))}: {text}" if found else text for text, found in names.items()]
