//! The list of what every tick must keep.

use hapterra_core::contact::presence::RATE;
use hapterra_core::contact::{Felt, Rule, State, WORK_PER_TICK};
use hapterra_core::force::ForceLaw;
use hapterra_core::grid::MAX_CELL;

use super::surface::{Patch, distance, patches_at};
use super::{Invariant, Violation, crossing, descent};
use crate::field::position;
use crate::scene::terrain::{Kind, Terrain, WALL, WALL_EVERY};

/// Error that is always allowed, cells (docs/contact.md).
const ERROR: f64 = 2e-6;
/// Distances that differ by less than this part count as equal: the squared
/// distance is compared to 10⁻⁶ in each patch on the way.
const TIE: f64 = 4e-6;
/// Stretches shorter than this, in cells, tell nothing about a fade.
const SHORT: f64 = 1e-3;
/// Hands farther from the surface than this, in cells, are so far that distances
/// to all that is near the proxy count as equal.
const FAR: f64 = 1e4;
/// A hand that moves no farther than this in a tick, in cells, is in the same
/// contact as before.
const NEAR: f64 = 0.1;

/// One tick as the judge sees it.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The hand.
    pub hip: [f64; 3],
    /// The answer.
    pub felt: Felt,
    /// The proxy, where the terrain was made.
    pub proxy: [f64; 3],
}

impl Seen {
    /// A tick over a terrain that lies `shift` cells away.
    #[must_use]
    pub fn new(hip: [f64; 3], felt: Felt, shift: [i32; 3]) -> Self {
        let at = position(&felt.proxy);
        Self {
            hip,
            felt,
            proxy: [0, 1, 2].map(|i| at[i] - f64::from(shift[i])),
        }
    }

    fn is_free(&self) -> bool {
        self.felt.state == State::Free && self.felt.settled
    }

    fn is_touching(&self) -> bool {
        self.felt.state == State::Touching
    }

    /// What part of the spring is felt; `None` where it is too short to tell.
    fn presence(&self) -> Option<f64> {
        let whole = distance(self.proxy, self.hip);
        let felt = self.felt.stretch.as_dvec3().length();
        (self.is_touching() && whole > SHORT).then(|| felt / whole)
    }

    /// Error allowed where the height is not in question: the bound, or four
    /// units in the last place of the largest coordinate of the hand in the
    /// proxy's patch.
    fn allowed(&self) -> f64 {
        let reach = (0..3).map(|i| (self.proxy[i] - self.hip[i]).abs());
        let largest = reach.fold(1.0, f64::max) + 1.0;
        ERROR.max(4.0 * f64::from(f32::EPSILON) * largest)
    }

    /// Error allowed in space: the corners of the patch are coordinates, too.
    fn allowed_in_space(&self, terrain: &Terrain) -> f64 {
        let [x, y, _] = self.proxy;
        let corners = patches_at(terrain, x, y).flat_map(|patch| patch.corners());
        let highest = corners.fold(0.0, |most, h| (h - self.hip[2]).abs().max(most));
        self.allowed().max(4.0 * f64::from(f32::EPSILON) * highest)
    }
}

/// What the judge learned that is no yes or no.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Ticks waiting, free, touching and letting go.
    pub states: [u64; 4],
    /// Ticks that left work over.
    pub unsettled: u64,
    /// Most units of work in a tick.
    pub work: u32,
    /// Largest distance of a proxy from the surface, cells, with the hand within
    /// a few cells.
    pub off_surface: f64,
    /// Largest distance from the exact closest point, cells, among those within
    /// the bound of gentle patches.
    pub off_minimum: f64,
    /// Answers judged against the exact closest point.
    pub judged: u64,
    /// Of those, beyond that bound, where steepness or a badly conditioned
    /// minimum allows it.
    pub beyond: u64,
    /// Ways that met the surface and yet ended free: around a pole.
    pub around: u64,
}

/// Looks at the ticks of one scene in turn.
pub struct Judge<'g> {
    terrain: &'g Terrain,
    rule: Rule,
    tick: usize,
    before: Option<Seen>,
    /// What was felt, cells, when the proxy began to let go.
    let_go_from: f64,
    /// What was learned.
    pub measured: Measured,
}

type Verdict = Result<(), Violation>;

impl<'g> Judge<'g> {
    /// A judge over a terrain.
    #[must_use]
    pub fn new(terrain: &'g Terrain, rule: Rule) -> Self {
        Self {
            terrain,
            rule,
            tick: 0,
            before: None,
            let_go_from: 0.0,
            measured: Measured::default(),
        }
    }

    /// Judges the next tick.
    ///
    /// # Errors
    /// The first invariant that it breaks.
    pub fn look(&mut self, seen: &Seen) -> Verdict {
        let felt = &seen.felt;
        self.measured.states[felt.state as usize] += 1;
        self.measured.unsettled += u64::from(!felt.settled);
        self.measured.work = self.measured.work.max(felt.work);
        self.is_sane(seen)?;
        self.is_clamped(seen)?;
        if seen.is_touching() {
            self.is_on_surface(seen)?;
        }
        if self.rule == Rule::Swept {
            self.is_swept(seen)?;
        }
        self.before = Some(*seen);
        self.tick += 1;
        Ok(())
    }

    fn is_swept(&mut self, seen: &Seen) -> Verdict {
        if seen.is_touching() && seen.felt.settled {
            self.is_local_minimum(seen)?;
        }
        if seen.is_free() {
            self.is_above(seen)?;
        }
        let Some(before) = self.before else {
            return Ok(());
        };
        self.was_seen_above(&before, seen)?;
        self.fades(&before, seen)?;
        self.lets_go_gently(&before, seen)?;
        self.descends(&before, seen)?;
        if before.is_free() {
            self.first_crossing(&before, seen)?;
        }
        self.passes_no_wall(&before, seen)
    }

    fn fail(&self, invariant: Invariant, detail: String) -> Verdict {
        Err(Violation {
            invariant,
            tick: self.tick,
            detail,
        })
    }

    fn is_sane(&self, seen: &Seen) -> Verdict {
        let felt = &seen.felt;
        let (cell, frac) = (felt.proxy.cell(), felt.proxy.frac());
        let valid = cell.iter().all(|c| c.abs() <= MAX_CELL)
            && frac.to_array().iter().all(|f| (0.0..1.0).contains(f));
        if !felt.stretch.is_finite() || !valid {
            return self.fail(Invariant::Finite, format!("{felt:?}"));
        }
        if felt.work > WORK_PER_TICK {
            return self.fail(Invariant::Work, format!("{felt:?}"));
        }
        let none = felt.stretch.to_array() == [0.0; 3];
        let free_at_hand = !seen.is_free() || seen.proxy == seen.hip;
        let may_press = seen.is_touching() || felt.state == State::LettingGo;
        if (!may_press && !none) || !free_at_hand {
            return self.fail(Invariant::Consistent, format!("{seen:?}"));
        }
        Ok(())
    }

    fn is_clamped(&self, seen: &Seen) -> Verdict {
        for cell_mm in [1e-3, 1.0, 1e3_f32] {
            let law = ForceLaw::PREMIUM;
            let force = law.force_n(seen.felt.stretch * cell_mm);
            let length = force.as_dvec3().length();
            // Half a unit in the last place is what its own length may be off.
            if !force.is_finite() || length > f64::from(law.max_force_n) * (1.0 + 1e-7) {
                let detail = format!("{length} N from {:?}", seen.felt.stretch);
                return self.fail(Invariant::Clamp, detail);
            }
        }
        Ok(())
    }

    fn is_on_surface(&mut self, seen: &Seen) -> Verdict {
        let [x, y, z] = seen.proxy;
        let off = patches_at(self.terrain, x, y)
            .map(|patch| (z - patch.height(x, y)).abs() / patch.slope(x, y).hypot(1.0));
        let off = off.fold(f64::INFINITY, f64::min);
        if off > seen.allowed() {
            let detail = format!("by {off:.3e} of {:.3e}: {seen:?}", seen.allowed());
            return self.fail(Invariant::OnSurface, detail);
        }
        if seen.allowed() == ERROR {
            self.measured.off_surface = self.measured.off_surface.max(off);
        }
        Ok(())
    }

    fn is_local_minimum(&mut self, seen: &Seen) -> Verdict {
        let Some((error, patch, start)) = self.off_minimum(seen.proxy, seen.hip) else {
            return Ok(()); // off the surface: said before
        };
        self.measured.judged += 1;
        // Within the bound of the hand itself there is no force to be wrong about.
        if !(ERROR..=FAR).contains(&distance(seen.proxy, seen.hip)) {
            return Ok(());
        }
        let allowed = seen.allowed();
        if error <= allowed {
            if allowed == ERROR {
                self.measured.off_minimum = self.measured.off_minimum.max(error);
            }
            return Ok(());
        }
        self.measured.beyond += 1;
        // On steep ground a unit in the last place of a coordinate is much height:
        // the bound is one in the plane. And how far does the truth move for a
        // rounding of the hand?
        let here = descent::from(self.terrain, seen.hip, start, patch).at;
        let moved = |axis: usize, by: f64| {
            let mut hip = seen.hip;
            hip[axis] += by;
            level(descent::from(self.terrain, hip, start, patch).at, here)
        };
        let moves = (0..3).flat_map(|axis| [moved(axis, allowed), moved(axis, -allowed)]);
        let condition = moves.fold(0.0, f64::max);
        let error = level(here, seen.proxy);
        if error > 4.0 * (allowed + condition) {
            let detail = format!(
                "{error:.3e} of {allowed:.3e} from {here:?}, truth moves {condition:.1e}: {seen:?}"
            );
            return self.fail(Invariant::LocalMinimum, detail);
        }
        Ok(())
    }

    /// Distance from the exact closest point: the least over the patches that
    /// single precision cannot tell the proxy's place from.
    fn off_minimum(&self, proxy: [f64; 3], hip: [f64; 3]) -> Option<(f64, Patch, [f64; 2])> {
        let [xs, ys] = [sides(proxy[0]), sides(proxy[1])];
        let starts = xs.iter().flat_map(|x| ys.iter().map(|y| [*x, *y]));
        starts
            .flat_map(|start| {
                patches_at(self.terrain, start[0], start[1]).map(move |patch| (start, patch))
            })
            .map(|(start, patch)| {
                let exact = descent::from(self.terrain, hip, start, patch);
                (distance(exact.at, proxy), patch, start)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn is_above(&self, seen: &Seen) -> Verdict {
        let [x, y, z] = seen.hip;
        // On a line of the grid the hand is over the patch to the north-east.
        let Some(patch) = Patch::at(self.terrain, [x.floor() as i32, y.floor() as i32]) else {
            return Ok(());
        };
        let below = (patch.height(x, y) - z) / patch.slope(x, y).hypot(1.0);
        let before = self.before.map_or(z, |before| before.hip[2]);
        let fall = z.abs().max((z - before).abs());
        if below > ERROR.max(4.0 * f64::from(f32::EPSILON) * fall) {
            return self.fail(Invariant::AboveSurface, format!("by {below:.3e}: {seen:?}"));
        }
        Ok(())
    }

    fn was_seen_above(&self, before: &Seen, seen: &Seen) -> Verdict {
        if before.felt.state == State::Waiting && seen.is_touching() {
            return self.fail(Invariant::SeenAbove, format!("{before:?} then {seen:?}"));
        }
        Ok(())
    }

    fn fades(&self, before: &Seen, seen: &Seen) -> Verdict {
        let moved = distance(before.hip, seen.hip);
        let hopped = distance(before.proxy, seen.proxy);
        if !before.is_touching() || moved > NEAR {
            return Ok(()); // a new contact may come at once
        }
        let rate = f64::from(RATE) + 1e-3;
        let broken = match (before.presence(), seen.presence()) {
            (Some(was), Some(is)) => hopped < 2.0 * NEAR && (is - was).abs() > rate,
            // Let go: there was next to nothing left.
            (Some(was), None) => seen.felt.state == State::Waiting && was > rate,
            (None, _) => false,
        };
        if broken {
            let detail = format!(
                "{:?} to {:?}: {before:?} then {seen:?}",
                before.presence(),
                seen.presence()
            );
            return self.fail(Invariant::Fade, detail);
        }
        Ok(())
    }

    /// What was felt last fades to nothing in equal steps.
    fn lets_go_gently(&mut self, before: &Seen, seen: &Seen) -> Verdict {
        let felt = |seen: &Seen| seen.felt.stretch.as_dvec3().length();
        let lets_go = |seen: &Seen| seen.felt.state == State::LettingGo;
        if lets_go(seen) && !lets_go(before) {
            self.let_go_from = felt(before);
        }
        let step = felt(before) - felt(seen);
        let most = (f64::from(RATE) + 1e-3) * self.let_go_from;
        let ends = lets_go(before) || lets_go(seen);
        if ends && !(-1e-6..=most + 1e-6).contains(&step) {
            let detail = format!("a step of {step:.3e}, {before:?} then {seen:?}");
            return self.fail(Invariant::Fade, detail);
        }
        Ok(())
    }

    fn descends(&self, before: &Seen, seen: &Seen) -> Verdict {
        // A proxy that waits for a tile goes on from where it entered its patch.
        let waited = before.felt.held_up_by.is_some();
        if !(before.is_touching() && seen.is_touching()) || waited {
            return Ok(());
        }
        let was = distance(before.proxy, seen.hip);
        let is = distance(seen.proxy, seen.hip);
        let allowed = |seen: &Seen| seen.allowed_in_space(self.terrain);
        if is > was * (1.0 + TIE) + allowed(seen) + allowed(before) {
            let detail = format!("{is} after {was}: {before:?} then {seen:?}");
            return self.fail(Invariant::Descent, detail);
        }
        Ok(())
    }

    fn first_crossing(&mut self, before: &Seen, seen: &Seen) -> Verdict {
        // Lowered by what rounding may do, the way meets the surface no later.
        let slope = patches_at(self.terrain, seen.proxy[0], seen.proxy[1])
            .map(|patch| patch.slope(seen.proxy[0], seen.proxy[1]))
            .fold(0.0, f64::max);
        let margin = 2.0 * (seen.allowed() + before.allowed()) * (1.0 + slope);
        let lowered = |[x, y, z]: [f64; 3]| [x, y, z - margin];
        let met = crossing::first(self.terrain, lowered(before.hip), lowered(seen.hip));
        match (met, seen.is_touching()) {
            (None, true) => {
                let detail = format!("nothing was crossed: {before:?} then {seen:?}");
                self.fail(Invariant::Freedom, detail)
            }
            (Some(met), true) => {
                let (from, is) = (
                    distance(met.at, lowered(seen.hip)),
                    distance(seen.proxy, seen.hip),
                );
                if is > from * (1.0 + TIE) + 2.0 * margin {
                    let detail = format!("{is} after {from} at {met:?}: {before:?} then {seen:?}");
                    return self.fail(Invariant::FirstCrossing, detail);
                }
                Ok(())
            }
            (Some(met), false) => {
                self.measured.around += u64::from(seen.is_free() && met.depth > 1e-3);
                Ok(())
            }
            (None, false) => Ok(()),
        }
    }

    fn passes_no_wall(&self, before: &Seen, seen: &Seen) -> Verdict {
        let inside = |p: [f64; 3]| {
            (0..2).all(|axis| (0.0..=f64::from(self.terrain.size[axis])).contains(&p[axis]))
        };
        let held = |seen: &Seen| seen.felt.state != State::Waiting;
        // Any place on a wall's top is farther from the hand than the proxy was.
        let out_of_reach = WALL - seen.hip[2] > distance(before.proxy, seen.hip) + 1.0;
        if self.terrain.kind != Kind::Walls
            || !(held(before) && held(seen) && out_of_reach)
            || !(inside(before.proxy) && inside(seen.proxy) && inside(seen.hip))
        {
            return Ok(());
        }
        let room =
            |p: [f64; 3]| [0, 1].map(|axis| (p[axis] / f64::from(WALL_EVERY)).floor() as i32);
        if room(before.proxy) != room(seen.proxy) {
            return self.fail(Invariant::Wall, format!("{before:?} then {seen:?}"));
        }
        Ok(())
    }
}

/// Distance in the plane.
fn level(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// A coordinate, and the border of a patch that single precision cannot tell it
/// from: on a sharp ridge its two sides lead to different valleys.
fn sides(x: f64) -> Vec<f64> {
    const ROUNDING: f64 = 1e-6;
    let border = x.round();
    if x == border || (x - border).abs() > ROUNDING {
        return vec![x];
    }
    vec![x, border]
}
