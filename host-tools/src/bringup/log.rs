//! The log of a bring-up, stored as TOML: the passed steps, with the board and its calibration
//! record. Its entries become invalid if the board, its firmware or its calibration changes.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use etcetera::{AppStrategy, AppStrategyArgs, choose_app_strategy};
use hapterra_core::phantom::{Calibration, RECORD_BYTES};
use hapterra_core::wire::hello::DeviceHello;
use serde::{Deserialize, Serialize};

use super::step::Step;
use super::utc::utc;
use crate::output::{Output, OutputError};
use heightfield::regular_file;

/// Size limit of a log; a step has a few hundred bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Identity of the board and of its calibration record.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The board's name.
    pub board: String,
    /// The board's serial number; empty if it has none.
    #[serde(default)]
    pub serial: String,
    /// The firmware's version.
    pub firmware: String,
    /// Ticks a second of the firmware.
    pub tick_hz: u32,
    /// CRC-32 of the calibration record in force, in hexadecimal digits; empty if there is none.
    pub calibration: String,
}

impl Identity {
    /// Returns the identity of a device with the record in force.
    #[must_use]
    pub fn of(device: &DeviceHello, record: Option<&Calibration>) -> Self {
        Self {
            board: device.board.to_string(),
            serial: serial(device),
            firmware: device.version.to_string(),
            tick_hz: device.tick_hz,
            calibration: record.map_or(String::new(), fingerprint),
        }
    }
}

/// Returns the board's serial number; empty if it has none.
fn serial(device: &DeviceHello) -> String {
    match device.serial.is_none() {
        true => String::new(),
        false => device.serial.to_string(),
    }
}

/// Returns the checksum at the end of a record.
fn fingerprint(record: &Calibration) -> String {
    let mut buffer = [0; RECORD_BYTES];
    let sum = record.encode(&mut buffer).last_chunk::<4>();
    let sum = u32::from_le_bytes(*sum.unwrap_or(&[0; 4]));
    format!("{sum:08x}")
}

/// Outcome of a step.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// The step.
    pub step: Step,
    /// True if the step was passed.
    pub passed: bool,
    /// Time of the entry, UTC.
    pub at: String,
    /// Measurement or finding.
    pub result: String,
}

/// The log of one board.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Log {
    /// The board and the record of the log.
    #[serde(flatten)]
    pub identity: Identity,
    /// The completed steps, in order, each once.
    #[serde(default, rename = "entry")]
    pub entries: Vec<Entry>,
}

/// Error of reading or writing a log.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// There is no home folder to store the log in.
    #[error("there is no folder to keep the log in: {0}")]
    NoHome(#[from] etcetera::HomeDirError),
    /// The log cannot be read.
    #[error("cannot read the log {path}: {source}")]
    Unreadable {
        /// The path.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file is not a log.
    #[error("{path} is no log of a first power-up: {source}")]
    NoLog {
        /// The path.
        path: PathBuf,
        /// The reason.
        source: Box<toml::de::Error>,
    },
    /// The log cannot be serialised.
    #[error("the log cannot be written: {0}")]
    Unwritable(#[from] toml::ser::Error),
    /// The log cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl Log {
    /// Returns the path of a board's log in the user's data folder: a file for each board,
    /// by its name and serial number.
    ///
    /// # Errors
    /// [`LogError::NoHome`].
    pub fn path_of(device: &DeviceHello) -> Result<PathBuf, LogError> {
        let strategy = choose_app_strategy(AppStrategyArgs {
            app_name: "hapterra".into(),
            ..AppStrategyArgs::default()
        })?;
        // The board's name is from the link, so it must not be able to select another folder.
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        let mut name: String = device.board.chars().map(plain).collect();
        let serial = serial(device);
        if !serial.is_empty() {
            name = format!("{name}-{serial}");
        }
        Ok(strategy.in_data_dir(format!("bringup/{name}.toml")))
    }

    /// Reads a log; it is empty if the file does not exist.
    ///
    /// # Errors
    /// [`LogError::Unreadable`], [`LogError::NoLog`].
    pub fn read(path: &Path) -> Result<Self, LogError> {
        let text = match regular_file::read_text(path, MAX_BYTES) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => {
                let path = path.to_owned();
                return Err(LogError::Unreadable { path, source });
            }
        };
        toml::from_str(&text).map_err(|source| LogError::NoLog {
            path: path.to_owned(),
            source: Box::new(source),
        })
    }

    /// Replaces the log atomically.
    ///
    /// # Errors
    /// [`LogError::Unwritable`], [`LogError::Output`].
    pub fn write(&self, path: &Path) -> Result<(), LogError> {
        let text = self.text()?;
        let failed = |source| OutputError {
            path: path.to_owned(),
            source,
        };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        let mut output = Output::create(path)?;
        output.write_all(text.as_bytes()).map_err(failed)?;
        Ok(output.finish()?)
    }

    fn text(&self) -> Result<String, LogError> {
        Ok(toml::to_string(self)?)
    }

    /// Sets the current board and record, and removes entries that are no longer valid: all of them
    /// if the board or firmware changed, those that depend on the calibration if the record
    /// changed. Returns the reason if any was removed.
    pub fn update_identity(&mut self, now: Identity) -> Option<&'static str> {
        let was = std::mem::replace(&mut self.identity, now);
        let before = self.entries.len();
        let now = &self.identity;
        let of = |it: &Identity| (it.board.clone(), it.serial.clone(), it.firmware.clone());
        let why = if (of(&was), was.tick_hz) != (of(now), now.tick_hz) {
            self.entries.clear();
            "the board or its firmware has changed"
        } else if was.calibration != now.calibration {
            self.entries
                .retain(|entry| !entry.step.depends_on_calibration());
            "the calibration has changed"
        } else {
            return None;
        };
        (self.entries.len() < before).then_some(why)
    }

    /// Returns the first step that is not passed; `None` if the log is complete.
    #[must_use]
    pub fn next(&self) -> Option<Step> {
        let passed = |step: &Step| self.entries.iter().any(|e| e.step == *step && e.passed);
        Step::ALL.into_iter().find(|step| !passed(step))
    }

    /// Adds the outcome of a step. Later steps are removed, because they depend on this one.
    pub fn add(&mut self, step: Step, passed: bool, result: String) {
        self.entries.retain(|entry| entry.step < step);
        self.entries.push(Entry {
            step,
            passed,
            at: utc(SystemTime::now()),
            result,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::wire::hello::SerialNumber;

    fn identity(calibration: &str) -> Identity {
        Identity {
            board: "nucleo-g474re".into(),
            serial: "0000000000000000000000AA".into(),
            firmware: "0.1.0".into(),
            tick_hz: 1000,
            calibration: calibration.into(),
        }
    }

    fn complete() -> Log {
        let mut log = Log {
            identity: identity("0badcafe"),
            entries: vec![],
        };
        for step in Step::ALL {
            assert_eq!(log.next(), Some(step));
            log.add(step, true, format!("{step:?}: \"fine\""));
        }
        assert_eq!(log.next(), None);
        log
    }

    #[test]
    fn log_round_trips_through_its_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("new").join("board.toml");
        assert_eq!(Log::read(&path).expect("none yet"), Log::default());
        let log = complete();
        log.write(&path).expect("written");
        assert_eq!(Log::read(&path).expect("a log"), log);
        std::fs::write(&path, "entry = 7").expect("written");
        assert!(matches!(Log::read(&path), Err(LogError::NoLog { .. })));
    }

    #[test]
    fn changed_calibration_voids_its_steps_and_new_firmware_all() {
        let mut log = complete();
        assert_eq!(log.update_identity(identity("0badcafe")), None);
        assert_eq!(log.next(), None);
        assert!(log.update_identity(identity("deadbeef")).is_some());
        assert_eq!(log.next(), Some(Step::Calibration));
        let mut flashed = identity("deadbeef");
        flashed.firmware = "0.2.0".into();
        assert!(log.update_identity(flashed).is_some());
        assert_eq!(log.next(), Some(Step::Board));
    }

    #[test]
    fn repeated_step_voids_later_steps() {
        let mut log = complete();
        log.add(Step::Encoders, false, "dead".into());
        assert_eq!(log.next(), Some(Step::Encoders));
        log.add(Step::Encoders, true, "alive".into());
        assert_eq!(log.next(), Some(Step::Calibration));
    }

    #[test]
    fn fingerprint_differs_between_records() {
        let one = fingerprint(&Calibration::PREMIUM_1_5);
        let mut other = Calibration::PREMIUM_1_5;
        other.motor_sign.y = -1.0;
        assert_eq!(one.len(), 8);
        assert_ne!(one, fingerprint(&other));
    }

    #[test]
    fn boards_of_one_kind_have_separate_logs() {
        let mut device = crate::link::hello();
        device.board = "../evil/board".try_into().expect("fits");
        let place = |device: &DeviceHello| Log::path_of(device).expect("a home");
        let without = place(&device);
        assert!(
            without.ends_with("bringup/---evil-board.toml"),
            "{without:?}"
        );
        device.serial = SerialNumber::new([0x2A; 12]);
        let one = place(&device);
        let name = "bringup/---evil-board-2A2A2A2A2A2A2A2A2A2A2A2A.toml";
        assert!(one.ends_with(name), "{one:?}");
        let mut other = device.clone();
        other.serial = SerialNumber::new([0x2B; 12]);
        assert_ne!(one, place(&other));
        // A log under the other board's name is not valid for it.
        let mut log = complete();
        log.identity = Identity::of(&device, None);
        assert_eq!(log.update_identity(Identity::of(&device, None)), None);
        assert!(log.update_identity(Identity::of(&other, None)).is_some());
        assert_eq!(log.next(), Some(Step::Board));
    }

    #[test]
    fn log_without_serial_is_void_for_a_board_with_one() {
        let text = complete().text().expect("in words");
        let old: String = text
            .lines()
            .filter(|line| !line.starts_with("serial"))
            .fold(String::new(), |text, line| text + line + "\n");
        let mut log: Log = toml::from_str(&old).expect("a log");
        assert!(log.update_identity(identity("0badcafe")).is_some());
        assert_eq!(log.next(), Some(Step::Board));
    }
}
