//! Reference systems of PROJ, by their text or code.

use std::ffi::{CStr, c_char, c_int};
use std::ptr;

use crate::error::Error;
use crate::functions::Handle;
use crate::loaded::Loaded;
use crate::text::{from_c, to_c};

/// `OGRERR_NONE`.
const FINE: c_int = 0;
/// A match at least as sure as this, percent, is the same system under another name.
const SURE: c_int = 90;

/// A horizontal reference system as PROJ describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct SpatialReference {
    /// As `NAD83 / UTM zone 11N`.
    pub name: String,
    /// EPSG's code, where the system is one of EPSG's.
    pub epsg: Option<u32>,
    /// EPSG's code of the geographic system that it stands on.
    pub base_epsg: Option<u32>,
    /// Name of its projection's method, as `New_Zealand_Map_Grid`.
    pub method: Option<String>,
    /// Name of its datum.
    pub datum: Option<String>,
    /// Unit of its coordinates.
    pub unit: AxisUnit,
    /// The projection as PROJ writes it; none where PROJ has no short form of it.
    pub proj: Option<String>,
    /// Semi-major axis of its ellipsoid, m, and inverse flattening, 0 for a sphere.
    pub ellipsoid: [f64; 2],
    /// Degrees east of Greenwich at which longitudes begin.
    pub meridian: f64,
    /// Three or seven parameters of a shift to WGS 84, where the text has them: m, seconds of arc,
    /// parts in a million, in the position vector's sense.
    pub to_wgs84: Option<[f64; 7]>,
}

/// Unit of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisUnit {
    /// An angle of so many radians.
    Radians(f64),
    /// A length of so many metres.
    Metres(f64),
}

/// A system in GDAL's memory.
struct Owned<'l> {
    loaded: &'l Loaded,
    handle: Handle,
}

impl Drop for Owned<'_> {
    fn drop(&mut self) {
        // SAFETY: it was made by GDAL, and is let go once.
        unsafe { (self.loaded.functions.OSRDestroySpatialReference)(self.handle) };
    }
}

impl SpatialReference {
    /// By its text (WKT of any kind).
    pub(crate) fn of_text(loaded: &Loaded, text: &str) -> Result<Self, Error> {
        let text = to_c(text)?;
        let system = Owned::new(loaded)?;
        let mut at = text.as_ptr().cast_mut();
        // SAFETY: GDAL moves the pointer behind what it has read, and writes nothing.
        let said = unsafe { (loaded.functions.OSRImportFromWkt)(system.handle, &raw mut at) };
        system.read(said)
    }

    /// By its code.
    pub(crate) fn of_epsg(loaded: &Loaded, code: u16) -> Result<Self, Error> {
        let system = Owned::new(loaded)?;
        // SAFETY: the system was made above.
        let said = unsafe { (loaded.functions.OSRImportFromEPSG)(system.handle, code.into()) };
        system.read(said)
    }
}

impl<'l> Owned<'l> {
    fn new(loaded: &'l Loaded) -> Result<Self, Error> {
        // SAFETY: null stands for a system of nothing.
        let handle = unsafe {
            (loaded.functions.CPLErrorReset)();
            (loaded.functions.OSRNewSpatialReference)(ptr::null())
        };
        match handle.is_null() {
            true => Err(loaded.refused("no reference system can be made")),
            false => Ok(Self { loaded, handle }),
        }
    }

    fn read(&self, said: c_int) -> Result<SpatialReference, Error> {
        let functions = &self.loaded.functions;
        let handle = self.handle;
        let refused = || {
            self.loaded
                .refused("PROJ does not know the reference system")
        };
        // SAFETY: here and below, the system stays, and each function reads it; null stands for a name
        // that is not wanted, and numbers have room.
        let kind = unsafe {
            [
                (functions.OSRIsGeographic)(handle),
                (functions.OSRIsProjected)(handle),
            ]
        };
        let unit = match kind {
            _ if said != FINE => return Err(refused()),
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
        let mut said = FINE;
        let mut to_wgs84 = [0.0; 7];
        // SAFETY: as above; the text of a name is copied.
        let (name, major, inverse, meridian, shift) = unsafe {
            (
                from_c((functions.OSRGetName)(handle)),
                (functions.OSRGetSemiMajor)(handle, &raw mut said),
                (functions.OSRGetInvFlattening)(handle, &raw mut said),
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
        // SAFETY: the system stays; the text is copied.
        unsafe {
            from_c((self.loaded.functions.OSRGetAttrValue)(
                self.handle,
                name.as_ptr(),
                0,
            ))
        }
    }

    /// The geographic system that it stands on.
    fn base(&self) -> Option<Self> {
        // SAFETY: the system stays; the copy is a new one.
        let handle = unsafe { (self.loaded.functions.OSRCloneGeogCS)(self.handle) };
        (!handle.is_null()).then_some(Self { handle, ..*self })
    }

    /// As PROJ writes it.
    fn proj(&self) -> Option<String> {
        let functions = &self.loaded.functions;
        let mut text: *mut c_char = ptr::null_mut();
        // SAFETY: GDAL hands over a text, which is copied and let go.
        unsafe {
            let said = (functions.OSRExportToProj4)(self.handle, &raw mut text);
            let copy = from_c(text);
            (functions.VSIFree)(text.cast());
            copy.filter(|_| said == FINE)
        }
    }

    /// EPSG's code, as it is stated, or that of the one system that it surely is.
    fn epsg(&self) -> Option<u32> {
        self.stated(ptr::null()).or_else(|| self.matching())
    }

    /// The geographic system of the datum's code: in EPSG's oldest thousand, that less 2000.
    fn usual_base(&self) -> Option<u32> {
        let datum = self.stated(c"DATUM".as_ptr())?;
        (6000..7000).contains(&datum).then(|| datum - 2000)
    }

    /// EPSG's code of a part, or of the system itself (null).
    fn stated(&self, part: *const c_char) -> Option<u32> {
        let functions = &self.loaded.functions;
        // SAFETY: the part is null or a text that stays; texts are copied.
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
        let functions = &self.loaded.functions;
        let (mut count, mut sureness) = (0, ptr::null_mut());
        // SAFETY: GDAL hands over a list of `count` systems and one of as many numbers, which are let go
        // below.
        let found = unsafe {
            (functions.OSRFindMatches)(self.handle, ptr::null(), &raw mut count, &raw mut sureness)
        };
        if found.is_null() {
            return None;
        }
        let mut codes = vec![];
        for at in 0..count.max(0) as usize {
            // SAFETY: both lists are as long; the system belongs to the list and is not dropped.
            unsafe {
                if *sureness.add(at) >= SURE {
                    let handle = *found.add(at);
                    let one = std::mem::ManuallyDrop::new(Owned { handle, ..*self });
                    codes.extend(one.stated(ptr::null()));
                }
            }
        }
        // SAFETY: what GDAL handed over, once.
        unsafe {
            (functions.OSRFreeSRSArray)(found);
            (functions.VSIFree)(sureness.cast());
        }
        codes.first().copied()
    }
}
