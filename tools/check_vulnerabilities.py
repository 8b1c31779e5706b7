"""Compare the pinned packages with the known vulnerabilities, and print those that are affected.

    ./run python tools/check_vulnerabilities.py                      ask the open database OSV, one request for all
    ./run python tools/check_vulnerabilities.py --database all.zip   without network: a copy of its files for PyPI

Exit code 0: none is known. 1: some are; each is a line with package, version, names and, where there is one, the
version that mends it. 2: nothing could be compared, and why.

Of the advisories in the format of OSV (https://ossf.github.io/osv-schema) `versions` and the ranges of type ECOSYSTEM
count, as the format's evaluation algorithm says. What is withdrawn does not.
"""

import argparse
import json
import re
import sys
import urllib.error
import urllib.request
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from packaging.version import InvalidVersion, Version

REQUIREMENTS = Path(__file__).resolve().parents[1] / "requirements"
PINNED = re.compile(r"^(?P<name>[\w.-]+)==(?P<version>[\w.]+)", re.MULTILINE)
SERVICE = "https://api.osv.dev/v1/querybatch"
PATIENCE = 30.0  # s


def main() -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--database", type=Path, metavar="ZIP", help="advisories as files, where there is no network")
    arguments = parser.parse_args()
    pinned = sorted({(plain(found["name"]), found["version"]) for found in _pins()})
    try:
        known = in_database(arguments.database, pinned) if arguments.database else ask(pinned)
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        print(f"nothing was compared: {error}", file=sys.stderr)
        return 2
    for (name, version), advisories in sorted(known.items()):
        print(f"{name} {version}: {', '.join(advisories)}")
    print(f"{len(pinned)} packages, {len(known)} with known vulnerabilities")
    return 1 if known else 0


def _pins() -> Iterator[re.Match[str]]:
    for path in sorted(REQUIREMENTS.glob("*.txt")):
        yield from PINNED.finditer(path.read_text())


def plain(name: str) -> str:
    """Name of a package as the packaging specifications compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def ask(pinned: list[tuple[str, str]]) -> dict[tuple[str, str], list[str]]:
    """Advisories that the service knows for each package."""
    queries = [{"package": {"ecosystem": "PyPI", "name": name}, "version": version} for name, version in pinned]
    request = urllib.request.Request(
        SERVICE, json.dumps({"queries": queries}).encode(), {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
        results = json.load(answer)["results"]
    named = {
        pin: [found["id"] for found in result.get("vulns", [])] for pin, result in zip(pinned, results, strict=True)
    }
    return {pin: advisories for pin, advisories in named.items() if advisories}


def in_database(path: Path, pinned: list[tuple[str, str]]) -> dict[tuple[str, str], list[str]]:
    """Advisories of a copy of the database for each package."""
    wanted = dict(pinned)
    found: dict[tuple[str, str], list[str]] = {}
    with zipfile.ZipFile(path) as archive:
        for name in sorted(archive.namelist()):
            advisory = json.loads(archive.read(name))
            for affected in [] if advisory.get("withdrawn") else advisory.get("affected", []):
                package = plain(affected.get("package", {}).get("name", ""))
                if package in wanted and is_affected(affected, wanted[package]):
                    found.setdefault((package, wanted[package]), []).append(_told(advisory, affected))
    return found


def is_affected(affected: dict[str, Any], version: str) -> bool:
    """True if a version is in the list or in one of the ranges."""
    if version in affected.get("versions", []):
        return True
    ranges = [entry["events"] for entry in affected.get("ranges", []) if entry.get("type") == "ECOSYSTEM"]
    return any(_in_range(events, Version(version)) for events in ranges)


def _in_range(events: list[dict[str, str]], version: Version) -> bool:
    """The last event at or before the version decides; `last_affected` acts behind its version."""
    inside = False
    for event in sorted(events, key=lambda event: _place(next(iter(event.values())))):
        kind, text = next(iter(event.items()))
        place = _place(text)
        if kind == "introduced" and version >= place:
            inside = True
        elif (kind == "fixed" and version >= place) or (kind == "last_affected" and version > place):
            inside = False
    return inside


def _place(text: str) -> Version:
    try:
        return Version(text)
    except InvalidVersion:
        return Version("0")


def _told(advisory: dict[str, Any], affected: dict[str, Any]) -> str:
    fixes = [event["fixed"] for entry in affected.get("ranges", []) for event in entry["events"] if "fixed" in event]
    return advisory["id"] + (f" (mended in {', '.join(fixes)})" if fixes else "")


if __name__ == "__main__":
    sys.exit(main())
