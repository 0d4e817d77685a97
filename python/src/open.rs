//! Terrains that the command opens, read where they are touched.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clap::Parser;
use hapterra::cli::Failure;
use hapterra::cli::options::exaggeration::Exaggeration;
use hapterra::cli::options::terrain_file::{ReadingOptions, assumed_unit};
use hapterra::place::{
    self, Coordinates, PlaceError, Placement, PlacementOptions, Reach, Sizing, Target,
};
use hapterra::terrain::{HapticCells, INTERPOLATED_STEP, Terrain as Laid};
use hapterra_core::phantom::Calibration;
use hapterra_touch::{Block, Heights, Terrain as Touched, Unread};
use heightfield::{Error, Raster, RasterError, ReadTracker};
use pyo3::exceptions::{PyFileNotFoundError, PyOSError};
use pyo3::{PyErr, PyResult};
use self_cell::self_cell;

use crate::{notes, refused};

/// Descriptions of a terrain, by the command's own definitions.
#[derive(Parser)]
#[command(name = "open", no_binary_name = true, disable_help_flag = true)]
struct OpenArguments {
    #[command(flatten)]
    reading: ReadingOptions,
    #[command(flatten)]
    size: Size,
}

/// The terrain's size in the hand.
#[derive(Clone, clap::Args)]
pub(crate) struct Size {
    #[arg(long)]
    cell_mm: Option<f64>,
    #[arg(long, allow_negative_numbers = true, conflicts_with = "cell_mm")]
    ground_m_per_mm: Option<f64>,
    #[arg(long, allow_negative_numbers = true)]
    exaggeration: Option<Exaggeration>,
    #[arg(long, allow_negative_numbers = true, conflicts_with = "exaggeration")]
    height_mm_per_unit: Option<f64>,
}

self_cell!(
    /// A raster, and the grid over it.
    struct GridOverRaster {
        owner: Arc<Raster>,
        #[covariant]
        dependent: Laid,
    }
);

/// A part of a raster at a scale.
pub(crate) struct Opened {
    grid_over_raster: GridOverRaster,
    /// Column and row of its south-west sample in the grid.
    first: [u32; 2],
    /// Samples from west to east, and from south to north.
    samples: [u32; 2],
    /// Number of failed reads, and the reason of the last one.
    unread: Mutex<(u64, String)>,
}

impl Opened {
    /// Opens a file, or several as one, by the command's options, with its whole extent.
    pub(crate) fn open(paths: Vec<PathBuf>, words: Vec<OsString>) -> PyResult<Arc<Self>> {
        let OpenArguments { reading, size } = parse(words)?;
        let options = reading.options().map_err(failed)?;
        let raster = match &paths[..] {
            [path] => Raster::open(path, &options),
            _ => Raster::open_all(paths, &options),
        };
        let raster = raster.map_err(unread)?;
        if let Some(note) = assumed_unit(&raster) {
            notes::add(&note);
        }
        Ok(Arc::new(Self::placed(
            Arc::new(raster),
            &size,
            Target::Whole,
        )?))
    }

    /// Returns a window of a size in the hand around a position of the same raster, within its
    /// bounds.
    pub(crate) fn window(
        &self,
        at: ([f64; 2], Coordinates),
        size_mm: [f64; 2],
        words: Vec<OsString>,
    ) -> PyResult<Arc<Self>> {
        let OpenArguments { size, .. } = parse(words)?;
        let raster = Arc::clone(self.grid_over_raster.borrow_owner());
        let reopened = Self::placed(raster, &size, Target::At(at.0, at.1))?;
        let middle = reopened.mm_at(at.0, at.1)?;
        let cell_mm = reopened.terrain().scale().cell_mm();
        let (mut first, mut samples) = ([0; 2], reopened.samples);
        for axis in 0..2 {
            let (size, last) = (size_mm[axis], f64::from(reopened.samples[axis] - 1));
            if !(size.is_finite() && size >= cell_mm) {
                return Err(refused(format!(
                    "size_mm is {size_mm:?}: use device millimetres, a cell of {cell_mm} at least"
                )));
            }
            let begin = ((middle[axis] - 0.5 * size) / cell_mm + 0.5).floor();
            let end = (begin + (size / cell_mm + 0.5).floor()).clamp(1.0, last);
            // Within the grid, whose last sample is a u32.
            first[axis] = begin.clamp(0.0, end - 1.0) as u32;
            samples[axis] = end as u32 - first[axis] + 1;
        }
        Ok(Arc::new(Self {
            first,
            samples,
            ..reopened
        }))
    }

    fn placed(raster: Arc<Raster>, size: &Size, target: Target) -> PyResult<Self> {
        let read = Arc::clone(&raster);
        let grid_over_raster = GridOverRaster::try_new(raster, |raster| {
            let grid = target.grid(raster, HapticCells::Square)?;
            let options = PlacementOptions {
                target,
                sizing: size.sizing(),
                heights: size.heights(),
                level: Some(0),
            };
            // The position in the arm's workspace has no effect here.
            let view = Placement::new(&grid, &Reach::of(&Calibration::PREMIUM_3_0), &options)?;
            Ok::<_, Failure>(view.terrain(grid)?)
        });
        // Heights that could not be fetched are not no-data.
        let grid_over_raster = grid_over_raster.map_err(|failure| match read.check_complete() {
            Err(error) => unread(error),
            Ok(()) => failed(failure),
        })?;
        let samples = grid_over_raster
            .borrow_dependent()
            .size()
            .map(|patches| patches as u32 + 1);
        Ok(Self {
            grid_over_raster,
            first: [0, 0],
            samples,
            unread: Mutex::default(),
        })
    }

    pub(crate) fn terrain(&self) -> &Laid<'_> {
        self.grid_over_raster.borrow_dependent()
    }

    /// Returns it as a terrain that can be touched.
    pub(crate) fn touched(self: &Arc<Self>) -> PyResult<Touched> {
        let ([columns, rows], terrain) = (self.samples, self.terrain());
        let scale = terrain.scale();
        let part = Part(Arc::clone(self));
        let touched = Touched::from_tiles(columns, rows, scale.cell_mm(), part);
        let touched = touched.and_then(|it| it.with_height_scale(scale.height_mm_per_unit()));
        let step = match terrain.grid().is_resampled() {
            true => INTERPOLATED_STEP,
            false => 0.0,
        };
        Ok(touched.map_err(refused)?.with_height_step(step))
    }

    /// Returns the millimetres east and north from the south-west sample to a position, which may
    /// be outside.
    pub(crate) fn mm_at(&self, at: [f64; 2], coordinates: Coordinates) -> PyResult<[f64; 2]> {
        let terrain = self.terrain();
        let ground = Target::At(at, coordinates).middle(&terrain.raster().georeference());
        let ground = ground.map_err(|error| failed(error.into()))?.unwrap_or(at);
        let cells = terrain.grid().of_ground(ground);
        Ok([0, 1]
            .map(|axis| (cells[axis] - f64::from(self.first[axis])) * terrain.scale().cell_mm()))
    }

    /// Returns a position in the file's coordinates, or in longitude and latitude.
    pub(crate) fn ground_at(&self, mm: [f64; 2], coordinates: Coordinates) -> PyResult<[f64; 2]> {
        let terrain = self.terrain();
        let cell_mm = terrain.scale().cell_mm();
        let cells = [0, 1].map(|axis| mm[axis] / cell_mm + f64::from(self.first[axis]));
        let ground = terrain.grid().to_ground(cells);
        let file = terrain.raster().georeference();
        if coordinates == Coordinates::Own {
            return Ok(ground);
        }
        file.to_lonlat(ground).ok_or_else(|| {
            let bounds = place::bounds_in_words(&file);
            failed(PlaceError::NoSystem { bounds }.into())
        })
    }

    /// Returns the file's own statements about its data.
    pub(crate) fn facts(&self) -> Vec<(&'static str, String)> {
        let raster = self.terrain().raster();
        let crs = raster.reference_system().map(|system| match system.code() {
            Some(code) => format!("EPSG:{code}"),
            None => system.name().to_owned(),
        });
        let side_m = self.terrain().grid().side_m().map(|side| side.to_string());
        let unit_m = raster.stated_metres_per_vertical_unit();
        let facts = [
            ("format", Some(raster.format().to_owned())),
            ("crs", crs),
            ("cell_m", side_m),
            ("height_unit_m", unit_m.map(|unit| unit.to_string())),
            (
                "covers",
                Some(place::bounds_in_words(&raster.georeference())),
            ),
        ];
        let facts = facts.into_iter();
        facts
            .filter_map(|(name, text)| Some((name, text?)))
            .collect()
    }

    /// Returns the result of `of` if all heights were read.
    pub(crate) fn check<T>(&self, of: impl FnOnce() -> T) -> PyResult<T> {
        let before = self.lock().0;
        let value = of();
        let after = self.lock().0;
        match after == before {
            true => Ok(value),
            false => Err(self.unread()),
        }
    }

    /// Returns the error of heights that were not read.
    pub(crate) fn unread(&self) -> PyErr {
        PyOSError::new_err(self.lock().1.clone())
    }

    fn lock(&self) -> MutexGuard<'_, (u64, String)> {
        self.unread.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Part of an opened terrain that is read.
struct Part(Arc<Opened>);

impl Heights for Part {
    fn read(&self, block: Block, heights: &mut [f64]) -> Result<(), Unread> {
        let opened = &*self.0;
        let (terrain, [west, south]) = (opened.terrain(), opened.first);
        let (raster, reads) = (terrain.raster(), ReadTracker::default());
        let lines = heights.chunks_exact_mut(block.columns.max(1) as usize);
        for (row, line) in (south + block.row..).zip(lines) {
            reads.add(terrain.grid().read_row(0, row, west + block.column, line));
        }
        if reads.status().is_complete() {
            return Ok(());
        }
        // Does not retry a failed connection each time: the reason stays.
        let (count, why) = &mut *opened.lock();
        *count += 1;
        match raster.check_complete() {
            Err(error) => *why = text(&error.into()),
            Ok(()) if why.is_empty() => {
                *why = "the heights have not arrived yet: try again".to_owned();
            }
            Ok(()) => {}
        }
        Err(Unread(0))
    }
}

impl Size {
    fn sizing(&self) -> Sizing {
        match self.ground_m_per_mm {
            Some(scale) => Sizing::GroundMPerMm(scale),
            None => Sizing::CellMm(self.cell_mm.unwrap_or(1.0)),
        }
    }

    fn heights(&self) -> place::Heights {
        match self.height_mm_per_unit {
            Some(height) => place::Heights::MmPerUnit(height),
            None => self.exaggeration.unwrap_or_default().into(),
        }
    }
}

fn parse(words: Vec<OsString>) -> PyResult<OpenArguments> {
    OpenArguments::try_parse_from(words).map_err(|error| {
        let text = error.to_string();
        let text = text.split("\n\nUsage: ").next().unwrap_or(&text);
        refused(text.strip_prefix("error: ").unwrap_or(text))
    })
}

/// Returns a failure of the command as the text of an exception.
fn text(failure: &Failure) -> String {
    let text = failure.text();
    text.strip_prefix("error: ").unwrap_or(&text).to_owned()
}

/// Returns a failure of the command as a `ValueError`.
pub(crate) fn failed(failure: Failure) -> PyErr {
    refused(text(&failure))
}

/// Returns the error of a file that cannot be opened: `OSError` if it cannot be read, else
/// `ValueError`.
fn unread(error: Error) -> PyErr {
    let raised = match error.fault() {
        RasterError::Unreadable(io) if io.kind() == std::io::ErrorKind::NotFound => {
            PyFileNotFoundError::new_err
        }
        RasterError::Unreadable(_) | RasterError::Remote(_) => PyOSError::new_err,
        _ => pyo3::exceptions::PyValueError::new_err,
    };
    raised(text(&error.into()))
}
