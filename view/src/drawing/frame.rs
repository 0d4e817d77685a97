//! A frame on the terrain around the hand, as on maps: its border, the coordinates of its corners,
//! and a scale bar of a round length.
//!
//! The frame is as large as the visible part, cut at the terrain's border. It is redrawn when the
//! hand leaves its middle, and after a change of the placement. In a live session only the latest
//! frame is kept; in a recording each has its time.

use anyhow::Result;
use hapterra_view_stream::{Sample, Scene};
use re_sdk_types::AsComponents;
use re_sdk_types::archetypes::{LineStrips3D, Points3D};
use re_sdk_types::components::Radius;

use super::captions;
use super::ground::Ground;
use super::layers::Layers;
use super::lengths::{distances, round_below, written};
use super::log::{Entry, Log};
use super::map::Map;
use super::shade::Rgb;

/// Maximum length of the bar, as a share of half of the visible size.
const BAR: f64 = 0.5;
/// Distance of the hand from the frame's border at which it leaves the middle, as a share of the
/// side. In a new frame the distance is 0.25 or more.
const MARGIN: f64 = 0.2;
/// Points along a side.
const POINTS: usize = 96;
/// Parts of the bar, light and dark.
const PARTS: usize = 4;
/// Height of border and bar over the surface, as a share of half of the visible size.
const FLOAT_SHARE: f64 = 0.008;
const LIGHT: Rgb = [255, 255, 255];
const DARK: Rgb = [20, 22, 28];

/// The current frame.
#[derive(Default)]
pub(super) struct Frame {
    square: Option<Square>,
}

/// A square on the ground, in the picture's units from the south-west sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Square {
    low: [f64; 2],
    side: f64,
    bar: f64,
}

impl Square {
    /// Creates the square around a position. Its side is a whole number of bars, so that it begins
    /// at a round distance.
    fn around(place: [f64; 2], near: f64) -> Option<Self> {
        let bar = round_below(BAR * near)?;
        let side = bar * (near / bar).round();
        let low = place.map(|at| ((at - 0.5 * side) / bar).round() * bar);
        Some(Self { low, side, bar })
    }

    /// Returns true if a position is in its middle.
    fn is_around(&self, place: [f64; 2]) -> bool {
        let inner = MARGIN * self.side..=(1.0 - MARGIN) * self.side;
        { place.iter().zip(self.low) }.all(|(at, low)| inner.contains(&(at - low)))
    }
}

impl Frame {
    /// Drops the frame, because the terrain or the placement has changed.
    pub(super) fn change(&mut self) {
        self.square = None;
    }

    /// Redraws the frame if the hand has left its middle. `ground` is of the current placement,
    /// `terrain` the one that is drawn.
    pub(super) fn take(
        &mut self,
        log: &Log,
        scene: &Scene,
        (ground, terrain): (&Ground, &Ground),
        (layers, map): (&Layers, &Map),
        samples: &[Sample],
    ) -> Result<Vec<Entry>> {
        let Some(sample) = samples.last() else {
            return Ok(Vec::new());
        };
        let [x, y, _] = sample.proxy_mm;
        let place = [x, y].map(|mm| mm * ground.per_mm);
        if { self.square.as_ref() }.is_some_and(|square| square.is_around(place)) {
            return Ok(Vec::new());
        }
        // Before the first layer there is no surface.
        let (Some(square), Some(extent)) = (Square::around(place, terrain.near), layers.extent())
        else {
            return Ok(Vec::new());
        };
        self.square = Some(square);
        let picture = Picture {
            scene,
            ground,
            terrain,
            layers,
            sides: square.cut(extent.map(|cells| terrain.step(cells))),
        };
        let entry = |entity: &str, what: &dyn AsComponents| match scene.is_live {
            true => log.log_static(entity, "", what),
            false => log.at(entity, sample.t_s, what),
        };
        let cells = picture.sides.map(|[west, south, east, north]| {
            [[west, south], [east, north]].map(|corner| terrain.cells(corner))
        });
        let mut entries = Vec::new();
        if let Some(visible) = map.visible_box(cells) {
            entries.push(entry("map/frame", &visible)?);
        }
        entries.extend([
            entry("frame/border", &picture.border())?,
            entry("frame/corners", &picture.corners())?,
            entry("frame/bar", &picture.bar(square.bar))?,
        ]);
        Ok(entries)
    }
}

impl Square {
    /// Returns the square's west, south, east and north side within others; `None` if nothing is
    /// left.
    fn cut(&self, [west, south, east, north]: [f64; 4]) -> Option<[f64; 4]> {
        let [x, y] = self.low;
        let cut = [
            x.max(west),
            y.max(south),
            (x + self.side).min(east),
            (y + self.side).min(north),
        ];
        (cut[0] < cut[2] && cut[1] < cut[3]).then_some(cut)
    }
}

/// Content of a frame.
struct Picture<'p> {
    scene: &'p Scene,
    ground: &'p Ground,
    terrain: &'p Ground,
    layers: &'p Layers,
    /// West, south, east and north side.
    sides: Option<[f64; 4]>,
}

impl Picture<'_> {
    fn float(&self) -> f32 {
        (FLOAT_SHARE * self.terrain.near) as f32
    }

    /// Returns a position of the surface in the picture; `None` for no-data.
    fn at(&self, place: [f64; 2]) -> Option<[f32; 3]> {
        let cell = self.terrain.cells(place);
        let up = self.layers.up_at(self.terrain, cell)?;
        Some(self.terrain.sample(cell, up + self.float()))
    }

    /// Returns the four sides on the surface, broken at no-data.
    fn border(&self) -> LineStrips3D {
        let mut strips = Vec::new();
        if let Some([west, south, east, north]) = self.sides {
            let corners = [[west, south], [east, south], [east, north], [west, north]];
            for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                let line: Vec<_> = between(*from, *to).map(|place| self.at(place)).collect();
                let parts = line.split(Option::is_none);
                strips.extend(
                    parts
                        .filter(|part| part.len() > 1)
                        .map(|part| part.iter().flatten().copied().collect::<Vec<_>>()),
                );
            }
        }
        LineStrips3D::new(strips)
            .with_colors([LIGHT])
            .with_radii([Radius::new_ui_points(0.8)])
    }

    /// Returns the south-west and north-east corner with their coordinates, and a label of the
    /// north side.
    fn corners(&self) -> Points3D {
        let mut points = Vec::new();
        if let Some([west, south, east, north]) = self.sides {
            let corners = [[west, south], [east, north]];
            let places = corners.map(|corner| (corner, self.coordinates(corner)));
            let is_north = ([0.5 * (west + east), north], "N".to_owned());
            let labelled = places.into_iter().chain([is_north]);
            points.extend(labelled.filter_map(|(place, text)| Some((self.at(place)?, text))));
        }
        let (places, texts): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        Points3D::new(places)
            .with_colors([LIGHT])
            .with_radii([Radius::new_ui_points(2.5)])
            .with_labels(texts)
            .with_show_labels(true)
    }

    /// Returns a position in the file's coordinates, or its distance from the south-west sample.
    fn coordinates(&self, place: [f64; 2]) -> String {
        let [x, y] = place.map(|at| at / self.ground.per_mm);
        captions::coordinates(self.scene, x, y)
            .unwrap_or_else(|| distances(place, self.is_on_ground()))
    }

    fn is_on_ground(&self) -> bool {
        self.scene.ground_m_per_mm.is_some()
    }

    /// Returns a level bar over the middle of the south side, alternately light and dark.
    fn bar(&self, longest: f64) -> LineStrips3D {
        let mut strips = Vec::new();
        let mut length = 0.0;
        if let Some([west, south, east, _]) = self.sides {
            // The side may be shorter after the cut.
            length = round_below(longest.min(east - west)).unwrap_or(longest);
            let middle = 0.5 * (west + east);
            let (from, to) = (
                [middle - 0.5 * length, south],
                [middle + 0.5 * length, south],
            );
            let highest = between(from, to)
                .filter_map(|place| self.at(place))
                .map(|[_, _, up]| up)
                .reduce(f32::max);
            let up = highest.unwrap_or(0.0) + self.float();
            let cut = |part: usize| {
                let at = from[0] + length * part as f64 / PARTS as f64;
                self.terrain.sample(self.terrain.cells([at, south]), up)
            };
            strips.extend((0..PARTS).map(|part| [cut(part), cut(part + 1)]));
        }
        let text = written(length, self.is_on_ground());
        LineStrips3D::new(strips)
            .with_colors((0..PARTS).map(|part| if part % 2 == 0 { LIGHT } else { DARK }))
            .with_radii([Radius::new_ui_points(3.5)])
            .with_labels([text])
            .with_show_labels(true)
    }
}

/// Returns positions from one to another.
fn between(from: [f64; 2], to: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    (0..=POINTS).map(move |i| {
        let share = i as f64 / POINTS as f64;
        [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_frame_has_the_hand_in_its_middle() {
        for near in [0.3, 1.0, 77.0, 313.0, 4200.0] {
            for i in 0..200 {
                let place = [0.173 * near * f64::from(i), -0.071 * near * f64::from(i)];
                let square = Square::around(place, near).expect("a frame");
                assert!(square.is_around(place), "{square:?} {place:?}");
                assert!((square.side / near - 1.0).abs() < 0.21, "{square:?} {near}");
                let bars = square.side / square.bar;
                assert!((bars - bars.round()).abs() < 1e-9, "{square:?}");
            }
        }
    }

    #[test]
    fn frame_is_cut_at_the_terrains_edge() {
        let square = Square {
            low: [-20.0, 30.0],
            side: 100.0,
            bar: 20.0,
        };
        assert_eq!(
            square.cut([0.0, 0.0, 60.0, 200.0]),
            Some([0.0, 30.0, 60.0, 130.0])
        );
        assert_eq!(square.cut([0.0, 0.0, 60.0, 20.0]), None);
    }
}
