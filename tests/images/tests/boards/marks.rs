//! The boards' mark pin, in the boards' own images.

use hapterra_core::scene::{MARK_GAP_MS, MARK_PULSE_MS};
use hapterra_core::wire::request::Request;
use hapterra_image_tests::device::{Device, on_each_board, rough_ground};

/// Lets this many milliseconds pass. Returns for each the time up to it, and true if the mark pin
/// is high.
fn levels(device: &mut Device<'_>, count: usize) -> Vec<(f64, bool)> {
    let pin = device.machine.borrow().chip.mark;
    let mut level = || {
        device.run_ms(1);
        let machine = device.machine.borrow();
        let bus = machine.bus();
        (bus.now_ns as f64 / 1e6, bus.output(pin))
    };
    (0..count).map(|_| level()).collect()
}

fn is_high_once(levels: &[(f64, bool)]) -> bool {
    levels.iter().any(|(_, is_high)| *is_high)
}

#[test]
fn mark_raises_the_pin_for_ten_ticks() {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, |machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::open(machine, terrain, scene);
        let mut recorded = levels(&mut device, 30);
        assert!(!is_high_once(&recorded), "{board}");
        let before = device.latest.expect("samples").tick;
        for _ in 0..3 {
            device.request(Request::Mark);
        }
        recorded.extend(levels(&mut device, 150));
        // Each edge lies between two checks, which are a millisecond or two apart.
        let pairs = recorded.windows(2).filter(|pair| pair[0].1 != pair[1].1);
        let edges: Vec<_> = pairs.map(|pair| [pair[0].0, pair[1].0]).collect();
        assert_eq!(edges.len(), 6, "{board}: three pulses {edges:?}");
        let from_to = |from: [f64; 2], to: [f64; 2]| to[0] - from[1]..=to[1] - from[0];
        for pulse in edges.chunks(2) {
            let lasts = from_to(pulse[0], pulse[1]);
            assert!(lasts.contains(&MARK_PULSE_MS.into()), "{board}: {lasts:?}");
        }
        let latest = device.latest.expect("samples").tick;
        let [first, second, third] = device.marked[..] else {
            panic!("{board}: {:?}", device.marked);
        };
        assert!(before < first && third <= latest, "{board}");
        for (ticks, ups) in [(second - first, 0), (third - second, 2)] {
            assert!(ticks >= MARK_PULSE_MS + MARK_GAP_MS, "{board}: {ticks}");
            let period = from_to(edges[ups], edges[ups + 2]);
            assert!(
                period.contains(&ticks.into()),
                "{board}: {period:?} {ticks}"
            );
        }
    });
}

#[test]
fn pin_is_low_after_a_reset_within_a_pulse() {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, |machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::open(machine, terrain, scene);
        device.request(Request::Mark);
        assert!(is_high_once(&levels(&mut device, 8)), "{board}");
        let mut device = Device::open(device.reset(), terrain, scene);
        assert!(!is_high_once(&levels(&mut device, 30)), "{board}");
        assert!(device.marked.is_empty(), "{board}");
    });
}
