//! Whether the figures on the pages are those of the committed tables. How a figure
//! is marked: `hapterra_tests::figures`.

use hapterra_tests::figures::check;
use hapterra_tests::repository;

#[test]
fn the_figures_on_the_pages_are_those_of_the_tables() {
    let docs = repository().join("docs").read_dir().expect("a folder");
    let docs = docs.map(|entry| entry.expect("readable").path());
    let pages = docs.chain(["README.md", "CHANGELOG.md"].map(|page| repository().join(page)));
    let mut stale = Vec::new();
    for page in pages.filter(|page| page.extension().is_some_and(|kind| kind == "md")) {
        let text = std::fs::read_to_string(&page).expect("readable");
        let (figures, wrong) = check(&text, repository());
        println!("{}: {figures} figures from tables", page.display());
        stale.extend(wrong.iter().map(|why| format!("{}: {why}", page.display())));
    }
    assert!(stale.is_empty(), "{}", stale.join("\n"));
}

/// What the check says about a page beside this table.
fn told(page: &str) -> (usize, Vec<String>) {
    const TABLE: &str = "state,median,share\nsliding,1218,0.04567\n\"chain, free\",1144,2.04e-6\n\
                         twice,1,1\ntwice,2,2\nempty,,1\n";
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("t.csv"), TABLE).expect("written");
    check(page, folder.path())
}

fn figure(place: &str, shown: &str) -> String {
    format!("It takes <!-- from t.csv: {place} -->{shown} at most.")
}

#[test]
fn a_figure_of_the_table_is_right_to_the_digits_shown() {
    for (place, shown) in [
        ("sliding, median", "1218"),
        ("sliding, median", "1,218"),
        ("sliding, share", "0.05"),
        ("sliding, share", "0.0457"),
        ("chain, free, median", "1144."),
        ("chain, free, share", "2e-6"),
        ("twice / 2, share", "2"),
    ] {
        assert_eq!(told(&figure(place, shown)), (1, vec![]), "{place} {shown}");
    }
    assert_eq!(told("No figure of a table: 17."), (0, vec![]));
}

#[test]
fn a_figure_that_is_not_the_tables_is_found() {
    for (place, shown, why) in [
        (
            "sliding, median",
            "1217",
            "the page says 1217, the table 1218",
        ),
        ("sliding, share", "0.04", "the page says 0.04"),
        ("chain, free, share", "3e-6", "the page says 3e-6"),
        ("sliding, median", "many", "no figure behind the comment"),
        ("gliding, median", "1218", "no such row"),
        ("sliding, mean", "1218", "no such column"),
        ("sliding", "1218", "no column is named"),
        ("twice, median", "1", "more than one row"),
        ("empty, median", "1", "is no number"),
    ] {
        let (figures, wrong) = told(&figure(place, shown));
        assert_eq!((figures, wrong.len()), (1, 1), "{place} {shown}");
        assert!(wrong[0].contains(why), "{wrong:?}");
    }
    let (_, wrong) = told("<!-- from no.csv: a, b -->1 and <!-- from t.csv: sliding, median 1218");
    assert_eq!(wrong.len(), 2, "{wrong:?}");
}
