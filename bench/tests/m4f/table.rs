//! The table of counts: the stored ones, the targets, and the present ones.

use std::fmt;

use hapterra_tests::cycles::Cycles;
use hapterra_tests::instruction_counter::Counted;
use hapterra_tests::repository;

/// The stored table, in the repository.
const TABLE: &str = "bench/instructions-m4f.csv";
/// A count above the stored one by more than this share, and by more than [`TOLERANCE_COUNT`]
/// instructions, is a regression: another compiler may need a few more.
const TOLERANCE: f64 = 0.05;
const TOLERANCE_COUNT: f64 = 10.0;
/// Least work of the ticks from which the cost of a unit is computed: in shorter ones the constant
/// part would weigh as much as the units.
const UNITS: u32 = 8;
/// The quantiles of the ticks.
const SHARES: [f64; 3] = [0.5, 0.99, 1.0];
/// The columns, after the state's name.
const COUNTS: [&str; 3] = ["median", "p99", "max"];
const COLUMNS: [&str; 12] = [
    "state",
    COUNTS[0],
    COUNTS[1],
    COUNTS[2],
    "target median",
    "target p99",
    "target max",
    "least per unit",
    "most per unit",
    "units of worst",
    "scene of worst",
    "tick of worst",
];

/// Target, instructions a tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Target {
    /// For the median tick.
    pub(crate) median: Option<u32>,
    /// For the 99th percentile.
    pub(crate) p99: Option<u32>,
    /// For the costliest tick.
    pub(crate) max: Option<u32>,
}

/// Cost of one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tick {
    /// Instructions, with the call and the return.
    pub(crate) instructions: u32,
    /// Cycles on the boards' chips, if they are computed.
    pub(crate) cycles: Cycles,
    /// Work units; 0 if more than the contact was counted.
    pub(crate) units: u32,
    /// The number of its scene in the stress test.
    pub(crate) scene: Option<u64>,
    /// Its index among the ticks of its scene.
    pub(crate) index: usize,
}

/// One state's ticks.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) state: String,
    /// Instructions: median, 99th percentile, maximum.
    pub(crate) counts: [u32; 3],
    /// Targets.
    target: [Option<u32>; 3],
    /// The ticks with the fewest and the most instructions a work unit.
    per_unit: Option<[Tick; 2]>,
    worst: Tick,
    /// Cycles, if computed, of an STM32G474 and of an STM32H743, with the same three quantiles.
    pub(crate) cycles: [[u32; 3]; 2],
    /// True if the stored row covers more ticks: only its largest count limits this one.
    is_part: bool,
}

impl Tick {
    /// Returns a tick of the whole chain, with its index among the ticks of its run.
    pub(crate) fn of(counted: &Counted, index: usize) -> Self {
        Self {
            instructions: counted.instructions,
            cycles: counted.cycles,
            units: 0,
            scene: None,
            index,
        }
    }

    fn per_unit(&self) -> f64 {
        f64::from(self.instructions) / f64::from(self.units)
    }
}

impl fmt::Display for Tick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            instructions,
            units,
            scene,
            index,
            ..
        } = self;
        let scene = scene
            .map(|scene| format!("scene {scene}, "))
            .unwrap_or_default();
        write!(
            f,
            "{instructions} instructions and {units} units in {scene}tick {index}"
        )
    }
}

impl Row {
    /// Titles of a row's columns on the screen.
    pub(crate) const TITLES: &str =
        "state                              median     p99     max   target";

    /// Computes a row from its ticks.
    pub(crate) fn new(state: &str, target: Target, mut ticks: Vec<Tick>) -> Self {
        assert!(ticks.len() >= 100, "{state}: {} ticks", ticks.len());
        let long = || ticks.iter().filter(|tick| tick.units >= UNITS).copied();
        let by_cost = |a: &Tick, b: &Tick| a.per_unit().total_cmp(&b.per_unit());
        let (min, max) = (long().min_by(by_cost), long().max_by(by_cost));
        let per_unit = min.zip(max).map(|(min, max)| [min, max]);
        let of_cycles = |of: fn(&Cycles) -> u32| {
            let mut cycles: Vec<u32> = ticks.iter().map(|tick| of(&tick.cycles)).collect();
            cycles.sort_unstable();
            SHARES.map(|share| *at(&cycles, share))
        };
        let cycles = [of_cycles(|c| c.g474), of_cycles(|c| c.h743)];
        ticks.sort_unstable_by_key(|tick| (tick.instructions, tick.scene, tick.index));
        Self {
            state: state.to_owned(),
            counts: SHARES.map(|share| at(&ticks, share).instructions),
            cycles,
            target: [target.median, target.p99, target.max],
            per_unit,
            worst: *at(&ticks, 1.0),
            is_part: false,
        }
    }

    /// Marks the row as covering a part of the stored row's ticks.
    pub(crate) fn of_a_part(self) -> Self {
        Self {
            is_part: true,
            ..self
        }
    }

    /// Returns its cells, in the order of [`COLUMNS`].
    fn record(&self) -> Vec<String> {
        let of = |number: Option<u32>| number.map(|n| n.to_string()).unwrap_or_default();
        let per_unit = |i: usize| {
            self.per_unit
                .map(|ticks| format!("{:.1}", ticks[i].per_unit()))
        };
        let mut record = vec![self.state.clone()];
        record.extend(self.counts.map(|count| count.to_string()));
        record.extend(self.target.map(of));
        record.extend([0, 1].map(|i| per_unit(i).unwrap_or_default()));
        record.push(self.worst.units.to_string());
        let scene = self.worst.scene.map(|scene| scene.to_string());
        record.push(scene.unwrap_or_default());
        record.push(self.worst.index.to_string());
        record
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, p99, max] = self.counts;
        write!(f, "{:32} {median:8} {p99:7} {max:7}  ", self.state)?;
        for ((target, name), count) in self.target.iter().zip(COUNTS).zip(self.counts) {
            if let Some(target) = target {
                let verdict = if count <= *target { "met" } else { "missed" };
                write!(f, " {name} ≤ {target} {verdict}")?;
            }
        }
        let Some([min, max]) = self.per_unit else {
            return Ok(());
        };
        write!(f, "\n        worst: {}", self.worst)?;
        let [from, to] = [min, max].map(|tick| tick.per_unit());
        write!(
            f,
            "\n        a unit: {from:.0} to {to:.0} instructions, most: {max}"
        )
    }
}

/// Returns the quantile of a sorted list.
fn at<T>(sorted: &[T], share: f64) -> &T {
    &sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

/// The stored table: the median, 99th percentile and largest count of each state.
pub(crate) struct Table(Vec<(String, [f64; 3])>);

impl Table {
    /// Reads the stored table.
    pub(crate) fn recorded() -> Self {
        let mut table =
            csv::Reader::from_path(repository().join(TABLE)).expect("the table is there");
        let rows = table.records().map(|row| {
            let row = row.expect("a row");
            let count = |i: usize| row[i].parse().expect("a count");
            (row[0].to_owned(), [count(1), count(2), count(3)])
        });
        Self(rows.collect())
    }

    /// Returns the scenes of the stress test with the costliest ticks of all and of each kind:
    /// without friction, and with.
    pub(crate) fn recorded_scenes() -> [Vec<u64>; 2] {
        let mut table =
            csv::Reader::from_path(repository().join(TABLE)).expect("the table is there");
        let rows = table.records().map(|row| row.expect("a row"));
        let named = rows.filter_map(|row| {
            let scene = row[10].parse::<u64>().ok()?;
            Some((row[0].contains("rough surfaces"), scene))
        });
        let (rough, smooth): (Vec<_>, Vec<_>) = named.partition(|(is_rough, _)| *is_rough);
        [smooth, rough].map(|named| named.into_iter().map(|(_, scene)| scene).collect())
    }

    /// Writes the table.
    pub(crate) fn write(rows: &[Row]) {
        let mut table =
            csv::Writer::from_path(repository().join(TABLE)).expect("the table can be written");
        table.write_record(COLUMNS).expect("written");
        for row in rows {
            table.write_record(row.record()).expect("written");
        }
    }

    /// Returns a message for each count above the table's allowance, or above a target that the
    /// table meets.
    pub(crate) fn regressions(&self, rows: &[Row]) -> Vec<String> {
        rows.iter()
            .flat_map(|row| self.row_regressions(row))
            .collect()
    }

    fn row_regressions(&self, row: &Row) -> Vec<String> {
        let recorded = self.0.iter().find(|(state, _)| *state == row.state);
        let Some((_, recorded)) = recorded else {
            return vec![format!("{}: not in the table", row.state)];
        };
        let binding = if row.is_part { 2..3 } else { 0..3 };
        let is_worse = |i: &usize| {
            let (count, recorded) = (f64::from(row.counts[*i]), recorded[*i]);
            let target = row.target[*i].map_or(f64::INFINITY, f64::from);
            let misses = recorded <= target && count > target;
            misses || (count > recorded * (1.0 + TOLERANCE) && count > recorded + TOLERANCE_COUNT)
        };
        let reported = |i: usize| {
            let (name, count, recorded) = (COUNTS[i], row.counts[i], recorded[i]);
            format!(
                "{}: {name} {count} instructions, {recorded} in the table",
                row.state
            )
        };
        binding.filter(is_worse).map(reported).collect()
    }
}
