#!/usr/bin/env python3
"""Writes the positions of the shared terrain files by GDAL, for `tests/tests/terrain/georeferences.rs`:

    python3 -m venv venv && venv/bin/pip install rasterio==1.4.4 pyproj==3.7.2
    venv/bin/python tests/data/places_by_gdal.py ../shared/dem > tests/data/places_by_gdal.csv

Longitudes and latitudes are those of WGS 84, by PROJ's best transformation without grids
if a datum differs.
"""
import os
import sys

import pyproj
import rasterio
from pyproj.transformer import TransformerGroup

STEPS = 32


def way(system):
    """Returns the transformation to WGS 84, if PROJ has one."""
    group = TransformerGroup(system, "EPSG:4326", always_xy=True)
    known = [one for one in group.transformers if one.accuracy is not None and one.accuracy >= 0]
    return (known or group.transformers)[0]


def lonlat(dataset):
    """Returns the smallest and largest longitude and latitude on the edges."""
    system = pyproj.CRS.from_user_input(dataset.crs.to_wkt())
    b = dataset.bounds
    if system.is_geographic:
        # Longitudes exceed 180 degrees if the field crosses that meridian.
        moved = way(system).transform([b.left % 360, b.right % 360], [b.bottom, b.top])
        to_own = [(v - own % 360 + 180) % 360 - 180 + own for v, own in zip(moved[0], (b.left, b.right))]
        return [to_own[0], moved[1][0], to_own[1], moved[1][1]]
    w, h = dataset.width, dataset.height
    shares = [step / STEPS for step in range(STEPS + 1)]
    edges = [p for s in shares for p in ((s * w, 0), (s * w, h), (0, s * h), (w, s * h))]
    x, y = zip(*(dataset.transform * p for p in edges))
    lon, lat = way(system).transform(x, y)
    return [min(lon), min(lat), max(lon), max(lat)]


def row(folder, name):
    path = os.path.join(folder, name)
    with rasterio.open(path) as dataset:
        t = dataset.transform
        if t.is_identity:
            return None
        corners = [t * p for p in ((0, 0), (dataset.width, 0), (0, dataset.height), (dataset.width, dataset.height))]
        x, y = zip(*corners)
        bounds = [min(x), min(y), max(x), max(y)]
        code, degrees = "", [""] * 4
        if dataset.crs:
            code = dataset.crs.to_epsg() or "without code"
            degrees = [f"{value:.9f}" for value in lonlat(dataset)]
        return [name, dataset.width, dataset.height, code] + [repr(float(v)) for v in bounds] + degrees


def main():
    folder = sys.argv[1]
    print("file,columns,rows,epsg,west,south,east,north,lon_west,lat_south,lon_east,lat_north")
    for part in ("real", "variants", "large", "tiff_ok"):
        for name in sorted(os.listdir(os.path.join(folder, part))):
            try:
                found = row(folder, os.path.join(part, name))
            except rasterio.errors.RasterioIOError:
                continue
            if found:
                print(",".join(map(str, found)))


main()
