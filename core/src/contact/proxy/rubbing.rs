//! A tick with friction: the proxy is held, or slides behind the HIP.

use super::{Contact, OnSurface, Phase, Turn};
use crate::contact::budget::{ARRIVAL, Budget, SLOPE};
use crate::contact::closest_point::leads_off_surface;
use crate::contact::friction::{Friction, Pull};
use crate::contact::output::ContactState;
use crate::contact::settings::Execution;
use crate::contact::surface::{HipView, SurfacePoint};
use crate::contact::sweep::Path;
use crate::grid::GridPoint;
use crate::rate::TickRate;
use crate::terrain::{TileIndex, Window};

/// Units of work for asking whether friction holds the proxy: what arriving on a border
/// costs.
const CONE: u32 = ARRIVAL + 4 * SLOPE;
/// A proxy that slides sticks again when it has not moved for so long, s: longer than
/// a slow hand waits for its next encoder count.
const STICKS_AFTER_S: f32 = 0.02;
/// Less than this is no motion, cells.
const STILL: f32 = 1e-3;
/// A proxy that has slid is asked for again whether friction holds it there: a crease
/// may have turned the surface under it. By this part it may slide on less far than it
/// would.
const SLACK: f32 = 0.01;
/// Times that a proxy slides in a tick; then it goes for the HIP itself, which is inside
/// of every cone.
const SLIDES: u32 = 3;

/// What a contact with friction remembers.
#[derive(Clone, Debug)]
pub(super) struct Rubbing {
    friction: Friction,
    /// The HIP of the tick.
    pub(super) hip: GridPoint,
    /// What a proxy on the surface goes for in the HIP's place, once that is known.
    aim: Option<GridPoint>,
    /// How often the proxy has slid for this HIP.
    times: u32,
    /// Where the proxy stood when the HIP came to where it is, until it has gone away.
    stood: Option<Stood>,
    /// The boundary fade before the tick: a tick changes it once, however often the proxy
    /// slides.
    fade: f32,
    /// The proxy slides: dynamic friction holds it, not static.
    slides: bool,
    /// How long it has not moved, ticks.
    still: u32,
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
            times: 0,
            stood: None,
            fade: 1.0,
            slides: false,
            still: 0,
        })
    }

    /// What becomes of a proxy that the HIP pulls like this.
    fn judges(&mut self, pull: &Pull, rate: TickRate, now: &GridPoint) -> Verdict {
        let Friction {
            static_mu,
            dynamic_mu,
            viscous_s,
        } = self.friction;
        let drag = viscous_s * rate.hz() as f32;
        let gone = |stood: Stood| drag * stood.proxy.to(now).length();
        let trail = self.stood.filter(|_| drag > 0.0).map_or(0.0, gone);
        let is_held = match self.times {
            0 if self.slides => pull.is_within(dynamic_mu),
            0 => pull.is_within(static_mu),
            _ => pull.is_within_trailing(dynamic_mu * (1.0 + SLACK), trail),
        };
        if is_held {
            return Verdict::Held;
        }
        self.slides = true;
        self.times += 1;
        if self.times > SLIDES {
            return Verdict::Goes(self.hip);
        }
        let back = pull.held_back(dynamic_mu, drag);
        Verdict::Goes(GridPoint::new(self.hip.cell(), self.hip.frac() - back))
    }
}

impl Contact {
    /// [`Contact::step`] with friction.
    #[inline(never)]
    pub(super) fn rub<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) {
        let before = self.output.proxy;
        let Some(rubbing) = &mut self.rubbing else {
            return;
        };
        let has_moved = !rubbing.hip.is_same(&hip);
        if self.at_rest && !has_moved {
            self.output.work = 0;
            return self.counts_stillness(before);
        }
        let mut budget = Budget::new(self.settings.work_per_tick);
        self.remembers_what_was_felt();
        if has_moved {
            self.redirect(window, hip, None, &mut budget);
            self.begins_to_rub(hip);
        }
        self.hip = hip;
        if let (Phase::OnSurface(on), Some(rubbing)) = (&self.phase, &mut self.rubbing) {
            rubbing.fade = on.fade;
        }
        while self.goes_on(window, hip, &mut budget) == Turn::GoesOn {}
        self.at_rest = self.output.converged && self.boundary_fade() == 1.0;
        self.output.work = budget.spent();
        if self.output.state == ContactState::Touching {
            self.output.displacement = hip.to(&self.output.proxy) * self.boundary_fade();
        }
        self.counts_stillness(before);
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
                (rubbing.aim, rubbing.stood) = (None, None);
                self.turn(window, hip, budget)
            }
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
            Verdict::Held => self.stays(window, hip),
            Verdict::Waits(tile) => self.touches(window, hip, false, tile),
            Verdict::Goes(aim) => self.aims_at(aim),
        }
    }

    fn aims_at(&mut self, aim: GridPoint) -> Turn {
        if let (Phase::OnSurface(on), Some(rubbing)) = (&mut self.phase, &mut self.rubbing) {
            rubbing.aim = Some(aim);
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
        let Some((point, _)) = on.descent.nearest(window, &view) else {
            return Verdict::Goes(hip);
        };
        if leads_off_surface(window, &view, &point) {
            return Verdict::Goes(hip);
        }
        match Pull::at(window, &view, &point, waits) {
            Ok(pull) => rubbing.judges(&pull, self.settings.rate, &self.output.proxy),
            Err(tile) => Verdict::Waits(Some(tile)),
        }
    }

    /// The proxy is held where it is.
    fn stays<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Turn {
        let turn = self.touches(window, hip, true, None);
        if let (Some(rubbing), ContactState::Touching) = (&self.rubbing, self.output.state)
            && rubbing.times == 0
            && let Some(stood) = rubbing.stood
        {
            // To the bit: seen from another HIP a height has other last places.
            self.output.proxy = stood.proxy;
        }
        turn
    }

    /// The proxy slides toward its aim.
    fn slides<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        aim: GridPoint,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        self.hip = aim;
        let turn = self.turn(window, aim, budget);
        self.hip = hip;
        match &mut self.phase {
            Phase::Sweeping(sweeping) => {
                sweeping.path = Path::off_surface(sweeping.path.at(), hip);
                turn
            }
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
        if self.has_gone_astray(hip) {
            return Turn::GoesOn;
        }
        if !self.output.converged || aim.is_same(&hip) {
            return Turn::Ends;
        }
        match self.judges(window, hip, budget) {
            Verdict::Held => Turn::Ends,
            Verdict::Goes(aim) => self.aims_at(aim),
            Verdict::Waits(tile) => {
                if let Some(rubbing) = &mut self.rubbing {
                    rubbing.aim = None;
                }
                (self.output.converged, self.output.missing_tile) = (false, tile);
                Turn::Ends
            }
        }
    }

    /// Over rough ground an aim may lead astray, farther from the HIP than the proxy stood:
    /// then it begins there again, and goes for the HIP itself.
    fn has_gone_astray(&mut self, hip: GridPoint) -> bool {
        let Some(rubbing) = &mut self.rubbing else {
            return false;
        };
        match rubbing.stood {
            Some(stood) if HipView::new(hip).is_nearer(&stood.proxy, &self.output.proxy) => {
                (rubbing.aim, rubbing.stood) = (Some(hip), None);
                self.phase = Phase::OnSurface(OnSurface::at(stood.point, rubbing.fade));
                true
            }
            _ => false,
        }
    }

    /// A proxy that slid sticks when it has not moved for a while.
    fn counts_stillness(&mut self, before: GridPoint) {
        let Some(rubbing) = &mut self.rubbing else {
            return;
        };
        if !rubbing.slides || !self.output.converged {
            return;
        }
        let moved = before.to(&self.output.proxy).abs().max_element();
        rubbing.still = if moved > STILL { 0 } else { rubbing.still + 1 };
        let is_touching = self.output.state == ContactState::Touching;
        let still_s = rubbing.still as f32 * self.settings.rate.tick_s();
        rubbing.slides = is_touching && still_s < STICKS_AFTER_S;
    }
}
