//! Settings of a recording in place of options that were not given.

use std::fmt::Debug;

use hapterra_core::contact::Friction;
use hapterra_core::force::{Controller, Shading};

use super::exaggeration::Exaggeration;
use super::rendering::{ForceShading, PassivityController, Rendering};
use crate::replay::Settings;

impl Rendering {
    /// These options, and where one is missing what a recording says. Options win; the
    /// lines say which did against the recording.
    ///
    /// A size in the hand of one's own keeps the recorded proportions, unless those are
    /// stated, too.
    #[must_use]
    pub fn or_recorded(&self, settings: &Settings) -> (Self, Vec<String>) {
        let (felt, force) = (&settings.felt, &settings.force);
        let mut told = Vec::new();
        let cells = merged("cells", self.cells, felt.cells, &mut told);
        let cell_mm = merged("cell-mm", self.cell_mm, felt.cell_mm, &mut told);
        let mut rendering = Self {
            cell_mm: Some(cell_mm),
            cells: Some(cells),
            level: Some(merged("level", self.level, felt.level, &mut told)),
            tip: Some(merged("tip", self.tip, felt.tip_mm, &mut told)),
            stiffness_n_per_mm: Some(merged(
                "stiffness-n-per-mm",
                self.stiffness_n_per_mm,
                force.stiffness_n_per_mm,
                &mut told,
            )),
            max_force_n: Some(merged(
                "max-force-n",
                self.max_force_n,
                force.max_force_n,
                &mut told,
            )),
            friction: Some(merged(
                "friction",
                self.friction,
                force.friction.dynamic_mu,
                &mut told,
            )),
            static_friction: self.recorded_static_friction(&force.friction, &mut told),
            viscous_friction: Some(merged(
                "viscous-friction",
                self.viscous_friction,
                force.friction.viscous_s,
                &mut told,
            )),
            damping_ns_per_m: Some(merged(
                "damping-ns-per-m",
                self.damping_ns_per_m,
                force.damping.ns_per_m,
                &mut told,
            )),
            passivity: Some(merged(
                "passivity",
                self.passivity,
                controller(force.damping.controller),
                &mut told,
            )),
            shading: Some(merged(
                "shading",
                self.shading,
                shading(force.shading),
                &mut told,
            )),
            texture: self.texture.or_recorded(&force.texture, &mut told),
            contact: Some(merged("contact", self.contact, force.rule, &mut told)),
            ..self.clone()
        };
        match (self.height_mm_per_unit, self.exaggeration) {
            (Some(height), _) if height != felt.height_mm_per_unit => {
                told.push(line(
                    "height-mm-per-unit",
                    &height,
                    &felt.height_mm_per_unit,
                ));
            }
            (None, Some(exaggeration)) => told.extend(differs(exaggeration, felt.exaggeration)),
            (Some(_), _) => {}
            // Other cells have another size on the ground: the proportions are kept by
            // the factor.
            (None, None) if cells != felt.cells && felt.exaggeration.is_some() => {
                rendering.exaggeration = felt.exaggeration.map(Exaggeration::Times);
            }
            (None, None) => rendering.height_mm_per_unit = Some(felt.height_at_cell_mm(cell_mm)),
        }
        (rendering, told)
    }
}

impl Rendering {
    /// Static friction follows a stated dynamic one, as it does without a recording.
    fn recorded_static_friction(&self, recorded: &Friction, told: &mut Vec<String>) -> Option<f32> {
        match (self.static_friction, self.friction) {
            (None, Some(_)) => None,
            (stated, _) => Some(merged("static-friction", stated, recorded.static_mu, told)),
        }
    }
}

pub(super) fn merged<T: PartialEq + Debug + Copy>(
    name: &str,
    given: Option<T>,
    recorded: T,
    told: &mut Vec<String>,
) -> T {
    if let Some(given) = given.filter(|given| *given != recorded) {
        told.push(line(name, &given, &recorded));
    }
    given.unwrap_or(recorded)
}

fn differs(given: Exaggeration, recorded: Option<f64>) -> Option<String> {
    let recorded = recorded.map_or("an unknown one".into(), |times| times.to_string());
    match given {
        Exaggeration::Times(times) if times.to_string() == recorded => None,
        Exaggeration::Times(times) => Some(told("exaggeration", &times.to_string(), &recorded)),
        Exaggeration::Auto => Some(told("exaggeration", "auto", &recorded)),
    }
}

fn line(name: &str, given: &impl Debug, recorded: &impl Debug) -> String {
    let [given, recorded] = [format!("{given:?}"), format!("{recorded:?}")];
    told(name, &given.to_lowercase(), &recorded.to_lowercase())
}

fn told(name: &str, given: &str, recorded: &str) -> String {
    format!("--{name} {given}, where the recording has {recorded}")
}

const fn controller(controller: Controller) -> PassivityController {
    match controller {
        Controller::On => PassivityController::On,
        Controller::Off => PassivityController::Off,
    }
}

const fn shading(shading: Shading) -> ForceShading {
    match shading {
        Shading::None => ForceShading::None,
        Shading::Smooth => ForceShading::Smooth,
    }
}
#[cfg(test)]
mod tests {
    use hapterra_core::force::{Damping, ForceLaw, Pattern, Texture};

    use super::super::texture::{SurfacePattern, SurfaceTexture};
    use super::*;
    use crate::replay::Rule;
    use crate::replay::settings::Device;
    use crate::terrain::{FeltCells, Scale, Terrain};
    use heightfield::Raster;

    fn recorded() -> Settings {
        let raster = Raster::from_fn(9, 9, |x, _| x as f32).expect("raster");
        let scale = Scale::new(2.0, 6.0).expect("valid");
        let terrain = Terrain::new(&raster, scale, 1).expect("terrain");
        let law = ForceLaw {
            stiffness_n_per_mm: 0.3,
            max_force_n: 4.0,
            ..ForceLaw::PREMIUM
        };
        let device = Device {
            board: "native".into(),
            firmware: String::new(),
            tick_hz: 1000,
        };
        Settings::new("t.tif", &terrain, (law, Rule::Paper), None, device)
    }

    #[test]
    fn what_is_not_stated_is_as_recorded() {
        let (rendering, told) = Rendering::default().or_recorded(&recorded());
        assert_eq!(told, [""; 0]);
        assert_eq!(
            (rendering.cell_mm, rendering.height_mm_per_unit),
            (Some(2.0), Some(6.0))
        );
        assert_eq!(
            (rendering.level, rendering.max_force_n),
            (Some(1), Some(4.0))
        );
        assert_eq!(rendering.rule(), Rule::Paper);
    }

    #[test]
    fn damping_is_as_recorded_and_what_is_stated_wins() {
        let mut recorded = recorded();
        recorded.force.rule = Rule::Swept;
        recorded.force.damping = Damping {
            ns_per_m: 2.5,
            controller: Controller::Off,
        };
        let (rendering, told) = Rendering::default().or_recorded(&recorded);
        assert_eq!(told, [""; 0]);
        let law = rendering.law().expect("valid");
        assert_eq!(law.damping, recorded.force.damping);
        let stated = Rendering {
            damping_ns_per_m: Some(0.0),
            passivity: Some(PassivityController::Auto),
            ..Rendering::default()
        };
        let (rendering, told) = stated.or_recorded(&recorded);
        assert_eq!(rendering.law().expect("valid").damping, Damping::NONE);
        assert_eq!(told.len(), 2, "{told:?}");
        let text = recorded.to_toml();
        assert!(
            text.contains("[force.damping]\nns_per_m = 2.5\ncontroller = \"off\""),
            "{text}"
        );
        assert_eq!(Settings::from_toml(&text).expect("read"), Some(recorded));
    }

    #[test]
    fn shading_is_as_recorded_and_what_is_stated_wins() {
        let mut recorded = recorded();
        recorded.force.rule = Rule::Swept;
        recorded.force.shading = Shading::Smooth;
        let (rendering, told) = Rendering::default().or_recorded(&recorded);
        assert_eq!(told, [""; 0]);
        assert_eq!(rendering.law().expect("valid").shading, Shading::Smooth);
        let stated = Rendering {
            shading: Some(ForceShading::None),
            ..Rendering::default()
        };
        let (rendering, told) = stated.or_recorded(&recorded);
        assert_eq!(told, ["--shading none, where the recording has smooth"]);
        assert_eq!(rendering.law().expect("valid").shading, Shading::None);
        let text = recorded.to_toml();
        assert!(text.contains("\nshading = \"smooth\"\n"), "{text}");
        assert_eq!(Settings::from_toml(&text).expect("read"), Some(recorded));
    }

    #[test]
    fn texture_is_as_recorded_and_what_is_stated_wins() {
        let mut recorded = recorded();
        let grating = Texture {
            pattern: Pattern::Grating,
            amplitude_mm: 0.1,
            wavelength_mm: 1.5,
            direction_deg: 30.0,
            seed: 4,
        };
        recorded.force.rule = Rule::Swept;
        recorded.force.texture = grating;
        let with = |change: fn(&mut SurfaceTexture)| {
            let mut rendering = Rendering::default();
            change(&mut rendering.texture);
            let (rendering, told) = rendering.or_recorded(&recorded);
            (rendering.law().map(|law| law.texture).ok(), told)
        };
        assert_eq!(with(|_| ()), (Some(grating), vec![]));
        let (texture, told) = with(|stated| stated.texture_amplitude = Some(0.15));
        let amplitude_mm = 0.15;
        assert_eq!(
            texture,
            Some(Texture {
                amplitude_mm,
                ..grating
            })
        );
        assert_eq!(
            told,
            ["--texture-amplitude 0.15, where the recording has 0.1"]
        );
        let (texture, told) = with(|stated| stated.texture = Some(SurfacePattern::None));
        assert_eq!(texture, Some(Texture::NONE));
        assert_eq!(told, ["--texture none, where the recording has grating"]);
        let (texture, told) = with(|stated| stated.texture = Some(SurfacePattern::Grain));
        let (pattern, direction_deg) = (Pattern::Grain, 0.0);
        let grain = Texture {
            pattern,
            direction_deg,
            ..grating
        };
        assert_eq!((texture, told.len()), (Some(grain), 1));
        let text = recorded.to_toml();
        assert!(
            text.contains("[force.texture]\npattern = \"grating\"\n"),
            "{text}"
        );
        assert_eq!(Settings::from_toml(&text).expect("read"), Some(recorded));
    }

    #[test]
    fn friction_is_as_recorded_and_a_stated_one_brings_its_own_static_part() {
        let mut recorded = recorded();
        recorded.force.rule = Rule::Swept;
        recorded.force.friction = Friction {
            static_mu: 0.5,
            dynamic_mu: 0.3,
            viscous_s: 0.01,
        };
        let (rendering, told) = Rendering::default().or_recorded(&recorded);
        assert_eq!(told, [""; 0]);
        let law = rendering.law().expect("valid");
        assert_eq!(law.friction, recorded.force.friction);
        let stated = Rendering {
            friction: Some(0.7),
            ..Rendering::default()
        };
        let (rendering, told) = stated.or_recorded(&recorded);
        assert_eq!(told, ["--friction 0.7, where the recording has 0.3"]);
        let friction = rendering.law().expect("valid").friction;
        let rough = Friction {
            viscous_s: 0.01,
            ..Friction::coulomb(0.7)
        };
        assert_eq!(friction, rough);
    }

    #[test]
    fn what_is_stated_wins_and_is_told_where_it_differs() {
        let stated = Rendering {
            cell_mm: Some(1.0),
            level: Some(1),
            stiffness_n_per_mm: Some(0.5),
            ..Rendering::default()
        };
        let (rendering, told) = stated.or_recorded(&recorded());
        assert_eq!(told.len(), 2, "{told:?}");
        assert_eq!(told[0], "--cell-mm 1.0, where the recording has 2.0");
        assert!(told[1].starts_with("--stiffness-n-per-mm 0.5"), "{told:?}");
        // Half as large, and half as high.
        assert_eq!(rendering.height_mm_per_unit, Some(3.0));
    }

    #[test]
    fn other_cells_keep_the_exaggeration_and_a_stated_one_wins() {
        let stated = Rendering {
            cells: Some(FeltCells::Stored),
            ..Rendering::default()
        };
        let (rendering, told) = stated.or_recorded(&recorded());
        assert_eq!(told, ["--cells stored, where the recording has square"]);
        assert_eq!(rendering.exaggeration, Some(Exaggeration::Times(3.0)));
        let stated = Rendering {
            exaggeration: Some(Exaggeration::Times(2.0)),
            ..Rendering::default()
        };
        let (rendering, told) = stated.or_recorded(&recorded());
        assert_eq!(rendering.height_mm_per_unit, None);
        assert_eq!(told, ["--exaggeration 2, where the recording has 3"]);
    }
}
