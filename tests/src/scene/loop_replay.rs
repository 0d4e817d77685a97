//! A scene on materials, rendered by the product's whole loop, from points to samples.

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::GuardInputs;
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{HipCommand, Scene as SceneMessage, Source, TickRecord};
use hapterra_core::terrain::{FieldSize, RequestHint, TILE_SAMPLES, Tile, TileKey, TileRequester};
use hapterra_core::tick::{Command, Haptics, Outcome};

use super::materials::Materials;
use super::run::{Scene, shifted};
use super::terrain::Terrain;
use super::tile_supply::{Buffers, Supply};
use crate::cycles::Cycles;
use crate::instruction_counter::{Counted, Event, WINDOW};
use crate::invariants::observed_tick::unshifted;
use crate::invariants::{Invariant, Violation};

/// Ticks that one point may be repeated for.
const TIMEOUT: usize = 20_000;

/// Answer to a point.
#[derive(Clone, Copy, Debug)]
pub struct Replied {
    /// The HIP, in the terrain's own coordinates.
    pub hip: [f64; 3],
    /// The proxy, in the same coordinates.
    pub proxy: [f64; 3],
    /// Record of the tick that answered it.
    pub sample: TickRecord,
}

/// Settings of a scene's replay.
#[derive(Clone, Copy, Debug)]
pub struct Replay {
    /// Shift of the terrain, cells.
    pub shift: [i32; 3],
    /// Supply of the tiles.
    pub supply: Supply,
}

/// The loop over a terrain with materials.
struct Device<'t, 'g, const D: usize> {
    haptics: Haptics<'t, D>,
    requester: TileRequester<D>,
    terrain: &'g Terrain,
    materials: &'g Materials,
    replay: Replay,
    spare: Vec<&'t mut Tile>,
    requested: Vec<(u32, TileKey)>,
    now: u32,
    seq: u32,
    /// Tiles and points in their order of arrival, and each tick's report.
    events: Vec<Event>,
    ticks: Vec<Counted>,
}

/// Replays the path of a scene on materials in a window of `D × D` tiles, and calls `check` for the
/// result of each point.
///
/// # Errors
/// The error of `check`, or a point without an answer.
///
/// # Panics
/// If the loop refuses the scene, or a terrain to be stored whole does not fit.
pub fn replay<const D: usize>(
    scene: &Scene,
    materials: &Materials,
    buffers: &mut Buffers,
    replay: Replay,
    mut check: impl FnMut(&Replied) -> Result<(), Violation>,
) -> Result<Vec<Replied>, Violation> {
    let mut device = Device::<D>::new(scene, materials, buffers, replay);
    let mut all = Vec::with_capacity(scene.path.len());
    for (tick, hip) in scene.path.iter().enumerate() {
        let sample = device
            .step(shifted(*hip, replay.shift))
            .ok_or_else(|| Violation {
                invariant: Invariant::Settles,
                tick,
                detail: format!("on materials it never settles for {hip:?}"),
            })?;
        let here = |point: &GridPoint| unshifted(point, replay.shift);
        let replied = Replied {
            hip: *hip,
            proxy: here(&sample.proxy),
            sample,
        };
        check(&replied)?;
        all.push(replied);
    }
    Ok(all)
}

/// Replays the path of a scene on materials in a window as large as the counting board's. Returns
/// the scene as the device receives it, tiles and points in order, and each tick's report.
///
/// # Panics
/// Like [`replay`], and if a point is never answered.
#[must_use]
pub fn noted(scene: &Scene, materials: &Materials) -> (SceneMessage, Vec<Event>, Vec<Counted>) {
    let mut buffers = Buffers::new(WINDOW);
    let how = Replay {
        shift: [0; 3],
        supply: scene.supply,
    };
    let mut device = Device::<WINDOW>::new(scene, materials, &mut buffers, how);
    for hip in &scene.path {
        let answer = device.step(shifted(*hip, how.shift));
        assert!(answer.is_some(), "{hip:?} is never answered");
    }
    let message = message(scene, materials, how.shift);
    (message, device.events, device.ticks)
}

impl<'t, 'g, const D: usize> Device<'t, 'g, D> {
    fn new(
        scene: &'g Scene,
        materials: &'g Materials,
        buffers: &'t mut Buffers,
        replay: Replay,
    ) -> Self {
        let mut tiles = buffers.tiles().iter_mut();
        let mut next = || tiles.next().expect("there is one for every slot");
        let slots = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        let mut haptics = Haptics::new(slots, TickRate::DEFAULT, None);
        let message = message(scene, materials, replay.shift);
        haptics.set_materials(&materials.reported());
        assert!(matches!(haptics.accept(Command::Scene(message)), Ok(None)));
        let mut requester = TileRequester::new();
        requester.reset(0, message.size);
        let mut device = Self {
            haptics,
            requester,
            terrain: &scene.terrain,
            materials,
            replay,
            spare: tiles.collect(),
            requested: Vec::new(),
            now: 0,
            seq: 0,
            events: Vec::new(),
            ticks: Vec::new(),
        };
        if replay.supply == Supply::Preloaded {
            device.hold_all();
        }
        device
    }

    fn hold_all(&mut self) {
        let tiles = |axis: usize| {
            let shift = self.replay.shift[axis];
            shift >> 5..=(shift + self.terrain.size[axis] - 1) >> 5
        };
        let (cols, rows) = (tiles(0), tiles(1));
        assert!(cols.clone().count() <= D && rows.clone().count() <= D);
        for row in rows {
            for col in cols.clone() {
                let _ = self.send_tile(TileKey::new(0, col, row));
            }
        }
    }

    /// Sends a tile. Returns true if the loop accepted it.
    fn send_tile(&mut self, key: TileKey) -> bool {
        let tile = self.spare.pop().expect("as many spares as requests");
        let [dx, dy, dz] = self.replay.shift;
        let first = key.index.first_cell();
        let (x, y) = (first.x - dx, first.y - dy);
        tile.fill(key, dz, |col, row| {
            self.terrain.post(x + col as i32, y + row as i32)
        })
        .expect("the base is in range");
        let class = |i: usize| {
            let (col, row) = (i % TILE_SAMPLES, i / TILE_SAMPLES);
            self.materials.class(x + col as i32, y + row as i32)
        };
        let classes = (0..TILE_SAMPLES * TILE_SAMPLES).map(class);
        tile.set_materials(self.materials.table.len(), classes)
            .expect("of the table");
        self.events.push(Event::Tile(key));
        let spent = self.haptics.accept(Command::Tile(tile)).expect("a tile");
        let is_taken = spent.as_ref().is_none_or(|spent| spent.key() != Some(key));
        self.spare.extend(spent);
        is_taken
    }

    /// Runs ticks for one point until it is answered; `None` if it never is.
    fn step(&mut self, hip: GridPoint) -> Option<TickRecord> {
        let seq = self.seq;
        self.seq += 1;
        let _ = self.haptics.accept(Command::Hip(HipCommand { seq, hip }));
        let mut work = 0;
        for _ in 0..TIMEOUT {
            let outcome = self.haptics.tick(&GuardInputs::default(), true);
            self.note(hip, &outcome);
            work = outcome.sample.work.max(work);
            self.now += 1;
            self.supply(&outcome.sample);
            if outcome.answered_seq == Some(seq) {
                return Some(TickRecord {
                    work,
                    ..outcome.sample
                });
            }
        }
        None
    }

    fn note(&mut self, hip: GridPoint, outcome: &Outcome) {
        let TickRecord {
            state,
            work,
            force_n,
            proxy,
            ..
        } = outcome.sample;
        self.events.push(Event::Hip(hip));
        self.ticks.push(Counted {
            instructions: 0,
            cycles: Cycles::default(),
            state: state as u32,
            converged: outcome.answered_seq.is_some(),
            work,
            vector: force_n,
            proxy,
        });
    }

    /// Requests the tiles that the tick needs, and delivers those that are due.
    fn supply(&mut self, sample: &TickRecord) {
        let Supply::OnDemand { latency } = self.replay.supply else {
            return;
        };
        let hint = RequestHint {
            missing_tile: sample.missing_tile,
            proxy: sample.proxy.column(),
            hip: sample.hip.column(),
            velocity: [0.0; 2],
        };
        while let Some(key) = self.requester.next_request(self.now, &hint) {
            self.requested.push((self.now + latency, key));
        }
        let is_here = |(due, _): &(u32, TileKey)| *due <= self.now;
        let (here, requested) = self.requested.iter().partition(|one| is_here(one));
        self.requested = requested;
        let here: Vec<(u32, TileKey)> = here;
        for (_, key) in here {
            self.requester.received(key);
            if !self.send_tile(key) {
                self.requester.lost(key);
            }
        }
    }
}

/// Returns the scene as the device receives it.
fn message(scene: &Scene, materials: &Materials, shift: [i32; 3]) -> SceneMessage {
    let [columns, rows] = scene.terrain.size;
    SceneMessage {
        epoch: 1,
        level: 0,
        size: FieldSize::new(columns + shift[0], rows + shift[1]),
        top: scene.terrain.top() + shift[2],
        fallback: None,
        cell_mm: materials.cell_mm,
        home: GridPoint::default(),
        params: SurfaceParams {
            shading: scene.shading,
            ..materials.params
        },
        source: Source::Points,
        hold_clock: false,
        materials: Some(materials.reported().check_sum()),
    }
}
