//! Terrains of arrays.

use hapterra_touch::{Block, Height, RowOrder, Terrain as Touched};
use pyo3::types::PyBytes;
use pyo3::{Bound, PyResult, Python, pyclass, pymethods};

use crate::{numbers, refused};

/// Heights of one of the types that the library keeps.
#[pyclass(frozen, module = "hapterra._native")]
pub(crate) struct Terrain(pub(crate) Touched);

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
    /// `kind` is numpy's letter and bytes of the samples, as f8; `materials` has a byte each.
    #[new]
    #[pyo3(signature = (samples, kind, shape, *, cell_mm, height_mm_per_unit, south_first, materials=None))]
    // One for each word of Python.
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
                other => Err(refused(format!("samples of {other}: give f8"))),
            }?;
            let terrain = terrain.with_height_scale(height_mm_per_unit);
            let terrain = terrain.map_err(refused)?;
            let terrain = match materials {
                Some(of) => terrain
                    .with_materials(order, of.to_vec())
                    .map_err(refused)?,
                None => terrain,
            };
            Ok(Self(terrain))
        })
    }

    /// Heights of some rows, counted from the south, as f8; none beyond the terrain.
    fn rows<'py>(&self, py: Python<'py>, south: u32, count: u32) -> PyResult<Bound<'py, PyBytes>> {
        let [columns, rows] = self.0.samples();
        let count = count.min(rows.saturating_sub(south));
        let block = Block {
            column: 0,
            row: south,
            columns,
            rows: count,
        };
        let mut heights = vec![0.0; columns as usize * count as usize];
        let read = py.detach(|| self.0.read(block, &mut heights));
        read.map_err(refused)?;
        let bytes: Vec<u8> = heights
            .iter()
            .flat_map(|height| height.to_ne_bytes())
            .collect();
        Ok(PyBytes::new(py, &bytes))
    }

    /// The height of the surface, mm; none in a hole and off the terrain.
    fn height_mm(&self, east_mm: f64, north_mm: f64) -> Option<f64> {
        self.0.height_mm(east_mm, north_mm)
    }

    /// Extent east and north, mm.
    #[getter]
    fn size_mm(&self) -> (f64, f64) {
        self.0.size_mm().into()
    }
}
