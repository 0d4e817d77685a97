//! A scene by its seed and number, and the run of it under the judge's eyes.

use hapterra_core::contact::{Contact, Felt, Pace, Rule};
use hapterra_core::grid::GridPoint;

use super::stage::{Buffers, SIDE, Stage, Supply};
use super::terrain::{KINDS, Terrain};
use super::{hand, twin};
use crate::chance::Chance;
use crate::field::point;
use crate::invariants::judge::{Judge, Measured};
use crate::invariants::seen::Seen;
use crate::invariants::{Invariant, Violation};

/// Ticks that one hand may be repeated for in lock-step.
const PATIENCE: usize = 20_000;

/// A terrain, a way of the hand, and the settings it is felt with.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What is felt.
    pub terrain: Terrain,
    /// The hand, cells.
    pub path: Vec<[f64; 3]>,
    /// The contact rule.
    pub rule: Rule,
    /// Whether a tick is repeated until it is done.
    pub pace: Pace,
    /// How the tiles come.
    pub supply: Supply,
    /// Which of the twins are run beside it.
    twins: Twins,
    seed: u64,
}

/// Which twins a scene is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Twins {
    /// One of them, or none: scenes of a soak are many.
    One(usize),
    /// Each.
    All,
}

impl Scene {
    /// The scene of that number among those of a seed.
    #[must_use]
    pub fn random(seed: u64, number: u64) -> Self {
        let mixed = seed ^ number.wrapping_mul(0xd134_2543_de82_ef95);
        let mut chance = Chance::new(mixed);
        let kind = KINDS[chance.below(KINDS.len())];
        // A hundred patches, or so many that the window cannot hold them all;
        // or a strip of thousands.
        let (size, supply) = match chance.below(4) {
            0 | 1 => ([70 + chance.below(60) as i32, 90], Supply::Held),
            2 => ([200, 256], Supply::Held),
            _ => {
                let latency = [0, 3, 40][chance.below(3)];
                let size = [[1500, 40], [130, 120], [520, 400]][chance.below(3)];
                (size, Supply::Pulled { latency })
            }
        };
        let terrain = Terrain::new(kind, size, chance.bits());
        let ticks = 300 + chance.below(500);
        let path = hand::walk(&terrain, &mut chance, ticks);
        // The paper's rule wants the whole way at once, and its ticks do not go on.
        let paper = chance.below(12) == 0 && supply == Supply::Held;
        let rule = if paper { Rule::Paper } else { Rule::Swept };
        let pace = if chance.below(2) == 0 {
            Pace::RealTime
        } else {
            Pace::LockStep
        };
        Self {
            terrain,
            path,
            rule,
            pace,
            supply,
            twins: Twins::One(if paper { 0 } else { chance.below(6) }),
            seed: chance.bits(),
        }
    }

    /// A scene of one's own, compared with every twin.
    #[must_use]
    pub const fn given(
        terrain: Terrain,
        path: Vec<[f64; 3]>,
        rule: Rule,
        pace: Pace,
        supply: Supply,
    ) -> Self {
        Self {
            terrain,
            path,
            rule,
            pace,
            supply,
            twins: Twins::All,
            seed: 1,
        }
    }

    /// Runs it with every check.
    ///
    /// # Errors
    /// The first violation.
    pub fn run(&self, buffers: &mut Buffers) -> Result<Measured, Violation> {
        let mut judge = Judge::new(&self.terrain, self.rule);
        let seen = self.feel(buffers, [0; 3], self.supply, |seen| judge.look(seen))?;
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
        Ok(judge.measured)
    }

    /// Runs it over the terrain shifted by so many cells, and lets `look` see
    /// each tick.
    ///
    /// # Errors
    /// What `look` says, or that a tick does not settle.
    pub fn feel(
        &self,
        buffers: &mut Buffers,
        shift: [i32; 3],
        supply: Supply,
        look: impl FnMut(&Seen) -> Result<(), Violation>,
    ) -> Result<Vec<Seen>, Violation> {
        self.feel_in::<SIDE>(buffers, shift, supply, look)
    }

    /// The same with a window of `D × D` tiles.
    ///
    /// # Errors
    /// As [`Self::feel`].
    pub fn feel_in<const D: usize>(
        &self,
        buffers: &mut Buffers,
        shift: [i32; 3],
        supply: Supply,
        mut look: impl FnMut(&Seen) -> Result<(), Violation>,
    ) -> Result<Vec<Seen>, Violation> {
        let mut player = Player::<D>::new(self, buffers, shift, supply);
        let mut all = Vec::with_capacity(self.path.len());
        for (tick, hip) in self.path.iter().enumerate() {
            let felt = player.feel(*hip).ok_or_else(|| Violation {
                invariant: Invariant::Settles,
                tick,
                detail: format!("never settles for {hip:?}"),
            })?;
            let seen = Seen::new(*hip, felt, shift);
            look(&seen)?;
            all.push(seen);
        }
        Ok(all)
    }

    /// The same settings over another terrain, with another way of the hand.
    #[must_use]
    pub fn with(&self, terrain: Terrain, path: Vec<[f64; 3]>) -> Self {
        Self {
            terrain,
            path,
            ..*self
        }
    }
}

/// A contact in a scene, tick by tick.
pub struct Player<'t, 'g, const D: usize> {
    /// Its state, for those who want to try a tick twice.
    pub contact: Contact,
    /// Where it feels.
    pub stage: Stage<'t, 'g, D>,
    rule: Rule,
    pace: Pace,
    shift: [i32; 3],
    now: u32,
}

impl<'t, 'g, const D: usize> Player<'t, 'g, D> {
    /// Before the first tick.
    pub fn new(
        scene: &'g Scene,
        buffers: &'t mut Buffers,
        shift: [i32; 3],
        supply: Supply,
    ) -> Self {
        Self {
            contact: Contact::new(),
            stage: Stage::new(buffers, &scene.terrain, shift, supply),
            rule: scene.rule,
            pace: scene.pace,
            shift,
            now: 0,
        }
    }

    /// One hand: one tick, or in lock-step as many as it takes. `None` when
    /// those do not end.
    pub fn feel(&mut self, hip: [f64; 3]) -> Option<Felt> {
        let hip = shifted(hip, self.shift);
        for _ in 0..PATIENCE {
            let felt = *self
                .contact
                .step(&self.stage.window, &hip, self.rule, self.pace);
            self.stage.supply(self.now, &self.contact, &felt, &hip);
            self.now += 1;
            if felt.settled || self.pace == Pace::RealTime {
                return Some(felt);
            }
        }
        None
    }
}

/// A position in cells, shifted by whole ones.
fn shifted(hip: [f64; 3], shift: [i32; 3]) -> GridPoint {
    let here = point(hip);
    let cell = here.cell();
    GridPoint::new([0, 1, 2].map(|i| cell[i] + shift[i]), here.frac())
}
