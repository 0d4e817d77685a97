//! The part of the terrain on a map, and the map's size.

/// A rectangle on the map, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MapView {
    pub(super) west: f64,
    pub(super) south: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

/// Max finished pixels of a map.
pub(super) const MAP_PX: (f64, f64) = (1096.0, 800.0);
/// Share of the terrain's extent from which a path is shown on all of it.
const MIN_WHOLE_SHARE: f64 = 0.55;
/// A terrain of at most this many cells in each direction is always shown whole.
const SMALL_CELLS: f64 = 160.0;
/// Margin around a path, as a share of its extent.
const MARGIN: f64 = 0.25;
/// Min number of cells on a map.
const MIN_CELLS: f64 = 24.0;

impl MapView {
    const fn new(west: f64, south: f64, width: f64, height: f64) -> Self {
        Self {
            west,
            south,
            width,
            height,
        }
    }

    /// Returns the whole of a terrain.
    pub(super) fn whole(size_mm: [f64; 2]) -> Self {
        Self::new(0.0, 0.0, size_mm[0], size_mm[1])
    }

    /// Returns the smallest rectangle around points; `None` without any.
    pub(super) fn around(points: impl Iterator<Item = [f64; 2]>) -> Option<Self> {
        let finite = points.filter(|p| p.iter().all(|v| v.is_finite()));
        let (low, high) = finite.fold(None, |bounds, p| {
            let (low, high) = bounds.unwrap_or((p, p));
            let low = [f64::min(low[0], p[0]), f64::min(low[1], p[1])];
            Some((low, [f64::max(high[0], p[0]), f64::max(high[1], p[1])]))
        })?;
        Some(Self::new(
            low[0],
            low[1],
            high[0] - low[0],
            high[1] - low[1],
        ))
    }

    /// Chooses the view for a path on a terrain: all of it if it is small or the path is long,
    /// otherwise the path with a margin, in the map's proportions and inside the terrain.
    pub(super) fn choose(path: Option<Self>, size_mm: [f64; 2], cell_mm: f64) -> Self {
        let whole = Self::whole(size_mm);
        let Some(path) = path else {
            return whole;
        };
        let small = whole.width.max(whole.height) <= SMALL_CELLS * cell_mm;
        let far = path.width > MIN_WHOLE_SHARE * whole.width
            || path.height > MIN_WHOLE_SHARE * whole.height;
        if small || far {
            return whole.union(path);
        }
        let room = |extent: f64| (extent * (1.0 + MARGIN)).max(MIN_CELLS * cell_mm);
        let (width, height) = (room(path.width), room(path.height));
        let aspect = MAP_PX.0 / MAP_PX.1;
        let (width, height) = (width.max(height * aspect), height.max(width / aspect));
        let (west, width) = inside(path.west + 0.5 * path.width, width, whole.width);
        let (south, height) = inside(path.south + 0.5 * path.height, height, whole.height);
        Self::new(west, south, width, height).union(path)
    }

    /// Returns the finished pixels of the map: the largest that fit, true to scale.
    pub(super) fn map_px(&self) -> (i32, i32) {
        let scale = (MAP_PX.0 / self.width).min(MAP_PX.1 / self.height);
        let pixels = |extent: f64| ((extent * scale).round() as i32).max(40);
        (pixels(self.width), pixels(self.height))
    }

    pub(super) fn shows_all(&self, size_mm: [f64; 2]) -> bool {
        self.width >= size_mm[0] && self.height >= size_mm[1]
    }

    fn union(self, other: Self) -> Self {
        let west = self.west.min(other.west);
        let south = self.south.min(other.south);
        let east = (self.west + self.width).max(other.west + other.width);
        let north = (self.south + self.height).max(other.south + other.height);
        Self::new(west, south, east - west, north - south)
    }
}

/// Returns the start and length of an interval around `centre`, moved or cut to lie between zero
/// and `limit`.
fn inside(centre: f64, length: f64, limit: f64) -> (f64, f64) {
    let length = length.min(limit);
    ((centre - 0.5 * length).clamp(0.0, limit - length), length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(west: f64, south: f64, width: f64, height: f64) -> Option<MapView> {
        Some(MapView {
            west,
            south,
            width,
            height,
        })
    }

    #[test]
    fn small_terrain_or_long_path_is_shown_completely() {
        let all = MapView::whole([100.0, 80.0]);
        assert_eq!(
            MapView::choose(path(40., 40., 3., 3.), [100., 80.], 1.0),
            all
        );
        let all = MapView::whole([1000.0, 800.0]);
        assert_eq!(
            MapView::choose(path(10., 40., 900., 3.), [1000., 800.], 1.0),
            all
        );
        assert_eq!(MapView::choose(None, [1000.0, 800.0], 1.0), all);
    }

    #[test]
    fn view_of_short_corner_path_is_inside_the_terrain() {
        let view = MapView::choose(path(2., 3., 80., 40.), [10_000., 6000.], 1.0);
        assert_eq!((view.west, view.south), (0.0, 0.0));
        assert!(view.width >= 100.0 && view.width < 140.0, "{view:?}");
        let aspect = view.width / view.height;
        assert!((aspect - MAP_PX.0 / MAP_PX.1).abs() < 1e-9);
        assert!(!view.shows_all([10_000.0, 6000.0]));
    }

    #[test]
    fn path_off_the_data_is_in_view() {
        let view = MapView::choose(path(-30., 10., 20., 20.), [1000., 800.], 1.0);
        assert!(view.west <= -30.0 && view.map_px().0 >= 40);
    }
}
