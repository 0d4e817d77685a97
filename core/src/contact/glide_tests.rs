use super::super::descent::Leave;
use super::super::dice::{Dice, wander};
use super::super::proxy::{Contact, Phase};
use super::super::{Pace, Rule};
use crate::grid::GridPoint;
use crate::terrain::testing::Field;
use glam::Vec3;

const SIZE: i32 = 60;
/// An interpreter takes seconds for a few hundred.
const TICKS: u32 = if cfg!(miri) { 60 } else { 40_000 };

/// Heights without any order, up to so many cells.
fn noise(x: i32, y: i32, most: f64) -> f32 {
    let seed = (x as u64 + 1) * 0x9E37_79B9 + (y as u64 + 1) * 0x85EB_CA77_C2B2;
    let mut dice = Dice(seed);
    dice.unit();
    dice.between(0.0, most) as f32
}

/// The hand half a cell a tick this way and that, under the heights around it.
fn hands(ground: impl Fn(i32, i32) -> f32) -> impl Iterator<Item = GridPoint> {
    let mut depths = Dice(62);
    wander(Dice(61), TICKS, SIZE, 0.5, 0.3).map(move |at| {
        let cell = at.map(|x| x as i32);
        let low = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| ground(cell[0] + x, cell[1] + y));
        let low = low.into_iter().fold(f32::INFINITY, f32::min);
        let [x, y] = [0, 1].map(|i| (at[i] - at[i].floor()) as f32);
        let depth = depths.between(0.0, 0.5) as f32;
        GridPoint::new([cell[0], cell[1], 0], Vec3::new(x, y, low - depth))
    })
}

/// Ticks that ended elsewhere than the general search ends, of those that went
/// over a corner quickly, and how many of these there were.
fn beside(most: f64) -> [u32; 2] {
    let ground = move |x, y| noise(x, y, most);
    let field = Field::<2>::held([SIZE; 2], ground);
    let mut contact = Contact::new();
    let step = |contact: &mut Contact, hand: &GridPoint| {
        *contact.step(&field.window, hand, Rule::Swept, Pace::LockStep)
    };
    let above = GridPoint::new([30, 30, 9], Vec3::ZERO);
    step(&mut contact, &above);
    let (mut over, mut elsewhere) = (0, 0);
    for hand in hands(ground) {
        let mut general = contact.clone();
        let Phase::Following(track) = &contact.phase else {
            step(&mut contact, &hand);
            continue;
        };
        let (spot, leave) = (track.spot, Leave::Anywhere);
        general.phase = Phase::Touching { spot, leave };
        let there = step(&mut general, &hand);
        let here = step(&mut contact, &hand);
        let Phase::Following(track) = &contact.phase else {
            continue;
        };
        let [east, north] = [0, 1].map(|i| track.spot.cell[i] - spot.cell[i]);
        let quick = here.work <= 12;
        if quick && east != 0 && north != 0 && there.settled {
            over += 1;
            elsewhere += u32::from(here.proxy.to(&there.proxy).length() > 1e-5);
        }
    }
    [over, elsewhere]
}

#[test]
fn over_a_corner_it_ends_where_the_general_search_ends() {
    for most in [0.1, 0.3, 1.0] {
        let [over, elsewhere] = beside(most);
        assert!(over >= TICKS / 1000, "{most}: {over}");
        assert_eq!(elsewhere, 0, "{most}: of {over}");
    }
}
