"""Write docs/validation.md anew: published results beside those of this program.

./run python tools/make_validation.py
"""

import argparse
import re
from pathlib import Path

from sbs_sim.analysis.validation import validate
from sbs_sim.analysis.validation.formats import markdown

PAGE = Path(__file__).resolve().parent.parent / "docs" / "validation.md"
NOTE = "<!-- Made by tools/make_validation.py: do not edit. -->\n"


def page() -> str:
    """The page."""
    return f"{NOTE}{markdown(validate())}"


def without_numbers(text: str) -> str:
    """What of the page is the same on every machine: all but the digits of computed values, and rows of blanks."""
    return re.sub(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "#", text)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    PAGE.write_text(page(), encoding="utf-8")
    print(f"written: {PAGE}")
