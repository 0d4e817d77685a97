//! The rows of a campaign's table, one for each kind of fault.

use std::fmt::Debug;

/// Counts by kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows<K, R>(Vec<(K, R)>);

impl<K, R> Default for Rows<K, R> {
    fn default() -> Self {
        Self(vec![])
    }
}

impl<K: Copy + Debug + PartialEq, R: Default> Rows<K, R> {
    /// Returns the row of a kind, for counting.
    pub fn of(&mut self, kind: K) -> &mut R {
        let at = self.0.iter().position(|(known, _)| *known == kind);
        let at = at.unwrap_or_else(|| {
            self.0.push((kind, R::default()));
            self.0.len() - 1
        });
        &mut self.0[at].1
    }

    /// Returns the row of a kind, if there is one.
    #[must_use]
    pub fn get(&self, kind: K) -> Option<&R> {
        let found = self.0.iter().find(|(known, _)| *known == kind);
        found.map(|(_, row)| row)
    }

    /// Returns the sum of a count over all rows.
    #[must_use]
    pub fn sum(&self, count: impl Fn(&R) -> u32) -> u32 {
        self.0.iter().map(|(_, row)| count(row)).sum()
    }

    /// Returns a table in Markdown: two heading lines, and a line for each kind that has a row, in
    /// the order of `all`, with the cells that `cells` writes after its name.
    #[must_use]
    pub fn table(&self, heading: &str, all: &[K], cells: impl Fn(&R) -> String) -> String {
        let rows = all.iter().filter_map(|kind| Some((kind, self.get(*kind)?)));
        let lines = rows.map(|(kind, row)| format!("| {kind:?} | {} |\n", cells(row)));
        heading.to_owned() + &lines.collect::<String>()
    }
}

/// Returns the kinds that a page's table lacks, or lists without a count of at least one.
#[must_use]
pub fn missing<K: Copy + Debug>(page: &str, all: &[K]) -> Vec<K> {
    let counts = |line: &str, kind: &K| {
        let mut cells = line.split('|').map(str::trim).skip(1);
        let is_it = cells.next() == Some(&format!("{kind:?}"));
        let count = cells.next().and_then(|count| count.parse().ok());
        is_it && count.is_some_and(|count: u32| count > 0)
    };
    let lacks = |kind: &&K| !page.lines().any(|line| counts(line, kind));
    all.iter().filter(lacks).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uncounted_row_is_omitted_and_listed_as_missing() {
        let mut rows = Rows::<_, u32>::default();
        *rows.of("b") += 2;
        *rows.of("a") += 1;
        *rows.of("b") += 1;
        let all = ["a", "b", "c"];
        let table = rows.table("| | n |\n| --- | --- |\n", &all, u32::to_string);
        assert!(table.ends_with("| \"a\" | 1 |\n| \"b\" | 3 |\n"), "{table}");
        assert_eq!((rows.sum(|n| *n), rows.get("c")), (4, None));
        assert_eq!(missing(&table, &all), ["c"]);
        let without_count = table.replace("| 3 |", "| 0 |");
        assert_eq!(missing(&without_count, &all), ["b", "c"]);
    }
}
