//! One keyboard for several devices. A digit selects the device that receives the keys.
//! Enter is only for a device whose digit was pressed directly before: an Enter for one arm must
//! never arm another user's arm.
//!
//! If the terminal sends whole lines, a line with only the number of a device means that digit and
//! Enter.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::device_console::DeviceConsole;
use super::keyboard::keyboard;
use super::raw_keys::Pressed;
use super::raw_mode::RawMode;
use super::writer::notify;
use crate::steering::keys::Key;

/// Maximum number of devices, each selected by one digit.
pub(in crate::cli) const MAX: usize = 9;
/// Maximum pending keys of a device; further keys are dropped.
const MAX_WAITING: usize = 64;

/// The keyboard of several devices.
struct SharedKeyboard {
    /// Prefix of each device's lines.
    names: Vec<String>,
    state: Mutex<State>,
    /// Raw mode, if the terminal sends single keys.
    raw: Option<RawMode>,
}

struct State {
    /// The selected device, counted from zero.
    chosen: usize,
    /// The device whose digit was the last key.
    named: Option<usize>,
    inboxes: Vec<Inbox>,
}

/// Pending keys of a device.
#[derive(Default)]
struct Inbox {
    keys: Vec<Key>,
    enters: usize,
    /// True if the device is no longer served.
    is_closed: bool,
}

/// A device's share of the keyboard.
pub(in crate::cli) struct DeviceKeys {
    shared_keyboard: Arc<SharedKeyboard>,
    index: usize,
}

/// Starts to share the keyboard among these devices, with single keys if the terminal can send
/// them. The first device is selected.
pub(in crate::cli) fn share(consoles: &[DeviceConsole]) -> Vec<Arc<DeviceKeys>> {
    share_from(consoles, RawMode::enter())
}

fn share_from(consoles: &[DeviceConsole], raw: Option<RawMode>) -> Vec<Arc<DeviceKeys>> {
    let names = consoles.iter().map(DeviceConsole::name);
    let names: Vec<_> = names.map(|name| name.unwrap_or_default().into()).collect();
    let state = State {
        chosen: 0,
        named: None,
        inboxes: names.iter().map(|_| Inbox::default()).collect(),
    };
    let shared_keyboard = Arc::new(SharedKeyboard {
        names,
        state: Mutex::new(state),
        raw,
    });
    (0..consoles.len())
        .map(|index| {
            let shared_keyboard = Arc::clone(&shared_keyboard);
            Arc::new(DeviceKeys {
                shared_keyboard,
                index,
            })
        })
        .collect()
}

impl SharedKeyboard {
    fn state(&self) -> MutexGuard<'_, State> {
        // No code that panics runs while the lock is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Distributes the keys pressed since the last call.
    fn distribute(&self) -> MutexGuard<'_, State> {
        let mut state = self.state();
        for pressed in keyboard().pressed() {
            if let Some(line) = self.route(&mut state, pressed) {
                notify(line);
            }
        }
        state
    }

    /// Distributes a pressed key. Returns a message about it, if any.
    fn route(&self, state: &mut State, pressed: Pressed) -> Option<String> {
        let number = match pressed {
            Pressed::Key(Key::Char(digit)) => digit.to_digit(10).unwrap_or(0) as usize,
            _ => 0,
        };
        let index = number.checked_sub(1);
        if let Some((index, name)) = index.and_then(|index| Some((index, self.names.get(index)?))) {
            state.named = Some(index);
            let was = std::mem::replace(&mut state.chosen, index);
            let is_closed = state.inboxes.get(index)?.is_closed;
            return match is_closed {
                true => Some(format!("{name} is not served any more")),
                false if was == index => None,
                false => Some(format!("keys are for {name}")),
            };
        }
        let named = state.named.take();
        match (pressed, named) {
            (Pressed::Enter, Some(named)) => state.inboxes.get_mut(named)?.enters += 1,
            (Pressed::Enter, None) => {
                let last = self.names.len();
                return Some(format!(
                    "Enter alone is for no device: press the number of one, 1 to {last}, and then Enter"
                ));
            }
            (Pressed::Key(key), _) => {
                let inbox = state.inboxes.get_mut(state.chosen)?;
                if inbox.keys.len() < MAX_WAITING {
                    inbox.keys.push(key);
                }
            }
        }
        None
    }
}

impl DeviceKeys {
    /// Returns true if the terminal sends single keys.
    pub(in crate::cli) fn has_keys(&self) -> bool {
        self.shared_keyboard.raw.is_some()
    }

    /// Returns the keys that answer a question of this device.
    pub(in crate::cli) fn press_enter(&self) -> String {
        format!("press {} and then Enter", self.index + 1)
    }

    /// Returns the keys except Enter that were pressed for this device since the last call.
    pub(in crate::cli) fn keys(&self) -> Vec<Key> {
        let mut state = self.shared_keyboard.distribute();
        let inbox = state.inboxes.get_mut(self.index);
        inbox.map_or(vec![], |inbox| std::mem::take(&mut inbox.keys))
    }

    /// Discards earlier answers to a question of this device, also its digit without an Enter.
    pub(in crate::cli) fn forget(&self) {
        drop(self.shared_keyboard.distribute());
        self.forget_answers();
    }

    fn forget_answers(&self) {
        let mut state = self.shared_keyboard.state();
        if let Some(inbox) = state.inboxes.get_mut(self.index) {
            inbox.enters = 0;
        }
        if state.named == Some(self.index) {
            state.named = None;
        }
    }

    /// Returns the number of presses of Enter for this device since the last call.
    pub(in crate::cli) fn enters(&self) -> usize {
        let mut state = self.shared_keyboard.distribute();
        let inbox = state.inboxes.get_mut(self.index);
        inbox.map_or(0, |inbox| std::mem::take(&mut inbox.enters))
    }
}

impl Drop for DeviceKeys {
    fn drop(&mut self) {
        if let Some(inbox) = self.shared_keyboard.state().inboxes.get_mut(self.index) {
            inbox.is_closed = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Vec<Arc<DeviceKeys>> {
        share_from(&DeviceConsole::of_each(&["native", "usb:7"]), None)
    }

    fn press(device_keys: &[Arc<DeviceKeys>], pressed: &[Pressed]) -> Vec<String> {
        let shared_keyboard = &device_keys[0].shared_keyboard;
        let mut state = shared_keyboard.state();
        let reported = pressed
            .iter()
            .map(|key| shared_keyboard.route(&mut state, *key));
        reported.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Returns the keys of a device, without the real keyboard.
    fn got(device_keys: &DeviceKeys) -> (Vec<Key>, usize) {
        let mut state = device_keys.shared_keyboard.state();
        let inbox = std::mem::take(&mut state.inboxes[device_keys.index]);
        (inbox.keys, inbox.enters)
    }

    const fn key(key: char) -> Pressed {
        Pressed::Key(Key::Char(key))
    }

    /// Safety: 34.
    #[test]
    fn enter_reaches_only_the_device_named_right_before() {
        let device_keys = two();
        let no_device = |reported: Vec<String>| {
            let [.., line] = &reported[..] else {
                panic!("{reported:?}");
            };
            assert!(line.contains("1 to 2, and then Enter"), "{line}");
        };
        no_device(press(&device_keys, &[Pressed::Enter]));
        assert_eq!(press(&device_keys, &[key('1'), Pressed::Enter]), [""; 0]);
        assert_eq!(got(&device_keys[0]), (vec![], 1));
        let reported = press(&device_keys, &[key('2'), Pressed::Enter]);
        assert_eq!(reported, ["keys are for [2 usb:7]"]);
        assert_eq!(got(&device_keys[1]), (vec![], 1));
        // The second device is still selected, but this Enter may be from the first one's user.
        no_device(press(&device_keys, &[Pressed::Enter]));
        no_device(press(&device_keys, &[key('2'), key('+'), Pressed::Enter]));
        assert_eq!(got(&device_keys[1]), (vec![Key::Char('+')], 0));
        // A digit before a question is no answer either; one for another device is kept.
        press(&device_keys, &[key('2')]);
        device_keys[1].forget_answers();
        no_device(press(&device_keys, &[Pressed::Enter]));
        press(&device_keys, &[key('2')]);
        device_keys[0].forget_answers();
        assert_eq!(press(&device_keys, &[Pressed::Enter]), [""; 0]);
        assert_eq!(got(&device_keys[1]), (vec![], 1));
        assert_eq!(got(&device_keys[0]), (vec![], 0));
    }

    #[test]
    fn keys_reach_the_device_selected_last() {
        let device_keys = two();
        press(&device_keys, &[key('+'), key('2'), key('-')]);
        // There is no third device, and 0 is an ordinary key.
        press(&device_keys, &[key('3'), key('0')]);
        assert_eq!(got(&device_keys[0]), (vec![Key::Char('+')], 0));
        let keys = ['-', '3', '0'].map(Key::Char).to_vec();
        assert_eq!(got(&device_keys[1]), (keys, 0));
    }

    #[test]
    fn unserved_device_is_reported_when_selected() {
        let mut device_keys = two();
        drop(device_keys.pop());
        let reported = press(&device_keys, &[key('2'), Pressed::Enter]);
        assert_eq!(reported, ["[2 usb:7] is not served any more"]);
        assert_eq!(got(&device_keys[0]), (vec![], 0));
        // Even if a key is held down.
        press(&device_keys, &[key('+'); 10 * MAX_WAITING]);
        assert!(device_keys[0].shared_keyboard.state().inboxes[1].keys.len() <= MAX_WAITING);
    }
}
