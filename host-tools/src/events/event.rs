//! The lines: one JSON object each.

use serde::Serialize;

use heightfield::printable_text::printable_json;

/// Version of the lines. Fields may be added in a version; none changes its meaning.
pub const FORMAT: u32 = 1;

/// An event.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event<'e> {
    /// The first line for a reader.
    Hello {
        /// [`FORMAT`].
        format: u32,
        /// Version of the program.
        program: &'static str,
    },
    /// Lines that this reader was too slow for, since the line before.
    Dropped {
        /// The number.
        lines: u64,
    },
    /// The contact begins or ends.
    Contact {
        /// True if it begins.
        touching: bool,
        /// Speed of the HIP into the surface, mm/s; none where it ends or is not known.
        speed_mm_s: Option<f64>,
        /// Force on the hand, N: east, north, up.
        force_n: [f64; 3],
        /// The place.
        #[serde(flatten)]
        place: Place,
    },
    /// The proxy has moved while it touches, a tenth of a second after the last place at the
    /// earliest.
    Place(Place),
    /// Another material is touched.
    Material {
        /// Its class in the file; none for the default.
        class: Option<i64>,
        /// Its name in the table.
        name: Option<&'e str>,
    },
    /// Another placement is in force.
    View {
        /// The view, counted from 0.
        view: usize,
        /// Level of detail: every 2^level-th sample.
        level: u8,
        /// Device millimetres a haptic cell of level 0.
        cell_mm: f64,
        /// Side of such a cell on the ground, m, if the file states it.
        cell_m: Option<f64>,
        /// Device millimetres a vertical unit of the file.
        height_mm_per_unit: f64,
    },
    /// The limits of the force, the mode or the fault has
    /// changed.
    Limits {
        /// Names of the limits, as in the column `limits` of a recording.
        limits: Vec<&'static str>,
        /// As the column `mode`.
        mode: &'static str,
        /// Number of the latched fault.
        fault: Option<u8>,
    },
    /// A tick of the loop.
    Sample {
        /// The HIP, device millimetres of the view: east, north, up.
        hip_mm: [f64; 3],
        /// The proxy, mm; the HIP where nothing is touched.
        proxy_mm: [f64; 3],
        /// Force on the hand, N: east, north, up.
        force_n: [f64; 3],
        /// State of the contact, as the column `state` of a recording.
        state: &'static str,
        /// As the column `mode`.
        mode: &'static str,
        /// The view, counted from 0.
        view: usize,
    },
    /// Instructions for arming.
    Arming {
        /// Lines for the user.
        lines: &'e [String],
        /// Number of the question that is open now, which the command `enter` answers.
        asks: Option<u32>,
    },
    /// A command was not done.
    Refused {
        /// The reason.
        text: &'e str,
    },
    /// The session with the device is over.
    End {
        /// True if the device has confirmed that it is disarmed.
        disarmed: bool,
    },
    /// A mark was made.
    Mark {
        /// The tick that was marked; none where the device has not answered.
        marked_tick: Option<u32>,
        /// Time of that tick, s, as `t_s`.
        marked_t_s: f64,
        /// The host's clock when the mark was asked for, seconds since 1970 in UTC.
        host_unix_s: f64,
        /// Its text.
        text: &'e str,
    },
}

/// Position of the proxy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Device millimetres of the view: east, north, up from the south-west sample at height 0.
    pub proxy_mm: [f64; 3],
    /// In the file's coordinates: x, y; columns and rows from the south-west where it has none.
    pub ground: [f64; 2],
    /// Longitude and latitude, degrees, where they are known.
    pub lonlat: Option<[f64; 2]>,
    /// Height, m; of a file that states no vertical unit, in its unit.
    pub height_m: f64,
}

/// A line: an event, of which device and when.
#[derive(Serialize)]
pub(super) struct Line<'l> {
    #[serde(flatten)]
    pub(super) event: &'l Event<'l>,
    #[serde(flatten)]
    pub(super) at: Option<At>,
}

/// Of which device, and when.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct At {
    /// The device, counted from 1 in the order of `--device`.
    pub(super) device: usize,
    /// The latest tick, as the column `tick` of a recording.
    pub(super) tick: u32,
    /// Its time, s, as the column `t_s`.
    pub(super) t_s: f64,
}

impl Line<'_> {
    /// The line with its end.
    pub(super) fn text(&self) -> String {
        // Numbers, text and lists always have a form in JSON.
        printable_json(&serde_json::to_string(self).unwrap_or_default()) + "\n"
    }
}
