"""The command ``bisplat dataset``, which makes or completes a dataset folder."""

from __future__ import annotations

from dataclasses import fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.scene_changes import array_option
from scenes.files.atomic import require_writable
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.options import changed
from simulate.dataset.dataset_kinds import Moving
from simulate.exchange.reading_options import Conversion, Recording

SHARED = "frequency", "moving"  # Options of recorded responses and of pictures, which the command has once


def _others(kind: type) -> Any:
    """The options of one kind of source alone."""
    own = [(each.name, each.type, each.default) for each in fields(kind) if each.name not in SHARED]
    return make_dataclass(kind.__name__, own, namespace={"__doc__": kind.__doc__, "__module__": kind.__module__})


RECORDING: Any = _others(Recording)
CONVERSION: Any = _others(Conversion)


def dataset(
    sources: Positional[tuple[Path, ...]],
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    retrieve: bool = False,
    frequency: str | None = None,
    array: str | None = None,
    gateway: tuple[float, float, float] = (0, 0, 0),
    boresight: tuple[float, float, float] = (0, 0, 1),
    moving: Moving | None = None,
    recording: OmitArgPrefixes[RECORDING] = RECORDING(),  # type: ignore[valid-type]
    conversion: OmitArgPrefixes[CONVERSION] = CONVERSION(),  # type: ignore[valid-type]
    force: Force = False,
) -> None:
    """Make a dataset of recorded responses or of pictures.

    Files hold positions and complex element responses. They are NumPy's, MATLAB's, HDF5 or tables of text. A folder
    holds another program's pictures: spectrum/, tx_pos.csv and gateway_info.yml. The command prints what it recognised
    and assumed.

    With --retrieve, it recovers the element responses from a dataset's pictures, and writes channels.npz into its
    folder. They are marked as retrieved, since a picture determines them up to a common phase and the flip
    y_m -> conj y_{MN-1-m}. If that is interrupted, the same command continues.

    Args:
        sources: one file or several, which together hold positions and responses; or a folder with pictures.
        output: the new dataset folder.
        retrieve: recover the element responses of a dataset folder without recorded ones; no --output.
        frequency: carrier frequency: hertz, or such as "2.4 GHz". If freq.txt of a folder lists several, only the
            pictures of this one are kept.
        array: of recorded responses: array of the gateway: ROWSxCOLUMNS@SPACING, with the spacing in wavelengths, or a
            CSV file with columns x,y,z of element positions, metres, gateway frame.
        gateway: of recorded responses: position of the gateway, metres.
        boresight: of recorded responses: direction that the gateway looks in. Its y axis points as far up as possible.
        moving: what is at the positions. receiver: the middle of the array, while the transmitter stands at the
            gateway's position. both: the transmitter, while the array is at the receivers' positions: rx_pos.csv of a
            folder (default: what metadata.json says, otherwise the transmitter).
        recording: of recorded responses.
        conversion: of pictures.
    """
    given = [*given_options(dataset, locals()), *changed(recording), *changed(conversion)]
    given = [name for name in given if name not in ("sources", "recording", "conversion")]
    folder = sources[0] if len(sources) == 1 and sources[0].is_dir() else None
    if not sources:
        raise ParameterError("sources", "expected at least one file or folder, found none")
    if retrieve:
        refuse_idle(given, [name for name in given if name not in ("retrieve", "force")], "with --retrieve")
        if folder is None:
            raise InputError(f"{sources[0]}: expected one dataset folder for --retrieve, found no folder")
        _retrieve(folder, force)
        return
    refuse_idle(given, ["force"], "without --retrieve")
    if output is None:
        raise ParameterError("output", "expected the new dataset folder, found none")
    require_writable(output / "metadata.json")
    stated = {"moving": moving, "frequency": frequency}
    if folder is not None:
        refuse_idle(given, ["array", "gateway", "boresight", *changed(recording)], "for a folder of pictures")
        from simulate.exchange.convert import convert

        said = convert(folder, output, Conversion(**vars(conversion), **stated))  # type: ignore[arg-type]
    else:
        refuse_idle(given, changed(conversion), "for files of recorded responses")
        said = _record(given, sources, output, frequency, array, gateway, boresight, moving, vars(recording))
    for sentence in said:
        print(printable(sentence))
    print(printable(f"dataset: {output}"))


def _record(
    given: list[str],
    files: tuple[Path, ...],
    output: Path,
    frequency: str | None,
    array: str | None,
    gateway: tuple[float, float, float],
    boresight: tuple[float, float, float],
    moving: Moving | None,
    options: dict[str, Any],
) -> list[str]:
    from scenes.scene.antennas import Gateway
    from scenes.scene.orientation import facing
    from simulate.exchange.recorded_responses import record

    if not files[0].exists():
        raise InputError(f"{files[0]}: expected a file with responses or a folder of pictures, found none")
    if frequency is None or array is None:
        name = "array" if array is None else "frequency"
        raise ParameterError(name, f"expected that of the responses in {files[0]}, found none")
    own_array = array_option(array)
    if "rows" in own_array and "spacing" not in own_array:
        raise ParameterError("array", f"expected the spacing in wavelengths, too, such as {array}@0.5, found {array}")
    if moving == "both":
        refuse_idle(given, ["gateway"], "with --moving both, where the receivers' positions are those of the array")
    receiver = Gateway(gateway, facing(boresight), **own_array)
    return record(files, output, receiver, frequency, Recording(**options, moving=moving or Recording.moving))


def _retrieve(folder: Path, force: bool) -> None:
    import numpy as np

    from simulate.dataset.dataset_folder import read_dataset
    from simulate.dataset.responses_file import retrieve
    from simulate.spectra.phase_retrieval import GOOD

    given = read_dataset(folder)
    recorded = given.phases_recorded_per_position and "retrieved" in given.values
    if "response" not in given.values and not recorded:  # recorded ones are never replaced
        require_new(folder / "channels.npz", force=force)
    residual = retrieve(given).residual
    good = residual < GOOD
    print(
        f"the responses reproduce {good.sum()} of {len(residual)} pictures to within {GOOD} grey levels (median "
        f"{np.median(residual):.2f}). Each picture determines its responses up to a common phase and the flip "
        "y_m -> conj y_(MN-1-m)."
    )
    doubtful = [name for name, fine in zip(given.names, good, strict=True) if not fine]
    if doubtful:
        more = " ..." if len(doubtful) > 10 else ""
        print(printable(f"doubtful: {len(doubtful)} pictures: {', '.join(doubtful[:10])}{more}"))
    print(printable(f"responses: {folder / 'channels.npz'}"))
