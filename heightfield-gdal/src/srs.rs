//! Reference systems from PROJ, by their text or code.

use std::ffi::{CStr, c_char, c_int};
use std::ptr;

use crate::error::Error;
use crate::functions::Handle;
use crate::libgdal::Libgdal;
use crate::text::{from_c, to_c};

/// `OGRERR_NONE`.
const FINE: c_int = 0;
/// Min confidence, percent, at which a match counts as the same system.
const MIN_CONFIDENCE: c_int = 90;

/// A horizontal reference system, as described by PROJ.
#[derive(Clone, Debug, PartialEq)]
pub struct SpatialReference {
    /// As `NAD83 / UTM zone 11N`.
    pub name: String,
    /// EPSG's code, if it has one.
    pub epsg: Option<u32>,
    /// EPSG's code of its geographic system.
    pub base_epsg: Option<u32>,
    /// Name of its projection's method, as `New_Zealand_Map_Grid`.
    pub method: Option<String>,
    /// Name of its datum.
    pub datum: Option<String>,
    /// Unit of its coordinates.
    pub unit: AxisUnit,
    /// The projection in PROJ's syntax; `None` if it cannot be written so.
    pub proj: Option<String>,
    /// Semi-major axis of its ellipsoid, m, and inverse flattening, 0 for a sphere.
    pub ellipsoid: [f64; 2],
    /// Prime meridian, degrees east of Greenwich.
    pub meridian: f64,
    /// Three or seven parameters of a shift to WGS 84, if the text has them: m, arc seconds, parts
    /// per million, with the position vector convention.
    pub to_wgs84: Option<[f64; 7]>,
}

/// Unit of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisUnit {
    /// An angle, in radians.
    Radians(f64),
    /// A length, in metres.
    Metres(f64),
}

/// A system in GDAL's memory.
struct Owned<'l> {
    libgdal: &'l Libgdal,
    handle: Handle,
}

impl Drop for Owned<'_> {
    fn drop(&mut self) {
        // SAFETY: created by GDAL, and freed once.
        unsafe { (self.libgdal.functions.OSRDestroySpatialReference)(self.handle) };
    }
}

impl SpatialReference {
    /// Creates a system from its text (WKT of any kind).
    pub(crate) fn of_text(libgdal: &Libgdal, text: &str) -> Result<Self, Error> {
        let text = to_c(text)?;
        let system = Owned::new(libgdal)?;
        let mut at = text.as_ptr().cast_mut();
        // SAFETY: GDAL advances the pointer past the text that it has read, and does not write to
        // it.
        let status = unsafe { (libgdal.functions.OSRImportFromWkt)(system.handle, &raw mut at) };
        system.read(status)
    }

    /// Creates a system from its code.
    pub(crate) fn of_epsg(libgdal: &Libgdal, code: u16) -> Result<Self, Error> {
        let system = Owned::new(libgdal)?;
        // SAFETY: the system was made above.
        let status = unsafe { (libgdal.functions.OSRImportFromEPSG)(system.handle, code.into()) };
        system.read(status)
    }
}

impl<'l> Owned<'l> {
    fn new(libgdal: &'l Libgdal) -> Result<Self, Error> {
        // SAFETY: null means an empty system.
        let handle = unsafe {
            (libgdal.functions.CPLErrorReset)();
            (libgdal.functions.OSRNewSpatialReference)(ptr::null())
        };
        match handle.is_null() {
            true => Err(libgdal.refused("no reference system can be made")),
            false => Ok(Self { libgdal, handle }),
        }
    }

    fn read(&self, status: c_int) -> Result<SpatialReference, Error> {
        let functions = &self.libgdal.functions;
        let handle = self.handle;
        let refused = || {
            self.libgdal
                .refused("PROJ does not support the reference system")
        };
        // SAFETY: here and below, the system exists, and each function only reads it; null means an
        // unneeded name, and the pointers to numbers are valid.
        let kind = unsafe {
            [
                (functions.OSRIsGeographic)(handle),
                (functions.OSRIsProjected)(handle),
            ]
        };
        let unit = match kind {
            _ if status != FINE => return Err(refused()),
            [0, 0] => return Err(refused()),
            // SAFETY: as above.
            [0, _] => {
                AxisUnit::Metres(unsafe { (functions.OSRGetLinearUnits)(handle, ptr::null_mut()) })
            }
            // SAFETY: as above.
            _ => AxisUnit::Radians(unsafe {
                (functions.OSRGetAngularUnits)(handle, ptr::null_mut())
            }),
        };
        let mut status = FINE;
        let mut to_wgs84 = [0.0; 7];
        // SAFETY: as above; the name is copied.
        let (name, major, inverse, meridian, shift) = unsafe {
            (
                from_c((functions.OSRGetName)(handle)),
                (functions.OSRGetSemiMajor)(handle, &raw mut status),
                (functions.OSRGetInvFlattening)(handle, &raw mut status),
                (functions.OSRGetPrimeMeridian)(handle, ptr::null_mut()),
                (functions.OSRGetTOWGS84)(handle, to_wgs84.as_mut_ptr(), 7),
            )
        };
        Ok(SpatialReference {
            name: name.unwrap_or_default(),
            epsg: self.epsg(),
            base_epsg: (self.base().and_then(|base| base.epsg())).or_else(|| self.usual_base()),
            method: self.attribute(c"PROJECTION"),
            datum: self.attribute(c"DATUM"),
            unit,
            proj: self.proj(),
            ellipsoid: [major, inverse],
            meridian,
            to_wgs84: (shift == FINE).then_some(to_wgs84),
        })
    }

    fn attribute(&self, name: &CStr) -> Option<String> {
        // SAFETY: the system exists; the text is copied.
        unsafe {
            from_c((self.libgdal.functions.OSRGetAttrValue)(
                self.handle,
                name.as_ptr(),
                0,
            ))
        }
    }

    /// Returns its geographic system.
    fn base(&self) -> Option<Self> {
        // SAFETY: the system exists; the copy is a new one.
        let handle = unsafe { (self.libgdal.functions.OSRCloneGeogCS)(self.handle) };
        (!handle.is_null()).then_some(Self { handle, ..*self })
    }

    /// Returns the system in PROJ's syntax.
    fn proj(&self) -> Option<String> {
        let functions = &self.libgdal.functions;
        let mut text: *mut c_char = ptr::null_mut();
        // SAFETY: GDAL returns a text, which is copied and freed.
        unsafe {
            let status = (functions.OSRExportToProj4)(self.handle, &raw mut text);
            let copy = from_c(text);
            (functions.VSIFree)(text.cast());
            copy.filter(|_| status == FINE)
        }
    }

    /// Returns EPSG's code as stated, or the code of a single certain match.
    fn epsg(&self) -> Option<u32> {
        self.code_of(ptr::null()).or_else(|| self.matching())
    }

    /// Returns the code of the datum's geographic system: for datum codes in EPSG's oldest range,
    /// the code less 2000.
    fn usual_base(&self) -> Option<u32> {
        let datum = self.code_of(c"DATUM".as_ptr())?;
        (6000..7000).contains(&datum).then(|| datum - 2000)
    }

    /// Returns the stated EPSG code of a part, or of the system itself (null).
    fn code_of(&self, part: *const c_char) -> Option<u32> {
        let functions = &self.libgdal.functions;
        // SAFETY: the part is null or a valid text; texts are copied.
        let (authority, code) = unsafe {
            (
                from_c((functions.OSRGetAuthorityName)(self.handle, part)),
                from_c((functions.OSRGetAuthorityCode)(self.handle, part)),
            )
        };
        authority.filter(|name| name == "EPSG")?;
        code?.parse().ok()
    }

    fn matching(&self) -> Option<u32> {
        let functions = &self.libgdal.functions;
        let (mut count, mut sureness) = (0, ptr::null_mut());
        // SAFETY: GDAL returns a list of `count` systems and one of as many numbers, which are
        // freed below.
        let found = unsafe {
            (functions.OSRFindMatches)(self.handle, ptr::null(), &raw mut count, &raw mut sureness)
        };
        if found.is_null() {
            return None;
        }
        let mut codes = vec![];
        for at in 0..count.max(0) as usize {
            // SAFETY: both lists have `count` entries; the system belongs to the list and is not
            // dropped.
            unsafe {
                if *sureness.add(at) >= MIN_CONFIDENCE {
                    let handle = *found.add(at);
                    let one = std::mem::ManuallyDrop::new(Owned { handle, ..*self });
                    codes.extend(one.code_of(ptr::null()));
                }
            }
        }
        // SAFETY: GDAL's lists, freed once.
        unsafe {
            (functions.OSRFreeSRSArray)(found);
            (functions.VSIFree)(sureness.cast());
        }
        codes.first().copied()
    }
}
