//! bring-up
#![no_std]
#![no_main]

mod chip;
#[path = "../common/critical.rs"]
mod critical;
mod serial;
mod time;

use chip::Interrupt as interrupt;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_rt::{entry, interrupt};
use embassy_executor::InterruptExecutor;
use embedded_io_async::{Read, Write};
use hapterra_firmware::board::TickClock;
use serial::Serial;

use defmt_semihosting as _;

static LINK: Serial = Serial::new(chip::link_uart);
static EXECUTOR: InterruptExecutor = InterruptExecutor::new();
static TICKS: AtomicU32 = AtomicU32::new(0);
static WORST: AtomicU32 = AtomicU32::new(0);

#[interrupt]
fn LinkReceived() {
    LINK.on_received();
}
#[interrupt]
fn LinkSent() {
    LINK.on_sent();
}
#[interrupt]
fn PlantReceived() {}
#[interrupt]
fn PlantSent() {}
#[interrupt]
fn HapticTick() {
    let mut c = time::Clock;
    let late = c.since_due();
    c.begin_tick();
    WORST.fetch_max(late, Ordering::Relaxed);
    TICKS.fetch_add(1, Ordering::Relaxed);
    cortex_m::peripheral::NVIC::pend(chip::Interrupt::TickDone);
}
#[interrupt]
fn Executor() {
    unsafe { EXECUTOR.on_interrupt() }
}
#[interrupt]
fn TickDone() {}

#[embassy_executor::task]
async fn echo() {
    let (mut rx, mut tx) = LINK.open();
    let mut b = [0; 64];
    time::release(time::Reason::Link);
    loop {
        let n = rx.read(&mut b).await.unwrap();
        for x in &b[..n] {
            if *x == b'q' {
                let t0 = time::Clock.now();
                cortex_m::asm::delay(30000);
                let t1 = time::Clock.now();
                defmt::info!(
                    "ticks {} worst {} delay {} now {}",
                    TICKS.load(Ordering::Relaxed),
                    WORST.load(Ordering::Relaxed),
                    t1 - t0,
                    t1
                );
                semihosting::process::exit(0)
            }
        }
        if b[..n].contains(&b'z') {
            tx.write_all(b"z").await.unwrap();
        }
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    semihosting::eprintln!("{}", info);
    semihosting::process::exit(101)
}

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    time::start();
    unsafe {
        for n in 0..32 {
            core.NVIC.ipr[n].write(0x40);
        }
        use chip::Interrupt as I;
        core.NVIC.set_priority(I::HapticTick, 0);
        core.NVIC.set_priority(I::Executor, 0xC0);
        for i in [I::LinkReceived, I::LinkSent, I::HapticTick, I::TickDone] {
            cortex_m::peripheral::NVIC::unmask(i);
        }
    }
    let sp = EXECUTOR.start(chip::Interrupt::Executor);
    sp.spawn(echo().unwrap());
    defmt::info!("up");
    loop {
        cortex_m::asm::nop();
    }
}
