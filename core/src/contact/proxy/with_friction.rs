//! A tick with friction: the proxy is held, or follows the HIP.

use glam::Vec3;

use super::on_ground::{Completion, SurfaceContact};
use super::{Contact, Phase, TickProgress};
use crate::contact::budget::Budget;
use crate::contact::closest_point::{DepartureRule, position_on};
use crate::contact::friction::{Cone, Friction, Walk, WalkEnd};
use crate::contact::output::ContactState;
use crate::contact::surface::{HipView, SurfacePoint};
use crate::grid::GridPoint;
use crate::terrain::Window;

/// Time without motion after which a sliding proxy sticks again, s: longer than a slow hand needs
/// for its next encoder count.
const STICK_AFTER_S: f32 = 0.02;

/// State of a contact with friction.
#[derive(Clone, Debug)]
pub(super) struct FrictionState {
    friction: Friction,
    motion: Motion,
    stage: WalkStage,
    /// Position of the proxy at the start of the tick, or where it met the surface during the tick.
    from: GridPoint,
    /// The part of the displacement that friction held when the proxy last moved, cells.
    friction_displacement: Vec3,
}

/// Coefficient that holds the proxy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// The static one.
    Sticking,
    /// The dynamic one: the proxy has moved, and then rested for `still_ticks` ticks.
    Sliding { still_ticks: u32 },
}

/// Stage of a tick's walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WalkStage {
    /// The proxy has not moved in this tick: the cone at rest decides.
    AtStart,
    /// The proxy has moved along `paths` straight segments, the last `paths_inside` of them within
    /// one patch.
    Walking { paths: u32, paths_inside: u32 },
    /// Descent without friction: the proxy moves to the closest point.
    Frictionless,
}

impl FrictionState {
    /// Creates the state for a surface with friction; `None` without friction.
    pub(super) fn on(friction: Friction) -> Option<Self> {
        (!friction.is_none()).then(|| Self {
            friction,
            motion: Motion::Sticking,
            stage: WalkStage::AtStart,
            from: GridPoint::default(),
            friction_displacement: Vec3::ZERO,
        })
    }

    /// Sets the coefficients. Returns true if they have changed.
    pub(super) fn set_friction(&mut self, friction: Friction) -> bool {
        let is_other = self.friction != friction;
        self.friction = friction;
        is_other
    }

    /// Returns the coefficient that holds a proxy before it moves.
    const fn mu_at_rest(&self) -> f32 {
        match self.motion {
            Motion::Sticking => self.friction.static_mu,
            Motion::Sliding { .. } => self.friction.dynamic_mu,
        }
    }
}

impl Contact {
    /// Returns the part of the last displacement that friction holds, not the surface, cells.
    pub(crate) fn friction_displacement(&self) -> Vec3 {
        match &self.friction {
            Some(state) => state.friction_displacement * -self.edge_fade(),
            None => Vec3::ZERO,
        }
    }

    /// [`Contact::step`] with friction.
    #[inline(never)]
    pub(super) fn step_with_friction<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
    ) {
        let mut budget = Budget::new(self.settings.work_per_tick);
        self.remember_contact();
        self.reset_beyond_window::<D>(&hip);
        if self.output.converged || !self.hip.is_same(&hip) {
            self.start_walk(window, hip, &mut budget);
        }
        // Bounded by the budget, as without friction.
        while self.continue_walk(window, hip, &mut budget) == TickProgress::Continue {}
        self.hip = hip;
        self.end_tick(&budget);
        self.count_still_ticks();
    }

    /// Starts a tick's walk at the proxy.
    fn start_walk<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) {
        match &mut self.phase {
            Phase::OnSurface(on) if self.output.converged => {
                on.descent.restart(on.descent.entry());
                (on.departure_rule, on.departures) = (DepartureRule::Anywhere, None);
            }
            _ => self.redirect(window, hip, None, budget),
        }
        match self.output.state {
            ContactState::Touching => self.walk_from(self.output.proxy),
            _ => self.walk_from_entry(window),
        }
    }

    /// Starts the walk at the entry of the descent; off the surface, at the last proxy.
    #[inline(never)]
    fn walk_from_entry<const D: usize>(&mut self, window: &Window<'_, D>) {
        let at = match &self.phase {
            Phase::OnSurface(on) => position_on(window, &on.descent.entry()),
            _ => None,
        };
        self.walk_from(at.unwrap_or(self.output.proxy));
    }

    /// Starts the walk at a point, from which the motion of the tick is measured.
    fn walk_from(&mut self, at: GridPoint) {
        let Some(state) = &mut self.friction else {
            return;
        };
        state.from = at;
        state.stage = match state.friction.is_none() {
            // A material without friction, in a scene with other materials.
            true => WalkStage::Frictionless,
            false => WalkStage::AtStart,
        };
    }

    /// Runs one step of the tick.
    fn continue_walk<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        let was_on_surface = matches!(self.phase, Phase::OnSurface(_));
        match &self.friction {
            Some(FrictionState { stage, .. })
                if was_on_surface && *stage != WalkStage::Frictionless =>
            {
                self.follow_pull(window, hip, budget)
            }
            _ => {
                let progress = self.advance_phase(window, hip, budget);
                if !was_on_surface && matches!(self.phase, Phase::OnSurface(_)) {
                    self.walk_from_entry(window);
                    if let Some(state) = &mut self.friction {
                        state.friction_displacement = Vec3::ZERO;
                    }
                }
                progress
            }
        }
    }

    /// Moves the proxy on the surface as far as friction allows.
    #[inline(never)]
    fn follow_pull<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        let (Phase::OnSurface(on), Some(state)) = (&mut self.phase, &mut self.friction) else {
            return TickProgress::Done;
        };
        let cone = Cone {
            mu: state.friction.dynamic_mu,
            drag: state.friction.viscous_s * self.settings.rate.hz() as f32,
            from: state.from,
        };
        let (at_rest, paths, paths_inside) = match state.stage {
            WalkStage::Walking {
                paths,
                paths_inside,
            } => (None, paths, paths_inside),
            _ => (Some(state.mu_at_rest()), 0, 0),
        };
        let start = on.descent.entry();
        let mut walk = Walk {
            point: start,
            at_rest,
            paths,
            paths_inside,
            friction_displacement: state.friction_displacement,
        };
        let walk_end = walk.advance(
            window,
            &HipView::new(hip),
            &cone,
            &on.departure_rule,
            budget,
        );
        if walk.at_rest.is_none() {
            state.stage = WalkStage::Walking {
                paths: walk.paths,
                paths_inside: walk.paths_inside,
            };
        }
        state.friction_displacement = walk.friction_displacement;
        if walk.point != start {
            if state.motion == Motion::Sticking {
                state.motion = Motion::Sliding { still_ticks: 0 };
            }
            on.descent.restart(walk.point);
        }
        match walk_end {
            WalkEnd::AtRest => {
                self.touch_with_friction(window, hip, walk.point, Completion::Converged, budget)
            }
            WalkEnd::MissingTile => {
                self.touch_with_friction(window, hip, walk.point, Completion::MissingTile, budget)
            }
            WalkEnd::Suspended => {
                self.touch_with_friction(window, hip, walk.point, Completion::Suspended, budget)
            }
            WalkEnd::Departure => self.depart(window, &HipView::new(hip), hip),
            WalkEnd::NoSurface => {
                (state.stage, state.friction_displacement) = (WalkStage::Frictionless, Vec3::ZERO);
                TickProgress::Continue
            }
        }
    }

    /// Sets the output of a proxy on a surface with friction. Its position is computed from the
    /// surface, not from the HIP, so a held proxy has the same bits for every HIP.
    #[inline(never)]
    pub(super) fn touch_with_friction<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        point: SurfacePoint,
        completion: Completion,
        budget: &mut Budget,
    ) -> TickProgress {
        let Some(proxy) = position_on(window, &point) else {
            return TickProgress::Done;
        };
        let touched = SurfaceContact {
            point,
            proxy,
            displacement: hip.to(&proxy),
        };
        self.touch_at(window, hip, touched, completion, budget)
    }

    /// Counts the ticks without motion, by converged outputs, and clears `at_rest` while the proxy
    /// may still move.
    fn count_still_ticks(&mut self) {
        let before = self.last_touch.map(|(proxy, _)| proxy);
        let tick_s = self.settings.rate.tick_s();
        let max_still_cells = self.settings.stick_speed * tick_s;
        let Some(state) = &mut self.friction else {
            return;
        };
        if !self.output.converged {
            return;
        }
        if self.output.state != ContactState::Touching {
            state.motion = Motion::Sticking;
            return;
        }
        let moved = before.map(|before| before.to(&self.output.proxy).abs().max_element());
        if let Motion::Sliding { still_ticks } = &mut state.motion {
            let is_still = moved.is_some_and(|moved| moved <= max_still_cells);
            *still_ticks = if is_still { *still_ticks + 1 } else { 0 };
            if (*still_ticks as f32) * tick_s >= STICK_AFTER_S {
                state.motion = Motion::Sticking;
            }
        }
        // Viscous friction ends with the motion, so the proxy continues to creep after the HIP
        // rests.
        let creeps = state.friction.viscous_s > 0.0 && moved != Some(0.0);
        self.at_rest &= state.motion == Motion::Sticking && !creeps;
    }
}
