//! The reference system in a `.prj` file, as Esri's programs write it.

use super::text;
use crate::RasterError;
use crate::crs::ReferenceSystem;
use crate::decoded::Decoded;
use crate::input::FileBytes;

/// Sets the reference system from a `.prj` beside the file, if there is one; call it before
/// `set_layout`.
///
/// # Errors
/// If it is remote and cannot be read at present.
pub(crate) fn reference_system(
    input: &FileBytes,
    decoded: &mut Decoded,
) -> Result<(), RasterError> {
    let (wkt, name) = match text(input, "prj") {
        Ok(Some(found)) => found,
        Err(error) if error.is_connection_error() => return Err(error),
        // If the neighbour cannot be read, only the place is lost, not the heights.
        Ok(None) | Err(_) => return Ok(()),
    };
    let (system, vertical) = ReferenceSystem::from_wkt(&wkt);
    if system.is_none() {
        decoded.remarks.push(format!(
            "{name} beside it names no supported reference system: it is not used"
        ));
    }
    decoded.system = system;
    if vertical.is_some() && decoded.vertical_datum.is_none() {
        decoded.set_vertical(vertical, decoded.metres_per_vertical_unit);
    }
    Ok(())
}
