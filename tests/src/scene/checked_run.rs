//! The run of a scene with all checks: the oracle for each tick, and the metamorphic tests.

use super::material_checks;
use super::metamorphic;
use super::run::{Scene, Twins};
use super::tile_supply::Buffers;
use crate::invariants::Violation;
use crate::invariants::oracle::{Measured, TickOracle};
use crate::random::Random;

impl Scene {
    /// Runs the scene under the oracle, then its metamorphic tests.
    ///
    /// # Errors
    /// The first violation.
    pub fn run(&self, buffers: &mut Buffers) -> Result<Measured, Violation> {
        let mut judge = TickOracle::of(self);
        let seen = self.step(buffers, [0; 3], self.supply, |seen| judge.look(seen))?;
        let mut random = Random::new(self.seed);
        let wanted = |twin: usize| {
            matches!(self.twins, Twins::One(n) if n == twin) || self.twins == Twins::All
        };
        let mut twins = [false; 4];
        if wanted(0) {
            twins[0] = metamorphic::repeated(self, &seen, buffers)?;
        }
        if wanted(1) {
            twins[1] = metamorphic::shifted(self, buffers, &mut random)?;
        }
        if wanted(2) {
            twins[2] = metamorphic::windowed(self, &seen, buffers, &mut random)?;
        }
        if wanted(3) || wanted(4) {
            twins[3] = metamorphic::turned(self, buffers, &mut random)?;
        }
        judge.measured.twins = twins.map(u64::from);
        if let Some(materials) = &self.materials {
            material_checks::run(self, materials, buffers, &mut judge.measured)?;
        }
        Ok(judge.measured)
    }
}
