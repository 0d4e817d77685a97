//! Lines about one device, which name it if several are served.

use std::fmt::Display;
use std::sync::{Arc, Mutex, PoisonError};

use super::writer;

/// Writes lines about one device with [`writer`].
#[derive(Clone, Default)]
pub(in crate::cli) struct DeviceConsole {
    /// `None` if there is only one device.
    several: Option<Several>,
}

#[derive(Clone)]
struct Several {
    /// Prefix of a line, such as `[2 tcp:localhost:4000]`.
    name: String,
    /// Index of the device's status line.
    index: usize,
    bottom: Arc<Mutex<Bottom>>,
}

/// The status lines of the terminal, one for each device.
struct Bottom(Vec<Option<String>>);

impl Bottom {
    /// Returns the status lines that are set.
    fn text(&self) -> Option<String> {
        let lines: Vec<&str> = self.0.iter().flatten().map(String::as_str).collect();
        (!lines.is_empty()).then(|| lines.join("\n"))
    }
}

impl DeviceConsole {
    /// Returns a console for each device. If there are several, their lines start with their
    /// number, from one, and their name.
    pub(in crate::cli) fn of_each(devices: &[impl Display]) -> Vec<Self> {
        if devices.len() == 1 {
            return vec![Self::default()];
        }
        let bottom = Arc::new(Mutex::new(Bottom(vec![None; devices.len()])));
        let several = devices.iter().enumerate().map(|(index, device)| Several {
            name: format!("[{} {device}]", index + 1),
            index,
            bottom: Arc::clone(&bottom),
        });
        several
            .map(|several| Self {
                several: Some(several),
            })
            .collect()
    }

    /// Returns the prefix of the lines, if there are several devices.
    pub(in crate::cli) fn name(&self) -> Option<&str> {
        self.several.as_ref().map(|several| several.name.as_str())
    }

    /// Writes a line to standard output.
    pub(in crate::cli) fn print_line(&self, line: impl Display) {
        writer::print_line(self.with_name(&line.to_string()));
    }

    /// Writes whole lines to standard output.
    pub(in crate::cli) fn show(&self, text: impl Display) {
        let text = text.to_string();
        match self.several {
            None => writer::show(text),
            Some(_) => writer::show(self.with_name(text.trim_end_matches('\n')) + "\n"),
        }
    }

    /// Writes lines to standard error.
    pub(in crate::cli) fn notify(&self, line: impl Display) {
        writer::notify(self.with_name(&line.to_string()));
    }

    /// Replaces or removes this device's status line.
    pub(in crate::cli) fn status(&self, line: Option<String>) {
        let Some(several) = &self.several else {
            return writer::status(line);
        };
        // No code that panics runs while the lock is held.
        let bottom = several.bottom.lock();
        let mut bottom = bottom.unwrap_or_else(PoisonError::into_inner);
        if let Some(own) = bottom.0.get_mut(several.index) {
            *own = line.map(|line| self.with_name(&line));
        }
        writer::status(bottom.text());
    }

    /// Adds the device's name to each line of a text.
    fn with_name(&self, text: &str) -> String {
        match self.name() {
            None => text.to_owned(),
            Some(name) => {
                let lines = text.split('\n').map(|line| format!("{name} {line}"));
                lines.collect::<Vec<_>>().join("\n")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn console_prefixes_lines_only_with_several_devices() {
        let alone = DeviceConsole::of_each(&["usb"]);
        assert_eq!(alone[0].with_name("a\nb"), "a\nb");
        assert_eq!(alone[0].name(), None);
        let two = DeviceConsole::of_each(&["native", "tcp:h:1"]);
        assert_eq!(two[0].with_name("a\nb"), "[1 native] a\n[1 native] b");
        assert_eq!(two[1].with_name("a"), "[2 tcp:h:1] a");
    }

    #[test]
    fn each_device_has_its_own_status_line() {
        let two = DeviceConsole::of_each(&["native", "usb:7"]);
        let bottom = || {
            let several = two[0].several.as_ref().expect("several");
            several.bottom.lock().expect("alone").text()
        };
        two[1].status(Some("armed".into()));
        two[0].status(Some("waits".into()));
        let both = "[1 native] waits\n[2 usb:7] armed";
        assert_eq!(bottom().as_deref(), Some(both));
        two[0].status(None);
        assert_eq!(bottom().as_deref(), Some("[2 usb:7] armed"));
        two[1].status(None);
        assert_eq!(bottom(), None);
    }
}
