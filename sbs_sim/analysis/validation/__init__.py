"""Published results beside those of this program.

One module for each case. To add one:

1. Write what is published into config/validation/NAME.yaml: `source`, and every figure with its unit in its key.
2. Write a module here with a function `case() -> Case`, which computes the rows. `data(NAME)` reads the file;
   `compared(...)` makes a row. An `Aim` says how near ours shall be, in the unit of the row or as a share of the
   published value, the larger of the two; `why` is the sentence that says where it comes from. A row without an aim is
   compared, but not judged.
3. Where an aim is not met, `Case.remarks` says why in physics, and what would move it. Nothing is tuned to a case.
4. Name the module in `CASES`, and run `./run python tools/make_validation.py`, which writes docs/validation.md.
"""

import importlib
from collections.abc import Callable, Sequence

from sbs_sim import checks
from sbs_sim.analysis.validation.comparison import Aim, Case, Report, Row, compared
from sbs_sim.analysis.validation.published import data
from sbs_sim.errors import ValidationError

__all__ = ["CASES", "MODEL", "Aim", "Case", "Report", "Row", "compared", "data", "validate"]

CASES = (
    "paper",
    "pitt_peters",
    "castles_gray",
    "caradonna_tung",
    "harrington",
    "hammond",
    "ormiston_hodges",
    "pca2",
    "uh60a",
    "uh60a_genhel",
)  # modules of this package, in the order in which they are shown
MODEL = (
    "One model and one set of options for all cases: rigid blades on hinges, 20 elements of a blade, airfoil tables"
    " over Reynolds number and angle of attack with smooth interpolation, dynamic inflow of Peters and HaQuang with"
    " three states a rotor, 12 azimuths of the averages. Tip loss is 1 unless the source of a case gives another. Where"
    " a case needs another statement of the model, it is among its own."
)


def validate(names: Sequence[str] = (), *, progress: Callable[[int, int], None] | None = None) -> Report:
    """Compute cases.

    Parameters
    ----------
    names : sequence of str
        Some of `CASES`; all of them if there are none.
    progress : callable, optional
        Called with the number of cases done and that of all, as each ends.

    Raises
    ------
    ValidationError
        There is no case of a name.
    """
    chosen = list(dict.fromkeys(names)) or list(CASES)
    for name in chosen:
        checks.choice("case", name, CASES, ValidationError)
    cases = []
    for done, name in enumerate(chosen, 1):
        cases.append(importlib.import_module(f"{__name__}.{name}").case())
        if progress is not None:
            progress(done, len(chosen))
    return Report(MODEL, tuple(cases))
