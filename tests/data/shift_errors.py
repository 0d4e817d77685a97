#!/usr/bin/env python3
"""Prints the errors of shifts between datums without grids, for
`heightfield/src/crs/shift.rs` and `docs/how-to/place-and-scale.md`:

    python3 -m venv venv && venv/bin/pip install pyproj==3.7.2
    venv/bin/python tests/data/shift_errors.py ~/.cargo/registry/src/*/crs-definitions-0.6.0/src/defs.rs

Each geographic system of `crs-definitions` is compared with PROJ's best transformation without
grids in the middle of its area; PROJ's stated accuracy is added, metres.
"""
import math
import re
import sys
import warnings

import pyproj
from pyproj.transformer import Transformer, TransformerGroup

WGS84 = "+proj=longlat +datum=WGS84"
# Systems that hapterra does not trust.
NOT_TRUSTED = {4161, 4240, 4688, 4805, 4751}


def kind(words):
    """Returns the kind of a definition: no shift, three parameters or seven."""
    if "NAD27" in words:
        return "three", "+proj=longlat +ellps=clrk66 +towgs84=-8,160,176"
    if "datum=WGS84" in words or "datum=NAD83" in words:
        return "none", words
    if named := re.search(r"\+datum=(\S+)", words):
        return ("three" if named[1] in ("carthage", "GGRS87") else "seven"), words
    if not (stated := re.search(r"\+towgs84=(\S+)", words)):
        return None, words
    numbers = [float(number) for number in stated[1].split(",")]
    if not any(numbers):
        return "none", words
    return ("seven" if any(numbers[3:]) else "three"), words


def off(code, words):
    """Returns the distance of both results, plus PROJ's stated accuracy, metres."""
    system = pyproj.CRS.from_epsg(code)
    area = system.area_of_use
    east = area.east if area.east > area.west else area.east + 360
    place = (area.west + east) / 2, (area.south + area.north) / 2
    group = TransformerGroup(system, "EPSG:4326", always_xy=True)
    best = next(way for way in group.transformers if way.accuracy is not None and way.accuracy >= 0)
    own = best.transform(*place, direction="INVERSE")
    there = best.transform(*own)
    radians = system.axis_info[0].unit_conversion_factor
    degrees = [math.degrees(angle * radians) for angle in own]
    by_words = Transformer.from_crs(words, WGS84, always_xy=True).transform(*degrees)
    return pyproj.Geod(ellps="WGS84").inv(*there, *by_words)[2] + best.accuracy


def main():
    warnings.filterwarnings("ignore")
    pyproj.network.set_network_enabled(False)
    found = {"none": [], "seven": [], "three": []}
    for code, words in re.findall(r'EPSG_(\d+)\|\d+\|"([^"]*)"', open(sys.argv[1]).read()):
        how, words = kind(words)
        if "proj=longlat" not in words or how is None or int(code) in NOT_TRUSTED:
            continue
        try:
            metres = off(int(code), words)
        except (pyproj.exceptions.CRSError, pyproj.exceptions.ProjError, AttributeError, StopIteration):
            continue
        # One of both transformations has no result there.
        if math.isfinite(metres):
            found[how].append(metres)
    for how, metres in found.items():
        metres.sort()
        print(f"{how} parameters: {len(metres)} systems, nine of ten within {metres[int(0.9 * len(metres))]:.1f} m")


main()
