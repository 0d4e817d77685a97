//! Calibration records in TOML files, to read, compare and change by hand. A device stores the same
//! numbers in its flash as a binary record with a checksum
//! ([`hapterra_core::phantom::Calibration::encode`]).

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use hapterra_core::Vec3;
use hapterra_core::phantom::{
    Calibration, CalibrationError, JointLimits, Model, RecordError, Thermal,
};
use serde::Deserialize;

use crate::output::{Output, OutputError};
use heightfield::regular_file;

/// Size limit of a calibration file.
const MAX_BYTES: u64 = 1 << 20;

/// Version of the file's format.
const FORMAT: u32 = 1;
/// First bytes of the binary files of earlier versions.
const BINARY: &[u8] = b"HAPC";

/// Models by their names in files and on the command line.
pub const MODELS: [(&str, Model); 5] = [
    ("premium-1.0", Model::Premium10),
    ("premium-1.5", Model::Premium15),
    ("premium-3.0", Model::Premium30),
    ("omni", Model::Omni),
    ("other", Model::Other),
];

/// Returns a model's name in files and on the command line.
#[must_use]
pub fn model_name(model: Model) -> &'static str {
    let known = MODELS.iter().find(|(_, known)| *known == model);
    known.map_or("other", |(name, _)| *name)
}

/// Error of reading a calibration file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct FileError {
    path: PathBuf,
    fault: Fault,
}

#[derive(Debug, thiserror::Error)]
enum Fault {
    #[error("cannot read the calibration: {0}")]
    Unreadable(io::Error),
    #[error("no calibration file: {0}")]
    NotToml(String),
    #[error("a calibration file of format {0}; this program reads format {FORMAT}")]
    Format(u32),
    #[error("no model is called {0}")]
    Model(String),
    #[error("the calibration is not valid: {0}")]
    Invalid(CalibrationError),
    #[error("a binary record of an earlier version, but {0}")]
    Binary(RecordError),
}

/// Content of a calibration file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Read before all other fields.
    #[serde(rename = "hapterra-calibration")]
    _format: u32,
    model: String,
    encoders: Encoders,
    links: Links,
    stops: Stops,
    gravity: Gravity,
    motors: Motors,
    thermal: Thermal,
    limits: Limits,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Encoders {
    counts_per_turn: f32,
    ratio: [f32; 3],
    sign: [f32; 3],
    zero_rad: [f32; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Links {
    l1_mm: f32,
    l2_mm: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stops {
    min_rad: [f32; 3],
    max_rad: [f32; 3],
    q2_minus_q3_max_rad: f32,
    q3_minus_q2_max_rad: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Gravity {
    joint_2_nm: f32,
    joint_3_nm: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Motors {
    sign: [f32; 3],
    torque_constant_nm_per_a: [f32; 3],
    peak_a: [f32; 3],
    continuous_a: [f32; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Limits {
    max_force_n: f32,
    max_speed_mm_s: f32,
}

/// Reads and checks a calibration file; also a binary one of an earlier version.
///
/// # Errors
/// [`FileError`] names the file and its fault.
pub fn read(path: &Path) -> Result<Calibration, FileError> {
    let record = regular_file::read(path, MAX_BYTES)
        .map_err(Fault::Unreadable)
        .and_then(|bytes| {
            if bytes.starts_with(BINARY) {
                return Calibration::decode(&bytes).map_err(Fault::Binary);
            }
            let text = String::from_utf8(bytes);
            from_toml(&text.map_err(|_| Fault::NotToml("it is not text".into()))?)
        });
    record.map_err(|fault| FileError {
        path: path.to_owned(),
        fault,
    })
}

/// Writes a calibration file.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, record: &Calibration) -> Result<(), OutputError> {
    let mut output = Output::create(path)?;
    let written = output.write_all(to_toml(record).as_bytes());
    written.map_err(|source| OutputError {
        path: path.to_owned(),
        source,
    })?;
    output.finish()
}

fn from_toml(text: &str) -> Result<Calibration, Fault> {
    /// The format alone, because the other fields depend on it.
    #[derive(Deserialize)]
    struct Format {
        #[serde(rename = "hapterra-calibration")]
        format: u32,
    }
    let not_toml = |error: toml::de::Error| Fault::NotToml(error.to_string());
    let Format { format } = toml::from_str(text).map_err(not_toml)?;
    if format != FORMAT {
        return Err(Fault::Format(format));
    }
    let file: File = toml::from_str(text).map_err(not_toml)?;
    let named = MODELS.iter().find(|(name, _)| *name == file.model);
    let Some(&(_, model)) = named else {
        return Err(Fault::Model(file.model));
    };
    let record = file.record(model);
    record.validate().map_err(Fault::Invalid)?;
    Ok(record)
}

impl File {
    fn record(self, model: Model) -> Calibration {
        let Self {
            encoders,
            links,
            stops,
            gravity,
            motors,
            thermal,
            limits,
            ..
        } = self;
        let v = Vec3::from_array;
        Calibration {
            model,
            counts_per_turn: encoders.counts_per_turn,
            ratio: v(encoders.ratio),
            encoder_sign: v(encoders.sign),
            motor_sign: v(motors.sign),
            zero_rad: v(encoders.zero_rad),
            l1_mm: links.l1_mm,
            l2_mm: links.l2_mm,
            limits: JointLimits {
                min_rad: v(stops.min_rad),
                max_rad: v(stops.max_rad),
                q2_minus_q3_max_rad: stops.q2_minus_q3_max_rad,
                q3_minus_q2_max_rad: stops.q3_minus_q2_max_rad,
            },
            gravity_2_nm: gravity.joint_2_nm,
            gravity_3_nm: gravity.joint_3_nm,
            torque_constant: v(motors.torque_constant_nm_per_a),
            peak_current_a: v(motors.peak_a),
            continuous_current_a: v(motors.continuous_a),
            thermal,
            max_force_n: limits.max_force_n,
            max_speed_mm_s: limits.max_speed_mm_s,
        }
    }
}

/// Returns a record as the text of a file. Numbers have enough digits to read back the same bits.
/// Angles are in radians for that reason, with degrees beside them.
#[must_use]
pub fn to_toml(record: &Calibration) -> String {
    let model = model_name(record.model);
    let (stops, thermal) = (&record.limits, &record.thermal);
    let v = |v: Vec3| format!("{:?}", v.to_array());
    let degrees = |v: Vec3| {
        let [a, b, c] = v.to_array().map(f32::to_degrees);
        format!("{a:.2}°, {b:.2}°, {c:.2}°")
    };
    format!(
        "\
# Calibration of a Phantom, written by hapterra {program}. Three numbers are joints 1 to 3.
hapterra-calibration = {FORMAT}
model = \"{model}\"

[encoders]
# Counts a motor turn, four edges a line.
counts_per_turn = {counts:?}
# Motor turns a joint turn.
ratio = {ratio}
# 1 where counts rise as the joint's angle grows, -1 where they fall.
sign = {encoder_sign}
# Joint angles of the zero pose: {zero_deg}.
zero_rad = {zero}

[links]
# Length of the upper link and of the fore link.
l1_mm = {l1:?}
l2_mm = {l2:?}

[stops]
# Smallest joint angles: {min_deg}.
min_rad = {min}
# Largest joint angles: {max_deg}.
max_rad = {max}
# Limits of the parallel linkage between joints 2 and 3: {spread_deg}.
q2_minus_q3_max_rad = {q23:?}
q3_minus_q2_max_rad = {q32:?}

[gravity]
# Torque against the arm's weight at joint 2 where cos q2 is 1, at joint 3 where sin q3 is 1.
joint_2_nm = {g2:?}
joint_3_nm = {g3:?}

[motors]
# 1 where a positive current turns the joint towards larger angles, -1 otherwise.
sign = {motor_sign}
torque_constant_nm_per_a = {torque}
# Largest current of a cool motor.
peak_a = {peak}
# Current that a motor can carry continuously.
continuous_a = {continuous}

[thermal]
# Winding resistance at 100 °C; winding to housing, housing to air; time constants.
resistance_ohm = {ohm:?}
winding_k_per_w = {winding:?}
housing_k_per_w = {housing:?}
winding_s = {winding_s:?}
housing_s = {housing_s:?}

[limits]
# Largest force at the tip.
max_force_n = {force:?}
# Speed of the tip from which force is reduced; at twice this speed it is zero.
max_speed_mm_s = {speed:?}
",
        program = env!("CARGO_PKG_VERSION"),
        counts = record.counts_per_turn,
        ratio = v(record.ratio),
        encoder_sign = v(record.encoder_sign),
        zero_deg = degrees(record.zero_rad),
        zero = v(record.zero_rad),
        l1 = record.l1_mm,
        l2 = record.l2_mm,
        min_deg = degrees(stops.min_rad),
        min = v(stops.min_rad),
        max_deg = degrees(stops.max_rad),
        max = v(stops.max_rad),
        spread_deg = format_args!(
            "{:.2}°, {:.2}°",
            stops.q2_minus_q3_max_rad.to_degrees(),
            stops.q3_minus_q2_max_rad.to_degrees()
        ),
        q23 = stops.q2_minus_q3_max_rad,
        q32 = stops.q3_minus_q2_max_rad,
        g2 = record.gravity_2_nm,
        g3 = record.gravity_3_nm,
        motor_sign = v(record.motor_sign),
        torque = v(record.torque_constant),
        peak = v(record.peak_current_a),
        continuous = v(record.continuous_current_a),
        ohm = thermal.resistance_ohm,
        winding = thermal.winding_k_per_w,
        housing = thermal.housing_k_per_w,
        winding_s = thermal.winding_s,
        housing_s = thermal.housing_s,
        force = record.max_force_n,
        speed = record.max_speed_mm_s,
    )
}

#[cfg(test)]
mod tests {
    use hapterra_core::phantom::RECORD_BYTES;

    use super::*;

    fn message(text: &str) -> String {
        from_toml(text).expect_err("is wrong").to_string()
    }

    #[test]
    fn every_preset_round_trips_bit_for_bit() {
        for (_, model) in MODELS {
            let mut record = model.preset();
            record.zero_rad = Vec3::new(0.1, -1.0 / 3.0, 1e-7);
            let read = from_toml(&to_toml(&record)).expect("read");
            let bytes = |record: &Calibration| record.encode(&mut [0; RECORD_BYTES]).to_vec();
            assert_eq!(bytes(&read), bytes(&record), "{model:?}");
        }
    }

    #[test]
    fn binary_file_of_an_earlier_version_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("old.cal");
        let mut buffer = [0; RECORD_BYTES];
        std::fs::write(&path, Calibration::OMNI.encode(&mut buffer)).expect("written");
        assert_eq!(read(&path).expect("read"), Calibration::OMNI);
        std::fs::write(&path, b"HAPC\x01\x00").expect("written");
        let wrong = read(&path).expect_err("cut short").to_string();
        assert!(
            wrong.contains("earlier version") && wrong.contains("damaged"),
            "{wrong}"
        );
    }

    #[test]
    fn invalid_calibration_file_is_refused_with_the_reason() {
        let good = to_toml(&Calibration::PREMIUM_1_5);
        for (from, to, expected) in [
            ("calibration = 1", "calibration = 2", "format 2"),
            ("premium-1.5", "premium-9", "no model is called premium-9"),
            ("l1_mm = 209.55", "l1_mm = 1.0", "is not valid"),
            ("l1_mm", "l1_inch", "l1_inch"),
            ("l1_mm = 209.55\n", "", "l1_mm"),
            ("l1_mm = 209.55", "l1_mm = nan", "is not valid"),
            ("[links]", "[links", "no calibration file"),
        ] {
            let message = message(&good.replacen(from, to, 1));
            assert!(message.contains(expected), "{from}: {message}");
        }
        assert!(message("").contains("hapterra-calibration"));
    }

    #[test]
    fn calibration_file_round_trips() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("arm.toml");
        write(&path, &Calibration::PREMIUM_1_5).expect("written");
        assert_eq!(read(&path).expect("read"), Calibration::PREMIUM_1_5);
        assert!(read(&folder.path().join("none.toml")).is_err());
    }
}
