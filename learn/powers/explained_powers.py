"""Universal kriging in dB about powers that a model of the waves predicts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from learn.powers.power_field import PowerField


class ExplainedPowers(PowerField):
    """The mean power of a gateway is P = a + n D + b T, with D = −10 log₁₀ of the distance and an explained power T.

    The weights a, n and b of each gateway are estimated with the remainder, so that what explains nothing gets no
    weight, and ``helmholtz`` is left. Subclasses set ``_of_known``, T at the known positions [n, G], before ``fit``.
    """

    _of_known: Float[np.ndarray, "n G"]

    def _explained(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        """T of each gateway, dB."""
        raise NotImplementedError

    def _trends(self, positions: Float[np.ndarray, "K 3"]) -> list[Float[np.ndarray, "K 3"]]:
        return self._with(self._explained(positions), super()._trends(positions))

    def _known_trends(self) -> list[Float[np.ndarray, "n 3"]]:
        return self._with(self._of_known[self._chosen], super()._trends(self._positions))

    def _with(
        self, explained: Float[np.ndarray, "K G"], law: list[Float[np.ndarray, "K 2"]]
    ) -> list[Float[np.ndarray, "K 3"]]:
        return [np.column_stack(each) for each in zip(law, explained.T, strict=True)]

    def _left(self, trends: list[Float[np.ndarray, "n 3"]]) -> Float[np.ndarray, "n G"]:
        pairs = zip(trends, self._powers.T, strict=True)
        return self._powers - np.stack([trend @ np.linalg.lstsq(trend, power)[0] for trend, power in pairs], axis=1)
