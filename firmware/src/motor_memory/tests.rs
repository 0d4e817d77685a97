//! Temperatures over a reset, whole and damaged.

use super::*;

const WARM: Temperatures = Temperatures {
    winding_k: Vec3::new(1.0, 2.0, 3.0),
    housing_k: Vec3::new(10.0, 20.0, 30.0),
};

const WARMER: Temperatures = Temperatures {
    winding_k: Vec3::new(4.0, 5.0, 6.0),
    housing_k: Vec3::new(11.0, 21.0, 31.0),
};

/// Returns the RAM after `ticks` ticks of a loop whose motors have these temperatures.
fn after(ticks: u32, of: impl Fn(u32) -> Temperatures) -> Copies {
    let (_, mut copies) = begin(ResetCause::PowerOn, &[[0xA5A5_A5A5; WORDS]; 2]);
    let mut log = MotorLog::new(TickRate::DEFAULT);
    for tick in 1..=ticks {
        if let Some((copy, words)) = log.tick(&of(tick)) {
            copies[copy] = words;
        }
    }
    copies
}

fn begun(cause: ResetCause, copies: &Copies) -> Temperatures {
    begin(cause, copies).0
}

const RESETS: [ResetCause; 4] = [
    ResetCause::Pin,
    ResetCause::Software,
    ResetCause::Watchdog,
    ResetCause::BrownOut,
];

#[test]
fn reset_resumes_from_newest_temperatures() {
    for ticks in [100, 200, 300, 1_234] {
        let newest = ticks / 100 * 100;
        let copies = after(ticks, |tick| if tick < newest { WARM } else { WARMER });
        for cause in RESETS {
            assert_eq!(Some(begun(cause, &copies)), WARMER.after_reset(), "{ticks}");
        }
    }
}

#[test]
fn power_up_or_unknown_reset_assumes_hot_motors() {
    let copies = after(1_000, |_| WARM);
    for cause in [ResetCause::PowerOn, ResetCause::Unknown] {
        assert_eq!(begun(cause, &copies), Temperatures::HOT);
    }
}

/// A reset during a write leaves only some of its words.
///
/// Safety: 12.
#[test]
fn truncated_copy_leaves_the_previous_one_valid() {
    let (old, new) = (after(100, |_| WARM), after(200, |_| WARMER));
    for words in 1..WORDS {
        let mut torn = old;
        torn[0][..words].copy_from_slice(&new[0][..words]);
        let begun = begun(ResetCause::Watchdog, &torn);
        assert_eq!(Some(begun), WARM.after_reset(), "{words}");
    }
}

#[test]
fn temperature_copies_with_a_flipped_bit_are_rejected() {
    let good = after(100, |_| WARM);
    for bit in 0..WORDS * 32 {
        let mut bad = good;
        for copy in &mut bad {
            copy[bit / 32] ^= 1 << (bit % 32);
        }
        assert_eq!(
            begun(ResetCause::Watchdog, &bad),
            Temperatures::HOT,
            "{bit}"
        );
    }
}

#[test]
fn uninitialised_ram_and_impossible_values_are_rejected() {
    for word in [0, u32::MAX, 0xAAAA_AAAA, MAGIC] {
        let begun = begun(ResetCause::Watchdog, &[[word; WORDS]; 2]);
        assert_eq!(begun, Temperatures::HOT);
    }
    // Whole, but with values that a motor cannot have.
    let nonsense = Temperatures {
        winding_k: Vec3::NAN,
        ..WARM
    };
    let begun = begun(ResetCause::Watchdog, &[encode(1, &nonsense), [0; WORDS]]);
    assert_eq!(begun, Temperatures::HOT);
}

#[test]
fn temperature_copies_from_before_power_on_are_not_reused() {
    let old = after(1_000, |_| WARM);
    let (hot, copies) = begin(ResetCause::PowerOn, &old);
    assert_eq!(hot, Temperatures::HOT);
    // The board is reset before its first tick.
    assert_eq!(
        Some(begun(ResetCause::Pin, &copies)),
        Temperatures::HOT.after_reset()
    );
    // After its second copy, which overwrites the old ones.
    let mut log = MotorLog::new(TickRate::DEFAULT);
    let mut copies = copies;
    for _ in 0..200 {
        if let Some((copy, words)) = log.tick(&WARMER) {
            copies[copy] = words;
        }
    }
    assert_eq!(Some(begun(ResetCause::Pin, &copies)), WARMER.after_reset());
}

#[test]
fn newest_copy_is_found_across_number_wrap() {
    let copies = [encode(0, &WARMER), encode(u32::MAX, &WARM)];
    assert_eq!(newest(&copies), Some(WARMER));
    let copies = [encode(u32::MAX - 1, &WARM), encode(u32::MAX, &WARMER)];
    assert_eq!(newest(&copies), Some(WARMER));
}

#[test]
fn ten_copies_are_made_each_second_at_every_rate() {
    for khz in [1, 4, 10] {
        let rate = TickRate::new(1_000 * khz).expect("in range");
        let mut log = MotorLog::new(rate);
        let copies = (0..rate.hz()).filter_map(|_| log.tick(&WARM)).count();
        assert_eq!(copies, 10);
    }
}
