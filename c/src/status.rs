//! Errors as numbers, with texts.

use std::ffi::{CStr, CString, c_char};

use hapterra_touch::{ContactError, StepError, TerrainError};

/// Result of a function: 0, or an error.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HapterraStatus {
    /// Success.
    Ok = 0,
    /// A pointer is null.
    NullPointer = 1,
    /// A pointer is not aligned, or a count is larger than memory.
    Pointer = 2,
    /// The terrain has no heights yet, or the contact was not begun.
    NotBegun = 3,
    /// The size or the number of samples is not possible.
    Size = 4,
    /// The millimetres of a cell or of a vertical unit are not a valid scale.
    Scale = 5,
    /// Heights are too tall or too steep.
    Heights = 6,
    /// A parameter of a surface is out of bounds.
    Surface = 7,
    /// A material of the terrain is not one of the surfaces.
    Material = 8,
    /// The tick rate is not 1,000 to 10,000 in whole thousands.
    Rate = 9,
    /// A position is not a number, or too far away.
    Place = 10,
    /// The reader of heights returned an error.
    Unread = 11,
    /// A path is too long for one step.
    Far = 12,
    /// A number is not a value of its enumeration.
    Choice = 13,
    /// Memory could not be allocated.
    Memory = 14,
    /// A defect of the library. The object can only be freed.
    Internal = 15,
    /// The radius of a tip is not possible on these cells.
    Tip = 16,
}

/// Texts by number.
const TEXTS: [&CStr; 17] = [
    c"all is well",
    c"a pointer is null: pass a valid one",
    c"a pointer is not aligned or a count larger than memory",
    c"the terrain has no heights yet, or the contact has not begun",
    c"no terrain can have this size or number of samples",
    c"the millimetres of a cell or of a vertical unit are no scale",
    c"heights are too tall or too steep: scale them down, or make no-data NaN",
    c"a parameter of a surface is out of its bounds",
    c"a material of the terrain is not one of the surfaces",
    c"no tick rate: use 1,000 to 10,000 in whole thousands",
    c"a place is not a number or too far away",
    c"the reader of heights returned an error",
    c"a path is too long for one step: use smaller steps",
    c"a number is none of an enumeration's",
    c"there is no memory",
    c"the library is at fault: report it, and free the object",
    c"a tip is no ball that can touch these cells: use a radius from 0 to 8 cells",
];

/// An error, with the message that the object keeps.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: HapterraStatus,
    message: String,
}

impl Failure {
    pub(crate) fn new(status: HapterraStatus, message: impl ToString) -> Self {
        let message = message.to_string();
        Self { status, message }
    }
}

impl From<HapterraStatus> for Failure {
    fn from(status: HapterraStatus) -> Self {
        let text = TEXTS.get(status as usize).copied().unwrap_or_default();
        Self::new(status, text.to_string_lossy())
    }
}

impl From<TerrainError> for Failure {
    fn from(error: TerrainError) -> Self {
        let status = match error {
            TerrainError::Size { .. }
            | TerrainError::Count { .. }
            | TerrainError::Ragged { .. } => HapterraStatus::Size,
            TerrainError::Memory { .. } => HapterraStatus::Memory,
            TerrainError::Scale(_) => HapterraStatus::Scale,
            TerrainError::Tip(_) | TerrainError::TipCells { .. } => HapterraStatus::Tip,
            TerrainError::TooTall { .. } | TerrainError::Step { .. } => HapterraStatus::Heights,
        };
        Self::new(status, error)
    }
}

impl From<ContactError> for Failure {
    fn from(error: ContactError) -> Self {
        let status = match error {
            ContactError::Terrain(error) => return error.into(),
            ContactError::Surface(_) => HapterraStatus::Surface,
            ContactError::Material { .. } => HapterraStatus::Material,
            ContactError::Rate(_) => HapterraStatus::Rate,
            ContactError::Refused => HapterraStatus::Internal,
        };
        Self::new(status, error)
    }
}

impl From<StepError> for Failure {
    fn from(error: StepError) -> Self {
        let status = match error {
            StepError::Place { .. } => HapterraStatus::Place,
            StepError::Unread(_) => HapterraStatus::Unread,
            StepError::Steep { .. } => HapterraStatus::Heights,
            StepError::Far { .. } => HapterraStatus::Far,
        };
        Self::new(status, error)
    }
}

/// The message of an object's last error.
#[derive(Default)]
pub(crate) struct Message(CString);

impl Message {
    pub(crate) fn set(&mut self, failure: Failure) -> HapterraStatus {
        // No message contains a zero.
        self.0 = CString::new(failure.message).unwrap_or_default();
        failure.status
    }

    pub(crate) fn as_ptr(&self) -> *const c_char {
        self.0.as_ptr()
    }
}

/// Returns the text of a status, valid forever; for any other number the text of
/// `HAPTERRA_STATUS_CHOICE`. Not to be freed.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_error_text(status: u32) -> *const c_char {
    let text = TEXTS.get(status as usize);
    text.unwrap_or(&TEXTS[HapterraStatus::Choice as usize])
        .as_ptr()
}

/// Returns the version of the library, such as `0.1.0`, valid forever. Not to be freed.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}
