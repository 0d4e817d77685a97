//! The proxy: what a tick does, and what is remembered from tick to tick.

mod landing;
mod rubbing;

use glam::Vec3;

use super::boundary_fade::{self, approach};
use super::budget::{Budget, SHORTCUT};
use super::closest_point::{Descent, Ended, Leave, Place, position_on};
use super::friction::Friction;
use super::output::{ContactOutput, ContactState};
use super::paper::{self, Candidate, Candidates};
use super::settings::{ContactSettings, Execution, Rule};
use super::shortcut::{self, Follow, Followed};
use super::surface::{HipView, SurfacePoint};
use super::sweep::{Path, Swept};
use crate::grid::{Cell, GridPoint};
use crate::terrain::{Ground, TileIndex, Window};
use landing::Landing;
use rubbing::Rubbing;

/// After so many departures without getting nearer to the HIP the proxy may leave the
/// surface no more: it only moves to and fro by rounding.
const DEPARTURES: u32 = 32;
/// The same after so many that each come nearer by next to nothing: it creeps along what
/// is all but vertical, and would for hours.
const CREEPING: u32 = 2_048;

/// What the proxy does, with what has to be remembered while it does so.
// The path is most of a contact's state, and there is no heap to put it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
enum Phase {
    /// The HIP has not been above the surface yet.
    Waiting,
    /// The last tick ended free, with the proxy in the HIP.
    Free,
    /// On a path through the air that is not at its end.
    Sweeping(Sweeping),
    /// On the surface.
    OnSurface(OnSurface),
    /// The surface ended: the last force fades away.
    Fading {
        proxy: GridPoint,
        displacement: Vec3,
        fade: f32,
    },
    /// By the paper's rule: the cells under a segment are looked at.
    Seeking { cells: Candidates, was_late: bool },
}

#[derive(Clone, Debug)]
struct Sweeping {
    path: Path,
    /// The proxy had to wait, for terrain or for work: the force of the contact that
    /// follows may not come at once.
    was_late: bool,
    /// What a hop from the surface to the surface keeps.
    fade: f32,
    departures: Departures,
}

#[derive(Clone, Debug)]
struct OnSurface {
    descent: Descent,
    leave: Leave,
    /// How much of the force is felt: less than 1 at the boundary of the surface, and
    /// while a contact comes in after a wait.
    fade: f32,
    departures: Departures,
    /// The proxy is at rest, and the next tick may take the shortcut.
    follow: Option<Follow>,
}

/// What a tick's shortcut comes to.
enum Shortcut {
    /// It has the answer.
    Taken,
    /// It has none, but knows the closest point of the patch that the proxy is on.
    Known(Place),
    /// There is none.
    None,
}

/// Whether a tick goes on, or ends with an answer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Turn {
    GoesOn,
    Ends,
}

/// The departures from the surface since the HIP last found the proxy on it, if there was
/// one.
type Departures = Option<Departed>;

#[derive(Clone, Copy, Debug)]
struct Departed {
    /// The place nearest to the HIP from which the proxy has left.
    nearest: GridPoint,
    /// Departures since from where it was no nearer.
    in_vain: u32,
    /// Departures in a row from where it was not clearly nearer.
    creeping: u32,
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
    /// What was felt by the last answer that counted, one that did not wait in
    /// lock-step: where the proxy was, and the displacement to it.
    felt: Option<(GridPoint, Vec3)>,
    /// Another view was put in: the proxy is to begin on its surface. It waits meanwhile.
    landing: Option<Landing>,
    /// What friction holds of the proxy, where the surface is rough.
    rubbing: Option<Rubbing>,
}

impl Contact {
    /// A contact that waits to see the HIP above the surface.
    #[must_use]
    pub fn new(settings: ContactSettings) -> Self {
        let rubbing = match settings.rule {
            Rule::Swept => Rubbing::on(settings.friction),
            Rule::Paper => None,
        };
        let is_smooth = rubbing.is_none();
        Self {
            // A proxy that is held back does not follow the HIP.
            settings: ContactSettings {
                shortcuts: settings.shortcuts && is_smooth,
                ..settings
            },
            phase: Phase::Waiting,
            landing: None,
            rubbing,
            hip: GridPoint::default(),
            at_rest: false,
            output: ContactOutput::default(),
            felt: None,
        }
    }

    /// The last tick's answer.
    #[must_use]
    pub const fn output(&self) -> &ContactOutput {
        &self.output
    }

    /// The HIP of the last tick.
    pub(crate) const fn hip(&self) -> &GridPoint {
        &self.hip
    }

    /// Whether what the last tick answered is felt: in lock-step only once all is done.
    pub(crate) fn is_felt(&self) -> bool {
        self.output.converged || self.settings.execution == Execution::RealTime
    }

    /// Whether a tick is repeated until all is done.
    pub(crate) fn is_in_lock_step(&self) -> bool {
        self.settings.execution == Execution::LockStep
    }

    /// Whether the last tick did all there was to do, for this HIP.
    pub(crate) fn has_answered(&self, hip: &GridPoint) -> bool {
        self.output.converged && self.hip.is_same(hip)
    }

    /// How much of the force is felt: less than 1 where it fades at the boundary of
    /// the surface, or comes in after a wait.
    #[must_use]
    pub const fn boundary_fade(&self) -> f32 {
        match &self.phase {
            Phase::Sweeping(Sweeping { fade, .. })
            | Phase::OnSurface(OnSurface { fade, .. })
            | Phase::Fading { fade, .. } => *fade,
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
        if let Some(rubbing) = &mut self.rubbing {
            return rubbing.surface_moved();
        }
        // No work is done before the next step.
        self.redirect(window, self.hip, None, &mut Budget::new(0));
    }

    /// How rough the surface is from the next step on, of a contact that knows friction: one
    /// that was made with some. A proxy that was held is judged again.
    pub(crate) fn feels_friction(&mut self, friction: Friction) {
        if let Some(rubbing) = &mut self.rubbing
            && rubbing.takes(friction)
        {
            self.at_rest = false;
        }
    }

    /// Moves the proxy for a HIP, in at most [`super::WORK_PER_TICK`] units of work.
    ///
    /// The HIP is in cells: x east, y north, z up, the origin at the south-west sample
    /// at height zero. How near the proxy is to the surface's closest point is in
    /// `docs/contact.md`, and the soak judges it in every tick. The answer is finite
    /// whatever the terrain.
    ///
    /// ```
    /// use hapterra_core::Vec3;
    /// use hapterra_core::contact::{Contact, ContactSettings, ContactState};
    /// use hapterra_core::grid::GridPoint;
    /// use hapterra_core::terrain::{FieldSize, FieldStorage};
    ///
    /// // Flat ground at height 2, felt by a HIP that goes down and along.
    /// let mut field = FieldStorage::<2>::from_fn(FieldSize::new(40, 40), |_, _| 2.0)?;
    /// let window = field.window();
    /// let mut contact = Contact::new(ContactSettings::REAL_TIME);
    /// let hip = |x, z| GridPoint::new([20, 20, 0], Vec3::new(x, 0.5, z));
    ///
    /// assert_eq!(contact.step(&window, &hip(0.2, 2.5)).state, ContactState::Free);
    /// let output = contact.step(&window, &hip(0.4, 1.9));
    /// assert_eq!(output.state, ContactState::Touching);
    /// assert!((output.displacement - Vec3::new(0.0, 0.0, 0.1)).length() < 1e-6);
    /// assert_eq!(output.proxy, hip(0.4, 2.0));
    /// # Ok::<(), hapterra_core::terrain::BadField>(())
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
        match self.take_shortcut(window, hip) {
            Shortcut::Taken => self.hip = *hip,
            Shortcut::Known(place) => self.step_in_full(window, *hip, Some(place)),
            Shortcut::None => self.step_in_full(window, *hip, None),
        }
        &self.output
    }

    /// Answers as [`Self::step_in_full`] would, or changes nothing.
    #[inline]
    fn take_shortcut<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: &GridPoint,
    ) -> Shortcut {
        match &mut self.phase {
            Phase::Free if self.at_rest && self.settings.shortcuts => {
                let is_free = shortcut::is_free(window, &self.hip, hip);
                if !is_free {
                    return Shortcut::None;
                }
                self.output.proxy = *hip;
                self.output.work = 0;
                Shortcut::Taken
            }
            Phase::OnSurface(OnSurface {
                follow: Some(follow),
                ..
            }) => match follow.to(&HipView::new(*hip)) {
                Followed::Rests(proxy, displacement) => {
                    self.output.proxy = proxy;
                    self.output.displacement = displacement;
                    self.output.work = SHORTCUT;
                    Shortcut::Taken
                }
                Followed::InPatch(place) => Shortcut::Known(place),
                Followed::Not => Shortcut::None,
            },
            _ => Shortcut::None,
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
        if self.rubbing.is_some() {
            // Nothing was known: with friction no shortcut is taken.
            return self.rub(window, hip);
        }
        let mut budget = Budget::new(self.settings.work_per_tick);
        self.remembers_what_was_felt();
        if !hip.is_same(&self.hip) {
            self.redirect(window, hip, known, &mut budget);
        }
        // Bounded by the budget: of the turns that follow one another without work,
        // none comes back to the one before.
        while self.turn(window, hip, &mut budget) == Turn::GoesOn {}
        self.hip = hip;
        self.at_rest = self.output.converged && self.boundary_fade() == 1.0;
        self.output.work = budget.spent();
    }

    #[inline]
    fn remembers_what_was_felt(&mut self) {
        if self.is_felt() {
            let ContactOutput {
                state,
                proxy,
                displacement,
                ..
            } = &self.output;
            let touched = *state == ContactState::Touching;
            self.felt = touched.then_some((*proxy, *displacement));
        }
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
            // Its departures count on: it may come back to where it left.
            Phase::Sweeping(sweeping) => sweeping.path.redirect(hip),
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
            Phase::Waiting => self.looks_around(window, hip),
            Phase::Fading { .. } => self.fades_out(window, hip),
            Phase::Free if self.settings.rule == Rule::Paper => {
                let cells = Candidates::between(self.hip, hip);
                let was_late = false;
                self.phase = Phase::Seeking { cells, was_late };
                Turn::GoesOn
            }
            Phase::Free => self.flies(window, hip, budget),
            Phase::Sweeping(_) => self.sweeps(window, hip, budget),
            Phase::Seeking { .. } => self.seeks(window, hip, budget),
            Phase::OnSurface(_) => self.descends(window, hip, budget),
        }
    }

    /// Waiting ends when the HIP is above the patch it is over, or above everything.
    #[inline(never)]
    fn looks_around<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Turn {
        if let Some(landing) = &self.landing {
            let waits = landing.waits();
            return self.answers(waits);
        }
        let view = HipView::new(hip);
        let (cell, ground) = view.ground(window);
        let is_above = view.altitude().cell() >= window.top()
            || matches!(&ground, Ground::Patch(corners) if view.is_above(cell, corners));
        if is_above {
            return self.becomes_free(hip);
        }
        self.phase = Phase::Waiting;
        let is_missing = ground == Ground::Missing;
        self.answers(ContactOutput {
            proxy: hip,
            converged: !is_missing,
            missing_tile: is_missing.then(|| TileIndex::holding(cell)),
            ..ContactOutput::default()
        })
    }

    /// The tick ends with this answer.
    #[inline]
    fn answers(&mut self, output: ContactOutput) -> Turn {
        self.output = output;
        Turn::Ends
    }

    /// A free proxy has to wait: it is as far as its path is known to be free.
    fn waits_at(&mut self, proxy: GridPoint, missing_tile: Option<TileIndex>) -> Turn {
        self.answers(ContactOutput {
            state: ContactState::Free,
            proxy,
            missing_tile,
            ..ContactOutput::default()
        })
    }

    /// The proxy is free, at the HIP; the tick ends.
    fn becomes_free(&mut self, hip: GridPoint) -> Turn {
        self.phase = Phase::Free;
        self.answers(ContactOutput {
            state: ContactState::Free,
            proxy: hip,
            converged: true,
            ..ContactOutput::default()
        })
    }

    /// In free space the proxy is the HIP, if it still is.
    ///
    /// Most paths end within the tick; those are not worth storing.
    #[inline(never)]
    fn flies<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let mut sweeping = Sweeping {
            path: Path::through_air(self.hip, hip),
            was_late: false,
            fade: 1.0,
            departures: None,
        };
        let swept = sweeping.path.advance(window, budget);
        if matches!(swept, Swept::Missing(_) | Swept::Suspended) {
            sweeping.was_late = self.settings.execution == Execution::RealTime;
            let at = sweeping.path.at();
            self.phase = Phase::Sweeping(sweeping);
            return self.waits_at(at, swept.missing_tile());
        }
        self.arrives(window, hip, swept, Departures::None, 1.0)
    }

    /// Goes on with a path from an earlier tick, or off the surface.
    #[inline(never)]
    fn sweeps<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Phase::Sweeping(sweeping) = &mut self.phase else {
            return Turn::Ends;
        };
        let swept = sweeping.path.advance(window, budget);
        if matches!(swept, Swept::Missing(_) | Swept::Suspended) {
            sweeping.was_late |= self.settings.execution == Execution::RealTime;
            let at = sweeping.path.at();
            return self.waits_at(at, swept.missing_tile());
        }
        let fade = if sweeping.was_late {
            0.0
        } else {
            sweeping.fade
        };
        let departures = sweeping.departures;
        self.arrives(window, hip, swept, departures, fade)
    }

    /// What a path that ended comes to: on the surface the tick goes on.
    fn arrives<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        swept: Swept,
        departures: Departures,
        fade: f32,
    ) -> Turn {
        match swept {
            Swept::Hit(point) => {
                self.phase = Phase::OnSurface(OnSurface {
                    leave: may_leave(window, &HipView::new(hip), point, &departures),
                    departures,
                    ..OnSurface::at(point, fade)
                });
                Turn::GoesOn
            }
            Swept::Under => self.loses_contact(window, hip),
            Swept::Clear | Swept::Missing(_) | Swept::Suspended => self.becomes_free(hip),
        }
    }

    /// On the surface: downhill to the closest point.
    #[inline]
    fn descends<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
        };
        let view = HipView::new(hip);
        let is_paper = self.settings.rule == Rule::Paper;
        let leave = if is_paper { &Leave::Nowhere } else { &on.leave };
        let waits = self.settings.execution == Execution::LockStep;
        match on.descent.advance(window, &view, leave, waits, budget) {
            Ended::Rests if is_paper => self.decides(window, &view, hip),
            Ended::Rests => self.touches(window, hip, true, None),
            Ended::Missing(tile) => self.touches(window, hip, false, Some(tile)),
            Ended::Suspended => self.touches(window, hip, false, None),
            Ended::Leaves => self.leaves(window, &view, hip),
            Ended::Lost(_) if is_paper => self.becomes_free(hip),
            Ended::Lost(tile) => {
                let turn = self.loses_contact(window, hip);
                self.output.missing_tile = self.output.missing_tile.or(tile);
                turn
            }
        }
    }

    /// From the surface into the air, straight to the HIP. The path begins at the
    /// nearest point that is known: that of the patch which was entered, if the proxy
    /// leaves on the border of it.
    #[inline(never)]
    fn leaves<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        hip: GridPoint,
    ) -> Turn {
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
        };
        // The descent has just stood on a patch there.
        let nearest = on.descent.nearest(window, view);
        let from = nearest.and_then(|(point, _)| position_on(window, &point));
        let from = from.unwrap_or(self.output.proxy);
        let mut departures = on.departures;
        count_departure(&mut departures, from, view);
        self.phase = Phase::Sweeping(Sweeping {
            path: Path::off_surface(from, hip),
            was_late: false,
            fade: on.fade,
            departures,
        });
        Turn::GoesOn
    }

    /// The answer in contact, faded where the surface ends.
    fn touches<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        mut converged: bool,
        mut missing_tile: Option<TileIndex>,
    ) -> Turn {
        let is_real_time = self.settings.execution == Execution::RealTime;
        let most = boundary_fade::RATE_PER_S * self.settings.rate.tick_s();
        let view = HipView::new(hip);
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
        };
        let Some((point, z)) = on.descent.nearest(window, &view) else {
            return Turn::Ends;
        };
        let mut may_follow = self.settings.shortcuts && self.settings.rule == Rule::Swept;
        if converged || is_real_time {
            let over = self.rubbing.as_ref().map_or(&hip, |rubbing| &rubbing.hip);
            let target = boundary_fade::target(window, over, point.cell);
            may_follow &= target.over_patch;
            if let (Some(tile), false) = (target.missing, is_real_time) {
                (converged, missing_tile) = (false, Some(tile));
            } else {
                on.fade = approach(on.fade, target.fade, most);
                if on.fade == 0.0 && target.fade == 0.0 {
                    // The HIP may be above the surface already; to look now and not in
                    // the next tick is what makes a missing tile leave no trace.
                    return self.looks_around(window, hip);
                }
            }
        }
        let displacement = view.displacement(&point, z) * on.fade;
        // A proxy that has stayed in its patch is likely to stay for another tick.
        let [x, y, _] = self.output.proxy.cell();
        let stayed = point.cell == Cell::new(x, y);
        if converged
            && on.fade == 1.0
            && stayed
            && may_follow
            && let Some(follow) = Follow::from(window, point, hip.column())
        {
            on.follow = Some(follow);
        }
        // Field by field: a whole answer would be made elsewhere first, and copied.
        self.output.state = ContactState::Touching;
        self.output.proxy = view.position(&point, z);
        self.output.displacement = displacement;
        self.output.converged = converged;
        self.output.missing_tile = missing_tile;
        Turn::Ends
    }

    /// The contact is lost: what was felt fades away where it was.
    fn loses_contact<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Turn {
        let Some((proxy, displacement)) = self.felt else {
            return self.looks_around(window, hip);
        };
        self.phase = Phase::Fading {
            proxy,
            displacement,
            fade: 1.0,
        };
        self.fades_out(window, hip)
    }

    /// A tick of fading out.
    fn fades_out<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Turn {
        let most = boundary_fade::RATE_PER_S * self.settings.rate.tick_s();
        if let Phase::Fading {
            proxy,
            displacement,
            fade,
        } = &mut self.phase
        {
            *fade = approach(*fade, 0.0, most);
            if *fade > 0.0 {
                self.output = ContactOutput {
                    state: ContactState::Fading,
                    proxy: *proxy,
                    displacement: *displacement * *fade,
                    converged: true,
                    ..ContactOutput::default()
                };
                return Turn::Ends;
            }
        }
        self.looks_around(window, hip)
    }

    /// By the paper's rule: the first candidate under the segment.
    #[inline(never)]
    fn seeks<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Phase::Seeking { cells, was_late } = &mut self.phase else {
            return Turn::Ends;
        };
        let missing_tile = match cells.find(window, budget) {
            Candidate::At(point) => {
                let fade = if *was_late { 0.0 } else { 1.0 };
                self.phase = Phase::OnSurface(OnSurface::at(point, fade));
                return Turn::GoesOn;
            }
            Candidate::None if cells.to == hip => return self.becomes_free(hip),
            Candidate::None => {
                // The HIP has moved on meanwhile.
                *cells = Candidates::between(cells.to, hip);
                return Turn::GoesOn;
            }
            Candidate::Missing(tile) => Some(tile),
            Candidate::Suspended => None,
        };
        *was_late |= self.settings.execution == Execution::RealTime;
        let from = cells.from;
        self.waits_at(from, missing_tile)
    }

    /// By the paper's rule: the closest point decides about contact.
    fn decides<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        hip: GridPoint,
    ) -> Turn {
        let Phase::OnSurface(on) = &self.phase else {
            return Turn::Ends;
        };
        match on.descent.nearest(window, view) {
            Some((point, z)) if paper::is_inside(window, view, &point, z) => {
                self.touches(window, hip, true, None)
            }
            _ => self.becomes_free(hip),
        }
    }
}

/// Counts a departure, and how it compares with the nearest one before.
fn count_departure(departures: &mut Departures, from: GridPoint, view: &HipView) {
    let Some(before) = departures else {
        *departures = Some(Departed {
            nearest: from,
            in_vain: 0,
            creeping: 0,
        });
        return;
    };
    before.creeping = match view.is_clearly_nearer(&from, &before.nearest) {
        true => 0,
        false => before.creeping + 1,
    };
    if view.is_nearer(&from, &before.nearest) {
        (before.nearest, before.in_vain) = (from, 0);
    } else {
        before.in_vain += 1;
    }
}

/// Where a proxy that has hit the surface may leave it again.
fn may_leave<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    hit: SurfacePoint,
    departures: &Departures,
) -> Leave {
    let is_nearer = |before: &GridPoint| {
        position_on(window, &hit).is_some_and(|position| view.is_nearer(&position, before))
    };
    match departures {
        Some(before) if before.in_vain >= DEPARTURES || before.creeping >= CREEPING => {
            Leave::NoMore(hit)
        }
        Some(before) if !is_nearer(&before.nearest) => Leave::ButAt(hit),
        _ => Leave::Anywhere,
    }
}
