//! A tick with friction: the proxy is held, or slides behind the HIP.

use glam::Vec3;

use super::{Contact, OnSurface, Phase, Turn};
use crate::contact::budget::{Budget, LARGEST_PIECE};
use crate::contact::closest_point::{Descent, Leave, position_on};
use crate::contact::friction::{Came, Friction, Pull, Pulled, border};
use crate::contact::output::ContactState;
use crate::contact::settings::Execution;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::contact::tolerance::RESOLUTION;
use crate::grid::GridPoint;
use crate::rate::TickRate;
use crate::scalar::root;
use crate::terrain::{Ground, TileIndex, Window};

/// Units of work for asking whether friction holds the proxy: what arriving on a border
/// costs.
const CONE: u32 = LARGEST_PIECE;
/// A proxy that slides sticks again when it has not moved for so long, s: longer than
/// a slow hand waits for its next encoder count.
const STICKS_AFTER_S: f32 = 0.02;
/// Less than this is no motion, cells.
const STILL: f32 = 1e-3;
/// A proxy that has slid is asked for again whether friction holds it there: a crease may have
/// turned the surface under it. By this part more than dry friction holds may pull it, and by this
/// part less than all of friction does.
const SLACK: f32 = 0.03;
/// Times that a proxy slides for a HIP. Then it returns to the last place where friction held it,
/// or, if there is none, goes for the HIP itself, which is inside of every cone.
const SLIDES: u32 = 6;

/// What a contact with friction remembers.
#[derive(Clone, Debug)]
pub(super) struct Rubbing {
    friction: Friction,
    /// The HIP of the tick.
    pub(super) hip: GridPoint,
    /// What a proxy on the surface goes for in the HIP's place, once that is known.
    aim: Option<GridPoint>,
    /// From the last aim to the HIP that it stood for, cells: how far friction held the proxy
    /// back when it last slid. Zero where the aim was the HIP.
    back: Vec3,
    /// How often the proxy has slid for this HIP.
    times: u32,
    /// Where the proxy stood when the HIP came to where it is, until it has gone away.
    stood: Option<Stood>,
    /// The last place where friction held it and which it has gone back from, and how far it was held
    /// back there, cells.
    came_to: Option<(SurfacePoint, Vec3)>,
    /// The boundary fade before the tick: a tick changes it once, however often the proxy
    /// slides.
    fade: f32,
    /// The proxy slides: dynamic friction holds it, not static.
    slides: bool,
    /// Its motion in the last tick held it back, too: it goes on though the HIP rests.
    creeps: bool,
    /// How long it has not moved, ticks.
    still: u32,
    /// There is nothing left to do while the HIP does not move. ([`Contact`] has a flag for
    /// this, too; a proxy that rubs counts its ticks at rest.)
    at_rest: bool,
}

/// A proxy that was felt on the surface.
#[derive(Clone, Copy, Debug)]
struct Stood {
    point: SurfacePoint,
    proxy: GridPoint,
}

/// What becomes of a proxy on the surface.
enum Verdict {
    /// Friction holds it where it is.
    Held,
    /// It goes for this point.
    Goes(GridPoint),
    /// It returns to this point, where it was held before.
    Returns(SurfacePoint),
    /// It cannot be told in this tick; a tile that is missing, if that is why.
    Waits(Option<TileIndex>),
}

impl Rubbing {
    /// Of a surface that is rough.
    pub(super) fn on(friction: Friction) -> Option<Self> {
        (!friction.is_none()).then(|| Self {
            friction,
            hip: GridPoint::default(),
            aim: None,
            back: Vec3::ZERO,
            times: 0,
            stood: None,
            came_to: None,
            fade: 1.0,
            slides: false,
            creeps: false,
            still: 0,
            at_rest: false,
        })
    }

    /// The surface has moved: the proxy is judged again, also for a HIP that has not.
    pub(super) fn surface_moved(&mut self) {
        (self.at_rest, self.creeps) = (false, true);
    }

    /// Takes other coefficients. Returns whether they are others.
    pub(super) fn takes(&mut self, friction: Friction) -> bool {
        let is_other = self.friction != friction;
        if is_other {
            self.friction = friction;
            self.surface_moved();
        }
        is_other
    }

    /// In the middle of a tick a proxy may be farther from the HIP than where the tick ends: it is
    /// where it stood, then.
    #[inline(never)]
    fn not_farther(&self, here: Stood) -> Stood {
        let stood = self.stood;
        stood
            .filter(|_| self.stood_nearer_than(&here.proxy))
            .unwrap_or(here)
    }

    /// One more tick. A proxy that slid sticks when it has not moved for a while.
    fn counts(&mut self, is_still: bool, rate: TickRate) {
        if self.slides {
            self.still = if is_still { self.still + 1 } else { 0 };
            self.slides = (self.still as f32) * rate.tick_s() < STICKS_AFTER_S;
        }
    }

    /// What becomes of a proxy that the HIP pulls like this, before it has slid for it.
    fn judges(&mut self, pull: &Pull, rate: TickRate) -> Verdict {
        let Friction {
            static_mu,
            dynamic_mu,
            ..
        } = self.friction;
        if pull.is_within(if self.slides { dynamic_mu } else { static_mu }) {
            return Verdict::Held;
        }
        self.goes(pull.held_back(dynamic_mu, self.drag(rate)))
    }

    /// The same of one that has slid to where it is.
    #[inline(never)]
    fn judges_again<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        descent: &mut Descent,
        pull: &Pull,
        rate: TickRate,
    ) -> Verdict {
        let (mu, drag) = (self.friction.dynamic_mu, self.drag(rate));
        let point = descent.entry();
        let way = match (&self.stood, position_on(window, &point)) {
            (Some(stood), Some(here)) => stood.proxy.to(&here),
            _ => Vec3::ZERO,
        };
        let length = root(way.length_squared());
        let came = Came { way, length };
        // The way is known to the last places of both its ends, and the proxy came here by an aim
        // that is known to the last place of how far it was held back.
        let places = RESOLUTION * (8.0 + 4.0 * self.back.abs().element_sum());
        let (pulls, dry) = pull.along_and_held_by(mu);
        let is_held = pulls < (1.0 + SLACK) * dry + drag * (length + places);
        let is_inside = border(&point) == Side::NONE;
        let least = (1.0 - SLACK) * (dry + drag * length) - drag * places;
        let has_passed = is_held && is_inside && self.times < SLIDES && pulls < least;
        if is_held && !has_passed {
            self.came_to = None;
            return Verdict::Held;
        }
        if is_inside && let Some(way) = pull.rest_of_way(came, (pulls, dry), (mu, drag), SLACK) {
            let there = point.moved_to(point.u + way.x, point.v + way.y);
            // Only a way back leads farther from the HIP.
            if border(&there) == Side::NONE && (!is_held || self.may_go_to(window, &there)) {
                (self.back, self.came_to) = (pull.along() - way, None);
                descent.restart(there);
                return Verdict::Held;
            }
        }
        if !is_held && let Some(verdict) = self.stays_in_crease(window, &point) {
            return verdict;
        }
        let has_slid_enough = !is_held && self.times >= SLIDES;
        if has_slid_enough && let Some(point) = self.returns() {
            return Verdict::Returns(point);
        }
        if is_held {
            self.came_to = Some((point, self.back));
        }
        self.goes(match is_held {
            true => pull.held_back_on_plane(came.way, mu, drag),
            false => pull.held_back(mu, drag),
        })
    }

    /// Whether the proxy stood nearer to the HIP than a place.
    #[inline(never)]
    fn stood_nearer_than(&self, place: &GridPoint) -> bool {
        let stood = self.stood.as_ref();
        stood.is_some_and(|stood| HipView::new(self.hip).is_nearer(&stood.proxy, place))
    }

    /// Back to where its way back left the patch that it had come to, if it did, and that is no
    /// farther from the HIP than it stood: friction that holds on one side of a crease and not on the
    /// other may hold in it.
    #[inline(never)]
    fn stays_in_crease<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        here: &SurfacePoint,
    ) -> Option<Verdict> {
        let (came_to, back) = self.came_to?;
        if self.times >= SLIDES {
            return None;
        }
        let crease = came_to.leaves_toward(here)?;
        if let Ground::Missing = window.ground(crease.cell) {
            // In lock-step the window may have given it up meanwhile.
            return Some(Verdict::Waits(Some(TileIndex::holding(crease.cell))));
        }
        let may = self.may_go_to(window, &crease);
        may.then(|| {
            (self.aim, self.back) = (None, back);
            Verdict::Returns(crease)
        })
    }

    /// Whether a place is no farther from the HIP than where the proxy stood.
    #[inline(never)]
    fn may_go_to<const D: usize>(&self, window: &Window<'_, D>, point: &SurfacePoint) -> bool {
        position_on(window, point).is_some_and(|place| !self.stood_nearer_than(&place))
    }

    /// Returns to where it went back from, if it did.
    fn returns(&mut self) -> Option<SurfacePoint> {
        let (point, back) = self.came_to.take()?;
        (self.aim, self.times, self.back) = (None, SLIDES, back);
        Some(point)
    }

    /// It slides for the HIP, held back by so much.
    #[inline(never)]
    fn goes(&mut self, back: Vec3) -> Verdict {
        self.slides = true;
        self.times += 1;
        if self.times > SLIDES {
            return Verdict::Goes(self.hip);
        }
        Verdict::Goes(GridPoint::new(self.hip.cell(), self.hip.frac() - back))
    }

    /// By how many times its way in a tick the proxy trails.
    fn drag(&self, rate: TickRate) -> f32 {
        self.friction.viscous_s * rate.hz() as f32
    }
}

impl Contact {
    /// The part of the last displacement that friction holds rather than the surface, cells: as
    /// it was when the proxy last slid.
    pub(crate) fn held_back(&self) -> Vec3 {
        match &self.rubbing {
            Some(rubbing) => rubbing.back * -self.boundary_fade(),
            None => Vec3::ZERO,
        }
    }

    /// Where a proxy on rough ground began to slide for the last HIP, if it was felt: where it
    /// stood, or where it came down to the surface. After a tick that left work over, where that
    /// tick ended.
    #[must_use]
    pub fn slid_from(&self) -> Option<&GridPoint> {
        let stood = self.rubbing.as_ref()?.stood.as_ref()?;
        Some(&stood.proxy)
    }

    /// [`Contact::step`] with friction.
    #[inline(never)]
    pub(super) fn rub<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) {
        let Some(rubbing) = &mut self.rubbing else {
            return;
        };
        let has_moved = rubbing.creeps || !rubbing.hip.is_same(&hip);
        if rubbing.at_rest && !has_moved {
            self.output.work = 0;
            return rubbing.counts(true, self.settings.rate);
        }
        let mut budget = Budget::new(self.settings.work_per_tick);
        self.remembers_what_was_felt();
        // While a force comes in, a tick that follows one which ended begins anew, too: the proxy
        // stands where that one left it.
        if has_moved || self.output.converged {
            self.begins_anew(window, hip, &mut budget);
            self.begins_to_rub(hip);
        }
        if let (Phase::OnSurface(on), Some(rubbing)) = (&self.phase, &mut self.rubbing) {
            rubbing.fade = on.fade;
        }
        while self.goes_on(window, hip, &mut budget) == Turn::GoesOn {}
        self.hip = hip;
        self.output.work = budget.spent();
        self.answers_from_the_surface(window);
        self.counts_stillness();
    }

    /// In contact the answer is told from the surface, not as the HIP or an aim sees it: a
    /// proxy that stays has the same bits for every HIP.
    fn answers_from_the_surface<const D: usize>(&mut self, window: &Window<'_, D>) {
        let Some(rubbing) = &mut self.rubbing else {
            return;
        };
        let has_ended = self.output.converged;
        rubbing.at_rest = has_ended;
        rubbing.creeps = has_ended && rubbing.times > 0 && rubbing.friction.viscous_s > 0.0;
        let Phase::OnSurface(on) = &self.phase else {
            rubbing.at_rest &= !matches!(self.phase, Phase::Fading { .. });
            if self.settings.execution == Execution::RealTime {
                rubbing.came_to = None;
            }
            return;
        };
        rubbing.at_rest &= on.fade == 1.0;
        let point = match has_ended {
            true => Some(on.descent.entry()),
            false => {
                let nearest = on.descent.nearest(window, &HipView::new(rubbing.hip));
                nearest.map(|(point, _)| point)
            }
        };
        if let Some(point) = point
            && let Some(mut proxy) = position_on(window, &point)
        {
            if has_ended {
                rubbing.aim = None;
            } else {
                let here = Stood { point, proxy };
                let place = rubbing.not_farther(here);
                proxy = place.proxy;
                if self.settings.execution == Execution::RealTime {
                    (rubbing.stood, rubbing.came_to) = (Some(place), None);
                }
            }
            self.output.proxy = proxy;
            self.output.displacement = rubbing.hip.to(&proxy) * on.fade;
        }
    }

    /// The HIP has moved: a way under way leads to its new place. A proxy that had come to
    /// its end begins where it is, without another look at where that is.
    fn begins_anew<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) {
        match &mut self.phase {
            Phase::OnSurface(on) if self.output.converged => {
                on.descent.restart(on.descent.entry());
                (on.leave, on.departures) = (Leave::Anywhere, None);
            }
            _ => self.redirect(window, hip, None, budget),
        }
    }

    /// The HIP has moved: where the proxy stands, if it was felt on the surface.
    fn begins_to_rub(&mut self, hip: GridPoint) {
        let Some(rubbing) = &mut self.rubbing else {
            return;
        };
        let stood = match &self.phase {
            Phase::OnSurface(on) if self.output.state == ContactState::Touching => Some(Stood {
                point: on.descent.entry(),
                proxy: self.output.proxy,
            }),
            _ => None,
        };
        (rubbing.hip, rubbing.aim, rubbing.times, rubbing.stood) = (hip, None, 0, stood);
        rubbing.came_to = None;
    }

    /// One step of a tick. In the air the HIP itself is the aim.
    fn goes_on<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Some(rubbing) = &mut self.rubbing else {
            return Turn::Ends;
        };
        match (&self.phase, rubbing.aim) {
            (Phase::OnSurface(_), None) => self.is_held(window, hip, budget),
            (Phase::OnSurface(_), Some(aim)) => self.slides(window, aim, hip, budget),
            _ => {
                (rubbing.aim, rubbing.stood, rubbing.came_to) = (None, None, None);
                rubbing.back = Vec3::ZERO;
                let turn = self.turn_toward(window, hip, budget);
                self.has_landed(window);
                turn
            }
        }
    }

    /// As [`Self::turn`], which is inlined where it is called: once is enough here.
    #[inline(never)]
    fn turn_toward<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        aim: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        self.turn(window, aim, budget)
    }

    /// A proxy that came out of the air stands where it met the surface.
    fn has_landed<const D: usize>(&mut self, window: &Window<'_, D>) {
        if let (Phase::OnSurface(on), Some(rubbing)) = (&self.phase, &mut self.rubbing) {
            let point = on.descent.entry();
            rubbing.fade = on.fade;
            rubbing.stood = position_on(window, &point).map(|proxy| Stood { point, proxy });
        }
    }

    /// A proxy that has come to the surface, or was there before: is it held?
    fn is_held<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        match self.judges(window, hip, budget) {
            Verdict::Held => self.touches(window, hip, true, None),
            Verdict::Waits(tile) => {
                // Also where the patch that it is on is in the tile that is missing.
                (self.output.converged, self.output.missing_tile) = (false, tile);
                self.touches(window, hip, false, tile)
            }
            Verdict::Goes(aim) => self.aims_at(aim),
            Verdict::Returns(point) => self.returns_to(point),
        }
    }

    /// It is judged there once more, to the precision of before. Where it was in the air meanwhile,
    /// the way that it slid is another, and it may go for the HIP after all.
    fn returns_to(&mut self, point: SurfacePoint) -> Turn {
        self.begins_at(point);
        Turn::GoesOn
    }

    /// It begins at this point, with the fade from before the tick.
    #[inline(never)]
    fn begins_at(&mut self, point: SurfacePoint) {
        if let Some(rubbing) = &self.rubbing {
            self.phase = Phase::OnSurface(OnSurface::at(point, rubbing.fade));
        }
    }

    fn aims_at(&mut self, aim: GridPoint) -> Turn {
        if let (Phase::OnSurface(on), Some(rubbing)) = (&mut self.phase, &mut self.rubbing) {
            rubbing.aim = Some(aim);
            rubbing.back = aim.to(&rubbing.hip);
            on.fade = rubbing.fade;
        }
        Turn::GoesOn
    }

    /// What becomes of the proxy where it is.
    fn judges<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Verdict {
        let view = HipView::new(hip);
        let waits = self.settings.execution == Execution::LockStep;
        let (Phase::OnSurface(on), Some(rubbing)) = (&mut self.phase, &mut self.rubbing) else {
            return Verdict::Waits(None);
        };
        if !budget.has(CONE) {
            return Verdict::Waits(None);
        }
        budget.spend(CONE);
        let point = on.descent.entry();
        match Pull::at(window, &view, &point) {
            Pulled::By(pull) => {
                let rate = self.settings.rate;
                if rubbing.times == 0 {
                    return rubbing.judges(&pull, rate);
                }
                rubbing.judges_again(window, &mut on.descent, &pull, rate)
            }
            Pulled::Unknown(tile) if waits => Verdict::Waits(Some(tile)),
            // Without a patch there is no friction. Before a missing tile the proxy is held
            // where it has come to; what lies beyond is not known.
            Pulled::Off | Pulled::Unknown(_) => Verdict::Goes(hip),
        }
    }

    /// The proxy slides toward its aim.
    fn slides<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        aim: GridPoint,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let turn = self.turn_toward(window, aim, budget);
        if let Phase::Sweeping(sweeping) = &mut self.phase {
            let from = sweeping.path.at();
            sweeping.path.begin_toward(hip);
            // Astray or not, the tick goes on.
            let _ = self.has_gone_astray(hip, from);
            return Turn::GoesOn;
        }
        match &self.phase {
            _ if turn == Turn::GoesOn => turn,
            Phase::OnSurface(_) => self.has_slid(window, aim, hip, budget),
            Phase::Fading { .. } => turn,
            _ => self.looks_around(window, hip),
        }
    }

    /// The proxy has slid: may it stay where it has come to?
    fn has_slid<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        aim: GridPoint,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        // In lock-step a tick that goes on later does not count.
        let counts = self.output.converged || self.settings.execution == Execution::RealTime;
        if counts && self.has_gone_astray(hip, self.output.proxy) {
            return Turn::GoesOn;
        }
        if !self.output.converged || aim.is_same(&hip) {
            return Turn::Ends;
        }
        if let Phase::OnSurface(on) = &mut self.phase {
            // What it knows of its patch is as seen from the aim.
            on.descent.restart(on.descent.entry());
        }
        match self.judges(window, hip, budget) {
            Verdict::Held => Turn::Ends,
            Verdict::Goes(aim) => self.aims_at(aim),
            Verdict::Returns(point) => self.returns_to(point),
            Verdict::Waits(tile) => {
                self.waits_to_be_judged();
                (self.output.converged, self.output.missing_tile) = (false, tile);
                Turn::Ends
            }
        }
    }

    /// It cannot be told yet whether the proxy is held. In lock-step the tick does not count.
    fn waits_to_be_judged(&mut self) {
        if let (Phase::OnSurface(on), Some(rubbing)) = (&mut self.phase, &mut self.rubbing) {
            rubbing.aim = None;
            if self.settings.execution == Execution::LockStep {
                on.fade = rubbing.fade;
            }
        }
    }

    /// Over rough ground an aim may lead astray, farther from the HIP than the proxy stood:
    /// then it begins there again, and goes for the HIP itself. One that was going back stays where it
    /// had come to.
    fn has_gone_astray(&mut self, hip: GridPoint, to: GridPoint) -> bool {
        let Some(rubbing) = &mut self.rubbing else {
            return false;
        };
        match rubbing.stood {
            // Once for a HIP: after that its only aim is the HIP.
            Some(stood) if rubbing.times <= SLIDES && rubbing.stood_nearer_than(&to) => {
                let from = match rubbing.returns() {
                    Some(point) => point,
                    None => {
                        (rubbing.aim, rubbing.times) = (Some(hip), SLIDES + 1);
                        rubbing.back = Vec3::ZERO;
                        stood.point
                    }
                };
                self.begins_at(from);
                true
            }
            _ => false,
        }
    }

    /// Whether the proxy has moved, by the last answers that counted.
    fn counts_stillness(&mut self) {
        let is_touching = self.output.state == ContactState::Touching;
        let Some(rubbing) = &mut self.rubbing else {
            return;
        };
        match self.felt {
            _ if !self.output.converged => {}
            Some((before, _)) if is_touching => {
                let way = before.to(&self.output.proxy).abs().max_element();
                rubbing.counts(way <= STILL, self.settings.rate);
            }
            _ => (rubbing.slides, rubbing.still) = (rubbing.slides && is_touching, 0),
        }
    }
}
