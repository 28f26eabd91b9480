"""A folder of spectra that another program predicted, as a method of a comparison."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from learn.comparison.known_spectra import KnownSpectra
from scenes.files.errors import InputError
from scenes.files.input_file import MEGABYTE, what_is_at
from scenes.files.npz_file import Expected, read_npy
from simulate.dataset.picture_files import read_picture
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.spectrum import spectrum_of

PICTURES, ARRAY = "spectrum", "spectra.npy"
"""Folder of pictures NAME.png, and the file of all spectra in the order of the test part."""

LARGEST = 4000 * MEGABYTE  # Most bytes of the array

BRIGHTEST = 2.0
"""Spectra are from 0 to 1, and predictions may overshoot. Grey levels of 255 are far above this."""


class Predictions:
    """Predictions of every test spectrum, which are read before anything is fitted. Other files are not looked at."""

    source: str  # hash of what was read, by which changed predictions are noticed. Set by ``read``.

    def __init__(self, folder: str):
        self._folder = Path(folder)

    def read(self, names: Sequence[str], scored: Sequence[int]) -> None:
        """Read the predictions of the test spectra of these names, and keep those that are scored."""
        if not self._folder.is_dir():
            raise InputError(f"{self._folder}: expected a folder of predictions, found {what_is_at(self._folder)}")
        if (self._folder / ARRAY).exists():
            spectra = self._array(len(names))
        elif (self._folder / PICTURES).is_dir():
            spectra = np.stack([self._picture(name, len(names)) for name in names])
        else:
            raise InputError(
                f"{self._folder}: expected {PICTURES}/ with a picture NAME.png of each test spectrum, or {ARRAY}, "
                "found neither"
            )
        self.source = hashlib.sha256(np.ascontiguousarray(spectra).data).hexdigest()[:16]
        chosen = spectra[np.asarray(scored)]
        self._scored = spectrum_of(chosen) if chosen.dtype == np.uint8 else chosen

    def fit(self, known: KnownSpectra) -> None:
        """Nothing: what the predictions learned from is their author's affair."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return self._scored

    def _picture(self, name: str, count: int) -> np.ndarray:
        path = self._folder / PICTURES / f"{name}.png"
        if not path.exists():
            raise InputError(f"{path}: expected a prediction of each of the {count} test spectra, found none of {name}")
        return read_picture(self._within(path))

    def _array(self, count: int) -> Float[np.ndarray, "K 90 360"]:
        path, shape = self._within(self._folder / ARRAY), (count, ROWS, COLUMNS)
        spectra = read_npy(path, Expected(f"spectra {list(shape)} of the test part", "f", shape), LARGEST)
        wrong = ~(np.abs(spectra) <= BRIGHTEST).all(axis=(1, 2))
        if wrong.any() or spectra.dtype.kind != "f":
            row = int(wrong.argmax())
            found = f"{spectra.dtype} from {spectra[row].min():g} to {spectra[row].max():g}"
            raise InputError(
                f"{path}, row {row} (counted from 0): expected finite numbers from 0 to 1 (grey levels / 255), found "
                f"{found} in {int(wrong.sum())} of {count} rows"
            )
        return spectra

    def _within(self, path: Path) -> Path:
        """Refuse a link out of the folder."""
        if not path.resolve().is_relative_to(self._folder.resolve()):
            raise InputError(f"{path}: expected a file in the folder, found a link out of it")
        return path
