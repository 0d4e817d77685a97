//! Terrain files: formats, places, damaged files, memory and time.

mod bad_files;
mod conversion_hints;
mod disk_cache;
mod encodings;
mod geographic_scale;
mod georeferences;
mod large_strips;
mod lying_headers;
mod mosaics;
mod netcdf;
mod odd_places;
mod only_gdal;
mod rasters;
mod stac;
mod stored_values;
