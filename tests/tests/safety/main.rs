//! Protection of the hand: the guard in the closed loop, injected faults, limits.

mod campaign;
mod campaign_force_invariants;
mod campaign_tick_invariants;
mod dead_encoder_threshold;
mod force_clamp;
mod guard;
