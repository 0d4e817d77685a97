//! The application of an image: its memory, and the way of the haptic loop into its
//! interrupt. What differs between boards is in `chip.rs`.

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
/// Memory of the loop. Not in the interrupt's own variable: what has a value from the
/// start takes flash, too.
static LOOP: StaticCell<Loop> = StaticCell::new();
/// Memory of the link. In its task, it would be moved over the stack twice.
static LINK: StaticCell<Link<'static, WINDOW>> = StaticCell::new();
/// Carries the loop to its interrupt: filled once, before that is enabled.
static HANDOVER: Mutex<Cell<Option<&'static mut Loop>>> = Mutex::new(Cell::new(None));
/// Raised, by an interrupt below the haptic one, when a tick has ended.
pub(crate) static TICK_DONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Assembles the application and leaves its loop for the haptic interrupt.
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

/// Runs a tick in the haptic interrupt, whose own variable `slot` is. Returns the loop and
/// what the amplifiers were left with, but nothing the first time: start-up raises the
/// interrupt once, before there is a tick to be late for, to fetch the loop.
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
