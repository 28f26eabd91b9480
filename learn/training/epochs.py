"""When a training by steps is validated, and on which spectra."""

from __future__ import annotations

import numpy as np
from jaxtyping import Int

from simulate.spectra.spectrum import evenly

STEPS_PER_VALIDATION, VALIDATIONS = 100, 15
"""Smallest number of steps between validations, and number of validations of a long training, which has more steps than
the product of both."""

VALIDATED = 128
"""Largest number of validation spectra, evenly spread over the validation part."""


def epochs_of(steps: int) -> list[int]:
    """Number of steps between validations, for each validation; they add up to ``steps``.

    >>> epochs_of(250), epochs_of(99), epochs_of(3001)[-2:]
    ([125, 125], [99], [200, 200])
    """
    validations = max(1, min(steps // STEPS_PER_VALIDATION, VALIDATIONS))
    each, more = divmod(steps, validations)
    return [each + 1] * more + [each] * (validations - more)


def validation_sample(part: Int[np.ndarray, " n"]) -> Int[np.ndarray, " v"]:
    """The spectra of a validation part on which models are validated.

    >>> len(validation_sample(np.arange(1000))), len(validation_sample(np.arange(50)))
    (128, 50)
    """
    return evenly(part, VALIDATED)
