//! Contacts.

use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use hapterra_touch::{Contact as Touched, State, Step, StepError};
use pyo3::exceptions::PyRuntimeError;
use pyo3::types::PyByteArray;
use pyo3::{Bound, PyErr, PyResult, Python, pyclass, pymethods};

use crate::open::Opened;
use crate::surface_params::Surface;
use crate::terrain::Terrain;
use crate::ticks::{Tick, Ticks};
use crate::{notes, numbers, refused};

/// Bytes of a row of steps: `STEP` of `package/hapterra/_contact.py`.
const ROW: usize = 72;
/// Steps between two checks for Ctrl-C.
pub(crate) const UNINTERRUPTED: usize = 4096;

/// One HIP over a terrain.
#[pyclass(frozen, module = "hapterra._native")]
pub(crate) struct Contact {
    contact: Mutex<Touched>,
    /// File of its terrain, if there is one.
    opened: Option<Arc<Opened>>,
    pub(crate) rate_hz: u32,
}

/// Force, N, proxy, mm, number of the state, and the surface over a HIP that is below ground, mm.
type Answer = ((f32, f32, f32), (f64, f64, f64), u8, Option<f64>);

/// Rows of steps, remarks on times, and the reason if a step was not possible.
pub(crate) type Run<'py> = (Bound<'py, PyByteArray>, Vec<String>, Option<String>);

#[pymethods]
impl Contact {
    #[new]
    fn new(terrain: &Terrain, surface: &Surface, rate_hz: u32) -> PyResult<Self> {
        let touched = terrain.touched.clone();
        let contact = Touched::at_rate(touched, surface.surface.clone(), rate_hz);
        let contact = Mutex::new(contact.map_err(refused)?);
        let opened = terrain.opened.clone();
        Ok(Self {
            contact,
            opened,
            rate_hz,
        })
    }

    /// Makes one step.
    fn step(&self, py: Python<'_>, east_mm: f64, north_mm: f64, up_mm: f64) -> PyResult<Answer> {
        let contact = &mut *self.lock()?;
        let hip_mm = [east_mm, north_mm, up_mm];
        let step = match &self.opened {
            None => contact.step(hip_mm),
            // It may wait for a file.
            Some(_) => {
                let step = py.detach(|| contact.step(hip_mm));
                notes::warn(py)?;
                step
            }
        };
        let step = step.map_err(|error| self.raised(error))?;
        let (state, surface_mm) = number(step.state);
        Ok((step.force_n.into(), step.proxy_mm.into(), state, surface_mm))
    }

    /// Makes a step for each tick of a path of 3 f8 a row, by times of f8 if there are any.
    #[pyo3(signature = (path, t_s=None))]
    fn run<'py>(&self, py: Python<'py>, path: &[u8], t_s: Option<&[u8]>) -> PyResult<Run<'py>> {
        let (ticks, remarks) = self.ticks(py, path, t_s)?;
        let contact = &mut *self.lock()?;
        let (mut rows, mut why) = (Vec::new(), None);
        for ticks in ticks.chunks(UNINTERRUPTED) {
            let ran = py.detach(|| run(contact, ticks, &mut rows));
            if let Err(error) = ran {
                let error = self.raised(error);
                why = Some(error.value(py).to_string());
                break;
            }
            py.check_signals()?;
        }
        if self.opened.is_some() {
            notes::warn(py)?;
        }
        Ok((PyByteArray::new(py, &rows), remarks, why))
    }

    fn set_surface(&self, surface: &Surface) -> PyResult<()> {
        let set = self.lock()?.set_surface(surface.surface.clone());
        set.map_err(refused)
    }
}

impl Contact {
    /// Returns an error as a Python exception: heights that cannot be read are an `OSError`.
    pub(crate) fn raised(&self, error: StepError) -> PyErr {
        match (&self.opened, error) {
            (Some(opened), StepError::Unread(_)) => opened.unread(),
            _ => refused(error),
        }
    }

    /// Returns the ticks of a path, and remarks on its times.
    pub(crate) fn ticks(
        &self,
        py: Python<'_>,
        path: &[u8],
        t_s: Option<&[u8]>,
    ) -> PyResult<(Vec<Tick>, Vec<String>)> {
        let path = numbers(path, f64::from_ne_bytes)?;
        let t_s = t_s
            .map(|t_s| numbers(t_s, f64::from_ne_bytes))
            .transpose()?;
        let Ticks { ticks, remarks } = py.detach(|| {
            let (path, _) = path.as_chunks();
            Ticks::of(path, t_s.as_deref(), self.rate_hz).map_err(refused)
        })?;
        Ok((ticks, remarks))
    }

    pub(crate) fn lock(&self) -> PyResult<MutexGuard<'_, Touched>> {
        self.contact.try_lock().map_err(|error| {
            PyRuntimeError::new_err(match error {
                TryLockError::WouldBlock => {
                    "this contact runs in another thread: use a contact for each thread"
                }
                TryLockError::Poisoned(_) => {
                    "a fault of hapterra ended this contact: make another, and report the fault"
                }
            })
        })
    }
}

fn run(contact: &mut Touched, ticks: &[Tick], rows: &mut Vec<u8>) -> Result<(), StepError> {
    rows.reserve(ROW * ticks.len());
    for tick in ticks {
        write(rows, tick, &contact.step(tick.1)?);
    }
    Ok(())
}

fn write(rows: &mut Vec<u8>, (t_s, hip_mm): &Tick, step: &Step) {
    let doubles = [t_s].into_iter().chain(hip_mm).chain(&step.proxy_mm);
    for number in doubles {
        rows.extend(number.to_ne_bytes());
    }
    for number in step.force_n {
        rows.extend(number.to_ne_bytes());
    }
    rows.extend([number(step.state).0, 0, 0, 0]);
}

/// Returns the number of a state in `hapterra.State`, and the height of the surface over the HIP,
/// mm.
pub(crate) const fn number(state: State) -> (u8, Option<f64>) {
    match state {
        State::Free => (0, None),
        State::Touching => (1, None),
        State::Releasing => (2, None),
        State::BelowGround { surface_mm } => (3, Some(surface_mm)),
        State::Outside => (4, None),
    }
}
