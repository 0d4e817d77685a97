//! What can be reached from one node of a graph, and on which way.

use std::collections::VecDeque;

/// The nodes reached, each with the node it was first reached from.
#[derive(Debug)]
pub(crate) struct Reached {
    order: Vec<usize>,
    /// By node: none where it was not reached; the root is its own parent.
    parents: Vec<Option<usize>>,
}

/// Everything reachable from `root`, nearest first.
pub(crate) fn from(root: usize, callees: impl Fn(usize) -> Vec<usize>) -> Reached {
    let mut parents = vec![];
    let mut order = vec![];
    let mut next = VecDeque::from([(root, root)]);
    while let Some((node, parent)) = next.pop_front() {
        if parents.len() <= node {
            parents.resize(node + 1, None);
        }
        if parents[node].is_some() {
            continue;
        }
        parents[node] = Some(parent);
        order.push(node);
        next.extend(callees(node).into_iter().map(|callee| (callee, node)));
    }
    Reached { order, parents }
}

impl Reached {
    /// All nodes, nearest first.
    pub(crate) fn all(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.order.iter().copied()
    }

    /// The node from which `node` was first reached; none for the root.
    fn parent(&self, node: usize) -> Option<usize> {
        self.parents[node].filter(|&parent| parent != node)
    }

    /// The way from the root to `node`, both included.
    pub(crate) fn chain(&self, node: usize) -> Vec<usize> {
        let mut chain: Vec<_> = std::iter::successors(Some(node), |&n| self.parent(n)).collect();
        chain.reverse();
        chain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_ends_and_the_shortest_way_is_kept() {
        let graph: [&[usize]; 5] = [&[1, 2], &[2, 0], &[3], &[0], &[0]];
        let reached = from(0, |n| graph[n].to_vec());
        assert_eq!(reached.all().collect::<Vec<_>>(), [0, 1, 2, 3]);
        assert_eq!(reached.chain(3), [0, 2, 3]);
        assert_eq!(reached.parent(0), None);
    }
}
