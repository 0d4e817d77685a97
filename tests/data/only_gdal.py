"""Files that only GDAL reads, written with rasterio: python tests/data/only_gdal.py

5 × 4 samples, height 100.5 + 7 column - 3 row, no-data at column 3, row 1. A second band is
1000 higher. `tests/tests/terrain/only_gdal.rs` reads them.
"""

import pathlib

import numpy as np
import rasterio

FOLDER = pathlib.Path(__file__).parent / "only_gdal"
PLACE = rasterio.Affine(30, 0, 400_000, 0, -30, 3_800_000)

row, column = np.mgrid[0:4, 0:5]
heights = (100.5 + 7 * column - 3 * row).astype("f4")
heights[1, 3] = -9999


def write(name, driver, bands, **options):
    with rasterio.open(
        FOLDER / name, "w", driver=driver, width=5, height=4, count=bands, dtype="float32",
        crs="EPSG:32611", transform=PLACE, nodata=-9999, **options,
    ) as file:
        for band in range(1, bands + 1):
            file.write(np.where(heights == -9999, -9999, heights + 1000 * (band - 1)), band)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    write("erdas.img", "HFA", 2)
    write("geomatica.pix", "PCIDSK", 2)
    write("saga.sdat", "SAGA", 1)

    # A large one, for which GDAL has overviews: 600 × 500, with a different content in each block.
    row, column = np.mgrid[0:500, 0:600]
    with rasterio.open(
        FOLDER / "overviews.img", "w", driver="HFA", width=600, height=500, count=1, dtype="int16",
        crs="EPSG:32611", transform=PLACE, COMPRESSED="YES",
    ) as file:
        file.write((column // 16 + row // 16).astype("i2"), 1)
        file.build_overviews([2, 4], rasterio.enums.Resampling.nearest)
