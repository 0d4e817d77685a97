//! The proxy: its motion in a tick, and its state between ticks.

mod departures;
mod in_air;
mod on_ground;
mod onset;
mod with_friction;

use glam::Vec3;

use super::budget::{Budget, FAST_PATH};
use super::closest_point::{DepartureRule, Descent, PatchPoint};
use super::fast_path::{self, FollowResult, PatchFollower};
use super::friction::Friction;
use super::output::{ContactOutput, ContactState};
use super::settings::ContactSettings;
use super::surface::{HipView, SurfacePoint};
use super::sweep::Path;
use crate::grid::{Cell, GridPoint};
use crate::terrain::{TILE_CELLS, Window};
use departures::Departures;
use onset::Onset;
use with_friction::FrictionState;

/// Phase of the proxy, with the state of that phase.
// The path is most of a contact's size, and without a heap it cannot be boxed.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
enum Phase {
    /// The HIP has not been above the surface yet.
    Unseeded,
    /// The last tick ended free, with the proxy at the HIP.
    Free,
    /// On an unfinished path through the air.
    Sweeping(Sweeping),
    /// On the surface.
    OnSurface(OnSurface),
    /// The surface has ended: the last force ramps down.
    Releasing {
        proxy: GridPoint,
        displacement: Vec3,
        fade: f32,
    },
}

impl Phase {
    /// Returns the phase's name, and the phases in which a tick that starts in it may end. Between
    /// ticks only [`Contact::place_on_surface`] changes the phase: a waiting proxy is then on the
    /// surface.
    #[cfg(test)]
    const fn exits(&self) -> (&'static str, &'static [&'static str]) {
        match self {
            // The HIP is above the surface.
            Self::Unseeded => ("unseeded", &["free"]),
            // Sweeping: the path continues in the next tick. On surface: it has hit the surface.
            // Unseeded: it leads under the surface from the side, or the HIP has jumped.
            Self::Free => ("free", &["sweeping", "on surface", "unseeded"]),
            // Free: the path has reached the HIP. The others as above.
            Self::Sweeping(_) => ("sweeping", &["free", "on surface", "unseeded"]),
            // Free: the HIP is free. Sweeping: the path to it continues. Releasing: the surface is
            // lost. Unseeded: the surface has ended over the HIP, or the HIP has jumped.
            Self::OnSurface(_) => ("on surface", &["free", "sweeping", "releasing", "unseeded"]),
            // The force has faded out. Free: the HIP is above the surface; otherwise unseeded.
            Self::Releasing { .. } => ("releasing", &["free", "unseeded"]),
        }
    }
}

#[derive(Clone, Debug)]
struct Sweeping {
    path: Path,
    /// The proxy has waited for terrain, or the HIP has moved before the path ended: the force of
    /// the next contact has to fade in.
    was_late: bool,
    /// Fade to keep if the path leads from the surface back to it.
    fade: f32,
    departures: Departures,
}

#[derive(Clone, Debug)]
struct OnSurface {
    descent: Descent,
    departure_rule: DepartureRule,
    /// Share of the force that is rendered: less than 1 at the edge of the surface, and while a
    /// contact fades in after a wait.
    fade: f32,
    departures: Departures,
    /// Data for the fast path of the next tick, if the proxy is at rest.
    follower: Option<PatchFollower>,
}

/// Outcome of a tick's fast path.
enum FastPath {
    /// The output is set.
    Taken,
    /// No output, but the closest point of the proxy's patch.
    ClosestPoint(PatchPoint),
    /// The fast path does not apply.
    NotTaken,
}

/// Decision to continue a tick, or to end it with an output.
#[derive(Clone, Copy, PartialEq, Eq)]
enum TickProgress {
    Continue,
    Done,
}

impl OnSurface {
    const fn at(point: SurfacePoint, fade: f32) -> Self {
        Self {
            descent: Descent::from(point),
            departure_rule: DepartureRule::Anywhere,
            fade,
            departures: None,
            follower: None,
        }
    }
}

/// The proxy and its state between ticks.
// Field order: fields that every tick reads come first, within the offset range of its loads. The
// phase and the state of friction are beyond that range.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Contact {
    /// The HIP of the last tick.
    hip: GridPoint,
    output: ContactOutput,
    /// True if the output stays the same while the HIP does not move: no work is left, and no force
    /// fades. (Another field gets a new contact; [`Contact::surface_moved`] clears this.)
    at_rest: bool,
    settings: ContactSettings,
    phase: Phase,
    /// Position and displacement of the proxy in the last output, if it touched.
    last_touch: Option<(GridPoint, Vec3)>,
    /// Start of the proxy on the surface after a change of placement, until the terrain there
    /// arrives.
    onset: Option<Onset>,
    /// State of friction, if the surface has any.
    friction: Option<FrictionState>,
}

impl Contact {
    /// Creates a contact that waits until the HIP is above the surface.
    #[must_use]
    pub fn new(settings: ContactSettings) -> Self {
        let friction = FrictionState::on(settings.friction);
        let is_frictionless = friction.is_none();
        Self {
            // With friction the proxy does not follow the HIP.
            settings: ContactSettings {
                fast_paths: settings.fast_paths && is_frictionless,
                ..settings
            },
            phase: Phase::Unseeded,
            onset: None,
            friction,
            hip: GridPoint::default(),
            at_rest: false,
            output: ContactOutput::default(),
            last_touch: None,
        }
    }

    /// Returns the output of the last tick.
    #[must_use]
    pub const fn output(&self) -> &ContactOutput {
        &self.output
    }

    /// Restores `before` as the last rendered output. The output of the last step was not rendered,
    /// because the next step continues it for the same HIP.
    pub const fn resume(&mut self, before: &ContactOutput) {
        (self.output.state, self.output.proxy) = (before.state, before.proxy);
        self.output.displacement = before.displacement;
    }

    /// Returns the HIP of the last tick.
    pub(crate) const fn hip(&self) -> &GridPoint {
        &self.hip
    }

    /// Returns the share of the force: less than 1 while it fades at the edge of the surface, or
    /// fades in after a wait.
    #[must_use]
    pub const fn edge_fade(&self) -> f32 {
        match &self.phase {
            Phase::Sweeping(Sweeping { fade, .. })
            | Phase::OnSurface(OnSurface { fade, .. })
            | Phase::Releasing { fade, .. } => *fade,
            _ => 1.0,
        }
    }

    /// Returns the patch under the proxy, while it touches.
    #[must_use]
    pub const fn patch(&self) -> Option<Cell> {
        match &self.phase {
            Phase::OnSurface(on) => Some(on.descent.cell()),
            _ => None,
        }
    }

    /// Prepares the contact for a surface that has moved a little: the next [`Self::step`] computes
    /// the proxy again, even if the HIP has not moved. A free HIP that the surface has passed then
    /// touches it, as deep as the surface has moved beyond it.
    #[inline(never)]
    pub fn surface_moved<const D: usize>(&mut self, window: &Window<'_, D>) {
        self.at_rest = false;
        if self.friction.is_some() {
            return;
        }
        // The work is done in the next step.
        self.redirect(window, self.hip, None, &mut Budget::new(0));
    }

    /// Sets the friction from the next step on. That step tests a held proxy again.
    pub(crate) fn set_friction(&mut self, friction: Friction) {
        if let Some(state) = &mut self.friction {
            self.at_rest &= !state.set_friction(friction);
        } else if !friction.is_none() {
            self.friction = FrictionState::on(friction);
            // With friction the proxy does not follow the HIP.
            self.settings.fast_paths = false;
            self.at_rest = false;
            if let Phase::OnSurface(on) = &mut self.phase
                && let Some(follower) = on.follower.take()
            {
                on.descent.restart(follower.point);
            }
        }
    }

    /// Moves the proxy for a HIP, with at most [`super::WORK_PER_TICK`] work units.
    ///
    /// The HIP is in cells: x east, y north, z up, the origin at the south-west sample at height
    /// zero. The maximum distance between the proxy and the surface's closest point is in
    /// `docs/explanation/contact.md`; the randomised stress test checks it in every tick. The
    /// output is finite for any terrain.
    ///
    /// ```
    /// use hapterra_core::Vec3;
    /// use hapterra_core::contact::{Contact, ContactSettings, ContactState};
    /// use hapterra_core::grid::GridPoint;
    /// use hapterra_core::terrain::{FieldSize, TileArena};
    ///
    /// // Flat ground at height 2, touched by a HIP that moves down and along.
    /// let mut field = TileArena::<2>::from_fn(FieldSize::new(40, 40), |_, _| 2.0)?;
    /// let window = field.window();
    /// let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    /// let hip = |x, z| GridPoint::new([20, 20, 0], Vec3::new(x, 0.5, z));
    ///
    /// assert_eq!(contact.step(&window, &hip(0.2, 2.5)).state, ContactState::Free);
    /// let output = contact.step(&window, &hip(0.4, 1.9));
    /// assert_eq!(output.state, ContactState::Touching);
    /// assert!((output.displacement - Vec3::new(0.0, 0.0, 0.1)).length() < 1e-6);
    /// assert_eq!(output.proxy, hip(0.4, 2.0));
    /// # Ok::<(), hapterra_core::terrain::FieldError>(())
    /// ```
    #[inline]
    pub fn step<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: &GridPoint,
    ) -> &ContactOutput {
        if self.at_rest && self.hip.is_same(hip) {
            self.output.work = 0;
            return &self.output;
        }
        match self.take_fast_path(window, hip) {
            FastPath::Taken => self.hip = *hip,
            FastPath::ClosestPoint(place) => self.step_in_full(window, *hip, Some(place)),
            FastPath::NotTaken => self.step_in_full(window, *hip, None),
        }
        &self.output
    }

    /// Sets the output that [`Self::step_in_full`] would set, or changes nothing.
    #[inline]
    fn take_fast_path<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: &GridPoint,
    ) -> FastPath {
        match &mut self.phase {
            Phase::Free if self.at_rest && self.settings.fast_paths => {
                let is_free = fast_path::is_free(window, &self.hip, hip);
                if !is_free {
                    return FastPath::NotTaken;
                }
                self.output.proxy = *hip;
                self.output.work = 0;
                FastPath::Taken
            }
            Phase::OnSurface(OnSurface {
                follower: Some(follower),
                ..
            }) => match follower.follow(&HipView::new(*hip)) {
                FollowResult::AtRest(proxy, displacement) => {
                    self.output.proxy = proxy;
                    self.output.displacement = displacement;
                    self.output.work = FAST_PATH;
                    FastPath::Taken
                }
                FollowResult::InPatch(place) => FastPath::ClosestPoint(place),
                FollowResult::NotApplicable => FastPath::NotTaken,
            },
            _ => FastPath::NotTaken,
        }
    }

    /// Runs a tick without the fast path. `closest` is the closest point of the proxy's patch, if
    /// the fast path has computed it.
    #[inline(never)]
    fn step_in_full<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        closest: Option<PatchPoint>,
    ) {
        if self.friction.is_some() {
            // `closest` is `None`: there is no fast path with friction.
            return self.step_with_friction(window, hip);
        }
        let mut budget = Budget::new(self.settings.work_per_tick);
        self.remember_contact();
        self.reset_beyond_window::<D>(&hip);
        if !hip.is_same(&self.hip) {
            self.redirect(window, hip, closest, &mut budget);
        }
        // Bounded by the budget: a series of turns without work never returns to the one before.
        while self.advance_phase(window, hip, &mut budget) == TickProgress::Continue {}
        self.hip = hip;
        self.end_tick(&budget);
    }

    /// Resets the contact if the HIP has moved by more than a window, which no arm does in a tick.
    fn reset_beyond_window<const D: usize>(&mut self, hip: &GridPoint) {
        let (from, to) = (self.hip.column(), hip.column());
        let distance = from.x.abs_diff(to.x).max(from.y.abs_diff(to.y));
        if distance > (D * TILE_CELLS) as u32 {
            self.phase = Phase::Unseeded;
        }
    }

    /// Ends a tick: stores its work, its missing tile and whether the proxy is at rest.
    fn end_tick(&mut self, budget: &Budget) {
        self.output.work = budget.spent();
        self.output.missing_tile = budget.missing();
        self.at_rest =
            self.output.converged && self.output.missing_tile.is_none() && self.edge_fade() == 1.0;
    }

    #[inline]
    fn remember_contact(&mut self) {
        let ContactOutput {
            state,
            proxy,
            displacement,
            ..
        } = &self.output;
        let is_touching = *state == ContactState::Touching;
        self.last_touch = is_touching.then_some((*proxy, *displacement));
    }

    /// Redirects a path or a descent to the new position of the HIP.
    fn redirect<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        closest: Option<PatchPoint>,
        budget: &mut Budget,
    ) {
        match &mut self.phase {
            // The departures still count: the proxy may return to the point where it left.
            Phase::Sweeping(sweeping) => {
                sweeping.path.redirect(hip);
                sweeping.was_late = true;
            }
            Phase::OnSurface(on) => {
                match (&on.follower, closest) {
                    (Some(follower), Some(place)) => {
                        on.descent
                            .restart_with_closest(follower.point, place, budget);
                    }
                    (Some(follower), None) => on.descent.restart(follower.point),
                    (None, _) => {
                        let view = HipView::new(self.hip);
                        if let Some((point, _)) = on.descent.nearest(window, &view) {
                            on.descent.restart(point);
                        }
                    }
                }
                (on.departure_rule, on.departures, on.follower) =
                    (DepartureRule::Anywhere, None, None);
            }
            _ => {}
        }
    }

    /// Runs one step of the current phase. The rare ones are calls: inlined, they would make the
    /// loop set up 70 registers and addresses in every tick.
    fn advance_phase<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        match &mut self.phase {
            Phase::Unseeded => self.try_seed(window, hip, budget),
            Phase::Releasing { .. } => self.fade_out(window, hip, budget),
            Phase::Free => self.start_sweep(window, hip, budget),
            Phase::Sweeping(_) => self.continue_sweep(window, hip, budget),
            Phase::OnSurface(_) => self.descend(window, hip, budget),
        }
    }

    /// Sets the output and ends the tick.
    #[inline]
    fn set_output(&mut self, output: ContactOutput) -> TickProgress {
        self.output = output;
        TickProgress::Done
    }
}

#[cfg(test)]
#[path = "proxy/exits_tests.rs"]
mod exits;
