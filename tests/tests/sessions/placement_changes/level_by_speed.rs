//! The level of detail follows the hand's speed, under a pressing hand.

use hapterra::place::Heights;

use super::*;

/// Resolution of the encoders, mm: half a cell of level 0.
const FINE_MM: f64 = 0.03;
/// Haptic cells of level 0, mm.
const CELL_MM: f64 = 0.06;

/// Returns hills with rough detail, down to single samples, in device millimetres.
fn rough() -> Raster {
    let raster = Raster::from_fn(SIZE, SIZE, |x, y| {
        let random =
            (x.wrapping_mul(0x9E37_79B9) ^ y.wrapping_mul(0x85EB_CA6B)).wrapping_mul(0xC2B2_AE35);
        let grain = 0.03 * f64::from(random >> 16) / 65_536.0;
        let (x, y) = (f64::from(x) * CELL_MM, f64::from(y) * CELL_MM);
        let hills = 2.0 * (x / 13.0).sin() * (y / 11.0).cos();
        let stones = 0.1 * (x * 2.3).sin() * (y * 1.9).cos();
        (hills + stones + grain) as f32
    });
    raster.expect("a raster")
}

/// Plays with a hand on rough ground, whose level follows its speed.
fn touched<T>(
    params: SurfaceParams,
    touch: impl FnOnce(Touch<'_>, [f64; 2]) -> Script,
    play: impl FnOnce(&mut Touching<'_>) -> T,
) -> T {
    let options = PlacementOptions {
        sizing: Sizing::CellMm(CELL_MM),
        heights: Heights::MmPerUnit(1.0),
        ..PlacementOptions::default()
    };
    let arm = (PhantomModel::premium_1_5(), FINE_MM, params, 0.0);
    touched_at(arm, &rough(), &options, touch, |touching| {
        touching.steering.follow_speed(1_000);
        play(touching)
    })
}

impl Touching<'_> {
    /// Runs to a tick, and returns the level of each placement that was rendered.
    fn levels_to(&mut self, tick: u32) -> Vec<u8> {
        let mut levels = vec![self.level()];
        while self.last().tick < tick {
            self.poll();
            let is_rendered = self.last().view as usize + 1 > levels.len();
            if is_rendered {
                levels.push(self.level());
            }
        }
        levels
    }
}

/// Checks that the clutch stays closed, and the force makes no step.
fn check_closed(samples: &[TickRecord]) {
    let (mut worst, mut worst_at_change, mut changed_at) = (0.0_f32, 0.0_f32, 0);
    for pair in samples.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        assert_eq!(
            (after.mode, after.fault),
            (Mode::Armed, None),
            "tick {}",
            after.tick
        );
        assert!(
            !after.limits.contains(Limits::CLUTCH_OPEN),
            "tick {}",
            after.tick
        );
        let change = (after.force_n - before.force_n).length();
        worst = worst.max(change);
        if after.view != before.view {
            changed_at = after.tick;
        }
        if after.tick - changed_at < 20 && changed_at > 0 {
            worst_at_change = worst_at_change.max(change);
        }
        assert!(
            change <= MAX_SLEW_N_PER_S / 1_000.0,
            "tick {}: {change} N",
            after.tick
        );
    }
    eprintln!(
        "{} ticks, at most {worst:.4} N from one to the next, {worst_at_change:.4} N at a change",
        samples.len()
    );
}

#[test]
fn level_follows_a_hand_that_slides_slowly_and_fast() {
    let slides = |touch: Touch<'_>, [x, y]: [f64; 2]| {
        let at = |east: f64, north: f64| [x + east, y + north];
        let touch = touch.press(PUSH_N, 6.0).slide(&[at(8.0, 2.0)], PUSH_N, 8.0);
        let fast = [
            at(40.0, 5.0),
            at(-40.0, -5.0),
            at(40.0, 10.0),
            at(-40.0, 0.0),
        ];
        let touch = touch.slide(&fast, PUSH_N, 150.0);
        let touch = touch
            .slide(&[at(-30.0, 2.0)], PUSH_N, 8.0)
            .slide(&fast, PUSH_N, 150.0);
        touch.press(PUSH_N, 5.0).finish()
    };
    touched(SurfaceParams::PREMIUM, slides, |touching| {
        let began = touching.samples.len();
        let levels = touching.levels_to(20_000);
        eprintln!("{levels:?}, cancelled after {:?}", touching.cancelled);
        let coarsest = levels.iter().max();
        assert!(levels.len() >= 3 && coarsest > Some(&0), "{levels:?}");
        assert_eq!(touching.level(), 0, "at rest");
        assert_eq!(touching.messages, [""; 0]);
        check_closed(&touching.samples[began..]);
        assert_eq!(touching.last().state, ContactState::Touching);
    });
}

/// The force limit is below the press of the hand at rest: the device then does not change the
/// level, and the host cancels it. Between its slides the hand lifts off.
#[test]
fn hand_that_taps_stays_armed_and_keeps_its_tiles() {
    let taps = |touch: Touch<'_>, [x, y]: [f64; 2]| {
        let mut touch = touch.press(PUSH_N, 6.0);
        for round in 0..12 {
            let [east, north] = [
                f64::from(round % 2) * 60.0 - 30.0,
                f64::from(round) * 3.0 - 18.0,
            ];
            touch = touch.slide(&[[x + east, y + north]], PUSH_N, 150.0);
            for _ in 0..6 {
                touch = touch.lift(4.0).press(PUSH_N, 0.02);
            }
        }
        touch
            .slide(&[[x, y]], PUSH_N, 8.0)
            .press(PUSH_N, 3.0)
            .finish()
    };
    let params = SurfaceParams {
        max_force_n: 0.95 * PUSH_N as f32,
        ..SurfaceParams::PREMIUM
    };
    touched(params, taps, |touching| {
        let began = touching.samples.len();
        let levels = touching.levels_to(36_000);
        eprintln!("{levels:?}, cancelled after {:?}", touching.cancelled);
        assert!(levels.len() > 2 && touching.cancelled.len() > 2);
        assert_eq!(touching.messages, [""; 0]);
        let samples = &touching.samples[began..];
        check_closed(samples);
        for tick in &touching.cancelled {
            let from = samples.partition_point(|sample| sample.tick < *tick);
            // The tiles of the placement that stays arrive.
            let is_late = |sample: &TickRecord| {
                let late = Limits::TERRAIN_COARSE | Limits::TERRAIN_MISSING;
                sample.limits.intersects(late)
            };
            let after = &samples[from..samples.len().min(from + 100)];
            assert!(!after.iter().all(is_late), "after tick {tick}");
        }
        let last = touching.last();
        let [touches, is_whole] = [
            last.state == ContactState::Touching,
            last.missing_tile.is_none(),
        ];
        assert!(touches && is_whole, "{last:?}");
    });
}
