#!/usr/bin/env python3
"""Writes small terrains with unusual georeferences, for `tests/tests/terrain/odd_places.rs`, and their
positions by GDAL and PROJ (without grids):

    python3 -m venv venv && venv/bin/pip install rasterio==1.4.4 pyproj==3.7.2
    venv/bin/python tests/data/odd_places.py tests/data/odd_places

`lean` is the cosine of the angle between a row and a column on the ground. Longitudes and latitudes are those of WGS 84, or
of the file's own datum for another body, or if PROJ has no transformation to WGS 84.
"""
import os
import sys

import numpy as np
import pyproj
import rasterio
from pyproj.transformer import TransformerGroup
from rasterio.transform import Affine

COLUMNS, ROWS = 8, 6
STEPS = 32
DEGREE = 'UNIT["degree",0.0174532925199433]'
MOON = f'GEOGCS["Moon 2000",DATUM["D_Moon_2000",SPHEROID["Moon_2000_IAU_IAG",1737400,0]],PRIMEM["Reference_Meridian",0],{DEGREE}]'
MARS = f'GEOGCS["Mars 2000",DATUM["D_Mars_2000",SPHEROID["Mars_2000_IAU_IAG",3396190,169.89444722361179]],PRIMEM["Reference_Meridian",0],{DEGREE}]'


def polar(name, base):
    return (
        f'PROJCS["{name}",{base},PROJECTION["Polar_Stereographic"],PARAMETER["latitude_of_origin",-90],'
        'PARAMETER["central_meridian",0],PARAMETER["scale_factor",1],PARAMETER["false_easting",0],'
        'PARAMETER["false_northing",0],UNIT["metre",1]]'
    )


def square(side):
    return (side, 0.0, 0.0, -side)


# Name: reference system, position of the first cell's outer corner, steps (column x, row x,
# column y, row y), where each projection is usually used.
FILES = {
    "ntf_paris_grads": ("EPSG:4807", (2.0, 53.0), square(0.01)),
    "ntf_lambert": ("EPSG:27572", (6e5, 2.2e6), square(100)),
    "monte_mario_rome": ("EPSG:4806", (-3.0, 43.0), square(0.01)),
    "nad27": ("EPSG:4267", (-100.0, 40.0), square(0.01)),
    "nad27_utm": ("EPSG:26711", (386e3, 3.79e6), square(30)),
    "ed50_utm": ("EPSG:23032", (5e5, 5.5e6), square(30)),
    "dhdn": ("EPSG:31467", (3.5e6, 5.5e6), square(30)),
    "feet": ("EPSG:2229", (6.49e6, 1.87e6), square(100)),
    "rotated": ("EPSG:32611", (4e5, 3.8e6), (26.0, 15.0, 15.0, -26.0)),
    "sheared": ("EPSG:32611", (4e5, 3.8e6), (30.0, 9.0, 0.0, -30.0)),
    "south_pole": ("EPSG:3031", (-4000.0, 3000.0), square(1000)),
    "moon": (MOON, (10.0, 60.0), square(0.01)),
    "mars": (MARS, (10.0, 60.0), square(0.01)),
    "moon_south_pole": (polar("Moon south", MOON), (4000.0, -3000.0), square(100)),
    "mars_south_pole": (polar("Mars south", MARS), (4000.0, -3000.0), square(100)),
    "modis": ("+proj=sinu +R=6371007.181 +units=m", (1111950.5, 5559752.6), square(463.3127)),
    "equidistant": ("+proj=eqdc +lat_0=39 +lon_0=-96 +lat_1=33 +lat_2=45 +datum=NAD83", (1e5, 2e5), square(100)),
    "azimuthal": ("+proj=aeqd +lat_0=45 +lon_0=10 +datum=WGS84", (1e5, 2e5), square(100)),
    "oblique": ("+proj=stere +lat_0=45 +lon_0=10 +datum=WGS84", (1e5, 2e5), square(100)),
    "double": ("+proj=sterea +lat_0=52 +lon_0=5 +k=0.9999 +ellps=bessel +towgs84=565,50,465", (1e4, 2e4), square(100)),
    "cassini": ("+proj=cass +lat_0=52.4 +lon_0=13.6 +datum=WGS84", (1e4, 2e4), square(100)),
    "equal_area": ("+proj=cea +lat_ts=30 +lon_0=0 +datum=WGS84", (1e6, 4e6), square(1000)),
    "mercator_ts": ("+proj=merc +lat_ts=41 +lon_0=10 +datum=WGS84", (1e5, 4e6), square(100)),
    "polyconic": ("+proj=poly +lat_0=40 +lon_0=-96 +datum=NAD27", (1e5, 2e5), square(100)),
    "robinson": ("+proj=robin +lon_0=0 +datum=WGS84", (1e6, 4e6), square(1000)),
    "utm_feet": ("+proj=utm +zone=11 +datum=NAD83 +units=us-ft", (1.3e6, 1.2e7), square(100)),
    "transverse_feet": ("+proj=tmerc +lat_0=33 +lon_0=-118 +k=0.9999 +x_0=609601.2192024384 +y_0=152400.3048006096 +datum=NAD83 +units=us-ft", (1.9e6, 9e5), square(100)),
    "mollweide": ("+proj=moll +datum=WGS84", (1e6, 4e6), square(1000)),
    "miller": ("+proj=mill +lon_0=11 +x_0=1000 +datum=WGS84", (1e6, 4e6), square(1000)),
    "hotine": ("+proj=omerc +lat_0=4 +lonc=102.25 +alpha=323.0257964666666 +gamma=323.1301023611111 +k=0.99984 +x_0=804671 +no_uoff +datum=WGS84", (4e5, 5e5), square(100)),
    "hotine_centre": ("+proj=omerc +lat_0=46 +lonc=-78 +alpha=337.25556 +k=0.9996 +x_0=1000 +y_0=2000 +datum=NAD83", (1e4, 2e4), square(100)),
    "gnomonic": ("+proj=gnom +lat_0=45 +lon_0=10 +datum=WGS84", (1e5, 2e5), square(100)),
    "europe": ("EPSG:3035", (6.4e6, 2.1e6), square(25)),
    "america": ("EPSG:5070", (2.1e6, 2.8e6), square(30)),
    "rotated_degrees": ("EPSG:4326", (10.0, 60.0), (0.008, 0.006, 0.006, -0.008)),
    "polar_scale": ("+proj=stere +lat_0=-90 +k=0.97276 +lon_0=0 +datum=WGS84", (1e5, 2e5), square(100)),
}
# Unknown projections, which are refused by name and are not in the table.
UNKNOWN = {
    "new_zealand": ("+proj=nzmg +lat_0=-41 +lon_0=173 +x_0=2510000 +y_0=6023150 +ellps=intl", (2.6e6, 6.0e6), square(100)),
    "grinten": ("+proj=vandg +lon_0=0 +R=6371000", (1e6, 4e6), square(1000)),
}
# As an ASCII grid with a `.prj` of WKT 2, which binds a system to its shift to WGS 84.
BOUND = {
    "bound": ("+proj=sterea +lat_0=52.15 +lon_0=5.38 +k=0.9999 +x_0=155000 +y_0=463000 +ellps=bessel +towgs84=565.2,50.1,465.5,-0.4,0.35,-1.87,4.07", (120000, 480000), square(100)),
    "bound_three": ("+proj=longlat +ellps=intl +towgs84=-87,-98,-121", (2.0, 45.0), square(0.01)),
}


def way(system):
    """Returns the transformation to WGS 84, if PROJ has one."""
    if abs(system.ellipsoid.semi_major_metre - 6.35e6) > 5e4:
        return pyproj.Transformer.from_crs(system, system.geodetic_crs, always_xy=True)
    group = TransformerGroup(system, "EPSG:4326", always_xy=True)
    known = [one for one in group.transformers if one.accuracy is not None and one.accuracy >= 0]
    return (known or group.transformers)[0]


def write_tiff(path, wanted, transform, samples):
    profile = dict(driver="GTiff", width=COLUMNS, height=ROWS, count=1, dtype="int16", transform=transform, crs=wanted)
    with rasterio.open(path, "w", **profile) as dataset:
        dataset.write(samples, 1)


def write_grid(path, wanted, transform, samples):
    with open(path, "w") as grid:
        y = transform.f + transform.e * ROWS
        print(f"ncols {COLUMNS}\nnrows {ROWS}\nxllcorner {transform.c:.10g}\nyllcorner {y:.10g}\ncellsize {transform.a:.10g}", file=grid)
        for line in samples:
            print(*line, file=grid)
    with open(path.replace(".asc", ".prj"), "w") as projection:
        print(pyproj.CRS.from_user_input(wanted).to_wkt("WKT2_2019"), file=projection)


# Extension and writer of each kind of file.
KINDS = ((FILES, ".tif", write_tiff), (UNKNOWN, ".tif", write_tiff), (BOUND, ".asc", write_grid))


def row(folder, name):
    files, ending, write = next(kind for kind in KINDS if name in kind[0])
    wanted, (x, y), (column_x, row_x, column_y, row_y) = files[name]
    transform = Affine(column_x, row_x, x, column_y, row_y, y)
    samples = np.arange(COLUMNS * ROWS, dtype="int16").reshape(ROWS, COLUMNS)
    name += ending
    write(os.path.join(folder, name), wanted, transform, samples)
    if files is UNKNOWN:
        return None
    system = pyproj.CRS.from_user_input(wanted)
    there = way(system)
    radians = system.geodetic_crs.axis_info[0].unit_conversion_factor
    shares = [step / STEPS for step in range(STEPS + 1)]
    edges = [p for s in shares for p in ((s * COLUMNS, 0), (s * COLUMNS, ROWS), (0, s * ROWS), (COLUMNS, s * ROWS))]
    lon, lat = there.transform(*zip(*(transform * p for p in edges)))
    own = pyproj.Transformer.from_crs(system, system.geodetic_crs, always_xy=True)
    middle = [transform * (COLUMNS / 2 + dx, ROWS / 2 + dy) for dx, dy in ((0, 0), (1, 0), (0, -1))]
    places = [own.transform(*p) for p in middle]
    places = [[np.degrees(v * radians) for v in p] for p in places]
    ellipsoid = system.ellipsoid
    geod = pyproj.Geod(a=ellipsoid.semi_major_metre, b=ellipsoid.semi_minor_metre)
    along = [geod.inv(*places[0], *other)[2] for other in places[1:]]
    near = [transform * (COLUMNS / 2 + dx, ROWS / 2 + dy) for dx, dy in ((0.01, 0), (0, -0.01))]
    near = [[np.degrees(v * radians) for v in own.transform(*p)] for p in near]
    turns = [geod.inv(*places[0], *other)[0] for other in near]
    lean = np.cos(np.radians(turns[0] - turns[1]))
    middle_lonlat = there.transform(*middle[0])
    bounds = [min(lon), min(lat), max(lon), max(lat)]
    if middle_lonlat[1] == -90:
        bounds = [-180, -90, 180, max(lat)]
    return [name, *(f"{v:.9f}" for v in (*bounds, *middle_lonlat)), *(f"{v:.4f}" for v in along), f"{lean:.6f}"]


def main():
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    pyproj.network.set_network_enabled(False)
    with open(os.path.join(folder, "places.csv"), "w") as table:
        print("file,lon_west,lat_south,lon_east,lat_north,lon_middle,lat_middle,along_row_m,along_column_m,lean", file=table)
        for name in [*FILES, *UNKNOWN, *BOUND]:
            if (places := row(folder, name)) is not None:
                print(",".join(places), file=table)


main()
