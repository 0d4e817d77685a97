//! Result of a decoder, and the checks on it.

use std::cell::RefCell;

use super::blocks::Survey;
use super::crs::{ReferenceSystem, Vertical};
use super::file_layout::FileLayout;
use super::geometry::{CellSize, metres_in, unknown_unit};
use super::height_summary::HeightSummary;
use super::place::Place;
use super::samples::{SampleValue, with_samples};
use super::storage::Storage;
use super::suspicious_values::{MAX_HEIGHT, Outermost};
use super::{Certainty, RasterError, VerticalDatum};

/// Result of a decoder: samples in file order, and the file's metadata.
#[derive(Clone, Debug)]
pub(super) struct Decoded {
    /// Name of the format and variant, as `GeoTIFF, int16, deflate`.
    pub(super) format: String,
    /// Samples a row.
    pub(super) columns: u32,
    /// Rows.
    pub(super) rows: u32,
    /// The samples, the file's first row first.
    pub(super) storage: Storage,
    /// True if the file's first row is the southernmost.
    pub(super) south_up: bool,
    /// True if the file's first column is the easternmost.
    pub(super) east_first: bool,
    /// Stored value that means no data.
    pub(super) no_data: Option<f64>,
    /// Height = stored × scale + offset.
    pub(super) scale: f64,
    /// See `scale`.
    pub(super) offset: f64,
    /// The reference system, if the file states it.
    pub(super) system: Option<ReferenceSystem>,
    /// Source of `system`.
    pub(super) system_from: Certainty,
    /// Place of the samples, if the file states it.
    pub(super) place: Option<Place>,
    /// Size of a cell, if the file states it.
    pub(super) cell: Option<CellSize>,
    /// True if the stored values are depths, which were turned into heights.
    pub(super) are_depths: bool,
    /// Metres per vertical unit, if the file states it.
    pub(super) metres_per_vertical_unit: Option<f64>,
    /// Source of `metres_per_vertical_unit`.
    pub(super) vertical_unit_from: Certainty,
    /// Zero of the heights, if the file states it.
    pub(super) vertical_datum: Option<VerticalDatum>,
    /// Reason why all samples are in memory, if the format could have left them in the file.
    pub(super) memory_reason: Option<String>,
    /// The samples' layout in the file.
    pub(super) file_layout: FileLayout,
    /// Remarks for the user.
    pub(super) remarks: Vec<String>,
}

/// Converts columns and rows to `u32`.
///
/// # Errors
/// [`RasterError::AbsurdSize`] if either exceeds a `u32`.
pub(super) fn sides(columns: u64, rows: u64) -> Result<(u32, u32), RasterError> {
    match (u32::try_from(columns), u32::try_from(rows)) {
        (Ok(columns), Ok(rows)) => Ok((columns, rows)),
        _ => Err(RasterError::AbsurdSize(format!(
            "{columns} × {rows} samples"
        ))),
    }
}

impl Decoded {
    /// Returns plain heights, north row first, without further metadata.
    pub(super) fn new(
        format: String,
        (columns, rows): (u32, u32),
        storage: impl Into<Storage>,
    ) -> Self {
        Self {
            format,
            columns,
            rows,
            storage: storage.into(),
            south_up: false,
            east_first: false,
            no_data: None,
            scale: 1.0,
            offset: 0.0,
            system: None,
            system_from: Certainty::Stated,
            place: None,
            cell: None,
            are_depths: false,
            metres_per_vertical_unit: None,
            vertical_unit_from: Certainty::Stated,
            vertical_datum: None,
            memory_reason: None,
            file_layout: FileLayout::default(),
            remarks: Vec::new(),
        }
    }
}

impl Decoded {
    /// Sets unit, datum and direction from a vertical reference system; `stated` is the number of
    /// metres in a unit, if the file states it.
    pub(super) fn set_vertical(&mut self, system: Option<Vertical>, declared: Option<f64>) {
        self.metres_per_vertical_unit = declared.or(system.as_ref().map(|system| system.metres));
        if let Some(system) = system {
            if let Some(declared) =
                declared.filter(|declared| (declared / system.metres - 1.0).abs() > 1e-9)
            {
                self.remarks.push(format!(
                    "unit of heights: the file states units of {declared} m, and {}, which counts in units of {} m; the former is used (--input height-unit=…)",
                    system.name, system.metres
                ));
            }
            if declared.is_none() && system.code.is_some() {
                self.vertical_unit_from = Certainty::FromCode;
            }
            if system.is_depth {
                self.turn_depths_into_heights(&system.name);
            }
            self.vertical_datum = Some(VerticalDatum {
                name: system.name,
                code: system.code,
            });
        }
    }

    /// Sets the vertical datum to the EPSG system `code`, which the format implies.
    pub(super) fn set_vertical_datum(&mut self, code: u16) {
        let known = super::crs::vertical(code);
        self.vertical_datum = known.map(|system| VerticalDatum {
            name: system.name,
            code: Some(code),
        });
    }

    /// Sets the unit of the heights by its name, if the file states one.
    pub(super) fn set_unit(&mut self, name: Option<&str>) {
        let Some(name) = name.filter(|name| !name.is_empty()) else {
            return;
        };
        match metres_in(name) {
            None => self.remarks.push(unknown_unit(name)),
            metres => self.metres_per_vertical_unit = metres,
        }
    }

    /// Overrides the metres per vertical unit of the file with the user's.
    pub(super) fn with_vertical_unit(mut self, metres: Option<f64>) -> Self {
        if metres.is_some() {
            self.metres_per_vertical_unit = metres;
            self.vertical_unit_from = Certainty::Given;
        }
        self
    }

    /// Adds a remark if more samples are in memory than would be for a file that is read in
    /// windows.
    pub(super) fn remark_if_in_memory(&mut self, max_bytes: u64) {
        if let Storage::Memory { samples, .. } = &self.storage
            && samples.bytes() as u64 > max_bytes
        {
            let megabytes = samples.bytes() / 1_000_000;
            let why = self.memory_reason.as_deref();
            let why = why.unwrap_or("its format has no windows, or too large ones");
            let remark = format!(
                "it is read as a whole, {megabytes} MB: {why}. As this it stays on the disk: gdal_translate -co TILED=YES -co COMPRESS=DEFLATE IN OUT.tif"
            );
            self.remarks.push(remark);
        }
    }

    /// Turns stored depths into heights, and adds a remark.
    pub(super) fn turn_depths_into_heights(&mut self, why: &str) {
        // Several facts in a file may each mark it as depths.
        if std::mem::replace(&mut self.are_depths, true) {
            return;
        }
        self.scale = -self.scale;
        self.offset = -self.offset;
        self.remarks.push(format!(
            "depths ({why}): they are rendered as heights below zero"
        ));
    }
}

impl Decoded {
    /// Checks the requirements for every format, and summarises the heights. `no_data` overrides
    /// the file's value.
    pub(super) fn check(&mut self, no_data: Option<f64>) -> Result<Survey, RasterError> {
        let (columns, rows) = (u64::from(self.columns), u64::from(self.rows));
        if columns < 2 || rows < 2 {
            return Err(RasterError::TooSmall { columns, rows });
        }
        if let Some(samples) = self.storage.in_memory()
            && columns.checked_mul(rows) != u64::try_from(samples.len()).ok()
        {
            return Err(RasterError::damaged(format!(
                "{} samples where {columns} × {rows} are stated",
                samples.len()
            )));
        }
        if !(self.scale.is_finite() && self.offset.is_finite()) || self.scale == 0.0 {
            return Err(RasterError::damaged(format!(
                "heights are stored with scale {} and offset {}",
                self.scale, self.offset
            )));
        }
        self.resolve_no_data(no_data);
        self.cell = self.cell.filter(CellSize::is_valid);
        self.storage.set_order(self.south_up, self.east_first);
        let mut outermost = RefCell::new(Outermost::NONE);
        let survey = match &self.storage {
            Storage::Memory { .. } => Survey::of_all(self.summarise(outermost.get_mut())),
            Storage::Blocks(blocks) => {
                let survey =
                    blocks.survey(|stored| self.counted(stored, &mut outermost.borrow_mut()));
                if let Some(outage) = blocks.take_outage() {
                    return Err(outage);
                }
                survey
            }
        };
        let suspicions = outermost.into_inner().remarks(self.no_data.is_some());
        self.remarks.extend(suspicions);
        match survey.summary.has_none() {
            true => Err(RasterError::AllNoData {
                // Some samples were read twice.
                samples: survey.summary.no_data.min(columns * rows),
            }),
            false => Ok(survey),
        }
    }

    /// Sets the no-data value to `no_data`, or else to the file's, as the sample type stores it.
    pub(super) fn resolve_no_data(&mut self, no_data: Option<f64>) {
        self.no_data = no_data
            .or(self.no_data)
            .and_then(|value| self.storage.sample_type().none().comparable_no_data(value));
    }

    /// Returns the height of a stored value; NaN for no-data and for values that are not heights.
    pub(super) fn height_of(&self, stored: f64) -> f64 {
        let height = stored * self.scale + self.offset;
        match self.no_data == Some(stored) || height.abs() > MAX_HEIGHT {
            true => f64::NAN,
            false => height,
        }
    }

    /// Returns the height of a value read from the file; NaN for `None`.
    pub(super) fn height_in_file(&self, stored: Option<f64>) -> f64 {
        stored.map_or(f64::NAN, |stored| self.height_of(stored))
    }

    /// As `height_in_file`, and counts the value in `outermost`.
    fn counted(&self, stored: Option<f64>, outermost: &mut Outermost) -> f64 {
        if let Some(stored) = stored.filter(|stored| self.no_data != Some(*stored)) {
            outermost.add(stored);
        }
        self.height_in_file(stored)
    }

    /// Computes range and number of no-data samples in one pass over the samples in memory.
    fn summarise(&self, outermost: &mut Outermost) -> HeightSummary {
        let mut summary = HeightSummary::EMPTY;
        let Storage::Memory { samples, mask } = &self.storage else {
            return summary;
        };
        let is_no_data = |index| mask.as_ref().is_some_and(|mask| mask.contains(index));
        with_samples!(samples, values => {
            for (index, value) in values.iter().enumerate() {
                let stored = (!is_no_data(index)).then(|| value.widen());
                summary.add(self.counted(stored, outermost));
            }
        });
        summary
    }
}
