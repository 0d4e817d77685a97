#!/usr/bin/env python3
"""Writes one field in the forms in which NetCDF stores a variable, for `tests/tests/terrain/netcdf.rs`:

    python3 -m venv venv && venv/bin/pip install numpy==2.4.6 netCDF4==1.7.5.1 h5py==3.16.0 hdf5plugin==7.1.0
    venv/bin/python tests/data/netcdf.py tests/data/netcdf

Row 0 is the northernmost; the height at a column and row is `field` below; HOLE is no-data.
"""
import os
import sys

import h5py
import hdf5plugin
import netCDF4
import numpy as np

COLUMNS, ROWS = 90, 70
CHUNKS = (16, 12)
HOLE = (3, 4)


def field():
    row, column = np.mgrid[0:ROWS, 0:COLUMNS]
    return 20 + (3 * column + 2 * row + (column * row) % 5) % 230


def classic_or_4(folder, name, kind, model="NETCDF4", fill=None, dims=("lat", "lon"), unlimited=(), south=False,
                 stored=lambda heights: heights, attributes=None, also=False, **storage):
    with netCDF4.Dataset(os.path.join(folder, name), "w", format=model) as dataset:
        lengths = {"time": 1, "lat": ROWS, "lon": COLUMNS}
        for dim in dims:
            dataset.createDimension(dim, None if dim in unlimited else lengths[dim])
        latitudes = 50 - 0.01 * np.arange(ROWS)
        axes = {"lat": latitudes[::-1] if south else latitudes, "lon": 8 + 0.01 * np.arange(COLUMNS)}
        # Before any record is written, as the classic format stores these variables first.
        variables = {}
        for dim, units in (("lat", "degrees_north"), ("lon", "degrees_east")):
            variables[dim] = dataset.createVariable(dim, "f8", (dim,))
            variables[dim].units = units
        heights = dataset.createVariable("z", kind, dims, fill_value=fill, **storage)
        heights.set_auto_maskandscale(False)
        if also:
            # Another variable, with records of an odd number of bytes.
            dataset.createVariable("quality", "i1", dims)
        for key, value in (attributes or {}).items():
            heights.setncattr(key, value)
        for dim in ("lat", "lon"):
            variables[dim][:] = axes[dim]
        values = stored(field()).astype(kind)
        values[HOLE[1], HOLE[0]] = heights.getncattr("_FillValue")
        if south:
            values = values[::-1]
        if dims[-2:] == ("lon", "lat"):
            values = values.T
        if "time" in dims:
            values = values[np.newaxis]
        heights[:] = values


def by_h5py(folder, name, chunks, libver, **storage):
    """Writes it with a filter of a plug-in."""
    with h5py.File(os.path.join(folder, name), "w", libver=libver) as file:
        axes = {"lat": 50 - 0.01 * np.arange(ROWS), "lon": 8 + 0.01 * np.arange(COLUMNS)}
        for dim, units in (("lat", "degrees_north"), ("lon", "degrees_east")):
            axis = file.create_dataset(dim, data=axes[dim])
            axis.make_scale(dim)
            axis.attrs["units"] = np.bytes_(units)
        heights = file.create_dataset(
            "z", (ROWS, COLUMNS), "f4", chunks=chunks, fillvalue=-1, **storage
        )
        heights.attrs["_FillValue"] = np.array([-1], "f4")
        values = field().astype("f4")
        values[HOLE[1], HOLE[0]] = -1
        heights[:] = values
        for index, dim in enumerate(("lat", "lon")):
            heights.dims[index].attach_scale(file[dim])


def main():
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    packed = dict(zlib=True, shuffle=True, fletcher32=True, chunksizes=CHUNKS)
    classic_or_4(folder, "contiguous.nc", "f4", fill=-1)
    classic_or_4(
        folder, "packed.nc", "i2", fill=-1, stored=lambda heights: 2 * heights - 200, **packed,
        attributes=dict(scale_factor=0.5, add_offset=100.0, missing_value=np.array([-3, -7], "i2"),
                        valid_range=np.array([-200, 400], "i2")),
    )
    classic_or_4(folder, "southern.nc", "f4", fill=-1, zlib=True, shuffle=True, chunksizes=CHUNKS, south=True)
    classic_or_4(folder, "depths.nc", "i4", fill=-1, chunksizes=CHUNKS, attributes=dict(positive="down"))
    classic_or_4(folder, "turned.nc", "f8", fill=-1, dims=("lon", "lat"), chunksizes=CHUNKS, zlib=True)
    classic_or_4(folder, "turned_contiguous.nc", "u2", fill=0, dims=("lon", "lat"))
    classic_or_4(folder, "time.nc", "i2", fill=-1, dims=("time", "lat", "lon"), unlimited=("time",),
                 chunksizes=(1, *CHUNKS), zlib=True)
    classic_or_4(folder, "growing.nc", "i2", fill=-1, unlimited=("lat",), zlib=True)
    classic_or_4(folder, "big_endian.nc", ">i2", fill=-1, endian="big", chunksizes=CHUNKS, zlib=True)
    classic_or_4(folder, "classic.nc", "i2", model="NETCDF3_CLASSIC", fill=-1, south=True,
                 attributes=dict(scale_factor=0.5, valid_min=np.int16(0)), stored=lambda heights: 2 * heights)
    classic_or_4(folder, "classic_records.nc", "f4", model="NETCDF3_64BIT_OFFSET", fill=-1, unlimited=("lat",), also=True)
    # With a compression that most builds of GDAL lack.
    by_h5py(folder, "early.nc", CHUNKS, "earliest", **hdf5plugin.Zstd())


main()
