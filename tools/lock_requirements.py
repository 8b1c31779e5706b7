"""Write the files of requirements/*.txt with the hashes of everything that may be installed for them: *.lock.

    ./run python tools/lock_requirements.py

Needs uv (0.13 or later) in the path, and the network. The environment is installed from the .lock files alone, so that
a package that was exchanged on its way, or later, is refused. The versions are those of the .txt files, which are
edited by hand; test/library/test_security.py checks that the two agree.
"""

import subprocess
import sys
from pathlib import Path

REQUIREMENTS = Path(__file__).resolve().parents[1] / "requirements"
OLDEST_PYTHON = "3.10"
OPTIONS = ("--generate-hashes", "--no-deps", "--universal", "--no-annotate", "--no-header", "--quiet")


def main() -> int:
    """Lock every file; the exit code of the first that fails."""
    for source in sorted(REQUIREMENTS.glob("*.txt")):
        target = source.with_suffix(".lock")
        command = ["uv", "pip", "compile", source.name, *OPTIONS, "--python-version", OLDEST_PYTHON, "-o", target.name]
        ended = subprocess.run(command, cwd=REQUIREMENTS, check=False)
        if ended.returncode:
            return ended.returncode
        print(f"{target.name}: {target.read_text().count('==')} packages, {target.read_text().count('--hash')} files")
    return 0


if __name__ == "__main__":
    sys.exit(main())
