//! Which stored samples are holes: the conventions know fill values, missing values and a valid
//! range.

use std::ops::RangeInclusive;

use netcdf_reader::NcVariable;
use netcdf_reader::masked::MaskParams;

use crate::blocks::BlockImage;
use crate::blocks::{Block, BlockReader, Looks, Part};
use crate::samples::{HoleMask, SampleValue, with_samples};
use crate::{BadRaster, SampleType, Samples};

/// What a variable says of its holes.
#[derive(Clone, Debug)]
pub(super) struct Missing {
    /// `_FillValue`, else `missing_value`, else what the format writes where nothing was
    /// written.
    pub(super) no_data: Option<f64>,
    /// Every other missing value, as a sample can hold it.
    others: Vec<f64>,
    valid: RangeInclusive<f64>,
}

impl Missing {
    /// What a variable says, whose samples have a type.
    pub(super) fn of(variable: &NcVariable, sample: SampleType) -> Self {
        let default = match sample {
            SampleType::I16 => Some(-32767.0),
            SampleType::I32 => Some(-2_147_483_647.0),
            SampleType::F32 | SampleType::F64 => Some(9.969_209_968_386_869e36),
            _ => None,
        };
        let Some(stated) = MaskParams::from_variable(variable) else {
            return Self {
                no_data: default,
                others: Vec::new(),
                valid: f64::MIN..=f64::MAX,
            };
        };
        let missing = stated.missing_values.first().copied();
        let none = sample.none();
        let others = stated.missing_values.iter();
        let others = others.filter_map(|value| none.comparable_no_data(*value));
        Self {
            no_data: stated.fill_value.or(missing).or(default),
            others: others.collect(),
            valid: stated.valid_min.unwrap_or(f64::MIN)..=stated.valid_max.unwrap_or(f64::MAX),
        }
    }

    /// The holes that no single value marks.
    pub(super) fn holes(&self, samples: &Samples) -> HoleMask {
        let mut mask = HoleMask::with_capacity(samples.len());
        with_samples!(samples, values => {
            for (index, value) in values.iter().enumerate() {
                let value = value.widen();
                let is_valid = value.is_nan() || self.valid.contains(&value);
                if self.others.contains(&value) || !is_valid {
                    mask.insert(index);
                }
            }
        });
        mask
    }
}

/// A reader whose blocks have these holes, too.
pub(super) struct WithHoles<R> {
    pub(super) reader: R,
    pub(super) missing: Missing,
}

impl<R: BlockReader> BlockReader for WithHoles<R> {
    fn format(&self) -> &'static str {
        super::FORMAT.name
    }

    fn images(&self) -> &[BlockImage] {
        self.reader.images()
    }

    fn sample_type(&self) -> SampleType {
        self.reader.sample_type()
    }

    fn is_stored(&self, image: usize, part: &Part) -> bool {
        self.reader.is_stored(image, part)
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, BadRaster> {
        let mut block = self.reader.read(image, part)?;
        let mut holes = self.missing.holes(&block.samples);
        if let Some(others) = block.holes.take() {
            holes.union_with(&others);
        }
        block.holes = Some(holes).filter(|holes| !holes.is_clear());
        Ok(block)
    }

    fn set_order(&mut self, south_up: bool, east_first: bool) {
        self.reader.set_order(south_up, east_first);
    }

    fn want(&self, image: usize, parts: &[Part]) {
        self.reader.want(image, parts);
    }

    fn index(&self) -> u64 {
        self.reader.index()
    }

    fn looks(&self) -> Option<Looks> {
        self.reader.looks()
    }

    fn kept_bytes(&self) -> usize {
        self.reader.kept_bytes()
    }
}
