#!/usr/bin/env python3
"""Writes one field in encodings that this repository has no encoder for, for
`tests/tests/terrain/encodings.rs`:

    python3 -m venv venv && venv/bin/pip install rasterio==1.4.4
    venv/bin/python tests/data/by_gdal.py tests/data/by_gdal

Row 0 is the northernmost; the height at a column and row is `height` below; HOLE
is no-data.
"""
import os
import sys

import numpy as np
import rasterio
from rasterio.transform import from_origin

COLUMNS, ROWS = 40, 30
HOLE = (3, 4)


def height(columns, rows):
    row, column = np.mgrid[0:rows, 0:columns]
    return 100 + 7 * column - 3 * row + (column * row) % 5


def write(folder, name, dtype, driver="GTiff", columns=COLUMNS, rows=ROWS, nodata=None, bands=1, **options):
    profile = dict(
        driver=driver, width=columns, height=rows, count=bands, dtype=dtype, nodata=nodata,
        crs="EPSG:32611", transform=from_origin(400000, 3800000, 30, 30),
    )
    profile.update(options)
    with rasterio.open(os.path.join(folder, name), "w", **profile) as dataset:
        for band in range(bands):
            # Each band is 1000 above the one before.
            samples = (height(columns, rows) + 1000 * band).astype(dtype)
            samples[HOLE[1], HOLE[0]] = nodata
            dataset.write(samples, band + 1)


def main():
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    tiles = dict(tiled=True, blockxsize=16, blockysize=16)
    write(folder, "lerc_i16.tif", "int16", nodata=-32768, compress="LERC", **tiles)
    write(folder, "lerc_deflate_u16.tif", "uint16", nodata=0, compress="LERC_DEFLATE")
    write(folder, "lerc_zstd_f32.tif", "float32", nodata=float("nan"), compress="LERC_ZSTD", **tiles)
    write(folder, "lerc_f64.tif", "float64", nodata=-9999.0, compress="LERC", **tiles)
    write(folder, "lerc_bands_i16.tif", "int16", nodata=-32768, bands=3, interleave="pixel", compress="LERC", **tiles)
    write(folder, "bands_planar_i16.tif", "int16", nodata=-32768, bands=3, interleave="band", compress="DEFLATE", **tiles)
    write(folder, "world.tif", "int16", nodata=-32768, compress="DEFLATE", profile="BASELINE", tfw="YES")
    write(folder, "ehdr.bil", "int16", driver="EHdr", nodata=-32768, bands=2)
    write(folder, "float.flt", "float32", driver="EHdr", nodata=-9999.0)
    write(folder, "envi.dat", "float32", driver="ENVI", nodata=-9999.0, bands=2, interleave="bip")
    write(
        folder, "n34w119.dt0", "int16", driver="DTED", columns=121, rows=121, nodata=-32767,
        crs="EPSG:4326", transform=from_origin(-119 - 1 / 240, 35 + 1 / 240, 1 / 120, 1 / 120),
    )
    for name in os.listdir(folder):
        if name.endswith((".aux.xml", ".dt0.tmp")):
            os.remove(os.path.join(folder, name))


main()
