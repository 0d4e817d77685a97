//! The proxy: what a tick does, and what is remembered from tick to tick.

mod departures;
mod in_air;
mod landing;
mod on_ground;
mod with_friction;

use glam::Vec3;

use super::budget::{Budget, FAST_PATH};
use super::closest_point::{Descent, Leave, Place};
use super::fast_path::{self, Follow, Followed};
use super::friction::Friction;
use super::output::{ContactOutput, ContactState};
use super::settings::ContactSettings;
use super::surface::{HipView, SurfacePoint};
use super::sweep::Path;
use crate::grid::{Cell, GridPoint};
use crate::terrain::{TILE_CELLS, Window};
use departures::Departures;
use landing::Landing;
use with_friction::Rough;

/// Phase of the proxy, with its memory.
// The path is most of a contact's state, and there is no heap to put it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
enum Phase {
    /// The HIP has not been above the surface yet.
    Unseeded,
    /// The last tick ended free, with the proxy in the HIP.
    Free,
    /// On a path through the air that is not at its end.
    Sweeping(Sweeping),
    /// On the surface.
    OnSurface(OnSurface),
    /// The surface ended: the last force fades away.
    Releasing {
        proxy: GridPoint,
        displacement: Vec3,
        fade: f32,
    },
}

impl Phase {
    /// Its name, and the phases in which a tick may end that begins in it. Nothing else begins
    /// one but [`Contact::land`], after which a proxy that waited is on the surface.
    #[cfg(test)]
    const fn exits(&self) -> (&'static str, &'static [&'static str]) {
        match self {
            // The HIP is above the surface.
            Self::Unseeded => ("unseeded", &["free"]),
            // The path continues in the next tick; it has hit the surface; it leads under it from
            // the side, or the HIP has leapt.
            Self::Free => ("free", &["sweeping", "on surface", "unseeded"]),
            // The same, and the path is at its end.
            Self::Sweeping(_) => ("sweeping", &["free", "on surface", "unseeded"]),
            // The HIP is free; the path to it continues; the surface is lost; it has ended under the
            // HIP, or the HIP has leapt.
            Self::OnSurface(_) => ("on surface", &["free", "sweeping", "releasing", "unseeded"]),
            // The force has faded, and the HIP is above the surface or not.
            Self::Releasing { .. } => ("releasing", &["free", "unseeded"]),
        }
    }
}

#[derive(Clone, Debug)]
struct Sweeping {
    path: Path,
    /// The proxy had to wait for terrain, or the HIP has moved while the path was under way: the
    /// force of the contact that follows may not come at once.
    was_late: bool,
    /// Fade that a hop from the surface to the surface keeps.
    fade: f32,
    departures: Departures,
}

#[derive(Clone, Debug)]
struct OnSurface {
    descent: Descent,
    leave: Leave,
    /// Share of the force that is rendered: less than 1 at the boundary of the surface, and
    /// while a contact comes in after a wait.
    fade: f32,
    departures: Departures,
    /// The proxy is at rest, and the next tick may take the shortcut.
    follow: Option<Follow>,
}

/// Outcome of a tick's fast path.
enum FastPath {
    /// It has the answer.
    Taken,
    /// It has none, but has the closest point of the patch that the proxy is on.
    Known(Place),
    /// There is none.
    None,
}

/// Decision to continue a tick, or to end it with an answer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Turn {
    GoesOn,
    Ends,
}

impl OnSurface {
    const fn at(point: SurfacePoint, fade: f32) -> Self {
        Self {
            descent: Descent::from(point),
            leave: Leave::Anywhere,
            fade,
            departures: None,
            follow: None,
        }
    }
}

/// The proxy and what it remembers from tick to tick.
// In this order: what every tick reads first lies within reach of its loads, which the phase
// and what friction remembers are not.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Contact {
    /// The HIP of the last tick.
    hip: GridPoint,
    output: ContactOutput,
    /// The last answer is the answer again while the HIP has not moved: there
    /// is nothing left to do, and no force is fading. (A field does not change;
    /// another one comes with a new contact.)
    at_rest: bool,
    settings: ContactSettings,
    phase: Phase,
    /// The last answer: where the proxy was, and the displacement to it, if it touched.
    touched: Option<(GridPoint, Vec3)>,
    /// Another view was put in: the proxy is to begin on its surface. It waits meanwhile.
    landing: Option<Landing>,
    /// Memory of friction, where the surface has some.
    rough: Option<Rough>,
}

impl Contact {
    /// A contact that waits to see the HIP above the surface.
    #[must_use]
    pub fn new(settings: ContactSettings) -> Self {
        let rough = Rough::on(settings.friction);
        let is_smooth = rough.is_none();
        Self {
            // A proxy that is held back does not follow the HIP.
            settings: ContactSettings {
                fast_paths: settings.fast_paths && is_smooth,
                ..settings
            },
            phase: Phase::Unseeded,
            landing: None,
            rough,
            hip: GridPoint::default(),
            at_rest: false,
            output: ContactOutput::default(),
            touched: None,
        }
    }

    /// The last tick's answer.
    #[must_use]
    pub const fn output(&self) -> &ContactOutput {
        &self.output
    }

    /// The last step's answer was not rendered, because the next step continues it for the same
    /// HIP: the last rendered answer is still the one `before` it.
    pub const fn resume(&mut self, before: &ContactOutput) {
        (self.output.state, self.output.proxy) = (before.state, before.proxy);
        self.output.displacement = before.displacement;
    }

    /// The HIP of the last tick.
    pub(crate) const fn hip(&self) -> &GridPoint {
        &self.hip
    }

    /// Share of the force: less than 1 where it fades at the edge of
    /// the surface, or comes in after a wait.
    #[must_use]
    pub const fn edge_fade(&self) -> f32 {
        match &self.phase {
            Phase::Sweeping(Sweeping { fade, .. })
            | Phase::OnSurface(OnSurface { fade, .. })
            | Phase::Releasing { fade, .. } => *fade,
            _ => 1.0,
        }
    }

    /// The patch the proxy is on, while touching.
    #[must_use]
    pub const fn patch(&self) -> Option<Cell> {
        match &self.phase {
            Phase::OnSurface(on) => Some(on.descent.cell()),
            _ => None,
        }
    }

    /// The surface moves under the contact by a little: the next [`Self::step`] takes nothing that
    /// was known of it for granted, also where the HIP has not moved. A free HIP that the
    /// surface has passed touches it from then on, as deep as the surface went beyond it.
    #[inline(never)]
    pub fn surface_moved<const D: usize>(&mut self, window: &Window<'_, D>) {
        self.at_rest = false;
        if self.rough.is_some() {
            return;
        }
        // No work is done before the next step.
        self.redirect(window, self.hip, None, &mut Budget::new(0));
    }

    /// Sets the friction from the next step on. A proxy that was held is tested again.
    pub(crate) fn set_friction(&mut self, friction: Friction) {
        if let Some(rough) = &mut self.rough {
            self.at_rest &= !rough.takes(friction);
        } else if !friction.is_none() {
            self.rough = Rough::on(friction);
            // A proxy that is held back does not follow the HIP.
            self.settings.fast_paths = false;
            self.at_rest = false;
            if let Phase::OnSurface(on) = &mut self.phase
                && let Some(follow) = on.follow.take()
            {
                on.descent.restart(follow.point);
            }
        }
    }

    /// Moves the proxy for a HIP, in at most [`super::WORK_PER_TICK`] units of work.
    ///
    /// The HIP is in cells: x east, y north, z up, the origin at the south-west sample
    /// at height zero. How near the proxy is to the surface's closest point is in
    /// `docs/explanation/contact.md`, and the soak judges it in every tick. The answer is finite
    /// whatever the terrain.
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
            FastPath::Known(place) => self.step_in_full(window, *hip, Some(place)),
            FastPath::None => self.step_in_full(window, *hip, None),
        }
        &self.output
    }

    /// Answers as [`Self::step_in_full`] would, or changes nothing.
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
                    return FastPath::None;
                }
                self.output.proxy = *hip;
                self.output.work = 0;
                FastPath::Taken
            }
            Phase::OnSurface(OnSurface {
                follow: Some(follow),
                ..
            }) => match follow.to(&HipView::new(*hip)) {
                Followed::Rests(proxy, displacement) => {
                    self.output.proxy = proxy;
                    self.output.displacement = displacement;
                    self.output.work = FAST_PATH;
                    FastPath::Taken
                }
                Followed::InPatch(place) => FastPath::Known(place),
                Followed::Not => FastPath::None,
            },
            _ => FastPath::None,
        }
    }

    /// A tick without shortcuts. Of a proxy on the surface the `known` closest point of
    /// its patch, if there is one, was found by the shortcut that was not taken.
    #[inline(never)]
    fn step_in_full<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        known: Option<Place>,
    ) {
        if self.rough.is_some() {
            // Nothing was known: with friction no shortcut is taken.
            return self.step_on_rough_ground(window, hip);
        }
        let mut budget = Budget::new(self.settings.work_per_tick);
        self.remember_contact();
        self.gives_up_beyond_window::<D>(&hip);
        if !hip.is_same(&self.hip) {
            self.redirect(window, hip, known, &mut budget);
        }
        // Bounded by the budget: of the turns that follow one another without work,
        // none returns to the one before.
        while self.turn(window, hip, &mut budget) == Turn::GoesOn {}
        self.hip = hip;
        self.ends(&budget);
    }

    /// No arm moves by more than a window in a tick: a HIP that does begins anew.
    fn gives_up_beyond_window<const D: usize>(&mut self, hip: &GridPoint) {
        let (from, to) = (self.hip.column(), hip.column());
        let way = from.x.abs_diff(to.x).max(from.y.abs_diff(to.y));
        if way > (D * TILE_CELLS) as u32 {
            self.phase = Phase::Unseeded;
        }
    }

    /// The end of a tick.
    fn ends(&mut self, budget: &Budget) {
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
        let touched = *state == ContactState::Touching;
        self.touched = touched.then_some((*proxy, *displacement));
    }

    /// The HIP has moved: a way under way now leads to its new place.
    fn redirect<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        known: Option<Place>,
        budget: &mut Budget,
    ) {
        match &mut self.phase {
            // Its departures count on: it may return to where it left.
            Phase::Sweeping(sweeping) => {
                sweeping.path.redirect(hip);
                sweeping.was_late = true;
            }
            Phase::OnSurface(on) => {
                match (&on.follow, known) {
                    (Some(follow), Some(place)) => {
                        on.descent.restart_knowing(follow.point, place, budget);
                    }
                    (Some(follow), None) => on.descent.restart(follow.point),
                    (None, _) => {
                        let view = HipView::new(self.hip);
                        if let Some((point, _)) = on.descent.nearest(window, &view) {
                            on.descent.restart(point);
                        }
                    }
                }
                (on.leave, on.departures, on.follow) = (Leave::Anywhere, None, None);
            }
            _ => {}
        }
    }

    /// One step of what the proxy does. All but the usual ones are calls: the loop around
    /// would set up 70 registers and addresses for them in every tick.
    fn turn<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        match &mut self.phase {
            Phase::Unseeded => self.looks_around(window, hip, budget),
            Phase::Releasing { .. } => self.fades_out(window, hip, budget),
            Phase::Free => self.flies(window, hip, budget),
            Phase::Sweeping(_) => self.sweeps(window, hip, budget),
            Phase::OnSurface(_) => self.descends(window, hip, budget),
        }
    }

    /// The tick ends with this answer.
    #[inline]
    fn answers(&mut self, output: ContactOutput) -> Turn {
        self.output = output;
        Turn::Ends
    }
}

#[cfg(test)]
#[path = "proxy/exits_tests.rs"]
mod exits;
