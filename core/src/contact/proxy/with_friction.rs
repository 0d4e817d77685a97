//! A tick with friction: the proxy is held, or follows the HIP.

use glam::Vec3;

use super::on_ground::{Came, SurfaceContact};
use super::{Contact, Phase, Turn};
use crate::contact::budget::Budget;
use crate::contact::closest_point::{Leave, position_on};
use crate::contact::friction::{Cone, Friction, Walk, Walked};
use crate::contact::output::ContactState;
use crate::contact::surface::{HipView, SurfacePoint};
use crate::grid::GridPoint;
use crate::terrain::Window;

/// Time without motion after which a sliding proxy sticks again, s: longer than a slow hand needs
/// for its next encoder count.
const STICKS_AFTER_S: f32 = 0.02;

/// State of a contact with friction.
#[derive(Clone, Debug)]
pub(super) struct Rough {
    friction: Friction,
    motion: Motion,
    stage: Stage,
    /// Position of the proxy at the start of the tick, or where it met the surface during the tick.
    from: GridPoint,
    /// The part of the displacement that friction held when the proxy last moved, cells.
    held: Vec3,
}

/// Coefficient that holds the proxy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// The static one.
    Sticks,
    /// The dynamic one: the proxy has moved, and then rested for `still` ticks.
    Slides { still: u32 },
}

/// Stage of a tick's walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The proxy has not moved in this tick: the cone at rest decides.
    Begins,
    /// The proxy has moved along `ways` straight segments, the last `inside` of them within one
    /// patch.
    GoesOn { ways: u32, inside: u32 },
    /// Descent without friction: the proxy moves to the closest point.
    Descends,
}

impl Rough {
    /// Creates the state for a surface with friction; `None` without friction.
    pub(super) fn on(friction: Friction) -> Option<Self> {
        (!friction.is_none()).then(|| Self {
            friction,
            motion: Motion::Sticks,
            stage: Stage::Begins,
            from: GridPoint::default(),
            held: Vec3::ZERO,
        })
    }

    /// Sets the coefficients. Returns true if they have changed.
    pub(super) fn takes(&mut self, friction: Friction) -> bool {
        let is_other = self.friction != friction;
        self.friction = friction;
        is_other
    }

    /// Returns the coefficient that holds a proxy before it moves.
    const fn mu_at_rest(&self) -> f32 {
        match self.motion {
            Motion::Sticks => self.friction.static_mu,
            Motion::Slides { .. } => self.friction.dynamic_mu,
        }
    }
}

impl Contact {
    /// Returns the part of the last displacement that friction holds, not the surface, cells.
    pub(crate) fn held_back(&self) -> Vec3 {
        match &self.rough {
            Some(rough) => rough.held * -self.edge_fade(),
            None => Vec3::ZERO,
        }
    }

    /// [`Contact::step`] with friction.
    #[inline(never)]
    pub(super) fn step_on_rough_ground<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
    ) {
        let mut budget = Budget::new(self.settings.work_per_tick);
        self.remember_contact();
        self.gives_up_beyond_window::<D>(&hip);
        if self.output.converged || !self.hip.is_same(&hip) {
            self.begins_to_walk(window, hip, &mut budget);
        }
        // Bounded by the budget, as without friction.
        while self.walks_on(window, hip, &mut budget) == Turn::GoesOn {}
        self.hip = hip;
        self.ends(&budget);
        self.counts_stillness();
    }

    /// Starts a tick's walk at the proxy.
    fn begins_to_walk<const D: usize>(
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
        match self.output.state {
            ContactState::Touching => self.walks_from(self.output.proxy),
            _ => self.walks_from_here(window),
        }
    }

    /// Starts the walk at the entry of the descent; off the surface, at the last proxy.
    #[inline(never)]
    fn walks_from_here<const D: usize>(&mut self, window: &Window<'_, D>) {
        let at = match &self.phase {
            Phase::OnSurface(on) => position_on(window, &on.descent.entry()),
            _ => None,
        };
        self.walks_from(at.unwrap_or(self.output.proxy));
    }

    /// Starts the walk at a point, from which the motion of the tick is measured.
    fn walks_from(&mut self, at: GridPoint) {
        let Some(rough) = &mut self.rough else { return };
        rough.from = at;
        rough.stage = match rough.friction.is_none() {
            // A material without friction, in a scene with other materials.
            true => Stage::Descends,
            false => Stage::Begins,
        };
    }

    /// Runs one step of the tick.
    fn walks_on<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let was_on_surface = matches!(self.phase, Phase::OnSurface(_));
        match &self.rough {
            Some(Rough { stage, .. }) if was_on_surface && *stage != Stage::Descends => {
                self.follows_the_pull(window, hip, budget)
            }
            _ => {
                let turn = self.turn(window, hip, budget);
                if !was_on_surface && matches!(self.phase, Phase::OnSurface(_)) {
                    self.walks_from_here(window);
                    if let Some(rough) = &mut self.rough {
                        rough.held = Vec3::ZERO;
                    }
                }
                turn
            }
        }
    }

    /// Moves the proxy on the surface as far as friction allows.
    #[inline(never)]
    fn follows_the_pull<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let (Phase::OnSurface(on), Some(rough)) = (&mut self.phase, &mut self.rough) else {
            return Turn::Ends;
        };
        let cone = Cone {
            mu: rough.friction.dynamic_mu,
            drag: rough.friction.viscous_s * self.settings.rate.hz() as f32,
            from: rough.from,
        };
        let (at_rest, ways, inside) = match rough.stage {
            Stage::GoesOn { ways, inside } => (None, ways, inside),
            _ => (Some(rough.mu_at_rest()), 0, 0),
        };
        let begun_at = on.descent.entry();
        let mut walk = Walk {
            point: begun_at,
            at_rest,
            ways,
            inside,
            held: rough.held,
        };
        let walked = walk.advance(window, &HipView::new(hip), &cone, &on.leave, budget);
        if walk.at_rest.is_none() {
            rough.stage = Stage::GoesOn {
                ways: walk.ways,
                inside: walk.inside,
            };
        }
        rough.held = walk.held;
        if walk.point != begun_at {
            if rough.motion == Motion::Sticks {
                rough.motion = Motion::Slides { still: 0 };
            }
            on.descent.restart(walk.point);
        }
        match walked {
            Walked::Rests => self.is_held_at(window, hip, walk.point, Came::ToRest, budget),
            Walked::Missing => {
                self.is_held_at(window, hip, walk.point, Came::ToMissingTile, budget)
            }
            Walked::Suspended => {
                self.is_held_at(window, hip, walk.point, Came::AsFarAsWork, budget)
            }
            Walked::Leaves => self.leaves(window, &HipView::new(hip), hip),
            Walked::Off => {
                (rough.stage, rough.held) = (Stage::Descends, Vec3::ZERO);
                Turn::GoesOn
            }
        }
    }

    /// Sets the output of a proxy on a surface with friction. Its position is computed from the
    /// surface, not from the HIP, so a held proxy has the same bits for every HIP.
    #[inline(never)]
    pub(super) fn is_held_at<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        point: SurfacePoint,
        came: Came,
        budget: &mut Budget,
    ) -> Turn {
        let Some(proxy) = position_on(window, &point) else {
            return Turn::Ends;
        };
        let touched = SurfaceContact {
            point,
            proxy,
            displacement: hip.to(&proxy),
        };
        self.touches_at(window, hip, touched, came, budget)
    }

    /// Counts the ticks without motion, by converged outputs, and clears `at_rest` while the proxy
    /// may still move.
    fn counts_stillness(&mut self) {
        let before = self.touched.map(|(proxy, _)| proxy);
        let tick_s = self.settings.rate.tick_s();
        let least_way = self.settings.sticks_below * tick_s;
        let Some(rough) = &mut self.rough else { return };
        if !self.output.converged {
            return;
        }
        if self.output.state != ContactState::Touching {
            rough.motion = Motion::Sticks;
            return;
        }
        let way = before.map(|before| before.to(&self.output.proxy).abs().max_element());
        if let Motion::Slides { still } = &mut rough.motion {
            let is_still = way.is_some_and(|way| way <= least_way);
            *still = if is_still { *still + 1 } else { 0 };
            if (*still as f32) * tick_s >= STICKS_AFTER_S {
                rough.motion = Motion::Sticks;
            }
        }
        // Viscous friction ends with the motion, so the proxy continues to creep after the HIP
        // rests.
        let creeps = rough.friction.viscous_s > 0.0 && way != Some(0.0);
        self.at_rest &= rough.motion == Motion::Sticks && !creeps;
    }
}
