#!/usr/bin/env python3
"""Writes where GDAL sees the shared terrain files, for `tests/tests/places.rs`:

    python3 -m venv venv && venv/bin/pip install rasterio==1.4.4 pyproj==3.7.2
    venv/bin/python tests/data/places_by_gdal.py ../shared/dem > tests/data/places_by_gdal.csv

Longitudes and latitudes belong to the datum of each file's own reference system.
"""
import os
import sys

import pyproj
import rasterio

STEPS = 32


def lonlat(dataset):
    """Smallest and largest longitude and latitude on the edges."""
    system = pyproj.CRS.from_user_input(dataset.crs.to_wkt())
    globe = system.geodetic_crs
    if system.is_geographic:
        b = dataset.bounds
        return [b.left, b.bottom, b.right, b.top]
    way = pyproj.Transformer.from_crs(system, globe, always_xy=True)
    w, h = dataset.width, dataset.height
    shares = [step / STEPS for step in range(STEPS + 1)]
    edges = [p for s in shares for p in ((s * w, 0), (s * w, h), (0, s * h), (w, s * h))]
    x, y = zip(*(dataset.transform * p for p in edges))
    lon, lat = way.transform(x, y)
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
