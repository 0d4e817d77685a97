"""Writes the tables of `heightfield/src/crs/` from PROJ's database (pyproj): vertical systems, and
the projected ones that the crate `crs-definitions` does not have.

    python3 epsg_tables.py CRS_DEFINITIONS/src/defs.rs ../../heightfield/src/crs
"""

import pathlib
import re
import sys
import warnings

import pyproj
from pyproj import CRS
from pyproj.database import query_crs_info

# Projections of `proj4rs`; PROJ computes the others.
PROJECTIONS = {"tmerc", "utm", "lcc", "laea", "aeqd", "aea", "sterea", "omerc", "cass", "stere", "merc"}
LEFT_OUT = {"+type=crs", "+no_defs", "+hyperbolic"}


def systems(kind):
    for info in query_crs_info(auth_name="EPSG", pj_types=kind, allow_deprecated=True):
        yield int(info.code), CRS.from_epsg(info.code)


def vertical(code, crs):
    axis = crs.axis_info[0]
    down = int(axis.direction == "down")
    return f"{code}|{axis.unit_conversion_factor:.12g}|{down}|{crs.name}"


def projected(code, crs):
    try:
        words = crs.to_proj4().split()
    except pyproj.exceptions.CRSError:
        return None
    if words[0].removeprefix("+proj=") not in PROJECTIONS or "+hyperbolic" in words:
        return None
    words = " ".join(word for word in words if word not in LEFT_OUT)
    metres = crs.axis_info[0].unit_conversion_factor
    ellipsoid = crs.ellipsoid
    size = f"{ellipsoid.semi_major_metre!r}|{ellipsoid.inverse_flattening!r}"
    base = crs.geodetic_crs.to_epsg() or 0
    return f"{code}|{metres:.12g}|{base}|{size}|{crs.datum.name}|{words}|{crs.name}"


def write(path, head, lines):
    lines = sorted((line for line in lines if line), key=lambda line: int(line.split("|")[0]))
    text = f"# {head}; PROJ {pyproj.proj_version_str}, by tests/data/epsg_tables.py\n"
    path.write_text(text + "\n".join(lines) + "\n")
    print(path, len(lines))


def main(definitions, folder):
    warnings.filterwarnings("ignore")
    there = {int(code) for code in re.findall(r"^EPSG_(\d+)\|", definitions.read_text(), re.M)}
    write(
        folder / "vertical.txt",
        "code|metres|counts downwards|name",
        (vertical(code, crs) for code, crs in systems("VERTICAL_CRS") if code < 65536),
    )
    write(
        folder / "projected.txt",
        "code|metres|geographic code|semi-major axis, m|inverse flattening|datum|projection|name",
        (projected(code, crs) for code, crs in systems("PROJECTED_CRS") if code not in there and code < 65536),
    )


main(*map(pathlib.Path, sys.argv[1:]))
