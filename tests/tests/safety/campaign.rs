//! A short segment of the closed-loop campaign, and a check that the stored report is complete.

use hapterra_tests::campaign::fault_kind::Kind;
use hapterra_tests::campaign::{SEED, report, run};
use hapterra_tests::newest_log;

/// Safety: 38, 48, response times.
#[test]
fn guard_bounds_hold_under_every_injected_fault() {
    let stats = run(SEED, 60, &mut |_, _| {}).expect("no violation");
    assert!(stats.armed >= 60_000);
    for kind in Kind::ALL {
        assert!(stats.injected_of(kind) > 0, "{kind:?} was not tried");
    }
    // Otherwise the bounds would never have been tested.
    assert!(stats.extremes.force_n > 4.0, "{:?}", stats.extremes);
    assert!(stats.extremes.current_a > 2.0, "{:?}", stats.extremes);
}

#[test]
fn campaign_is_reproducible_from_its_seed() {
    let once = || run(SEED + 1, 1, &mut |_, _| {}).expect("no violation");
    assert_eq!(once(), once());
}

#[test]
fn committed_report_has_every_kind() {
    let path = newest_log("campaign.md");
    let page = std::fs::read_to_string(path).expect("the report is kept");
    assert_eq!(report::missing(&page), []);
}
