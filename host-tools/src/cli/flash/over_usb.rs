//! Update over USB, by the loader in the chip's ROM.

use std::time::{Duration, Instant};

use hapterra_core::wire::request::Request;

use super::Args;
use crate::board::Image;
use crate::board::update::{
    Choice, ConnectedDevice, Loader, Plan, Step, SystemPipe, UpdateError, choose,
    connected_devices, open_loader, update,
};
use crate::cli::failure::{Failure, OrHint};
use crate::cli::session_summary;
use crate::cli::terminal::progress;
use crate::cli::terminal::questions::prompt;
use crate::cli::terminal::writer::{self, print_line};
use crate::link::{ControlSession, DeviceAddress, Usb};

/// Time limit for the board's reply.
const TIMEOUT: Duration = Duration::from_secs(4);
/// Time limit for a device to reappear as another; on Windows, a driver's first start takes
/// seconds.
const REAPPEAR_TIMEOUT: Duration = Duration::from_secs(15);
/// Interval of checks for connected devices.
const POLL_INTERVAL: Duration = Duration::from_millis(200);

pub(super) fn run(args: &Args, image: &Image) -> Result<(), Failure> {
    let serial = match &args.device {
        DeviceAddress::Usb(serial) => serial.as_deref(),
        _ => None,
    };
    let connected_devices = connected_devices();
    let place = match choose(&connected_devices, serial)? {
        Choice::Loader(device) => {
            print_line(format!("loader         {}", device.place));
            &device.place
        }
        Choice::UnnamedLoader(device) => {
            confirm_loader(args, device)?;
            &device.place
        }
        Choice::Board(device) => {
            enter_loader(args, device)?;
            &device.place
        }
    };
    let mut loader = wait_for(|| open_loader(place))?.ok_or(UpdateError::NoLoader)?;
    // The update repeats this check before the first erase; a failure here can still restart the
    // program.
    if let Err(error) = Plan::new(args.board, image, loader.layout()) {
        let _ = loader.start_program(image.memories().flash);
        return Err(error.into());
    }
    let bytes = write(args, image, &mut loader)?;
    print_line(format!(
        "written        {bytes} bytes to {}, read back and equal",
        args.board.name
    ));
    drop(loader);
    wait_for_firmware(place)
}

/// Asks the user to confirm a loader that was not named, because a loader cannot report which board
/// it is on.
fn confirm_loader(args: &Args, device: &ConnectedDevice) -> Result<(), Failure> {
    let serial = device.serial.as_deref().unwrap_or("without a number");
    let (place, board) = (&device.place, args.board.name);
    print_line(format!(
        "loader         {serial} at {place}, as it was found"
    ));
    let question = format!("is this the {board} to write? [y/N]");
    match prompt(&question).as_deref() {
        Some("y" | "Y" | "yes") => Ok(()),
        _ => Err(Failure::new(format!(
            "the loader {serial} at {place} could not be confirmed as the board to write"
        ))
        .hint(format!(
            "nothing was changed; name it: --device usb:{serial}"
        ))),
    }
}

/// Makes a board enter its loader if it is the right board.
fn enter_loader(args: &Args, device: &ConnectedDevice) -> Result<(), Failure> {
    let transport = Box::new(Usb::connect(device.serial.as_deref())?);
    let mut control = ControlSession::open(transport, TIMEOUT)?;
    let running = control.device().board.as_str();
    if running != args.board.name {
        return Err(UpdateError::OtherBoard {
            image: args.board.name,
            running: running.to_owned(),
        }
        .into());
    }
    print_line(format!(
        "board          {}",
        session_summary::device(control.device())
    ));
    control
        .request(&Request::EnterLoader)?
        .or_hint("disarm it (`hapterra status --disarm`) and try again; firmware without this request is flashed through the debug probe once")
}

/// Calls `find` until it finds something, at most for `REAPPEAR_TIMEOUT`.
fn wait_for<T>(
    mut find: impl FnMut() -> Result<Option<T>, UpdateError>,
) -> Result<Option<T>, UpdateError> {
    let start = Instant::now();
    loop {
        match find() {
            Ok(None) | Err(UpdateError::Disconnected { .. })
                if start.elapsed() < REAPPEAR_TIMEOUT =>
            {
                std::thread::sleep(POLL_INTERVAL);
            }
            other => return other,
        }
    }
}

fn write(args: &Args, image: &Image, loader: &mut Loader<SystemPipe>) -> Result<usize, Failure> {
    writer::finish();
    let bar = progress::bar(Some(0), "{msg:10} {bar:30} {pos} of {len}");
    let written = update(loader, args.board, image, &mut |step| {
        let (what, done, of) = match step {
            Step::Erased(done, of) => ("erased", done, of),
            Step::Written(done, of) => ("written", done, of),
            Step::Compared(done, of) => ("compared", done, of),
        };
        bar.set_message(what);
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    Ok(written?)
}

/// Waits for the new firmware's introduction.
fn wait_for_firmware(place: &str) -> Result<(), Failure> {
    let back = wait_for(|| {
        let mut devices = connected_devices().into_iter();
        Ok(devices.find(|device| !device.is_loader && device.place == place))
    })?;
    let Some(device) = back else {
        return Err(
            Failure::new("the board was updated, and did not reappear on USB")
                .hint("press its reset button, then check it with `hapterra status`"),
        );
    };
    let transport = Box::new(Usb::connect(device.serial.as_deref())?);
    let control = ControlSession::open(transport, TIMEOUT)?;
    print_line(format!(
        "started        {}",
        session_summary::device(control.device())
    ));
    Ok(())
}
