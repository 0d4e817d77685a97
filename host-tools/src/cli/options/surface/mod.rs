//! Options for the surface of a terrain, shared by `replay`, `run`, `demo` and `view`.

mod material_entry;
mod numbers;
pub mod table;
mod texture;

use std::path::{Path, PathBuf};

use clap::ValueHint;
use clap::builder::{PathBufValueParser, TypedValueParser};
use hapterra_core::force::{Controller, Damping, Material, Shading, SurfaceParams};

use super::recording::settings_of;
use super::terrain_file::ReadingOptions;
use crate::cli::failure::{Failure, Hint, OrHint};
use crate::materials::{ClassMaterial, ClassMaterials, Materials};
use crate::named_surfaces::{NAMED_SURFACES, NamedSurface};
use crate::place::MAX_STIFFNESS_N_PER_MM;
use crate::quantity::{FORCE, STIFFNESS};
use heightfield::{Raster, files_read_with};
use numbers::{check, failure_of, with_coefficient, with_entry};
use table::{MaterialEntry, PassivityName, ShadingName, TableFile};

/// Surface of a terrain.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Surface")]
pub struct SurfaceOptions {
    /// Surface: ice, sand, rock, or a file
    ///
    /// [default: ice] ice: 0.5 N/mm without friction. sand: 0.4 N/mm, friction 0.5, damping 2 Ns/m, grain of 0.1 mm
    /// every 1.5 mm. rock: 0.8 N/mm, friction 0.4 and 0.6 at rest, grain of 0.05 mm every 0.8 mm.
    /// FILE.toml: stiffness, friction, static_friction, viscous_friction, damping, texture ("grain" or
    /// "grating") and its texture_amplitude, texture_wavelength, texture_direction and texture_seed
    /// under `[default]`, and under `[class.N]` for each class of --materials; shading = "smooth" and
    /// passivity = "off" at its top. A recording: the surface that was recorded.
    #[arg(long, value_name = "NAME|FILE", value_hint = ValueHint::FilePath, value_parser = choice())]
    pub surface: Option<SurfaceChoice>,

    /// Stiffness, such as 0.5N/mm [default: the surface's]
    #[arg(long, value_name = "N/MM", value_parser = |text: &str| STIFFNESS.read_single(text),
          allow_negative_numbers = true)]
    pub stiffness: Option<f32>,

    /// Friction: tangential over normal force [default: the surface's]
    #[arg(long, value_name = "MU", allow_negative_numbers = true)]
    pub friction: Option<f32>,

    /// Largest force, such as 8N [default: 8.5N]
    #[arg(long, value_name = "N", value_parser = |text: &str| FORCE.read_single(text),
          allow_negative_numbers = true)]
    pub max_force: Option<f32>,

    /// Raster of ground classes; the file of --surface has a surface for each
    ///
    /// As land cover: in a grid and a reference system of its own.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub materials: Option<PathBuf>,
}

/// A named surface, or the file of one.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceChoice {
    /// A named surface.
    Named(&'static NamedSurface),
    /// A table, a settings file with one, or a recording.
    File(PathBuf),
}

/// Returns the parser of a surface's name or file.
pub fn choice() -> impl TypedValueParser<Value = SurfaceChoice> {
    PathBufValueParser::new().try_map(|path| {
        let named = path.to_str().and_then(NamedSurface::find);
        let is_file = path.extension().is_some() || path.components().count() > 1;
        match named {
            Some(named) => Ok(SurfaceChoice::Named(named)),
            None if is_file => Ok(SurfaceChoice::File(path)),
            None => {
                let names: Vec<_> = NAMED_SURFACES.iter().map(|known| known.name).collect();
                let names = names.join(", ");
                Err(format!("a surface is {names}, a FILE.toml, or a recording"))
            }
        }
    })
}

/// A surface with all its numbers.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The scene's surface parameters; the default class if the ground has classes.
    pub params: SurfaceParams,
    /// The classes of the ground, if any.
    class_materials: Option<ClassMaterials>,
}

impl SurfaceOptions {
    /// Returns the input files, none of which may be an output.
    pub(in crate::cli) fn inputs(&self) -> Vec<PathBuf> {
        let mut inputs = self.materials.as_deref().map_or(vec![], files_read_with);
        if let Some(SurfaceChoice::File(file)) = &self.surface {
            inputs.push(file.clone());
        }
        inputs
    }

    /// Reads the surface. `--stiffness` and `--friction` replace its own numbers.
    ///
    /// # Errors
    /// The file has no surface, or a number is invalid for a surface.
    pub fn load(&self) -> Result<Surface, Failure> {
        let mut surface = match &self.surface {
            None => Surface::of(&SurfaceParams::PREMIUM),
            Some(SurfaceChoice::Named(named)) => {
                Surface::of(&named.material.params(&SurfaceParams::PREMIUM))
            }
            Some(SurfaceChoice::File(file)) if file.extension().is_some_and(|it| it == "toml") => {
                self.of_table(file)?
            }
            Some(SurfaceChoice::File(file)) => self.of_recording(file)?,
        };
        let params = &mut surface.params;
        if let Some(stiffness) = self.stiffness {
            params.stiffness_n_per_mm = stiffness;
        }
        if let Some(mu) = self.friction {
            params.friction = with_coefficient(&params.friction, mu);
        }
        if let Some(force) = self.max_force {
            params.max_force_n = force;
        }
        check(&Material::of(params)).map_err(|why| failure_of(&why))?;
        let limit = params.max_force_n;
        if !(limit.is_finite() && limit >= 0.0) {
            return Err(format!("a largest force of {limit} N is not valid"))
                .or_hint("--max-force finite and not below 0; 8.5 N without it");
        }
        Ok(surface)
    }

    /// Returns the surface of a recording, with its classes.
    fn of_recording(&self, file: &Path) -> Result<Surface, Failure> {
        let Some(settings) = settings_of(file)? else {
            return Err(format!("{} is no recording, and no .toml", file.display()))
                .or_hint("name a recording, or a surface in a FILE.toml, with --surface");
        };
        let class_materials = settings
            .materials
            .as_ref()
            .map(|it| it.class_materials.clone());
        if self.friction.is_some() && class_materials.is_some() {
            return Err("--friction: each of the recorded materials has its own")
                .or_hint("leave it out, or name a table that states it with --surface");
        }
        let params = settings.params();
        Ok(Surface {
            params,
            class_materials,
        })
    }

    /// Returns the surface of a table: the options replace numbers of its default, and the classes
    /// replace both.
    fn of_table(&self, file: &Path) -> Result<Surface, Failure> {
        let table = TableFile::open(file)?;
        let (line, entry) = &table.default;
        let of_classes = table.classes.iter().map(|(_, line, entry)| (*line, entry));
        for (line, entry) in std::iter::once((*line, entry)).chain(of_classes) {
            self.check_stiffness(entry, (file, line))?;
        }
        let material = Material::of(&SurfaceParams::PREMIUM);
        let mut default = with_entry(&material, entry, (file, *line, "the default"))?;
        if let Some(stiffness) = self.stiffness {
            default.stiffness_n_per_mm = stiffness;
        }
        if let Some(mu) = self.friction {
            default.friction = with_coefficient(&default.friction, mu);
        }
        if default.stiffness_n_per_mm == 0.0 {
            return Err("[default] has no stiffness, and a placement scales all stiffnesses by it")
                .or_hint("state stiffness in [default]");
        }
        let classes = table.classes.iter().map(|(class, line, entry)| {
            let what = format!("class {class}");
            Ok(ClassMaterial {
                class: *class,
                name: entry.name.clone(),
                material: with_entry(&default, entry, (file, *line, &what))?,
            })
        });
        let class = classes.collect::<Result<_, Failure>>()?;
        let scene = SurfaceParams {
            shading: match table.shading {
                ShadingName::None => Shading::None,
                ShadingName::Smooth => Shading::Smooth,
            },
            damping: Damping {
                controller: match table.passivity {
                    PassivityName::On => Controller::On,
                    PassivityName::Off => Controller::Off,
                },
                ..Damping::NONE
            },
            ..SurfaceParams::PREMIUM
        };
        Ok(Surface {
            params: default.params(&scene),
            class_materials: Some(ClassMaterials { default, class }),
        })
    }

    /// Checks that a table, which may be from an untrusted source, has no more stiffness than keys
    /// or the command line allow.
    fn check_stiffness(
        &self,
        entry: &MaterialEntry,
        (file, line): (&Path, usize),
    ) -> Result<(), Failure> {
        let max = MAX_STIFFNESS_N_PER_MM.max(self.stiffness.unwrap_or(0.0));
        let Some(stiffness) = entry.stiffness.filter(|stiffness| *stiffness > max) else {
            return Ok(());
        };
        let place = format!("{}, line {line}:", file.display());
        Err(Failure::new(format!(
            "a stiffness of {stiffness} N/mm: a table may state {max} N/mm at most"
        ))
        .hint(format!(
            "if you trust the table, add --stiffness {stiffness}"
        ))
        .about(Some(&place)))
    }
}

impl Surface {
    /// Returns a uniform surface.
    const fn of(params: &SurfaceParams) -> Self {
        Self {
            params: *params,
            class_materials: None,
        }
    }

    /// Returns a terrain's materials: the classes of the options' file, with this surface's
    /// entries.
    ///
    /// # Errors
    /// The file of classes or its place is invalid; there are no classes for a file, or no file for
    /// classes.
    pub(in crate::cli) fn materials(
        &self,
        options: &SurfaceOptions,
        terrain: (&str, &Raster),
        reading: &ReadingOptions,
    ) -> Result<Option<Materials>, Failure> {
        let has_classes = |class_materials: &&ClassMaterials| !class_materials.class.is_empty();
        let (file, class_materials) = match (&options.materials, &self.class_materials) {
            (None, class_materials)
                if class_materials.as_ref().is_some_and(|it| has_classes(&it)) =>
            {
                return Err("the surface lists several classes, but no class raster is given")
                    .or_hint("name the raster with --materials");
            }
            (None, _) => return Ok(None),
            (Some(_), None) => {
                return Err("--materials without surfaces for its classes")
                    .or_hint("name a table with --surface FILE.toml; docs/worldcover.toml is one");
            }
            (Some(file), Some(class_materials)) => (file, class_materials.clone()),
        };
        let classes = Raster::open(file, &reading.of_classes()?).map_err(of_classes)?;
        let name = file.display().to_string();
        Ok(Some(Materials::over(
            terrain,
            (&name, classes),
            class_materials,
        )?))
    }
}

/// Returns the failure of a file of classes. Hints for heights interpolate between values, which is
/// invalid for classes.
fn of_classes(error: heightfield::Error) -> Failure {
    let hint = error.hint().replace("-r bilinear", "-r near");
    let hint = hint.replace("-r average", "-r mode");
    let hint = hint.replace(" -ot Float32", "");
    Failure::new(error).hint(hint)
}

#[cfg(test)]
mod tests;
