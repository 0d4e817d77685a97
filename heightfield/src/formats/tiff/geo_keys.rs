//! The keys of a GeoTIFF: codes, numbers and texts about its reference system.

use geotiff_core::geokeys::{
    GEODETIC_CRS_TYPE, GEOG_ANGULAR_UNITS, GT_MODEL_TYPE, GT_RASTER_TYPE, GeoKeyDirectory,
    PROJ_LINEAR_UNITS, PROJECTED_CRS_TYPE,
};
use tiff_reader::Ifd;

use crate::Certainty;
use crate::file_layout::RasterType;
use crate::placed::GroundUnit;

const GEO_ASCII_PARAMS: u16 = 34737;
const GEO_DOUBLE_PARAMS: u16 = 34736;
const GEO_KEY_DIRECTORY: u16 = 34735;
/// Values of [`GT_MODEL_TYPE`].
const PROJECTED: u16 = 1;
const GEOGRAPHIC: u16 = 2;
/// Key of a linear unit's size in metres, for a unit without a code.
const LINEAR_UNIT_SIZE: u16 = 3077;

/// The GeoTIFF keys, if there are any.
pub(super) struct GeoKeys(Option<GeoKeyDirectory>);

impl GeoKeys {
    pub(super) fn read(image: &Ifd) -> Self {
        let doubles = numbers(image, GEO_DOUBLE_PARAMS);
        let texts = image.tag(GEO_ASCII_PARAMS);
        let texts = texts.and_then(|tag| tag.value.as_str()).unwrap_or_default();
        let directory = image.tag(GEO_KEY_DIRECTORY);
        let directory = directory.and_then(|tag| tag.value.as_u16_slice());
        Self(directory.and_then(|keys| GeoKeyDirectory::parse(keys, &doubles, texts)))
    }

    pub(super) fn code(&self, key: u16) -> Option<u16> {
        self.0.as_ref()?.get_short(key)
    }

    pub(super) fn number(&self, key: u16) -> Option<f64> {
        self.0.as_ref()?.get_double(key)?.first().copied()
    }

    /// Returns the first line of a text.
    pub(super) fn text(&self, key: u16) -> Option<&str> {
        let text = self.whole_text(key)?.split('|').next()?.trim();
        (!text.is_empty()).then_some(text)
    }

    /// Returns a text with its lines separated by bars.
    pub(super) fn whole_text(&self, key: u16) -> Option<&str> {
        let text = self.0.as_ref()?.get_ascii(key)?;
        Some(text.trim_matches(['\0', ' ']))
    }

    /// Returns the meaning of a sample: coordinates refer to the centres of points, and to the
    /// corners of areas.
    pub(super) fn raster_type(&self) -> Option<RasterType> {
        match self.code(GT_RASTER_TYPE)? {
            1 => Some(RasterType::Area),
            2 => Some(RasterType::Point),
            _ => None,
        }
    }

    /// Returns a code if it is EPSG's.
    pub(super) fn epsg_code(&self, key: u16) -> Option<u16> {
        const USER_DEFINED: u16 = 32767;
        self.code(key).filter(|code| *code != USER_DEFINED)
    }

    /// Returns the metres in the linear unit, if the file states it.
    pub(super) fn stated_metres(&self) -> Option<f64> {
        let named = self.code(PROJ_LINEAR_UNITS).and_then(metres_of_code);
        let metres = named.or(self.number(LINEAR_UNIT_SIZE));
        metres.filter(|metres| metres.is_finite() && *metres > 0.0)
    }

    /// Returns true for lengths on a map, false for angles.
    pub(super) fn is_projected(&self) -> Option<bool> {
        match self.code(GT_MODEL_TYPE) {
            Some(PROJECTED) => Some(true),
            Some(GEOGRAPHIC) => Some(false),
            _ if self.code(PROJECTED_CRS_TYPE).is_some() => Some(true),
            // A user-defined projected system on a geographic one.
            _ if self.code(PROJ_LINEAR_UNITS).is_some() => Some(true),
            _ if self.code(GEODETIC_CRS_TYPE).is_some() => Some(false),
            _ => None,
        }
    }

    /// Returns the unit of the ground coordinates, if the keys state it; otherwise it is the
    /// system's.
    pub(super) fn unit(&self) -> Option<GroundUnit> {
        match self.is_projected()? {
            true => {
                let metres = self.stated_metres();
                metres.map(|metres| GroundUnit::length(metres, Certainty::Stated))
            }
            false => self.stated_degrees().map(GroundUnit::angle),
        }
    }

    /// Returns the degrees in the angular unit; one if it is not stated.
    pub(super) fn degrees(&self) -> f64 {
        self.stated_degrees().unwrap_or(1.0)
    }

    pub(super) fn stated_degrees(&self) -> Option<f64> {
        Some(match self.code(GEOG_ANGULAR_UNITS)? {
            9101 => 1.0_f64.to_degrees(),
            9102 | 9122 => 1.0,
            9103 => 1.0 / 60.0,
            9104 => 1.0 / 3600.0,
            9105 | 9106 => 0.9,
            _ => return None,
        })
    }
}

/// Returns the numbers of a tag; empty if it is missing.
pub(super) fn numbers(image: &Ifd, tag: u16) -> Vec<f64> {
    let tag = image.tag(tag);
    tag.and_then(|tag| tag.value.as_f64_vec())
        .unwrap_or_default()
}

/// EPSG's units of length: code, metres.
const LENGTHS: [(u16, f64); 47] = [
    (1025, 0.001),
    (1033, 0.01),
    (9001, 1.0),
    (9002, 0.304_8),
    (9003, 1200.0 / 3937.0),
    (9005, 0.304_797_265_4),
    (9014, 1.828_8),
    (9030, 1_852.0),
    (9031, 1.000_013_596_5),
    (9033, 20.116_840_233_680_5),
    (9034, 0.201_168_402_336_805),
    (9035, 1_609.347_218_694_44),
    (9036, 1_000.0),
    (9037, 0.914_391_796_2),
    (9038, 20.116_619_516_4),
    (9039, 0.201_166_195_164),
    (9040, 0.914_398_414_616_029),
    (9041, 0.304_799_471_538_676),
    (9042, 20.116_765_121_552_6),
    (9043, 0.201_167_651_215_526),
    (9050, 0.914_399_2),
    (9051, 0.304_799_733_333_333),
    (9052, 20.116_782_4),
    (9053, 0.201_167_824),
    (9060, 0.914_399_204_289_812),
    (9061, 0.304_799_734_763_271),
    (9062, 20.116_782_494_375_9),
    (9063, 0.201_167_824_943_759),
    (9070, 0.304_800_833_333_333),
    (9080, 0.304_799_510_248_147),
    (9081, 0.304_798_41),
    (9082, 0.304_799_6),
    (9083, 0.304_799_5),
    (9084, 0.914_398_530_744_441),
    (9085, 0.914_395_23),
    (9086, 0.914_398_8),
    (9087, 0.914_398_5),
    (9093, 1_609.344),
    (9094, 0.304_799_710_181_509),
    (9095, 0.304_800_749_1),
    (9096, 0.914_4),
    (9097, 20.116_8),
    (9098, 0.201_168),
    (9099, 0.914_398),
    (9300, 0.304_799_333_333_333),
    (9301, 20.116_756),
    (9302, 0.201_167_56),
];

/// Returns the metres in a unit of length by its EPSG code.
pub(super) fn metres_of_code(code: u16) -> Option<f64> {
    let found = LENGTHS.iter().find(|(known, _)| *known == code);
    found.map(|(_, metres)| *metres)
}
