//! The table of counts: what is kept, what was meant, what is now.

use std::fmt;

/// The kept table.
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instructions-m4f.csv");
/// More than this share above the kept count is a regression, and more than
/// [`LEEWAY`] instructions: another compiler may take a few.
const TOLERANCE: f64 = 0.05;
const LEEWAY: f64 = 10.0;

/// What was set as a target, instructions a tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Target {
    /// For the usual tick.
    pub(crate) median: Option<u32>,
    /// For all but one in a hundred.
    pub(crate) p99: Option<u32>,
    /// For the worst.
    pub(crate) max: Option<u32>,
}

/// One state's ticks.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// Its name.
    pub(crate) state: String,
    /// Instructions: median, 99th percentile, most.
    pub(crate) counts: [u32; 3],
    /// What they were meant to be.
    pub(crate) target: Target,
}

impl Row {
    /// Over the columns of a row on screen.
    pub(crate) const TITLES: &str =
        "state                              median     p99     max   target";

    /// From the counts of its ticks.
    pub(crate) fn new(state: &str, target: Target, mut ticks: Vec<u32>) -> Self {
        assert!(ticks.len() >= 100, "{state}: {} ticks", ticks.len());
        ticks.sort_unstable();
        let at = |share: f64| ticks[((ticks.len() - 1) as f64 * share).round() as usize];
        Self {
            state: state.to_owned(),
            counts: [at(0.5), at(0.99), at(1.0)],
            target,
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, p99, max] = self.counts;
        write!(f, "{:32} {median:8} {p99:7} {max:7}  ", self.state)?;
        let targets = [self.target.median, self.target.p99, self.target.max];
        let names = ["median", "p99", "max"];
        for ((target, name), count) in targets.iter().zip(names).zip(self.counts) {
            if let Some(target) = target {
                let verdict = if count <= *target { "met" } else { "missed" };
                write!(f, " {name} ≤ {target} {verdict}")?;
            }
        }
        Ok(())
    }
}

/// The kept table: `state,median,p99,max` and the targets beside them.
pub(crate) struct Table(Vec<(String, [f64; 3])>);

impl Table {
    /// Reads it.
    pub(crate) fn kept() -> Self {
        type Record = (String, f64, f64, f64, String, String, String);
        let mut table = csv::Reader::from_path(TABLE).expect("the table is there");
        let rows = table.deserialize::<Record>().map(|row| {
            let (state, median, p99, max, ..) = row.expect("state and counts");
            (state, [median, p99, max])
        });
        Self(rows.collect())
    }

    /// Writes it anew.
    pub(crate) fn write(rows: &[Row]) {
        let mut table = csv::Writer::from_path(TABLE).expect("the table can be written");
        let titles = ["state", "median", "p99", "max"];
        let targets = ["target median", "target p99", "target max"];
        table
            .write_record(titles.iter().chain(&targets))
            .expect("written");
        for row in rows {
            let counts = row.counts.map(|count| count.to_string());
            let target = [row.target.median, row.target.p99, row.target.max]
                .map(|target| target.map(|t| t.to_string()).unwrap_or_default());
            let record = std::iter::once(&row.state).chain(&counts).chain(&target);
            table.write_record(record).expect("written");
        }
    }

    /// A sentence for each count that is more than the table allows.
    pub(crate) fn worse(&self, rows: &[Row]) -> Vec<String> {
        let mut worse = Vec::new();
        for row in rows {
            let kept = self.0.iter().find(|(state, _)| *state == row.state);
            let Some((_, kept)) = kept else {
                worse.push(format!("{}: not in the table", row.state));
                continue;
            };
            for ((name, kept), count) in ["median", "p99", "max"].iter().zip(kept).zip(row.counts) {
                let count = f64::from(count);
                if count > kept * (1.0 + TOLERANCE) && count > kept + LEEWAY {
                    worse.push(format!(
                        "{}: {name} {count} instructions, {kept} in the table",
                        row.state
                    ));
                }
            }
        }
        worse
    }
}
