"""What others have published, read from config/validation, and the aircraft that is compared with it."""

from functools import cache
from typing import Any

from sbs_sim.aircraft import Aircraft
from sbs_sim.config_file import config_folder, read_yaml


@cache
def data(name: str) -> dict[str, Any]:
    """File of a case, as it is.

    Raises
    ------
    UnreadableError
        It cannot be read.
    """
    return dict(read_yaml(config_folder() / "validation" / f"{name}.yaml"))


@cache
def craft(name: str) -> Aircraft:
    """Aircraft of the repository, read once for all evaluations of a case."""
    return Aircraft.load(name)
