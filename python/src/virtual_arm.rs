//! A virtual arm in a hand, in a closed loop with a contact.

use hapterra::phantom::{ArmFrame, HandModel, PhantomModel, Plant};
use hapterra_core::Vec3;
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_touch::{Contact as Touched, StepError};
use pyo3::types::PyByteArray;
use pyo3::{PyResult, Python, pyclass, pymethods};

use crate::contact::{Contact, Run, UNINTERRUPTED, number};
use crate::ticks::Tick;
use crate::{notes, refused};

/// Bytes of a row: `ARM_STEP` of `package/hapterra/_virtual_arm.py`.
const ROW: usize = 104;

/// A Premium 1.5 and the hand.
#[pyclass(frozen, module = "hapterra._native")]
pub(crate) struct VirtualArm {
    hand: HandModel,
    placement: ArmFrame,
    mechanism: Kinematics,
}

#[pymethods]
impl VirtualArm {
    /// Creates an arm from the terrain point at its tip in the home pose, mm, and a `HandModel`:
    /// kg, N/m and N·s/m towards the target, the same for the grip.
    #[new]
    fn new(home_mm: [f64; 3], hand: [f64; 5]) -> PyResult<Self> {
        let [
            mass_kg,
            arm_n_per_m,
            arm_ns_per_m,
            grip_n_per_m,
            grip_ns_per_m,
        ] = hand;
        Ok(Self {
            hand: HandModel {
                mass_kg,
                arm_n_per_m,
                arm_ns_per_m,
                grip_n_per_m,
                grip_ns_per_m,
            },
            placement: ArmFrame { home_mm },
            mechanism: Kinematics::new(&Calibration::PREMIUM_1_5).map_err(refused)?,
        })
    }

    /// Runs a tick for each target; the path is as in `Contact.run`.
    #[pyo3(signature = (contact, targets, t_s=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        contact: &Contact,
        targets: &[u8],
        t_s: Option<&[u8]>,
    ) -> PyResult<Run<'py>> {
        let (targets, remarks) = contact.ticks(py, targets, t_s)?;
        let touched = &mut *contact.lock()?;
        let mut rows = Vec::new();
        let Some(mut at_rest) = py.detach(|| self.at_rest(&targets))? else {
            return Ok((PyByteArray::new(py, &rows), remarks, None));
        };
        let tick_s = 1.0 / f64::from(contact.rate_hz);
        let mut why = None;
        for at in (0..targets.len()).step_by(UNINTERRUPTED) {
            let ahead = targets.get(at..).unwrap_or_default();
            let ran = py.detach(|| self.run_ticks(&mut at_rest, touched, ahead, tick_s, &mut rows));
            if let Err(error) = ran {
                why = Some(contact.raised(error).value(py).to_string());
                break;
            }
            py.check_signals()?;
        }
        notes::warn(py)?;
        Ok((PyByteArray::new(py, &rows), remarks, why))
    }
}

impl VirtualArm {
    /// Returns the arm at rest at the first target, held by the hand; `None` without targets.
    fn at_rest(&self, targets: &[Tick]) -> PyResult<Option<Plant>> {
        let model = PhantomModel::premium_1_5();
        for (_, at_mm) in targets {
            self.placement.joints_at(&model, *at_mm).map_err(refused)?;
        }
        let Some((_, first_mm)) = targets.first() else {
            return Ok(None);
        };
        let q = self
            .placement
            .joints_at(&model, *first_mm)
            .map_err(refused)?;
        Ok(Some(Plant::new(model, q).with_hand(self.hand)))
    }

    /// Runs ticks at the first of these targets, up to the next check for Ctrl-C.
    fn run_ticks(
        &self,
        plant: &mut Plant,
        contact: &mut Touched,
        targets: &[Tick],
        tick_s: f64,
        rows: &mut Vec<u8>,
    ) -> Result<(), StepError> {
        rows.reserve(ROW * targets.len().min(UNINTERRUPTED));
        for (index, (t_s, target_mm)) in targets.iter().enumerate().take(UNINTERRUPTED) {
            let pose = self.mechanism.pose(plant.counts(), [0; 3]);
            let moved = pose.tip_mm() - self.mechanism.home_mm();
            // East is the device's y, north its -x.
            let moved = [moved.y, -moved.x, moved.z].map(f64::from);
            let hip_mm: [f64; 3] = std::array::from_fn(|i| self.placement.home_mm[i] + moved[i]);
            let hand_m = plant.hand_m().unwrap_or_else(|| plant.tip_m());
            let hand_mm = self.placement.to_terrain_mm(plant.model(), hand_m);
            let step = contact.step(hip_mm)?;
            let [east, north, up] = step.force_n;
            let torques = pose.torques_nm(Vec3::new(-north, east, up));
            let currents = self
                .mechanism
                .currents_a(torques + self.mechanism.gravity_nm(&pose));
            let next_mm = targets.get(index + 1).map_or(target_mm, |(_, next)| next);
            let speed: [f64; 3] = std::array::from_fn(|i| (next_mm[i] - target_mm[i]) / tick_s);
            let target_m = self.placement.to_device_m(plant.model(), *target_mm);
            plant.set_target(
                target_m,
                ArmFrame::turn_to_device(speed).map(|mm_s| 1e-3 * mm_s),
            );
            plant.step(currents.to_array().map(f64::from), tick_s);

            let doubles = [*t_s]
                .into_iter()
                .chain(hip_mm)
                .chain(step.proxy_mm)
                .chain(hand_mm);
            doubles.for_each(|number| rows.extend(number.to_ne_bytes()));
            step.force_n
                .iter()
                .for_each(|number| rows.extend(number.to_ne_bytes()));
            let tick = (rows.len() / ROW) as u32;
            rows.extend(tick.to_ne_bytes());
            rows.extend([number(step.state).0, 0, 0, 0, 0, 0, 0, 0]);
        }
        Ok(())
    }
}
