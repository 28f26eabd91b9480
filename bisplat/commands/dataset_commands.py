"""The commands that make or complete a dataset folder: dataset, convert, responses and rssi."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.idle_options import given_options, refuse_idle, refuse_idle_propagation
from bisplat.commands.scene_changes import SceneChanges, array_option, changed_scene
from bisplat.commands.simulate_command import Output
from scenes.files.atomic import require_writable
from scenes.files.errors import ParameterError, printable
from scenes.files.options import changed, checked, unchecked
from simulate.exchange.reading_options import Conversion, Recording
from simulate.generation.power_receiver import PowerReceiver
from simulate.positions.positions import Places
from simulate.rays.core.propagation import Propagation


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
    options = given_options(dataset, locals())
    from scenes.scene.antennas import Gateway
    from scenes.scene.orientation import facing
    from simulate.exchange.recorded_responses import record

    if not files:
        raise ParameterError("files", "expected at least one file, found none")
    own_array = array_option(array)
    if "rows" in own_array and "spacing" not in own_array:
        raise ParameterError("array", f"expected the spacing in wavelengths, too, such as {array}@0.5, found {array}")
    if recording.moving == "both":
        refuse_idle(options, ["gateway"], "with --moving both, where the receivers' positions are those of the array")
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
    from simulate.dataset.responses_file import retrieve
    from simulate.spectra.phase_retrieval import GOOD

    given = read_dataset(dataset)
    recorded = given.phases_recorded_per_position and "retrieved" in given.values
    if "response" not in given.values and not recorded:  # recorded ones are never replaced
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


def rssi(
    scene: Positional[str],
    output: Output,
    gateways: Path,
    frequency: str | None = None,
    content: OmitArgPrefixes[unchecked(Places)] = unchecked(Places)(),  # type: ignore[valid-type]
    receiver: OmitArgPrefixes[unchecked(PowerReceiver)] = unchecked(PowerReceiver)(),  # type: ignore[valid-type]
    propagation: OmitArgPrefixes[unchecked(Propagation)] = unchecked(Propagation)(),  # type: ignore[valid-type]
) -> None:
    """Simulate the powers that gateways receive (RSSI).

    Each gateway has one element. The folder has the format of NeRF²'s BLE data. If the command is interrupted, the
    same command continues.

    Args:
        scene: built-in name (such as lab) or scene YAML. Its own gateways are left out.
        output: the folder: a new one, or one that the same command began.
        gateways: YAML file of the gateways: NAME: [x, y, z], or NAME: {position: [x, y, z], boresight: [x, y, z],
            pattern: dipole}; metres, world frame.
        frequency: carrier frequency instead of the scene's: hertz, or such as "2.4 GHz". Materials of ITU-R P.2040
            follow.
        content: where the transmitter is.
        receiver: what a gateway reports.
        propagation: what the ray tracer follows.
    """
    from scenes.storage.scene_yaml import load_scene
    from simulate.engines.rays_engine import Rays
    from simulate.generation.simulated_powers import make_rssi

    wanted, heard = checked(Places, content), checked(PowerReceiver, receiver)
    followed = checked(Propagation, propagation)
    if wanted.positions is not None:
        refuse_idle(changed(content), ["n", "placement"], f"beside --positions {wanted.positions}")
    require_writable(output / "metadata.json")
    place = changed_scene(load_scene(scene), SceneChanges(frequency=frequency))
    refuse_idle_propagation(followed, [place])
    made = make_rssi(place, output, gateways, wanted, heard, Rays(followed))
    print(printable(f"{len(made)} positions, {len(made.gateway_names)} gateways: {output}"))
