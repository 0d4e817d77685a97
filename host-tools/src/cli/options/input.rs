//! `--input`: properties that a terrain file does not state, one `KEY=VALUE` each.

use std::str::FromStr;

use crate::cli::failure::{Failure, OrHint};
use crate::quantity::{GROUND, MEMORY};
use crate::terrain::HapticCells;
use heightfield::{
    Encoding, Endian, Fill, OpenOptions, PngChannel, RawLayout, SampleType, metres_in,
};

/// The keys, each with an example.
const KEYS: [(&str, &str); 13] = [
    ("raw", "512x400:i16:le"),
    ("no-data", "-9999"),
    ("fill", "16"),
    ("band", "2"),
    ("variable", "depth"),
    ("cell", "30m"),
    ("height-unit", "ft"),
    ("encoding", "terrarium"),
    ("channel", "alpha"),
    ("cells", "stored"),
    ("in-memory", "64MB"),
    ("gdal:NAME", "VALUE"),
    ("asset", "dem"),
];

/// A property of the input.
#[derive(Clone, Debug, PartialEq)]
pub struct InputSetting {
    key: String,
    value: InputValue,
}

#[derive(Clone, Debug, PartialEq)]
enum InputValue {
    /// The file contains raw samples, north row first.
    Raw(u32, u32, SampleType, Endian),
    /// The stored value that means no data.
    NoData(f64),
    /// Distance within which no-data is filled.
    Fill(Fill),
    /// The band with the heights; the first is 1.
    Band(u32),
    /// The raster with the heights, if the file has several.
    Variable(String),
    /// Side of a cell on the ground, m.
    CellM(f64),
    /// Metres per unit of height.
    HeightUnitM(f64),
    /// Encoding of heights as colours.
    Encoding(Encoding),
    /// The channel of a PNG with the heights.
    Channel(PngChannel),
    /// The rendered cells.
    Cells(HapticCells),
    /// Maximum megabytes of samples in memory.
    InMemoryMb(u32),
    /// An option of the GDAL driver.
    Gdal(String),
}

impl FromStr for InputSetting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || {
            let keys: Vec<_> = KEYS.iter().map(|(key, it)| format!("{key}={it}")).collect();
            format!("supported are {}", keys.join(", "))
        };
        let (key, value) = text.split_once('=').ok_or_else(unknown)?;
        let key = match key {
            // The raster of a STAC item is an asset.
            "asset" => "variable",
            key => key,
        };
        let parsed = match key {
            "raw" => raw(value),
            "no-data" => number(value).map(InputValue::NoData),
            "fill" => fill(value).map(InputValue::Fill),
            "band" => match value.parse() {
                Ok(band) if band > 0 => Ok(InputValue::Band(band)),
                _ => Err("a band is a whole number from 1 on".into()),
            },
            "variable" => Ok(InputValue::Variable(value.to_owned())),
            "cell" => GROUND
                .read_within(value, [1e-6, 1e7])
                .map(InputValue::CellM),
            "height-unit" => height_unit(value).map(InputValue::HeightUnitM),
            "encoding" => one_of(Encoding::ALL, Encoding::name, value).map(InputValue::Encoding),
            "channel" => one_of(PngChannel::ALL, PngChannel::name, value).map(InputValue::Channel),
            "cells" => <HapticCells as clap::ValueEnum>::from_str(value, false)
                .map(InputValue::Cells)
                .map_err(|_| "square or stored".to_owned()),
            "in-memory" => MEMORY
                .read_within(value, [0.0, f64::from(u32::MAX)])
                .map(|mb| InputValue::InMemoryMb(mb as u32)),
            _ => match key.strip_prefix("gdal:") {
                Some(name) if !name.is_empty() => Ok(InputValue::Gdal(format!("{name}={value}"))),
                _ => return Err(unknown()),
            },
        };
        let value = parsed.map_err(|why| format!("{key}: {why}"))?;
        let key = key.to_owned();
        Ok(Self { key, value })
    }
}

impl InputSetting {
    /// Returns the requested cells, if this setting is about them.
    pub(in crate::cli) const fn cells(&self) -> Option<HapticCells> {
        match self.value {
            InputValue::Cells(cells) => Some(cells),
            _ => None,
        }
    }
}

/// Converts the options of an input to the library's.
pub(super) fn open_options(settings: &[InputSetting]) -> Result<OpenOptions, Failure> {
    let twice = settings.iter().enumerate().find(|(index, setting)| {
        let mut before = settings.iter().take(*index);
        before.any(|other| other.key == setting.key)
    });
    if let Some((_, InputSetting { key, .. })) = twice {
        return Err(format!("--input {key}=… is stated twice")).or_hint("state it once");
    }
    let mut options = OpenOptions {
        max_in_memory_bytes: u64::from(OpenOptions::IN_MEMORY_MB) << 20,
        ..OpenOptions::default()
    };
    for InputSetting { value, .. } in settings {
        match value {
            InputValue::Raw(columns, rows, sample, endian) => {
                options.raw = Some(RawLayout {
                    columns: *columns,
                    rows: *rows,
                    sample: *sample,
                    endian: *endian,
                });
            }
            InputValue::NoData(value) => options.no_data = Some(*value),
            InputValue::Fill(fill) => options.fill = Some(*fill),
            InputValue::Band(band) => options.band = Some(*band),
            InputValue::Variable(name) => options.variable = Some(name.clone()),
            InputValue::CellM(side) => options.ground_cell_m = Some(*side),
            InputValue::HeightUnitM(metres) => options.vertical_unit_m = Some(*metres),
            InputValue::Encoding(encoding) => options.encoding = Some(*encoding),
            InputValue::Channel(channel) => options.png_channel = Some(*channel),
            InputValue::Cells(_) => {}
            InputValue::InMemoryMb(mb) => options.max_in_memory_bytes = u64::from(*mb) << 20,
            InputValue::Gdal(option) => options.open_options.push(option.clone()),
        }
    }
    if options.encoding.is_some() && options.png_channel.is_some() {
        return Err("encoding= and channel= both define how colours are heights")
            .or_hint("leave one of them out");
    }
    Ok(options)
}

/// Parses `512x400:i16:le`; type and byte order are optional.
fn raw(text: &str) -> Result<InputValue, String> {
    let mut parts = text.split(':');
    let (columns, rows) = parse_size(parts.next().unwrap_or_default())?;
    let sample = parts
        .next()
        .map(|name| one_of(SampleType::ALL, SampleType::name, name));
    let endian = parts.next().map(|name| match name {
        "le" => Ok(Endian::Little),
        "be" => Ok(Endian::Big),
        _ => one_of(Endian::ALL, Endian::name, name),
    });
    if let Some(more) = parts.next() {
        return Err(format!("`{more}` is too much: WIDTHxHEIGHT:TYPE:ORDER"));
    }
    Ok(InputValue::Raw(
        columns,
        rows,
        sample.transpose()?.unwrap_or(SampleType::I16),
        endian.transpose()?.unwrap_or(Endian::Little),
    ))
}

/// Parses the name of one of `all` values.
fn one_of<T: Copy>(all: &[T], name: fn(T) -> &'static str, text: &str) -> Result<T, String> {
    let named = all.iter().find(|value| name(**value) == text);
    named.copied().ok_or_else(|| {
        let names: Vec<_> = all.iter().map(|value| name(*value)).collect();
        format!("`{text}` is none of {}", names.join(", "))
    })
}

fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| "a number is wanted".into())
}

/// Parses the distance within which no-data is filled.
fn fill(text: &str) -> Result<Fill, String> {
    let samples = text.trim().parse().ok();
    let expected = || format!("a whole number of samples from 1 to {}", Fill::MAX);
    samples.and_then(Fill::within).ok_or_else(expected)
}

/// Parses a unit of height, in metres.
fn height_unit(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let metres = metres_in(text).or_else(|| text.parse().ok());
    metres
        .filter(|metres| (1e-6..=1e6).contains(metres))
        .ok_or_else(|| "m, ft, us-ft, or metres in a unit, as 0.01".into())
}

/// Parses a size in samples: `512x400`, or `512` for a square.
///
/// # Errors
/// The text is no size.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    match (parts.0.trim().parse(), parts.1.trim().parse()) {
        (Ok(width), Ok(height)) if width > 0 && height > 0 => Ok((width, height)),
        _ => Err("a size is WIDTHxHEIGHT in samples, as 512x400".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(settings: &[&str]) -> Result<OpenOptions, String> {
        let settings: Result<Vec<_>, _> = settings.iter().map(|text| text.parse()).collect();
        open_options(&settings?).map_err(|failure| failure.text())
    }

    #[test]
    fn each_input_key_parses_its_example() {
        for (key, value) in KEYS {
            let text = format!("{key}={value}");
            assert!(text.parse::<InputSetting>().is_ok(), "{text}");
        }
        let all = [
            "raw=512x400:f32:be",
            "no-data=-9999",
            "cell=0.5km",
            "fill=64",
            "gdal:A=b=c",
        ];
        let options = options(&all).expect("read");
        let raw = options.raw.expect("raw");
        assert_eq!((raw.columns, raw.rows), (512, 400));
        assert_eq!((raw.sample, raw.endian), (SampleType::F32, Endian::Big));
        assert_eq!(options.no_data, Some(-9999.0));
        assert_eq!(options.ground_cell_m, Some(500.0));
        assert_eq!(options.fill, Fill::within(64));
        assert_eq!(options.open_options, ["A=b=c"]);
    }

    #[test]
    fn invalid_input_setting_error_names_the_valid_form() {
        for (text, expected) in [
            ("bands=2", "band=2"),
            ("stored", "cells=stored"),
            ("gdal:=1", "gdal:NAME"),
            ("band=0", "from 1 on"),
            ("raw=0x4", "WIDTHxHEIGHT"),
            ("raw=4x", "WIDTHxHEIGHT"),
            ("raw=4x4:i17", "i16"),
            ("raw=4x4:i16:middle", "little"),
            ("raw=4x4:i16:le:more", "too much"),
            ("cell=0", "from"),
            ("cell=-3", "from"),
            ("cell=1e9", "from"),
            ("cell=3furlongs", "km"),
            ("height-unit=furlong", "us-ft"),
            ("height-unit=0", "us-ft"),
            ("height-unit=nan", "us-ft"),
            ("no-data=none", "number"),
            ("fill=0", "from 1 to 64"),
            ("fill=65", "from 1 to 64"),
            ("fill=-3", "from 1 to 64"),
            ("fill=2.5", "from 1 to 64"),
            ("in-memory=1TB", "MB, GB"),
            ("cells=round", "square or stored"),
            ("encoding=morse", "terrarium"),
        ] {
            let why = text.parse::<InputSetting>().expect_err(text);
            assert!(why.contains(expected), "{text}: {why}");
        }
    }

    #[test]
    fn contradicting_input_options_are_refused() {
        let why = options(&["band=1", "band=2"]).expect_err("twice");
        assert!(why.contains("band=… is stated twice"), "{why}");
        assert!(options(&["variable=a", "asset=b"]).is_err());
        assert!(options(&["encoding=terrarium", "channel=red"]).is_err());
        assert!(options(&["gdal:A=1", "gdal:B=2"]).is_ok());
        assert!(options(&["gdal:A=1", "gdal:A=2"]).is_err());
    }

    #[test]
    fn height_units_are_parsed() {
        let feet = 1200.0 / 3937.0;
        for (unit, metres) in [("m", 1.0), ("ft", 0.3048), ("us-ft", feet), ("0.01", 0.01)] {
            assert_eq!(height_unit(unit), Ok(metres));
        }
    }
}
