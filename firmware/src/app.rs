//! Assembles the application from a board's parts: the haptic loop for the timer interrupt and the
//! link for its task, over memory that is not moved.

use hapterra_core::guard::Fault;
use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::phantom::Kinematics;
use hapterra_core::terrain::Tile;
use hapterra_core::tick::{self, Haptics};
use hapterra_core::wire::hello::SerialNumber;
use hapterra_core::wire::status::{BootReport, CalibrationSource};

use crate::board::{Amplifiers, Encoders, TickClock};
use crate::haptic_loop::HapticLoop;
use crate::link::{ArmConfig, Buffers, DeviceState, Link};
use crate::monitor::Monitor;
use crate::queues::{Queues, SPARES};
use crate::store::Stored;

/// All tile buffers of a device with a window of `D × D` tiles.
pub struct TileBuffers<const D: usize> {
    window: [[Tile; D]; D],
    spare: [Tile; SPARES],
}

impl<const D: usize> TileBuffers<D> {
    /// Vacant buffers.
    pub const VACANT: Self = Self {
        window: [const { [const { Tile::VACANT }; D] }; D],
        spare: [const { Tile::VACANT }; SPARES],
    };

    /// Splits the buffers into the window's and the spare ones.
    pub(crate) fn split(&mut self) -> ([[&mut Tile; D]; D], [&mut Tile; SPARES]) {
        let window = self.window.each_mut().map(|row| row.each_mut());
        (window, self.spare.each_mut())
    }
}

/// The application's memory besides its tiles: the queues and the link's large buffers. It is
/// placed once, because moving it would need the same size of stack.
pub struct WorkingMemory<'t> {
    pub(crate) queues: Queues<'t>,
    pub(crate) link: Buffers,
}

impl WorkingMemory<'_> {
    /// Makes empty memory.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            queues: Queues::new(),
            link: Buffers::new(),
        }
    }
}

impl Default for WorkingMemory<'_> {
    fn default() -> Self {
        Self::new()
    }
}

/// A board's parts for the application.
pub struct Hardware<E, A, C> {
    /// The encoders.
    pub encoders: E,
    /// The amplifiers, off.
    pub amplifiers: A,
    /// The tick's timer and the clock.
    pub clock: C,
    /// The current at the ends of the amplifiers' range, A: the maximum of any calibration.
    pub full_scale_a: f32,
    /// Maximum time from the beginning of a tick until the motors have its current, µs: the tick,
    /// the outputs, the amplifiers' reading of them, and the lag of their current loops. The
    /// passivity controller uses it, and the host receives it.
    pub latency_us: u16,
    /// The Phantom's calibration record, as the board's memory contains it.
    pub calibration: Stored,
    /// Assumed temperatures of the motors, from [`crate::motor_memory::begin`];
    /// [`Temperatures::HOT`] if they are unknown.
    pub motors: Temperatures,
    /// Serial number among boards of its kind.
    pub serial: SerialNumber,
    /// Report of the board's start.
    pub boot: BootReport,
}

/// The application's two halves, and the monitor of both.
pub struct Application<'t, E, A: Amplifiers, C, const D: usize> {
    /// For the timer interrupt.
    pub haptic_loop: HapticLoop<'t, E, A, C, D>,
    /// For the link's task.
    pub link: Link<'t, D>,
    /// For the task that feeds the watchdog.
    pub monitor: &'t Monitor,
}

/// Returns the arm of the stored calibration, if this firmware and this board support it, and its
/// source for the host.
fn usable_calibration(
    stored: &Stored,
    full_scale_a: f32,
) -> (Option<Kinematics>, CalibrationSource) {
    let bad = match stored {
        Stored::Found(calibration) => {
            let fits = calibration.check_board(full_scale_a);
            match fits.and_then(|()| Kinematics::new(calibration)) {
                Ok(mechanism) => return (Some(mechanism), CalibrationSource::Stored),
                Err(bad) => bad,
            }
        }
        Stored::Refused(bad) => *bad,
        Stored::Missing | Stored::Damaged => return (None, CalibrationSource::None),
    };
    (None, CalibrationSource::Refused(bad))
}

/// Builds the application in the given memory. `board` is the name by which the
/// host identifies the board.
///
/// A stored calibration that cannot be used latches
/// [`Fault::CalibrationCorrupt`], unless the board starts with a worse fault.
pub fn assemble<'t, E, A, C, const D: usize>(
    tiles: &'t mut TileBuffers<D>,
    memory: &'t mut WorkingMemory<'t>,
    hardware: Hardware<E, A, C>,
    board: &str,
) -> Application<'t, E, A, C, D>
where
    E: Encoders,
    A: Amplifiers,
    C: TickClock,
{
    let (loop_ends, link_ends) = memory.queues.split();
    let monitor = loop_ends.monitor;
    let (window, spare) = tiles.split();
    let (mechanism, source) = usable_calibration(&hardware.calibration, hardware.full_scale_a);
    let is_unusable = hardware.calibration != Stored::Missing && mechanism.is_none();
    let found = is_unusable.then_some(Fault::CalibrationCorrupt);
    let board_facts = tick::Board {
        rate: C::RATE,
        latency_s: 1e-6 * f32::from(hardware.latency_us),
        motors: Some(hardware.motors),
        fault: hardware.boot.fault().or(found),
    };
    let mut haptics = Haptics::on_board(window, &board_facts);
    if let Some(mechanism) = mechanism {
        haptics.configure(mechanism);
    }
    let haptic_loop = HapticLoop::new(
        haptics,
        loop_ends,
        hardware.encoders,
        hardware.amplifiers,
        hardware.clock,
    );
    let arm = ArmConfig {
        calibration: mechanism.map(|mechanism| *mechanism.calibration()),
        source,
        full_scale_a: hardware.full_scale_a,
        latency_us: hardware.latency_us,
    };
    let device = DeviceState::new::<C, D>((board, hardware.serial), hardware.boot, arm);
    let link = Link::new(device, spare, link_ends, &mut memory.link);
    Application {
        haptic_loop,
        link,
        monitor,
    }
}
