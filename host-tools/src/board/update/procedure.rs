//! An update from the first erase to the start of the program.

use super::error::{UpdateError, UpdateFailure};
use super::loader::{ControlPipe, Loader};
use super::plan::{FlashRange, Plan};
use crate::board::boards::Board;
use crate::board::image::Image;

/// Progress of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Pages erased, of a total.
    Erased(usize, usize),
    /// Bytes written, of a total.
    Written(usize, usize),
    /// Bytes read back and equal, of a total.
    Compared(usize, usize),
}

/// Writes an image through a loader, verifies it and starts it. Returns the number of bytes
/// written.
///
/// The page with the vectors is erased first, and its first word is written after everything else
/// is verified. Before that, a chip that is reset finds no program, never a mixture of two.
///
/// # Errors
/// [`UpdateFailure`], which reports whether anything was erased.
pub fn update<P: ControlPipe>(
    loader: &mut Loader<P>,
    board: &Board,
    image: &Image,
    progress: &mut dyn FnMut(Step),
) -> Result<usize, UpdateFailure> {
    let plan = Plan::new(board, image, loader.layout());
    let plan = plan.map_err(|error| UpdateFailure {
        error,
        erased: false,
    })?;
    let done = carry_out(loader, &plan, progress);
    done.map_err(|error| UpdateFailure {
        error,
        erased: true,
    })?;
    Ok(plan.bytes())
}

fn carry_out<P: ControlPipe>(
    loader: &mut Loader<P>,
    plan: &Plan,
    progress: &mut dyn FnMut(Step),
) -> Result<(), UpdateError> {
    let (pages, bytes) = (plan.erased.len(), plan.bytes());
    for (done, page) in (1..).zip(&plan.erased) {
        loader.erase(*page)?;
        progress(Step::Erased(done, pages));
    }
    let mut written = 0;
    for range in &plan.others {
        loader.write(range.address, &range.bytes)?;
        written += range.bytes.len();
        progress(Step::Written(written, bytes));
    }
    let mut compared = 0;
    for range in &plan.others {
        compare(loader, range)?;
        compared += range.bytes.len();
        progress(Step::Compared(compared, bytes));
    }
    loader.write(plan.vectors.address, &plan.vectors.bytes)?;
    progress(Step::Written(bytes, bytes));
    compare(loader, &plan.vectors)?;
    progress(Step::Compared(bytes, bytes));
    loader.start_program(plan.vectors.address)
}

fn compare<P: ControlPipe>(loader: &mut Loader<P>, range: &FlashRange) -> Result<(), UpdateError> {
    let found = loader.read(range.address, range.bytes.len())?;
    let mut pairs = found.iter().zip(&range.bytes);
    match pairs.position(|(is, was)| is != was) {
        None => Ok(()),
        Some(at) => Err(UpdateError::Differs(range.address + at as u64)),
    }
}
