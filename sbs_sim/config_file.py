"""Configuration files: where they are, and reading YAML."""

from pathlib import Path
from typing import Any

from sbs_sim.errors import AircraftError, SbsError

MAX_FILE_SIZE = 1 << 18  # bytes; an aircraft with 16 rotors has 20 000


class UnreadableError(SbsError):
    """A file that is not YAML, or too large for a configuration."""


def config_folder() -> Path:
    """Folder with the configuration files of the package: aircraft, airfoils, joysticks.

    Raises
    ------
    AircraftError
        The package was installed without them.
    """
    here = Path(__file__).resolve().parent
    # of a wheel, of a checkout, of an installation of ROS
    folders = [here / "config", here.parent / "config", *(parent / "share/sbs_sim/config" for parent in here.parents)]
    for folder in folders:
        if (folder / "aircraft").is_dir():
            return folder
    raise AircraftError(f"no folder config/aircraft in or beside {here} and none under share/sbs_sim above it")


def find_file(path_or_name: str | Path, kind: str, suffix: str, folder: Path) -> Path:
    """Path of a configuration file.

    Parameters
    ----------
    path_or_name : str or Path
        A path, or the name of a file of the package without its suffix.
    kind : str
        Folder below config/ with the files of the package.
    suffix : str
    folder : Path
        Where relative paths start.

    Raises
    ------
    AircraftError
        There is no such file: one line with the names of those of the package.
    """
    given = Path(path_or_name)
    for start in (folder, config_folder() / kind):
        for candidate in (start / given, start / f"{given}{suffix}"):
            if _is_file(candidate):
                return candidate
    known = ", ".join(sorted(path.stem for path in (config_folder() / kind).glob(f"*{suffix}")))
    raise AircraftError(f"{kind.rstrip('s')} = {str(path_or_name)!r}: allowed are a file's path or one of {known}")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have, a folder that may not be entered
        return False


def read_yaml(path: Path) -> Any:
    """Content of a YAML file.

    Raises
    ------
    UnreadableError
        It cannot be read, in one line.
    """
    from ruamel.yaml import YAML  # here, because it is slow to import and needed once

    try:
        with path.open("rb") as file:
            text = file.read(MAX_FILE_SIZE + 1)
        if len(text) > MAX_FILE_SIZE:
            raise UnreadableError(f"the file has more than {MAX_FILE_SIZE} bytes")
        return YAML(typ="safe", pure=True).load(text.decode("utf-8"))
    except UnreadableError:
        raise
    except Exception as error:  # of many kinds: for "!!int x", a 31st of June, deep nesting
        raise UnreadableError("not readable as YAML: " + " ".join(str(error).split())) from None
