//! The columns of a `run` recording, in order, with their meanings for the reference.

/// Columns of the board's loop, which only `run` writes.
pub const TICK_COLUMNS: [&str; 4] = [TICK, WORK, COST, LATE];

const TICK: &str = "tick";
const WORK: &str = "work";
const COST: &str = "cost";
const LATE: &str = "late";

/// Columns that share a meaning, and the meaning.
pub const COLUMNS: [(&[&str], &str); 12] = [
    (&["t_s"], "time of the tick, s"),
    (
        &["x_mm", "y_mm", "z_mm"],
        "the HIP (haptic interface point): east, north, up",
    ),
    (&["contact"], "1 in contact, else 0"),
    (
        &["proxy_x_mm", "proxy_y_mm", "proxy_z_mm"],
        "the proxy; without contact, the HIP",
    ),
    (
        &["force_x_n", "force_y_n", "force_z_n"],
        "the force on the hand, N",
    ),
    (&["state"], "`free`, `touching`, `releasing`, or `unseeded`"),
    (
        &[TICK, WORK],
        "`run`: number of the tick; its contact work in work units",
    ),
    (
        &[COST],
        "`run`: duration of the previous tick, in counts of the device's clock",
    ),
    (&[LATE], "`run`: number of late ticks so far"),
    (&["mode"], "`run`, `demo`: progress of arming"),
    (
        &["limits"],
        "`run`, `demo`: the limits that reduced the force, by name",
    ),
    (&["view"], "number of the [placement](#placements), from 0"),
];
