//! The settings of a recording as options.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::Setting;
use crate::cli::options::exaggeration::Exaggeration;
use crate::cli::options::rendering::Rendering;
use crate::cli::options::scale::MapScale;
use crate::cli::options::surface::SurfaceChoice;
use crate::quantity::{FORCE, LENGTH, STIFFNESS};
use crate::replay::Settings;
use crate::replay::settings::RenderedTerrain;
use crate::terrain::HapticCells;

/// Returns the options of a recording. If the user states a scale or another kind of cells, the
/// recorded proportions are kept.
pub(super) fn settings(
    path: &Path,
    recorded: &Settings,
    (scale, explicit_cells): (Option<MapScale>, Option<HapticCells>),
) -> Vec<Setting> {
    let RenderedTerrain {
        cells,
        level,
        cell_mm,
        tip_mm,
        measured_at,
        ..
    } = &recorded.rendered;
    let exaggeration = height(&recorded.rendered, scale, explicit_cells.unwrap_or(*cells));
    let max_force = FORCE.format(recorded.force.max_force_n);
    let mut options: Vec<(&str, OsString)> = vec![
        ("input", in_words(*cells).into()),
        ("scale", MapScale::CellMm(*cell_mm).to_string().into()),
        ("exaggeration", exaggeration.to_string().into()),
        ("level", level.to_string().into()),
        ("tip", LENGTH.format(tip_mm).into()),
        ("max-force", max_force.into()),
        ("surface", surface_file(path).into()),
    ];
    if let Some([x, y]) = measured_at {
        options.push(("at", format!("{x},{y}").into()));
    }
    if let Some(materials) = &recorded.materials {
        options.push(("materials", materials.file.clone().into()));
    }
    let setting = |(name, value): (&str, OsString)| Setting {
        name: name.to_owned(),
        values: vec![value],
        place: path.display().to_string(),
    };
    options.into_iter().map(setting).collect()
}

/// Returns the recorded height at the user's scale. For another kind of cells, whose size on the
/// ground differs, returns the factor that keeps the proportions.
fn height(rendered: &RenderedTerrain, scale: Option<MapScale>, cells: HapticCells) -> Exaggeration {
    let cell_mm = match scale {
        None => Some(rendered.cell_mm),
        Some(scale) => scale.cell_mm(rendered.cell_m),
    };
    match (rendered.exaggeration, cell_mm) {
        (Some(times), _) if cells != rendered.cells => Exaggeration::Times(times),
        (_, Some(cell_mm)) => Exaggeration::MmPerUnit(rendered.height_at_cell_mm(cell_mm)),
        (times, None) => Exaggeration::Times(times.unwrap_or(1.0)),
    }
}

/// Returns the path of the recording in a form that cannot be the name of a surface.
fn surface_file(path: &Path) -> PathBuf {
    match path.extension() {
        Some(_) => path.to_owned(),
        None => Path::new(".").join(path),
    }
}

/// Returns lines about the options that differ from a recording.
pub(in crate::cli) fn differences(
    rendering: &Rendering,
    cells: HapticCells,
    (path, recorded): (&Path, &Settings),
) -> Vec<String> {
    let (rendered, force, surface) = (&recorded.rendered, &recorded.force, &rendering.surface);
    let number = |name: &str, value: Option<f32>, recorded: f32, format: &dyn Fn(f32) -> String| {
        (
            name.to_owned(),
            format(value.unwrap_or(recorded)),
            format(recorded),
        )
    };
    let recorded_height = height(rendered, rendering.scale, cells);
    let exaggeration = rendering.exaggeration.unwrap_or(recorded_height);
    let recorded_height = match (exaggeration, rendered.exaggeration) {
        (Exaggeration::MmPerUnit(_), _) => recorded_height.to_string(),
        (_, Some(times)) => times.to_string(),
        (_, None) => "an unknown one".to_owned(),
    };
    let scale = MapScale::CellMm(rendered.cell_mm);
    let stated_scale = rendering.scale.unwrap_or(scale);
    let level = rendering.fixed_level().unwrap_or(rendered.level);
    let tip_mm = rendering.tip.unwrap_or(rendered.tip_mm);
    let materials = recorded.materials.as_ref().map(|it| it.file.clone().into());
    let shown = |file: &Option<PathBuf>| {
        let file = file.as_ref().map(|file| file.display().to_string());
        file.unwrap_or_else(|| "none".to_owned())
    };
    let own = "its own".to_owned();
    let lines = [
        (
            "input".into(),
            in_words(cells).into(),
            in_words(rendered.cells).into(),
        ),
        ("scale".into(), stated_scale.to_string(), scale.to_string()),
        (
            "exaggeration".into(),
            exaggeration.to_string(),
            recorded_height,
        ),
        (
            "level".into(),
            level.to_string(),
            rendered.level.to_string(),
        ),
        (
            "tip".into(),
            LENGTH.format(tip_mm),
            LENGTH.format(rendered.tip_mm),
        ),
        (
            "surface".into(),
            surface_in_words(surface.surface.as_ref(), path),
            own,
        ),
        number(
            "stiffness",
            surface.stiffness,
            force.stiffness_n_per_mm,
            &|it| STIFFNESS.format(it),
        ),
        number(
            "friction",
            surface.friction,
            force.friction.dynamic_mu,
            &|it| it.to_string(),
        ),
        number("max-force", surface.max_force, force.max_force_n, &|it| {
            FORCE.format(it)
        }),
        (
            "materials".into(),
            shown(&surface.materials),
            shown(&materials),
        ),
    ];
    let lines = lines
        .into_iter()
        .filter(|(_, given, recorded)| given != recorded);
    let line = |(name, given, recorded): (String, String, String)| {
        format!("--{name} {given}, where the recording has {recorded}")
    };
    lines.map(line).collect()
}

fn in_words(cells: HapticCells) -> &'static str {
    match cells {
        HapticCells::Stored => "cells=stored",
        HapticCells::Square => "cells=square",
    }
}

/// Describes the requested surface; the recording itself means its own surface.
fn surface_in_words(surface: Option<&SurfaceChoice>, recording: &Path) -> String {
    match surface {
        Some(SurfaceChoice::Named(named)) => named.name.to_owned(),
        Some(SurfaceChoice::File(file)) if *file != surface_file(recording) => {
            file.display().to_string()
        }
        Some(SurfaceChoice::File(_)) | None => "its own".to_owned(),
    }
}
