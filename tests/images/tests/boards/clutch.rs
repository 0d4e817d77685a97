//! The boards' clutch input, in the boards' own images.

use hapterra_core::clutch::ClutchMode;
use hapterra_core::guard::{Limits, Mode};
use hapterra_core::scene::TickRecord;
use hapterra_core::wire::request::Request;
use hapterra_image_tests::bench::Bench;
use hapterra_image_tests::device::Device;

/// Limits set by the clutch.
const CLUTCH_LIMITS: Limits = Limits::CLUTCH_INPUT
    .union(Limits::CLUTCH_OPEN)
    .union(Limits::CLUTCH_MOVES);

/// Closes or opens the switch.
fn switch(device: &Device<'_>, closed: bool) {
    let mut machine = device.machine.borrow_mut();
    let pin = machine.chip.clutch;
    machine.set_input(pin, !closed);
}

fn latest(device: &Device<'_>) -> TickRecord {
    let sample = device.latest.expect("samples");
    assert_eq!((sample.mode, sample.fault), (Mode::Armed, None));
    sample
}

fn limits(device: &Device<'_>) -> Limits {
    latest(device).limits & CLUTCH_LIMITS
}

/// Safety: 15.
#[test]
fn clutch_switch_removes_force_and_its_release_restores_it() {
    Bench::new().on_each(|device| {
        device.wait_for_full_force();
        device.run_ms(40);
        assert_eq!(limits(device), Limits::empty());
        let rendered = latest(device).force_n;
        assert!(rendered.z > 1.0, "{rendered}");
        switch(device, true);
        device.run_ms(150);
        assert_eq!(limits(device), Limits::CLUTCH_INPUT | Limits::CLUTCH_OPEN);
        assert_eq!(latest(device).force_n.length(), 0.0);
        assert!(device.query_status().health.sense.clutch);
        // The host holds it as well: both must release it.
        let hold = |hold| Request::Clutch { hold };
        device.request(hold(ClutchMode::WithHand));
        device.run_ms(20);
        switch(device, false);
        device.run_ms(60);
        assert_eq!(limits(device), Limits::CLUTCH_OPEN);
        device.request(hold(ClutchMode::Released));
        device.run_ms(600);
        assert_eq!(limits(device), Limits::empty());
        let back = latest(device).force_n;
        assert!(
            (back - rendered).length() < 0.01,
            "{rendered} before, {back} after"
        );
    });
}

/// Safety: 15.
#[test]
fn bouncing_or_stuck_switch_adds_no_force() {
    Bench::new().on_each(|device| {
        device.wait_for_full_force();
        device.run_ms(40);
        let rendered = latest(device).force_n.length();
        let mut max: f32 = 0.0;
        // Bounces of every length from 1 to 40 ms.
        for ms in (1..=40).chain((1..=40).rev()) {
            switch(device, ms % 2 == 0);
            device.run_ms(ms);
            max = max.max(latest(device).force_n.length());
        }
        assert!(max <= rendered + 1e-3, "{max} N of {rendered} N");
        switch(device, true);
        device.run_ms(2_000);
        assert_eq!(latest(device).force_n.length(), 0.0, "stuck");
        // Pulled up: a broken wire counts as a released switch.
        switch(device, false);
        device.run_ms(700);
        assert_eq!(limits(device), Limits::empty());
    });
}
