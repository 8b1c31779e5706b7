"""Results as JSON."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def to_json(data: Any) -> str:
    """Text of a mapping as JSON; see `plain`."""
    return json.dumps(plain(data), allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Numbers, texts, lists and mappings of them for JSON.

    Arrays and tuples become lists, complex numbers {"real", "imag"}, and None is what is not finite.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        numbers = value.tolist()
        # the long way for each number is slow where there are thousands
        is_plain = value.dtype.kind in "biu" or (value.dtype.kind == "f" and bool(np.isfinite(value).all()))
        return numbers if is_plain else plain(numbers)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, complex):
        return {"real": plain(value.real), "imag": plain(value.imag)}
    return None if isinstance(value, float) and not math.isfinite(value) else value
