"""What are known phases worth?

python -m benchmarks.data.phases data/rfid-s23-160 --json

The closet in full wave (the field in tests/data) has several numbers of known spectra. The figures are median SSIMs of
200 other spectra, predicted by kriging in three ways: from the pictures, from responses that are found behind the
pictures and form one field (learn/models/kriging/retrieved_field.py), and from the true responses.

The measured sample has no true responses. There, the third way is helmholtz, which weighs the first two by pictures
that are left out. ``seconds`` is the time to find the responses and to fit to them.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from learn.data.splits import split
from learn.models.base import SpectrumModel
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.retrieved_field import fit_to_pictures, retrieved_responses
from learn.training.prediction import predict
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.generation.simulation import simulate

KNOWN = (50, 100, 150, 300, 600)
TESTED = 200


def empty(dataset: Dataset, of: Any) -> KrigedField:
    """A field without known spectra."""
    return KrigedField(np.zeros((2, 3)), dataset.beamformer, dataset.wavelength, of)


def scored(model: SpectrumModel, dataset: Dataset, test: np.ndarray) -> float:
    """Median SSIM of the test spectra."""
    found = predict(model, dataset.positions[test]).spectra
    return round(float(np.median(ssim(found, dataset.spectra[test]))), 4)


def from_pictures(dataset: Dataset, known: np.ndarray, test: np.ndarray) -> dict[str, float]:
    """Scores without the phases and with those that are found."""
    of_spectra, found = empty(dataset, "spectra"), empty(dataset, "responses")
    of_spectra.fit(dataset, known)
    began = time.perf_counter()
    fit_to_pictures(found, of_spectra, retrieved_responses(dataset, known), dataset, known)
    seconds = round(time.perf_counter() - began, 1)
    return {
        "pictures": scored(of_spectra, dataset, test),
        "phases found": scored(found, dataset, test),
        "seconds": seconds,
    }


def main(
    measured: Positional[Path | None] = None,
    field: Path = Path("tests/data/closet"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Score fields from pictures and from responses."""

    sizes, tested = ((12,), 4) if smallest else (KNOWN, TESTED)
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        closet = simulate("closet", Path(folder) / "closet", max(sizes) + tested, engine="fullwave", field=field)
        order = np.random.default_rng(0).permutation(len(closet.positions))
        test = np.sort(order[:tested])
        for size in sizes:
            known = np.sort(order[tested : tested + size])
            row = from_pictures(closet, known, test)
            of_responses = empty(closet, "responses")
            of_responses.fit(closet, known)
            result[f"closet, {size}"] = row | {"responses known": scored(of_responses, closet, test)}
    if measured is not None and not smallest:
        sample = read_dataset(measured).with_values(response=None)
        for kind in ("files", "blocked"):
            parts: Any = split(sample, kind, 0)  # type: ignore[arg-type]
            model = HelmholtzField(np.zeros((2, 3)), sample.beamformer, sample.wavelength)
            model.fit(sample, parts.train)
            model.refit(sample, parts.known)
            row = from_pictures(sample, parts.known, parts.test)
            result[f"measured, {kind}"] = row | {"helmholtz": scored(model, sample, parts.test)}
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
