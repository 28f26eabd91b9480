"""The option ``--array``: the size of a planar array, or a file of element positions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenes.files.errors import InputError, ParameterError, shown


def array_option(text: str) -> dict[str, Any]:
    """Read the option ``--array``.

    Args:
        text: ROWSxCOLUMNS, or ROWSxCOLUMNS@SPACING in wavelengths, or the path of a CSV with the header x,y,z and the
            position of each element, metres, gateway frame.

    Returns:
        The arguments of ``Gateway`` that it states: "elements", or "rows", "columns" and perhaps "spacing".

    Raises:
        InputError: the CSV cannot be read, or its positions are not those of an array.
        ParameterError: the text is something else.

    >>> array_option("4x8@0.4")
    {'rows': 4, 'columns': 8, 'spacing': 0.4}
    """
    from scenes.scene.antennas import as_positions, fault_of, read_array
    from simulate.positions.positions import read_points

    path = Path(text)
    if path.suffix.lower() != ".csv":
        if path.is_file():
            expected = "a file of element positions whose name ends in .csv, with the header x,y,z, in metres"
            raise ParameterError("array", f"expected {expected}, found {shown(text)}")
        try:
            rows, columns, spacing = read_array(text)
        except ParameterError as error:
            or_file = ", or a CSV file of element positions, found"
            raise ParameterError("array", error.message.replace(", found", or_file, 1)) from None
        return {"rows": rows, "columns": columns} | ({} if spacing is None else {"spacing": spacing})
    elements = as_positions("array", read_points(path))
    fault = fault_of(elements)
    if fault is not None:
        raise InputError(f"{path}: {fault}")
    return {"elements": elements}
