"""The commands that make or complete a dataset folder from what others measured: dataset, convert, responses."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional

from bisplat.commands.array_option import array_option
from bisplat.commands.given_options import refuse_given
from bisplat.commands.output_file import Force, require_new
from bisplat.commands.simulate_command import Output
from scenes.files.errors import ParameterError, printable
from simulate.exchange.reading_options import Conversion, Recording


def dataset(
    files: Positional[tuple[Path, ...]],
    output: Output,
    frequency: str,
    array: str,
    gateway: tuple[float, float, float] = (0, 0, 0),
    boresight: tuple[float, float, float] = (0, 0, 1),
    recording: Annotated[Recording, OmitArgPrefixes] = Recording(),
) -> None:
    """Make a dataset folder from recorded element responses.

    The files hold positions and complex responses. They are NumPy's, MATLAB's, HDF5 or tables of text. The command
    prints what it recognised and assumed.

    Args:
        files: one file or several, which together hold positions and responses.
        output: the new dataset folder.
        frequency: carrier frequency: hertz, or such as "2.4 GHz".
        array: array of the gateway: ROWSxCOLUMNS@SPACING, with the spacing in wavelengths, or a CSV file with columns
            x,y,z of element positions, metres, gateway frame.
        gateway: position of the gateway, metres.
        boresight: direction that the gateway looks in. Its y axis points as far up as possible.
    """
    from scenes.scene.antennas import Gateway
    from scenes.scene.orientation import facing
    from simulate.exchange.recorded_responses import record

    if not files:
        raise ParameterError("files", "expected at least one file, found none")
    own_array = array_option(array)
    if "rows" in own_array and "spacing" not in own_array:
        raise ParameterError("array", f"expected the spacing in wavelengths, too, such as {array}@0.5, found {array}")
    if recording.moving == "both":
        refuse_given(["--gateway"], "none beside --moving both, where the receivers' positions are those of the array")
    receiver = Gateway(gateway, facing(boresight), **own_array)
    for sentence in record(files, output, receiver, frequency, recording):
        print(printable(sentence))
    print(printable(f"dataset: {output}"))


def convert(
    source: Positional[Path],
    output: Output,
    conversion: Annotated[Conversion, OmitArgPrefixes] = Conversion(),
) -> None:
    """Convert another program's spectra into a dataset folder.

    The command prints what it changed.

    Args:
        source: folder with spectrum/, tx_pos.csv and gateway_info.yml.
        output: the new dataset folder.
    """
    from simulate.exchange.convert import convert as convert_folder

    for sentence in convert_folder(source, output, conversion):
        print(printable(sentence))
    print(printable(f"dataset: {output}"))


def responses(dataset: Positional[Path], json: bool = False, force: Force = False) -> None:
    """Recover the element responses from a dataset's pictures.

    The command writes channels.npz to the dataset folder, and marks the responses as retrieved. A picture determines
    its responses up to a common phase and the flip y_m -> conj y_{MN-1-m}. If the command is interrupted, the same
    command continues.

    Args:
        dataset: dataset folder without recorded responses.
        json: print the result as JSON.
    """
    import numpy as np

    from simulate.dataset.dataset_folder import read_dataset
    from simulate.dataset.response_retrieval import retrieve
    from simulate.spectra.phase_retrieval import GOOD

    given = read_dataset(dataset)
    recorded = given.phases_recorded_per_position and given.retrieved is not None
    if given.responses is None and not recorded:  # recorded ones are never replaced
        require_new(dataset / "channels.npz", force=force)
    residual = retrieve(given).residual
    good = residual < GOOD
    doubtful = [name for name, fine in zip(given.names, good, strict=True) if not fine]
    if json:
        result = {
            "pictures": len(residual),
            "retrieved": int(good.sum()),
            "residual_median_grey_levels": round(float(np.median(residual)), 3),
            "doubtful": doubtful,
        }
        print(json_format.dumps(result, indent=2))
        return
    print(
        f"the responses reproduce {good.sum()} of {len(residual)} pictures to within {GOOD} grey levels (median "
        f"{np.median(residual):.2f}). Each picture determines its responses up to a common phase and the flip "
        "y_m -> conj y_(MN-1-m)."
    )
    if doubtful:
        more = " ..." if len(doubtful) > 10 else ""
        print(printable(f"doubtful: {len(doubtful)} pictures: {', '.join(doubtful[:10])}{more}"))
    print(printable(f"responses: {dataset / 'channels.npz'}"))
