//! Keys that change the placement, and the line that names them.

use std::time::Duration;

use super::Steer;
use crate::place::PlacementChange;

/// The keys, for the screen.
pub const KEYS: &str = "arrows pan, + - zoom, ] [ heights, . , stiffness, space held or c: clutch, 0 reset, Enter goes on";
/// Device millimetres of a pan by one key press.
const PAN_MM: f64 = 5.0;
/// Zoom factor of one key press.
const ZOOM: f64 = 1.5;
/// Factor of heights or stiffness of one key press.
const STEP_FACTOR: f64 = 1.25;
/// Time without a repetition after which a key counts as released: a terminal reports presses and
/// repetitions, but no releases.
const RELEASE_AFTER: Duration = Duration::from_millis(800);

/// A key with a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A character.
    Char(char),
    /// An arrow: east and north, −1, 0 or 1.
    Arrow(i8, i8),
}

/// Commands from keys: most are one change, and the clutch has a state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Keys {
    /// Time of the last repetition of the key that holds the clutch.
    held: Option<Duration>,
    toggled: bool,
}

impl Keys {
    /// Returns the command of a key at a time since any fixed moment; `None` if it has none.
    pub fn press(&mut self, key: Key, now: Duration) -> Option<Steer> {
        let change = |change| Some(Steer::Change(change));
        match key {
            Key::Arrow(east, north) => change(PlacementChange::Pan {
                east_mm: PAN_MM * f64::from(east),
                north_mm: PAN_MM * f64::from(north),
            }),
            Key::Char('+' | '=') => change(PlacementChange::Zoom(ZOOM)),
            Key::Char('-' | '_') => change(PlacementChange::Zoom(1.0 / ZOOM)),
            Key::Char(']') => change(PlacementChange::Exaggerate(STEP_FACTOR)),
            Key::Char('[') => change(PlacementChange::Exaggerate(1.0 / STEP_FACTOR)),
            Key::Char('.') => change(PlacementChange::Stiffness(STEP_FACTOR)),
            Key::Char(',') => change(PlacementChange::Stiffness(1.0 / STEP_FACTOR)),
            Key::Char('0') => change(PlacementChange::Reset),
            Key::Char(' ') => {
                let was_held = self.held.replace(now).is_some() || self.toggled;
                (!was_held).then_some(Steer::Clutch(true))
            }
            Key::Char('c') => {
                self.toggled = !self.toggled;
                self.held = None;
                Some(Steer::Clutch(self.toggled))
            }
            Key::Char(_) => None,
        }
    }

    /// Returns the release of the key that holds the clutch, once.
    pub fn released(&mut self, now: Duration) -> Option<Steer> {
        let is_over = |received: &mut Duration| now.saturating_sub(*received) >= RELEASE_AFTER;
        let over = self.held.take_if(is_over).is_some();
        (over && !self.toggled).then_some(Steer::Clutch(false))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn opposite_keys_cancel_and_arrow_keys_pan() {
        let mut keys = Keys::default();
        let mut factor = |key| match keys.press(Key::Char(key), ms(0)) {
            Some(Steer::Change(
                PlacementChange::Zoom(factor)
                | PlacementChange::Exaggerate(factor)
                | PlacementChange::Stiffness(factor),
            )) => factor,
            other => panic!("{key}: {other:?}"),
        };
        for (more, less) in [('+', '-'), (']', '['), ('.', ',')] {
            assert!((factor(more) * factor(less) - 1.0).abs() < 1e-12);
            assert!(factor(more) > 1.0);
        }
        let north = keys.press(Key::Arrow(0, 1), ms(0));
        let pan = PlacementChange::Pan {
            east_mm: 0.0,
            north_mm: PAN_MM,
        };
        assert_eq!(north, Some(Steer::Change(pan)));
        assert_eq!(keys.press(Key::Char('x'), ms(0)), None);
    }

    #[test]
    fn clutch_is_held_while_its_key_repeats() {
        let mut keys = Keys::default();
        let space = Key::Char(' ');
        assert_eq!(keys.press(space, ms(0)), Some(Steer::Clutch(true)));
        for at in [500, 530, 560] {
            assert_eq!(keys.released(ms(at)), None);
            assert_eq!(keys.press(space, ms(at)), None);
        }
        assert_eq!(keys.released(ms(1_359)), None);
        assert_eq!(keys.released(ms(1_360)), Some(Steer::Clutch(false)));
        assert_eq!(keys.released(ms(5_000)), None);
        // The other key holds the clutch until it is pressed again.
        assert_eq!(
            keys.press(Key::Char('c'), ms(6_000)),
            Some(Steer::Clutch(true))
        );
        assert_eq!(keys.press(space, ms(6_001)), None);
        assert_eq!(keys.released(ms(9_000)), None);
        assert_eq!(
            keys.press(Key::Char('c'), ms(9_001)),
            Some(Steer::Clutch(false))
        );
    }
}
