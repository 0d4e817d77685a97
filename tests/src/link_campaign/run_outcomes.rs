//! Outcomes of the runs, as a table.

use std::collections::BTreeMap;

use super::fault::Kind;
use crate::campaign::maxima::Maxima;
use crate::campaign_table::Rows;

/// End of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Host and device agreed on the end.
    Agreed,
    /// The fault was reported to the user.
    Reported(String),
    /// The host was killed, and no other connected in this run.
    Killed,
}

/// Results of the runs with one kind of fault.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Row {
    runs: u32,
    agreed: u32,
    killed: u32,
    /// By the error's text, without numbers.
    reported: BTreeMap<String, u32>,
}

/// All outcomes of a campaign.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkStats {
    rows: Rows<Kind, Row>,
    /// Ticks of all devices, and those with the amplifiers on.
    pub ticks: [u64; 2],
    /// Samples in contact whose proxy was checked against the surface.
    pub touching: u64,
    /// The largest distance of a proxy from the surface, cells.
    pub off_surface: f64,
    /// The largest values of the tick checks.
    pub extremes: Maxima,
}

impl LinkStats {
    /// Counts a run.
    pub fn count(&mut self, kind: Kind, outcome: Outcome) {
        let row = self.rows.of(kind);
        row.runs += 1;
        match outcome {
            Outcome::Agreed => row.agreed += 1,
            Outcome::Killed => row.killed += 1,
            Outcome::Reported(error) => {
                let words = error.split([':', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']);
                let begin = words.into_iter().next().unwrap_or_default();
                *row.reported.entry(begin.trim().to_owned()).or_default() += 1;
            }
        }
    }

    /// Adds the measurements of a segment.
    pub fn add(&mut self, ticks: [u64; 2], touching: u64, off_surface: f64, extremes: &Maxima) {
        self.ticks = [0, 1].map(|i| self.ticks[i] + ticks[i]);
        self.touching += touching;
        self.off_surface = self.off_surface.max(off_surface);
        self.extremes = self.extremes.max(*extremes);
    }

    /// Returns the number of runs with this kind of fault.
    #[must_use]
    pub fn runs_with(&self, kind: Kind) -> u32 {
        self.rows.get(kind).map_or(0, |row| row.runs)
    }

    /// Returns the number of runs.
    #[must_use]
    pub fn runs(&self) -> u32 {
        self.rows.sum(|row| row.runs)
    }

    /// Returns the number of runs whose end host and device agreed on.
    #[must_use]
    pub fn agreed(&self) -> u32 {
        self.rows.sum(|row| row.agreed)
    }

    /// Returns the table in Markdown.
    #[must_use]
    pub fn table(&self) -> String {
        let heading = "| fault | runs | end agreed | host killed |\n\
             | --- | ---: | ---: | ---: |\n";
        let runs = self.rows.table(heading, &Kind::ALL, |row| {
            format!("{} | {} | {}", row.runs, row.agreed, row.killed)
        });
        let mut reports =
            "\n| fault | runs | reported to the user |\n| --- | ---: | --- |\n".to_owned();
        for kind in Kind::ALL {
            let reported = self
                .rows
                .get(kind)
                .into_iter()
                .flat_map(|row| &row.reported);
            reports
                .extend(reported.map(|(words, runs)| format!("| {kind:?} | {runs} | {words} |\n")));
        }
        runs + &reports
    }
}
