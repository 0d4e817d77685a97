//! The run of a scene with all checks: the oracle for each tick, and the metamorphic tests.

use super::material_checks;
use super::metamorphic;
use super::run::{Metamorphic, Scene};
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
        let mut oracle = TickOracle::of(self);
        let observed = self.render(buffers, [0; 3], self.supply, |observed| {
            oracle.check(observed)
        })?;
        let mut random = Random::new(self.seed);
        let expected = |twin: usize| {
            matches!(self.metamorphic, Metamorphic::One(n) if n == twin)
                || self.metamorphic == Metamorphic::All
        };
        let mut metamorphic = [false; 4];
        if expected(0) {
            metamorphic[0] = metamorphic::repeated(self, &observed, buffers)?;
        }
        if expected(1) {
            metamorphic[1] = metamorphic::shifted(self, buffers, &mut random)?;
        }
        if expected(2) {
            metamorphic[2] = metamorphic::windowed(self, &observed, buffers, &mut random)?;
        }
        if expected(3) || expected(4) {
            metamorphic[3] = metamorphic::turned(self, buffers, &mut random)?;
        }
        oracle.measured.metamorphic = metamorphic.map(u64::from);
        if let Some(materials) = &self.materials {
            material_checks::run(self, materials, buffers, &mut oracle.measured)?;
        }
        Ok(oracle.measured)
    }
}
