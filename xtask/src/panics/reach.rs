//! Nodes that can be reached from one node of a graph, and the paths to them.

/// The reached nodes, nearest first, each with the index in this list of the node from which it was
/// first reached; the root has none.
#[derive(Debug)]
pub(crate) struct Reached(Vec<(usize, Option<usize>)>);

/// Returns all nodes that can be reached from `root`.
pub(crate) fn from(root: usize, callees: impl Fn(usize) -> Vec<usize>) -> Reached {
    let mut reached = vec![(root, None)];
    let mut place = 0;
    while let Some(&(node, _)) = reached.get(place) {
        for callee in callees(node) {
            if reached.iter().all(|(known, _)| *known != callee) {
                reached.push((callee, Some(place)));
            }
        }
        place += 1;
    }
    Reached(reached)
}

impl Reached {
    /// Returns all nodes, nearest first.
    pub(crate) fn all(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.0.iter().map(|(node, _)| *node)
    }

    /// Returns the shortest path from the root to `node`, including both; empty if it was not
    /// reached.
    pub(crate) fn chain(&self, node: usize) -> Vec<usize> {
        let last = self.0.iter().position(|(known, _)| *known == node);
        let places = std::iter::successors(last, |place| self.0[*place].1);
        let mut chain: Vec<_> = places.map(|place| self.0[place].0).collect();
        chain.reverse();
        chain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reach_stops_at_loops_and_keeps_the_shortest_chain() {
        let graph: [&[usize]; 5] = [&[1, 2], &[2, 0], &[3], &[0], &[0]];
        let reached = from(0, |n| graph[n].to_vec());
        assert_eq!(reached.all().collect::<Vec<_>>(), [0, 1, 2, 3]);
        assert_eq!(reached.chain(3), [0, 2, 3]);
        assert_eq!(reached.chain(0), [0]);
        assert!(reached.chain(4).is_empty());
    }
}
