//! Options that say what the ground is made of, where that is not the same everywhere; shared by
//! `replay`, `run` and `demo`.

use std::path::{Path, PathBuf};

use clap::ValueHint;
use hapterra_core::force::{ForceLaw, Material};

use super::rendering::Rendering;
use super::terrain_file::ReadingOptions;
use super::texture::{SurfacePattern, SurfaceTexture};
use crate::cli::failure::{Failure, Hint, OrHint};
use crate::materials::table::{Look, TableFile, TextureName};
use crate::materials::{ClassMaterial, Looks, Materials};
use crate::place::STIFFEST_N_PER_MM;
use crate::replay::settings::MaterialSettings;
use heightfield::{Raster, files_read_with};

/// What the ground is made of.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct SurfaceMaterials {
    /// Raster of classes of the ground, as land cover: any that overlaps the terrain, in its own
    /// grid and reference system [default: one material everywhere]
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub materials: Option<PathBuf>,

    /// What each class feels like: TOML, as docs/worldcover.toml
    #[arg(long, value_name = "TABLE.toml", value_hint = ValueHint::FilePath)]
    pub material_table: Option<PathBuf>,
}

impl SurfaceMaterials {
    /// The files that are read: no output may be one of them.
    pub(in crate::cli) fn inputs(&self) -> Vec<PathBuf> {
        let mut inputs = self.materials.as_deref().map_or(vec![], files_read_with);
        inputs.extend(self.material_table.clone());
        inputs
    }

    /// The materials of a terrain, where some are asked for, or a recording has some. The rest of
    /// the options says what a table does not.
    ///
    /// # Errors
    /// What is wrong with the file of classes, the table, or their places.
    pub(in crate::cli) fn over(
        &self,
        terrain: (&str, &Raster),
        (rendering, reading): (&Rendering, &ReadingOptions),
        recorded: Option<&MaterialSettings>,
    ) -> Result<Option<Materials>, Failure> {
        let file = self.materials.clone();
        let Some(file) = file.or_else(|| recorded.map(|recorded| recorded.file.clone().into()))
        else {
            return match self.material_table {
                None => Ok(None),
                Some(_) => Err("--material-table without a raster of classes")
                    .or_hint("name one with --materials, or leave the table out"),
            };
        };
        let looks = match (&self.material_table, recorded) {
            (Some(table), _) => looks(table, rendering)?,
            (None, Some(recorded)) => recorded.looks.clone(),
            (None, None) => {
                return Err("--materials without what its classes feel like")
                    .or_hint("name a table with --material-table; docs/worldcover.toml is one");
            }
        };
        let classes = Raster::open(&file, &reading.of_classes()).map_err(of_classes)?;
        let name = file.display().to_string();
        Ok(Some(Materials::over(terrain, (&name, classes), looks)?))
    }

    /// The law of a scene with these materials: over the default. What a recording says of its
    /// stiffness, or an option beside it, makes all of them stiffer or softer.
    pub(in crate::cli) fn law(&self, materials: Option<&Materials>, law: ForceLaw) -> ForceLaw {
        let Some(materials) = materials else {
            return law;
        };
        let of_default = materials.law(&law);
        match self.material_table {
            Some(_) => of_default,
            None => ForceLaw {
                stiffness_n_per_mm: law.stiffness_n_per_mm,
                ..of_default
            },
        }
    }
}

impl Rendering {
    /// The first option given that a table of materials states for each of them.
    pub(in crate::cli) fn stated_of_ground(&self) -> Option<&'static str> {
        let texture = &self.texture;
        [
            ("--friction", self.friction.is_some()),
            ("--static-friction", self.static_friction.is_some()),
            ("--viscous-friction", self.viscous_friction.is_some()),
            ("--damping-ns-per-m", self.damping_ns_per_m.is_some()),
            ("--texture", texture.texture.is_some()),
            ("--texture-amplitude", texture.texture_amplitude.is_some()),
            ("--texture-wavelength", texture.texture_wavelength.is_some()),
            ("--texture-direction", texture.texture_direction.is_some()),
            ("--texture-seed", texture.texture_seed.is_some()),
        ]
        .into_iter()
        .find_map(|(option, is_given)| is_given.then_some(option))
    }
}

/// What went wrong with a file of classes: hints for heights work out numbers between those of the
/// file, and of classes there are none.
fn of_classes(error: heightfield::Error) -> Failure {
    let hint = error.hint().replace("-r bilinear", "-r near");
    let hint = hint.replace("-r average", "-r mode");
    let hint = hint.replace(" -ot Float32", "");
    Failure::new(error).hint(hint)
}

/// What a table says, with what the options say besides.
fn looks(file: &Path, rendering: &Rendering) -> Result<Looks, Failure> {
    let table = TableFile::open(file)?;
    let (line, default) = &table.default;
    let of_classes = table.classes.iter().map(|(_, line, look)| (*line, look));
    for (line, look) in std::iter::once((*line, default)).chain(of_classes) {
        check_stiffness(look, rendering, (file, line))?;
    }
    let default = over(rendering, default);
    let material = material(&default, (file, *line, "the default"))?;
    if material.stiffness_n_per_mm == 0.0 {
        return Err("a default without stiffness: views make all materials as much stiffer as it")
            .or_hint("state stiffness_n_per_mm in [default]");
    }
    let classes = table.classes.iter().map(|(class, line, look)| {
        let what = format!("class {class}");
        Ok(ClassMaterial {
            class: *class,
            name: look.name.clone(),
            material: self::material(&over(&default, look), (file, *line, &what))?,
        })
    });
    let class = classes.collect::<Result<_, Failure>>()?;
    Ok(Looks {
        default: material,
        class,
    })
}

/// Checks that a table, which may be a stranger's, asks for no more stiffness than keys may, or
/// than the command line does.
fn check_stiffness(
    look: &Look,
    rendering: &Rendering,
    (file, line): (&Path, usize),
) -> Result<(), Failure> {
    let most = STIFFEST_N_PER_MM.max(rendering.stiffness_n_per_mm.unwrap_or(0.0));
    let Some(stiffness) = look.stiffness_n_per_mm.filter(|asked| *asked > most) else {
        return Ok(());
    };
    let place = format!("{}, line {line}:", file.display());
    Err(Failure::new(format!(
        "a stiffness of {stiffness} N/mm: a table may ask for {most} N/mm at most"
    ))
    .hint(format!(
        "if you trust the table, say --stiffness-n-per-mm {stiffness}"
    ))
    .about(Some(&place)))
}

/// What these options make of a surface.
fn material(
    rendering: &Rendering,
    (file, line, what): (&Path, usize, &str),
) -> Result<Material, Failure> {
    let place = format!("{}, line {line}, {what}:", file.display());
    let law = rendering.law();
    law.map(|law| Material::of(&law))
        .map_err(|failure| failure.about(Some(&place)))
}

/// Options with what a table states in their place. A friction brings its own static part, and a
/// texture its own numbers, as on the command line.
fn over(rendering: &Rendering, look: &Look) -> Rendering {
    let static_friction = match look.friction {
        Some(_) => look.static_friction,
        None => look.static_friction.or(rendering.static_friction),
    };
    Rendering {
        stiffness_n_per_mm: look.stiffness_n_per_mm.or(rendering.stiffness_n_per_mm),
        friction: look.friction.or(rendering.friction),
        static_friction,
        viscous_friction: look.viscous_friction.or(rendering.viscous_friction),
        damping_ns_per_m: look.damping_ns_per_m.or(rendering.damping_ns_per_m),
        texture: texture_over(&rendering.texture, look),
        ..rendering.clone()
    }
}

fn texture_over(texture: &SurfaceTexture, look: &Look) -> SurfaceTexture {
    let nothing = SurfaceTexture::default();
    let before = match look.texture {
        Some(_) => &nothing,
        None => texture,
    };
    let pattern = look.texture.map(|texture| match texture {
        TextureName::None => SurfacePattern::None,
        TextureName::Grain => SurfacePattern::Grain,
        TextureName::Grating => SurfacePattern::Grating,
    });
    SurfaceTexture {
        texture: pattern.or(before.texture),
        texture_amplitude: look.texture_amplitude.or(before.texture_amplitude),
        texture_wavelength: look.texture_wavelength.or(before.texture_wavelength),
        texture_direction: look.texture_direction.or(before.texture_direction),
        texture_seed: look.texture_seed.or(before.texture_seed),
    }
}

#[cfg(test)]
mod tests {
    use hapterra_core::contact::Friction;
    use hapterra_core::force::Pattern;

    use super::*;

    fn read(text: &str, rendering: &Rendering) -> Result<Looks, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("table.toml");
        std::fs::write(&file, text).expect("written");
        looks(&file, rendering).map_err(|failure| failure.text())
    }

    #[test]
    fn what_a_class_does_not_state_is_the_defaults_and_then_the_options() {
        let rendering = Rendering {
            stiffness_n_per_mm: Some(0.7),
            friction: Some(0.2),
            static_friction: Some(0.9),
            ..Rendering::default()
        };
        let text = "[default]\ntexture = \"grating\"\ntexture_direction = 20\n[class.3]\nfriction = 0.5\ntexture = \"grain\"\n[class.2]\nstiffness_n_per_mm = 0.9\n";
        let looks = read(text, &rendering).expect("a table");
        assert_eq!(looks.default.stiffness_n_per_mm, 0.7);
        assert_eq!(looks.default.friction.static_mu, 0.9);
        let [two, three] = &looks.class[..] else {
            panic!("{looks:?}");
        };
        assert_eq!((two.class, three.class), (2, 3));
        assert_eq!(two.material.stiffness_n_per_mm, 0.9);
        assert_eq!(two.material.texture, looks.default.texture);
        assert_eq!(three.material.stiffness_n_per_mm, 0.7);
        assert_eq!(three.material.friction, Friction::coulomb(0.5));
        assert_eq!(three.material.texture.pattern, Pattern::Grain);
    }

    #[test]
    fn what_no_surface_has_is_told_with_its_class_and_line() {
        let usual = Rendering::default();
        for (text, wanted) in [
            (
                "\n[class.7]\nfriction = -1\n",
                "line 2, class 7: a friction of -1",
            ),
            (
                "[default]\nstiffness_n_per_mm = nan",
                "line 1, the default: a stiffness",
            ),
            (
                "[default]\nstiffness_n_per_mm = 0",
                "a default without stiffness",
            ),
            (
                "[class.7]\ndamping_ns_per_m = 21",
                "line 1, class 7: a damping of 21",
            ),
            (
                "[class.7]\ntexture_amplitude = 0.1",
                "class 7: --texture-amplitude of no texture",
            ),
        ] {
            let why = read(text, &usual).expect_err(text);
            assert!(why.contains(wanted) && why.contains("hint: "), "{why}");
        }
        let paper = Rendering {
            contact: Some(crate::replay::settings::Rule::Paper),
            ..usual
        };
        assert!(read("[class.1]\nfriction = 0.3", &paper).is_err());
    }

    #[test]
    fn table_asks_for_no_more_stiffness_than_the_command_line() {
        let usual = Rendering::default();
        let stiff = Rendering {
            stiffness_n_per_mm: Some(3.0),
            ..Rendering::default()
        };
        for (text, told, allowed) in [
            (
                "[default]\nstiffness_n_per_mm = 3",
                "line 1: a stiffness of 3",
                true,
            ),
            (
                "[class.1]\nstiffness_n_per_mm = 1.1",
                "a stiffness of 1.1",
                true,
            ),
            ("[class.1]\nstiffness_n_per_mm = 1e30", "at most", false),
        ] {
            let why = read(text, &usual).expect_err(text);
            assert!(why.contains(told) && why.contains("--stiffness"), "{why}");
            assert_eq!(read(text, &stiff).is_ok(), allowed, "{text}");
        }
    }

    #[test]
    fn no_hint_makes_classes_of_those_between_them() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, cell) in [("a.asc", 10.0), ("b.asc", 17.0)] {
            let header = format!("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize {cell}\n");
            let text = header + "10 80 10\n80 10 80\n";
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        let error = Raster::open(folder.path(), &Default::default()).expect_err("two grids");
        let told = of_classes(error).text();
        assert!(told.contains("gdalwarp -r near -dstnodata"), "{told}");
    }

    #[test]
    fn one_of_the_two_files_alone_is_refused_with_what_to_do() {
        let terrain = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
        let reading = <ReadingOptions as clap::FromArgMatches>::from_arg_matches(
            &<ReadingOptions as clap::Args>::augment_args(clap::Command::new("t"))
                .get_matches_from(["t"]),
        );
        let (rendering, reading) = (Rendering::default(), reading.expect("by default"));
        let with = |materials: Option<&str>, table: Option<&str>| {
            let options = SurfaceMaterials {
                materials: materials.map(Into::into),
                material_table: table.map(Into::into),
            };
            let over = options.over(("t.tif", &terrain), (&rendering, &reading), None);
            over.map(|materials| materials.is_some())
                .map_err(|failure| failure.text())
        };
        assert_eq!(with(None, None), Ok(false));
        for (materials, table, wanted) in [
            (Some("c.tif"), None, "--material-table"),
            (None, Some("t.toml"), "--materials"),
            (Some("c.tif"), Some("no/t.toml"), "no/t.toml"),
        ] {
            let why = with(materials, table).expect_err("one alone");
            assert!(why.contains(wanted) && why.contains("hint: "), "{why}");
        }
    }
}
