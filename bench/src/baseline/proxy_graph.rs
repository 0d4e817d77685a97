//! The proxy graph (Walker & Salisbury 2003): in contact the proxy lies only on edges and vertices
//! of the triangulated field, and moves from one to the next while that leads nearer to the HIP.

use super::triangle::Facet;
use crate::grid::Grid;
use crate::variant::{ContactResult, Haptics, Hip};

/// Most moves in one tick.
const MOVES: u32 = 4096;

/// A node: a point on an edge; the ends of the edge are vertices.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Sample at the start of the edge.
    post: [i32; 2],
    /// Direction of the edge: east, north or north-west, or back.
    to: [i32; 2],
    /// Position on it, `[0, 1]`.
    t: f64,
    displacement: [f64; 3],
    squared: f64,
}

/// The six edges at a vertex, counter-clockwise.
const SPOKES: [[i32; 2]; 6] = [[1, 0], [0, 1], [-1, 1], [-1, 0], [0, -1], [1, -1]];

/// The algorithm's state.
pub struct ProxyGraph<'g> {
    grid: &'g Grid,
    hip: Option<[f64; 3]>,
    node: Option<Node>,
    result: ContactResult,
}

impl<'g> ProxyGraph<'g> {
    /// Creates the algorithm on a terrain.
    #[must_use]
    pub const fn new(grid: &'g Grid) -> Self {
        Self {
            grid,
            hip: None,
            node: None,
            result: ContactResult::FREE,
        }
    }

    #[inline]
    fn post(&self, [x, y]: [i32; 2]) -> Option<f64> {
        let inside =
            (x as u32 as usize) <= self.grid.columns && (y as u32 as usize) <= self.grid.rows;
        inside.then(|| f64::from(self.grid.post(x as usize, y as usize)))
    }

    /// Returns the nearest point of one edge.
    #[inline]
    fn on_edge(&self, post: [i32; 2], to: [i32; 2], hip: &[f64; 3]) -> Option<Node> {
        let end = [post[0] + to[0], post[1] + to[1]];
        let (low, high) = (self.post(post)?, self.post(end)?);
        let (dx, dy, dz) = (f64::from(to[0]), f64::from(to[1]), high - low);
        let from = [
            f64::from(post[0]) - hip[0],
            f64::from(post[1]) - hip[1],
            low - hip[2],
        ];
        let along = -(from[0] * dx + from[1] * dy + from[2] * dz);
        let t = (along / (dx * dx + dy * dy + dz * dz)).clamp(0.0, 1.0);
        let displacement = [from[0] + t * dx, from[1] + t * dy, from[2] + t * dz];
        Some(Node {
            post,
            to,
            t,
            displacement,
            squared: displacement.iter().map(|x| x * x).sum(),
        })
    }

    /// Returns the nearest point on the edges within one move: all edges at a vertex, or the other
    /// two of each triangle with this edge.
    #[inline]
    fn nearer(&self, node: &Node, hip: &[f64; 3]) -> Option<Node> {
        let mut best = *node;
        let mut visit = |post: [i32; 2], to: [i32; 2]| {
            if let Some(there) = self.on_edge(post, to, hip)
                && there.squared < best.squared * (1.0 - 1e-12)
            {
                best = there;
            }
        };
        let end = [node.post[0] + node.to[0], node.post[1] + node.to[1]];
        if node.t == 0.0 || node.t == 1.0 {
            let vertex = if node.t == 0.0 { node.post } else { end };
            for spoke in SPOKES {
                visit(vertex, spoke);
            }
        } else {
            let turn = SPOKES.iter().position(|s| *s == node.to).unwrap_or(0);
            for side in [1, 5] {
                let third = SPOKES[(turn + side) % 6];
                visit(node.post, third);
                visit(end, [third[0] - node.to[0], third[1] - node.to[1]]);
            }
        }
        (best.squared < node.squared).then_some(best)
    }

    #[inline]
    fn descend(&self, mut node: Node, hip: &[f64; 3]) -> Node {
        for _ in 0..MOVES {
            match self.nearer(&node, hip) {
                Some(next) => node = next,
                None => break,
            }
        }
        node
    }

    /// Returns the height of the triangles above the HIP.
    #[inline]
    fn depth(&self, hip: &[f64; 3]) -> Option<f64> {
        let facet = Facet::under(hip[0], hip[1]);
        let has_data = self.grid.has(facet.cell);
        has_data.then(|| facet.plane(self.grid).above(hip))
    }
}

impl Haptics for ProxyGraph<'_> {
    fn reset(&mut self) {
        self.hip = None;
        self.node = None;
        self.result = ContactResult::FREE;
    }

    #[inline]
    fn tick(&mut self, hip: &Hip) -> ContactResult {
        let hip = hip.wide;
        if self.hip.replace(hip) == Some(hip) {
            return self.result;
        }
        if self.depth(&hip).is_none_or(|depth| depth <= 0.0) {
            self.node = None;
            self.result = ContactResult::FREE;
            return self.result;
        }
        let start = match &self.node {
            Some(node) => self.on_edge(node.post, node.to, &hip),
            None => self.on_edge([hip[0] as i32, hip[1] as i32], SPOKES[0], &hip),
        };
        self.node = start.map(|start| self.descend(start, &hip));
        self.result = self.node.map_or(ContactResult::FREE, |node| {
            ContactResult::touching(node.displacement.map(|x| x as f32))
        });
        self.result
    }
}
