//! Parts of the application on the emulated board.

use hapterra_firmware::native::VirtualAmplifiersOff;

use crate::{plant, time};

/// Tiles along the side of the window.
pub(crate) const WINDOW: usize = 16;

pub(crate) type Encoders = plant::PlantEncoders;
/// The plant receives the currents of a tick through its encoders.
pub(crate) type Amplifiers = VirtualAmplifiersOff;
pub(crate) type Clock = time::Clock;
