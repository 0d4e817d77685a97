//! A table's entry for one material, with units.

use serde::{Deserialize, Deserializer};

use crate::quantity::{ANGLE, DAMPING, LENGTH, STIFFNESS, TIME, Units};

/// A table's entry for one material; fields not stated are `None`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MaterialEntry {
    /// Name of the material.
    pub name: Option<String>,
    /// Stiffness, N/mm.
    #[serde(deserialize_with = "stiffness")]
    pub stiffness: Option<f32>,
    /// Coefficient of sliding friction.
    pub friction: Option<f32>,
    /// Coefficient of static friction.
    pub static_friction: Option<f32>,
    /// Viscous friction, proportional to the speed: the time by which the tip lags, s.
    #[serde(deserialize_with = "time")]
    pub viscous_friction: Option<f32>,
    /// Damping along the force, N·s/m.
    #[serde(deserialize_with = "damping")]
    pub damping: Option<f32>,
    /// The micro-relief.
    pub texture: Option<TextureName>,
    /// Height of the micro-relief above and below the surface, mm.
    #[serde(deserialize_with = "length")]
    pub texture_amplitude: Option<f32>,
    /// Distance between ridges, mm.
    #[serde(deserialize_with = "length")]
    pub texture_wavelength: Option<f32>,
    /// Direction across the ridges of a grating, degrees from east to north.
    #[serde(deserialize_with = "angle")]
    pub texture_direction: Option<f32>,
    /// Selects one of many similar textures.
    pub texture_seed: Option<u32>,
}

/// Name of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TextureName {
    /// No texture.
    None,
    /// Random heights.
    Grain,
    /// Parallel ridges.
    Grating,
}

/// Shading of the force across the edges of patches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShadingName {
    /// The force follows the patches' normals.
    #[default]
    None,
    /// The force's direction changes gradually.
    Smooth,
}

/// The passivity controller, on or off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PassivityName {
    /// On while a current may flow.
    #[default]
    On,
    /// Always off.
    Off,
}

/// A number, or a text with a unit.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a number, or a text with a number and its unit")]
enum Quantity {
    Number(f32),
    Text(String),
}

fn quantity<'de, D: Deserializer<'de>>(from: D, units: &Units) -> Result<Option<f32>, D::Error> {
    match Quantity::deserialize(from)? {
        Quantity::Number(number) => Ok(Some(number)),
        Quantity::Text(text) => units
            .read_single(&text)
            .map(Some)
            .map_err(serde::de::Error::custom),
    }
}

fn stiffness<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f32>, D::Error> {
    quantity(from, &STIFFNESS)
}

fn time<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f32>, D::Error> {
    quantity(from, &TIME)
}

fn damping<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f32>, D::Error> {
    quantity(from, &DAMPING)
}

fn length<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f32>, D::Error> {
    quantity(from, &LENGTH)
}

fn angle<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f32>, D::Error> {
    quantity(from, &ANGLE)
}
