//! parry3d's height field: a ray from the last HIP to this one while free,
//! the nearest point while in contact.

use parry3d::math::Vector;
use parry3d::query::{PointQuery, Ray, RayCast};
use parry3d::shape::HeightField;
use parry3d::utils::Array2;

use super::triangle::Facet;
use crate::grid::Grid;
use crate::variant::{ContactResult, Haptics, Hip};

/// Call that finds the nearest point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Project {
    /// `project_local_point`
    Anywhere,
    /// `project_local_point_with_max_dist`, with the last distance plus the HIP's motion as the
    /// limit.
    Within,
}

/// parry's shape, and its state between ticks.
pub struct Parry<'g> {
    grid: &'g Grid,
    field: HeightField,
    project: Project,
    hip: Option<Hip>,
    /// Distance from the HIP to the surface in contact.
    depth: Option<f32>,
    result: ContactResult,
}

impl<'g> Parry<'g> {
    /// Creates parry's own copy of a terrain.
    #[must_use]
    pub fn new(grid: &'g Grid, project: Project) -> Self {
        let (columns, rows) = (grid.columns + 1, grid.rows + 1);
        let mut heights = Array2::zeros(rows, columns);
        for row in 0..rows {
            for column in 0..columns {
                heights[(row, column)] = grid.post(column, row);
            }
        }
        let scale = Vector::new(grid.columns as f32, 1.0, grid.rows as f32);
        Self {
            grid,
            field: HeightField::new(heights, scale),
            project,
            hip: None,
            depth: None,
            result: ContactResult::FREE,
        }
    }

    /// Converts to parry's frame: y up, the origin in the middle of the field.
    #[inline]
    fn local(&self, [x, y, z]: [f32; 3]) -> Vector {
        Vector::new(
            x - 0.5 * self.grid.columns as f32,
            z,
            y - 0.5 * self.grid.rows as f32,
        )
    }

    /// Returns true if the path from the last HIP to this one is free.
    #[inline]
    fn is_free(&self, from: Vector, to: Vector) -> bool {
        let ray = Ray::new(from, to - from);
        self.field.cast_local_ray(&ray, 1.0, false).is_none()
    }

    /// Returns true if the HIP is below the triangles: parry has no call for this.
    #[inline]
    fn is_below(&self, hip: &Hip) -> bool {
        let facet = Facet::under(hip.wide[0], hip.wide[1]);
        self.grid.has(facet.cell) && facet.plane(self.grid).above(&hip.wide) > 0.0
    }

    #[inline]
    fn nearest(&self, hip: Vector, motion: f32) -> Option<Vector> {
        let projection = match (self.project, self.depth) {
            (Project::Within, Some(depth)) => {
                let reach = depth + motion + 1e-3;
                self.field
                    .project_local_point_with_max_dist(hip, false, reach)
            }
            _ => Some(self.field.project_local_point(hip, false)),
        };
        projection.map(|projection| projection.point)
    }
}

impl Haptics for Parry<'_> {
    fn reset(&mut self) {
        self.hip = None;
        self.depth = None;
        self.result = ContactResult::FREE;
    }

    #[inline]
    fn tick(&mut self, hip: &Hip) -> ContactResult {
        let Some(last) = self.hip.replace(*hip) else {
            return self.result;
        };
        if last.grid == hip.grid {
            return self.result;
        }
        let (from, to) = (self.local(last.single), self.local(hip.single));
        let touches = match self.depth {
            Some(_) => self.is_below(hip),
            None => !self.is_free(from, to) && self.is_below(hip),
        };
        let nearest = touches.then(|| self.nearest(to, (to - from).length()));
        self.result = match nearest.flatten() {
            Some(point) => {
                let displacement = point - to;
                self.depth = Some(displacement.length());
                ContactResult::touching([displacement.x, displacement.z, displacement.y])
            }
            None => {
                self.depth = None;
                ContactResult::FREE
            }
        };
        self.result
    }
}
