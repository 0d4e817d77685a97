//! Outcomes of all injected faults, as a table.

use std::collections::BTreeMap;

use hapterra_core::guard::Fault;

use super::fault_kind::Kind;
use super::maxima::Maxima;
use crate::campaign_table::Rows;

/// Outcome of an injected fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The arm stayed armed.
    Ridden,
    /// The arm was disarmed, without a fault.
    Disarmed,
    /// A fault was latched.
    Latched(Fault),
}

/// Results of one kind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Row {
    injected: u32,
    ridden: u32,
    disarmed: u32,
    /// By the fault's number.
    latched: BTreeMap<u8, (Fault, u32)>,
    /// Most ticks after the first one with the amplifiers on, before the fault was latched or the
    /// arm disarmed.
    worst: Option<u64>,
}

/// All outcomes of a campaign.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkStats {
    rows: Rows<Kind, Row>,
    /// Ticks run.
    pub ticks: u64,
    /// Ticks with the amplifiers on.
    pub armed: u64,
    /// The largest values.
    pub extremes: Maxima,
}

impl LinkStats {
    /// Counts an injected fault.
    ///
    /// # Errors
    /// If the outcome is not the expected one of its kind.
    pub fn count(
        &mut self,
        kind: Kind,
        outcome: Outcome,
        reaction: Option<u64>,
    ) -> Result<(), String> {
        let row = self.rows.of(kind);
        row.injected += 1;
        let expected = kind.expectation();
        let fits = match outcome {
            Outcome::Ridden => {
                row.ridden += 1;
                expected.may_ride
            }
            Outcome::Disarmed => {
                row.disarmed += 1;
                expected.may_disarm
            }
            Outcome::Latched(fault) => {
                row.latched.entry(fault.number()).or_insert((fault, 0)).1 += 1;
                expected.may_latch.contains(&fault)
            }
        };
        row.worst = row.worst.max(reaction);
        if !fits {
            return Err(format!(
                "{kind:?} ended as {outcome:?}, expected {expected:?}"
            ));
        }
        match (expected.within, reaction) {
            (Some(max), Some(took)) if took <= u64::from(max) => Ok(()),
            (Some(max), took) => Err(format!(
                "{kind:?}: amplifiers on for {took:?} ticks, expected at most {max}"
            )),
            (None, _) => Ok(()),
        }
    }

    /// Adds a segment's ticks and extremes.
    pub fn add(&mut self, ticks: u64, armed: u64, extremes: &Maxima) {
        self.ticks += ticks;
        self.armed += armed;
        self.extremes = self.extremes.max(*extremes);
    }

    /// Returns the number of injected faults.
    #[must_use]
    pub fn injected(&self) -> u32 {
        self.rows.sum(|row| row.injected)
    }

    /// Returns the number of times that a kind was injected.
    #[must_use]
    pub fn injected_of(&self, kind: Kind) -> u32 {
        self.rows.get(kind).map_or(0, |row| row.injected)
    }

    /// Returns the table in Markdown.
    #[must_use]
    pub fn table(&self) -> String {
        let heading = "| fault | injected | ridden through | disarmed | latched | amplifiers on, ticks |\n\
             | --- | ---: | ---: | ---: | --- | ---: |\n";
        self.rows.table(heading, &Kind::ALL, |row| {
            let latched = row.latched.values();
            let latched: Vec<_> = latched
                .map(|(fault, count)| format!("{count} {fault:?}"))
                .collect();
            let worst = row.worst.map_or("always".into(), |ticks| ticks.to_string());
            let (injected, ridden, disarmed) = (row.injected, row.ridden, row.disarmed);
            let latched = latched.join(", ");
            format!("{injected} | {ridden} | {disarmed} | {latched} | {worst}")
        })
    }
}
