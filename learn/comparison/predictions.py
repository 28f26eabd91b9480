"""A folder with the predictions of another program, as a method of a comparison."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.quantities.known import Known
from learn.quantities.quantity import Prediction, Quantity
from scenes.files.errors import InputError
from scenes.files.input_file import MEGABYTE, what_is_at
from scenes.files.npz_file import Expected, read_npy
from simulate.dataset.picture_files import read_picture
from simulate.spectra.spectrum import spectrum_of

PICTURES = "spectrum"  # Folder of pictures NAME.png

LARGEST = 4000 * MEGABYTE  # Most bytes of the array

BRIGHTEST = 2.0
"""Spectra are from 0 to 1, and predictions may overshoot. Grey levels of 255 are far above this."""


class Predictions:
    """Predictions of every test row, which are read before anything is fitted. Other files are not looked at.

    The file of the quantity (spectra.npy, powers.npy, …) has those of all rows in the order of the test part. Spectra
    may also be pictures, spectrum/NAME.png.
    """

    seconds = None  # of the fit: it is not known
    source: str  # hash of what was read, by which changed predictions are noticed. Set by ``read``.

    def __init__(self, folder: str):
        self._folder = Path(folder)

    def read(self, quantity: Quantity, names: Sequence[str], scored: Sequence[int], shape: Sequence[int]) -> None:
        """Read the predictions of the test rows of these names, [shape] each, and keep those that are scored."""
        if not self._folder.is_dir():
            raise InputError(f"{self._folder}: expected a folder of predictions, found {what_is_at(self._folder)}")
        pictures = self._folder / PICTURES if quantity.name == "spectrum" else None
        if (self._folder / quantity.file).exists():
            values = self._array(quantity, (len(names), *shape))
        elif pictures is not None and pictures.is_dir():
            values = np.stack([self._picture(name, len(names)) for name in names])
        else:
            also = "" if pictures is None else f", or {PICTURES}/ with a picture NAME.png of each test spectrum"
            raise InputError(f"{self._folder}: expected {quantity.file}{also}, found neither")
        self.source = hashlib.sha256(np.ascontiguousarray(values).data).hexdigest()[:16]
        chosen = values[np.asarray(scored)]
        self._scored = spectrum_of(chosen) if pictures is not None and chosen.dtype == np.uint8 else chosen

    def fit(self, known: Known) -> None:
        """Nothing: what the predictions learned from is their author's affair."""

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        return Prediction(self._scored)

    def _picture(self, name: str, count: int) -> np.ndarray:
        path = self._folder / PICTURES / f"{name}.png"
        if not path.exists():
            raise InputError(f"{path}: expected a prediction of each of the {count} test spectra, found none of {name}")
        return read_picture(self._within(path))

    def _array(self, quantity: Quantity, shape: tuple[int, ...]) -> np.ndarray:
        path = self._within(self._folder / quantity.file)
        kind = "c" if "c" in quantity.kinds else "f"
        expected = Expected(f"{quantity.things} {list(shape)} of the test part", kind, shape)
        values = read_npy(path, expected, LARGEST)
        within = np.isfinite(values)
        if quantity.name == "spectrum":
            within &= (np.abs(values) <= BRIGHTEST) & (values.dtype.kind == "f")
        wrong = ~within.reshape(len(values), -1).all(axis=1)
        if wrong.any():
            row = int(wrong.argmax())
            numbers = "finite numbers" + (" from 0 to 1 (grey levels / 255)" if quantity.name == "spectrum" else "")
            raise InputError(
                f"{path}, row {row} (counted from 0): expected {numbers}, found {values.dtype} of magnitudes up to "
                f"{np.abs(values[row]).max():g} in {int(wrong.sum())} of {shape[0]} rows"
            )
        return values

    def _within(self, path: Path) -> Path:
        """Refuse a link out of the folder."""
        if not path.resolve().is_relative_to(self._folder.resolve()):
            raise InputError(f"{path}: expected a file in the folder, found a link out of it")
        return path
