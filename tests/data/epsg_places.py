"""Prints a point of each projected system of EPSG's, or of every N-th: code, longitude and latitude
in degrees of the system's own datum, counted from Greenwich, and x and y in its units (pyproj).

    python3 epsg_places.py 20 > ../../heightfield/src/crs/places.txt
"""

import math
import sys
import warnings

import pyproj
from pyproj import CRS, Transformer
from pyproj.database import query_crs_info


def place(crs):
    area = crs.area_of_use
    east = area.east + (360 if area.east < area.west else 0)
    longitude = (area.west + east) / 2 + 0.1
    longitude -= 360 if longitude > 180 else 0
    return longitude, min(max((area.south + area.north) / 2 + 0.1, -89.5), 89.5)


def line(code):
    crs = CRS.from_epsg(code)
    longitude, latitude = place(crs)
    base = crs.geodetic_crs.to_2d()
    meridian = base.prime_meridian
    begin = meridian.longitude * math.degrees(meridian.unit_conversion_factor)
    unit = math.degrees(base.axis_info[0].unit_conversion_factor)
    own = ((longitude - begin) / unit, latitude / unit)
    x, y = Transformer.from_crs(base, crs, always_xy=True).transform(*own)
    return f"{code} {longitude!r} {latitude!r} {x!r} {y!r}" if math.isfinite(x) else None


def main(step):
    warnings.filterwarnings("ignore")
    print(f"# code longitude latitude x y; PROJ {pyproj.proj_version_str}, by tests/data/epsg_places.py")
    lines = []
    for info in query_crs_info(auth_name="EPSG", pj_types="PROJECTED_CRS", allow_deprecated=True):
        try:
            lines.append(line(int(info.code)))
        except pyproj.exceptions.ProjError:
            continue
    for found in [found for found in lines if found][::step]:
        print(found)


main(int(sys.argv[1]))
