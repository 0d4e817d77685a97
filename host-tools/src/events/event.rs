//! Events: one JSON object a line.

use serde::Serialize;

use heightfield::printable_text::printable_json;

/// Version of the format. A version may add fields, but does not change their meaning.
pub const FORMAT: u32 = 1;

/// An event.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event<'e> {
    /// The first line that a reader receives.
    Hello {
        /// [`FORMAT`].
        format: u32,
        /// Version of the program.
        program: &'static str,
    },
    /// Lines lost since the last one because this reader was too slow.
    Dropped {
        /// Number of lost lines.
        lines: u64,
    },
    /// The contact begins or ends.
    Contact {
        /// True if it begins.
        touching: bool,
        /// Speed of the HIP into the surface, mm/s; `None` at the end of a contact or if unknown.
        speed_mm_s: Option<f64>,
        /// Force on the hand, N: east, north, up.
        force_n: [f64; 3],
        /// Position of the proxy.
        #[serde(flatten)]
        place: Place,
    },
    /// The proxy moved in contact. Sent at most every 0.1 s.
    Place(Place),
    /// The material at the proxy changed.
    Material {
        /// The material's class in the file; `None` for the default.
        class: Option<i64>,
        /// The material's name in the table.
        name: Option<&'e str>,
    },
    /// The placement changed.
    View {
        /// Number of the placement, from 0.
        view: usize,
        /// Level of detail: every 2^level-th sample.
        level: u8,
        /// Device millimetres per haptic cell of level 0.
        cell_mm: f64,
        /// Side of a level-0 cell on the ground, m, if the file states it.
        cell_m: Option<f64>,
        /// Device millimetres per vertical unit of the file.
        height_mm_per_unit: f64,
    },
    /// The force limits, the mode or the fault changed.
    Limits {
        /// Names of the limits, as in the column `limits` of a recording.
        limits: Vec<&'static str>,
        /// Mode, as in the column `mode`.
        mode: &'static str,
        /// Number of the latched fault.
        fault: Option<u8>,
    },
    /// A sample of one tick.
    Sample {
        /// The HIP, device millimetres of the placement: east, north, up.
        hip_mm: [f64; 3],
        /// The proxy, mm; equal to the HIP without contact.
        proxy_mm: [f64; 3],
        /// Force on the hand, N: east, north, up.
        force_n: [f64; 3],
        /// State of the contact, as in the column `state` of a recording.
        state: &'static str,
        /// Mode, as in the column `mode`.
        mode: &'static str,
        /// Number of the placement, from 0.
        view: usize,
    },
    /// Instructions for arming.
    Arming {
        /// Lines for the user.
        lines: &'e [String],
        /// Number of the open question, which the command `enter` answers.
        asks: Option<u32>,
    },
    /// A command was refused.
    Refused {
        /// The reason.
        text: &'e str,
    },
    /// The session with the device ended.
    End {
        /// True if the device has confirmed that it is disarmed.
        disarmed: bool,
    },
    /// A mark was made.
    Mark {
        /// The marked tick; `None` if the device has not replied.
        marked_tick: Option<u32>,
        /// Time of the marked tick, s, as `t_s`.
        marked_t_s: f64,
        /// The host's clock at the mark's request, seconds since 1970 in UTC.
        host_unix_s: f64,
        /// The mark's text.
        text: &'e str,
    },
}

/// Position of the proxy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Device millimetres of the placement: east, north, up from the south-west sample at height 0.
    pub proxy_mm: [f64; 3],
    /// Position in the file's coordinates: x, y; without these, columns and rows from the
    /// south-west.
    pub ground: [f64; 2],
    /// Longitude and latitude, degrees, if known.
    pub lonlat: Option<[f64; 2]>,
    /// Height, m; in the file's unit if its vertical unit is not stated.
    pub height_m: f64,
}

/// A line: an event with its device and time.
#[derive(Serialize)]
pub(super) struct Line<'l> {
    #[serde(flatten)]
    pub(super) event: &'l Event<'l>,
    #[serde(flatten)]
    pub(super) at: Option<At>,
}

/// Device and time of an event.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct At {
    /// The device, counted from 1 in the order of `--device`.
    pub(super) device: usize,
    /// The latest tick, as in the column `tick` of a recording.
    pub(super) tick: u32,
    /// The time of the tick, s, as in the column `t_s`.
    pub(super) t_s: f64,
}

impl Line<'_> {
    /// Returns the line with its line end.
    pub(super) fn text(&self) -> String {
        // Numbers, text and lists can always be serialised to JSON.
        printable_json(&serde_json::to_string(self).unwrap_or_default()) + "\n"
    }
}
