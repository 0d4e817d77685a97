//! Registers and memories of the two chips that the images use.

use crate::shutdown::{BreakAt, Freeze};
use crate::supply::{Comparator, ResetFlags};

/// A timer at an address, with its kernel clock and its interrupt, if used.
#[derive(Clone, Copy, Debug)]
pub struct TimerAt {
    /// Name in the manual.
    pub name: &'static str,
    /// Base address.
    pub base: u32,
    /// Position in the vector table.
    pub interrupt: Option<usize>,
}

/// A status that follows a request: if some bits of a register are set, others read as set.
#[derive(Clone, Copy, Debug)]
pub struct Follows {
    /// The register.
    pub address: u32,
    /// Bits of the request.
    pub of: u32,
    /// Bits of the status.
    pub ready: u32,
}

/// USB peripheral of a chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UsbKind {
    /// The device-only one, with packet memory.
    FullSpeedDevice {
        /// Registers.
        base: u32,
        /// Packet memory.
        memory: u32,
    },
    /// Synopsys' OTG.
    Otg {
        /// Registers and FIFOs.
        base: u32,
    },
}

/// Commands to the amplifiers of axes 1 to 3, and the code of a current.
#[derive(Clone, Copy, Debug)]
pub enum Commands {
    /// Converters on the chip: their data registers, 12 bits; the middle is zero, and 256 and 3840
    /// are the ends of the range.
    Converters([u32; 3]),
    /// Compare registers, and the register with the largest count: 50 % is zero,
    /// 15 % and 85 % are the ends of the range.
    DutyCycles([u32; 3], u32),
    /// A quad converter on SPI in two's complement: the transmit and receive registers, the status
    /// register's end-of-transfer bit, and the frame pin.
    Serial {
        /// Register for bytes to send.
        data: u32,
        /// Register of bytes received.
        response_register: u32,
        /// Status register and its end-of-frame bit.
        sent: (u32, u32),
        /// Low during a frame: port and number.
        sync: (u32, u32),
    },
}

/// Reaction of a chip to the load of a flash word that cannot be read.
#[derive(Clone, Copy, Debug)]
pub enum Unreadable {
    /// It loads any value, sets the bit `failed`, and `second` for the second bank, and raises the
    /// NMI. Writing a bit clears it.
    Nmi {
        /// The register.
        register: u32,
        /// Its bit.
        failed: u32,
        /// Its bit for the second bank.
        second: u32,
    },
    /// It raises a bus fault, and sets a bit of the status register, which the next register
    /// clears.
    BusFault {
        /// The register and its bit.
        status: (u32, u32),
        /// The register that clears it.
        clear: u32,
    },
}

/// Flash of a chip: its sectors, and the location of the calibrations.
#[derive(Clone, Copy, Debug)]
pub struct Flash {
    /// Control register, and the bit that starts an erase.
    pub control: (u32, u32),
    /// Status register, and its bits that are set during an erase.
    pub status: (u32, u32),
    /// Address and bytes of the sector that a control word names.
    pub sector: fn(u32) -> (u32, u32),
    /// Addresses of the two areas with calibrations, and bytes of an area.
    pub calibrations: ([u32; 2], u32),
    /// First address of the second bank.
    pub second_bank: u32,
    /// Bytes of a word, the unit of the error correction.
    pub word: u32,
    /// Reaction to a word that cannot be read.
    pub unreadable: Unreadable,
}

/// Current at the ends of every board's range, A.
const FULL_SCALE_A: f64 = 5.5;

/// A chip.
#[derive(Clone, Copy, Debug)]
pub struct Chip {
    /// Board name, as in the workspace.
    pub board: &'static str,
    /// Name in probe-rs's registry.
    pub chip: &'static str,
    /// Environment variable with the image's path.
    pub variable: &'static str,
    /// True if the core is a Cortex-M7.
    pub is_m7: bool,
    /// Core clock, Hz.
    pub core_hz: u64,
    /// The fastest core clock in the data sheet, Hz.
    pub max_core_hz: u64,
    /// Clock of the timers, Hz.
    pub timer_hz: u64,
    /// Memories for code and data: address and bytes.
    pub memories: &'static [(u32, u32)],
    /// The timers in use.
    pub timers: &'static [TimerAt],
    /// Names of the encoder timers of axes 1 to 3.
    pub encoders: [&'static str; 3],
    /// First GPIO port; they are 0x400 apart.
    pub gpio: u32,
    /// The watchdog.
    pub watchdog: u32,
    /// The reset flags.
    pub reset_flags: ResetFlags,
    /// The comparator of the supply.
    pub comparator: Comparator,
    /// Register with the brown-out level of the option bytes, the field's first bit, and the
    /// highest level.
    pub brown_out_level: (u32, u32, u32),
    /// Register and bit that switch an external clock on.
    pub external_clock: (u32, u32),
    /// The clock recovery of USB's oscillator, and the synchronisation source for the
    /// start-of-frame of the USB in use.
    pub recovery: (u32, u32),
    /// Peripherals that a halted core stops.
    pub freeze: Freeze,
    /// The outputs' break.
    pub output_break: Option<BreakAt>,
    /// Ready bits.
    pub follows: &'static [Follows],
    /// Registers in which these bits always read as set.
    pub set: &'static [(u32, u32)],
    /// Fields that copy another field: register, from bit, to bit, width.
    pub copies: &'static [(u32, u32, u32, u32)],
    /// USB.
    pub usb: UsbKind,
    /// USB's interrupt.
    pub usb_interrupt: usize,
    /// The haptic tick's interrupt.
    pub tick_interrupt: usize,
    /// Enable pin: port and number.
    pub enable: (u32, u32),
    /// Emergency stop, high when pressed.
    pub emergency_stop: (u32, u32),
    /// Dead-man switch, closed to ground while held.
    pub dead_man: (u32, u32),
    /// Clutch, closed to ground while held.
    pub clutch: (u32, u32),
    /// Heartbeat, which toggles in each tick with the amplifiers on.
    pub heartbeat: (u32, u32),
    /// Mark pin, high for a while after each mark.
    pub mark: (u32, u32),
    /// The status LED.
    pub led: (u32, u32),
    /// Low while an amplifier is ready, axes 1 to 3.
    pub ready: [(u32, u32); 3],
    /// Closed to ground if the current monitors are wired.
    pub monitors_fitted: (u32, u32),
    /// The converter that reads the current monitors: its address, its bits, and the
    /// channels of axes 1 to 3.
    pub monitors: (u32, u32, [usize; 3]),
    /// The converter that reads the commands of axes 1 to 3 back at their pins, and its channels.
    pub read_back: Option<(u32, [usize; 3])>,
    /// The flash with the calibrations.
    pub flash: Flash,
    /// Registers of the commands of axes 1 to 3.
    pub commands: Commands,
}

const fn timer(name: &'static str, base: u32, interrupt: Option<usize>) -> TimerAt {
    TimerAt {
        name,
        base,
        interrupt,
    }
}

const fn follows(address: u32, of: u32, ready: u32) -> Follows {
    Follows { address, of, ready }
}

/// Returns the flags of four causes of a reset, each with the pin's flag.
const fn with_pin([a, b, c, d]: [u32; 4], pin: u32) -> [u32; 4] {
    [a | pin, b | pin, c | pin, d | pin]
}

const A: u32 = 0;
const B: u32 = 1;
const C: u32 = 2;
const D: u32 = 3;
const E: u32 = 4;
const F: u32 = 5;
const G: u32 = 6;
const KIB: u32 = 1024;

/// STM32G474RE on the NUCLEO-G474RE (RM0440).
pub static G474: Chip = Chip {
    board: "nucleo-g474re",
    chip: "STM32G474RETx",
    variable: "HAPTERRA_G474_ELF",
    is_m7: false,
    core_hz: 168_000_000,
    max_core_hz: 170_000_000,
    timer_hz: 168_000_000,
    memories: &[
        (0x0800_0000, 512 * KIB),
        (0x2000_0000, 128 * KIB),
        // System memory: the unique identifier and calibration words.
        (0x1FFF_0000, 64 * KIB),
    ],
    timers: &[
        timer("TIM2", 0x4000_0000, None),
        timer("TIM3", 0x4000_0400, None),
        timer("TIM4", 0x4000_0800, None),
        timer("TIM5", 0x4000_0C00, Some(50)),
        timer("TIM7", 0x4000_1400, Some(55)),
    ],
    encoders: ["TIM2", "TIM3", "TIM4"],
    gpio: 0x4800_0000,
    watchdog: 0x4000_3000,
    // RCC_CSR: BORRSTF (also after a power-up), IWDGRSTF, SFTRSTF; PINRSTF with each; RMVF.
    reset_flags: ResetFlags {
        register: 0x4002_1094,
        of: with_pin([1 << 27, 1 << 29, 1 << 28, 1 << 27], 1 << 26),
        clear: 1 << 23,
    },
    // PWR_CR2.PVDE, PLS; PWR_SR2.PVDO; EXTI_RTSR1, IMR1, PR1.
    comparator: Comparator {
        control: (0x4000_7004, 1 << 0, 1),
        status: (0x4000_7014, 1 << 11),
        exti: [0x4001_0408, 0x4001_0400, 0x4001_0414],
        levels_mv: [2_000, 2_200, 2_400, 2_500, 2_600, 2_800, 2_900],
        interrupt: 1,
    },
    // FLASH_OPTR.BOR_LEV.
    brown_out_level: (0x4002_2020, 8, 4),
    // RCC_CR.HSEON.
    external_clock: (0x4002_1000, 1 << 16),
    recovery: (0x4000_2000, 0b10),
    // DBGMCU_APB1FZR1.DBG_IWDG_STOP, DBG_TIM5_STOP.
    freeze: Freeze {
        watchdog: (0xE004_2008, 1 << 12),
        clock: (0xE004_2008, 1 << 3),
        gate: None,
        outputs: None,
    },
    output_break: None,
    follows: &[
        // RCC_CR: HSI, PLL. There is no external clock.
        follows(0x4002_1000, 1 << 8, 1 << 10),
        follows(0x4002_1000, 1 << 24, 1 << 25),
        // RCC_CRRCR: HSI48; RCC_CSR: LSI.
        follows(0x4002_1098, 1 << 0, 1 << 1),
        follows(0x4002_1094, 1 << 0, 1 << 1),
    ],
    // FLASH_OPTR.DBANK: two banks, the setting at delivery.
    set: &[(0x4002_2020, 1 << 22)],
    // RCC_CFGR: SWS follows SW.
    copies: &[(0x4002_1008, 0, 2, 2)],
    usb: UsbKind::FullSpeedDevice {
        base: 0x4000_5C00,
        memory: 0x4000_6000,
    },
    usb_interrupt: 20,
    tick_interrupt: 55,
    enable: (B, 0),
    emergency_stop: (C, 0),
    dead_man: (C, 1),
    clutch: (C, 9),
    heartbeat: (D, 2),
    mark: (B, 10),
    led: (A, 8),
    ready: [(C, 10), (C, 11), (C, 12)],
    monitors_fitted: (C, 8),
    // ADC1: PC2, PC3, PB1.
    monitors: (0x5000_0000, 12, [8, 9, 12]),
    // ADC2: PA4, PA5, PA6.
    read_back: Some((0x5000_0100, [17, 13, 3])),
    // FLASH_CR: PNB, BKER, STRT; FLASH_SR.BSY. Pages of 2 KiB.
    flash: Flash {
        control: (0x4002_2014, 1 << 16),
        status: (0x4002_2010, 1 << 16),
        sector: |control| {
            let page = control >> 3 & 0x7F | control >> 11 << 7 & 0x80;
            (0x0800_0000 + page * 2 * KIB, 2 * KIB)
        },
        calibrations: ([0x0807_F000, 0x0807_F800], 2 * KIB),
        second_bank: 0x0804_0000,
        word: 8,
        // FLASH_ECCR: ECCD, BK_ECC.
        unreadable: Unreadable::Nmi {
            register: 0x4002_2018,
            failed: 1 << 31,
            second: 1 << 21,
        },
    },
    // DAC1 channels 1 and 2, DAC2 channel 1: DHR12Rx.
    commands: Commands::Converters([0x5000_0808, 0x5000_0814, 0x5000_0C08]),
};

/// STM32H743ZI on the NUCLEO-H743ZI2 (RM0433).
pub static H743: Chip = Chip {
    board: "nucleo-h743zi2",
    chip: "STM32H743ZITx",
    variable: "HAPTERRA_H743_ELF",
    is_m7: true,
    core_hz: 456_000_000,
    max_core_hz: 480_000_000,
    timer_hz: 228_000_000,
    memories: &[
        (0x0800_0000, 2048 * KIB),
        (0x2000_0000, 128 * KIB),
        (0x2400_0000, 512 * KIB),
        // ITCM, which the core accesses without a bus.
        (0x0000_0000, 64 * KIB),
        (0x1FF0_0000, 128 * KIB),
    ],
    timers: &[
        timer("TIM1", 0x4001_0000, None),
        timer("TIM15", 0x4001_4000, None),
        timer("TIM8", 0x4001_0400, None),
        timer("TIM3", 0x4000_0400, None),
        timer("TIM4", 0x4000_0800, None),
        timer("TIM5", 0x4000_0C00, Some(50)),
        timer("TIM7", 0x4000_1400, Some(55)),
    ],
    encoders: ["TIM8", "TIM3", "TIM4"],
    gpio: 0x5802_0000,
    watchdog: 0x5800_4800,
    // RCC_RSR: PORRSTF and BORRSTF, IWDG1RSTF, SFTRSTF, BORRSTF; PINRSTF with each; RMVF.
    reset_flags: ResetFlags {
        register: 0x5802_44D0,
        of: with_pin([1 << 23 | 1 << 21, 1 << 26, 1 << 24, 1 << 21], 1 << 22),
        clear: 1 << 16,
    },
    // PWR_CR1.PVDE, PLS; PWR_CSR1.PVDO; EXTI_RTSR1, CPUIMR1, CPUPR1.
    comparator: Comparator {
        control: (0x5802_4800, 1 << 4, 5),
        status: (0x5802_4804, 1 << 4),
        exti: [0x5800_0000, 0x5800_0080, 0x5800_0088],
        levels_mv: [1_950, 2_100, 2_250, 2_400, 2_550, 2_700, 2_850],
        interrupt: 1,
    },
    // FLASH_OPTSR_CUR.BOR_LEV.
    brown_out_level: (0x5200_201C, 2, 3),
    // RCC_CR.HSEON.
    external_clock: (0x5802_4400, 1 << 16),
    // 0b10 is OTG_HS (USB1), 0b11 is OTG_FS (USB2).
    recovery: (0x4000_8400, 0b11),
    // DBGMCU_APB4FZ1.DBG_IWDG1, APB1LFZ1.DBG_TIM5, APB2FZ1.DBG_TIM15, DBG_TIM1.
    freeze: Freeze {
        watchdog: (0x5C00_1054, 1 << 18),
        clock: (0x5C00_103C, 1 << 3),
        gate: Some((0x5C00_104C, 1 << 16)),
        outputs: Some((0x5C00_104C, 1 << 0)),
    },
    // SYSCFG_CFGR: PVDL, CM7L; FLASHL, DTCML, ITCML, AXISRAML.
    output_break: Some(BreakAt {
        timer: "TIM1",
        pin: (E, 15, 1),
        system: (0x5800_0418, 1 << 2, 1 << 6),
        memories: [1 << 3, 1 << 13, 1 << 14, 1 << 15],
    }),
    follows: &[
        // RCC_CR: HSI, CSI, HSI48, the PLLs. There is no external clock.
        follows(0x5802_4400, 1 << 0, 1 << 2),
        follows(0x5802_4400, 1 << 7, 1 << 8),
        follows(0x5802_4400, 1 << 12, 1 << 13),
        follows(0x5802_4400, 1 << 24, 1 << 25),
        follows(0x5802_4400, 1 << 26, 1 << 27),
        follows(0x5802_4400, 1 << 28, 1 << 29),
        // RCC_CSR: LSI.
        follows(0x5802_4474, 1 << 0, 1 << 1),
    ],
    set: &[
        // PWR_CSR1.ACTVOSRDY, PWR_CR3 (USB regulator ready), PWR_D3CR.VOSRDY.
        (0x5802_4804, 1 << 13),
        (0x5802_480C, 1 << 26),
        (0x5802_4818, 1 << 13),
        // SYSCFG_CCCSR.READY.
        (0x5800_0420, 1 << 8),
        // RCC_CR: the clock domains are ready.
        (0x5802_4400, 0b11 << 14),
    ],
    // RCC_CFGR: SWS follows SW.
    copies: &[(0x5802_4410, 0, 3, 3)],
    usb: UsbKind::Otg { base: 0x4008_0000 },
    usb_interrupt: 101,
    tick_interrupt: 55,
    enable: (F, 3),
    emergency_stop: (E, 15),
    dead_man: (F, 5),
    clutch: (F, 4),
    heartbeat: (G, 1),
    mark: (G, 0),
    led: (B, 0),
    ready: [(F, 12), (F, 13), (F, 14)],
    monitors_fitted: (F, 15),
    // ADC1: PA3, PC0, PB1.
    monitors: (0x4002_2000, 16, [15, 10, 5]),
    read_back: None,
    // FLASH_CR2: SNB, START; FLASH_SR2: BSY, QW. Sectors of 128 KiB.
    flash: Flash {
        control: (0x5200_210C, 1 << 7),
        status: (0x5200_2110, 0b101),
        sector: |control| {
            let sector = control >> 8 & 7;
            (0x0810_0000 + sector * 128 * KIB, 128 * KIB)
        },
        calibrations: ([0x081C_0000, 0x081E_0000], 128 * KIB),
        second_bank: 0x0810_0000,
        word: 32,
        // FLASH_SR2.DBECCERR2, FLASH_CCR2.
        unreadable: Unreadable::BusFault {
            status: (0x5200_2110, 1 << 26),
            clear: 0x5200_2114,
        },
    },
    // TIM1_CCR1 to 3, TIM1_ARR.
    commands: Commands::DutyCycles([0x4001_0034, 0x4001_0038, 0x4001_003C], 0x4001_002C),
};

/// The same board with a converter on SPI4.
pub static H743_SPI: Chip = Chip {
    board: "nucleo-h743zi2-spi",
    variable: "HAPTERRA_H743_SPI_ELF",
    output_break: None,
    commands: Commands::Serial {
        data: 0x4001_3420,
        response_register: 0x4001_3430,
        sent: (0x4001_3414, 1 << 3),
        sync: (E, 11),
    },
    ..H743
};

/// All chips.
pub static CHIPS: [&Chip; 3] = [&G474, &H743, &H743_SPI];

impl Commands {
    /// Returns the code of a current, not rounded. `largest` is the largest count of duty cycles.
    #[must_use]
    pub fn code(&self, current_a: f64, largest: u32) -> f64 {
        let fraction = current_a / FULL_SCALE_A;
        match self {
            Self::Converters(_) => 2048.0 + 1792.0 * fraction,
            Self::DutyCycles(..) => f64::from(largest + 1) * (0.5 + 0.35 * fraction),
            Self::Serial { .. } => 32_768.0 * fraction,
        }
    }
}
