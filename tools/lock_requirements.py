"""Lock requirements/*.txt and docs/requirements.txt: write *.lock with the hashes of everything that may be installed.

    ./run python tools/lock_requirements.py

Needs uv (0.13 or later) in the path, and the network. The environment is installed from the .lock files alone, so that
a package that was exchanged on its way, or later, is refused. The versions are those of the .txt files, which are
edited by hand; test/library/test_security.py checks that the two agree.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OLDEST_PYTHON = {"requirements": "3.10", "docs": "3.11.5"}  # of the folders of the files
OPTIONS = ("--generate-hashes", "--no-deps", "--universal", "--no-annotate", "--no-header", "--quiet")


def main() -> int:
    """Lock every file; the exit code of the first that fails."""
    for source in (*sorted((ROOT / "requirements").glob("*.txt")), ROOT / "docs" / "requirements.txt"):
        target, oldest = source.with_suffix(".lock"), OLDEST_PYTHON[source.parent.name]
        command = ["uv", "pip", "compile", source.name, *OPTIONS, "--python-version", oldest, "-o", target.name]
        ended = subprocess.run(command, cwd=source.parent, check=False)
        if ended.returncode:
            return ended.returncode
        print(f"{target.name}: {target.read_text().count('==')} packages, {target.read_text().count('--hash')} files")
    return 0


if __name__ == "__main__":
    sys.exit(main())
