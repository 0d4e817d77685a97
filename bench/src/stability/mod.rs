//! Largest stable stiffness of a surface: the tick of the boards in a closed loop with a virtual
//! Premium 1.5 and a person's hand, over stiffness, tick rate and grasp.
//!
//! - [`grasp`]: models of the hand at the tip;
//! - `contact_loop`: the tick and the arm, step by step;
//! - [`setting`]: rate, surface, grasp and delay of a trial;
//! - `surface_work`: the energy that the surface adds;
//! - [`tap`]: taps at a stated speed;
//! - [`trial`]: results of a press and of taps: limit cycle, and energy from the surface;
//! - [`entry`]: presses while the force ramps up;
//! - [`bounds`]: stiffness that is passive in theory;
//! - [`map`]: many trials, and their table;
//! - `limits`: the limits that follow, as a table;
//! - [`picture`]: the table as a picture.
//!
//! Friction of the surface is left out: it reduces limit cycles. The warnings of `hapterra run` use
//! the results: [`hapterra::stability`].

pub mod bounds;
mod contact_loop;
pub mod entry;
pub mod grasp;
mod limits;
pub mod map;
pub mod picture;
pub mod setting;
mod surface_work;
pub mod tap;
pub mod trial;

#[cfg(test)]
mod tests;
