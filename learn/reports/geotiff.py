"""GeoTIFF files of maps on a horizontal grid, as GIS programs read them."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from jaxtyping import Float

from scenes.files.atomic import write_atomically

PIXEL_SCALE, TIE_POINT, KEYS, KEY_TEXTS = 33550, 33922, 34735, 34737
"""Tags of GeoTIFF: sides of a pixel, the corner of the first pixel, keys of the coordinate system, and their texts."""

GDAL_METADATA, GDAL_NODATA = 42112, 42113
"""Tags of GDAL: descriptions of the bands as XML, and the value that says nothing."""

LOCAL_FRAME = "local frame in metres|"
"""Name of the coordinate system. The bar ends a text."""

GEO_KEYS = (
    *(1, 1, 0, 4),  # version 1.1.0, and the number of keys, each as key, tag of its value, count and value
    *(1024, 0, 1, 32767),  # the model is user-defined: neither geographic nor a map projection
    *(1025, 0, 1, 1),  # a pixel is an area, so that the tie point is its corner
    *(1026, KEY_TEXTS, len(LOCAL_FRAME), 0),
    *(3076, 0, 1, 9001),  # metres
)


def write_geotiff(
    path: Path,
    bands: Float[np.ndarray, "bands rows columns"],
    descriptions: Sequence[str],
    corner: tuple[float, float],
    step: float,
) -> None:
    """Write bands of float32 with their place in the world, compressed without loss.

    In the file, the first row is the north, the largest y, as in all such files: the bands are turned upside down.
    """
    from tifffile import TiffWriter

    items = "".join(  # GDAL escapes descriptions twice, and undoes it twice
        f'<Item name="DESCRIPTION" sample="{number}" role="description">{escape(escape(text))}</Item>'
        for number, text in enumerate(descriptions)
    )
    tags = [
        (PIXEL_SCALE, "d", 3, (step, step, 0.0), True),
        (TIE_POINT, "d", 6, (0.0, 0.0, 0.0, *corner, 0.0), True),
        (KEYS, "H", len(GEO_KEYS), GEO_KEYS, True),
        (KEY_TEXTS, "s", 0, LOCAL_FRAME, True),
        (GDAL_METADATA, "s", 0, f"<GDALMetadata>{items}</GDALMetadata>".encode(), True),
        (GDAL_NODATA, "s", 0, "nan", True),
    ]
    content = BytesIO()
    turned = bands[:, ::-1].astype(np.float32)
    with TiffWriter(content) as file:
        file.write(
            turned if len(turned) > 1 else turned[0],
            photometric="minisblack",
            planarconfig="separate" if len(turned) > 1 else None,
            compression="zlib",
            metadata=None,
            extratags=tags,
        )
    write_atomically(path, content.getbuffer())
