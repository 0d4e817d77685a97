//! Counts of a stress test up to now.

use std::collections::BTreeMap;
use std::fmt;

use hapterra_core::contact::WORK_PER_TICK;

use crate::invariants::material::MaterialCounts;
use crate::invariants::oracle::Measured;
use crate::scene::terrain::{KINDS, Kind};

/// Outcome of one scene.
#[derive(Clone, Debug)]
pub enum SceneOutcome {
    /// No violation.
    Passed(Kind, Measured),
    /// A violation: the invariant, and its details.
    Violated(Kind, String, String),
}

/// A scene with a violation.
#[derive(Clone, Debug)]
pub struct FailedScene {
    /// Its number.
    pub number: u64,
    /// Its terrain.
    pub kind: Kind,
    /// Name of the invariant; `Panic` for a panic.
    pub invariant: String,
    /// Its details.
    pub what: String,
}

/// The largest work of a tick, and its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaxWork {
    /// Work units.
    pub units: u32,
    /// The number of the tick's scene.
    pub number: u64,
}

/// All scenes up to now.
#[derive(Clone, Debug, Default)]
pub struct LinkStats {
    /// Scenes run.
    pub scenes: u64,
    /// Violations.
    pub failed: Vec<FailedScene>,
    /// The tick with the most work, among the scenes without violations.
    pub max_work: Option<MaxWork>,
    by_kind: BTreeMap<usize, Measured>,
    by_invariant: BTreeMap<String, u64>,
}

impl LinkStats {
    /// Adds one scene.
    pub fn add(&mut self, number: u64, found: SceneOutcome) {
        self.scenes += 1;
        match found {
            SceneOutcome::Violated(kind, invariant, what) => {
                let which = format!("{invariant} on {kind:?}");
                *self.by_invariant.entry(which).or_default() += 1;
                self.failed.push(FailedScene {
                    number,
                    kind,
                    invariant,
                    what,
                });
            }
            SceneOutcome::Passed(kind, measured) => {
                let row = KINDS.iter().position(|k| *k == kind).unwrap_or(0);
                self.by_kind.entry(row).or_default().add(&measured);
                if self.max_work.is_none_or(|max| measured.work > max.units) {
                    let units = measured.work;
                    self.max_work = Some(MaxWork { units, number });
                }
            }
        }
    }

    /// Returns the measurements over all terrains.
    #[must_use]
    pub fn total(&self) -> Measured {
        let mut total = Measured::default();
        for measured in self.by_kind.values() {
            total.add(measured);
        }
        total
    }

    /// Returns the number of ticks checked.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.total().states.iter().sum()
    }
}

impl fmt::Display for LinkStats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "terrain            ticks    waiting       free   touching  unsettled  work  off surface  off minimum     beyond   around  stalled"
        )?;
        for (kind, m) in &self.by_kind {
            row(f, &format!("{:?}", KINDS[*kind]), m)?;
        }
        row(f, "all", &self.total())?;
        writeln!(
            f,
            "\n{} scenes, {} ticks, {} wrong answers",
            self.scenes,
            self.ticks(),
            self.failed.len()
        )?;
        if let Some(MaxWork { units, number }) = self.max_work {
            writeln!(
                f,
                "largest work of a tick: {units} of {WORK_PER_TICK} units, in scene {number}"
            )?;
        }
        let [repeated, shifted, window, turned] = self.total().metamorphic;
        writeln!(
            f,
            "twins compared: {repeated} repeated, {shifted} shifted, {window} in another window, {turned} mirrored or turned"
        )?;
        on_materials(f, &self.total())?;
        for (invariant, scenes) in &self.by_invariant {
            writeln!(f, "    {invariant}: {scenes} scenes")?;
        }
        Ok(())
    }
}

fn on_materials(f: &mut fmt::Formatter<'_>, m: &Measured) -> fmt::Result {
    let MaterialCounts {
        compared_as_vectors,
        compared_by_size,
        open,
        changing,
        sliding,
        with_friction,
    } = m.on_materials;
    let [window, shifted, turned] = m.metamorphic_on_materials;
    writeln!(
        f,
        "on materials: force judged in whole at {compared_as_vectors} points and by its size at {compared_by_size}, {changing} of them while one changed, {with_friction} rubbed, {sliding} slid over a plane, {open} not judged\n\
         twins on materials: {window} in another window, {shifted} shifted, {turned} mirrored or turned"
    )
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, m: &Measured) -> fmt::Result {
    let [waiting, free, touching, letting_go] = m.states;
    let (touching, ticks) = (touching + letting_go, m.states.iter().sum::<u64>());
    writeln!(
        f,
        "{name:13} {ticks:10} {waiting:10} {free:10} {touching:10} {:10} {:5}  {:11.2e}  {:11.2e} {:10} {:8} {:8}",
        m.unconverged, m.work, m.off_surface, m.off_minimum, m.beyond, m.around, m.stalled
    )
}
