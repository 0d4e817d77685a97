//! The rectangles of a source: which samples of the file fill which of the terrain.

use super::super::super::BadRaster;
use super::super::super::blocks::Part;
use super::super::source::Axis;
use super::xml::{Element, number};

/// A rectangle of samples; its edges need not be those of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    at: [f64; 2],
    size: [f64; 2],
}

/// Numbers beyond this are no places of samples.
const LARGEST: f64 = 1e10;

/// Edges that are nearer to those of samples are meant to be there, cells; GDAL's number.
const ROUNDING: f64 = 1e-3;

impl Rectangle {
    /// All of a file.
    pub(super) fn whole((columns, rows): (u32, u32)) -> Self {
        Self {
            at: [0.0; 2],
            size: [columns, rows].map(f64::from),
        }
    }

    /// From an element; `None` for one that stands for the whole, by sizes of −1.
    pub(super) fn read(element: &Element) -> Result<Option<Self>, BadRaster> {
        let part = |name: &str| {
            let number = element.attribute(name).and_then(number);
            let number = number.filter(|number| number.abs() <= LARGEST);
            number.ok_or_else(|| {
                BadRaster::damaged(format!("VRT: {name} of a {} is no place", element.name))
            })
        };
        let rectangle = Self {
            at: [part("xOff")?, part("yOff")?],
            size: [part("xSize")?, part("ySize")?],
        };
        if rectangle.at == [-1.0; 2] && rectangle.size == [-1.0; 2] {
            return Ok(None);
        }
        match rectangle.size.iter().all(|size| *size > 0.0) {
            true => Ok(Some(rectangle)),
            false => Err(BadRaster::damaged(format!(
                "VRT: a {} of {} × {} samples",
                element.name, rectangle.size[0], rectangle.size[1]
            ))),
        }
    }

    /// Whether both have as many samples.
    pub(super) fn is_as_large_as(&self, other: &Self) -> bool {
        (0..2).all(|axis| (self.size[axis] / other.size[axis] - 1.0).abs() < 1e-6)
    }

    /// The samples of a terrain whose cells are inside, also in part, as GDAL takes them; rows
    /// from the south. `None` where there are none.
    pub(super) fn covers(&self, (columns, rows): (u32, u32)) -> Option<Part> {
        let along = |axis: usize, count: u32| {
            let end = self.at[axis] + self.size[axis];
            let inside = |edge: f64| edge.clamp(0.0, f64::from(count)) as u32;
            let first = inside((self.at[axis] + ROUNDING).floor());
            let end = inside((end - ROUNDING).ceil());
            (first < end).then(|| (first, end - first))
        };
        let (column, columns) = along(0, columns)?;
        let (row, covered) = along(1, rows)?;
        Some(Part {
            column,
            row: rows - row - covered,
            columns,
            rows: covered,
        })
    }

    /// From columns and rows of the terrain, rows from the south, in this rectangle to those of
    /// a file in another one.
    pub(super) fn to(&self, file: &Self, rows: u32) -> [Axis; 2] {
        let step = [0, 1].map(|axis| file.size[axis] / self.size[axis]);
        let column = Axis {
            start: file.at[0] - self.at[0] * step[0],
            step: step[0],
        };
        let row = Axis {
            start: file.at[1] + (f64::from(rows) - self.at[1]) * step[1],
            step: -step[1],
        };
        [column, row]
    }
}
