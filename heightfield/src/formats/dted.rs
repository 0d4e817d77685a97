//! DTED levels 0 to 2 (MIL-PRF-89020B): a header of 3428 bytes, then one record a
//! meridian from west to east, each with its samples from south to north.

use std::io::Read;

use crate::decoded::Decoded;
use crate::format::{Claim, Format, Parts};
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::placed::GroundUnit;
use crate::{BadRaster, ReferenceSystem, Samples};

/// Digital terrain elevation data.
pub(super) const FORMAT: Format = Format {
    name: "DTED",
    begins: |head| first_label(head).is_some(),
    extensions: &[
        ("dt0", Claim::Promises),
        ("dt1", Claim::Promises),
        ("dt2", Claim::Promises),
    ],
    parts: Parts::One,
    decode: |input, _| decode(input),
};

/// Bytes of the labels: user header, data set identification, accuracy.
const USER_HEADER: usize = 80;
const HEADER: usize = USER_HEADER + 648 + 2700;
/// Bytes of a record besides its samples: counts before, a checksum after.
const RECORD_HEAD: usize = 8;
const CHECKSUM: usize = 4;
/// What begins a record of samples.
const SENTINEL: u8 = 0xaa;
/// What stands where there is no height, in sign and magnitude.
const VOID: i16 = -32767;
/// No place on Earth is lower: such a number is a complement, which some write.
const LOWEST: i16 = -16000;

/// Where the user header begins: a tape's volume and file labels may stand before it.
fn first_label(head: &[u8]) -> Option<usize> {
    let labels = [0, 80, 160].into_iter();
    let mut labels = labels.filter(|&at| head.get(at..at + 4) == Some(b"UHL1".as_slice()));
    let before = |at: usize| {
        head[..at]
            .chunks(80)
            .all(|label| label.starts_with(b"VOL") || label.starts_with(b"HDR"))
    };
    labels.next().filter(|&at| before(at))
}

/// Reads a cell.
fn decode(input: &FileBytes) -> Result<Decoded, BadRaster> {
    let head = input.head(240 + HEADER as u64)?;
    let start = first_label(&head).ok_or_else(|| {
        BadRaster::damaged("its name says DTED, but no user header (UHL1) begins it")
    })?;
    let header = Header::read(&head[start..])?;
    let (columns, rows) = header.size;
    let record = RECORD_HEAD + 2 * rows as usize + CHECKSUM;
    let promised = (start + HEADER) as u64 + u64::from(columns) * record as u64;
    if promised > input.len() {
        return Err(BadRaster::Truncated(format!(
            "its header promises {columns} × {rows} samples in {promised} bytes, it has {}",
            input.len()
        )));
    }
    let samples = match input.is_outline() {
        true => Records::new((0, 0), record),
        false => {
            let mut reader = input.reader()?;
            let skipped = std::io::SeekFrom::Start((start + HEADER) as u64);
            reader.seek(skipped).map_err(BadRaster::Unreadable)?;
            Records::new(header.size, record).read(&mut reader)?
        }
    };
    let mut decoded = Decoded::new(
        format!("{}, int16", header.name()),
        header.size,
        Samples::from(samples.heights),
    );
    decoded.no_data = Some(VOID.into());
    decoded.metres_per_vertical_unit = Some(1.0);
    decoded.system = header.system();
    if let Some(code) = header.vertical {
        decoded.set_vertical_datum(code);
    }
    let (west, south) = header.corner;
    let (east, north) = header.step;
    // Records go from south to north; they were put into rows the same way.
    let map = GroundMap::from_centre([west, east, 0.0], [south, 0.0, north]);
    let map = map.ok_or_else(|| BadRaster::damaged("its header places it nowhere"))?;
    decoded.lay_out(map, Some(GroundUnit::DEGREE));
    if samples.wrong_sums > 0 {
        decoded.remarks.push(format!(
            "{} of {columns} checksums do not agree with their samples: it may be damaged",
            samples.wrong_sums
        ));
    }
    Ok(decoded)
}

struct Header {
    /// Longitude and latitude of the south-western sample, degrees.
    corner: (f64, f64),
    /// Degrees between samples.
    step: (f64, f64),
    size: (u32, u32),
    level: Option<char>,
    /// The horizontal datum as it stands there.
    datum: String,
    /// EPSG's code of the vertical datum.
    vertical: Option<u16>,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, BadRaster> {
        let text = |at: usize, chars: usize| {
            let bytes = bytes.get(at..at + chars).unwrap_or_default();
            String::from_utf8_lossy(bytes).trim().to_owned()
        };
        let wrong = |what: &str, columns: &str| {
            BadRaster::damaged(format!("the user header's {what} (columns {columns})"))
        };
        let tenths = |at: usize, columns: &str| {
            let step = text(at, 4).parse::<f64>().ok().filter(|step| *step > 0.0);
            step.map(|tenths| tenths / 36_000.0)
                .ok_or_else(|| wrong("interval", columns))
        };
        let count = |at: usize, columns: &str| {
            let count = text(at, 4).parse::<u32>().ok();
            count.ok_or_else(|| wrong("number of samples", columns))
        };
        let west = angle(&text(4, 8)).ok_or_else(|| wrong("longitude", "5-12"))?;
        let south = angle(&text(12, 8)).ok_or_else(|| wrong("latitude", "13-20"))?;
        // The identification: what it says of the datums counts from its own start.
        let of_set = |at: usize, chars: usize| text(USER_HEADER + at, chars);
        Ok(Self {
            corner: (west, south),
            step: (tenths(20, "21-24")?, tenths(24, "25-28")?),
            size: (count(47, "48-51")?, count(51, "52-55")?),
            level: of_set(59, 5)
                .strip_prefix("DTED")
                .and_then(|rest| rest.chars().next()),
            datum: of_set(144, 5),
            vertical: match of_set(141, 3).as_str() {
                "E96" => Some(5773),
                "MSL" => Some(5714),
                _ => None,
            },
        })
    }

    fn name(&self) -> String {
        let level = self.level.map(|level| format!(" level {level}"));
        format!("DTED{}", level.unwrap_or_default())
    }

    fn system(&self) -> Option<ReferenceSystem> {
        match self.datum.as_str() {
            "WGS84" => ReferenceSystem::from_code(4326),
            "WGS72" => ReferenceSystem::from_code(4322),
            _ => None,
        }
    }
}

/// Degrees from `DDDMMSSH`, where H is the hemisphere.
fn angle(text: &str) -> Option<f64> {
    let (digits, hemisphere) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let (rest, seconds) = digits.split_at_checked(digits.len().checked_sub(2)?)?;
    let (degrees, minutes) = rest.split_at_checked(rest.len().checked_sub(2)?)?;
    let number = |text: &str| text.trim().parse::<u16>().ok().map(f64::from);
    let size = number(degrees)? + number(minutes)? / 60.0 + number(seconds)? / 3600.0;
    match hemisphere {
        "N" | "E" => Some(size),
        "S" | "W" => Some(-size),
        _ => None,
    }
}

/// Heights in rows from south to north, from records of columns.
struct Records {
    size: (usize, usize),
    record: usize,
    heights: Vec<i16>,
    wrong_sums: usize,
}

impl Records {
    /// The caller has checked that the file holds so many.
    fn new((columns, rows): (u32, u32), record: usize) -> Self {
        let size = (columns as usize, rows as usize);
        Self {
            size,
            record,
            heights: vec![VOID; size.0 * size.1],
            wrong_sums: 0,
        }
    }

    fn read(mut self, reader: &mut dyn Read) -> Result<Self, BadRaster> {
        let mut record = vec![0; self.record];
        for column in 0..self.size.0 {
            reader
                .read_exact(&mut record)
                .map_err(|error| BadRaster::from_io(error, "the records"))?;
            self.take(column, &record)?;
        }
        Ok(self)
    }

    fn take(&mut self, column: usize, record: &[u8]) -> Result<(), BadRaster> {
        if record[0] != SENTINEL {
            return Err(BadRaster::damaged(format!(
                "record {} of {} does not begin like one",
                column + 1,
                self.size.0
            )));
        }
        let (data, sum) = record.split_at(record.len() - CHECKSUM);
        let computed: u32 = data.iter().map(|byte| u32::from(*byte)).sum();
        let stored = u32::from_be_bytes(sum.try_into().unwrap_or_default());
        self.wrong_sums += usize::from(computed != stored);
        let (pairs, _) = data[RECORD_HEAD..].as_chunks::<2>();
        for (row, pair) in pairs.iter().enumerate() {
            self.heights[row * self.size.0 + column] = height(u16::from_be_bytes(*pair));
        }
        Ok(())
    }
}

/// A height in metres from its sign and magnitude.
fn height(stored: u16) -> i16 {
    let magnitude = (stored & 0x7fff) as i16;
    match stored & 0x8000 {
        0 => magnitude,
        _ if -magnitude < LOWEST && -magnitude != VOID => stored as i16,
        _ => -magnitude,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{OpenOptions, Raster};

    /// Three meridians of four samples, 30 seconds apart, at 10° 30' W, 5° S.
    fn cell(heights: [[u16; 4]; 3]) -> Vec<u8> {
        let mut bytes = b"UHL10103000W0050000S03000300".to_vec();
        bytes.resize(47, b' ');
        bytes.extend(b"00030004");
        bytes.resize(USER_HEADER, b' ');
        bytes.extend(b"DSIU");
        bytes.resize(USER_HEADER + 59, b' ');
        bytes.extend(b"DTED1");
        bytes.resize(USER_HEADER + 141, b' ');
        bytes.extend(b"E96WGS84");
        bytes.resize(HEADER, b' ');
        for (index, column) in heights.iter().enumerate() {
            let mut record = vec![SENTINEL, 0, 0, index as u8, 0, index as u8, 0, 0];
            record.extend(column.iter().flat_map(|height| height.to_be_bytes()));
            let sum: u32 = record.iter().map(|byte| u32::from(*byte)).sum();
            record.extend(sum.to_be_bytes());
            bytes.extend(record);
        }
        bytes
    }

    const HEIGHTS: [[u16; 4]; 3] = [
        [1, 2, 3, 4],
        [0x8005, 0xffff, 0x0000, 0x8000],
        [9000, 0x8000 | 430, 0xfffb, 7],
    ];

    fn open(bytes: Vec<u8>) -> Result<Raster, BadRaster> {
        let input = FileBytes::unpacked("w010.dt1", bytes);
        Raster::checked((FORMAT.decode)(&input, &OpenOptions::default())?, None)
    }

    #[test]
    fn sign_and_magnitude_columns_and_place() {
        let raster = open(cell(HEIGHTS)).expect("a cell");
        let column = |column| [0, 1, 2, 3].map(|row| raster.height(column, row));
        assert_eq!(column(0), [1.0, 2.0, 3.0, 4.0]);
        let [a, void, c, d] = column(1);
        assert_eq!([a, c, d], [-5.0, 0.0, 0.0]);
        assert!(void.is_nan(), "-32767 is no data");
        // 0xfffb would be 32763 m deep: a complement, -5.
        assert_eq!(column(2), [9000.0, -430.0, -5.0, 7.0]);
        assert_eq!(raster.format(), "DTED level 1, int16");
        let bounds = raster.bounds().expect("placed");
        let half = 15.0 / 3600.0;
        assert!((bounds.west - (-10.5 - half)).abs() < 1e-12, "{bounds:?}");
        assert!(
            (bounds.north - (-5.0 + 3.5 / 120.0)).abs() < 1e-12,
            "{bounds:?}"
        );
        assert_eq!(
            raster.reference_system().and_then(ReferenceSystem::code),
            Some(4326)
        );
        assert_eq!(
            raster.vertical_datum().and_then(|datum| datum.code),
            Some(5773)
        );
        assert!(raster.remarks().is_empty());
    }

    #[test]
    fn labels_of_a_tape_stand_before_the_header() {
        let mut bytes = [b"VOL1".to_vec(), vec![b' '; 76]].concat();
        bytes.extend([b"HDR1".to_vec(), vec![b' '; 76]].concat());
        bytes.extend(cell(HEIGHTS));
        assert_eq!(open(bytes).expect("a cell").height(2, 0), 9000.0);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let whole = cell(HEIGHTS);
        let told = |bytes: Vec<u8>| open(bytes).expect_err("refused").to_string();
        assert!(told(whole[..whole.len() - 1].to_vec()).contains("truncated"));
        assert!(told(whole[..100].to_vec()).contains("truncated"));
        let with = |at: usize, new: &[u8]| {
            let mut bytes = whole.clone();
            bytes[at..at + new.len()].copy_from_slice(new);
            bytes
        };
        assert!(
            told(with(47, b"9999")).contains("truncated"),
            "and no room was made"
        );
        assert!(told(with(20, b"0000")).contains("interval"));
        assert!(told(with(4, b"01O3000W")).contains("longitude"));
        assert!(told(with(HEADER, &[0])).contains("record 1 of 3"));
        assert!(told(with(0, b"DTED")).contains("UHL1"));
        let summed = open(with(HEADER + RECORD_HEAD, &[1])).expect("one sample differs");
        assert!(summed.remarks()[0].contains("1 of 3 checksums"));
    }
}
