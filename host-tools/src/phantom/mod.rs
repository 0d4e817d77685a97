//! The virtual Phantom and the hand that holds it.
//!
//! The model computes the motion of a real arm between two ticks of the haptic loop, in f64 and
//! independently of the code under test: its inputs are motor currents, its outputs encoder counts.
//! Read it in the direction of the data flow:
//!
//! ```text
//! currents ─ amplifier ─ motor torque ─┐
//!                                      ├─ dynamics + friction ─ joints ─ encoder ─ counts
//! script ─ target ─ hand ─ tip force ──┘            (plant)
//! ```
//!
//! [`HeldPhantom`] contains all of it: the arm ([`Plant`]), the hand on it ([`Hand`]) and the
//! hand's plan ([`Script`], which [`Touch`] and [`TourPlan`] create). [`PlacedTerrain`] puts a
//! terrain in front of that arm.
//!
//! Nothing here reads a clock or draws a random number, and the trigonometry
//! is `libm`'s, so the same inputs result in the same bits on every machine.
//!
//! # Frames
//! - *Device frame*, metres: origin where the joint axes meet, z up, x away
//!   from the base towards the user, right-handed: for the user, who faces the
//!   device, y points to the right.
//! - *Terrain frame*, device millimetres: x east, y north, z up. [`ArmFrame`] maps one to the
//!   other.

mod amplifier;
mod arm_frame;
mod dynamics;
mod encoder;
mod friction;
mod hand;
mod held_phantom;
pub mod kinematics;
mod model;
mod motor;
mod placed_terrain;
mod plant;
mod script;
mod touch;
mod tour;
mod wiring;

pub use amplifier::{Amplifier, AmplifierFault};
pub use arm_frame::{ArmFrame, OutOfReach};
pub use dynamics::Dynamics;
pub use encoder::Encoder;
pub use hand::{Hand, HandModel};
pub use held_phantom::HeldPhantom;
pub use model::{AxisDrive, JointLimits, Lumped, Motor, PhantomModel, STANDARD_GRAVITY};
pub use motor::MotorTemperature;
pub use placed_terrain::{PlacedTerrain, PlacingError};
pub use plant::{MAX_SUBSTEP_S, Plant};
pub use script::{Script, Target};
pub use touch::{Surface, Touch};
pub use tour::{Tour, TourPlan};
pub use wiring::Wiring;
