//! Hints for each error of the library: one table per error type.
//!
//! A hint that depends on a command's options is in that command.

mod terrain_files;

use super::failure::Hint;
use super::options::surface::table::TableError;
use crate::board::ImageError;
use crate::board::update::{UpdateError, UpdateFailure};
use crate::calibrate::file::FileError;
use crate::calibrate::{FitError, ProcedureError};
use crate::link::{EmulatorError, LinkError};
use crate::materials::GroundError;
use crate::phantom::PlacingError;
use crate::place::PlaceError;
use crate::replay::ReplayError;
use crate::replay::settings::OtherTerrain;
use crate::synth::{WriteError, WriteFault};
use crate::terrain::TerrainError;

/// Hint for errors that a user cannot cause.
const REPORT: &str = "this should not happen: please report it with the file and the options";

impl Hint for TerrainError {
    fn hint(&self) -> String {
        let hint = match self {
            Self::NoSuchLevel { .. } => "choose a lower --level",
            Self::Tip { .. } => "choose a smaller --tip, a larger --scale, or a higher --level",
            Self::TooLarge(_) => "cut a smaller part out of the file",
            Self::TooTall { .. } | Self::Scale(_) => {
                "choose a smaller --exaggeration, another --scale, or name the file's no-data value with --input no-data=VALUE"
            }
        };
        hint.into()
    }
}

impl Hint for TableError {
    fn hint(&self) -> String {
        match self {
            Self::Unreadable { .. } => "name a surface's file with --surface",
            Self::NoTable { .. } | Self::Class { .. } => {
                "compare it with docs/worldcover.toml: a surface stands under [default], and a class of the ground under [class.NUMBER]"
            }
        }
        .into()
    }
}

impl Hint for GroundError {
    fn hint(&self) -> String {
        match self {
            Self::NoSystem { unplaced, .. } => {
                format!("assign one: gdal_translate -a_srs EPSG:CODE {unplaced} OUT.tif")
            }
            Self::NoConversion { .. } => {
                "bring the classes into the terrain's reference system: gdalwarp -t_srs EPSG:CODE -r near IN OUT.tif"
                    .into()
            }
            Self::Apart { .. } | Self::OtherBody { .. } => {
                "name a class raster that covers this terrain with --materials".into()
            }
            Self::TooMany(_) => {
                "remove the classes that may use the default from the table".into()
            }
        }
    }
}

impl Hint for PlacingError {
    fn hint(&self) -> String {
        match self {
            Self::Interrupted => LinkError::Interrupted.hint(),
            Self::OutOfReach(_) | Self::FarAway(_) => {
                "choose another place with --at, a smaller --exaggeration or another --scale".into()
            }
        }
    }
}

impl Hint for PlaceError {
    fn hint(&self) -> String {
        let hint = match self {
            Self::NoSystem { .. } => {
                "state the place in the file's own coordinates with --at X,Y or --bbox W,S,E,N, or assign the file its reference system: gdal_translate -a_srs EPSG:CODE IN OUT.tif"
            }
            Self::NotOnMap { .. } | Self::BoxAcrossSeam { .. } | Self::NoProjection { .. } => {
                "state the place in the file's own coordinates, with --at X,Y or --bbox W,S,E,N, or bring the file into longitude and latitude, its edges as no data: gdalwarp -t_srs EPSG:4326 -r bilinear -ot Float32 -dstnodata -9999 IN OUT.tif"
            }
            Self::Outside { .. } | Self::NoData { .. } => {
                "choose a place inside: longitude (or x) comes first"
            }
            Self::Unread { .. } => "try again when the file can be read",
            Self::BoxOutside { .. } | Self::BoxOfHoles { .. } => {
                "choose a box that overlaps it: west, south, east, north"
            }
            Self::UnknownCode(_) => {
                "state the place with --crs file or --crs lonlat, or install GDAL, which supports more codes"
            }
            Self::OtherDatum { .. } => "state the place in the file's own coordinates: --crs file",
            Self::NotInSystem { .. } => "choose a place inside: x, to the east, comes first",
            Self::LatitudeFirst([latitude, longitude]) => {
                return format!("swap them: --at {longitude},{latitude} --crs lonlat");
            }
            Self::WestInTheEast([west, south, east, north]) => {
                return format!("swap them: --bbox {east},{south},{west},{north} --crs lonlat");
            }
            Self::NoBox(_) => {
                "state west before east and south before north; only a box of degrees may cross 180°"
            }
            Self::BoxInTwoParts { .. } => "name one of both parts, or --at a place",
            Self::BoxTooSmall { .. } => "choose a larger box",
            Self::NoGroundSize => "state the size of a cell, as --scale 1mm/cell",
            Self::GroundScale(_) => "choose another --scale",
            Self::Exaggeration(_) => "choose another --exaggeration; 1 is true to scale",
            Self::TooTall { .. } => "choose a smaller --exaggeration",
            Self::FarAway(_) => {
                "choose another place with --at, a smaller --exaggeration or another --scale"
            }
            Self::NoReach => "check the record: hapterra status, then hapterra calibrate",
            Self::Scale(_) => "choose another --scale or --exaggeration",
        };
        hint.into()
    }
}

impl Hint for WriteError {
    fn hint(&self) -> String {
        let hint = match self.fault {
            WriteFault::Io(_) => {
                "check that the folder exists and has room, and that you may write there"
            }
            WriteFault::NoRoom(_) => "make it smaller with --size, or name a file on a larger disk",
            WriteFault::Interrupted(_) => "nothing was written",
            WriteFault::UnknownExtension => "name the output .tif for a GeoTIFF",
            WriteFault::TooHighForPng(_) => "lower --amplitude, or write a .tif",
            WriteFault::Encoder(_) => "make it smaller with --size",
        };
        hint.into()
    }
}

impl Hint for ReplayError {
    fn hint(&self) -> String {
        let hint = match self {
            Self::Link(error) => return error.hint(),
            Self::Trajectory(error) if error.is_about_settings() => {
                "replay it with the version of hapterra that recorded it, or replay its path alone with --ignore-settings"
            }
            Self::Trajectory(error) if error.is_about_time() => {
                "t_s is in seconds and increases from row to row, in a recording by whole ticks; --rows-are-ticks replays each row as one tick and ignores t_s"
            }
            Self::Trajectory(_) => {
                "a trajectory is CSV: the header t_s,x_mm,y_mm,z_mm, then four numbers a line"
            }
            Self::Output(_) => "name a file in a folder that you may write to with -o",
            Self::Placement { .. } => {
                "replay it on the terrain that it was recorded on; --ignore-settings replays its path alone"
            }
            Self::Interrupted => "nothing was written",
        };
        hint.into()
    }
}

impl Hint for OtherTerrain {
    fn hint(&self) -> String {
        "name the terrain file of the recording, with the same options; or replay the recording's path alone, on this terrain, with --ignore-settings".into()
    }
}

impl Hint for LinkError {
    fn hint(&self) -> String {
        let hint = match self {
            Self::Absent { searched_for, .. } if searched_for.contains("USB") => {
                "plug the board in, check its cable and that you may open it (on Linux the udev rule host-tools/udev/70-hapterra.rules); or try --device native"
            }
            Self::Absent { .. } => "start the emulated board there, or try --device native",
            Self::Several(_) => "name one: --device usb:SERIAL",
            Self::Disconnected(_) | Self::Silent(_) | Self::HostSilent | Self::Restarted => {
                "check the device and its cable, then start again"
            }
            Self::Version { ours, theirs } if theirs < ours => {
                "flash the firmware that belongs to this command"
            }
            Self::Version { .. } => "install the hapterra command that belongs to the firmware",
            Self::Taken => {
                "switch the amplifiers off if no hand holds the arm; end the other host; start again"
            }
            Self::NotConfirmed => "then see hapterra status",
            Self::Interrupted => "start again",
            Self::SceneRefused | Self::Stuck(_) => REPORT,
        };
        hint.into()
    }
}

impl Hint for EmulatorError {
    fn hint(&self) -> String {
        let hint = match self {
            Self::NoImage | Self::Image { .. } => {
                "`cargo xtask demo` builds the image and names it; or name it with --device emulated:ELF"
            }
            Self::Qemu { .. } => {
                "install QEMU for ARM (`cargo xtask demo` does, or type: sudo apt-get install qemu-system-arm), or name it in HAPTERRA_QEMU"
            }
            Self::NotUp { .. } => {
                "check that the image is the mps2-an386 one: `cargo xtask demo` rebuilds it"
            }
            Self::Listen(_) => "check that this program may open sockets on 127.0.0.1",
        };
        hint.into()
    }
}

impl Hint for ProcedureError<LinkError> {
    fn hint(&self) -> String {
        let hint = match self {
            Self::Counts(error) => return error.hint(),
            Self::Fit(FitError::NotMoved { .. }) => {
                "move the tip by 80 mm or so in each direction; if you did, check that joint's encoder cable"
            }
            Self::Fit(FitError::NoRatios { .. }) => {
                "measure again, along the ruler and in the requested direction; check the link lengths with --set l1=… and --set l2=…"
            }
            Self::Fit(FitError::NoWeight { .. }) => {
                "hold the arm in more different poses, or leave gravity out with --measure zero,ratios"
            }
            Self::Stopped(_) | Self::Refused => {
                "start again when you are ready: hapterra calibrate"
            }
        };
        hint.into()
    }
}

impl Hint for FileError {
    fn hint(&self) -> String {
        "name a file that hapterra calibrate -o has written".into()
    }
}

impl Hint for ImageError {
    fn hint(&self) -> String {
        let hint = match self {
            Self::Emulated(_) => "`hapterra demo` runs it",
            Self::Unreadable { .. } => "check the path given with --image",
            Self::NoImage { .. } => {
                "name the ELF that `cargo xtask image BOARD` prints with --image"
            }
            Self::OutOfMemory { .. } => {
                "it was built for another board: name the right one with --board"
            }
            Self::OtherBoard { found: Some(_), .. } => {
                "name the board that it was built for with --board, or another image"
            }
            Self::OtherBoard { found: None, .. } => {
                "images built from this source name theirs, unless they were stripped: `cargo xtask image BOARD` builds one"
            }
        };
        hint.into()
    }
}

impl Hint for UpdateError {
    fn hint(&self) -> String {
        let hint = match self {
            Self::Nothing { .. } => {
                "plug the board's own USB in; `hapterra list` shows the devices that are found; a board without working firmware shows its loader when BOOT0 is high at a reset"
            }
            Self::Several(_) => {
                "name one: --device usb:SERIAL; if two have the same serial number, unplug one"
            }
            Self::OtherBoard { .. } => {
                "nothing was touched: name the image of that board, or plug in the other one"
            }
            Self::NoLoader => {
                "press the board's reset button: nothing was erased, and it runs as before; on Windows the loader needs the WinUSB driver once (https://zadig.akeo.ie), on Linux the udev rule host-tools/udev/70-hapterra.rules"
            }
            Self::Layout(_) | Self::OtherChip { .. } | Self::Cannot(_) => {
                "nothing was touched: check that --board is the board that is plugged in; a press of its reset button ends the loader"
            }
            Self::Calibrations { .. } | Self::NoVectors(_) => {
                "nothing was touched: `cargo xtask image BOARD` builds an image that fits"
            }
            Self::Disconnected { .. }
            | Self::Refused { .. }
            | Self::Endless(_)
            | Self::Differs(_) => "press the board's reset button and try again",
        };
        hint.into()
    }
}

impl Hint for UpdateFailure {
    fn hint(&self) -> String {
        if !self.erased {
            return format!("{}; nothing was erased", self.error.hint());
        }
        "the board has no complete program now, and its calibration is unchanged; leave the power stages off and type the same command again, the loader is still there; if it is not: unplug everything, set BOOT0 high (NUCLEO-G474RE: CN7 pin 7 to pin 5; NUCLEO-H743ZI2: CN11 pin 7 to pin 5), plug in, and type it again; or use the debug probe: hapterra flash without --dfu".into()
    }
}

#[cfg(feature = "probe")]
mod of_the_probe {
    use super::Hint;
    use crate::board::FlashError;

    impl Hint for FlashError {
        fn hint(&self) -> String {
            let hint = match self {
                Self::UnknownChip(..) | Self::Emulated(_) => super::REPORT,
                Self::NoProbe => {
                    "plug the Nucleo's ST-LINK connector in with a data cable; `hapterra list` shows the devices that are found"
                }
                Self::NoSuchProbe { .. } | Self::ManyProbes(_) | Self::Selector(_) => {
                    "name one as --probe VID:PID:SERIAL"
                }
                Self::Forbidden(_) => {
                    "install probe-rs' udev rules (https://probe.rs/docs/getting-started/probe-setup/), then plug it in again"
                }
                Self::Probe { .. } => {
                    "close other programs that use it (an IDE, probe-rs, OpenOCD), then plug it in again"
                }
                Self::Chip { .. } => {
                    "check that the board has power, that it is the board named, and that the probe's jumpers are on"
                }
                Self::Write { .. } => {
                    "try again; if it stays so, the chip's flash is protected or worn out"
                }
            };
            hint.into()
        }
    }
}
