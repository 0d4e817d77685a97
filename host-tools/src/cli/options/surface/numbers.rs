//! The valid numbers of a surface, and their change by a table.

use std::path::Path;

use hapterra_core::contact::Friction;
use hapterra_core::force::{Damping, Material};

use super::table::MaterialEntry;
use super::texture;
use crate::cli::failure::Failure;

/// Returns a friction with another coefficient, also for static friction.
pub(super) fn with_coefficient(friction: &Friction, mu: f32) -> Friction {
    Friction {
        viscous_s: friction.viscous_s,
        ..Friction::coulomb(mu)
    }
}

/// Returns a material with a table's numbers in place of its own. A stated friction also sets the
/// static part.
pub(super) fn with_entry(
    material: &Material,
    entry: &MaterialEntry,
    (file, line, what): (&Path, usize, &str),
) -> Result<Material, Failure> {
    let before = &material.friction;
    let friction = Friction {
        dynamic_mu: entry.friction.unwrap_or(before.dynamic_mu),
        static_mu: entry
            .static_friction
            .or(entry.friction)
            .unwrap_or(before.static_mu),
        viscous_s: entry.viscous_friction.unwrap_or(before.viscous_s),
    };
    let made = texture::texture(entry, &material.texture).and_then(|texture| {
        let material = Material {
            stiffness_n_per_mm: entry.stiffness.unwrap_or(material.stiffness_n_per_mm),
            friction,
            damping_ns_per_m: entry.damping.unwrap_or(material.damping_ns_per_m),
            texture,
        };
        check(&material).map(|()| material)
    });
    made.map_err(|why| {
        let place = format!("{}, line {line}, {what}:", file.display());
        failure_of(&why).about(Some(&place))
    })
}

/// Checks that the numbers are valid for a surface; the message states the valid range.
pub(super) fn check(material: &Material) -> Result<(), String> {
    let Friction {
        static_mu,
        dynamic_mu,
        viscous_s,
    } = material.friction;
    if !material.friction.is_valid() {
        return Err(format!(
            "a friction of {dynamic_mu}, {static_mu} at rest, trailing by {viscous_s} s: friction from 0 to {}, static_friction not below it, viscous_friction from 0 to {} s",
            Friction::MAX,
            Friction::MAX_VISCOUS_S
        ));
    }
    let damping = Damping {
        ns_per_m: material.damping_ns_per_m,
        ..Damping::NONE
    };
    if !damping.is_valid() {
        let (damping, max) = (material.damping_ns_per_m, Damping::MAX_NS_PER_M);
        return Err(format!(
            "a damping of {damping} N·s/m: damping from 0 to {max} N·s/m"
        ));
    }
    let stiffness = material.stiffness_n_per_mm;
    let is_valid = material.is_valid();
    is_valid.then_some(()).ok_or_else(|| {
        format!(
            "a stiffness of {stiffness} N/mm: stiffness finite and not below 0, usually 0.5 N/mm"
        )
    })
}

/// Returns the failure with a message and a hint.
pub(super) fn failure_of(why: &str) -> Failure {
    let (what, next_step) = why
        .split_once(": ")
        .unwrap_or((why, "choose another number"));
    Failure::new(what.to_owned()).hint(next_step)
}
