//! Options for the part of a terrain in front of the arm and its scale, shared by `run` and `demo`.

use hapterra_core::phantom::Calibration;

use super::rendering::Rendering;
use super::scale::MapScale;
use crate::cli::failure::Failure;
use crate::place::{
    CLEAR_RELIEF_MM, Coordinates, PlaceError, Placement, PlacementOptions, Reach, Target,
    coordinates_in_words, place_in_words,
};
use crate::terrain::{Distortion, HapticCells, HapticGrid, Terrain};
use heightfield::{Georeference, Raster};

/// Height of the relief at the device below which an exaggeration is suggested, mm.
const FLAT_MM: f64 = 4.0;

/// The part of the terrain to render. Without these options all of it is fitted to the workspace.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Place and scale")]
pub struct Placing {
    /// Place under the arm's home position
    ///
    /// At 1mm/cell, unless --scale is given.
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = numbers::<2>,
          conflicts_with = "bbox")]
    pub at: Option<[f64; 2]>,

    /// Part of the terrain to fit to the arm's workspace
    #[arg(long, value_name = "W,S,E,N", allow_hyphen_values = true, value_parser = numbers::<4>,
          conflicts_with = "scale")]
    pub bbox: Option<[f64; 4]>,

    /// Coordinates of --at and --bbox: file, lonlat or EPSG:N
    ///
    /// [default: file] file: x and y of the file's reference system (columns and rows from the south-west sample where
    /// it has none); lonlat: degrees of WGS 84, on another body its own; EPSG:N: x and y, east before
    /// north, of that reference system.
    #[arg(long, value_name = "CRS", value_parser = coordinates)]
    pub crs: Option<Coordinates>,
}

/// A grid and its requested placement.
pub(in crate::cli) struct TerrainRequest<'r> {
    pub(in crate::cli) grid: HapticGrid<'r>,
    options: PlacementOptions,
}

impl Placing {
    /// Checks the placement on a raster, before any device is opened.
    ///
    /// # Errors
    /// The place does not exist.
    pub(in crate::cli) fn of<'r>(
        &self,
        (rendering, cells): (&Rendering, HapticCells),
        raster: &'r Raster,
    ) -> Result<TerrainRequest<'r>, Failure> {
        let options = self.options(rendering);
        let grid = options.target.grid(raster, cells)?;
        // Any arm will do here: only the workspace depends on it.
        placement(&grid, &Calibration::PREMIUM_3_0, &options)?;
        Ok(TerrainRequest { grid, options })
    }

    fn options(&self, rendering: &Rendering) -> PlacementOptions {
        let coordinates = self.crs.unwrap_or(Coordinates::Own);
        let target = match (self.at, self.bbox) {
            (Some(at), _) => Target::At(at, coordinates),
            (None, Some(sides)) => Target::Box(sides, coordinates),
            (None, None) => Target::Whole,
        };
        PlacementOptions {
            target,
            sizing: MapScale::sizing(rendering.scale),
            heights: rendering.exaggeration.unwrap_or_default().into(),
            level: rendering.fixed_level(),
        }
    }
}

impl TerrainRequest<'_> {
    /// Returns the placement in front of an arm with a calibration.
    ///
    /// # Errors
    /// The arm cannot reach the heights.
    pub(in crate::cli) fn view(&self, arm: &Calibration) -> Result<Placement, Failure> {
        placement(&self.grid, arm, &self.options)
    }
}

/// Places a terrain in front of an arm. If heights cannot be read, returns the file's error.
fn placement(
    grid: &HapticGrid<'_>,
    arm: &Calibration,
    options: &PlacementOptions,
) -> Result<Placement, Failure> {
    let fault = match Placement::new(grid, &Reach::of(arm), options) {
        Err(fault @ PlaceError::Unread { .. }) => fault,
        placed => return Ok(placed?),
    };
    grid.raster().check_complete()?;
    Err(fault.into())
}

/// Returns the place and scale of a terrain, in lines that `run` and `demo` print.
pub(in crate::cli) fn describe(view: &Placement, terrain: &Terrain<'_>) -> String {
    let file = terrain.raster().georeference();
    let mut text = format!(
        "place          {} under the home position\nscale          {}\n",
        place_in_words(&file, view.home_ground),
        scale_in_words(view),
    );
    if let Some(worst) = view
        .worst_reached(terrain.grid())
        .filter(Distortion::is_noticeable)
    {
        let (off, place) = (off_in_words(&worst), place_in_words(&file, worst.ground));
        let remedy = match terrain.grid().is_distorted() {
            true => "--input cells=square renders them in their true shape",
            false => "pan there, or hold the clutch, and the cells are measured again",
        };
        text += &format!("shape          {off} where the arm reaches, at {place}; {remedy}\n");
    }
    let relief = view.heights_mm[1] - view.heights_mm[0];
    if relief > 0.0 && relief < FLAT_MM && view.exaggeration.is_some_and(|times| times == 1.0) {
        let times = (CLEAR_RELIEF_MM / relief).round();
        text += &format!(
            "relief         {relief:.2} mm in the hand; --exaggeration {times} makes it {:.0} mm\n",
            times * relief
        );
    }
    text
}

/// Describes the largest error of the haptic cells' shape.
pub(in crate::cli) fn off_in_words(worst: &Distortion) -> String {
    let percent = 100.0 * worst.share;
    format!("slopes and lengths are off by up to {percent:.2} %")
}

/// Describes the scale of a placement, and a cell of its level.
pub(in crate::cli) fn scale_in_words(view: &Placement) -> String {
    let (level, cell_mm) = (view.level, short(view.haptic_cell_mm()));
    match (view.ground_m_per_mm(), view.haptic_cell_m()) {
        (Some(scale), Some(cell_m)) => format!(
            "{} ground metres per device millimetre; at level {level} a cell is {} m, {cell_mm} mm at the device",
            short(scale),
            short(cell_m)
        ),
        _ => format!("at level {level} a cell is {cell_mm} mm at the device"),
    }
}

/// Returns scale and place in short lines for a picture: name and text.
pub(in crate::cli) fn picture_lines(
    view: &Placement,
    file: &Georeference<'_>,
) -> Vec<(String, String)> {
    let mut lines = vec![];
    if let Some(scale) = view.ground_m_per_mm() {
        lines.push(("1 mm in the hand".to_owned(), format!("{} m", short(scale))));
    }
    let cell_mm = short(view.haptic_cell_mm());
    lines.push(match view.haptic_cell_m() {
        Some(metres) => (
            format!("cell, level {}", view.level),
            format!("{} m, {cell_mm} mm", short(metres)),
        ),
        None => (
            format!("cell, level {}", view.level),
            format!("{cell_mm} mm"),
        ),
    });
    if let Some(times) = view.exaggeration {
        let text = match (times - 1.0).abs() < 1e-9 {
            true => "true to scale".to_owned(),
            false => format!("× {}", short(times)),
        };
        lines.push(("heights".to_owned(), text));
    }
    let home = coordinates_in_words(file, view.home_ground);
    lines.push(("home position".to_owned(), home));
    if let Some([longitude, latitude]) = file.to_lonlat(view.home_ground) {
        let text = format!("{longitude:.5}, {latitude:.5}");
        lines.push(("longitude, latitude".to_owned(), text));
    }
    lines
}

/// Formats a number with at most five digits.
pub(in crate::cli) fn short(value: f64) -> String {
    let decimals = (4.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0);
    let text = format!("{value:.*}", decimals as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Parses the name of a coordinate system.
fn coordinates(text: &str) -> Result<Coordinates, String> {
    let code = || {
        let prefix = text
            .get(..5)
            .filter(|it| it.eq_ignore_ascii_case("EPSG:"))?;
        text[prefix.len()..].parse().ok().map(Coordinates::Epsg)
    };
    match text {
        "file" => Ok(Coordinates::Own),
        "lonlat" => Ok(Coordinates::LonLat),
        _ => code().ok_or_else(|| "file, lonlat or EPSG:N, as EPSG:2056".into()),
    }
}

/// Parses `COUNT` finite numbers, separated by commas.
fn numbers<const COUNT: usize>(text: &str) -> Result<[f64; COUNT], String> {
    let parsed: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let numbers = parsed.ok().and_then(|numbers| numbers.try_into().ok());
    numbers
        .filter(|numbers: &[f64; COUNT]| numbers.iter().all(|number| number.is_finite()))
        .ok_or_else(|| format!("expected {COUNT} numbers between commas"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinate_systems_are_parsed() {
        assert_eq!(coordinates("file"), Ok(Coordinates::Own));
        assert_eq!(coordinates("lonlat"), Ok(Coordinates::LonLat));
        assert_eq!(coordinates("epsg:2056"), Ok(Coordinates::Epsg(2056)));
        for bad in [
            "",
            "wgs84",
            "EPSG:",
            "EPSG:x",
            "EPSG:70000",
            "2056",
            "°°°°°1",
        ] {
            assert!(coordinates(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn comma_separated_numbers_are_parsed() {
        assert_eq!(numbers("-72.5, 44"), Ok([-72.5, 44.0]));
        for bad in ["1", "1,2,3", "1;2", "1,", "inf,0", "nan,1", ""] {
            assert!(numbers::<2>(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lengths_are_printed_with_five_significant_digits() {
        for (value, text) in [
            (10.9, "10.9"),
            (0.123_456_7, "0.12346"),
            (1234.567, "1234.6"),
            (400_000.0, "400000"),
            (5.0, "5"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
