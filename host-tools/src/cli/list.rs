//! `hapterra list`: boards, debug probes and ports that this computer can reach.

use std::time::Duration;

use super::failure::{Failure, Hint};
use super::session_summary;
use crate::board::update::connected_devices;
use crate::board::{BOARDS, probes};
use crate::link::{ControlSession, LinkError, Tcp, Transport, Usb, tcp_address};
use heightfield::printable_text::printable;

/// Arguments of `hapterra list`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Further address of an emulated board's link
    #[arg(long = "tcp", value_name = "HOST:PORT", value_parser = tcp_address)]
    pub addresses: Vec<String>,
}

/// Default address of an emulated board's link.
const DEFAULT_ADDRESS: &str = "localhost:4000";
/// Time limit for a board's introduction.
const TIMEOUT: Duration = Duration::from_millis(1500);

/// Lists the devices; if there are none, what was searched for and what to check.
///
/// # Errors
/// None: an empty list is a valid result.
pub fn run(args: &Args) -> Result<(), Failure> {
    println!("boards with firmware");
    for board in &BOARDS {
        let chip = board
            .chip
            .map_or(String::new(), |chip| format!(" ({chip})"));
        println!("  {:<19} {}{chip}", board.name, board.what);
    }
    list_usb();
    list_probes();
    list_emulated(args);
    Ok(())
}

fn list_usb() {
    println!("boards on USB");
    let (found, looked_at) = Usb::list();
    if found.is_empty() {
        println!(
            "  none: looked for {} among {looked_at} USB devices",
            Usb::searched_for()
        );
        println!("  check that the board's own USB connector is plugged in, not only its ST-LINK,");
        println!("  that the cable carries data, and that the board runs hapterra's firmware");
    }
    for info in found {
        let place = printable(&Usb::place(&info));
        let known = Usb::open(&info).and_then(|link| describe(Box::new(link)));
        println!(
            "  {place}: {}",
            known.unwrap_or_else(|error| error_text(&error))
        );
    }
    for loader in connected_devices().iter().filter(|device| device.is_loader) {
        let serial = loader.serial.as_deref().unwrap_or("(no serial number)");
        println!("  usb:{serial} at {}: an STM32 in its loader", loader.place);
        println!("  `hapterra flash --dfu` writes firmware to it; its reset button ends it");
    }
}

fn list_probes() {
    println!("debug probes");
    let (found, looked_at) = probes();
    if found.is_empty() {
        println!("  none: looked for ST-LINK, CMSIS-DAP and J-Link among {looked_at} USB devices");
        println!("  check the cable to the board's ST-LINK connector");
    }
    for probe in &found {
        let name = printable(probe.name.as_deref().unwrap_or("no name"));
        println!("  {} {} ({name})", probe.kind, printable(&probe.selector));
    }
    #[cfg(not(feature = "probe"))]
    if !found.is_empty() {
        println!(
            "  this hapterra was built without debug probes, so it cannot flash through them:"
        );
        println!("  {}", super::flash::WITHOUT);
    }
}

fn list_emulated(args: &Args) {
    println!("emulated boards");
    let default = [DEFAULT_ADDRESS.to_owned()];
    let addresses = if args.addresses.is_empty() {
        &default[..]
    } else {
        &args.addresses
    };
    for address in addresses {
        match Tcp::connect(address).and_then(|link| describe(Box::new(link))) {
            Ok(description) => println!("  tcp:{address}: {description}"),
            Err(LinkError::Absent { why, .. }) => {
                println!("  none at tcp:{address}: {why}");
                println!(
                    "  name another place with --tcp HOST:PORT; `hapterra demo` starts a board of its own"
                );
            }
            Err(error) => println!("  tcp:{address}: {}", error_text(&error)),
        }
    }
}

/// Returns a description of the device behind a link.
fn describe(link: Box<dyn Transport>) -> Result<String, LinkError> {
    let control = ControlSession::open_read_only(link, TIMEOUT)?;
    Ok(session_summary::device(control.device()))
}

fn error_text(error: &LinkError) -> String {
    format!("{error}; {}", error.hint())
}
