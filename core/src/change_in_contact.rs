//! A change of placement under a pressing hand: the force stays, and no clutch opens.
//!
//! The old placement is rendered until the fallback of the new one has arrived. Then, between two
//! ticks, the new terrain is put under the hand: the proxy is at the same place of the ground, and
//! the HIP is under it as before. The fallback is higher or lower there than the ground, so the
//! force would make a step. It begins as it was, and changes at the rate at which the surface blends
//! to the tiles that arrive: both together leave it nearly the same. If the tiles stay, nothing
//! blends, and the force changes as slowly as that of a closing clutch. The passivity controller
//! starts anew, as after an open clutch.
//!
//! A hand that lifts off before the change keeps the old placement; the host then opens the clutch,
//! or cancels the change.

use glam::Vec3;

use crate::contact::surface::patch::Patch;
use crate::force::SurfaceParams;
use crate::grid::{Cell, GridPoint};
use crate::guard::Mode;
use crate::haptics::Haptics;
use crate::phantom::Pose;
use crate::renderer::ContactOnset;
use crate::scalar::larger;
use crate::scene::{ContactMap, SceneChange, Source};
use crate::terrain::{BLEND_MM_S, Corners};
use crate::tick::place;

/// Maximum rise of the ground under the hand after a change, mm.
const MAX_GROUND_RISE_MM: f32 = 1.0;
/// Maximum depth, in addition to twice the depth before, under a surface that is too high, mm.
const MAX_EXTRA_DEPTH_MM: f32 = 5.0;

impl<const D: usize> Haptics<'_, D> {
    /// Stores a change until its terrain has arrived.
    pub(crate) fn wait_for_change(&mut self, change: &SceneChange) {
        let fallback = self.needs_fallback(change).then_some(change.scene.fallback);
        let fallback = fallback.flatten();
        self.window.expect_fallback(fallback, change.scene.level);
        self.pending = Some(*change);
        self.clutch.wait_for_change();
    }

    /// Forgets the pending change, if any.
    pub(crate) fn cancel_change(&mut self) {
        if self.pending.take().is_some() {
            self.window.expect_fallback(None, 0);
        }
    }

    /// Forgets the pending change if it has this number.
    pub(crate) fn cancel_change_numbered(&mut self, number: u8) {
        if self.pending.is_some_and(|change| change.number == number) {
            self.cancel_change();
        }
    }

    /// Returns true if the new placement has another fallback than the current one.
    pub(crate) fn needs_fallback(&self, change: &SceneChange) -> bool {
        let before = self.scene.and_then(|scene| scene.fallback);
        !change.keeps_tiles || before != change.scene.fallback
    }

    /// Runs a tick of a clutch that is not closed: makes a pending change, if it is possible now,
    /// and returns the HIP. `None` without a scene.
    #[cold]
    #[inline(never)]
    pub(crate) fn tick_clutch(&mut self, pose: &Pose) -> Option<GridPoint> {
        if let Some(change) = self.pending {
            if self.clutch.is_open() {
                self.pending = None;
                self.apply_change(&change);
            } else if let Some((onset, step_n)) = self.onset_in_contact(&change) {
                self.pending = None;
                self.change_in_contact(&change, onset, pose);
                self.clutch.turn_from(self.guard.force_n(), step_n);
            }
        }
        let (Some(mechanism), Some(scene)) = (&self.mechanism, &mut self.scene) else {
            return None;
        };
        let tip = place(mechanism, scene, pose);
        let in_contact = (self.renderer.contact_mut(), &self.window);
        let drives = self.guard.mode().is_driving();
        let hip = self.clutch.tick(tip, scene, in_contact, drives);
        if self.pending.is_some() {
            self.clutch.wait_for_change();
        }
        Some(hip)
    }

    /// Returns the start of the contact in the new placement, and the step in which the force turns
    /// ([`Clutch::turn_from`](crate::clutch::Clutch::turn_from)), if it can change now.
    fn onset_in_contact(&self, change: &SceneChange) -> Option<(ContactOnset, Option<f32>)> {
        if !self.may_change_now(change) {
            return None;
        }
        let (before, scene) = (self.scene.as_ref()?, &change.scene);
        let contact = self.renderer.contact();
        let map = change.in_contact?;
        let at = map.place(&contact.output().proxy);
        let normal = self.normal_after(change, &at)?;
        let before_mm = contact.displacement()? * before.cell_mm;
        let deeper_mm = match change.keeps_tiles {
            true => 0.0,
            false => self.deeper_by(change, &map, normal.z, before_mm.length())?,
        };
        let after_mm = before_mm + normal * deeper_mm;
        let force_n = |params: &SurfaceParams, mm: Vec3| params.stiffness_n_per_mm * mm.length();
        let before_n = force_n(&before.params, before_mm);
        let after_n = force_n(&scene.params, after_mm);
        // A force at its limit does not follow a surface that blends.
        let is_cut_off = !change.keeps_tiles && after_n > scene.params.max_force_n;
        // The part that presses on the new surface: not that along it, or away from it.
        let pressed_n = scene.params.stiffness_n_per_mm * after_mm.dot(normal);
        // False for NaN.
        let stays_pressed = before_n <= SceneChange::MAX_FORCE_RATIO * pressed_n;
        if is_cut_off || !stays_pressed {
            return None;
        }
        let onset = ContactOnset {
            at,
            displacement: after_mm / scene.cell_mm,
            fade: contact.edge_fade(),
        };
        // The surface moves up and down, and the depth changes along its normal.
        let blend_mm = BLEND_MM_S * self.rate.tick_s() * normal.z;
        let blend_n = blend_mm * scene.params.stiffness_n_per_mm;
        // Tiles that are kept do not blend: a spring that gets harder then pushes the hand back.
        Some((onset, (!change.keeps_tiles).then_some(blend_n)))
    }

    /// Returns true if the hand presses on real ground, with the full force of the scene, and the
    /// force can turn to that of the new placement.
    fn may_change_now(&self, change: &SceneChange) -> bool {
        let Some(before) = &self.scene else {
            return false;
        };
        let has_full_force = self.guard.shares() == Some([1.0; 2])
            && self.guard.mode() == Mode::Armed
            && self.clutch.may_change_in_contact();
        // The fallback has no materials: the hand would touch another one.
        let has_materials = before.materials.is_some() || change.scene.materials.is_some();
        // The new placement is computed from the ground, not from its fallback.
        let patch = self.renderer.contact().patch();
        let is_on_ground =
            before.fallback.is_none() || patch.is_some_and(|cell| self.window.is_blended(cell));
        has_full_force && !has_materials && is_on_ground && change.may_turn_from(&before.params)
    }

    /// Returns the additional depth, mm, under the fallback of the new placement, whose error is
    /// its height over the ground. `None` if it is too high or too low to continue the contact.
    ///
    /// A fallback above the ground only makes the HIP deeper until the tiles have arrived. Under
    /// one that is too low, the HIP is at half its depth, and the ground will have risen by the
    /// rest.
    ///
    /// The error is that at the place that the host computed, because only there the ground of the
    /// new placement is known: a hand that has slid since then is at another height in it.
    fn deeper_by(
        &self,
        change: &SceneChange,
        map: &ContactMap,
        normal_z: f32,
        depth_mm: f32,
    ) -> Option<f32> {
        let to = map.to.normalised();
        let corners = self.corners_of_next(change, to.column())?;
        let (frac, base) = (to.frac(), corners.base.wrapping_sub(to.cell()[2]) as f32);
        let error = base + (Patch::new(corners.heights).height(frac.x, frac.y) - frac.z);
        let error_mm = error * normal_z * change.scene.cell_mm;
        let lowest_mm = -0.5 * depth_mm - MAX_GROUND_RISE_MM;
        let highest_mm = depth_mm + MAX_EXTRA_DEPTH_MM;
        // Not for NaN.
        let is_near = error_mm >= lowest_mm && error_mm <= highest_mm;
        is_near.then(|| larger(error_mm, -0.5 * depth_mm))
    }

    /// Changes the placement under the pressing hand.
    fn change_in_contact(&mut self, change: &SceneChange, onset: ContactOnset, pose: &Pose) {
        let mut scene = change.scene;
        self.set_window(change);
        self.renderer.set_scene(Some(&scene), Some(onset));
        let hip = self.renderer.contact_mut().place_on_surface(&self.window);
        if let (Some(mechanism), Some(hip)) = (&self.mechanism, hip) {
            let shift = place(mechanism, &scene, pose).to(&hip);
            scene.home = GridPoint::new(scene.home.cell(), scene.home.frac() + shift);
        }
        self.scene = Some(scene);
        self.view = change.number;
    }

    /// Returns the normal of the surface on which the hand presses after the change; `None` if the
    /// terrain there has not arrived, or has no height.
    fn normal_after(&self, change: &SceneChange, at: &GridPoint) -> Option<Vec3> {
        let cell = at.column();
        let has_fallback = !self.needs_fallback(change) || self.window.has_next();
        let corners = match change.keeps_tiles {
            true if has_fallback && self.window.is_blended(cell) => self.window.corners(cell),
            true => None,
            false => self.corners_of_next(change, cell),
        };
        let normal = Patch::new(corners?.heights).normal(at.frac().x, at.frac().y);
        normal.is_finite().then(|| normal.normalize())
    }

    /// Returns the corners of a cell in the fallback of the new placement; `None` if it has no such
    /// cell, or before the fallback has arrived.
    fn corners_of_next(&self, change: &SceneChange, cell: Cell) -> Option<Corners> {
        let has_cell = change.scene.size.has_cell(cell);
        has_cell
            .then(|| self.window.corners_of_next(cell))
            .flatten()
    }

    /// Renders a changed placement without a step in force: the clutch of an arm is open, and a
    /// replay drives no arm. A proxy in contact starts on the surface at its position relative to
    /// the hand, as deep as before.
    pub(crate) fn apply_change(&mut self, change: &SceneChange) {
        let scene = change.scene;
        let contact = self.renderer.contact();
        let displacement = contact.displacement();
        let displacement = self
            .scene
            .zip(displacement)
            .map(|(before, displacement)| displacement * (before.cell_mm / scene.cell_mm));
        let hip = match change.in_contact {
            // The hand has moved since the host computed its place.
            Some(map) => match displacement {
                Some(displacement) => {
                    let at = map.place(&contact.output().proxy);
                    GridPoint::new(at.cell(), at.frac() - displacement)
                }
                None => self.hip_in_air(&map, scene.cell_mm),
            },
            // The link can deliver any bits.
            None => change.hip.normalised(),
        };
        let fade = match scene.source {
            // The hand may press again before the terrain has arrived.
            Source::Encoders => 0.0,
            // A replay has all its terrain, and its recording has the force of the next tick.
            Source::Points => contact.edge_fade(),
        };
        self.set_window(change);
        let onset = displacement.map(|displacement| ContactOnset {
            at: GridPoint::new(hip.cell(), hip.frac() + displacement),
            displacement,
            fade,
        });
        self.renderer.set_scene(Some(&scene), onset);
        self.clutch.set_hip(hip);
        self.scene = Some(scene);
        self.point = None;
        self.view = change.number;
    }

    /// Returns the HIP of a hand in the air in the new placement: over the same place, as high over
    /// its ground as before. Where the ground is unknown, its height is that of the touched place.
    fn hip_in_air(&self, map: &ContactMap, cell_mm: f32) -> GridPoint {
        let hip = self.renderer.contact().hip();
        let ([x, y, _], frac) = (hip.cell(), hip.frac());
        let ground = self.window.corners(hip.column()).map(|corners| {
            let height = Patch::new(corners.heights).height(frac.x, frac.y);
            (corners.base, height)
        });
        let touched = map.from.normalised();
        let (base, height) = ground
            .filter(|(_, height)| height.is_finite())
            .unwrap_or((touched.cell()[2], touched.frac().z));
        let ground = GridPoint::new([x, y, base], frac.with_z(height));
        let before_mm = self.scene.map_or(cell_mm, |scene| scene.cell_mm);
        let above = ground.to(hip).z * before_mm / cell_mm;
        let at = map.place(&ground);
        GridPoint::new(at.cell(), at.frac() + Vec3::Z * above).normalised()
    }

    /// Sets the window's field and fallback for a changed placement. Tiles of its fallback that
    /// have arrived already are kept.
    fn set_window(&mut self, change: &SceneChange) {
        let scene = &change.scene;
        let needs_fallback = self.needs_fallback(change);
        if !change.keeps_tiles {
            self.window.reset(scene.level, scene.size, scene.top);
        }
        if needs_fallback {
            self.window.set_fallback(scene.fallback);
        }
    }
}
