//! Names beside their marks, without overlap of names or of marks of the same kind.

/// A rectangle of the drawing: left, top, right, bottom.
pub(super) type Rect = [i32; 4];

/// A mark that needs a name, with the name's size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Named {
    /// Middle of the mark.
    pub(super) at: (i32, i32),
    /// Radius of the mark.
    pub(super) radius: i32,
    /// Width and height of the name.
    pub(super) size: (i32, i32),
}

impl Named {
    fn mark(&self) -> Rect {
        let ((x, y), r) = (self.at, self.radius);
        [x - r, y - r, x + r, y + r]
    }

    /// Returns the possible places of the name: right of the mark, left of it, and beside it
    /// farther and farther down and up.
    fn places(&self, gap: i32) -> impl Iterator<Item = Rect> + use<> {
        let ((x, y), (width, height)) = (self.at, self.size);
        let offset = self.radius + gap;
        let rows = (0..60).flat_map(move |i| [i * gap, -i * gap]);
        rows.flat_map(move |down| {
            let top = y + down - height / 2;
            let at = move |left: i32| [left, top, left + width, top + height];
            [at(x + offset), at(x - offset - width)]
        })
    }
}

/// Returns the left ends and tops of the names: inside `frame`, over no name and no mark, and over
/// as few of the `dots` as nearby places allow.
pub(super) fn place(named: &[Named], dots: &[Rect], frame: Rect, gap: i32) -> Vec<(i32, i32)> {
    let marks: Vec<Rect> = named.iter().map(Named::mark).collect();
    let mut placed: Vec<Rect> = Vec::new();
    for own in named {
        let free: Vec<Rect> = own
            .places(gap)
            .filter(|place| is_inside(place, &frame))
            .filter(|place| {
                !marks
                    .iter()
                    .chain(&placed)
                    .any(|other| overlap(place, other))
            })
            .take(8)
            .collect();
        let hidden = |place: &&Rect| dots.iter().filter(|dot| overlap(place, dot)).count();
        let best = free.iter().min_by_key(hidden).copied();
        // Without any room in the frame, the name overlaps.
        placed.push(best.or_else(|| own.places(gap).next()).unwrap_or_default());
    }
    placed.iter().map(|[left, top, ..]| (*left, *top)).collect()
}

fn is_inside(a: &Rect, frame: &Rect) -> bool {
    a[0] >= frame[0] && a[1] >= frame[1] && a[2] <= frame[2] && a[3] <= frame[3]
}

fn overlap(a: &Rect, b: &Rect) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Random;

    const FRAME: Rect = [0, 0, 1800, 1200];

    fn rect(named: &Named, (left, top): (i32, i32)) -> Rect {
        [left, top, left + named.size.0, top + named.size.1]
    }

    #[test]
    fn single_name_is_placed_right_of_its_mark() {
        let own = Named {
            at: (100, 100),
            radius: 14,
            size: (200, 40),
        };
        assert_eq!(place(&[own], &[], FRAME, 12), [(126, 80)]);
    }

    #[test]
    fn crowded_labels_overlap_no_other_label_or_mark() {
        let mut random = Random(3);
        for _ in 0..200 {
            let named: Vec<Named> = (0..9)
                .map(|_| Named {
                    at: (
                        random.between(600.0, 1000.0) as i32,
                        random.between(500.0, 620.0) as i32,
                    ),
                    radius: 14,
                    size: (random.between(100.0, 420.0) as i32, 40),
                })
                .collect();
            let places = place(&named, &[], FRAME, 12);
            let names: Vec<Rect> = named
                .iter()
                .zip(places)
                .map(|(n, at)| rect(n, at))
                .collect();
            for (i, name) in names.iter().enumerate() {
                assert!(is_inside(name, &FRAME));
                assert!(named.iter().all(|own| !overlap(name, &own.mark())));
                assert!(names[..i].iter().all(|other| !overlap(name, other)));
            }
        }
    }
}
