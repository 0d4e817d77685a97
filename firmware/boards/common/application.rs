//! The application of an image: its memory, and the transfer of the haptic loop to its interrupt.
//! The differences between boards are in `chip.rs`.

use core::cell::Cell;

use critical_section::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use hapterra_core::guard::GuardOutputs;
use hapterra_firmware::app::{self, Application, Hardware, TileBuffers, WorkingMemory};
use hapterra_firmware::haptic_loop::HapticLoop;
use hapterra_firmware::link::Link;
use hapterra_firmware::monitor::Monitor;
use static_cell::{ConstStaticCell, StaticCell};

use crate::chip::{Amplifiers, Clock, Encoders, WINDOW};

/// The haptic loop of this board.
pub(crate) type Loop = HapticLoop<'static, Encoders, Amplifiers, Clock, WINDOW>;

static TILES: ConstStaticCell<TileBuffers<WINDOW>> = ConstStaticCell::new(TileBuffers::VACANT);
static MEMORY: ConstStaticCell<WorkingMemory<'static>> = ConstStaticCell::new(WorkingMemory::new());
/// Memory of the loop. It is not the interrupt's own variable, because a variable with an initial
/// value also takes flash.
static LOOP: StaticCell<Loop> = StaticCell::new();
/// Memory of the link. In its task, the link would be copied over the stack twice.
static LINK: StaticCell<Link<'static, WINDOW>> = StaticCell::new();
/// Transfers the loop to its interrupt. Filled once, before the interrupt is enabled.
static HANDOVER: Mutex<Cell<Option<&'static mut Loop>>> = Mutex::new(Cell::new(None));
/// Raised at the end of each tick by an interrupt of lower priority than the haptic one.
pub(crate) static TICK_DONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Assembles the application and leaves its loop for the haptic interrupt to fetch.
pub(crate) fn assemble(
    hardware: Hardware<Encoders, Amplifiers, Clock>,
    board: &str,
) -> (&'static mut Link<'static, WINDOW>, &'static Monitor) {
    let Application {
        haptic_loop,
        link,
        monitor,
    } = app::assemble(TILES.take(), MEMORY.take(), hardware, board);
    let haptic_loop = LOOP.init(haptic_loop);
    critical_section::with(|cs| HANDOVER.borrow(cs).set(Some(haptic_loop)));
    (LINK.init(link), monitor)
}

/// Runs a tick in the haptic interrupt, which owns `slot`. Returns the loop and the outputs of the
/// tick, but `None` in the first call: start-up raises the interrupt once, before a tick can be
/// late, to fetch the loop.
pub(crate) fn tick<'s>(
    slot: &'s mut Option<&'static mut Loop>,
) -> Option<(&'s mut Loop, GuardOutputs)> {
    let Some(haptic_loop) = slot else {
        *slot = critical_section::with(|cs| HANDOVER.borrow(cs).take());
        return None;
    };
    let drive = haptic_loop.tick();
    Some((haptic_loop, drive))
}
