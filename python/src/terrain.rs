//! Terrains from arrays, and from files that the command opens.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use hapterra::place::Coordinates;
use hapterra_touch::{Block, Height, RowOrder, Terrain as Touched};
use pyo3::types::PyBytes;
use pyo3::{Bound, PyResult, Python, pyclass, pymethods};

use crate::open::Opened;
use crate::{notes, numbers, refused};

/// Heights of one of the library's types, or a terrain that remains in its files.
#[pyclass(frozen, module = "hapterra._native")]
pub(crate) struct Terrain {
    pub(crate) touched: Touched,
    pub(crate) opened: Option<Arc<Opened>>,
}

/// An array of heights as bytes, row by row.
struct Samples<'a> {
    bytes: &'a [u8],
    columns: u32,
    rows: u32,
    order: RowOrder,
    cell_mm: f64,
}

impl Samples<'_> {
    fn terrain<T: Height, const BYTES: usize>(
        &self,
        of_bytes: impl Fn([u8; BYTES]) -> T,
    ) -> PyResult<Touched> {
        let heights = numbers(self.bytes, of_bytes)?;
        let terrain = Touched::from_vec(self.columns, self.rows, self.cell_mm, self.order, heights);
        terrain.map_err(refused)
    }
}

#[pymethods]
impl Terrain {
    /// `kind` is numpy's type code of the samples, such as f8; `materials` has a byte for each.
    #[new]
    #[pyo3(signature = (samples, kind, shape, *, cell_mm, height_mm_per_unit, south_first, materials=None))]
    // One for each keyword of Python.
    #[expect(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        samples: &[u8],
        kind: &str,
        shape: [u32; 2],
        cell_mm: f64,
        height_mm_per_unit: f64,
        south_first: bool,
        materials: Option<&[u8]>,
    ) -> PyResult<Self> {
        let order = match south_first {
            true => RowOrder::SouthFirst,
            false => RowOrder::NorthFirst,
        };
        let samples = Samples {
            bytes: samples,
            columns: shape[1],
            rows: shape[0],
            order,
            cell_mm,
        };
        py.detach(|| {
            let terrain = match kind {
                "f8" => samples.terrain(f64::from_ne_bytes),
                "f4" => samples.terrain(f32::from_ne_bytes),
                "i4" => samples.terrain(i32::from_ne_bytes),
                "u4" => samples.terrain(u32::from_ne_bytes),
                "i2" => samples.terrain(i16::from_ne_bytes),
                "u2" => samples.terrain(u16::from_ne_bytes),
                "i1" => samples.terrain(i8::from_ne_bytes),
                "u1" => samples.terrain(u8::from_ne_bytes),
                other => Err(refused(format!("samples of {other}: use f8"))),
            }?;
            let terrain = terrain.with_height_scale(height_mm_per_unit);
            let terrain = terrain.map_err(refused)?;
            let terrain = match materials {
                Some(of) => terrain
                    .with_materials(order, of.to_vec())
                    .map_err(refused)?,
                None => terrain,
            };
            Ok(Self {
                touched: terrain,
                opened: None,
            })
        })
    }

    /// Returns the same ground under a ball of a radius.
    fn with_tip(&self, tip_mm: f64) -> PyResult<Self> {
        let touched = self.touched.clone().with_tip(tip_mm).map_err(refused)?;
        let opened = self.opened.clone();
        Ok(Self { touched, opened })
    }

    /// Opens a terrain of files, by the command's options.
    #[staticmethod]
    fn open(py: Python<'_>, paths: Vec<PathBuf>, words: Vec<OsString>) -> PyResult<Self> {
        notes::listen();
        let opened = py.detach(|| Self::of(Opened::open(paths, words)?));
        notes::warn(py)?;
        opened
    }

    /// Returns a window of an opened terrain around a position.
    fn window(
        &self,
        py: Python<'_>,
        at: [f64; 2],
        lonlat: bool,
        size_mm: [f64; 2],
        words: Vec<OsString>,
    ) -> PyResult<Self> {
        let at = (at, coordinates(lonlat));
        py.detach(|| Self::of(self.opened()?.window(at, size_mm, words)?))
    }

    /// Returns the millimetres east and north to a position.
    fn mm_at(&self, at: [f64; 2], lonlat: bool) -> PyResult<(f64, f64)> {
        Ok(self.opened()?.mm_at(at, coordinates(lonlat))?.into())
    }

    /// Returns the position at millimetres east and north.
    fn ground_at(&self, mm: [f64; 2], lonlat: bool) -> PyResult<(f64, f64)> {
        Ok(self.opened()?.ground_at(mm, coordinates(lonlat))?.into())
    }

    /// Returns the statements of the file, as pairs of a name and a text.
    fn stated(&self) -> PyResult<Vec<(&'static str, String)>> {
        Ok(self.opened()?.facts())
    }

    /// Returns the heights of some rows, counted from the south, as f8, without rows beyond the
    /// terrain.
    fn rows<'py>(&self, py: Python<'py>, south: u32, count: u32) -> PyResult<Bound<'py, PyBytes>> {
        let [columns, rows] = self.touched.samples();
        let count = count.min(rows.saturating_sub(south));
        let block = Block {
            column: 0,
            row: south,
            columns,
            rows: count,
        };
        let mut heights = vec![0.0; columns as usize * count as usize];
        let read = py.detach(|| self.touched.read(block, &mut heights));
        read.map_err(|unread| match &self.opened {
            Some(opened) => opened.unread(),
            None => refused(unread),
        })?;
        let bytes: Vec<u8> = heights
            .iter()
            .flat_map(|height| height.to_ne_bytes())
            .collect();
        Ok(PyBytes::new(py, &bytes))
    }

    /// Returns the height of the surface, mm; `None` for no-data and outside the terrain.
    fn height_mm(&self, py: Python<'_>, east_mm: f64, north_mm: f64) -> PyResult<Option<f64>> {
        let height = || self.touched.height_mm(east_mm, north_mm);
        let Some(opened) = &self.opened else {
            return Ok(height());
        };
        let height_mm = py.detach(|| opened.check(height));
        notes::warn(py)?;
        height_mm
    }

    /// Number of rows and columns.
    #[getter]
    fn shape(&self) -> (u32, u32) {
        let [columns, rows] = self.touched.samples();
        (rows, columns)
    }

    /// Millimetres of a cell, and of a unit of the heights.
    #[getter]
    fn scale(&self) -> (f64, f64) {
        let scale = self.touched.scale();
        (scale.cell_mm(), scale.height_mm_per_unit())
    }

    /// Extent east and north, mm.
    #[getter]
    fn size_mm(&self) -> (f64, f64) {
        self.touched.size_mm().into()
    }
}

impl Terrain {
    fn of(opened: Arc<Opened>) -> PyResult<Self> {
        Ok(Self {
            touched: opened.touched()?,
            opened: Some(opened),
        })
    }

    fn opened(&self) -> PyResult<&Arc<Opened>> {
        let opened = self.opened.as_ref();
        opened.ok_or_else(|| refused("a terrain of an array has no file"))
    }
}

const fn coordinates(lonlat: bool) -> Coordinates {
    match lonlat {
        true => Coordinates::LonLat,
        false => Coordinates::Own,
    }
}
