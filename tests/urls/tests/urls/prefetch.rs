//! Blocks ahead of the hand are requested before their tiles.

use std::time::Duration;

use hapterra::link::{Client, Timeouts};
use hapterra::terrain::{Scale, Terrain, TileBuffer};
use hapterra_core::Vec3;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{SceneChange, Source};
use hapterra_core::terrain::TileKey;
use hapterra_tests::timeouts::{pass, wait_until};
use hapterra_url_tests::cog::cog;
use hapterra_url_tests::http::Server;
use heightfield::{OpenOptions, Raster};

/// Requests for two adjacent tiles, and for the surroundings of a HIP: runs of pages, by the layout
/// of the file.
const TWO_TILES_REQUESTS: usize = 1;
const VIEW_REQUESTS: usize = 1;

fn height(column: u32, row: u32) -> f32 {
    (column % 100) as f32 + 0.5 * (row % 64) as f32
}

fn hills() -> (tempfile::TempDir, Raster, Server) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("hills.tif");
    std::fs::write(&path, cog(4200, 1800, 3, height)).expect("written");
    let server = Server::of(folder.path());
    let raster = Raster::open(server.url("hills.tif"), &OpenOptions::default());
    (folder, raster.expect("opens"), server)
}

/// Returns true if all of a tile has arrived.
fn is_loaded(terrain: &Terrain<'_>, key: TileKey) -> bool {
    let mut buffer = TileBuffer::default();
    let (_, status) = terrain.tile(key, &mut buffer).expect("there is one");
    status.is_complete()
}

fn terrain(raster: &Raster) -> Terrain<'_> {
    let scale = Scale::new(1.0, 0.05).expect("a scale");
    let terrain = Terrain::new(raster, scale, 0).expect("a terrain");
    terrain.non_blocking()
}

/// Returns the number of requests up to now.
fn requests(server: &Server) -> usize {
    server.log().0.len()
}

/// Returns the number of requests up to now, after time for unwanted ones.
fn requests_later(server: &Server) -> usize {
    pass(Duration::from_millis(100));
    requests(server)
}

#[test]
fn tiles_read_ahead_need_no_request() {
    let (_folder, raster, server) = hills();
    let terrain = terrain(&raster);
    let keys = [TileKey::new(0, 60, 20), TileKey::new(0, 61, 20)];
    let opened = requests(&server);
    // It must not wait: the server holds its answers back forever.
    server.hold(true);
    terrain.grid().prefetch(0, [1920, 640], [1984, 672]);
    let ahead = opened + TWO_TILES_REQUESTS;
    wait_until("requests ahead", || requests(&server) >= ahead);
    server.hold(false);
    for key in keys {
        wait_until("a tile", || is_loaded(&terrain, key));
    }
    assert_eq!(
        requests(&server),
        ahead,
        "the tiles caused no further request"
    );
    // The whole field, or an area outside it, is not prefetched.
    terrain.grid().prefetch(0, [0, 0], [4200, 1800]);
    assert_eq!(requests_later(&server), ahead);
    terrain.grid().prefetch(0, [-900, -900], [-800, -800]);
    terrain.grid().prefetch(0, [i32::MIN; 2], [i32::MAX; 2]);
    terrain.grid().prefetch(40, [i32::MAX; 2], [i32::MIN; 2]);
}

/// While the clutch is open, blocks of the next placement are fetched before any tile request.
#[test]
fn next_placement_is_prefetched_around_the_hip() {
    let (_folder, raster, server) = hills();
    let terrain = terrain(&raster);
    let at = |east| GridPoint::new([east, 640, 100], Vec3::ZERO);
    let scene = terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, at(640));
    let mut client = Client::numbered(&terrain, scene, None, Timeouts::REAL_TIME, 1);
    let before = requests(&server);
    server.hold(true);
    let view = SceneChange {
        number: 1,
        scene,
        hip: at(3500),
        keeps_tiles: true,
        in_contact: None,
    };
    client.put_view(Duration::ZERO, view, terrain.clone(), &mut vec![]);
    let after = before + VIEW_REQUESTS;
    wait_until("requests around the HIP", || requests(&server) >= after);
    server.hold(false);
    wait_until("the tile at the HIP", || {
        is_loaded(&terrain, TileKey::new(0, 3500 / 32, 20))
    });
    assert_eq!(
        requests_later(&server),
        after,
        "the tile causes no further request"
    );
}

/// `cargo test -p hapterra-url-tests --test urls prefetch -- --ignored --nocapture`: counts checks, one
/// every 10 ms along 3000 cells, without the tile under the HIP; answers take 100 ms.
#[test]
#[ignore = "it prints figures, for as long as the hand moves"]
fn benchmark_counts_missing_tiles_at_100_ms_latency() {
    println!("cells/s  without  ahead  of looks");
    for speed in [200, 500, 1000, 2000] {
        let counts = [false, true].map(|reads_ahead| {
            let (_folder, raster, server) = hills();
            let terrain = terrain(&raster);
            server.set_latency(Duration::from_millis(100));
            let reads = 3000 * 100 / speed;
            let cells = |read_all: i32| 40 + read_all * speed / 100;
            let missing = (0..reads).filter(|read_all| {
                pass(Duration::from_millis(10));
                let (at, ahead) = (cells(*read_all), cells(*read_all + 50));
                if reads_ahead {
                    let edge = |cell: i32| cell / 32 * 32;
                    let to = [edge(ahead) + 32, 672];
                    terrain.grid().prefetch(0, [edge(at), 640], to);
                }
                !is_loaded(&terrain, TileKey::new(0, at / 32, 20))
            });
            (missing.count(), reads)
        });
        let [(without, reads), (ahead, _)] = counts;
        println!("{speed:7}  {without:7}  {ahead:5}  {reads:8}");
    }
}
