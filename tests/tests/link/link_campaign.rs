//! A minute of the campaign of link faults, and a check that the stored report is complete.

use hapterra_tests::link_campaign::fault::Kind;
use hapterra_tests::link_campaign::{SEED, report, run};
use hapterra_tests::newest_log;

/// Safety: 48.
#[test]
fn link_faults_change_no_force_never_hang_and_are_reported() {
    let stats = run(SEED, 60, &mut |_, _| {}).expect("no violation");
    for kind in Kind::ALL {
        assert!(stats.runs_with(kind) > 0, "{kind:?} was not tried");
    }
    // Otherwise the bounds would never have been tested.
    assert!(stats.extremes.force_n > 2.0, "{:?}", stats.extremes);
    assert!(stats.touching > 5_000, "{stats:?}");
    assert!(stats.agreed() > 3, "{stats:?}");
}

#[test]
fn campaign_is_reproducible_from_its_seed() {
    let once = || run(SEED + 1, 1, &mut |_, _| {}).expect("no violation");
    assert_eq!(once(), once());
}

#[test]
fn committed_report_has_every_kind() {
    let path = newest_log("link-campaign.md");
    let page = std::fs::read_to_string(path).expect("the report is kept");
    assert_eq!(report::missing(&page), []);
}
