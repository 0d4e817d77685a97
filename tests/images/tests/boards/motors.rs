//! Motor temperatures of a board after a start: a reset keeps those in RAM; otherwise all motors
//! count as hot.

use hapterra::terrain::Terrain;
use hapterra_core::Vec3;
use hapterra_core::guard::GuardInputs;
use hapterra_core::guard::thermal::{CONTINUOUS_C, RESET_MARGIN_K};
use hapterra_core::scene::Scene;
use hapterra_core::wire::status::{BootReport, ResetCause, Status};
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::motor_memory::Copies;
use hapterra_firmware::native::{Device as NativeDevice, StoppedClock};
use hapterra_firmware::store::Stored;
use hapterra_image_tests::device::{Device, Plane, on_each_board};
use hapterra_image_tests::machine::{Machine, Stop};
use hapterra_image_tests::supply::Reset;
use heightfield::Raster;

/// Returns the RAM of a board with unused motors.
fn cold() -> Copies {
    let tiles = Box::leak(Box::new(TileBuffers::<4>::VACANT));
    let memory = Box::leak(Box::new(WorkingMemory::new()));
    let (clock, boot) = (StoppedClock::<1>, BootReport::default());
    let mut device = NativeDevice::new(tiles, memory, clock, Stored::Missing, boot);
    for _ in 0..200 {
        device.tick(GuardInputs::default());
    }
    *device.retained()
}

fn on_each(mut then: impl FnMut(Machine, &Plane, &Terrain<'_>, Scene)) {
    let plane = Plane::level([100.0, 100.0, 30.0], 20.0);
    let raster = Raster::from_fn(201, 201, |_, _| 20.0).expect("raster");
    on_each_board(&raster, plane.place.home_mm, |machine, terrain, scene| {
        then(machine, &plane, terrain, scene);
    });
}

/// Returns the address of the copies in the image.
fn place(machine: &Machine) -> u32 {
    let symbol = machine.image.symbol_like(&["motor_memory", "COPIES"]);
    symbol.expect("the copies").address
}

/// Puts copies into the RAM and resets the chip.
fn reset_with(machine: &mut Machine, copies: &Copies, cause: Reset) {
    let words = copies.as_flattened().iter();
    let bytes: Vec<u8> = words.flat_map(|word| word.to_le_bytes()).collect();
    machine.patch(place(machine), &bytes);
    machine.reset(cause);
}

fn assert_hot(status: &Status, board: &str) {
    let winding_c = status.health.winding_c;
    let hot = winding_c
        .to_array()
        .map(|c| CONTINUOUS_C - 3.0 < c && c <= CONTINUOUS_C + 0.1);
    assert_eq!(hot, [true; 3], "{board}: {winding_c}");
}

/// Safety: 12.
#[test]
fn motors_count_as_hot_after_power_up() {
    on_each(|mut machine, _, terrain, scene| {
        let board = machine.chip.board;
        reset_with(&mut machine, &cold(), Reset::PowerUp);
        let status = Device::open(machine, terrain, scene).query_status();
        assert_eq!(status.boot.cause, ResetCause::PowerOn, "{board}");
        assert_hot(&status, board);
    });
}

/// Safety: 12, images.
#[test]
fn motors_count_as_hot_if_the_ram_is_damaged() {
    on_each(|mut machine, _, terrain, scene| {
        let board = machine.chip.board;
        let mut copies = cold();
        for copy in &mut copies {
            copy[3] ^= 1 << 20;
        }
        reset_with(&mut machine, &copies, Reset::Watchdog);
        let status = Device::open(machine, terrain, scene).query_status();
        assert_eq!(status.boot.cause, ResetCause::Watchdog, "{board}");
        assert_hot(&status, board);
    });
}

/// Safety: 12, images.
#[test]
fn motor_temperatures_survive_a_reset_under_load() {
    on_each(|mut machine, plane, terrain, scene| {
        let board = machine.chip.board;
        // It has run for long, and its motors are cold.
        reset_with(&mut machine, &cold(), Reset::Watchdog);
        let mut device = Device::arm(machine, terrain, scene);
        let initial_c = device.query_status().health.winding_c;
        assert!(
            initial_c.max_element() < 25.0 + RESET_MARGIN_K + 0.1,
            "{board}: {initial_c}"
        );
        device.move_to(plane.counts_at([100.0, 100.0], -3.0));
        device.wait_for_full_force();
        device.move_to(plane.counts_at([100.0, 100.0], 6.0));
        device.run_ms(1_500);
        let before = device.query_status().health.winding_c;
        {
            // The tick hangs with the force on, and the watchdog resets the chip.
            let mut machine = device.machine.borrow_mut();
            assert!(machine.is_enabled(), "{board}: under load");
            let tick = machine.image.function_like(&["HapticLoop", "run_tick"]);
            machine.patch(tick.address, &[0xFE, 0xE7]);
            assert_eq!(machine.run_ms(200), Stop::Watchdog, "{board}");
            machine.restore(tick);
        }
        let mut restarted = Device::open(device.reset(), terrain, scene);
        let after = restarted.query_status().health.winding_c;
        println!("{board}: {before} °C before the reset, {after} after it");
        let recorded = after - before;
        // The start takes a moment, in which the windings cool a little.
        assert!(
            recorded.cmpgt(Vec3::splat(0.0)).all(),
            "{board}: {before} {after}"
        );
        assert!(
            recorded.cmplt(Vec3::splat(RESET_MARGIN_K + 1.0)).all(),
            "{board}: {before} {after}"
        );
        // Each axis has its own temperature: the one that pushed is the warmest.
        assert!(after.y > after.x + 1.0, "{board}: {after}");
    });
}
