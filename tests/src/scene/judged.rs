//! The run of a scene with every check: each tick under the judge, and the whole
//! beside its twins.

use super::on_materials;
use super::run::{Scene, Twins};
use super::supply::Buffers;
use super::twin;
use crate::chance::Chance;
use crate::invariants::Violation;
use crate::invariants::judge::{Judge, Measured};

impl Scene {
    /// Runs it under the judge, and beside it the twins it is compared with.
    ///
    /// # Errors
    /// The first violation.
    pub fn run(&self, buffers: &mut Buffers) -> Result<Measured, Violation> {
        let mut judge = Judge::of(self);
        let seen = self.step(buffers, [0; 3], self.supply, |seen| judge.look(seen))?;
        let mut chance = Chance::new(self.seed);
        let wanted = |twin: usize| {
            matches!(self.twins, Twins::One(n) if n == twin) || self.twins == Twins::All
        };
        let mut twins = [false; 4];
        if wanted(0) {
            twins[0] = twin::repeated(self, &seen, buffers)?;
        }
        if wanted(1) {
            twins[1] = twin::shifted(self, buffers, &mut chance)?;
        }
        if wanted(2) {
            twins[2] = twin::windowed(self, &seen, buffers, &mut chance)?;
        }
        if wanted(3) || wanted(4) {
            twins[3] = twin::turned(self, buffers, &mut chance)?;
        }
        judge.measured.twins = twins.map(u64::from);
        if let Some(materials) = &self.materials {
            on_materials::run(self, materials, buffers, &mut judge.measured)?;
        }
        Ok(judge.measured)
    }
}
