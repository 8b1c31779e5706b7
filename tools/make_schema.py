"""Write config/aircraft.schema.json anew from the declarations in sbs_sim/aircraft/description.py.

    ./run python tools/make_schema.py

Editors that know JSON schemas complete and check aircraft files with it.
"""

import json
from pathlib import Path

from sbs_sim.aircraft.declaration import schema_of
from sbs_sim.aircraft.description import Description

TARGET = Path(__file__).resolve().parent.parent / "config" / "aircraft.schema.json"
HEADER = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "title": "sbs_sim aircraft file",
    "description": "SI units; angles in degrees where a key ends in _deg; body axes x forward, y right, z down,"
    " origin at the c.g.",
}


def text() -> str:
    """The complete file."""
    return json.dumps({**HEADER, **schema_of(Description)}, indent=2) + "\n"


def main() -> None:
    """Write the file."""
    TARGET.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    main()
