//! Contacts.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use hapterra_touch::{Contact, State, Step};

use crate::border::{array, catch_panic, output_array};
use crate::status::{Failure, HapterraStatus, Message};
use crate::surface_params::{HapterraSurface, surface};
use crate::terrain::HapterraTerrain;

/// The state of a proxy.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HapterraState {
    /// The HIP is in the air: no force.
    Free = 0,
    /// The proxy is on the surface and the HIP below it.
    Touching = 1,
    /// The surface has ended, and the last force ramps down.
    Releasing = 2,
    /// The HIP is below the surface and has not been above it yet: no force until then.
    BelowGround = 3,
    /// The HIP is in a no-data area or outside, and has not been above the surface yet: no force.
    Outside = 4,
}

/// The result of a step. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapterraStep {
    /// The force on the hand, N: east, north, up. Each has single precision.
    pub force_n: [f64; 3],
    /// The proxy, mm: east, north, up.
    pub proxy_mm: [f64; 3],
    /// The height of the surface over the HIP, mm, in the state `HAPTERRA_STATE_BELOW_GROUND`; NaN
    /// in all others.
    pub surface_mm: f64,
    /// A value of `HapterraState`.
    pub state: u32,
    /// 0.
    pub reserved: u32,
}

impl From<Step> for HapterraStep {
    fn from(step: Step) -> Self {
        let (state, surface_mm) = match step.state {
            State::Free => (HapterraState::Free, f64::NAN),
            State::Touching => (HapterraState::Touching, f64::NAN),
            State::Releasing => (HapterraState::Releasing, f64::NAN),
            State::BelowGround { surface_mm } => (HapterraState::BelowGround, surface_mm),
            State::Outside => (HapterraState::Outside, f64::NAN),
        };
        Self {
            force_n: step.force_n.map(f64::from),
            proxy_mm: step.proxy_mm,
            surface_mm,
            state: state as u32,
            reserved: 0,
        }
    }
}

/// One haptic interface point (HIP) over a terrain, created by `hapterra_contact_new` and not
/// begun.
#[derive(Default)]
pub struct HapterraContact {
    contact: Option<Contact>,
    message: Message,
}

impl HapterraContact {
    /// Makes a call; a panic drops the contact.
    fn call(
        &mut self,
        call: impl FnOnce(&mut Option<Contact>) -> Result<(), Failure>,
    ) -> HapterraStatus {
        let Err(failure) = catch_panic(|| call(&mut self.contact)) else {
            return HapterraStatus::Ok;
        };
        if failure.status == HapterraStatus::Internal {
            self.contact = None;
        }
        self.message.set(failure)
    }
}

/// Returns a contact that has not begun, which the caller owns until `hapterra_contact_free`.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_contact_new() -> Box<HapterraContact> {
    Box::default()
}

/// Frees a contact; null is ignored.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_contact_free(contact: Option<Box<HapterraContact>>) {
    drop(contact);
}

/// Begins or restarts a contact on the current heights of a terrain: `rate_hz` steps a second,
/// 1,000 to 10,000 in whole thousands. The first of the `count` surfaces, 1 to 16, is the surface.
/// The others are materials of the terrain, of which only stiffness, friction, damping and texture
/// are used. Surfaces are copied, and the terrain may be freed before the contact.
///
/// # Safety
/// At `surfaces` are `count` values.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_contact_begin(
    contact: Option<&mut HapterraContact>,
    terrain: Option<&HapterraTerrain>,
    surfaces: *const HapterraSurface,
    count: usize,
    rate_hz: u32,
) -> HapterraStatus {
    contact.map_or(HapterraStatus::NullPointer, |contact| {
        contact.call(|contact| {
            let terrain = terrain.ok_or(HapterraStatus::NullPointer)?;
            let terrain = terrain.terrain.clone().ok_or(HapterraStatus::NotBegun)?;
            // SAFETY: by this function's contract.
            let surface = unsafe { surface(surfaces, count) }?;
            *contact = Some(Contact::at_rate(terrain, surface, rate_hz)?);
            Ok(())
        })
    })
}

/// Changes the surfaces between two steps; the arguments are as in `hapterra_contact_begin`. The
/// proxy stays where it is, and the next step has the force of the new surface.
///
/// # Safety
/// At `surfaces` are `count` values.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_contact_set_surface(
    contact: Option<&mut HapterraContact>,
    surfaces: *const HapterraSurface,
    count: usize,
) -> HapterraStatus {
    contact.map_or(HapterraStatus::NullPointer, |contact| {
        contact.call(|contact| {
            let contact = contact.as_mut().ok_or(HapterraStatus::NotBegun)?;
            // SAFETY: by this function's contract.
            Ok(contact.set_surface(unsafe { surface(surfaces, count) }?)?)
        })
    })
}

/// Makes one step with the HIP at three numbers, mm: east, north, up from the south-west sample at
/// height zero. After an error the contact and `step` are unchanged. An error has no force: a
/// program that drives a device must set its force to zero.
///
/// # Safety
/// At `hip_mm` are 3 numbers, and at `step` is room for one step.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_contact_step(
    contact: Option<&mut HapterraContact>,
    hip_mm: *const f64,
    step: *mut HapterraStep,
) -> HapterraStatus {
    // SAFETY: by this function's contract.
    unsafe { hapterra_contact_run(contact, hip_mm, 1, step, None) }
}

/// Makes `count` steps, of three numbers each, and stores their results in `steps`. Stops at the
/// first step that is not possible. `done` receives the number of steps made, unless it is null.
///
/// # Safety
/// At `hips_mm` are 3 times `count` numbers, and at `steps` is room for `count` steps.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_contact_run(
    contact: Option<&mut HapterraContact>,
    hips_mm: *const f64,
    count: usize,
    steps: *mut HapterraStep,
    done: Option<&mut MaybeUninit<usize>>,
) -> HapterraStatus {
    let mut done_steps = 0;
    let status = contact.map_or(HapterraStatus::NullPointer, |contact| {
        contact.call(|contact| {
            let contact = contact.as_mut().ok_or(HapterraStatus::NotBegun)?;
            // SAFETY: by this function's contract.
            let hips_mm = unsafe { array(hips_mm.cast::<[f64; 3]>(), count) }?;
            // SAFETY: by this function's contract.
            let steps = unsafe { output_array(steps, count) }?;
            for (hip_mm, step) in hips_mm.iter().zip(steps) {
                step.write(contact.step(*hip_mm)?.into());
                done_steps += 1;
            }
            Ok(())
        })
    });
    if let Some(done) = done {
        done.write(done_steps);
    }
    status
}

/// Returns the message of the contact's last error, empty if there was none, null for null. The
/// contact owns the message, which is valid until the next call with it.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_contact_message(contact: Option<&HapterraContact>) -> *const c_char {
    contact.map_or(std::ptr::null(), |contact| contact.message.as_ptr())
}
