//! Detection of a limit cycle: the tip moves to and fro faster than a hand can.

use hapterra_core::Vec3;

/// Least distance of a reversal, mm; below it is an encoder's count or two, or the hand's tremor.
const MIN_SWING_MM: f32 = 0.3;
/// Most reversals in the window. Tremor of 11.2 Hz reverses six times in 0.25 s.
pub const MAX_TURNS: usize = 10;
const TICKS: u32 = 250;

/// Tracks the tip along the force.
#[derive(Clone, Debug, Default)]
pub struct Swing {
    place_mm: f32,
    /// The farthest point since the last reversal, and the direction.
    extreme_mm: f32,
    is_outward: bool,
    turns: std::collections::VecDeque<u32>,
}

impl Swing {
    /// Adds a tick's motion along a unit vector. Returns the reversals in the last quarter of a
    /// second.
    pub fn turns(&mut self, tick: u32, moved_mm: Vec3, along: Vec3) -> usize {
        self.place_mm += moved_mm.dot(along);
        let back_mm = match self.is_outward {
            true => self.extreme_mm - self.place_mm,
            false => self.place_mm - self.extreme_mm,
        };
        if back_mm <= 0.0 {
            self.extreme_mm = self.place_mm;
        } else if back_mm > MIN_SWING_MM {
            self.is_outward = !self.is_outward;
            self.extreme_mm = self.place_mm;
            self.turns.push_back(tick);
        }
        while { self.turns.front() }.is_some_and(|turn| tick.wrapping_sub(*turn) > TICKS) {
            self.turns.pop_front();
        }
        self.turns.len()
    }
}
