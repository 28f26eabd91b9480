"""With which grid and array were spectra measured, and which element responses are behind them?

python -m benchmarks.data.grid data/rfid-s23-160 --json

For a folder of measured pictures, 4 × 4 arrays are fitted: with rows that begin at 0° or 1° of elevation, and with
several spacings in wavelengths. The figure is the root mean square error in grey levels of 255, as the median over the
pictures. Rounding to 8 bits alone leaves 0.29.

Then the responses of 200 pictures are retrieved. Measured are the seconds, the percentage of pictures that the
responses reproduce to within 0.5 grey levels, and the SSIM of reproduced and measured pictures. The last figure is by
how many grey levels the pictures lie below the reproduced spectra: 0.5 if they were cut to whole numbers, 0 if they
were rounded.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import fit_grids
from simulate.spectra.lags import EXAMINED, fit_lags
from simulate.spectra.phase_retrieval import GOOD, retrieve_responses
from simulate.spectra.spectrum import LARGEST_GREY, evenly, normalise, spectrum_of


def main(
    measured: tyro.conf.Positional[Path],
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Fit grids and arrays to a measured folder, and retrieve its responses."""
    spectra = spectrum_of(read_dataset(measured).pictures)
    if smallest:
        spectra = spectra[:4]
    began = time.perf_counter()
    best = fit_grids(evenly(spectra, EXAMINED))[0][1]
    result: dict[str, float] = {
        "found_elevation_first_deg": best.grid.elevation_first_deg,
        "found_spacing_wavelengths": round(best.array.spacing, 4),
        "finding_seconds": round(time.perf_counter() - began, 2),
    }
    for first in (0.0, 1.0):
        for spacing in (round(best.array.spacing, 3), 0.5):
            fitted = fit_lags(spectra, Beamformer(PlanarArray(spacing=spacing), AngularGrid(first)))
            name = f"residual_rows_{first:g}_to_{first + 89:g}_spacing_{spacing:g}"
            result[name] = round(fitted.median_residual, 2)

    began = time.perf_counter()
    found = retrieve_responses(spectra, best)
    seconds = time.perf_counter() - began
    reproduced = normalise(best.spectrum(found.responses))
    result |= {
        "retrieval_seconds_per_200": round(200 * seconds / len(spectra), 1),
        "retrieval_residual_median": round(float(np.median(found.residual)), 2),
        "retrieval_residual_p99": round(float(np.percentile(found.residual, 99)), 2),
        "retrieved_percent": round(100 * float(np.mean(found.residual < GOOD)), 1),
        "ssim_of_reproduced_median": round(float(np.median(ssim(reproduced, spectra.astype(float)))), 4),
        "grey_levels_cut_off": round(LARGEST_GREY * float(np.median((reproduced - spectra).mean(axis=(1, 2)))), 2),
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
