//! A hand that is faster than the link: 2,000 cells a second over a line of 200 bytes a tick. It
//! renders the fallback while its tiles are late, and never no-data.

use std::path::Path;
use std::time::Duration;

use hapterra::link::{
    Arming, Client, Emulator, Event, LinkStats, State, Timeouts, Transport, move_arm_while,
};
use hapterra::phantom::{ArmFrame, HandModel, HeldPhantom, PhantomModel, Script, Touch};
use hapterra::place::Reach;
use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::Limits;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::terrain::CoarseTile;
use hapterra_tests::emulation::emulated_board;
use hapterra_tests::shared;
use hapterra_tests::slow_line::{InMemory, OnBoard, SlowLine, Stepped};
use hapterra_tests::timeouts::HANG;
use heightfield::{OpenOptions, Raster};

/// Millimetres of the hand a cell, so that 2,000 cells a second are 200 mm/s.
const CELL_MM: f64 = 0.1;
const SPEED_MM_S: f64 = 200.0;
/// Bytes on the line in a tick of 1 ms: 200 kB/s.
const BYTES_A_TICK: usize = 200;
/// Same over real ground, whose tiles need fewer bytes: 100 kB/s.
const REAL_BYTES_A_TICK: usize = 100;
/// Seed of the session's number.
const SEED: u64 = 36;
/// Distance from the middle of the slide to either end, mm.
const AWAY_MM: f64 = 60.0;
/// The guard's limit for the change of force in a tick of 1 ms, N.
const SLEW_N: f32 = 1.0;

/// Slide of a hand around the middle of a terrain.
struct Slide<'t> {
    terrain: &'t Terrain<'t>,
    home_mm: [f64; 3],
    ground_mm: [f64; 2],
    rig: HeldPhantom,
    ticks: u32,
}

impl<'t> Slide<'t> {
    fn over(terrain: &'t Terrain<'t>) -> Self {
        let surface = |east: f64, north: f64| terrain.height_mm(east, north);
        let middle = terrain.size_mm().map(|side| 0.5 * side);
        let [x, y] = middle;
        let ground = surface(x, y).expect("ground in the middle");
        let (hand, params) = (HandModel::default(), SurfaceParams::PREMIUM);
        let wall = f64::from(params.stiffness_n_per_mm);
        let ends = [[x + AWAY_MM, y + 10.0], [x - AWAY_MM, y - 10.0]];
        let mut touch = Touch::start(&surface, &hand, wall, middle, 10.0).press(1.5, 0.3);
        for _ in 0..3 {
            touch = touch.slide(&ends, 1.5, SPEED_MM_S);
        }
        let script: Script = touch.lift(10.0).finish().wait(0.2);
        let ticks = ((HeldPhantom::ARMED_S + script.duration_s()) * 1e3) as u32;
        let home_mm = [x, y, ground + 15.0];
        let model = PhantomModel::premium_1_5();
        let rig = HeldPhantom::new(model, hand, ArmFrame { home_mm }, script).expect("in reach");
        Self {
            terrain,
            home_mm,
            ground_mm: middle,
            rig: rig.arming(),
            ticks,
        }
    }

    fn scene(&self, has_fallback: bool) -> Scene {
        let home = self.terrain.scale().to_grid(self.home_mm);
        let home = home.expect("addressable");
        let scene = self
            .terrain
            .scene(SurfaceParams::PREMIUM, Source::Encoders, home);
        // Its time continues, as on a board.
        let scene = Scene {
            hold_clock: false,
            materials: None,
            ..scene
        };
        let reach = Reach::of(&Calibration::PREMIUM_1_5);
        match has_fallback {
            true => self.terrain.with_fallback(scene, reach.sides_mm()),
            false => scene,
        }
    }

    /// Returns the samples of a slide over a line of this rate, and the client, still open.
    fn rendered(
        &self,
        scene: Scene,
        rate: usize,
        device: &mut dyn Stepped,
    ) -> (Vec<TickRecord>, Client<'t>) {
        let (arming, timeout) = (Some(Arming::VIRTUAL), Timeouts::REAL_TIME);
        let mut client = Client::numbered(self.terrain, scene, arming, timeout, SEED);
        let (mut out, mut is_open) = (vec![], false);
        client.greet(ms(0), &mut out);
        // Without a scene the device's time stops, and the line carries everything.
        while !is_open {
            let output = device.exchange(&std::mem::take(&mut out));
            let mut open = |event: Event<'_>| is_open |= matches!(event, Event::Opened { .. });
            client
                .receive(ms(0), &output, &mut out, &mut open)
                .expect("it answers");
        }
        let (mut line, mut samples) = (SlowLine::new(rate), vec![]);
        for tick in 1..=self.ticks {
            let mut on_event = |event: Event<'_>| {
                if let Event::Sample(sample) = event {
                    samples.push(*sample);
                }
            };
            client
                .append_due(ms(tick), &mut out, &mut on_event)
                .expect("it is there");
            line.send(&std::mem::take(&mut out));
            let output = device.tick(client.session(), &line.carry());
            client
                .receive(ms(tick), &output, &mut out, &mut on_event)
                .expect("it is there");
        }
        (samples, client)
    }

    /// Returns the fallback's own error over the path of the hand, mm: at the samples, where the
    /// difference is largest, as both are bilinear between them.
    fn fallback_error_mm(&self, scene: &Scene) -> f64 {
        let fallback = scene.fallback.expect("a fallback");
        let size = self.terrain.size();
        let at = |column: i32, row: i32| {
            let place = [column.clamp(0, size[0]), row.clamp(0, size[1])];
            let [east, north] = place.map(|cells| f64::from(cells) * CELL_MM);
            self.terrain.height_mm(east, north).expect("known")
        };
        let near = fallback.near.expect("a finer tile where the hand is");
        // On its border the near tile has the heights of the wide one.
        let wide = |column: i32, row: i32| between(&fallback.wide, &at, column, row);
        let of_near = |column: i32, row: i32| match is_on_border(&near, column, row) {
            true => wide(column, row),
            false => at(column, row),
        };
        let coarse = |column: i32, row: i32| match is_in(&near, column, row) {
            true => between(&near, &of_near, column, row),
            false => wide(column, row),
        };
        let away = [AWAY_MM + 8.0, 18.0].map(|mm| (mm / CELL_MM) as i32);
        let [x, y] = self.ground_mm.map(|mm| (mm / CELL_MM) as i32);
        let mut worst = 0.0_f64;
        for column in x - away[0]..=x + away[0] {
            for row in y - away[1]..=y + away[1] {
                worst = worst.max((at(column, row) - coarse(column, row)).abs());
            }
        }
        worst
    }
}

/// Returns the height of a coarse tile at a sample of the level, from its own samples.
fn between(tile: &CoarseTile, sample: &dyn Fn(i32, i32) -> f64, column: i32, row: i32) -> f64 {
    let side = tile.spacing();
    let along = |at: i32, first: i32| {
        let cell = (at - first).div_euclid(side);
        let share = f64::from((at - first).rem_euclid(side)) / f64::from(side);
        (first + cell * side, share)
    };
    let (west, u) = along(column, tile.first.x);
    let (south, v) = along(row, tile.first.y);
    let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    let eastward = |row: i32| mix(sample(west, row), sample(west + side, row), u);
    mix(eastward(south), eastward(south + side), v)
}

fn is_in(tile: &CoarseTile, column: i32, row: i32) -> bool {
    let side = 32 * tile.spacing();
    (0..=side).contains(&(column - tile.first.x)) && (0..=side).contains(&(row - tile.first.y))
}

fn is_on_border(tile: &CoarseTile, column: i32, row: i32) -> bool {
    let side = 32 * tile.spacing();
    [0, side].contains(&(column - tile.first.x)) || [0, side].contains(&(row - tile.first.y))
}

/// Ground under the ticks: ticks in contact, those over no-data for lack of a tile, those over
/// coarse ground, and the largest distance of the proxy from the terrain, mm.
#[derive(Debug, Default)]
struct Ground {
    touched: u32,
    lacked: u32,
    coarse: u32,
    off_mm: f64,
    step_n: f32,
}

fn measure_ground(terrain: &Terrain<'_>, samples: &[TickRecord]) -> Ground {
    let mut ground = Ground::default();
    for sample in samples {
        ground.lacked += u32::from(sample.limits.contains(Limits::TERRAIN_MISSING));
        if sample.state != ContactState::Touching {
            continue;
        }
        ground.touched += 1;
        ground.coarse += u32::from(sample.limits.contains(Limits::TERRAIN_COARSE));
        let [east, north, up] = terrain.scale().to_mm(&sample.proxy);
        let height = terrain.height_mm(east, north).expect("over the terrain");
        ground.off_mm = ground.off_mm.max((up - height).abs());
    }
    for pair in samples
        .windows(2)
        .filter(|pair| pair[1].tick == pair[0].tick + 1)
    {
        let step = (pair[1].force_n - pair[0].force_n).length();
        ground.step_n = ground.step_n.max(step);
    }
    ground
}

fn check_slide(
    name: &str,
    slide: &Slide<'_>,
    scene: &Scene,
    (samples, stats): &(Vec<TickRecord>, LinkStats),
) {
    assert_eq!(stats.lost + stats.dropped, 0, "{name}");
    let ground = measure_ground(slide.terrain, samples);
    let estimated = slide.fallback_error_mm(scene);
    eprintln!(
        "{name}: {ground:?}, fallback off by up to {estimated:.3} mm, {} tiles",
        stats.tiles
    );
    // Until the fallback has arrived, only its absence is known.
    let comes = samples
        .iter()
        .position(|s| !s.limits.contains(Limits::TERRAIN_MISSING));
    assert!(comes.is_some_and(|tick| tick < 1000), "{name}: {comes:?}");
    let ground_then = measure_ground(slide.terrain, &samples[comes.unwrap_or(0)..]);
    assert_eq!(ground_then.lacked, 0, "{name}");
    assert!(ground.touched > 1500, "{name}: hardly a touch");
    assert!(ground.coarse > 100, "{name}: the line was fast enough");
    assert!(
        ground.step_n <= SLEW_N * 1.001,
        "{name}: {} N",
        ground.step_n
    );
    assert!(
        ground.off_mm <= estimated + 1e-4,
        "{name}: {} mm",
        ground.off_mm
    );
}

fn in_memory(slide: &Slide<'_>, scene: Scene) -> (Vec<TickRecord>, LinkStats) {
    let mut device = InMemory::new(slide.rig.clone());
    let (samples, client) = slide.rendered(scene, BYTES_A_TICK, &mut device);
    (samples, client.stats().clone())
}

/// Same as [`in_memory`] on the emulated board; then closes the session.
fn on_board(
    slide: &Slide<'_>,
    scene: Scene,
    qemu: &Path,
    image: &Path,
) -> (Vec<TickRecord>, LinkStats) {
    let (emulator, lines) = Emulator::start(qemu, image).expect("starts");
    let mut board = OnBoard::new(lines.link, lines.plant, slide.rig.clone());
    let (samples, mut client) = slide.rendered(scene, REAL_BYTES_A_TICK, &mut board);
    let rendered = (samples, client.stats().clone());
    let mut out = vec![];
    client.leave(ms(slide.ticks), &mut out);
    move_arm_while(&mut board.plant, &mut board.arm, || {
        while client.state() != State::Closed {
            board
                .link
                .send(&std::mem::take(&mut out))
                .expect("it is there");
            let mut chunk = [0; 4096];
            let n = board.link.receive(&mut chunk, HANG).expect("it is there");
            let received = client.receive(ms(slide.ticks), &chunk[..n], &mut out, &mut |_| {});
            received.expect("it confirms");
        }
        board.link.send(&out).expect("it is there");
        emulator.finish().expect("ends");
    });
    rendered
}

fn ms(tick: u32) -> Duration {
    Duration::from_millis(tick.into())
}

fn made() -> Raster {
    Synth::new(Kind::Fractal, 5, 300.0)
        .raster(3000, 2000)
        .expect("raster")
}

#[test]
fn fallback_prevents_missing_terrain_at_2000_cells_per_second() {
    let raster = made();
    let scale = Scale::new(CELL_MM, 0.1).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let slide = Slide::over(&terrain);
    let without = slide.scene(false);
    let ground = measure_ground(&terrain, &in_memory(&slide, without).0);
    assert!(
        ground.lacked > 100,
        "without a fallback there is no-data: {ground:?}"
    );
    let scene = slide.scene(true);
    check_slide(
        "made, in this program",
        &slide,
        &scene,
        &in_memory(&slide, scene),
    );
}

#[test]
fn fallback_prevents_missing_terrain_on_the_emulated_board() {
    let Some((qemu, image)) = emulated_board() else {
        return;
    };
    let file = shared("dem/large/globe_g10g_10800x6000_i16_cog.tif");
    // Mountains of thousands of metres, in millimetres.
    let (raster, height_mm) = match file {
        Some(path) => (
            Raster::open(path, &OpenOptions::default()).expect("opens"),
            0.0005,
        ),
        None => (made(), 0.1),
    };
    let scale = Scale::new(CELL_MM, height_mm).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let slide = Slide::over(&terrain);
    let scene = slide.scene(true);
    let rendered = on_board(&slide, scene, &qemu, &image);
    check_slide("real, on the emulated board", &slide, &scene, &rendered);
}
