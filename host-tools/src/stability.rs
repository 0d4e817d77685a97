//! Stiffness limits from trials on the virtual arm, and the warnings about a surface above them.
//!
//! `hapterra-lab stability` runs the trials; its tests check these tables.

use hapterra_core::force::{MaterialTable, SurfaceParams, Texture};
use hapterra_core::rate::TickRate;
use hapterra_core::wire::hello::DeviceHello;

/// Stiffness up to which a press in a light grasp is stable, N/mm: ticks a second, without and with
/// the passivity controller.
pub type StiffnessLimits = [(u32, f32, f32); 4];

/// Limits at [`SHORT_US`]. The tests repeat the trials.
pub const STABLE_N_PER_MM: StiffnessLimits = [
    (1_000, 2.0, 6.0),
    (2_000, 3.0, 8.0),
    (4_000, 4.0, 8.0),
    (10_000, 4.0, 8.0),
];

/// Limits at [`LONG_US`].
pub const STABLE_N_PER_MM_LONG: StiffnessLimits = [
    (1_000, 1.0, 3.0),
    (2_000, 1.0, 3.0),
    (4_000, 1.0, 3.0),
    (10_000, 1.5, 3.0),
];

/// Stiffness up to which the force ramps up well on an arm with a tenth of the model's friction,
/// with the controller, N/mm (`Entered::is_good` of the trials), by ticks a second: in the ramp,
/// and while the clutch closes. The tests repeat the trials.
pub const RAMP_UP_N_PER_MM: [(u32, f32); 4] =
    [(1_000, 1.0), (2_000, 2.0), (4_000, 2.0), (10_000, 2.0)];

/// Limits at [`LONG_US`].
pub const RAMP_UP_N_PER_MM_LONG: [(u32, f32); 4] =
    [(1_000, 1.0), (2_000, 1.0), (4_000, 1.0), (10_000, 0.5)];

/// Latencies of the trials, µs: of boards whose converters command the amplifiers, and of boards
/// with duty cycles. Each is at least the latency that such a board reports; a test of the images
/// checks this.
pub const SHORT_US: u16 = 310;
/// See [`SHORT_US`].
pub const LONG_US: u16 = 1_240;

/// Factor for a textured surface at [`SHORT_US`]: its steepest slopes also excite a light grasp.
pub const TEXTURE_FACTOR: f32 = 0.5;
/// Factor for a textured surface at [`LONG_US`].
pub const TEXTURE_FACTOR_LONG: f32 = 1.0 / 3.0;

/// Warns of a surface that is too stiff for a device's tick rate and latency.
pub fn warn(params: &SurfaceParams, device: &DeviceHello) {
    let (rate, latency_us) = (TickRate::new(device.tick_hz), device.latency_us);
    let warnings = rate.map(|rate| {
        [
            warning(params, rate, latency_us),
            fine_texture_warning(&params.texture, rate),
        ]
    });
    for warning in warnings.into_iter().flatten().flatten() {
        tracing::warn!("{warning}");
    }
}

/// As [`warn`], for a surface of several materials, once for each warning. The device sets its
/// controller for the stiffest of them.
pub fn warn_for_materials(
    params: &SurfaceParams,
    materials: Option<&MaterialTable>,
    device: &DeviceHello,
) {
    let Some(table) = materials else {
        return warn(params, device);
    };
    for warning in warnings_of(params, table, device.tick_hz, device.latency_us) {
        tracing::warn!("{warning}");
    }
}

fn warnings_of(
    params: &SurfaceParams,
    table: &MaterialTable,
    tick_hz: u32,
    latency_us: u16,
) -> Vec<String> {
    let mut reported = Vec::new();
    let Some(rate) = TickRate::new(tick_hz) else {
        return reported;
    };
    let scale = table.stiffness_scale(params);
    for material in table.materials() {
        let mut params = material.params(params);
        params.stiffness_n_per_mm *= scale;
        let warnings = [
            warning(&params, rate, latency_us),
            fine_texture_warning(&params.texture, rate),
        ];
        reported.extend(warnings.into_iter().flatten());
    }
    reported.sort();
    reported.dedup();
    reported
}

/// Returns the warning about a texture too fine for a slow hand.
fn fine_texture_warning(texture: &Texture, rate: TickRate) -> Option<String> {
    let (wavelength, shortest) = (texture.wavelength_mm, Texture::shortest_mm(rate));
    let hz = rate.hz();
    let whole_mm_s = wavelength * hz as f32 / 8.0;
    (!texture.is_none() && wavelength < shortest).then(|| {
        format!(
            "a texture with a wavelength of {wavelength} mm: at {hz} ticks a second it fades from {whole_mm_s:.0} mm/s on, and is zero at twice that; from {shortest} mm on it is rendered in full for a slow hand"
        )
    })
}

/// Returns the warning about a surface at a device's rate and latency; `None` if it is within the
/// limits of the trials.
#[must_use]
fn warning(params: &SurfaceParams, rate: TickRate, latency_us: u16) -> Option<String> {
    let (stiffness, hz) = (params.stiffness_n_per_mm, rate.hz());
    let latency_s = 1e-6 * f32::from(latency_us);
    let is_controlled = params.is_controlled();
    let with = if is_controlled { "with" } else { "without" };
    let still = stable_n_per_mm(rate, latency_us, is_controlled, &params.texture);
    let late = match latency_us > SHORT_US {
        true => format!(" and {:.2} ms to the motors", 1e3 * latency_s),
        false => String::new(),
    };
    if stiffness > still {
        let shakes = match params.texture.is_none() {
            true => "is unstable",
            false => "may be unstable on a texture",
        };
        return Some(format!(
            "a stiffness of {stiffness} N/mm: on the virtual arm a light grasp {shakes} above {still} N/mm at {hz} ticks a second{late}, {with} the passivity controller (hapterra-lab stability)"
        ));
    }
    let enters = ramp_up_n_per_mm(rate, latency_us);
    (stiffness > enters).then(|| {
        format!(
            "a stiffness of {stiffness} N/mm: on a virtual arm with a tenth of a Premium 1.5's friction the tip vibrates above {enters} N/mm at {hz} ticks a second{late}, in the ramp or after the clutch (hapterra-lab stability)"
        )
    })
}

/// As [`stable_n_per_mm`], for a force that ramps up.
fn ramp_up_n_per_mm(rate: TickRate, latency_us: u16) -> f32 {
    let tried = match latency_us > SHORT_US {
        true => RAMP_UP_N_PER_MM_LONG,
        false => RAMP_UP_N_PER_MM,
    };
    let slower = tried.iter().rev().find(|(hz, _)| *hz <= rate.hz());
    slower.unwrap_or(&tried[0]).1
}

/// Returns the limit from the trials at the fastest rate that is not faster, and at the latency
/// that is not shorter.
fn stable_n_per_mm(rate: TickRate, latency_us: u16, is_controlled: bool, texture: &Texture) -> f32 {
    let (tried, left) = match latency_us > SHORT_US {
        true => (STABLE_N_PER_MM_LONG, TEXTURE_FACTOR_LONG),
        false => (STABLE_N_PER_MM, TEXTURE_FACTOR),
    };
    let slower = tried.iter().rev().find(|(hz, ..)| *hz <= rate.hz());
    let (_, without, with) = slower.unwrap_or(&tried[0]);
    let even = if is_controlled { *with } else { *without };
    match texture.is_none() {
        true => even,
        false => left * even,
    }
}

#[cfg(test)]
mod tests {
    use hapterra_core::force::{Controller, Damping, Material, Pattern};

    use super::*;

    fn reported(stiffness_n_per_mm: f32, hz: u32, controller: Controller) -> String {
        reported_late(stiffness_n_per_mm, hz, SHORT_US, controller)
    }

    fn reported_late(
        stiffness_n_per_mm: f32,
        hz: u32,
        latency_us: u16,
        controller: Controller,
    ) -> String {
        let params = SurfaceParams {
            stiffness_n_per_mm,
            damping: Damping {
                controller,
                ..Damping::NONE
            },
            ..SurfaceParams::PREMIUM
        };
        let rate = TickRate::new(hz).expect("a rate");
        warning(&params, rate, latency_us).unwrap_or_default()
    }

    #[test]
    fn warnings_name_the_stiffest_and_finest_materials() {
        let soft = Material::of(&SurfaceParams::PREMIUM);
        let stiff = Material {
            stiffness_n_per_mm: 8.0,
            ..soft
        };
        let fine = Material {
            texture: Texture {
                pattern: Pattern::Grain,
                amplitude_mm: 0.03,
                wavelength_mm: 0.3,
                ..Texture::NONE
            },
            ..soft
        };
        let reported = |materials: &[Material], params: &SurfaceParams| {
            let table = MaterialTable::new(materials).expect("some");
            warnings_of(params, &table, 1000, SHORT_US).join("; ")
        };
        let params = SurfaceParams::PREMIUM;
        assert_eq!(reported(&[soft, soft], &params), "");
        let both = reported(&[soft, stiff, fine, stiff], &params);
        assert_eq!(both.matches("a stiffness of 8 N/mm").count(), 1, "{both}");
        assert!(both.contains("wavelength of 0.3 mm"));
        // A scene of twice the stiffness doubles that of each material.
        let twice = SurfaceParams {
            stiffness_n_per_mm: 1.0,
            ..params
        };
        assert!(reported(&[soft, stiff], &twice).contains("a stiffness of 16 N/mm"));
    }

    #[test]
    fn too_fine_texture_has_a_warning() {
        let reported = |wavelength_mm, hz| {
            let texture = Texture {
                pattern: Pattern::Grain,
                wavelength_mm,
                ..Texture::NONE
            };
            fine_texture_warning(&texture, TickRate::new(hz).expect("a rate")).unwrap_or_default()
        };
        let fine = reported(0.3, 1000);
        assert!(
            fine.contains("from 38 mm/s on") && fine.contains("from 0.4 mm on"),
            "{fine}"
        );
        assert_eq!(
            [reported(0.3, 2000), reported(0.4, 1000)],
            [String::new(), String::new()]
        );
        assert_eq!(
            fine_texture_warning(&Texture::NONE, TickRate::DEFAULT),
            None
        );
    }

    #[test]
    fn textured_surface_has_half_the_stiffness_limit() {
        let reported = |stiffness_n_per_mm| {
            let params = SurfaceParams {
                stiffness_n_per_mm,
                texture: Texture {
                    pattern: Pattern::Grain,
                    amplitude_mm: 0.1,
                    wavelength_mm: 1.0,
                    ..Texture::NONE
                },
                ..SurfaceParams::PREMIUM
            };
            warning(&params, TickRate::DEFAULT, SHORT_US).unwrap_or_default()
        };
        assert_eq!(reported(1.0), "");
        let shakes = reported(3.1);
        assert!(
            shakes.contains("may be unstable on a texture above 3 N/mm"),
            "{shakes}"
        );
        assert!(!reported(3.0).contains("shake"));
    }

    #[test]
    fn stiffness_warning_depends_on_the_rate() {
        for (stiffness, hz) in [(0.5, 1000), (1.0, 1000), (2.0, 2000), (2.0, 10_000)] {
            assert_eq!(reported(stiffness, hz, Controller::On), "", "{hz}");
        }
        let trembles = reported(1.5, 1000, Controller::On);
        assert!(
            trembles.contains("the tip vibrates above 1 N/mm"),
            "{trembles}"
        );
        let shakes = |stiffness, hz, controller| {
            reported(stiffness, hz, controller).contains("a light grasp is unstable above")
        };
        assert!(shakes(3.5, 1000, Controller::Off) && !shakes(3.5, 1000, Controller::On));
        assert!(shakes(6.5, 1000, Controller::On) && !shakes(6.5, 3000, Controller::On));
        assert!(shakes(3.5, 3000, Controller::Off) && !shakes(3.5, 4000, Controller::Off));
    }

    #[test]
    fn stiffness_warning_depends_on_the_latency() {
        let trembles = reported_late(1.5, 1000, 1231, Controller::On);
        assert!(
            trembles.contains("above 1 N/mm at 1000 ticks a second and 1.23 ms to the motors"),
            "{trembles}"
        );
        let shakes = |stiffness, controller| {
            reported_late(stiffness, 1000, 1231, controller)
                .contains("a light grasp is unstable above")
        };
        assert!(shakes(1.5, Controller::Off) && !shakes(1.5, Controller::On));
        assert!(shakes(4.0, Controller::On) && !shakes(3.0, Controller::On));
        // Stable without the latency.
        assert!(!reported_late(4.0, 1000, SHORT_US, Controller::On).contains("unstable"));
    }
}
