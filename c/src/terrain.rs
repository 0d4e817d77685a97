//! Terrains.

use std::ffi::{c_char, c_void};

use hapterra_touch::{Block, Height, Heights, RowOrder, Terrain, TerrainError, Unread};

use crate::border::{array, catch_panic};
use crate::status::{Failure, HapterraStatus, Message};

/// The order of the rows of an array.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HapterraRowOrder {
    /// The first row is the northernmost, as in images and GeoTIFF.
    NorthFirst = 0,
    /// The first row is the southernmost.
    SouthFirst = 1,
}

/// A height field, created by `hapterra_terrain_new` without heights.
#[derive(Default)]
pub struct HapterraTerrain {
    pub(crate) terrain: Option<Terrain>,
    message: Message,
}

/// Reads heights of a block of samples into `heights`, row by row from the south and each row from
/// west to east: `columns` times `rows`, at most 33 × 33, or 52 × 52 under a tip, NaN for no-data.
/// `column` and `row` count from the south-west sample. Returns 0, or any other number for an
/// error. `user` is the pointer that was passed with the function. The function is only called
/// during calls with a contact or terrain, and must not end by an exception or `longjmp`.
pub type HapterraRead = Option<
    extern "C" fn(
        user: *mut c_void,
        column: u32,
        row: u32,
        columns: u32,
        rows: u32,
        heights: *mut f64,
    ) -> u32,
>;

/// A caller's function as a source.
struct Reader {
    read: extern "C" fn(*mut c_void, u32, u32, u32, u32, *mut f64) -> u32,
    user: *mut c_void,
}

// SAFETY: the pointer is passed to the caller's function and not used here; the header requires
// that the function work in any thread that uses the terrain.
unsafe impl Send for Reader {}
// SAFETY: as above.
unsafe impl Sync for Reader {}

impl Heights for Reader {
    fn read(&self, block: Block, heights: &mut [f64]) -> Result<(), Unread> {
        let Block {
            column,
            row,
            columns,
            rows,
        } = block;
        let buffer = heights.as_mut_ptr();
        match (self.read)(self.user, column, row, columns, rows, buffer) {
            0 => Ok(()),
            error => Err(Unread(error)),
        }
    }
}

impl HapterraTerrain {
    /// Replaces the heights; keeps the previous ones after an error.
    fn set_terrain(
        &mut self,
        create: impl FnOnce(Option<&Terrain>) -> Result<Terrain, Failure>,
    ) -> HapterraStatus {
        match catch_panic(|| create(self.terrain.as_ref())) {
            Ok(terrain) => {
                self.terrain = Some(terrain);
                HapterraStatus::Ok
            }
            Err(failure) => self.message.set(failure),
        }
    }

    /// # Safety
    /// At `heights` are columns times rows values.
    unsafe fn put_array<T: Height>(
        &mut self,
        heights: *const T,
        [columns, rows]: [u32; 2],
        cell_mm: f64,
        order: u32,
    ) -> HapterraStatus {
        self.set_terrain(|_| {
            let order = row_order(order)?;
            let count = (columns as usize).checked_mul(rows as usize);
            let count = count.ok_or(TerrainError::Memory { columns, rows })?;
            // SAFETY: by this function's contract.
            let heights = unsafe { array(heights, count) }?;
            Ok(Terrain::from_slice(columns, rows, cell_mm, order, heights)?)
        })
    }
}

fn row_order(order: u32) -> Result<RowOrder, Failure> {
    match order {
        0 => Ok(RowOrder::NorthFirst),
        1 => Ok(RowOrder::SouthFirst),
        other => {
            let message = format!("row order is {other}: use 0 (north first) or 1 (south first)");
            Err(Failure::new(HapterraStatus::Choice, message))
        }
    }
}

/// Returns a terrain without heights, which the caller owns until `hapterra_terrain_free`.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_terrain_new() -> Box<HapterraTerrain> {
    Box::default()
}

/// Frees a terrain; null is ignored. Its contacts stay valid.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_terrain_free(terrain: Option<Box<HapterraTerrain>>) {
    drop(terrain);
}

/// Sets `columns` times `rows` heights in millimetres, `cell_mm` apart, row by row in a
/// `HapterraRowOrder`, each row from west to east; NaN is no-data. The heights are copied. Contacts
/// that have begun keep their terrain.
///
/// # Safety
/// At `heights` are `columns` times `rows` values.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_terrain_set_f32(
    terrain: Option<&mut HapterraTerrain>,
    heights: *const f32,
    columns: u32,
    rows: u32,
    cell_mm: f64,
    row_order: u32,
) -> HapterraStatus {
    terrain.map_or(HapterraStatus::NullPointer, |terrain| {
        // SAFETY: by this function's contract.
        unsafe { terrain.put_array(heights, [columns, rows], cell_mm, row_order) }
    })
}

/// Sets heights as `hapterra_terrain_set_f32` does, in double precision.
///
/// # Safety
/// At `heights` are `columns` times `rows` values.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_terrain_set_f64(
    terrain: Option<&mut HapterraTerrain>,
    heights: *const f64,
    columns: u32,
    rows: u32,
    cell_mm: f64,
    row_order: u32,
) -> HapterraStatus {
    terrain.map_or(HapterraStatus::NullPointer, |terrain| {
        // SAFETY: by this function's contract.
        unsafe { terrain.put_array(heights, [columns, rows], cell_mm, row_order) }
    })
}

/// Sets a function that reads heights in millimetres where they are touched. The caller owns the
/// function and `user`, which must stay valid until the terrain and all contacts that began on it
/// are freed. A contact that was moved to another thread calls the function there.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_terrain_set_reader(
    terrain: Option<&mut HapterraTerrain>,
    read: HapterraRead,
    user: *mut c_void,
    columns: u32,
    rows: u32,
    cell_mm: f64,
) -> HapterraStatus {
    terrain.map_or(HapterraStatus::NullPointer, |terrain| {
        terrain.set_terrain(|_| {
            let read = read.ok_or(HapterraStatus::NullPointer)?;
            let reader = Reader { read, user };
            Ok(Terrain::from_tiles(columns, rows, cell_mm, reader)?)
        })
    })
}

/// Sets the millimetres of a unit of the heights, if they are not in millimetres. Applies to the
/// current heights, and to contacts that begin later.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_terrain_set_height_scale(
    terrain: Option<&mut HapterraTerrain>,
    mm_per_unit: f64,
) -> HapterraStatus {
    terrain.map_or(HapterraStatus::NullPointer, |terrain| {
        terrain.set_terrain(|terrain| {
            let terrain = terrain.cloned().ok_or(HapterraStatus::NotBegun)?;
            Ok(terrain.with_height_scale(mm_per_unit)?)
        })
    })
}

/// Sets the radius of the ball that touches the terrain, mm; 0 for a point. The HIP and the proxy
/// are then the ball's centre, one radius above flat ground, and so is
/// `hapterra_terrain_height_mm`. The radius is at most 8 cells. Applies to the current heights, and
/// to contacts that begin later.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_terrain_set_tip(
    terrain: Option<&mut HapterraTerrain>,
    tip_mm: f64,
) -> HapterraStatus {
    terrain.map_or(HapterraStatus::NullPointer, |terrain| {
        terrain.set_terrain(|terrain| {
            let terrain = terrain.cloned().ok_or(HapterraStatus::NotBegun)?;
            Ok(terrain.with_tip(tip_mm)?)
        })
    })
}

/// Sets the material of each sample: the index of one of the surfaces of `hapterra_contact_begin`,
/// row by row in a `HapterraRowOrder`. `count` is the number of samples of the terrain. The
/// materials are copied.
///
/// # Safety
/// At `materials` are `count` values.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_terrain_set_materials(
    terrain: Option<&mut HapterraTerrain>,
    materials: *const u8,
    count: usize,
    order: u32,
) -> HapterraStatus {
    terrain.map_or(HapterraStatus::NullPointer, |terrain| {
        terrain.set_terrain(|terrain| {
            let terrain = terrain.cloned().ok_or(HapterraStatus::NotBegun)?;
            // SAFETY: by this function's contract.
            let materials = unsafe { array(materials, count) }?;
            Ok(terrain.with_materials(row_order(order)?, materials.to_vec())?)
        })
    })
}

/// Returns the height of the surface at a position, mm, or of a ball's centre over it; NaN for
/// no-data, outside the terrain, if it cannot be read, and for null.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_terrain_height_mm(
    terrain: Option<&HapterraTerrain>,
    east_mm: f64,
    north_mm: f64,
) -> f64 {
    let terrain = terrain.and_then(|terrain| terrain.terrain.as_ref());
    let height = catch_panic(|| Ok(terrain.and_then(|it| it.height_mm(east_mm, north_mm))));
    height.ok().flatten().unwrap_or(f64::NAN)
}

/// Returns the message of the terrain's last error, empty if there was none, null for null. The
/// terrain owns the message, which is valid until the next call with it.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_terrain_message(terrain: Option<&HapterraTerrain>) -> *const c_char {
    terrain.map_or(std::ptr::null(), |terrain| terrain.message.as_ptr())
}
